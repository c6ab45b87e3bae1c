"""The closest points of a convolution surface by Newton's method, compiled."""

from __future__ import annotations

from math import sqrt

import numpy as np
from numba import njit
from numpy.typing import NDArray

from contact.surfaces.segment_kernel import Terms
from contact.surfaces.surface_kernels import BALL, NOWHERE, SEGMENT, TRIANGLE, Network, evaluate, locate
from fem.lanes import ALL, LANES, read, write
from fem.vectors import Vector, combined, dot

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]
# xx, xy, xz, yy, yz, zz
Curvature = tuple[float, float, float, float, float, float]

# Newton's method ends with a step that leaves less than this part of the radius, by its quadratic term.
SETTLED = 1e-12
# No foot is where the distance falls along the surface: twice the eigenvalue of M that rounding may leave below zero.
SADDLE = 2e-4


@njit(cache=True, error_model="numpy", forceinline=True)
def _step(
    x: Vector, y: Vector, terms: Terms, thin: float, sign: float, cautious: bool
) -> tuple[Vector, Vector, Curvature, float, bool, bool]:
    """One step of Newton's method from y for the foot of x, where F and its derivatives are `terms`.

    Without side effects, and of no value where F ≤ 0. Returns the next y; the normal, Hessian of the distance and the
    distance itself at the end of the step, taken on linearly from its start; and whether that end is settled, and
    whether it is no foot, but on the wall opposite the nearest.
    """
    F, g0, g1, g2, h0, h1, h2, h3, h4, h5 = terms
    longest = 0.5 * thin
    size = sqrt(g0 * g0 + g1 * g1 + g2 * g2)
    unit = sign / size
    along = (1.0 - F) * unit
    n0, n1, n2 = unit * g0, unit * g1, unit * g2
    h0, h1, h2, h3, h4, h5 = unit * h0, unit * h1, unit * h2, unit * h3, unit * h4, unit * h5
    # Tangents t, b by Duff et al. (2017).
    s = 1.0 if n2 >= 0.0 else -1.0
    a = -1.0 / (s + n2)
    c = n0 * n1 * a
    n, t, b = (n0, n1, n2), (1.0 + s * n0 * n0 * a, s * c, -s * n0), (c, s + n1 * n1 * a, -n1)
    H = ((h0, h1, h2), (h1, h3, h4), (h2, h4, h5))
    Hn = (dot(H[0], n), dot(H[1], n), dot(H[2], n))
    Ht = (dot(H[0], t), dot(H[1], t), dot(H[2], t))
    Hb = (dot(H[0], b), dot(H[1], b), dot(H[2], b))
    Snt, Snb, Stt, Stb, Sbb = dot(t, Hn), dot(b, Hn), dot(t, Ht), dot(b, Ht), dot(b, Hb)
    v = (x[0] - y[0], x[1] - y[1], x[2] - y[2])
    d = dot(v, n)
    rt, rb = dot(v, t) - d * along * Snt, dot(v, b) - d * along * Snb
    Mtt, Mtb, Mbb = 1.0 + d * Stt, d * Stb, 1.0 + d * Sbb
    det = Mtt * Mbb - Mtb * Mtb
    # |M| = (M² + |det M| I)/√(tr M² + 2 |det M|), kept from being singular
    trace, positive = Mtt + Mbb, det > 1e-9 and Mtt > 0.0
    four = trace * trace - 4.0 * det
    saddle = not positive and trace - sqrt(four if four > 0.0 else 0.0) < -SADDLE
    root = 1.0 / (sqrt(Mtt * Mtt + 2.0 * Mtb * Mtb + Mbb * Mbb + 2.0 * abs(det)) + 1e-300)
    Att = Mtt if positive else (Mtt * Mtt + Mtb * Mtb + abs(det)) * root + 1e-6
    Abb = Mbb if positive else (Mbb * Mbb + Mtb * Mtb + abs(det)) * root + 1e-6
    Atb = Mtb if positive else Mtb * trace * root
    over = 1.0 / (Att * Abb - Atb * Atb)
    zt, zb = (Abb * rt - Atb * rb) * over, (Att * rb - Atb * rt) * over
    step2 = along * along + zt * zt + zb * zb
    cut = longest / sqrt(step2) if step2 > longest * longest else 1.0
    # Newton's steps may go to and fro about a ridge of the distance; short ones do not.
    cut = 0.3 * cut if cautious and step2 > 1e-4 * longest * longest else cut
    # Back to g = 0 by what its second derivative makes of the step
    bow = along * (along * dot(n, Hn) + 2.0 * (zt * Snt + zb * Snb)) + zt * (zt * Stt + 2.0 * zb * Stb) + zb * zb * Sbb
    up = along - 0.5 * bow if step2 < 1e-2 * longest * longest else along
    way = combined(cut * up, n, cut * zt, t, cut * zb, b)
    # On an axis any direction leads to the wall.
    axis = size * longest < 1e-9
    end = (
        y[0] + (0.31 * longest if axis else way[0]),
        y[1] + (0.22 * longest if axis else way[1]),
        y[2] + (0.13 * longest if axis else way[2]),
    )
    bent2 = h0 * h0 + h3 * h3 + h5 * h5 + 2.0 * (h1 * h1 + h2 * h2 + h4 * h4)
    settled = not axis and step2 * step2 * bent2 < (SETTLED * thin) ** 2 and step2 < 1e-4 * longest * longest
    # The unit normal turns by (I − n nᵀ) H m, of which the tangential parts are
    wt, wb = along * Snt + zt * Stt + zb * Stb, along * Snb + zt * Stb + zb * Sbb
    normal = combined(1.0, n, wt, t, wb, b)
    distance = (x[0] - end[0]) * normal[0] + (x[1] - end[1]) * normal[1] + (x[2] - end[2]) * normal[2]
    # S (I + d S)⁻¹ = (S + d det S I)/det(I + d S) in two dimensions; beyond a focus it has no meaning.
    extra = d * (Stt * Sbb - Stb * Stb) if det > 1e-9 else 0.0
    scale = 1.0 / det if det > 1e-9 else 1.0
    at = combined(scale * (Stt + extra), t, scale * Stb, b, 0.0, n)
    ab = combined(scale * Stb, t, scale * (Sbb + extra), b, 0.0, n)
    curvature = (
        at[0] * t[0] + ab[0] * b[0],
        at[0] * t[1] + ab[0] * b[1],
        at[0] * t[2] + ab[0] * b[2],
        at[1] * t[1] + ab[1] * b[1],
        at[1] * t[2] + ab[1] * b[2],
        at[2] * t[2] + ab[2] * b[2],
    )
    return end, normal, curvature, distance, settled, saddle and d > 0.0


@njit(cache=True, error_model="numpy", forceinline=True)
def _write_foot(
    i: int, end: Vector, n: Vector, C: Curvature, d: float, distance: Floats, foot: Floats, normal: Floats,
    curvature: Floats,
) -> None:  # fmt: skip
    distance[i] = d
    foot[i, 0], foot[i, 1], foot[i, 2] = end
    normal[i, 0], normal[i, 1], normal[i, 2] = n
    curvature[i, 0, 0], curvature[i, 1, 1], curvature[i, 2, 2] = C[0], C[3], C[5]
    curvature[i, 0, 1] = curvature[i, 1, 0] = C[1]
    curvature[i, 0, 2] = curvature[i, 2, 0] = C[2]
    curvature[i, 1, 2] = curvature[i, 2, 1] = C[4]


@njit(cache=True, error_model="numpy")
def closest(net: Network, x: Floats, guess: Floats, sign: float, limit: int) -> tuple[Floats, Floats, Floats, Floats]:
    """Distance (NaN where it fails), closest point, normal, Hessian of the distance by Newton's method.

    On y − x + μ∇g = 0, g = 0 with μ = n·(x − y)/|∇g|: the step is −g n/|∇g| and, in the tangent plane, z with
    M z = (x − y)_t − (d S)(step along n), M = I + d S, S = ∇²g/|∇g|, d = n·(x − y); |M| takes the place of M where that
    has negative eigenvalues, at a saddle of the distance. Steps end at half the least radius near. Values at the end of
    the last step are those at its start, taken on linearly.

    The first step, which for followed feet is the only one as a rule, is that of several points side by side.
    """
    constants, table, keys, cells, bounds, groups, slots, plates, balls = net
    distance, foot = np.full(len(x), np.nan), guess.copy()
    normal, curvature = np.zeros((len(x), 3)), np.zeros((len(x), 3, 3))
    place, S = NOWHERE, np.zeros(32 * LANES)
    for first in range(0, len(x), LANES):
        count = min(LANES, len(x) - first)
        for lane in range(count):
            i = first + lane
            place = locate(constants, table, keys, guess[i, 0], guess[i, 1], guess[i, 2], place)
            cell = place[3]
            S[lane] = 0.0
            if cell >= 0:
                terms = evaluate(
                    constants, cells, groups, slots, plates, balls, cell, guess[i, 0], guess[i, 1], guess[i, 2]
                )
                S[lane], S[LANES + lane], S[2 * LANES + lane], S[3 * LANES + lane] = terms[:4]
                S[4 * LANES + lane], S[5 * LANES + lane], S[6 * LANES + lane] = terms[4:7]
                S[7 * LANES + lane], S[8 * LANES + lane], S[9 * LANES + lane] = terms[7:]
                S[10 * LANES + lane] = bounds[cell, 2]
            for k in range(3):
                S[LANES * (11 + k) + lane], S[LANES * (14 + k) + lane] = x[i, k], guess[i, k]
        for lane in range(ALL):
            g, h1, h2 = read(S, 1, lane), read(S, 4, lane), read(S, 7, lane)
            terms = (S[lane], g[0], g[1], g[2], h1[0], h1[1], h1[2], h2[0], h2[1], h2[2])
            thin = S[np.uint64(10 * LANES) + lane]
            end, n, C, d, settled, opposite = _step(read(S, 11, lane), read(S, 14, lane), terms, thin, sign, False)
            write(S, 17, lane, end)
            write(S, 20, lane, n)
            write(S, 23, lane, (C[0], C[1], C[2]))
            write(S, 26, lane, (C[3], C[4], C[5]))
            write(S, 29, lane, (d, 1.0 if settled else 0.0, 1.0 if opposite else 0.0))
        for lane in range(count):
            i, end, (d, is_settled, is_opposite) = first + lane, read(S, 17, lane), read(S, 29, lane)
            if not S[lane] > 0.0:
                continue
            if is_settled:
                C1, C2 = read(S, 23, lane), read(S, 26, lane)
                C = (C1[0], C1[1], C1[2], C2[0], C2[1], C2[2])
                if not is_opposite:
                    _write_foot(i, end, read(S, 20, lane), C, d, distance, foot, normal, curvature)
                continue
            y, point = end, (x[i, 0], x[i, 1], x[i, 2])
            for iteration in range(1, limit):
                place = locate(constants, table, keys, y[0], y[1], y[2], place)
                cell = place[3]
                if cell < 0:
                    break
                terms = evaluate(constants, cells, groups, slots, plates, balls, cell, y[0], y[1], y[2])
                if terms[0] <= 0.0:
                    break
                y, n, C, d, settled, opposite = _step(point, y, terms, bounds[cell, 2], sign, iteration >= 20)
                if settled:
                    if not opposite:
                        _write_foot(i, y, n, C, d, distance, foot, normal, curvature)
                    break
    return distance, foot, normal, curvature


@njit(cache=True, error_model="numpy")
def beside(kind: Ints, data: Floats, x: Floats) -> Floats:
    """For each x the point at the radius of the primitive whose wall is nearest, looking at all, (points, 3)."""
    out = x.copy()
    for i in range(len(x)):
        best = np.inf
        for n in range(len(kind)):
            c0, c1, c2, r = data[n, 0], data[n, 1], data[n, 2], data[n, 3]
            if kind[n] == SEGMENT:
                t0, t1, t2 = data[n, 3], data[n, 4], data[n, 5]
                s = (x[i, 0] - c0) * t0 + (x[i, 1] - c1) * t1 + (x[i, 2] - c2) * t2
                s = min(max(s, 0.0), data[n, 6])
                c0, c1, c2, r = c0 + s * t0, c1 + s * t1, c2 + s * t2, data[n, 7] + s * data[n, 8]
            elif kind[n] == TRIANGLE:
                c0, c1, c2 = (c0 + data[n, 3] + data[n, 6]) / 3, (c1 + data[n, 4] + data[n, 7]) / 3, data[n, 8]
                c2, r = (data[n, 2] + data[n, 5] + c2) / 3, data[n, 9]
            elif kind[n] != BALL:
                continue
            v0, v1, v2 = x[i, 0] - c0, x[i, 1] - c1, x[i, 2] - c2
            rho = np.sqrt(v0 * v0 + v1 * v1 + v2 * v2)
            if abs(rho - r) < best:
                best = abs(rho - r)
                scale = r / max(rho, 1e-300)
                out[i, 0], out[i, 1], out[i, 2] = c0 + scale * v0, c1 + scale * v1, c2 + scale * v2
    return out


@njit(cache=True, error_model="numpy")
def outward(net: Network, x: Floats) -> Floats:
    """For each x the point at the radius of the chain or ball of its cell that it is deepest in, (points, 3).

    As a rule the foot is next to it: no wall is nearer to x. It is x itself on an axis, from where any direction leads
    to the wall, and where only plates are near, or nothing.
    """
    constants, table, keys, cells, _, groups, slots, _, balls = net
    out, place = x.copy(), NOWHERE
    for i in range(len(x)):
        x0, x1, x2 = x[i, 0], x[i, 1], x[i, 2]
        place = locate(constants, table, keys, x0, x1, x2, place)
        deepest = -np.inf
        first, last = (cells[place[3], 0], cells[place[3], 1]) if place[3] >= 0 else (0, 0)
        for g in range(first, last):
            if groups[g, 0] == TRIANGLE:
                continue
            for n in range(groups[g, 1], groups[g, 2]):
                if groups[g, 0] == SEGMENT:
                    t0, t1, t2, length = slots[3, n], slots[4, n], slots[5, n], slots[6, n]
                    if length == 0.0:  # fills up a block
                        continue
                    v0, v1, v2 = x0 - slots[0, n], x1 - slots[1, n], x2 - slots[2, n]
                    along = v0 * t0 + v1 * t1 + v2 * t2
                    s = min(max(along, 0.0), length)
                    v0, v1, v2, r = v0 - s * t0, v1 - s * t1, v2 - s * t2, slots[7, n] + s * slots[8, n]
                    beyond = r if s != along else 0.0  # where a chain ends, its wall comes to the axis
                else:
                    beyond = 0.0
                    v0, v1, v2, r = x0 - balls[n, 0], x1 - balls[n, 1], x2 - balls[n, 2], balls[n, 3]
                rho = np.sqrt(v0 * v0 + v1 * v1 + v2 * v2)
                if r - rho - beyond > deepest:
                    deepest = r - rho - beyond
                    scale = r / rho - 1.0 if rho > 1e-6 * r else 0.0
                    out[i, 0], out[i, 1], out[i, 2] = x0 + scale * v0, x1 + scale * v1, x2 + scale * v2
    return out
