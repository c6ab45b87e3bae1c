"""The kernel's integral over segments of linearly varying radius, compiled for whole vectors of segments.

∫e³/r ds over the part of a segment where e = 1 − |x − a|²/(k r)² > 0: one interval, as |x − a(s)| − k r(s) is convex.
There Gauss and Legendre's rule with 4 points is the closed form where r is constant, the integrand being a polynomial
of degree 6; `pieces` divides tapered segments until its error is near 1e-8 of F. Boundary terms vanish with e, so that
derivatives go under the integral.
"""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]
Terms = tuple[float, float, float, float, float, float, float, float, float, float]

# Segments of a chain come in blocks of as many as a processor adds at once, and empty ones fill them up. One that adds
# eight would add a block of four one by one.
BLOCK = 8
COLUMNS = 10
QUADRATURE = 1e-8
_RULE = np.polynomial.legendre.leggauss(4)
NODES, WEIGHTS = (_RULE[0] + 1) / 2, _RULE[1] / 2


def pieces(segments: Floats, reach: float) -> tuple[Floats, Ints]:
    """Segments a, b, r_a, r_b divided evenly until four points integrate them to QUADRATURE, and whose part each is.

    About the middle of a segment of length 2 l the integrand's leading term that four points miss is
    28 (r′l/r)² (l/k r)⁶ t⁸, of which they miss 0.006. Beyond l = k r the kernel ends.
    """
    r = segments[:, 6:].min(axis=1)
    length = np.linalg.norm(segments[:, 3:6] - segments[:, :3], axis=1)
    taper = np.abs(segments[:, 7] - segments[:, 6]) / length
    with np.errstate(divide="ignore"):
        half = reach * (QUADRATURE / (0.16 * (reach * taper) ** 2)) ** 0.125
    count = np.where(half < reach, np.ceil(length / (2 * half * r)), 1.0).astype(np.int64)
    of = np.repeat(np.arange(len(segments)), count)
    part = (np.arange(len(of)) - np.repeat(np.cumsum(count) - count, count)) / count[of]
    start, end = segments[:, [0, 1, 2, 6]][of], segments[:, [3, 4, 5, 7]][of]
    low = start + part[:, None] * (end - start)
    high = np.where((part + 1 / count[of] > 1 - 1e-9)[:, None], end, low + (end - start) / count[of][:, None])
    return np.column_stack([low[:, :3], high[:, :3], low[:, 3], high[:, 3]]), of


def columns(segments: Floats, reach: float) -> Floats:
    """What the kernel takes of each segment: a, t, ℓ, r, dr/ds and 1/(1 − k² (dr/ds)²), (n, COLUMNS)."""
    along = segments[:, 3:6] - segments[:, :3]
    length = np.linalg.norm(along, axis=1)
    taper = (segments[:, 7] - segments[:, 6]) / length
    spread = 1 - (reach * taper) ** 2
    spread[np.abs(spread) < 1e-9] = 1e-9
    return np.column_stack([segments[:, :3], along / length[:, None], length, segments[:, 6], taper, 1 / spread])


@njit(cache=True, error_model="numpy", forceinline=True, fastmath={"reassoc", "contract"})
def integrate_segments(
    slots: Floats,
    start: int,
    stop: int,
    weight: float,
    k2: float,
    inverse_k2: float,
    x: float,
    y: float,
    z: float,
) -> Terms:
    """Σ weight ∫e³/r over slots[:, start:stop], its gradient and Hessian: value, x, y, z, xx, xy, xz, yy, yz, zz."""
    f = fx = fy = fz = fxx = fxy = fxz = fyy = fyz = fzz = 0.0
    # An unsigned index needs no test for negative ones, which would keep the loop from being vectorised.
    for n in range(np.uint64(start), np.uint64(stop)):
        tx, ty, tz = slots[3, n], slots[4, n], slots[5, n]
        px, py, pz = x - slots[0, n], y - slots[1, n], z - slots[2, n]
        end, r0, taper, opening = slots[6, n], slots[7, n], slots[8, n], slots[9, n]
        s0 = px * tx + py * ty + pz * tz
        px, py, pz = px - s0 * tx, py - s0 * ty, pz - s0 * tz
        across = px * px + py * py + pz * pz
        # e > 0 where s² − 2 b s + c < 0, times 1 − k² (dr/ds)²; where that is negative, beyond a root
        b = (s0 + k2 * r0 * taper) * opening
        c = (s0 * s0 + across - k2 * r0 * r0) * opening
        under = b * b - c
        root = np.sqrt(under if under > 0.0 else 0.0)
        root = root if opening > 0.0 else -root
        low, high = b - root, b + root
        low = 0.0 if (opening < 0.0 and taper < 0.0) or low < 0.0 else low
        high = end if (opening < 0.0 and taper > 0.0) or high > end else high
        length = high - low
        length = length if length > 0.0 else 0.0
        A0 = A1 = B0 = B1 = B2 = 0.0
        scale = weight * length
        for q in range(4):
            s = low + length * NODES[q]
            along = s0 - s
            one_r = 1.0 / (r0 + taper * s)
            inverse = one_r * one_r * inverse_k2
            e = 1.0 - (across + along * along) * inverse
            w = scale * WEIGHTS[q] * one_r * e
            bb = 24.0 * inverse * inverse * w
            w *= e
            aa = -6.0 * inverse * w
            f += w * e
            A0 += aa
            A1 += aa * along
            B0 += bb
            bb *= along
            B1 += bb
            B2 += bb * along
        fx += A0 * px + A1 * tx
        fy += A0 * py + A1 * ty
        fz += A0 * pz + A1 * tz
        # B0 p pᵀ + B1 (p tᵀ + t pᵀ) + B2 t tᵀ = p uᵀ + t vᵀ
        ux, uy, uz = B0 * px + B1 * tx, B0 * py + B1 * ty, B0 * pz + B1 * tz
        vx, vy, vz = B1 * px + B2 * tx, B1 * py + B2 * ty, B1 * pz + B2 * tz
        fxx += A0 + px * ux + tx * vx
        fxy += px * uy + tx * vy
        fxz += px * uz + tx * vz
        fyy += A0 + py * uy + ty * vy
        fyz += py * uz + ty * vz
        fzz += A0 + pz * uz + tz * vz
    return f, fx, fy, fz, fxx, fxy, fxz, fyy, fyz, fzz
