"""The spatial index of a convolution surface: which primitives reach a cell, and bounds of the potential there."""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray

from contact.surfaces.segment_kernel import BLOCK
from contact.surfaces.surface_kernels import BALL, DENT, POWER, SEGMENT, TRIANGLE, Network, slot

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]
Bools = NDArray[np.bool_]


def network(kind: Ints, chain: Ints, data: Floats, reach: float, sharpness: float) -> Network:
    """Primitives in the order of segments by chain, triangles, balls, dents, with their index.

    Parameters
    ----------
    kind, chain, data : of each primitive; data is `segment_kernel.columns` of a segment; three corners and r of
        a triangle; centre, r of a ball; centre, radius, strength of a dent, (n, 10)
    """
    low, high, a, b, thin, thick = _boxes(kind, data)
    weight = np.array([35 / (32 * reach * (1 - reach**-2) ** 3.5), 4 / (np.pi * reach**2 * (1 - reach**-2) ** 4)])
    support = np.where(kind == DENT, 1.0, reach) * thick
    cell = float(np.median(thick[kind != DENT]))
    corner = (low - support[:, None]).min(axis=0) - 2 * cell
    number, item, near, coordinates = cells_of(a, b, low, high, support, corner, cell)
    bounds = cell_bounds(number, item, len(coordinates), kind, chain, data, thin, thick, weight, reach, cell)
    table, keys = hashed(coordinates)
    constants = np.array([*weight, reach, sharpness, cell, *corner, 1 / cell, reach**-2])
    balls = data[kind >= BALL, :5].copy()
    return Network(
        constants, table, keys, *_groups(number[near], item[near], len(coordinates), kind, chain, data, bounds), balls
    )


def _groups(
    number: Ints, item: Ints, cells: int, kind: Ints, chain: Ints, data: Floats, bounds: Floats
) -> tuple[Ints, Floats, Ints, Floats, Floats]:
    """Pairs of cells and primitives as runs of one cell and chain, and the copies of data that they point to."""
    new = np.diff(number, prepend=-1).astype(bool) | np.diff(chain[item], prepend=-1).astype(bool)
    first, run = np.flatnonzero(new), np.cumsum(new) - 1
    count = np.diff(first, append=len(item))
    of = kind[item[first]]
    size = np.select([of == SEGMENT, of == TRIANGLE], [-(-count // BLOCK) * BLOCK, count], 0)
    start = np.zeros(len(first), dtype=np.int64)
    for own in (SEGMENT, TRIANGLE):
        start[of == own] = np.cumsum(size[of == own]) - size[of == own]
    alone = of >= BALL
    start[alone], size[alone] = item[first[alone]] - np.count_nonzero(kind < BALL), 1
    groups = np.column_stack([of, start, start + size])
    slots = np.zeros((data.shape[1], size[of == SEGMENT].sum()))
    slots[[7, 9]] = 1.0
    mine = of[run] == SEGMENT
    slots[:, (start[run] + np.arange(len(item)) - first[run])[mine]] = data[item[mine]].T
    ends = np.searchsorted(number[first], np.arange(cells + 1))
    dents = np.bincount(number[first], of == DENT, cells).astype(np.int64)
    index = np.column_stack([ends[:-1], ends[1:] - dents, ends[1:]])
    return index, bounds, groups, slots, data[item[of[run] == TRIANGLE]]


def _boxes(kind: Ints, data: Floats) -> tuple[Floats, Floats, Floats, Floats, Floats, Floats]:
    """Bounding boxes of axes, the segment in them (its ends; equal for the others), least and largest radii."""
    thin, thick = data[:, 3].copy(), data[:, 3].copy()
    a, b = data[:, :3].copy(), data[:, :3].copy()
    s, t = kind == SEGMENT, kind == TRIANGLE
    b[s] += data[s, 6:7] * data[s, 3:6]
    ends = np.stack([data[s, 7], data[s, 7] + data[s, 8] * data[s, 6]])
    thin[s], thick[s] = ends.min(axis=0), ends.max(axis=0)
    low, high = np.minimum(a, b), np.maximum(a, b)
    corners = data[t, :9].reshape(-1, 3, 3)
    low[t], high[t] = corners.min(axis=1), corners.max(axis=1)
    thin[t], thick[t] = data[t, 9], data[t, 9]
    return low, high, a, b, thin, thick


@njit(cache=True, error_model="numpy")
def _distance(a: Floats, b: Floats, low: Floats, high: Floats, n: int, x: float, y: float, z: float) -> float:
    """A lower bound of a point's distance from what lies in box n and, where a ≠ b, on the segment."""
    tx, ty, tz = b[n, 0] - a[n, 0], b[n, 1] - a[n, 1], b[n, 2] - a[n, 2]
    length = tx * tx + ty * ty + tz * tz
    if length > 0.0:
        vx, vy, vz = x - a[n, 0], y - a[n, 1], z - a[n, 2]
        s = min(max((vx * tx + vy * ty + vz * tz) / length, 0.0), 1.0)
        vx, vy, vz = vx - s * tx, vy - s * ty, vz - s * tz
    else:
        vx = max(low[n, 0] - x, 0.0, x - high[n, 0])
        vy = max(low[n, 1] - y, 0.0, y - high[n, 1])
        vz = max(low[n, 2] - z, 0.0, z - high[n, 2])
    return float(np.sqrt(vx * vx + vy * vy + vz * vz))


@njit(cache=True, error_model="numpy")
def _overlaps(a: Floats, b: Floats, low: Floats, high: Floats, support: Floats, corner: Floats, cell: float) -> Ints:
    """Rows of cell coordinates, primitive, and 1 where its support may meet the cell, 0 where only one beside it."""
    half = 0.8661 * cell
    rows = np.empty((0, 5), dtype=np.int64)
    count = 0
    for fill in range(2):
        if fill == 1:
            rows = np.empty((count, 5), dtype=np.int64)
            count = 0
        for n in range(len(a)):
            first, last = np.empty(3, dtype=np.int64), np.empty(3, dtype=np.int64)
            for i in range(3):
                first[i] = int(np.floor((low[n, i] - support[n] - cell - corner[i]) / cell))
                last[i] = int(np.floor((high[n, i] + support[n] + cell - corner[i]) / cell))
            for i in range(first[0], last[0] + 1):
                for j in range(first[1], last[1] + 1):
                    for k in range(first[2], last[2] + 1):
                        x, y = corner[0] + cell * (i + 0.5), corner[1] + cell * (j + 0.5)
                        z = corner[2] + cell * (k + 0.5)
                        away = _distance(a, b, low, high, n, x, y, z) - support[n] - half
                        if away > cell:
                            continue
                        if fill == 1:
                            rows[count, 0], rows[count, 1], rows[count, 2], rows[count, 3] = i, j, k, n
                            rows[count, 4] = away <= 0.0
                        count += 1
    return rows


def cells_of(
    a: Floats, b: Floats, low: Floats, high: Floats, support: Floats, corner: Floats, cell: float
) -> tuple[Ints, Ints, Bools, Ints]:
    """Pairs of a cell and a primitive that comes within a cell's width of it.

    Returns
    -------
    number, item : the pairs, in the order of cells and then of primitives
    near : whether the primitive's support may meet the cell itself
    coordinates : of the cells, (cells, 3)
    """
    rows = _overlaps(a, b, low, high, support, corner, cell)
    size = rows[:, :3].max(axis=0) + 1
    key = (rows[:, 0] * size[1] + rows[:, 1]) * size[2] + rows[:, 2]
    # Rows come in the order of primitives, which a stable sort keeps.
    rows = rows[np.argsort(key, kind="stable")]
    new = np.any(np.diff(rows[:, :3], axis=0, prepend=-1), axis=1)
    return np.cumsum(new) - 1, rows[:, 3], rows[:, 4] > 0, rows[new, :3]


@njit(cache=True, error_model="numpy")
def _fill(coordinates: Ints, table: Ints, keys: Ints) -> None:
    for n in range(len(coordinates)):
        at = slot(keys, table, coordinates[n, 0], coordinates[n, 1], coordinates[n, 2])
        table[at] = n
        keys[at] = coordinates[n]


def hashed(coordinates: Ints) -> tuple[Ints, Ints]:
    """A hash table of cells that is at most half full."""
    size = 1 << (2 * len(coordinates)).bit_length()
    table, keys = np.full(size, -1, dtype=np.int64), np.zeros((size, 3), dtype=np.int64)
    _fill(coordinates, table, keys)
    return table, keys


def cell_bounds(
    number: Ints,
    item: Ints,
    cells: int,
    kind: Ints,
    chain: Ints,
    data: Floats,
    thin: Floats,
    thick: Floats,
    weight: Floats,
    reach: float,
    cell: float,
) -> Floats:
    """Bounds of |∇F| where F ≥ ½ and of −∂²F/∂s² where F ≥ 1, extreme radii; within a cell's width, (cells, 4).

    With f = ∫e³dμ and ∂e = −2a/R², |a| ≤ R √(1 − e), Cauchy and Schwarz's inequality bounds (∂f)² by
    36 f ∫e a²/R⁴dμ, so that F = f^(2/7) has
    |∂F| ≤ (12/7) f^(−3/14) (∫e dμ)^½/R and ∂²F ≥ −(2/7) f^(−5/7) ∫((30/7) e² + (12/7) e) dμ/R²;
    Hölder's inequality then bounds ∫e² and ∫e by f^(2/3) m^(1/3) and f^(1/3) m^(2/3), m = ∫dμ within reach. A p-norm
    is convex and each of its weights at most one: bounds of chains add up. Dents: the extremes of e³.
    """
    r = thin[item]
    R = reach * r
    within = 2 * (reach * thick[item] + 1.8661 * cell)
    m = np.zeros(len(item))
    s, t = kind[item] == SEGMENT, kind[item] == TRIANGLE
    m[s] = weight[0] * np.minimum(data[item[s], 6], within[s]) / r[s]
    corners = data[item[t], :9].reshape(-1, 3, 3)
    area = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1) / 2
    m[t] = weight[1] * np.minimum(area, np.pi / 4 * within[t] ** 2) / r[t] ** 2
    # Pairs come by cell and then by chain.
    starts = np.flatnonzero(np.diff(number, prepend=-1) | np.diff(chain[item], prepend=-1))
    if len(starts):
        total, least = np.add.reduceat(m, starts), np.minimum.reduceat(R, starts)
        slope = 12 / 7 * 2 ** (1 / 6) * np.cbrt(total) / least
        bend = POWER * (30 / 7 * np.cbrt(total) + 12 / 7 * np.cbrt(total) ** 2) / least**2
    of = kind[item[starts]]
    ball, dent = of == BALL, of == DENT
    sharp = 2 / (1 - reach**-2)
    slope[ball], bend[ball] = sharp / least[ball], sharp / least[ball] ** 2
    strength, radius = data[item[starts], 4], r[starts]
    slope[dent], bend[dent] = 1.72 * (strength / radius)[dent], 4.8 * (strength / radius**2)[dent]
    where = number[starts]
    # Dents have walls of their own, but no radius of a vessel.
    small = np.full(cells, np.inf)
    np.minimum.at(small, number, r)
    large = np.zeros(cells)
    np.maximum.at(large, number, thick[item])
    return np.column_stack([np.bincount(where, slope, cells), np.bincount(where, bend, cells), small, large])
