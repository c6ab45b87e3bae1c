"""Uniform stress in two blocks that press on each other without friction."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from validation.exact.common import Floats, as_points, elastic, positive


@dataclass(frozen=True, kw_only=True)
class Patch:
    """Block 1 lies on block 2, interface y = x tan(tilt) (z = x tan(tilt) in space), unit square, pressure p on top.

    On a level interface the sides are free: σ_yy = −p, in plane strain ε_yy = −p(1−ν²)/E and ε_xx = pν(1+ν)/E, in space
    ε_zz = −p/E and ε_xx = ε_yy = pν/E. An inclined one transmits a uniform stress without friction only if that is −p
    in all directions of the plane: p acts on all sides, ε = −p(1+ν)(1−2ν)/E, in space −p(1−2ν)/E. In both cases
    u = ε·x with the origin on the interface: u·n = 0 there for both blocks, which slide on each other.

    Parameters
    ----------
    E1, nu1, E2, nu2 : upper and lower block [Pa]
    p : pressure [Pa]
    tilt : slope of the interface [degrees], 0 <= tilt < 90
    dim : 2 (plane strain) or 3

    Checked: Hooke's law of the strains gives the tractions.
    """

    E1: float
    nu1: float
    E2: float
    nu2: float
    p: float
    tilt: float
    dim: int

    def __post_init__(self) -> None:
        elastic(E=self.E1, nu=self.nu1, body="1")
        elastic(E=self.E2, nu=self.nu2, body="2")
        positive(p=self.p)
        if not 0 <= self.tilt < 90:
            raise ValueError(f"tilt = {self.tilt}: must be an angle in degrees, >= 0 and < 90")

    @property
    def slope(self) -> float:
        """tan(tilt)."""
        return float(np.tan(np.deg2rad(self.tilt)))

    @property
    def side_pressure(self) -> float:
        """Pressure on the sides [Pa]."""
        return self.p if self.tilt else 0.0

    @property
    def force(self) -> float:
        """Normal force on the interface [N], of a unit thickness in the plane."""
        return self.p / float(np.cos(np.deg2rad(self.tilt)))

    def displacement_upper(self, points: ArrayLike) -> Floats:
        """u of block 1 at points (n, dim) [m]."""
        return as_points(points, self.dim) * self._strains(self.E1, self.nu1)

    def displacement_lower(self, points: ArrayLike) -> Floats:
        """u of block 2 at points (n, dim) [m]."""
        return as_points(points, self.dim) * self._strains(self.E2, self.nu2)

    def _strains(self, E: float, nu: float) -> Floats:
        """Strains along the axes, (dim)."""
        if self.tilt:
            return np.full(self.dim, -self.p / E * (1 - 2 * nu) * (1 + nu if self.dim == 2 else 1))
        if self.dim == 2:
            return self.p / E * np.array([nu * (1 + nu), -(1 - nu**2)])
        return self.p / E * np.array([nu, nu, -1.0])
