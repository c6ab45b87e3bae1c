"""What a device's contact does point by point in every pass, compiled; the docstrings' formulas are the oracle."""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray

from contact.surfaces.implicit import Foot

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]
Bools = NDArray[np.bool_]


@njit(cache=True)
def bounds(known: Floats, at: Floats, seen: Floats) -> Floats:
    """What gaps are at least, known − |at − seen|, (c)."""
    result = np.empty(len(known))
    for i in range(len(known)):
        way = 0.0
        for k in range(3):
            way += (at[i, k] - seen[i, k]) ** 2
        result[i] = known[i] - np.sqrt(way)
    return result


@njit(cache=True)
def gaps(candidates: Bools, known: Floats, at: Floats, seen: Floats) -> Floats:
    """Known gaps of the candidates, and what those of the others are at least, (c)."""
    result = bounds(known, at, seen)
    for i in range(len(known)):
        if candidates[i]:
            result[i] = known[i]
    return result


@njit(cache=True)
def moved_along(rows: Ints, at: Floats, seen: Floats, foot: Foot) -> tuple[Floats, Floats]:
    """Present places of some points, and their feet y = x − d n moved along by ∂y = I − n nᵀ − d ∇²d."""
    distance, point, normal, curvature = foot
    x, guess = np.empty((len(rows), 3)), np.empty((len(rows), 3))
    for j in range(len(rows)):
        i = rows[j]
        m0, m1, m2 = at[i, 0] - seen[i, 0], at[i, 1] - seen[i, 1], at[i, 2] - seen[i, 2]
        along = normal[i, 0] * m0 + normal[i, 1] * m1 + normal[i, 2] * m2
        for k in range(3):
            turned = curvature[i, k, 0] * m0 + curvature[i, k, 1] * m1 + curvature[i, k, 2] * m2
            x[j, k] = at[i, k]
            guess[j, k] = point[i, k] + at[i, k] - seen[i, k] - normal[i, k] * along - distance[i] * turned
    return x, guess


@njit(cache=True)
def settle(
    rows: Ints, x: Floats, found: Foot, radius: Floats, foot: Foot, known: Floats, seen: Floats, followed: Bools,
    slack: Floats, far: float,
) -> Ints:  # fmt: skip
    """Write the feet found for some points at x into those of all, and their gaps d − a; follow those up to `far`.

    Returns which of the rows, 0, 1, …, changed their gaps by more than their motion since they were seen and `slack`.
    """
    lost = np.empty(len(rows), dtype=np.int64)
    n = 0
    for j in range(len(rows)):
        i, square = rows[j], 0.0
        for k in range(3):
            square += (x[j, k] - seen[i, k]) ** 2
        gap = found[0][j] - radius[i]
        if abs(gap - known[i]) > np.sqrt(square) + slack[j]:
            lost[n] = j
            n += 1
        foot[0][i] = found[0][j]
        known[i] = gap
        followed[i] = gap <= far
        for k in range(3):
            foot[1][i, k], foot[2][i, k], seen[i, k] = found[1][j, k], found[2][j, k], x[j, k]
            for m in range(3):
                foot[3][i, k, m] = found[3][j, k, m]
    return lost[:n]


@njit(cache=True)
def offsets(candidates: Bools, at: Floats, point: Floats, normal: Floats, radius: Floats, values: Floats) -> Floats:
    """n·(p − y) − a of the candidates, infinite elsewhere, (c); empties the rows `values` (c, 12) of the others."""
    result = np.empty(len(candidates))
    for i in range(len(candidates)):
        if candidates[i]:
            total = -radius[i]
            for k in range(3):
                total += normal[i, k] * (at[i, k] - point[i, k])
            result[i] = total
        else:
            result[i] = np.inf
            values[i] = 0.0
    return result
