"""Products with rows of H that touch a few neighbouring unknowns each: compiled, for `contact.rows.ElementRows`.

Row i has the entries values[i] at the unknowns first[i], first[i] + 1, … Oracle: the same rows as a sparse matrix.
"""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]


@njit(cache=True)
def apply(values: Floats, first: Ints, u: Floats) -> Floats:
    """H u, (c)."""
    c, w = values.shape
    result = np.empty(c)
    for i in range(c):
        total = 0.0
        for k in range(w):
            total += values[i, k] * u[first[i] + k]
        result[i] = total
    return result


@njit(cache=True)
def apply_transpose(values: Floats, first: Ints, lam: Floats, n: int) -> Floats:
    """Hᵀ λ, (n)."""
    result = np.zeros(n)
    for i in range(len(lam)):
        if lam[i] != 0.0:
            for k in range(values.shape[1]):
                result[first[i] + k] += values[i, k] * lam[i]
    return result


@njit(cache=True)
def columns(values: Floats, first: Ints, rows: Ints, n: int) -> Floats:
    """Hᵀ for some rows as k dense right-hand sides, stored one after the other, (k, n)."""
    result = np.zeros((len(rows), n))
    for j in range(len(rows)):
        i = rows[j]
        for k in range(values.shape[1]):
            result[j, first[i] + k] = values[i, k]
    return result


@njit(cache=True)
def product(values: Floats, first: Ints, X: Floats) -> Floats:
    """H Xᵀ for k solutions stored one after the other (k, n), given as (k, c)."""
    c, w = values.shape
    result = np.empty((len(X), c))
    for j in range(len(X)):
        for i in range(c):
            total = 0.0
            for k in range(w):
                total += values[i, k] * X[j, first[i] + k]
            result[j, i] = total
    return result


@njit(cache=True)
def without(values: Floats, first: Ints, free: NDArray[np.bool_]) -> Floats:
    """The entries, zero at unknowns that are not free."""
    result = np.zeros_like(values)
    for i in range(len(values)):
        for k in range(values.shape[1]):
            if free[first[i] + k]:
                result[i, k] = values[i, k]
    return result


@njit(cache=True)
def touching(values: Floats) -> NDArray[np.bool_]:
    """Rows that are not zero, (c)."""
    result = np.zeros(len(values), dtype=np.bool_)
    for i in range(len(values)):
        for k in range(values.shape[1]):
            if values[i, k] != 0.0:
                result[i] = True
                break
    return result


@njit(cache=True)
def _tangential(C: Floats) -> tuple[float, float]:
    """The eigenvalues a ≤ b of a symmetric matrix (3, 3) in its plane, the third being zero."""
    trace = C[0, 0] + C[1, 1] + C[2, 2]
    squares = 0.0
    for j in range(3):
        for k in range(3):
            squares += C[j, k] * C[j, k]
    root = np.sqrt(max(2.0 * squares - trace * trace, 0.0))
    return 0.5 * (trace - root), 0.5 * (trace + root)


@njit(cache=True)
def braced(curvature: Floats, normal: Floats, factor: float) -> tuple[Floats, Floats]:
    """C − β n nᵀ for symmetric matrices C (q, 3, 3) with normals n (q, 3), and β = factor · max(b, 0), (q).

    b ≥ a as in `concave_part`.
    """
    result, brace = curvature.copy(), np.empty(len(curvature))
    for i in range(len(curvature)):
        brace[i] = factor * max(_tangential(curvature[i])[1], 0.0)
        for j in range(3):
            for k in range(3):
                result[i, j, k] -= brace[i] * normal[i, j] * normal[i, k]
    return result, brace


@njit(cache=True)
def concave_part(curvature: Floats, normal: Floats) -> Floats:
    """The negative part of symmetric matrices (q, 3, 3) whose null vectors are the normals (q, 3).

    With eigenvalues a ≤ b in the tangent plane: the matrix itself where b ≤ 0, zero where a ≥ 0, and between
    a (C − b P)/(a − b), P = I − n nᵀ.
    """
    result = np.zeros_like(curvature)
    for i in range(len(curvature)):
        C, n = curvature[i], normal[i]
        a, b = _tangential(C)
        if a >= 0.0:
            continue
        for j in range(3):
            for k in range(3):
                if b <= 0.0:
                    result[i, j, k] = C[j, k]
                else:
                    P = (1.0 if j == k else 0.0) - n[j] * n[k]
                    result[i, j, k] = a * (C[j, k] - b * P) / (a - b)
    return result
