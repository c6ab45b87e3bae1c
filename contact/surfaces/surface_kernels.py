"""The potential of a convolution surface with its derivatives, compiled.

A primitive is the integral of the kernel e³/r over its axis, e = 1 − |x − a|²/(k r)² where positive. Of a chain of
primitives the potential is F = (Σ f)^(2/7), which makes a straight tube's a quadratic function of the distance from the
axis; chains and balls (F = e of their centre, normalised) are joined by a p-norm, and each dent takes away a multiple
of its own e³.

`evaluate` stands inlined wherever it is called, so that derivatives that a caller does not use are not computed.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from contact.surfaces.segment_kernel import Terms, integrate_segments
from contact.surfaces.triangle_kernel import integrate_triangles

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]
Place = tuple[int, int, int, int]

SEGMENT, TRIANGLE, BALL, DENT = 0, 1, 2, 3
POWER = 2 / 7
# Below this potential a chain is as good as absent.
FAINT = 1e-12
NOWHERE = (-(1 << 60), 0, 0, -1)


class Network(NamedTuple):
    """Primitives in the cells of their spatial index.

    constants : weights of the kernel in segments and in triangles, so that a long tube and a wide plate have F = 1 at
        r; k and p; cell width and corner of the grid [m]; inverses of the cell width
        and of k², which would be divided by again and again, (10)
    table, keys : hash table of cells: number of a cell (−1 empty) and its three integer coordinates
    cells : first group, first group of dents, and end, (cells, 3)
    bounds : per cell and within one cell width of it: bounds of |∇F| where F ≥ ½ and of −∂²F/∂s² where F ≥ 1, the least
        and the largest radius, (cells, 4)
    groups : what adds up to one chain in a cell: kind, and from where to where it stands in the arrays that follow
    slots : segments by cell, a column each, see `segment_kernel.columns`
    plates : triangles by cell, three corners and r, (n, 10)
    balls : of balls and dents: centre, radius, strength, (n, 5)
    """

    constants: Floats
    table: Ints
    keys: Ints
    cells: Ints
    bounds: Floats
    groups: Ints
    slots: Floats
    plates: Floats
    balls: Floats


@njit(cache=True, error_model="numpy")
def slot(keys: Ints, table: Ints, i: int, j: int, k: int) -> int:
    """Where in the hash table a cell stands, or the empty place where it would."""
    mask = len(table) - 1
    at = (i * 73856093 ^ j * 19349663 ^ k * 83492791) & mask
    while table[at] >= 0 and not (keys[at, 0] == i and keys[at, 1] == j and keys[at, 2] == k):
        at = (at + 1) & mask
    return at


@njit(cache=True, error_model="numpy", forceinline=True)
def locate(constants: Floats, table: Ints, keys: Ints, x: float, y: float, z: float, last: Place) -> Place:
    """Coordinates and number (−1 where nothing is near) of a point's cell; looked up where it is not the last one."""
    u, v, w = (x - constants[5]) * constants[8], (y - constants[6]) * constants[8], (z - constants[7]) * constants[8]
    # Beyond that many cells, or where x is not a number, there is no integer.
    if not (abs(u) < 1e9 and abs(v) < 1e9 and abs(w) < 1e9):
        return NOWHERE
    i, j, k = int(np.floor(u)), int(np.floor(v)), int(np.floor(w))
    if i == last[0] and j == last[1] and k == last[2]:
        return last
    return i, j, k, int(table[slot(keys, table, i, j, k)])


@njit(cache=True, error_model="numpy", forceinline=True)
def _power(t: Terms, power: float) -> Terms:
    """f, ∇f, ∇²f of a positive f become those of f^power."""
    f, x, y, z, xx, xy, xz, yy, yz, zz = t
    F, inverse = f**power, 1.0 / f
    one = power * F * inverse
    two = (power - 1.0) * one * inverse
    return (
        F,
        one * x,
        one * y,
        one * z,
        one * xx + two * x * x,
        one * xy + two * x * y,
        one * xz + two * x * z,
        one * yy + two * y * y,
        one * yz + two * y * z,
        one * zz + two * z * z,
    )


@njit(cache=True, error_model="numpy", forceinline=True)
def _sum(a: Terms, b: Terms) -> Terms:
    return (
        a[0] + b[0],
        a[1] + b[1],
        a[2] + b[2],
        a[3] + b[3],
        a[4] + b[4],
        a[5] + b[5],
        a[6] + b[6],
        a[7] + b[7],
        a[8] + b[8],
        a[9] + b[9],
    )


@njit(cache=True, error_model="numpy", forceinline=True)
def _round(balls: Floats, n: int, k: float, dent: bool, x: float, y: float, z: float) -> Terms:
    """A ball's F = e/(1 − 1/k²), or a dent's −e³ times its strength."""
    px, py, pz = x - balls[n, 0], y - balls[n, 1], z - balls[n, 2]
    R2 = balls[n, 3] ** 2 if dent else (k * balls[n, 3]) ** 2
    e = max(1.0 - (px * px + py * py + pz * pz) / R2, 0.0)
    if dent:
        strength = balls[n, 4]
        F, A, B = -strength * e**3, 6.0 * strength * e * e / R2, -24.0 * strength * e / (R2 * R2)
    else:
        scale = 1.0 / (1.0 - 1.0 / k**2)
        F, A, B = scale * e, -2.0 * scale / R2, 0.0
    return (
        F,
        A * px,
        A * py,
        A * pz,
        A + B * px * px,
        B * px * py,
        B * px * pz,
        A + B * py * py,
        B * py * pz,
        A + B * pz * pz,
    )


@njit(cache=True, error_model="numpy", forceinline=True)
def evaluate(
    constants: Floats,
    cells: Ints,
    groups: Ints,
    slots: Floats,
    plates: Floats,
    balls: Floats,
    cell: int,
    x: float,
    y: float,
    z: float,
) -> Terms:
    """F and its derivatives (value, x, y, z, xx, xy, xz, yy, yz, zz) at a point of a cell."""
    k, p = constants[2], constants[3]
    total = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    joined, power = 0, 1.0
    for g in range(cells[cell, 0], cells[cell, 1]):
        kind, start, stop = groups[g, 0], groups[g, 1], groups[g, 2]
        own_power = POWER
        if kind == SEGMENT:
            own = integrate_segments(slots, start, stop, constants[0], k * k, constants[9], x, y, z)
        elif kind == TRIANGLE:
            own = integrate_triangles(plates, start, stop, constants[1], k, x, y, z)
        else:
            own = _round(balls, start, k, False, x, y, z)
            own_power = 1.0
        if own[0] <= FAINT:
            continue
        # A single chain needs no p-norm: it is raised once, at the end.
        if joined == 0:
            total, power = own, own_power
        else:
            if joined == 1:
                total, power = _power(total, power * p), 1.0 / p
            total = _sum(total, _power(own, own_power * p))
        joined += 1
    if power != 1.0:
        total = _power(total, power)
    for g in range(cells[cell, 1], cells[cell, 2]):
        total = _sum(total, _round(balls, groups[g, 1], k, True, x, y, z))
    return total


@njit(cache=True, error_model="numpy")
def values(net: Network, x: Floats) -> Floats:
    """F at each point, (points)."""
    constants, table, keys, cells, _, groups, slots, plates, balls = net
    out, place = np.zeros(len(x)), NOWHERE
    for i in range(len(x)):
        x0, x1, x2 = x[i, 0], x[i, 1], x[i, 2]
        place = locate(constants, table, keys, x0, x1, x2, place)
        if place[3] >= 0:
            out[i] = evaluate(constants, cells, groups, slots, plates, balls, place[3], x0, x1, x2)[0]
    return out


@njit(cache=True, error_model="numpy")
def potentials(net: Network, x: Floats) -> Floats:
    """F and its derivatives at each point, (points, 10)."""
    constants, table, keys, cells, _, groups, slots, plates, balls = net
    out, place = np.zeros((len(x), 10)), NOWHERE
    for i in range(len(x)):
        x0, x1, x2 = x[i, 0], x[i, 1], x[i, 2]
        place = locate(constants, table, keys, x0, x1, x2, place)
        if place[3] >= 0:
            t = evaluate(constants, cells, groups, slots, plates, balls, place[3], x0, x1, x2)
            out[i, 0], out[i, 1], out[i, 2], out[i, 3], out[i, 4] = t[0], t[1], t[2], t[3], t[4]
            out[i, 5], out[i, 6], out[i, 7], out[i, 8], out[i, 9] = t[5], t[6], t[7], t[8], t[9]
    return out


@njit(cache=True, error_model="numpy")
def lower_bounds(net: Network, x: Floats) -> Floats:
    """The largest proven distance of each point from F = 1, with the sign of F − 1, (points).

    Where F > 1 no way shorter than s leads to the wall if F − 1 − |∇F| s − M s²/2 > 0, M the cell's bound of −∂²F:
    r − ρ where M is that of a straight tube.
    """
    constants, table, keys, cells, bounds, groups, slots, plates, balls = net
    out, place, width = np.empty(len(x)), NOWHERE, constants[4]
    for i in range(len(x)):
        x0, x1, x2 = x[i, 0], x[i, 1], x[i, 2]
        place = locate(constants, table, keys, x0, x1, x2, place)
        cell = place[3]
        if cell < 0:
            out[i] = -width
            continue
        t = evaluate(constants, cells, groups, slots, plates, balls, cell, x0, x1, x2)
        above = t[0] - 1.0
        if above > 0.0:
            slope2 = t[1] * t[1] + t[2] * t[2] + t[3] * t[3]
            bound = 2.0 * above / (np.sqrt(slope2) + np.sqrt(slope2 + 2.0 * bounds[cell, 1] * above))
            out[i] = min(bound, width)
        else:
            # From beyond F = ½ the way leads through what is between.
            out[i] = max(max(above, -0.5) / bounds[cell, 0], -width)
    return out


@njit(cache=True, error_model="numpy")
def cells_at(net: Network, x: Floats) -> Ints:
    """The number of each point's cell, −1 where nothing is near, (points)."""
    constants, table, keys, _, _, _, _, _, _ = net
    out, place = np.empty(len(x), dtype=np.int64), NOWHERE
    for i in range(len(x)):
        place = locate(constants, table, keys, x[i, 0], x[i, 1], x[i, 2], place)
        out[i] = place[3]
    return out
