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

from contact.segment_kernel import Terms

Floats = NDArray[np.float64]
_RULE = np.polynomial.legendre.leggauss(4)
NODES, WEIGHTS = (_RULE[0] + 1) / 2, _RULE[1] / 2


@njit(cache=True, error_model="numpy")
def integrate_triangles(
    plates: Floats, start: int, stop: int, weight: float, k: float, x: float, y: float, z: float
) -> Terms:
    """Σ weight/r² ∫e³ over plates[start:stop], rows of three corners and r, with its gradient and Hessian."""
    total, out = 0.0, np.zeros(9)
    for m in range(start, stop):
        d = plates[m]
        r = d[9]
        R2 = (k * r) ** 2
        p = np.array([x, y, z])
        n = np.cross(d[3:6] - d[:3], d[6:9] - d[:3])
        n /= np.sqrt(n @ n)
        height = (p - d[:3]) @ n
        c = R2 - height * height
        if c <= 0.0:
            continue
        J1 = J2 = J3 = 0.0
        gradient, mixed, hessian = np.zeros(3), np.zeros(3), np.zeros((3, 3))
        for i in range(3):
            a = d[3 * i : 3 * i + 3] - p + height * n
            j = (i + 1) % 3
            b = d[3 * j : 3 * j + 3] - p + height * n
            length = np.sqrt((b - a) @ (b - a))
            t = (b - a) / length
            out_of = np.cross(t, n)
            away = a @ out_of
            s0, s1 = a @ t, b @ t
            half = c - away * away
            low, high = s0, s0
            if half > 0.0:
                half = np.sqrt(half)
                low, high = min(max(s0, -half), s1), max(min(s1, half), s0)
            inner = 0.0
            if high > low:
                inner = np.arctan2(high * away, away * away) - np.arctan2(low * away, away * away)
                for q in range(4):
                    s = low + (high - low) * NODES[q]
                    w = WEIGHTS[q] * (high - low)
                    v = s * s + away * away
                    e = c - v
                    J1 -= away * w * (v - 2.0 * c) / 4.0
                    J2 -= away * w * (-v * v + 3.0 * c * v - 3.0 * c * c) / 6.0
                    J3 -= away * w * (v**3 - 4.0 * c * v * v + 6.0 * c * c * v - 4.0 * c**3) / 8.0
                    offset = s * t + away * out_of
                    gradient -= w * e**3 * out_of
                    mixed += 6.0 * w * e * e * height * out_of
                    for row in range(3):
                        for column in range(3):
                            hessian[row, column] -= 6.0 * w * e * e * out_of[row] * offset[column]
            angle = np.arctan2(s1 * away, away * away) - np.arctan2(s0 * away, away * away) - inner
            J1 += c**2 * angle / 4.0
            J2 += c**3 * angle / 6.0
            J3 += c**4 * angle / 8.0
        unit = weight / (r * r * R2**3)
        total += unit * J3
        normal = -6.0 * height * J2
        bend = -6.0 * J2 + 24.0 * height * height * J1
        for row in range(3):
            out[row] += unit * (gradient[row] + normal * n[row])
        at = 3
        for row in range(3):
            for column in range(row, 3):
                sides = n[row] * mixed[column] + n[column] * mixed[row]
                out[at] += unit * (hessian[row, column] + sides + bend * n[row] * n[column])
                at += 1
    return total, out[0], out[1], out[2], out[3], out[4], out[5], out[6], out[7], out[8]
