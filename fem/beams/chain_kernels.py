"""Symmetric block-tridiagonal matrices of 6 × 6 blocks along a chain, compiled.

With diagonal blocks Dᵢ and upper ones Eᵢ the elimination from the start leaves Sᵢ = Dᵢ − Eᵢ₋₁ᵀ Sᵢ₋₁⁻¹ Eᵢ₋₁; kept are
Sᵢ⁻¹ and Uᵢ = Sᵢ⁻¹ Eᵢ. The blocks of the inverse on the diagonal are Zᵢ = Sᵢ⁻¹ + Uᵢ Zᵢ₊₁ Uᵢᵀ, and above it
Zᵢⱼ = −Uᵢ Zᵢ₊₁,ⱼ (Takahashi, Fagan and Chen 1973), so that an entry of H A⁻¹ Hᵀ costs no solve over the whole chain.
Oracle: PETSc's SeqBAIJ LU.
"""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]
Bools = NDArray[np.bool_]

Six = tuple[float, float, float, float, float, float]

DEFINITE, INDEFINITE = -1, -2
ZERO = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0)


@njit(cache=True)
def hold(diagonal: Floats, upper: Floats, fixed: Bools) -> None:
    """Unit rows and columns, on the scale of the largest diagonal entry, at fixed unknowns (6 N); overwrites both."""
    scale = 0.0
    for i in range(len(diagonal)):
        for a in range(6):
            scale = max(scale, abs(diagonal[i, a, a]))
    for i in range(len(diagonal)):
        for a in range(6):
            if not fixed[6 * i + a]:
                continue
            for b in range(6):
                diagonal[i, a, b] = diagonal[i, b, a] = 0.0
                if i > 0:
                    upper[i - 1, b, a] = 0.0
                if i < len(upper):
                    upper[i, a, b] = 0.0
            diagonal[i, a, a] = scale


@njit(cache=True)
def _invert(S: Floats, X: Floats) -> bool:
    """X ← S⁻¹ by Gauss–Jordan elimination with row pivots; overwrites S, False where it is singular."""
    for a in range(6):
        for b in range(6):
            X[a, b] = 0.0
        X[a, a] = 1.0
    for k in range(6):
        p = k
        for a in range(k + 1, 6):
            if abs(S[a, k]) > abs(S[p, k]):
                p = a
        if S[p, k] == 0.0 or not np.isfinite(S[p, k]):
            return False
        if p != k:
            for b in range(6):
                S[k, b], S[p, b] = S[p, b], S[k, b]
                X[k, b], X[p, b] = X[p, b], X[k, b]
        f = 1.0 / S[k, k]
        for b in range(6):
            S[k, b] *= f
            X[k, b] *= f
        for a in range(6):
            g = S[a, k]
            if a != k and g != 0.0:
                for b in range(6):
                    S[a, b] -= g * S[k, b]
                    X[a, b] -= g * X[k, b]
    return True


@njit(cache=True, fastmath={"contract"}, forceinline=True)
def _plus(six: Six, f: float, A: Floats, c: int) -> Six:
    """Six numbers, and f times row c of A: they stay in registers."""
    return (
        six[0] + f * A[c, 0],
        six[1] + f * A[c, 1],
        six[2] + f * A[c, 2],
        six[3] + f * A[c, 3],
        six[4] + f * A[c, 4],
        six[5] + f * A[c, 5],
    )


@njit(cache=True, fastmath={"contract"}, forceinline=True)
def _along(A: Floats, a: int, x: Six) -> float:
    """Row a of A times six numbers."""
    product: float = A[a, 0] * x[0] + A[a, 1] * x[1] + A[a, 2] * x[2] + A[a, 3] * x[3] + A[a, 4] * x[4] + A[a, 5] * x[5]
    return product


@njit(cache=True, forceinline=True)
def _put(A: Floats, a: int, six: Six) -> None:
    """Six numbers into row a of A."""
    A[a, 0], A[a, 1], A[a, 2], A[a, 3], A[a, 4], A[a, 5] = six


@njit(cache=True, fastmath={"contract"}, forceinline=True)
def _lower(S: Floats, L: Floats) -> bool:
    """L ← L⁻¹ of the Cholesky factor of S, lower; False where S is not positive definite."""
    for a in range(6):
        for b in range(a + 1):
            total = S[a, b]
            for c in range(b):
                total -= L[a, c] * L[b, c]
            if a == b:
                if not total > 0.0:
                    return False
                L[a, a] = 1.0 / np.sqrt(total)
            else:
                L[a, b] = total * L[b, b]
    for b in range(6):
        for a in range(b + 1, 6):
            total = 0.0
            for c in range(b, a):
                total -= L[a, c] * L[c, b]
            L[a, b] = total * L[a, a]
    return True


@njit(cache=True, fastmath={"contract"})
def factor(diagonal: Floats, upper: Floats, inverse: Floats, ratio: Floats) -> int:
    """Sᵢ⁻¹ (N, 6, 6) and Uᵢ (N − 1, 6, 6) into `inverse` and `ratio`.

    Returns `DEFINITE`, `INDEFINITE` or the first singular node.

    Where S = LLᵀ is positive definite, S⁻¹ = L⁻ᵀL⁻¹ and the next D − YᵀY, Y = L⁻¹E, are formed from L, which keeps the
    digits that a product with the inverse loses; elsewhere by elimination with pivots.
    """
    S, L, Y = diagonal[0].copy(), np.zeros((6, 6)), np.zeros((6, 6))
    last, verdict = len(diagonal) - 1, DEFINITE
    for i in range(last + 1):
        X = inverse[i]
        if _lower(S, L):
            for a in range(6):
                six = ZERO
                for c in range(a, 6):
                    six = _plus(six, L[c, a], L, c)
                _put(X, a, six)
            if i == last:
                break
            E, U, D = upper[i], ratio[i], diagonal[i + 1]
            for a in range(6):
                six = ZERO
                for c in range(a + 1):
                    six = _plus(six, L[a, c], E, c)
                _put(Y, a, six)
            for a in range(6):
                six = ZERO
                for c in range(a, 6):
                    six = _plus(six, L[c, a], Y, c)
                _put(U, a, six)
            for a in range(6):
                six = _plus(ZERO, 1.0, D, a)
                for c in range(6):
                    six = _plus(six, -Y[c, a], Y, c)
                _put(S, a, six)
            continue
        verdict = INDEFINITE
        if not _invert(S, X):
            return i
        if i == last:
            break
        E, U, D = upper[i], ratio[i], diagonal[i + 1]
        for a in range(6):
            six = ZERO
            for c in range(6):
                six = _plus(six, X[a, c], E, c)
            _put(U, a, six)
        for a in range(6):
            for b in range(a, 6):
                total = D[a, b]
                for c in range(6):
                    total -= E[c, a] * U[c, b]
                S[a, b] = S[b, a] = total
    return verdict


@njit(cache=True, fastmath={"contract"})
def solve(inverse: Floats, ratio: Floats, fixed: Bools, B: Floats) -> Floats:
    """A⁻¹ B for k right-hand sides stored one after the other (k, 6 N), zero at fixed unknowns (6 N)."""
    N = len(inverse)
    X = B.copy()
    blocks = X.reshape(len(B), N, 6)
    for j in range(len(B)):
        rows = blocks[j]  # by its number, as an item of an iteration it is not known to be contiguous
        for i in range(N):
            for a in range(6):
                if fixed[6 * i + a]:
                    rows[i, a] = 0.0
        six = _plus(ZERO, 1.0, rows, 0)
        for i in range(1, N):
            U, above = ratio[i - 1], six
            six = _plus(ZERO, 1.0, rows, i)
            six = _plus(_plus(_plus(six, -above[0], U, 0), -above[1], U, 1), -above[2], U, 2)
            six = _plus(_plus(_plus(six, -above[3], U, 3), -above[4], U, 4), -above[5], U, 5)
            _put(rows, i, six)
        for i in range(N - 1, -1, -1):
            S, below = inverse[i], six
            six = ZERO
            for c in range(6):
                six = _plus(six, rows[i, c], S, c)
            if i + 1 < N:
                U = ratio[i]
                six = (
                    six[0] - _along(U, 0, below),
                    six[1] - _along(U, 1, below),
                    six[2] - _along(U, 2, below),
                    six[3] - _along(U, 3, below),
                    six[4] - _along(U, 4, below),
                    six[5] - _along(U, 5, below),
                )
            _put(rows, i, six)
    return X


@njit(cache=True, fastmath={"contract"})
def diagonal_of_inverse(inverse: Floats, ratio: Floats) -> Floats:
    """Zᵢ = (A⁻¹)ᵢᵢ, (N, 6, 6)."""
    N = len(inverse)
    Z = inverse.copy()
    T, V = np.empty((6, 6)), np.empty((6, 6))
    for i in range(N - 2, -1, -1):
        U = ratio[i]
        for a in range(6):
            six = ZERO
            for c in range(6):
                six = _plus(six, U[a, c], Z[i + 1], c)
                V[c, a] = U[a, c]
            _put(T, a, six)
        for a in range(6):
            six = _plus(ZERO, 1.0, Z[i], a)
            for c in range(6):
                six = _plus(six, T[a, c], V, c)
            _put(Z[i], a, six)
    return Z


@njit(cache=True)
def rising(numbers: Ints) -> bool:
    """Whether none is below the one before it."""
    falls = 0
    for i in range(1, len(numbers)):
        falls += numbers[i] < numbers[i - 1]
    return falls == 0


@njit(cache=True, fastmath={"reassoc", "contract"}, forceinline=True)
def _combined(
    f0: float, f1: float, f2: float, f3: float, f4: float, f5: float, rows: Floats, n: int, result: Floats
) -> None:
    """The first n entries of a sum of six rows."""
    a, b, c, d, e, f = rows[0], rows[1], rows[2], rows[3], rows[4], rows[5]
    for j in range(n):
        result[j] = f0 * a[j] + f1 * b[j] + f2 * c[j] + f3 * d[j] + f4 * e[j] + f5 * f[j]


@njit(cache=True, fastmath={"reassoc", "contract"})
def delassus(values: Floats, element: Ints, inverse: Floats, ratio: Floats) -> Floats:
    """W = H A⁻¹ Hᵀ for rows with entries `values` (c, 12) at the nodes e, e + 1 of their elements (c) in rising order.

    The columns of A⁻¹Hᵀ are carried up the chain together, from their own elements to its start: the other half of W is
    its transpose.
    """
    c, N = len(values), len(inverse)
    W = np.empty((c, c))
    Z = diagonal_of_inverse(inverse, ratio)
    here, below = np.zeros((6, c)), np.zeros((6, c))
    first_half, second_half = np.empty(c), np.empty(c)
    # Columns stand in falling order: those that have begun come first.
    begun, row = 0, c - 1
    for i in range(N - 2, -1, -1):
        U, X, last = ratio[i], inverse[i], Z[i + 1]
        # Six factors at a time: each number is stored once.
        for a in range(6):
            _combined(-U[a, 0], -U[a, 1], -U[a, 2], -U[a, 3], -U[a, 4], -U[a, 5], below, begun, here[a])
        first = row
        while row >= 0 and element[row] == i:
            h, j = values[row], c - 1 - row
            for a in range(6):
                total = 0.0
                for b in range(6):
                    w = h[6 + b]
                    for k in range(6):
                        w -= U[k, b] * h[k]
                    total += last[a, b] * w
                below[a, j] = total
            for a in range(6):
                total = 0.0
                for b in range(6):
                    total += X[a, b] * h[b] - U[a, b] * below[b, j]
                here[a, j] = total
            row -= 1
        begun = c - 1 - row
        for r in range(first, row, -1):
            h, n = values[r], c - r
            _combined(h[0], h[1], h[2], h[3], h[4], h[5], here, n, first_half)
            _combined(h[6], h[7], h[8], h[9], h[10], h[11], below, n, second_half)
            for j in range(n):
                # column j stands for row c − 1 − j ≥ r
                W[r, c - 1 - j] = first_half[j] + second_half[j]
        here, below = below, here
    for i in range(c):
        for j in range(i):
            W[i, j] = W[j, i]
    return W
