"""Line contact of an elastic half-plane with a rigid parabola (Hertz)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from validation.exact.common import Complexes, Floats, positive
from validation.exact.half_plane import HalfPlane, log_cut_below, sqrt_cut_below


@dataclass(frozen=True, kw_only=True)
class HertzLine(HalfPlane):
    """Obstacle y = −x²/2R (a parabola, not a circle), contact for |x| < a, u(0, 0) = 0.

    With s = √(z−a)√(z+a) the potential Z = −(p₀/a) i (z−s) is written −i p₀ a/(z+s), which does not cancel far away.
    p₀ = aE*/2R, P = πap₀/2, p = p₀ √(1−x²/a²).

    Parameters
    ----------
    a : half-width of the contact [m]
    R : radius of curvature at the apex, 1/R = 1/R₁ + 1/R₂ [m]

    Checked: as `HalfPlane`; the profile −x²/2R in contact, a free surface outside; the force by quadrature of σ_yy
    across a section; the catalogue's p₀ and P at a=.3, R=E=1, ν=.3. Source: Johnson, Contact Mechanics, §4.2(c).
    """

    a: float
    R: float

    def __post_init__(self) -> None:
        super().__post_init__()
        positive(a=self.a, R=self.R)

    @property
    def p0(self) -> float:
        """Largest pressure aE*/2R [Pa]."""
        return self.a * self.E_star / (2 * self.R)

    @property
    def P(self) -> float:
        """Force per thickness πap₀/2 [N/m], both halves."""
        return 0.5 * np.pi * self.a * self.p0

    @property
    def singular_points(self) -> tuple[float, ...]:
        """The edges ±a."""
        return (-self.a, self.a)

    def potentials(self, z: Complexes) -> tuple[Complexes, Complexes, Complexes]:
        """Ẑ = −½ i p₀ a [z/(z+s) + log((z+s)/ia)], Z = −i p₀ a/(z+s), Z′ = i p₀ a/(s (z+s))."""
        s = sqrt_cut_below(z - self.a) * sqrt_cut_below(z + self.a)
        c = -1j * self.p0 * self.a
        integral = 0.5 * c * (z / (z + s) + log_cut_below(z + s) - np.log(self.a) - 0.5j * np.pi)
        return integral, c / (z + s), -c / (s * (z + s))

    def pressure(self, x: ArrayLike) -> Floats:
        """p(x) on y = 0 [Pa]."""
        return self.p0 * np.sqrt(np.maximum(1 - (np.asarray(x, dtype=float) / self.a) ** 2, 0))

    def lift(self, x: ArrayLike) -> Floats:
        """Gap u_y(x, 0) + x²/2R over the obstacle, 0 in contact: (a²/2R)(ξ√(ξ²−1) − acosh ξ), ξ = |x|/a [m]."""
        xi = np.maximum(np.abs(np.asarray(x, dtype=float)) / self.a, 1)
        return self.a**2 / (2 * self.R) * (xi * np.sqrt(xi**2 - 1) - np.arccosh(xi))
