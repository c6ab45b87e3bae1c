"""The kernel's integral over segments of linearly varying radius, compiled for whole vectors of segments.

∫e³/r ds over the part of a segment where e = 1 − |x − a|²/(k r)² > 0: one interval, as |x − a(s)| − k r(s) is convex.
There Gauss and Legendre's rule with 4 points is the closed form where r is constant, the integrand being a polynomial
of degree 6; `pieces` divides tapered segments until its error is below 1e-8. Boundary terms vanish with e, so that
derivatives go under the integral.
"""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]
Terms = tuple[float, float, float, float, float, float, float, float, float, float]

# Segments of a chain come in blocks of as many as a processor adds at once; empty ones fill them up.
BLOCK = 4
COLUMNS = 11
RATIO = 0.12
_RULE = np.polynomial.legendre.leggauss(4)
NODES, WEIGHTS = (_RULE[0] + 1) / 2, _RULE[1] / 2


def pieces(segments: Floats) -> tuple[Floats, Ints]:
    """Segments a, b, r_a, r_b divided evenly in radius until it varies by no more than RATIO, and whose part each is."""
    count = np.ceil(np.abs(np.log(segments[:, 7] / segments[:, 6])) / RATIO).astype(np.int64)
    count = np.maximum(count, 1)
    of = np.repeat(np.arange(len(segments)), count)
    place = np.arange(len(of)) - np.repeat(np.cumsum(count) - count, count)
    a, b, r = segments[of, :3], segments[of, 3:6], segments[of, 6:]

    def share(j: Ints) -> Floats:
        # Radii in geometric progression; of a constant one, length.
        ratio = (r[:, 1] / r[:, 0]) ** (j / count[of]) - 1
        whole = r[:, 1] / r[:, 0] - 1
        part: Floats = np.divide(ratio, whole, out=j / count[of], where=count[of] > 1)
        return part

    low, high = share(place)[:, None], share(place + 1)[:, None]
    radii = [r[:, 0] + s[:, 0] * (r[:, 1] - r[:, 0]) for s in (low, high)]
    return np.column_stack([a + low * (b - a), a + high * (b - a), *radii]), of


def columns(segments: Floats, reach: float) -> Floats:
    """What the kernel takes of each segment: a, t, ℓ, r, dr/ds, 1/(1 − k² (dr/ds)²) and 1/r in the middle, (n, COLUMNS)."""
    along = segments[:, 3:6] - segments[:, :3]
    length = np.linalg.norm(along, axis=1)
    taper = (segments[:, 7] - segments[:, 6]) / length
    spread = 1 - (reach * taper) ** 2
    spread[np.abs(spread) < 1e-9] = 1e-9
    middle = segments[:, 6:].mean(axis=1)
    return np.column_stack([segments[:, :3], along / length[:, None], length, segments[:, 6], taper, 1 / spread, 1 / middle])


@njit(cache=True, error_model="numpy", forceinline=True, fastmath={"reassoc", "contract"})
def integrate_segments(
    slots: Floats, start: int, stop: int, weight: float, k2: float, x: float, y: float, z: float
) -> Terms:
    """Σ weight ∫e³/r over slots[:, start:stop], its gradient and Hessian: value, x, y, z, xx, xy, xz, yy, yz, zz."""
    f = fx = fy = fz = fxx = fxy = fxz = fyy = fyz = fzz = 0.0
    inverse_k2 = 1.0 / k2
    # An unsigned index needs no test for negative ones, which would keep the loop from being vectorised.
    for n in range(np.uint64(start), np.uint64(stop)):
        tx, ty, tz = slots[3, n], slots[4, n], slots[5, n]
        px, py, pz = x - slots[0, n], y - slots[1, n], z - slots[2, n]
        end, r0, taper, opening, thin = slots[6, n], slots[7, n], slots[8, n], slots[9, n], slots[10, n]
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
            # 1/r about the middle of the segment, where |u| ≤ RATIO/2: to 5e-10
            u = 1.0 - (r0 + taper * s) * thin
            one_r = thin * (1.0 + u * (1.0 + u * (1.0 + u * (1.0 + u * (1.0 + u * (1.0 + u))))))
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
