"""The closest points of a convolution surface by Newton's method, compiled."""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray

from contact.surfaces.surface_kernels import BALL, NOWHERE, SEGMENT, TRIANGLE, Network, evaluate, locate

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

# Newton's method ends with a step that leaves less than this part of the radius, by its quadratic term.
SETTLED = 1e-12
# No foot is where the distance falls along the surface: twice the eigenvalue of M that rounding may leave below zero.
SADDLE = 2e-4


@njit(cache=True, error_model="numpy")
def closest(net: Network, x: Floats, guess: Floats, sign: float, limit: int) -> tuple[Floats, Floats, Floats, Floats]:
    """Distance (NaN where it fails), closest point, normal, Hessian of the distance by Newton's method.

    On y − x + μ∇g = 0, g = 0 with μ = n·(x − y)/|∇g|: the step is −g n/|∇g| and, in the tangent plane, z with
    M z = (x − y)_t − (d S)(step along n), M = I + d S, S = ∇²g/|∇g|, d = n·(x − y); |M| takes the place of M where that
    has negative eigenvalues, at a saddle of the distance. Steps end at half the least radius near. Values at the end of
    the last step are those at its start, taken on linearly.
    """
    constants, table, keys, cells, bounds, groups, slots, plates, balls = net
    distance, foot = np.full(len(x), np.nan), guess.copy()
    normal, curvature = np.zeros((len(x), 3)), np.zeros((len(x), 3, 3))
    place = NOWHERE
    for i in range(len(x)):
        x0, x1, x2 = x[i, 0], x[i, 1], x[i, 2]
        y0, y1, y2 = guess[i, 0], guess[i, 1], guess[i, 2]
        for iteration in range(limit):
            place = locate(constants, table, keys, y0, y1, y2, place)
            cell = place[3]
            if cell < 0:
                break
            F, n0, n1, n2, h0, h1, h2, h3, h4, h5 = evaluate(
                constants, cells, groups, slots, plates, balls, cell, y0, y1, y2
            )
            if F <= 0.0:
                break
            thin = bounds[cell, 2]
            longest = 0.5 * thin
            size = np.sqrt(n0 * n0 + n1 * n1 + n2 * n2)
            if size * longest < 1e-9:
                # On an axis any direction leads to the wall.
                y0, y1, y2 = y0 + 0.31 * longest, y1 + 0.22 * longest, y2 + 0.13 * longest
                continue
            unit = sign / size
            n0, n1, n2 = unit * n0, unit * n1, unit * n2
            h0, h1, h2, h3, h4, h5 = unit * h0, unit * h1, unit * h2, unit * h3, unit * h4, unit * h5
            # Tangents t, b by Duff et al. (2017).
            s = 1.0 if n2 >= 0.0 else -1.0
            a = -1.0 / (s + n2)
            c = n0 * n1 * a
            t0, t1, t2 = 1.0 + s * n0 * n0 * a, s * c, -s * n0
            b0, b1, b2 = c, s + n1 * n1 * a, -n1
            Hn0, Hn1, Hn2 = h0 * n0 + h1 * n1 + h2 * n2, h1 * n0 + h3 * n1 + h4 * n2, h2 * n0 + h4 * n1 + h5 * n2
            Ht0, Ht1, Ht2 = h0 * t0 + h1 * t1 + h2 * t2, h1 * t0 + h3 * t1 + h4 * t2, h2 * t0 + h4 * t1 + h5 * t2
            Hb0, Hb1, Hb2 = h0 * b0 + h1 * b1 + h2 * b2, h1 * b0 + h3 * b1 + h4 * b2, h2 * b0 + h4 * b1 + h5 * b2
            Snt, Snb = t0 * Hn0 + t1 * Hn1 + t2 * Hn2, b0 * Hn0 + b1 * Hn1 + b2 * Hn2
            Stt, Stb = t0 * Ht0 + t1 * Ht1 + t2 * Ht2, b0 * Ht0 + b1 * Ht1 + b2 * Ht2
            Sbb = b0 * Hb0 + b1 * Hb1 + b2 * Hb2
            v0, v1, v2 = x0 - y0, x1 - y1, x2 - y2
            d = v0 * n0 + v1 * n1 + v2 * n2
            along = (1.0 - F) / size * sign
            rt = v0 * t0 + v1 * t1 + v2 * t2 - d * along * Snt
            rb = v0 * b0 + v1 * b1 + v2 * b2 - d * along * Snb
            Mtt, Mtb, Mbb = 1.0 + d * Stt, d * Stb, 1.0 + d * Sbb
            det, saddle = Mtt * Mbb - Mtb * Mtb, False
            if not (det > 1e-9 and Mtt > 0.0):
                # |M| = (M² + |det M| I)/√(tr M² + 2 |det M|), kept from being singular
                trace = Mtt + Mbb
                saddle = trace - np.sqrt(max(trace * trace - 4.0 * det, 0.0)) < -SADDLE
                root = np.sqrt(Mtt * Mtt + 2.0 * Mtb * Mtb + Mbb * Mbb + 2.0 * abs(det)) + 1e-300
                Mtt, Mtb, Mbb = (
                    (Mtt * Mtt + Mtb * Mtb + abs(det)) / root + 1e-6,
                    Mtb * trace / root,
                    (Mbb * Mbb + Mtb * Mtb + abs(det)) / root + 1e-6,
                )
            over = 1.0 / (Mtt * Mbb - Mtb * Mtb)
            zt, zb = (Mbb * rt - Mtb * rb) * over, (Mtt * rb - Mtb * rt) * over
            step2 = along * along + zt * zt + zb * zb
            cut = 1.0
            if step2 > longest * longest:
                cut = longest / np.sqrt(step2)
            # Newton's steps may go to and fro about a ridge of the distance; short ones do not.
            if iteration >= 20 and step2 > 1e-4 * longest * longest:
                cut *= 0.3
            # Back to g = 0 by what its second derivative makes of the step
            Hnn = n0 * Hn0 + n1 * Hn1 + n2 * Hn2
            bow = along * (along * Hnn + 2.0 * (zt * Snt + zb * Snb)) + zt * (zt * Stt + 2.0 * zb * Stb) + zb * zb * Sbb
            up = along - 0.5 * bow if step2 < 1e-2 * longest * longest else along
            y0 += cut * (up * n0 + zt * t0 + zb * b0)
            y1 += cut * (up * n1 + zt * t1 + zb * b1)
            y2 += cut * (up * n2 + zt * t2 + zb * b2)
            bent2 = h0 * h0 + h3 * h3 + h5 * h5 + 2.0 * (h1 * h1 + h2 * h2 + h4 * h4)
            if step2 * step2 * bent2 < (SETTLED * thin) ** 2 and step2 < 1e-4 * longest * longest:
                if saddle and d > 0.0:
                    break  # on the wall opposite the nearest one: this distance is no bound
                # The unit normal turns by (I − n nᵀ) H m, of which the tangential parts are
                wt, wb = along * Snt + zt * Stt + zb * Stb, along * Snb + zt * Stb + zb * Sbb
                n0, n1, n2 = n0 + wt * t0 + wb * b0, n1 + wt * t1 + wb * b1, n2 + wt * t2 + wb * b2
                foot[i, 0], foot[i, 1], foot[i, 2] = y0, y1, y2
                normal[i, 0], normal[i, 1], normal[i, 2] = n0, n1, n2
                distance[i] = (x0 - y0) * n0 + (x1 - y1) * n1 + (x2 - y2) * n2
                # S (I + d S)⁻¹ = (S + d det S I)/det(I + d S) in two dimensions; beyond a focus it has no meaning.
                if det > 1e-9:
                    extra = d * (Stt * Sbb - Stb * Stb)
                    Stt, Stb, Sbb = (Stt + extra) / det, Stb / det, (Sbb + extra) / det
                at0, at1, at2 = Stt * t0 + Stb * b0, Stt * t1 + Stb * b1, Stt * t2 + Stb * b2
                ab0, ab1, ab2 = Stb * t0 + Sbb * b0, Stb * t1 + Sbb * b1, Stb * t2 + Sbb * b2
                curvature[i, 0, 0] = at0 * t0 + ab0 * b0
                curvature[i, 1, 1] = at1 * t1 + ab1 * b1
                curvature[i, 2, 2] = at2 * t2 + ab2 * b2
                curvature[i, 0, 1] = curvature[i, 1, 0] = at0 * t1 + ab0 * b1
                curvature[i, 0, 2] = curvature[i, 2, 0] = at0 * t2 + ab0 * b2
                curvature[i, 1, 2] = curvature[i, 2, 1] = at1 * t2 + ab1 * b2
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
            for n in range(groups[g, 1], groups[g, 2] if groups[g, 0] != TRIANGLE else 0):
                if groups[g, 0] == SEGMENT:
                    t0, t1, t2, length = slots[3, n], slots[4, n], slots[5, n], slots[6, n]
                    if length == 0.0:  # fills up a block
                        continue
                    v0, v1, v2 = x0 - slots[0, n], x1 - slots[1, n], x2 - slots[2, n]
                    s = min(max(v0 * t0 + v1 * t1 + v2 * t2, 0.0), length)
                    v0, v1, v2, r = v0 - s * t0, v1 - s * t1, v2 - s * t2, slots[7, n] + s * slots[8, n]
                else:
                    v0, v1, v2, r = x0 - balls[n, 0], x1 - balls[n, 1], x2 - balls[n, 2], balls[n, 3]
                rho = np.sqrt(v0 * v0 + v1 * v1 + v2 * v2)
                if r - rho > deepest:
                    deepest = r - rho
                    scale = r / rho - 1.0 if rho > 1e-6 * r else 0.0
                    out[i, 0], out[i, 1], out[i, 2] = x0 + scale * v0, x1 + scale * v1, x2 + scale * v2
    return out
