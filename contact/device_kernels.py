"""What a device's contact does point by point in every pass, compiled; the docstrings' formulas are the oracle."""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray

from contact.surfaces import Foot

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
def moved(rows: Ints, at: Floats, seen: Floats, point: Floats) -> tuple[Floats, Floats, Floats]:
    """Present places of some points, their feet moved along, and how far they have moved since they were seen."""
    n = len(rows)
    x, guess, way = np.empty((n, 3)), np.empty((n, 3)), np.empty(n)
    for j in range(n):
        i, square = rows[j], 0.0
        for k in range(3):
            step = at[i, k] - seen[i, k]
            x[j, k], guess[j, k] = at[i, k], point[i, k] + step
            square += step * step
        way[j] = np.sqrt(square)
    return x, guess, way


@njit(cache=True)
def settle(
    rows: Ints, x: Floats, found: Foot, radius: Floats, foot: Foot, known: Floats, seen: Floats
) -> None:  # fmt: skip
    """Write the feet found for some points at x into those of all, and their gaps d − a."""
    for j in range(len(rows)):
        i = rows[j]
        foot[0][i] = found[0][j]
        known[i] = found[0][j] - radius[i]
        for k in range(3):
            foot[1][i, k], foot[2][i, k], seen[i, k] = found[1][j, k], found[2][j, k], x[j, k]
            for m in range(3):
                foot[3][i, k, m] = found[3][j, k, m]


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
