"""What a device's contact does point by point in every pass, compiled; the docstrings' formulas are the oracle."""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray

from contact.devices import row_kernels
from contact.surfaces.implicit import Foot
from fem.beams import beam_points

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]
Bools = NDArray[np.bool_]


@njit(cache=True)
def ways(a: Floats, b: Floats) -> Floats:
    """|b − a|, (c)."""
    result = np.empty(len(a))
    for i in range(len(a)):
        square = 0.0
        for k in range(3):
            square += (b[i, k] - a[i, k]) ** 2
        result[i] = np.sqrt(square)
    return result


@njit(cache=True)
def bounds(known: Floats, at: Floats, seen: Floats, drift: Floats) -> Floats:
    """What gaps are at least, known − |at − seen| − drift, (c)."""
    result = ways(seen, at)
    for i in range(len(known)):
        result[i] = known[i] - result[i] - drift[i]
    return result


@njit(cache=True)
def gaps(candidates: Bools, known: Floats, at: Floats, seen: Floats, drift: Floats) -> Floats:
    """Known gaps of the candidates, and what those of the others are at least, (c)."""
    result = bounds(known, at, seen, drift)
    for i in range(len(known)):
        if candidates[i]:
            result[i] = known[i]
    return result


@njit(cache=True)
def split(chosen: Bools, followed: Bools) -> tuple[Ints, Ints]:
    """The chosen points whose feet are followed, and the others."""
    rows = np.empty(len(chosen), dtype=np.int64)
    n, last = 0, len(chosen)
    for i in range(len(chosen)):
        if chosen[i]:
            if followed[i]:
                rows[n] = i
                n += 1
            else:
                last -= 1
                rows[last] = i
    return rows[:n], rows[last:][::-1].copy()


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
    rows: Ints, x: Floats, found: tuple[Floats, Floats, Floats, Floats], radius: Floats, foot: Foot, known: Floats,
    seen: Floats, followed: Bools, drift: Floats, slack: float, far: float,
) -> Ints:  # fmt: skip
    """Write the feet found for some points at x into those of all, and their gaps d − a; follow those up to `far`.

    Returns which of the rows, 0, 1, …, have no foot (NaN), or changed their gaps by more than their motion since they
    were seen, the `drift` of the surface, which ends here, and `slack`.
    """
    lost = np.empty(len(rows), dtype=np.int64)
    n = 0
    for j in range(len(rows)):
        i, square = rows[j], 0.0
        for k in range(3):
            square += (x[j, k] - seen[i, k]) ** 2
        gap = found[0][j] - radius[i]
        if not abs(gap - known[i]) <= np.sqrt(square) + drift[i] + slack:
            lost[n] = j
            n += 1
        foot[0][i] = found[0][j]
        known[i], drift[i] = gap, 0.0
        followed[i] = gap <= far
        for k in range(3):
            foot[1][i, k], foot[2][i, k], seen[i, k] = found[1][j, k], found[2][j, k], x[j, k]
            for m in range(3):
                foot[3][i, k, m] = found[3][j, k, m]
    return lost[:n]


@njit(cache=True)
def planes(
    candidates: Bools, at: Floats, foot: Foot, radius: Floats, R: Floats, element: Ints, xi: Floats, length: Floats,
) -> tuple[Floats, Floats, Floats]:  # fmt: skip
    """Of the candidates: n·(p − y) − a, infinite elsewhere, (c), normals (c, 3) and rows of H, (c, 12)."""
    offset, rows = np.full(len(candidates), np.inf), np.zeros((len(candidates), 12))
    _, point, normal, _ = foot
    for i in range(len(candidates)):
        if candidates[i]:
            total = -radius[i]
            for k in range(3):
                total += normal[i, k] * (at[i, k] - point[i, k])
            offset[i] = total
            beam_points.write_point_row(rows[i], normal[i], R, element[i], xi[i], length[element[i]])
    return offset, normal.copy(), rows


@njit(cache=True)
def stiffness(
    lam: Floats, foot: Foot, brace: float, R: Floats, element: Ints, xi: Floats, length: Floats
) -> tuple[Ints, Floats, Floats]:
    """Elements (q), blocks (q, 12, 12) and β (c) of `point_blocks`, for the points with force.

    The wall's curvature is `braced` by that factor; where it is zero, only its `concave_part` is taken.
    """
    rows, braces = np.flatnonzero(lam > 0.0), np.zeros(len(lam))
    force, normal, curvature = lam[rows], foot[2][rows], foot[3][rows]
    if brace > 0.0:
        curvature, beta = row_kernels.braced(curvature, normal, brace)
        braces[rows] = force * beta
    else:
        curvature = row_kernels.concave_part(curvature, normal)
    blocks = beam_points.point_blocks(force, normal, curvature, R, element[rows], xi[rows], length)
    return element[rows], blocks, braces
