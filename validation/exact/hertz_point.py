"""Point contact of an elastic half-space with a rigid paraboloid (Hertz)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from validation.exact.axisymmetric import AxisymmetricContact, Density
from validation.exact.common import Floats, positive


@dataclass(frozen=True, kw_only=True)
class HertzPoint(AxisymmetricContact):
    """Obstacle z = δ − r²/2R (a paraboloid, not a sphere), contact for r < a; F(t) = (E*/R)(a²−t²).

    p₀ = 2aE*/πR, P = 4E*a³/3R, δ = a²/R, p = p₀ √(1−r²/a²).

    Parameters
    ----------
    a : radius of the contact [m]
    R : radius of curvature at the apex, 1/R = 1/R₁ + 1/R₂ [m]

    Checked: as `AxisymmetricContact`; the profile δ − r²/2R in contact; the force by quadrature of the pressure; the
    catalogue's p₀, P and δ at a=.3, R=E=1, ν=.3. Source: Johnson, Contact Mechanics, §4.2(a).
    """

    a: float
    R: float

    def __post_init__(self) -> None:
        super().__post_init__()
        positive(a=self.a, R=self.R)

    def density(self) -> Density:
        """(E*/R)(a²−t²)."""
        c = self.E_star / self.R
        return Density(a=self.a, F_a=0, dF_a=-2 * c * self.a, ddF=-2 * c, dF_0=0)

    @property
    def p0(self) -> float:
        """Largest pressure 2aE*/πR [Pa]."""
        return 2 * self.a * self.E_star / (np.pi * self.R)

    @property
    def delta(self) -> float:
        """Approach a²/R [m]."""
        return self.a**2 / self.R

    def pressure(self, r: ArrayLike) -> Floats:
        """p(r) on z = 0 [Pa]."""
        return self.p0 * np.sqrt(np.maximum(1 - (np.asarray(r, dtype=float) / self.a) ** 2, 0))
