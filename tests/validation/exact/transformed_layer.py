"""A layer of plane-strain elasticity for one wave number, by the matrix exponential of the transformed equations.

u_x = U sin kx, u_y = V cos kx, σ_yy = S cos kx, σ_xy = T sin kx; y = (U, V, S, T)(y), y′ = M y by Hooke's law and
equilibrium. It shares nothing with the symbols L that it checks.
"""

from __future__ import annotations

import numpy as np
from scipy.linalg import expm


def transfer(k, H, E, nu):
    """y(H) = transfer @ y(0), shape (4, 4)."""
    G, lam = E / (2 * (1 + nu)), E * nu / ((1 + nu) * (1 - 2 * nu))
    modulus = lam + 2 * G
    M = np.array(
        [
            [0, k, 0, 1 / G],
            [-lam * k / modulus, 0, 1 / modulus, 0],
            [0, 0, 0, -k],
            [k**2 * (modulus - lam**2 / modulus), 0, k * lam / modulus, 0],
        ]
    )
    return expm(M * H)


def indentation_on_base(k, H, E, nu, base):
    """−V(H) under the pressure cos kx on top, over a base at y = 0 that is "frictionless" or "bonded"."""
    free = [0, 2] if base == "frictionless" else [2, 3]  # what the base leaves open of (U, V, S, T)
    t = transfer(k, H, E, nu)[:, free]
    return -(t @ np.linalg.solve(t[2:], [-1, 0]))[1]


def indentation_of_both_faces(k, H, E, nu, sign):
    """−V(H) under the pressure cos kx on top and `sign` times that on the bottom."""
    t = transfer(k, H, E, nu)
    known = t @ [0, 0, -sign, 0]
    ends = np.linalg.solve(t[2:, :2], [-1 - known[2], -known[3]])
    return -(t[:, :2] @ ends + known)[1]
