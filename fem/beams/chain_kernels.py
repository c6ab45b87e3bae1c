"""Symmetric block-tridiagonal matrices of 6 × 6 blocks along a chain, compiled.

With diagonal blocks Dᵢ and upper ones Eᵢ the elimination from the start leaves Sᵢ = Dᵢ − Eᵢ₋₁ᵀ Sᵢ₋₁⁻¹ Eᵢ₋₁; kept are
Sᵢ⁻¹, Uᵢ = Sᵢ⁻¹ Eᵢ and its transpose, node by node in one array F (`block_products`). The blocks of the inverse on the
diagonal are Zᵢ = Sᵢ⁻¹ + Uᵢ Zᵢ₊₁ Uᵢᵀ, and above it Zᵢⱼ = −Uᵢ Zᵢ₊₁,ⱼ (Takahashi, Fagan and Chen 1973), so that an entry
of H A⁻¹ Hᵀ costs no solve over the whole chain. Oracle: PETSc's SeqBAIJ LU.
"""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray

from fem.beams.block_products import (
    MATRIX,
    Six,
    add_product,
    along,
    columns,
    copy,
    load,
    minus,
    plus,
    product,
    put,
    row,
    rows,
    times,
    transpose,
    weighed,
)
from fem.lanes import LANES

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]
Bools = NDArray[np.bool_]

DEFINITE, INDEFINITE = -1, -2
ZERO = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
# What a node has in F: S⁻¹, U and Uᵀ
NODE, RATIO, TURNED = 3 * MATRIX, MATRIX, 2 * MATRIX
# Places of matrices in the work array of a loop: for products within it alone the compiler sees that they are apart
M0, M1, M2, M3, M4, M5, M6, M7 = (MATRIX * k for k in range(8))


@njit(cache=True)
def room(nodes: int) -> Floats:
    """F for so many nodes."""
    return np.empty(nodes * NODE)


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
def _eliminate(F: Floats, S: int, M: int, P: int) -> bool:
    """M ← L⁻¹ and P ← the inverse pivots D⁻¹, where S = L D Lᵀ; overwrites S. False where a pivot is not positive."""
    for k in range(6):
        pivot = F[S + LANES * k + k]
        if not pivot > 0.0:
            return False
        F[P + k] = 1.0 / pivot
        F[M + LANES * k + k] = 1.0
        for a in range(k + 1, 6):
            f = F[S + LANES * a + k] * F[P + k]
            F[M + LANES * a + k] = -f
            for b in range(k + 1, a + 1):
                F[S + LANES * a + b] -= f * F[S + LANES * b + k]
    for b in range(6):
        for a in range(b + 1, 6):
            total = F[M + LANES * a + b]
            for c in range(b + 1, a):
                total += F[M + LANES * a + c] * F[M + LANES * c + b]
            F[M + LANES * a + b] = total
    return True


@njit(cache=True)
def _by_pivots(F: Floats, S: int, at: int) -> bool:
    """F[at] ← S⁻¹ where S is indefinite; False where it is singular."""
    A, X = np.empty((6, 6)), np.empty((6, 6))
    for a in range(6):
        for b in range(6):
            A[a, b] = F[S + LANES * a + b]
    if not _invert(A, X):
        return False
    for a in range(6):
        for b in range(6):
            F[at + LANES * a + b] = X[a, b]
    return True


@njit(cache=True, fastmath={"contract"})
def factor(diagonal: Floats, upper: Floats, F: Floats) -> int:
    """The elimination of blocks (N, 6, 6) and (N − 1, 6, 6) into F, which has `room` for it.

    Returns `DEFINITE`, `INDEFINITE` or the first singular node.

    Where S = L D Lᵀ has positive pivots D, S⁻¹ = L⁻ᵀD⁻¹L⁻¹ and the next S = D' − YᵀD⁻¹Y, Y = L⁻¹E, keep the digits that
    a product with the inverse loses; elsewhere elimination is with row exchanges.
    """
    last, verdict, work = len(diagonal) - 1, DEFINITE, np.zeros(8 * MATRIX)
    S, K, L, E, Y, X, U, P = M0, M1, M2, M3, M4, M5, M6, M7
    load(work, S, diagonal, 0)
    for i in range(last + 1):
        copy(work, S, work, K)
        if i < last:
            load(work, E, upper, i)
        definite = _eliminate(work, K, L, P)
        if not definite:
            verdict = INDEFINITE
            if not _by_pivots(work, S, X):
                return i
        if definite:
            product(1.0, weighed(columns(work, L), row(work, P)), work, L, X)
        copy(work, X, F, NODE * i)
        if i == last:
            break
        load(work, S, diagonal, i + 1)
        if definite:
            product(1.0, rows(work, L), work, E, Y)
            product(1.0, weighed(columns(work, L), row(work, P)), work, Y, U)
            add_product(-1.0, weighed(columns(work, Y), row(work, P)), work, Y, S)
        else:
            product(1.0, rows(work, X), work, E, U)
            add_product(-1.0, columns(work, E), work, U, S)
        copy(work, U, F, NODE * i + RATIO)
        transpose(work, U, F, NODE * i + TURNED)
    return verdict


@njit(cache=True, fastmath={"contract"})
def solve(F: Floats, fixed: Bools, B: Floats) -> Floats:
    """A⁻¹ B for k right-hand sides stored one after the other (k, 6 N), zero at fixed unknowns (6 N)."""
    N = len(fixed) // 6
    X = B.copy()
    for j in range(len(B)):
        x = X[j]
        for i in range(6 * N):
            if fixed[i]:
                x[i] = 0.0
        six = row(x, 0)
        for i in range(1, N):
            at, above = NODE * (i - 1) + RATIO, six
            six = row(x, 6 * i)
            six = plus(six, -above[0], row(F, at))
            six = plus(six, -above[1], row(F, at + LANES))
            six = plus(six, -above[2], row(F, at + 2 * LANES))
            six = plus(six, -above[3], row(F, at + 3 * LANES))
            six = plus(six, -above[4], row(F, at + 4 * LANES))
            six = plus(six, -above[5], row(F, at + 5 * LANES))
            put(x, 6 * i, six)
        for i in range(N - 1, -1, -1):
            at, below = NODE * i, six
            six = ZERO
            for c in range(6):
                six = plus(six, x[6 * i + c], row(F, at + LANES * c))
            if i + 1 < N:
                U = at + RATIO
                six = (
                    six[0] - along(row(F, U), below),
                    six[1] - along(row(F, U + LANES), below),
                    six[2] - along(row(F, U + 2 * LANES), below),
                    six[3] - along(row(F, U + 3 * LANES), below),
                    six[4] - along(row(F, U + 4 * LANES), below),
                    six[5] - along(row(F, U + 5 * LANES), below),
                )
            put(x, 6 * i, six)
    return X


@njit(cache=True)
def rising(numbers: Ints) -> bool:
    """Whether none is below the one before it."""
    falls = 0
    for i in range(1, len(numbers)):
        falls += numbers[i] < numbers[i - 1]
    return falls == 0


@njit(cache=True, fastmath={"reassoc", "contract"}, forceinline=True)
def _combined(
    f0: float, f1: float, f2: float, f3: float, f4: float, f5: float, six_rows: Floats, n: int, result: Floats
) -> None:
    """The first n entries of a sum of six rows."""
    a, b, c, d, e, f = six_rows[0], six_rows[1], six_rows[2], six_rows[3], six_rows[4], six_rows[5]
    for j in range(n):
        result[j] = f0 * a[j] + f1 * b[j] + f2 * c[j] + f3 * d[j] + f4 * e[j] + f5 * f[j]


@njit(cache=True, fastmath={"contract"}, forceinline=True)
def _begin(F: Floats, node: int, work: Floats, Z: int, h: Six, g: Six) -> tuple[Six, Six]:
    """A⁻¹Hᵀ at a node and at the next one, for a row of H with entries h and g at them."""
    U = node + RATIO
    w = plus(plus(plus(g, -h[0], row(F, U)), -h[1], row(F, U + LANES)), -h[2], row(F, U + 2 * LANES))
    w = plus(plus(plus(w, -h[3], row(F, U + 3 * LANES)), -h[4], row(F, U + 4 * LANES)), -h[5], row(F, U + 5 * LANES))
    below = times(rows(work, Z), w)
    return minus(times(rows(F, node), h), times(rows(F, U), below)), below


@njit(cache=True, fastmath={"reassoc", "contract"})
def delassus(values: Floats, element: Ints, F: Floats) -> Floats:
    """W = H A⁻¹ Hᵀ for rows with entries `values` (c, 12) at the nodes e, e + 1 of their elements (c) in rising order.

    The columns of A⁻¹Hᵀ are carried up the chain together, from their own elements to its start: the other half of W is
    its transpose.
    """
    c, end = len(values), len(F)
    W, work = np.empty((c, c)), np.zeros(4 * MATRIX)
    Z, T, U, V = M0, M1, M2, M3
    here, below = np.zeros((6, c)), np.zeros((6, c))
    first_half, second_half = np.empty(c), np.empty(c)
    copy(F, end - NODE, work, Z)
    # Columns stand in falling order: those that have begun come first.
    r = c - 1
    for node in range(end - 2 * NODE, -1, -NODE):
        if r < 0:
            break
        copy(F, node + RATIO, work, U)
        copy(F, node + TURNED, work, V)
        # Six factors at a time: each number is stored once.
        for a in range(6):
            f = row(work, U + LANES * a)
            _combined(-f[0], -f[1], -f[2], -f[3], -f[4], -f[5], below, c - 1 - r, here[a])
        first = r
        while r >= 0 and NODE * element[r] == node:
            at_node, at_next = _begin(F, node, work, Z, row(values[r], 0), row(values[r], 6))
            for a in range(6):
                here[a, c - 1 - r], below[a, c - 1 - r] = at_node[a], at_next[a]
            r -= 1
        for i in range(first, r, -1):
            h, n = values[i], c - i
            _combined(h[0], h[1], h[2], h[3], h[4], h[5], here, n, first_half)
            _combined(h[6], h[7], h[8], h[9], h[10], h[11], below, n, second_half)
            for j in range(n):
                # column j stands for row c − 1 − j ≥ i
                W[i, c - 1 - j] = first_half[j] + second_half[j]
        here, below = below, here
        product(1.0, rows(work, U), work, Z, T)
        copy(F, node, work, Z)
        add_product(1.0, rows(work, T), work, V, Z)
    for i in range(c):
        for j in range(i):
            W[i, j] = W[j, i]
    return W
