"""Mortar integrals over pairs of facets on non-matching meshes, compiled.

A facet of the multiplier side is cut into flat pieces, one where it is straight. The pieces of the other side are
projected on a piece along its normal and clipped by it (Sutherland and Hodgman 1974); a quadrature rule on each clipped
polygon gives points ξ of the facet. There x(ξ), the area element and the unit normal n are those of the true curved
facet, and the point of the other side is where the ray from x along n meets its true curved facet,

    x + g n = x′(ξ′),    g > 0 where the surfaces are apart.

Force and counterforce then act along one line: their moments cancel as their resultants do. Polygons of one piece tile
it without gap or overlap, and on straight facets the rule is exact for products of the shape functions.
Oracle: the same integrals by convex hulls and numpy in the tests.

Source: Puso and Laursen, CMAME 193 (2004) for segments on flat pieces; Puso, IJNME 59 (2004) for curved faces.
"""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

FACING = -0.1  # pieces whose normals have a larger product do not look at each other
NEWTON = 12
Integrals = tuple[Floats, Floats, Floats, Floats, Floats, Floats, Floats]


@njit(cache=True)
def _shape(k: int, xi: Floats, N: Floats, dN: Floats) -> None:
    """Shape functions and their derivatives of an edge with 2 or 3 nodes, or a triangle with 3 or 6."""
    if len(xi) == 1:
        s = xi[0]
        if k == 2:
            N[0], N[1] = 1.0 - s, s
            dN[0, 0], dN[1, 0] = -1.0, 1.0
        else:
            N[0], N[1], N[2] = (1.0 - s) * (1.0 - 2.0 * s), s * (2.0 * s - 1.0), 4.0 * s * (1.0 - s)
            dN[0, 0], dN[1, 0], dN[2, 0] = 4.0 * s - 3.0, 4.0 * s - 1.0, 4.0 - 8.0 * s
        return
    a, b, c = 1.0 - xi[0] - xi[1], xi[0], xi[1]
    if k == 3:
        N[0], N[1], N[2] = a, b, c
        dN[0, 0], dN[0, 1], dN[1, 0], dN[1, 1], dN[2, 0], dN[2, 1] = -1.0, -1.0, 1.0, 0.0, 0.0, 1.0
        return
    N[0], N[1], N[2] = a * (2.0 * a - 1.0), b * (2.0 * b - 1.0), c * (2.0 * c - 1.0)
    N[3], N[4], N[5] = 4.0 * a * b, 4.0 * b * c, 4.0 * c * a
    dN[0, 0] = dN[0, 1] = 1.0 - 4.0 * a
    dN[1, 0], dN[1, 1] = 4.0 * b - 1.0, 0.0
    dN[2, 0], dN[2, 1] = 0.0, 4.0 * c - 1.0
    dN[3, 0], dN[3, 1] = 4.0 * (a - b), -4.0 * b
    dN[4, 0], dN[4, 1] = 4.0 * c, 4.0 * b
    dN[5, 0], dN[5, 1] = -4.0 * c, 4.0 * (a - c)


@njit(cache=True)
def _map(x: Floats, f: int, N: Floats, dN: Floats, at: Floats, tangents: Floats) -> None:
    """The place Σ N x of a point of facet f, and its tangents there."""
    _, k, D = x.shape
    at[:] = 0.0
    tangents[:] = 0.0
    for a in range(k):
        for d in range(D):
            at[d] += N[a] * x[f, a, d]
            for j in range(D - 1):
                tangents[j, d] += dN[a, j] * x[f, a, d]


@njit(cache=True)
def _dot(a: Floats, b: Floats) -> float:
    """a·b."""
    total = 0.0
    for d in range(len(a)):
        total += a[d] * b[d]
    return total


@njit(cache=True)
def _product(a: Floats, b: Floats, c: Floats) -> None:
    """c = a × b."""
    c[0] = a[1] * b[2] - a[2] * b[1]
    c[1] = a[2] * b[0] - a[0] * b[2]
    c[2] = a[0] * b[1] - a[1] * b[0]


@njit(cache=True)
def _cross(t: Floats, n: Floats) -> float:
    """The normal of the tangents' plane into `n`, and the size of the area element."""
    if len(n) == 2:
        n[0], n[1] = t[0, 1], -t[0, 0]
    else:
        _product(t[0], t[1], n)
    size = np.sqrt(_dot(n, n))
    for d in range(len(n)):
        n[d] /= size
    return float(size)


@njit(cache=True)
def _meet(x: Floats, f: int, at: Floats, n: Floats, xi: Floats, N: Floats, dN: Floats, y: Floats, t: Floats) -> float:
    """The gap g along n from `at` to facet f, whose point ξ, N and y become; Newton's method from ξ."""
    _, k, D = x.shape
    a, b = xi[0], xi[-1]
    spare = np.empty(3)
    for _ in range(NEWTON):
        _shape(k, xi, N, dN)
        _map(x, f, N, dN, y, t)
        # (y − at) + t δ = g n, solved for δ along the facet
        if D == 2:
            rx, ry = at[0] - y[0], at[1] - y[1]
            det = t[0, 1] * n[0] - t[0, 0] * n[1]
            step = (ry * n[0] - rx * n[1]) / det
            xi[0] += step
            size = abs(step)
        else:
            rx, ry, rz = at[0] - y[0], at[1] - y[1], at[2] - y[2]
            _product(t[1], n, spare)
            det = _dot(t[0], spare)
            first = (rx * spare[0] + ry * spare[1] + rz * spare[2]) / det
            _product(n, t[0], spare)
            second = (rx * spare[0] + ry * spare[1] + rz * spare[2]) / det
            xi[0] += first
            xi[1] += second
            size = max(abs(first), abs(second))
        if size < 1e-9:  # its square is below round-off
            break
    if not (abs(xi[0] - a) < 1.0 and abs(xi[-1] - b) < 1.0):
        xi[0], xi[-1] = a, b  # no foot near: the point found by projection
    _shape(k, xi, N, dN)
    _map(x, f, N, dN, y, t)
    g = 0.0
    for d in range(D):
        g += n[d] * (y[d] - at[d])
    return g


@njit(cache=True)
def _clip(polygon: Floats, count: int, other: Floats) -> int:
    """Cut a polygon in reference coordinates (u, v) to u ≥ 0, v ≥ 0, u + v ≤ 1; the number of corners left."""
    for side in range(3):
        kept = 0
        for i in range(count):
            j = (i + 1) % count
            if side < 2:
                d0, d1 = polygon[i, side], polygon[j, side]
            else:
                d0, d1 = 1.0 - polygon[i, 0] - polygon[i, 1], 1.0 - polygon[j, 0] - polygon[j, 1]
            if d0 >= 0.0:
                other[kept, 0], other[kept, 1] = polygon[i, 0], polygon[i, 1]
                kept += 1
            if (d0 > 0.0 and d1 < 0.0) or (d0 < 0.0 and d1 > 0.0):
                s = d0 / (d0 - d1)
                for e in range(2):
                    other[kept, e] = polygon[i, e] + s * (polygon[j, e] - polygon[i, e])
                kept += 1
        count = kept
        for i in range(count):
            polygon[i, 0], polygon[i, 1] = other[i, 0], other[i, 1]
    return count


@njit(cache=True, error_model="numpy")
def integrate(
    pairs: Ints,
    xs: Floats,
    normals: Floats,
    pieces: Floats,
    corners: Floats,
    xm: Floats,
    pieces_m: Floats,
    corners_m: Floats,
    points: Floats,
    weights: Floats,
    clearance: Floats,
    reach: float,
    depth: float,
    axisymmetric: bool,
) -> Integrals:
    """Integrals over the part of each pair's multiplier facet that looks at the other facet.

    Parameters
    ----------
    pairs : (p, 2) facets of the multiplier side and of the other
    xs, normals : (f, k, D) nodes of the multiplier side and the normals there, out of the body
    pieces, corners : (s, d, D) reference and (f, s, d, D) true corners of the flat pieces, d = D nodes each
    xm, pieces_m, corners_m : the same of the other side
    points, weights : a rule on the unit interval or triangle
    clearance : (f, k) what the gap has at the nodes of the multiplier side besides [m]
    reach, depth : how far apart, and how deep in each other, pieces may be [m]

    Returns
    -------
    covered (p), the part of the reference facet; w_i = ∫ψ_i (p, d); ∫ψ_i ψ_j (p, d, d); ∫ψ_i g (p, d);
    ∫ψ_i n (p, d, D); ∫ψ_i N_k n (p, d, k, D) of the multiplier side and ∫ψ_i N′_k n of the other
    """
    P, D = len(pairs), xs.shape[2]
    d, ks, km = D, xs.shape[1], xm.shape[1]
    covered, area, gram, gap = np.zeros(P), np.zeros((P, d)), np.zeros((P, d, d)), np.zeros((P, d))
    mean, own, other = np.zeros((P, d, D)), np.zeros((P, d, ks, D)), np.zeros((P, d, km, D))
    N, dN, M, dM = np.empty(ks), np.empty((ks, D - 1)), np.empty(km), np.empty((km, D - 1))
    x, y, n, t, tm = np.empty(D), np.empty(D), np.empty(D), np.empty((D - 1, D)), np.empty((D - 1, D))
    e, em, flat, flat_m, r = np.empty((D - 1, D)), np.empty((D - 1, D)), np.empty(D), np.empty(D), np.empty(D)
    q, polygon, spare = np.empty((d, D - 1)), np.empty((12, 2)), np.empty((12, 2))
    z, s, xi, eta, psi = np.empty(D - 1), np.empty(D - 1), np.empty(D - 1), np.empty(D - 1), np.empty(d)
    for p in range(P):
        f, h = pairs[p, 0], pairs[p, 1]
        for a in range(len(pieces)):
            for j in range(D - 1):
                for k in range(D):
                    e[j, k] = corners[f, a, j + 1, k] - corners[f, a, 0, k]
            size = _cross(e, flat)
            if D == 2:
                scale = abs(pieces[a, 1, 0] - pieces[a, 0, 0])
                guu, guv, gvv, det = size * size, 0.0, 1.0, size * size
            else:
                scale = abs(
                    (pieces[a, 1, 0] - pieces[a, 0, 0]) * (pieces[a, 2, 1] - pieces[a, 0, 1])
                    - (pieces[a, 1, 1] - pieces[a, 0, 1]) * (pieces[a, 2, 0] - pieces[a, 0, 0])
                )
                guu, guv, gvv = _dot(e[0], e[0]), _dot(e[0], e[1]), _dot(e[1], e[1])
                det = size * size
            for b in range(len(pieces_m)):
                for j in range(D - 1):
                    for k in range(D):
                        em[j, k] = corners_m[h, b, j + 1, k] - corners_m[h, b, 0, k]
                _cross(em, flat_m)
                if _dot(flat, flat_m) > FACING:
                    continue
                # The corners of the other piece in the reference coordinates of this one
                for c in range(d):
                    for k in range(D):
                        r[k] = corners_m[h, b, c, k] - corners[f, a, 0, k]
                    u = _dot(e[0], r)
                    if D == 2:
                        q[c, 0] = u / guu
                    else:
                        v = _dot(e[1], r)
                        q[c, 0], q[c, 1] = (gvv * u - guv * v) / det, (guu * v - guv * u) / det
                if D == 2:
                    polygon[0, 0], polygon[1, 0] = max(0.0, min(q[0, 0], q[1, 0])), min(1.0, max(q[0, 0], q[1, 0]))
                    parts = 1 if polygon[1, 0] > polygon[0, 0] else 0
                    z[0] = (polygon[0, 0] + polygon[1, 0]) / 2
                    det_m = q[1, 0] - q[0, 0]
                else:
                    if (
                        max(q[0, 0], q[1, 0], q[2, 0]) <= 0.0
                        or max(q[0, 1], q[1, 1], q[2, 1]) <= 0.0
                        or min(q[0, 0] + q[0, 1], q[1, 0] + q[1, 1], q[2, 0] + q[2, 1]) >= 1.0
                    ):
                        continue
                    for c in range(3):
                        polygon[c, 0], polygon[c, 1] = q[c, 0], q[c, 1]
                    count = _clip(polygon, 3, spare)
                    parts = count - 2
                    z[:] = 0.0
                    for c in range(count):
                        z[0] += polygon[c, 0] / count
                        z[1] += polygon[c, 1] / count
                    det_m = (q[1, 0] - q[0, 0]) * (q[2, 1] - q[0, 1]) - (q[1, 1] - q[0, 1]) * (q[2, 0] - q[0, 0])
                if parts <= 0:
                    continue
                _within(z, q, det_m, s)
                distance = 0.0
                for k in range(D):
                    away = corners_m[h, b, 0, k] - corners[f, a, 0, k]
                    for j in range(D - 1):
                        away += s[j] * em[j, k]
                    distance += flat[k] * away
                if distance > reach or distance < -depth:
                    continue
                for part in range(parts):
                    if D == 2:
                        part_size = polygon[1, 0] - polygon[0, 0]
                    else:
                        part_size = abs(
                            (polygon[part + 1, 0] - polygon[0, 0]) * (polygon[part + 2, 1] - polygon[0, 1])
                            - (polygon[part + 1, 1] - polygon[0, 1]) * (polygon[part + 2, 0] - polygon[0, 0])
                        )
                    for g in range(len(points)):
                        for j in range(D - 1):
                            z[j] = polygon[0, j]
                            for i in range(D - 1):
                                z[j] += points[g, i] * (polygon[part + i + 1, j] - polygon[0, j])
                        _within(z, q, det_m, s)
                        psi[0] = 1.0
                        for j in range(D - 1):
                            xi[j], eta[j] = pieces[a, 0, j], pieces_m[b, 0, j]
                            for i in range(D - 1):
                                xi[j] += z[i] * (pieces[a, i + 1, j] - pieces[a, 0, j])
                                eta[j] += s[i] * (pieces_m[b, i + 1, j] - pieces_m[b, 0, j])
                            psi[j + 1] = xi[j]
                            psi[0] -= xi[j]
                        _shape(ks, xi, N, dN)
                        _map(xs, f, N, dN, x, t)
                        w = weights[g] * part_size * scale
                        covered[p] += w
                        w *= _cross(t, n)
                        if axisymmetric:
                            w *= 2.0 * np.pi * x[0]
                        for k in range(D):
                            n[k] = 0.0
                            for j in range(ks):
                                n[k] += N[j] * normals[f, j, k]
                        length = np.sqrt(_dot(n, n))
                        for k in range(D):
                            n[k] /= length
                        apart = _meet(xm, h, x, n, eta, M, dM, y, tm)
                        for j in range(ks):
                            apart += N[j] * clearance[f, j]
                        for i in range(d):
                            wi = w * psi[i]
                            area[p, i] += wi
                            gap[p, i] += wi * apart
                            for j in range(d):
                                gram[p, i, j] += wi * psi[j]
                            for k in range(D):
                                wn = wi * n[k]
                                mean[p, i, k] += wn
                                for j in range(ks):
                                    own[p, i, j, k] += wn * N[j]
                                for j in range(km):
                                    other[p, i, j, k] += wn * M[j]
    return covered, area, gram, gap, mean, own, other


@njit(cache=True, error_model="numpy")
def _within(z: Floats, q: Floats, det: float, s: Floats) -> None:
    """Coordinates s of the point z in the simplex with corners q."""
    if len(z) == 1:
        s[0] = (z[0] - q[0, 0]) / det
        return
    u, v = z[0] - q[0, 0], z[1] - q[0, 1]
    s[0] = (u * (q[2, 1] - q[0, 1]) - v * (q[2, 0] - q[0, 0])) / det
    s[1] = (v * (q[1, 0] - q[0, 0]) - u * (q[1, 1] - q[0, 1])) / det
