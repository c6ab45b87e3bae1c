"""Combinations of a wall's kept columns, compiled; the docstrings' formulas, as numpy's einsum, are the oracle.

C (m, K, 3, 3): C[s, l, i, a] is the displacement i of point l due to a force a on the s-th kept point; `slot` (K) is
the s of a point, −1 where it is not kept.
"""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

BLOCK = 1024  # unknowns at a time: they stay in the cache while columns pass


@njit(cache=True, error_model="numpy")
def combine(columns: Floats, rows: Ints, factors: Floats) -> Floats:
    """Σ_j factors[j] columns[rows[j]], (n), for columns (m, n)."""
    n = columns.shape[1]
    result = np.zeros(n)
    for start in range(0, n, BLOCK):
        stop = min(start + BLOCK, n)
        for j in range(len(rows)):
            factor, column = factors[j], columns[rows[j]]
            for i in range(start, stop):
                result[i] += factor * column[i]
    return result


@njit(cache=True, error_model="numpy")
def displace(C: Floats, slots: Ints, forces: Floats, points: Ints) -> Floats:
    """Displacements (p, 3) of points due to forces (f, 3) on kept points: d_l = Σ_s C_sl f_s."""
    result = np.zeros((len(points), 3))
    for j in range(len(slots)):
        row, f0, f1, f2 = C[slots[j]], forces[j, 0], forces[j, 1], forces[j, 2]
        for m in range(len(points)):
            block = row[points[m]]
            for i in range(3):
                result[m, i] += block[i, 0] * f0 + block[i, 1] * f1 + block[i, 2] * f2
    return result


@njit(cache=True, error_model="numpy")
def sum_forces(points: Ints, shares: Floats, normals: Floats, lam: Floats, forces: Floats) -> None:
    """Add −λ_i n_i shares_ik to forces (K, 3) at points_ik."""
    for i in range(len(lam)):
        if lam[i] != 0.0:
            for k in range(points.shape[1]):
                for a in range(3):
                    forces[points[i, k], a] -= lam[i] * normals[i, a] * shares[i, k]


@njit(cache=True, error_model="numpy")
def along(points: Ints, shares: Floats, normals: Floats, d: Floats) -> Floats:
    """−n_i·Σ_k shares_ik d[points_ik], (c), for displacements d (K, 3)."""
    result = np.zeros(len(points))
    for i in range(len(points)):
        for k in range(points.shape[1]):
            l = points[i, k]
            result[i] -= shares[i, k] * (normals[i, 0] * d[l, 0] + normals[i, 1] * d[l, 1] + normals[i, 2] * d[l, 2])
    return result


@njit(cache=True, error_model="numpy")
def delassus(C: Floats, slot: Ints, points: Ints, shares: Floats, normals: Floats) -> Floats:
    """W_ij = Σ_kl shares_ik shares_jl n_i·C_kl n_j, (c, c), symmetric; every point must be kept.

    The rows are gathered on the distinct points (t) first: (c, 3t) times (3t, 3t) times (3t, c), the outer ones sparse.
    """
    c, width = points.shape
    number = np.full(len(slot), -1)
    used = np.empty(min(len(slot), c * width), dtype=np.int64)
    t = 0
    for i in range(c):
        for k in range(width):
            if shares[i, k] != 0.0 and number[points[i, k]] < 0:
                number[points[i, k]] = t
                used[t] = points[i, k]
                t += 1
    G = np.empty((3 * t, 3 * t))
    for p in range(t):
        row = C[slot[used[p]]]
        for q in range(t):
            block = row[used[q]]
            for i in range(3):
                for a in range(3):
                    G[3 * p + a, 3 * q + i] = block[i, a]
    W = np.empty((c, c))
    y = np.empty(3 * t)
    for i in range(c):
        y[:] = 0.0
        for k in range(width):
            if shares[i, k] != 0.0:
                for a in range(3):
                    factor, row = shares[i, k] * normals[i, a], G[3 * number[points[i, k]] + a]
                    for m in range(3 * t):
                        y[m] += factor * row[m]
        for j in range(i + 1):
            total = 0.0
            for k in range(width):
                if shares[j, k] != 0.0:
                    first = 3 * number[points[j, k]]
                    total += shares[j, k] * (
                        normals[j, 0] * y[first] + normals[j, 1] * y[first + 1] + normals[j, 2] * y[first + 2]
                    )
            W[i, j] = W[j, i] = total
    return W
