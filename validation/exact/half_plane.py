"""Frictionless contact of an elastic half-plane by one analytic function (Westergaard)."""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import ArrayLike

from validation.exact.common import Complexes, ElasticBody, Floats, as_points, finite, positive, vanishing_product

ORDER = 64  # Gauss points per direction and sector of the H¹ seminorm


def sqrt_cut_below(w: Complexes) -> Complexes:
    """√w with its cut along the negative imaginary axis, so that rounding to y = -0 does not change the branch."""
    root: Complexes = np.exp(0.25j * np.pi) * np.sqrt(-1j * w)
    return root


def log_cut_below(w: Complexes) -> Complexes:
    """log w with its cut along the negative imaginary axis."""
    return np.log(-1j * w) + 0.5j * np.pi


@dataclass(frozen=True, kw_only=True)
class HalfPlane(ElasticBody, ABC):
    """Plane strain of the body y >= 0, whose obstacle lies below, from Z(z), z = x + iy, Ẑ = ∫ Z dz.

    σ_yy = Re Z + y Im Z′,  σ_xx = Re Z − y Im Z′,  σ_xy = −y Re Z′,
    2G u_x = (1−2ν) Re Ẑ − y Im Z,  2G u_y = 2(1−ν) Im Ẑ − y Re Z.

    The shear traction vanishes on y = 0 and the pressure there is −Re Z.
    Checked: equilibrium and Hooke's law by finite differences, Ẑ′ = Z and Z′ by finite differences.

    Parameters
    ----------
    E : Young's modulus [Pa]
    nu : Poisson's ratio, -1 < nu <= 1/2

    Raises
    ------
    ValueError : a parameter outside its range; a point below y = 0 by more than rounding.

    Source: Westergaard, J. Appl. Mech. 6 (1939) A49; Barber, Contact Mechanics, ch. 6.
    """

    @abstractmethod
    def potentials(self, z: Complexes) -> tuple[Complexes, Complexes, Complexes]:
        """Ẑ [Pa m], Z [Pa] and Z′ [Pa/m] at z = x + iy, y >= 0."""

    @property
    @abstractmethod
    def singular_points(self) -> tuple[float, ...]:
        """Abscissae on y = 0 where Z or Z′ is singular, in increasing order [m]."""

    def displacement(self, points: ArrayLike) -> Floats:
        """(u_x, u_y) at points (n, 2), shape (n, 2) [m]."""
        y, (Zhat, Z, _) = self._at(points)
        ux = (1 - 2 * self.nu) * Zhat.real - vanishing_product(y, Z.imag)
        uy = 2 * (1 - self.nu) * Zhat.imag - vanishing_product(y, Z.real)
        return np.stack([ux, uy], axis=-1) / (2 * self.G)

    def displacement_gradient(self, points: ArrayLike) -> Floats:
        """∂u_i/∂x_j at points (n, 2), shape (n, 2, 2)."""
        y, (_, Z, dZ) = self._at(points)
        ydZ = vanishing_product(y, dZ)
        normal, rotation = (1 - 2 * self.nu) * Z.real, 2 * (1 - self.nu) * Z.imag
        gradient = np.stack([normal - ydZ.imag, -rotation - ydZ.real, rotation - ydZ.real, normal + ydZ.imag], axis=-1)
        return gradient.reshape(-1, 2, 2) / (2 * self.G)

    def strain(self, points: ArrayLike) -> Floats:
        """ε_xx, ε_yy, ε_xy (not the engineering shear) at points (n, 2), shape (n, 3)."""
        g = self.displacement_gradient(points)
        return np.stack([g[:, 0, 0], g[:, 1, 1], 0.5 * (g[:, 0, 1] + g[:, 1, 0])], axis=-1)

    def stress(self, points: ArrayLike) -> Floats:
        """σ_xx, σ_yy, σ_xy at points (n, 2), shape (n, 3) [Pa]."""
        y, (_, Z, dZ) = self._at(points)
        ydZ = vanishing_product(y, dZ)
        return np.stack([Z.real - ydZ.imag, Z.real + ydZ.imag, -ydZ.real], axis=-1)

    def h1_seminorm(self, x_min: float, x_max: float, height: float) -> float:
        """|u|_H¹ = (∫ |∇u|²)^½ over [x_min, x_max] × [0, height] [m].

        The box is cut between its singular points; each part is swept in polar coordinates about its own point, with
        r = r_max(θ) τ⁴, which makes √r and r analytic in τ and tames log r. Gauss quadrature in θ and τ.
        """
        finite(x_min=x_min, x_max=x_max)
        positive(height=height)
        if x_max <= x_min:
            raise ValueError(f"x_max = {x_max}: must be > x_min = {x_min}")
        centres = [x for x in self.singular_points if x_min <= x <= x_max] or [0.5 * (x_min + x_max)]
        cuts = [x_min, *(0.5 * (p + q) for p, q in pairwise(centres)), x_max]
        parts = zip(centres, pairwise(cuts), strict=True)
        return float(np.sqrt(sum(self._energy_about(centre, *sides, height) for centre, sides in parts)))

    def _energy_about(self, centre: float, left: float, right: float, height: float) -> float:
        """∫ |∇u|² over [left, right] × [0, height], swept about (centre, 0) by the three sides that it sees."""
        abscissae, weights = np.polynomial.legendre.leggauss(ORDER)
        tau, w_tau = 0.5 * (1 + abscissae), 0.5 * weights
        corner_right, corner_left = np.arctan2(height, right - centre), np.arctan2(height, left - centre)
        energy = 0.0
        for start, end, distance, normal in (
            (0.0, corner_right, right - centre, 0.0),
            (corner_right, corner_left, height, 0.5 * np.pi),
            (corner_left, np.pi, centre - left, np.pi),
        ):
            if distance == 0:  # the centre lies on this side
                continue
            theta, w_theta = start + (end - start) * tau, (end - start) * w_tau
            r_max = distance / np.cos(theta - normal)
            r = np.outer(r_max, tau**4)
            area = np.outer(w_theta * r_max, w_tau * 4 * tau**3) * r
            points = np.stack([centre + r * np.cos(theta)[:, None], r * np.sin(theta)[:, None]], axis=-1)
            squared = np.sum(self.displacement_gradient(points.reshape(-1, 2)) ** 2, axis=(1, 2))
            energy += float(area.ravel() @ squared)
        return energy

    def _at(self, points: ArrayLike) -> tuple[Floats, tuple[Complexes, Complexes, Complexes]]:
        x, y = as_points(points, 2).T
        if np.any(y < -1e-9 * (1e-300 + np.max(np.abs([x, y]), initial=0.0))):
            raise ValueError(f"y = {y.min()}: must be >= 0, the body is the half-plane above y = 0")
        with np.errstate(divide="ignore", invalid="ignore"):
            return y, self.potentials(x + 1j * y)
