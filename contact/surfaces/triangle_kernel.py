"""The kernel's integral over a triangle in closed form, compiled.

With z the height of x above the plane and t the distance from its foot, e = (c − t²)/R², c = R² − z². Polar coordinates
about the foot turn J_n = ∫(c − t²)ⁿ over the triangle, where positive, into a sum over edges:
J_n = Σ [c^(n+1) (angle of the edge's parts beyond t² = c) − d ∫Q_n ds over its part within]/(2n + 2), d the distance
of the foot from the edge, Q_n(w) = ((c − w)^(n+1) − c^(n+1))/w a polynomial in w = t². Derivatives along the plane are
integrals over edges of the polynomial e³ and of its gradient, by Green's theorem; Gauss and Legendre's rule with four
points is exact for all of them.
"""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray

from contact.surfaces.segment_kernel import Terms

Floats = NDArray[np.float64]
_RULE = np.polynomial.legendre.leggauss(4)
NODES, WEIGHTS = (_RULE[0] + 1) / 2, _RULE[1] / 2


@njit(cache=True, error_model="numpy")
def integrate_triangles(
    plates: Floats, start: int, stop: int, weight: float, k: float, x: float, y: float, z: float
) -> Terms:
    """Σ weight/r² ∫e³ over plates[start:stop], rows of three corners and r, with its gradient and Hessian."""
    f = fx = fy = fz = fxx = fxy = fxz = fyy = fyz = fzz = 0.0
    for m in range(start, stop):
        ux, uy, uz = plates[m, 3] - plates[m, 0], plates[m, 4] - plates[m, 1], plates[m, 5] - plates[m, 2]
        vx, vy, vz = plates[m, 6] - plates[m, 0], plates[m, 7] - plates[m, 1], plates[m, 8] - plates[m, 2]
        nx, ny, nz = uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx
        size = np.sqrt(nx * nx + ny * ny + nz * nz)
        nx, ny, nz = nx / size, ny / size, nz / size
        height = (x - plates[m, 0]) * nx + (y - plates[m, 1]) * ny + (z - plates[m, 2]) * nz
        R2 = (k * plates[m, 9]) ** 2
        c = R2 - height * height
        if c <= 0.0:
            continue
        J1 = J2 = J3 = 0.0
        # Integrals over the edges of the kernel times the outward normal o, g; of its slope, o and (o offsetᵀ)
        gx = gy = gz = hxx = hxy = hxz = hyy = hyz = hzz = ox = oy = oz = 0.0
        for i in range(3):
            p, q = 3 * i, 3 * ((i + 1) % 3)
            ax, ay, az = plates[m, p] - x, plates[m, p + 1] - y, plates[m, p + 2] - z
            tx, ty, tz = plates[m, q] - x - ax, plates[m, q + 1] - y - ay, plates[m, q + 2] - z - az
            size = np.sqrt(tx * tx + ty * ty + tz * tz)
            tx, ty, tz = tx / size, ty / size, tz / size
            wx, wy, wz = ty * nz - tz * ny, tz * nx - tx * nz, tx * ny - ty * nx
            away = ax * wx + ay * wy + az * wz
            s0 = ax * tx + ay * ty + az * tz
            s1 = s0 + size
            low, high = s0, s0
            half = c - away * away
            if half > 0.0:
                half = np.sqrt(half)
                low, high = min(max(s0, -half), s1), max(min(s1, half), s0)
            inner = E0 = E1 = E2 = 0.0
            if high > low:
                inner = np.arctan2(high * away, away * away) - np.arctan2(low * away, away * away)
                for j in range(4):
                    s = low + (high - low) * NODES[j]
                    w = WEIGHTS[j] * (high - low)
                    v = s * s + away * away
                    e = c - v
                    J1 -= away * w * (v - 2.0 * c) / 4.0
                    J2 -= away * w * (-v * v + 3.0 * c * v - 3.0 * c * c) / 6.0
                    J3 -= away * w * (v**3 - 4.0 * c * v * v + 6.0 * c * c * v - 4.0 * c**3) / 8.0
                    E0 -= w * e**3
                    E1 -= 6.0 * w * e * e
                    E2 -= 6.0 * w * e * e * s
            angle = np.arctan2(s1 * away, away * away) - np.arctan2(s0 * away, away * away) - inner
            J1 += c**2 * angle / 4.0
            J2 += c**3 * angle / 6.0
            J3 += c**4 * angle / 8.0
            gx, gy, gz = gx + E0 * wx, gy + E0 * wy, gz + E0 * wz
            ox, oy, oz = ox - height * E1 * wx, oy - height * E1 * wy, oz - height * E1 * wz
            # The part along the plane of the offset of the edge's points: s t + away o
            bx, by, bz = E2 * tx + away * E1 * wx, E2 * ty + away * E1 * wy, E2 * tz + away * E1 * wz
            hxx, hxy, hxz = hxx + wx * bx, hxy + wx * by, hxz + wx * bz
            hyy, hyz, hzz = hyy + wy * by, hyz + wy * bz, hzz + wz * bz
        unit = weight / (plates[m, 9] ** 2 * R2**3)
        slope = -6.0 * height * J2
        bend = -6.0 * J2 + 24.0 * height * height * J1
        f += unit * J3
        fx, fy, fz = fx + unit * (gx + slope * nx), fy + unit * (gy + slope * ny), fz + unit * (gz + slope * nz)
        fxx += unit * (hxx + 2.0 * nx * ox + bend * nx * nx)
        fxy += unit * (hxy + nx * oy + ny * ox + bend * nx * ny)
        fxz += unit * (hxz + nx * oz + nz * ox + bend * nx * nz)
        fyy += unit * (hyy + 2.0 * ny * oy + bend * ny * ny)
        fyz += unit * (hyz + ny * oz + nz * oy + bend * ny * nz)
        fzz += unit * (hzz + 2.0 * nz * oz + bend * nz * nz)
    return f, fx, fy, fz, fxx, fxy, fxz, fyy, fyz, fzz
