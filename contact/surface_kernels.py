"""The potential of a convolution surface with its derivatives, its closest points and first roots, compiled.

A primitive is the integral of the kernel e³/r over its axis, e = 1 − |x − a|²/(k r)² where positive. On the part of a
segment where e > 0 the integrand is a polynomial of degree 6 if r is constant there, so that Gauss and Legendre's rule
with 4 points is its closed form; where r varies linearly the integrand is rational, and 8 points are used. Boundary
terms vanish with e, so that derivatives go under the integral.
Of a chain of primitives the potential is F = (Σ f)^(2/7), which makes a straight tube's a quadratic function of the
distance from the axis; chains and balls (F = e of their centre, normalised) are joined by a p-norm, and each dent takes
away a multiple of its own e³.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from contact.triangle_kernel import add_triangle

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

SEGMENT, TRIANGLE, BALL, DENT = 0, 1, 2, 3
POWER = 2 / 7
# Below this potential a chain is as good as absent.
FAINT = 1e-12
_FOUR = np.polynomial.legendre.leggauss(4)
_EIGHT = np.polynomial.legendre.leggauss(8)
NODES4, WEIGHTS4 = (_FOUR[0] + 1) / 2, _FOUR[1] / 2
NODES8, WEIGHTS8 = (_EIGHT[0] + 1) / 2, _EIGHT[1] / 2


class Network(NamedTuple):
    """Primitives and the cells of their spatial index.

    Kernels take its arrays out once: passed on whole, or a row at a time, counting references would cost more than
    the arithmetic.

    kind, chain, data : per primitive, in the order of chains; data is a, t, ℓ, r, dr/ds of a segment; three corners
        and r of a triangle; centre, r of a ball; centre, radius, strength of a dent, (n, 10)
    constants : weights of the kernel in segments and in triangles, so that a long tube and a wide plate have F = 1 at
        r; k and p; cell width and corner of the grid [m], (8)
    table, keys : hash table of cells: number of a cell (−1 empty) and its three integer coordinates
    first, items : primitives whose support meets a cell: items[first[c]:first[c + 1]]
    slope, bend, thin, wide : per cell and within one cell width of it: bounds of |∇F| where F ≥ ½ and of −∂²F/∂s²
        where F ≥ 1, the least and the largest radius
    """

    kind: Ints
    chain: Ints
    data: Floats
    constants: Floats
    table: Ints
    keys: Ints
    first: Ints
    items: Ints
    slope: Floats
    bend: Floats
    thin: Floats
    wide: Floats


@njit(cache=True, error_model="numpy")
def slot(keys: Ints, table: Ints, i: int, j: int, k: int) -> int:
    """Where in the hash table a cell stands, or the empty place where it would."""
    mask = len(table) - 1
    at = (i * 73856093 ^ j * 19349663 ^ k * 83492791) & mask
    while table[at] >= 0 and not (keys[at, 0] == i and keys[at, 1] == j and keys[at, 2] == k):
        at = (at + 1) & mask
    return at


@njit(cache=True, error_model="numpy")
def find_cell(constants: Floats, table: Ints, keys: Ints, x: float, y: float, z: float) -> int:
    """The number of the cell that a point is in, −1 where nothing is near."""
    i = np.floor((x - constants[5]) / constants[4])
    j = np.floor((y - constants[6]) / constants[4])
    k = np.floor((z - constants[7]) / constants[4])
    # Beyond that many cells, or where x is not a number, there is no integer.
    if not (abs(i) < 1e9 and abs(j) < 1e9 and abs(k) < 1e9):
        return -1
    return int(table[slot(keys, table, int(i), int(j), int(k))])


@njit(cache=True, error_model="numpy")
def add_segment(data: Floats, n: int, weight: float, k: float, x: float, y: float, z: float, out: Floats) -> None:
    """Add a segment's ∫e³/r, its gradient and its Hessian."""
    tx, ty, tz, r0, taper = data[n, 3], data[n, 4], data[n, 5], data[n, 7], data[n, 8]
    px, py, pz = x - data[n, 0], y - data[n, 1], z - data[n, 2]
    s0 = px * tx + py * ty + pz * tz
    px, py, pz = px - s0 * tx, py - s0 * ty, pz - s0 * tz
    across = px * px + py * py + pz * pz
    k2 = k * k
    # e > 0 where a s² + 2 b s + c < 0; |x − a(s)| − k r(s) is convex in s, so that this is one interval.
    a = 1.0 - k2 * taper * taper
    if abs(a) < 1e-9:
        a = 1e-9
    b = -(s0 + k2 * r0 * taper)
    c = s0 * s0 + across - k2 * r0 * r0
    under = b * b - a * c
    if under <= 0.0:
        return
    root = np.sqrt(under)
    low, high = 0.0, data[n, 6]
    if a > 0.0:
        low, high = max(low, (-b - root) / a), min(high, (-b + root) / a)
    elif taper > 0.0:
        low = max(low, (-b - root) / a)
    else:
        high = min(high, (-b + root) / a)
    if high <= low:
        return
    length = high - low
    f = A0 = A1 = B0 = B1 = B2 = 0.0
    if taper == 0.0:
        inverse = 1.0 / (k2 * r0 * r0)
        for q in range(4):
            along = s0 - low - length * NODES4[q]
            e = 1.0 - (across + along * along) * inverse
            w = WEIGHTS4[q] * e
            B0 += w
            B1 += w * along
            B2 += w * along * along
            w *= e
            A0 += w
            A1 += w * along
            f += w * e
        unit = weight * length / r0
        f *= unit
        unit *= -6.0 * inverse
        A0, A1 = A0 * unit, A1 * unit
        unit *= -4.0 * inverse
        B0, B1, B2 = B0 * unit, B1 * unit, B2 * unit
    else:
        for q in range(8):
            s = low + length * NODES8[q]
            along = s0 - s
            r = 1.0 / (r0 + taper * s)
            inverse = r * r / k2
            e = 1.0 - (across + along * along) * inverse
            w = weight * length * WEIGHTS8[q] * r * e
            bb = 24.0 * inverse * inverse * w
            w *= e
            aa = -6.0 * inverse * w
            f += w * e
            A0 += aa
            A1 += aa * along
            B0 += bb
            B1 += bb * along
            B2 += bb * along * along
    out[0] += f
    out[1] += A0 * px + A1 * tx
    out[2] += A0 * py + A1 * ty
    out[3] += A0 * pz + A1 * tz
    # B0 p pᵀ + B1 (p tᵀ + t pᵀ) + B2 t tᵀ = p uᵀ + t vᵀ
    ux, uy, uz = B0 * px + B1 * tx, B0 * py + B1 * ty, B0 * pz + B1 * tz
    vx, vy, vz = B1 * px + B2 * tx, B1 * py + B2 * ty, B1 * pz + B2 * tz
    out[4] += A0 + px * ux + tx * vx
    out[5] += px * uy + tx * vy
    out[6] += px * uz + tx * vz
    out[7] += A0 + py * uy + ty * vy
    out[8] += py * uz + ty * vz
    out[9] += A0 + pz * uz + tz * vz


@njit(cache=True, error_model="numpy")
def raise_power(out: Floats, power: float) -> None:
    """f, ∇f, ∇²f of a positive f become those of f^power."""
    f = out[0]
    F = f**power
    first, second = power * F / f, power * (power - 1.0) * F / (f * f)
    gx, gy, gz = out[1], out[2], out[3]
    out[0] = F
    out[1], out[2], out[3] = first * gx, first * gy, first * gz
    out[4] = first * out[4] + second * gx * gx
    out[5] = first * out[5] + second * gx * gy
    out[6] = first * out[6] + second * gx * gz
    out[7] = first * out[7] + second * gy * gy
    out[8] = first * out[8] + second * gy * gz
    out[9] = first * out[9] + second * gz * gz


@njit(cache=True, error_model="numpy")
def add_round(data: Floats, n: int, k: float, x: float, y: float, z: float, out: Floats) -> None:
    """Set a ball's F = e/(1 − 1/k²), or take a dent's e³ times its strength away (k = 0)."""
    px, py, pz = x - data[n, 0], y - data[n, 1], z - data[n, 2]
    if k > 0.0:
        R2 = (k * data[n, 3]) ** 2
        scale = 1.0 / (1.0 - 1.0 / k**2)
        e = 1.0 - (px * px + py * py + pz * pz) / R2
        if e <= 0.0:
            return
        out[0] = scale * e
        A, B = -2.0 * scale / R2, 0.0
    else:
        R2 = data[n, 3] ** 2
        e = 1.0 - (px * px + py * py + pz * pz) / R2
        if e <= 0.0:
            return
        out[0] -= data[n, 4] * e**3
        A, B = 6.0 * data[n, 4] * e * e / R2, -24.0 * data[n, 4] * e / (R2 * R2)
    out[1] += A * px
    out[2] += A * py
    out[3] += A * pz
    out[4] += A + B * px * px
    out[5] += B * px * py
    out[6] += B * px * pz
    out[7] += A + B * py * py
    out[8] += B * py * pz
    out[9] += A + B * pz * pz


@njit(cache=True, error_model="numpy")
def evaluate(
    kind: Ints,
    chain: Ints,
    data: Floats,
    constants: Floats,
    table: Ints,
    keys: Ints,
    first: Ints,
    items: Ints,
    x: float,
    y: float,
    z: float,
    total: Floats,
    own: Floats,
) -> int:
    """F and its derivatives (value, x, y, z, xx, xy, xz, yy, yz, zz) into `total`; returns the cell, −1 without."""
    total[:] = 0.0
    cell = find_cell(constants, table, keys, x, y, z)
    if cell < 0:
        return cell
    at, end = first[cell], first[cell + 1]
    k, p, joined = constants[2], constants[3], 0
    while at < end and kind[items[at]] != DENT:
        own[:] = 0.0
        link, of = chain[items[at]], kind[items[at]]
        while at < end and chain[items[at]] == link:
            if of == SEGMENT:
                add_segment(data, items[at], constants[0], k, x, y, z, own)
            elif of == TRIANGLE:
                add_triangle(data[items[at]], constants[1], k, x, y, z, own)
            else:
                add_round(data, items[at], k, x, y, z, own)
            at += 1
        if own[0] <= FAINT:
            continue
        if of != BALL:
            raise_power(own, POWER)
        if joined == 0:
            total[:] = own
        else:
            if joined == 1:
                raise_power(total, p)
            raise_power(own, p)
            total += own
        joined += 1
    if joined > 1:
        raise_power(total, 1.0 / p)
    while at < end:
        add_round(data, items[at], 0.0, x, y, z, total)
        at += 1
    return cell


@njit(cache=True, error_model="numpy")
def potentials(net: Network, x: Floats) -> Floats:
    """F and its derivatives at each point, (points, 10)."""
    total, own = np.empty(10), np.empty(10)
    kind, chain, data, constants, table, keys, first, items, _, _, _, _ = net
    out = np.empty((len(x), 10))
    for i in range(len(x)):
        evaluate(kind, chain, data, constants, table, keys, first, items, x[i, 0], x[i, 1], x[i, 2], total, own)
        out[i] = total
    return out


@njit(cache=True, error_model="numpy")
def lower_bounds(net: Network, x: Floats) -> Floats:
    """The largest proven distance of each point from F = 1, with the sign of F − 1, (points)."""
    total, own = np.empty(10), np.empty(10)
    kind, chain, data, constants, table, keys, first, items, slopes, _, _, _ = net
    out = np.empty(len(x))
    for i in range(len(x)):
        cell = evaluate(kind, chain, data, constants, table, keys, first, items, x[i, 0], x[i, 1], x[i, 2], total, own)
        F = total[0]
        out[i] = -constants[4]
        if cell >= 0:
            # From beyond F = ½ the way leads through what is between.
            out[i] = max(min(max(F - 1.0, -0.5) / slopes[cell], constants[4]), -constants[4])
    return out


@njit(cache=True, error_model="numpy")
def closest(net: Network, x: Floats, guess: Floats, sign: float, limit: int) -> tuple[Floats, Floats, Floats, Floats]:
    """Distance, closest point, normal and Hessian of the distance by Newton's method; distance NaN where it fails.

    On y − x + μ∇g = 0, g = 0 with μ = n·(x − y)/|∇g|: the step is −g n/|∇g| and, in the tangent plane, z with
    (I + d S) z = (x − y)_t − (d S)(step along n), S = ∇²g/|∇g|, d = n·(x − y). Steps end at half the least radius near.
    What a step below √ε of the radius leaves is of its square: values at its end are then linear in it.
    """
    total, own = np.empty(10), np.empty(10)
    kind, chain, data, constants, table, keys, first, items, _, _, thin, _ = net
    distance, foot = np.full(len(x), np.nan), guess.copy()
    normal, curvature = np.zeros((len(x), 3)), np.zeros((len(x), 3, 3))
    for i in range(len(x)):
        x0, x1, x2 = x[i]
        y0, y1, y2 = guess[i]
        for iteration in range(limit):
            cell = evaluate(kind, chain, data, constants, table, keys, first, items, y0, y1, y2, total, own)
            if cell < 0 or total[0] <= 0.0:
                break
            longest = 0.5 * thin[cell]
            g = sign * (total[0] - 1.0)
            n0, n1, n2 = sign * total[1], sign * total[2], sign * total[3]
            size = np.sqrt(n0 * n0 + n1 * n1 + n2 * n2)
            if size * longest < 1e-9:
                # On an axis any direction leads to the wall.
                y0, y1, y2 = y0 + 0.31 * longest, y1 + 0.22 * longest, y2 + 0.13 * longest
                continue
            n0, n1, n2 = n0 / size, n1 / size, n2 / size
            unit = sign / size
            h0, h1, h2 = unit * total[4], unit * total[5], unit * total[6]
            h3, h4, h5 = unit * total[7], unit * total[8], unit * total[9]
            # Tangents t, b by Duff et al. (2017).
            s = 1.0 if n2 >= 0.0 else -1.0
            a = -1.0 / (s + n2)
            c = n0 * n1 * a
            t0, t1, t2 = 1.0 + s * n0 * n0 * a, s * c, -s * n0
            b0, b1, b2 = c, s + n1 * n1 * a, -n1
            Hn0, Hn1, Hn2 = (
                h0 * n0 + h1 * n1 + h2 * n2,
                h1 * n0 + h3 * n1 + h4 * n2,
                h2 * n0 + h4 * n1 + h5 * n2,
            )
            Ht0, Ht1, Ht2 = (
                h0 * t0 + h1 * t1 + h2 * t2,
                h1 * t0 + h3 * t1 + h4 * t2,
                h2 * t0 + h4 * t1 + h5 * t2,
            )
            Hb0, Hb1, Hb2 = (
                h0 * b0 + h1 * b1 + h2 * b2,
                h1 * b0 + h3 * b1 + h4 * b2,
                h2 * b0 + h4 * b1 + h5 * b2,
            )
            Stt, Stb, Sbb = (
                t0 * Ht0 + t1 * Ht1 + t2 * Ht2,
                b0 * Ht0 + b1 * Ht1 + b2 * Ht2,
                b0 * Hb0 + b1 * Hb1 + b2 * Hb2,
            )
            Snt, Snb = t0 * Hn0 + t1 * Hn1 + t2 * Hn2, b0 * Hn0 + b1 * Hn1 + b2 * Hn2
            v0, v1, v2 = x0 - y0, x1 - y1, x2 - y2
            d = v0 * n0 + v1 * n1 + v2 * n2
            along = -g / size
            rt = v0 * t0 + v1 * t1 + v2 * t2 - d * along * Snt
            rb = v0 * b0 + v1 * b1 + v2 * b2 - d * along * Snb
            Mtt, Mtb, Mbb = 1.0 + d * Stt, d * Stb, 1.0 + d * Sbb
            det = Mtt * Mbb - Mtb * Mtb
            if det > 1e-3 and Mtt > 0.0:
                zt, zb = (Mbb * rt - Mtb * rb) / det, (Mtt * rb - Mtb * rt) / det
            else:
                # No minimum of the distance to second order: down its gradient, by less than curvature allows.
                part = 0.5 / (1.0 + abs(d) * (abs(Stt) + 2.0 * abs(Stb) + abs(Sbb)))
                zt, zb = part * rt, part * rb
            step = np.sqrt(along * along + zt * zt + zb * zb)
            cut = min(1.0, longest / step) if step > 0.0 else 1.0
            # Newton's steps may go to and fro about a ridge of the distance; short ones do not.
            cut *= 1.0 if iteration < 20 else 0.3
            m0, m1, m2 = (
                along * n0 + zt * t0 + zb * b0,
                along * n1 + zt * t1 + zb * b1,
                along * n2 + zt * t2 + zb * b2,
            )
            y0, y1, y2 = y0 + cut * m0, y1 + cut * m1, y2 + cut * m2
            if step < 3e-8 * longest:
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
                for j in range(3):
                    tj = (t0, t1, t2)[j]
                    bj = (b0, b1, b2)[j]
                    at, ab = Stt * tj + Stb * bj, Stb * tj + Sbb * bj
                    curvature[i, j, 0] = at * t0 + ab * b0
                    curvature[i, j, 1] = at * t1 + ab * b1
                    curvature[i, j, 2] = at * t2 + ab * b2
                break
    return distance, foot, normal, curvature


@njit(cache=True, error_model="numpy")
def roots(net: Network, start: Floats, end: Floats, sign: float, tolerance: float) -> Floats:
    """The first s in [0, 1] with sign (F − 1) ≤ 0 on each segment, NaN without."""
    total, own = np.empty(10), np.empty(10)
    kind, chain, data, constants, table, keys, first, items, slopes, bends, _, wide = net
    out = np.full(len(start), np.nan)
    for i in range(len(start)):
        m0, m1, m2 = end[i, 0] - start[i, 0], end[i, 1] - start[i, 1], end[i, 2] - start[i, 2]
        length = np.sqrt(m0 * m0 + m1 * m1 + m2 * m2)
        if length > 0.0:
            m0, m1, m2 = m0 / length, m1 / length, m2 / length
        before, s = 0.0, 0.0
        while True:
            cell = evaluate(
                kind,
                chain,
                data,
                constants,
                table,
                keys,
                first,
                items,
                start[i, 0] + s * m0,
                start[i, 1] + s * m1,
                start[i, 2] + s * m2,
                total,
                own,
            )
            g = sign * (total[0] - 1.0)
            if g <= 0.0:
                break
            if s >= length:
                s = np.nan
                break
            before = s
            step = constants[4]
            if cell >= 0:
                # A tenth of the tolerance in F: |∇F| is near 2/r(k² − 1) at the wall; half of that for safety
                depth = 0.1 * tolerance / (wide[cell] * (constants[2] ** 2 - 1.0))
                reach = (min(g, 0.5) + depth) / slopes[cell]
                if sign > 0.0:
                    slope = total[1] * m0 + total[2] * m1 + total[3] * m2
                    bend = bends[cell]
                    reach = max(reach, (slope + np.sqrt(slope * slope + 2.0 * bend * (g + depth))) / bend)
                step = min(step, reach)
            s = min(s + step, length)
        if s > 0.0:
            low, high = before, s
            for _ in range(100):
                # total holds the derivatives at the last s tried
                g = sign * (total[0] - 1.0)
                slope = sign * (total[1] * m0 + total[2] * m1 + total[3] * m2)
                if g > 0.0:
                    low = s
                else:
                    high = s
                new = s - g / slope if slope < 0.0 else low
                if not (low < new < high):
                    new = 0.5 * (low + high)
                settled = abs(new - s) <= 4e-16 * length or new <= low or new >= high
                s = new
                if settled:
                    break
                evaluate(
                    kind,
                    chain,
                    data,
                    constants,
                    table,
                    keys,
                    first,
                    items,
                    start[i, 0] + s * m0,
                    start[i, 1] + s * m1,
                    start[i, 2] + s * m2,
                    total,
                    own,
                )
        out[i] = s / length if length > 0.0 else s
    return out
