"""Contact of an elastic half-space or half-plane with rigid punches that are not smooth."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from validation.exact.axisymmetric import AxisymmetricContact, Density
from validation.exact.common import Complexes, Floats, positive, slope_angle
from validation.exact.half_plane import HalfPlane, log_cut_below, sqrt_cut_below


@dataclass(frozen=True, kw_only=True)
class Cone(AxisymmetricContact):
    """Obstacle z = δ − r tan α, contact for r < a = 2δ/(π tan α); F(t) = E*(δ − ½π |t| tan α).

    P = 2E*δ²/(π tan α), p = ½E* tan α acosh(a/r): infinite at the apex.

    Parameters
    ----------
    alpha : slope of the surface against the plane z = 0 [rad], in (0, π/2)
    delta : approach [m]

    Checked: as `AxisymmetricContact`; the profile in contact; the force by quadrature of the pressure.
    Source: Love, Q. J. Math. 10 (1939) 161; Sneddon, Int. J. Engng Sci. 3 (1965) 47.
    """

    alpha: float
    delta: float

    def __post_init__(self) -> None:
        super().__post_init__()
        slope_angle(alpha=self.alpha)
        positive(delta=self.delta)

    def density(self) -> Density:
        """E*(δ − ½π |t| tan α)."""
        kink = -0.5 * np.pi * self.E_star * np.tan(self.alpha)
        return Density(a=self.a, F_a=0, dF_a=kink, ddF=0, dF_0=kink)

    @property
    def a(self) -> float:
        """Radius of the contact [m]."""
        return float(2 * self.delta / (np.pi * np.tan(self.alpha)))

    def pressure(self, r: ArrayLike) -> Floats:
        """p(r) on z = 0 [Pa]; infinite at r = 0."""
        return 0.5 * self.E_star * float(np.tan(self.alpha)) * _acosh_of_inverse(np.asarray(r, dtype=float) / self.a)


@dataclass(frozen=True, kw_only=True)
class FlatPunch(AxisymmetricContact):
    """Circular obstacle z = δ, r < a; F(t) = E*δ.

    P = 2aE*δ, p = E*δ/(π√(a²−r²)): infinite at the edge.

    Parameters
    ----------
    a : radius of the punch [m]
    delta : approach [m]

    Checked: as `AxisymmetricContact`; the profile in contact; the force by quadrature of the pressure.
    Source: Boussinesq (1885); Johnson, Contact Mechanics, §3.4(b).
    """

    a: float
    delta: float

    def __post_init__(self) -> None:
        super().__post_init__()
        positive(a=self.a, delta=self.delta)

    def density(self) -> Density:
        """E*δ."""
        return Density(a=self.a, F_a=self.E_star * self.delta, dF_a=0, ddF=0, dF_0=0)

    def pressure(self, r: ArrayLike) -> Floats:
        """p(r) on z = 0 [Pa]; infinite at r = a."""
        squared = self.a**2 - np.asarray(r, dtype=float) ** 2
        with np.errstate(divide="ignore"):
            return np.where(squared < 0, 0, self.E_star * self.delta / (np.pi * np.sqrt(np.abs(squared))))


@dataclass(frozen=True, kw_only=True)
class Wedge(HalfPlane):
    """Obstacle y = −|x| tan α in plane strain, contact for |x| < a, u(0, 0) = 0.

    With s = √(z−a)√(z+a), Z = −(E* tan α/π) log((s+ia)/z), which is −(E* tan α/π) i asin(a/z) in y >= 0.
    p = (E* tan α/π) acosh(a/|x|), P = E* a tan α; a plane half-space has no approach δ.

    Parameters
    ----------
    alpha : slope of the surface against the plane y = 0 [rad], in (0, π/2)
    a : half-width of the contact [m]

    Checked: as `HalfPlane`; the profile in contact, a free surface outside; the force by quadrature.
    Source: Johnson, Contact Mechanics, §5.2.
    """

    alpha: float
    a: float

    def __post_init__(self) -> None:
        super().__post_init__()
        slope_angle(alpha=self.alpha)
        positive(a=self.a)

    @property
    def P(self) -> float:
        """Force per thickness E* a tan α [N/m], both halves."""
        return float(self.E_star * self.a * np.tan(self.alpha))

    @property
    def singular_points(self) -> tuple[float, ...]:
        """The edges ±a and the apex."""
        return (-self.a, 0.0, self.a)

    def potentials(self, z: Complexes) -> tuple[Complexes, Complexes, Complexes]:
        """Ẑ = −(E* tan α/π) [z log((s+ia)/z) + ia log((z+s)/ia)], Z, Z′ = i (E* tan α/π) a/(zs)."""
        a, c = self.a, -self.E_star * np.tan(self.alpha) / np.pi
        s = sqrt_cut_below(z - a) * sqrt_cut_below(z + a)
        log = log_cut_below(s + 1j * a) - log_cut_below(z)
        z_log = np.where(z == 0, 0, z * log)
        integral = c * (z_log + 1j * a * (log_cut_below(z + s) - np.log(a) - 0.5j * np.pi))
        return integral, c * log, -1j * a * c / (z * s)

    def pressure(self, x: ArrayLike) -> Floats:
        """p(x) on y = 0 [Pa]; infinite at x = 0."""
        return self.E_star * float(np.tan(self.alpha)) / np.pi * _acosh_of_inverse(np.asarray(x, dtype=float) / self.a)


def _acosh_of_inverse(s: Floats) -> Floats:
    """acosh(1/|s|) for |s| <= 1, and 0 beyond."""
    with np.errstate(divide="ignore"):
        return np.arccosh(np.maximum(1 / np.abs(s), 1))
