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
def combine(columns: Floats, rows: Ints, factors: Floats, n: int) -> Floats:
    """Σ_j factors[j] columns[rows[j], :n], (n), for columns (m, n or more)."""
    result = np.zeros(n)
    for start in range(0, n, BLOCK):
        stop = min(start + BLOCK, n)
        part = result[start:stop]
        for j in range(len(rows)):
            factor, column = factors[j], columns[rows[j], start:stop]
            for i in range(len(part)):
                part[i] += factor * column[i]
    return result


@njit(cache=True, error_model="numpy")
def displace(C: Floats, slots: Ints, forces: Floats) -> Floats:
    """Displacements (K, 3) of all points due to forces (f, 3) on kept ones: d_l = Σ_s C_sl f_s."""
    result = np.zeros((C.shape[1], 3))
    for j in range(len(slots)):
        row, f0, f1, f2 = C[slots[j]], forces[j, 0], forces[j, 1], forces[j, 2]
        for m in range(len(row)):
            for i in range(3):
                result[m, i] += row[m, i, 0] * f0 + row[m, i, 1] * f1 + row[m, i, 2] * f2
    return result


@njit(cache=True, error_model="numpy")
def gather(C: Floats, slots: Ints, points: Ints, first: int, G: Floats) -> None:
    """Fill G[3p + a, 3q + i] = C[slots[p], points[q], i, a] where p or q is `first` or more.

    G is symmetric but for round-off; every point is kept.
    """
    for p in range(len(points)):
        row = C[slots[p]]
        for q in range(first if p < first else 0, len(points)):
            block = row[points[q]]
            for i in range(3):
                for a in range(3):
                    G[3 * p + a, 3 * q + i] = block[i, a]


@njit(cache=True, error_model="numpy")
def nonzero(forces: Floats) -> Ints:
    """The rows of (K, 3) that are not zero."""
    found = np.empty(len(forces), dtype=np.int64)
    n = 0
    for k in range(len(forces)):
        if forces[k, 0] != 0.0 or forces[k, 1] != 0.0 or forces[k, 2] != 0.0:
            found[n] = k
            n += 1
    return found[:n]


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
def delassus(G: Floats, place: Ints, points: Ints, shares: Floats, normals: Floats, t: int) -> Floats:
    """W_ij = Σ_kl shares_ik shares_jl n_i·C_kl n_j, (c, c), symmetric.

    C_kl are blocks of G (3t, 3t or more), at the `place` (K) of their points; rows with normals of zero are skipped.
    """
    c, width = points.shape
    W = np.zeros((c, c))
    y = np.empty(3 * t)
    used = np.zeros(c, dtype=np.bool_)
    for i in range(c):
        used[i] = normals[i, 0] != 0.0 or normals[i, 1] != 0.0 or normals[i, 2] != 0.0
        if not used[i]:
            continue
        y[:] = 0.0
        for k in range(width):
            share = shares[i, k]
            if share != 0.0:
                row = 3 * place[points[i, k]]
                f0, f1, f2 = share * normals[i, 0], share * normals[i, 1], share * normals[i, 2]
                g0, g1, g2 = G[row, : 3 * t], G[row + 1, : 3 * t], G[row + 2, : 3 * t]
                for m in range(len(y)):
                    y[m] += f0 * g0[m] + f1 * g1[m] + f2 * g2[m]
        for j in range(i + 1):
            if used[j]:
                total = 0.0
                for k in range(width):
                    first = 3 * place[points[j, k]]
                    total += shares[j, k] * (
                        normals[j, 0] * y[first] + normals[j, 1] * y[first + 1] + normals[j, 2] * y[first + 2]
                    )
                W[i, j] = W[j, i] = total
    return W
