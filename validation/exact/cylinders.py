"""Press fits of concentric cylinders (plane strain) and spheres, by Lamé's solutions."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from validation.exact.common import Floats, as_points, ascending, elastic, positive, radius


@dataclass(frozen=True, kw_only=True)
class Plug:
    """Cylinder of radius b + δ in a tube b < r < c, free outside, plane strain, no friction.

    Tube: u_r = p b²/(2G(c²−b²)) [(1−2ν) r + c²/r], σ_rr = −p b²(c²/r²−1)/(c²−b²). Core: σ_rr = σ_θθ = −p,
    u_r = −p (1+ν₁)(1−2ν₁) r/E₁; both are linear on the common radius b, where they differ by δ.

    Parameters
    ----------
    E, nu : tube [Pa], -1 < nu <= 1/2
    b, c : inner and outer radius [m]
    delta : interference of the radii [m]
    E1, nu1 : core [Pa]; rigid where E1 is left out

    Checked: Hooke's law and the boundary conditions by finite differences; p = δ/{b[(c²+b²)/(c²−b²)+ν′]/E′}, with the
    core b(1−ν₁′)/E₁′ more in the braces; the catalogue's figures. Source: Timoshenko & Goodier, Theory of Elasticity,
    §28.
    """

    E: float
    nu: float
    b: float
    c: float
    delta: float
    E1: float = np.inf
    nu1: float = 0.0

    def __post_init__(self) -> None:
        elastic(E=self.E, nu=self.nu)
        _core(self.E1, self.nu1)
        ascending(b=self.b, c=self.c)
        positive(delta=self.delta)

    @property
    def p(self) -> float:
        """Pressure [Pa], uniform."""
        core = (1 + self.nu1) * (1 - 2 * self.nu1) / self.E1 * self.b
        return self.delta / (self._radial(np.array(self.b), pressure=1.0).item() + core)

    @property
    def force(self) -> float:
        """2πbp, the pressure summed over the whole circumference, per thickness [N/m]."""
        return 2 * np.pi * self.b * self.p

    def displacement(self, points: ArrayLike) -> Floats:
        """(u_x, u_y) of the tube at points (n, 2), the axis at the origin, shape (n, 2) [m]."""
        points = as_points(points, 2)
        r = radius(points)
        return points * (self._radial(r, self.p) / r)[:, None]

    def displacement_core(self, points: ArrayLike) -> Floats:
        """(u_x, u_y) of the core at points (n, 2), shape (n, 2) [m]."""
        return -self.p * (1 + self.nu1) * (1 - 2 * self.nu1) / self.E1 * as_points(points, 2)

    def _radial(self, r: Floats, pressure: float) -> Floats:
        return tube(r, self.E, self.nu, self.b, self.c, inner=pressure, outer=0.0)


@dataclass(frozen=True, kw_only=True)
class BallShell:
    """Sphere of radius b + δ in a spherical shell b < r < c, free outside, no friction.

    Shell: u_r = p b³/(E(c³−b³)) [(1−2ν) r + (1+ν) c³/2r²]. Core: σ = −p 1, u_r = −p (1−2ν₁) r/E₁; both are linear on
    the common radius b, where they differ by δ.

    Parameters
    ----------
    E, nu : shell [Pa], -1 < nu <= 1/2
    b, c : inner and outer radius [m]
    delta : interference of the radii [m]
    E1, nu1 : core [Pa]; rigid where E1 is left out

    Checked: Hooke's law, equilibrium and the boundary conditions by finite differences; the catalogue's p = .0125;
    where core and shell are alike and c → ∞, Eshelby's p = 2Eδ/3(1−ν)b. Source: Timoshenko & Goodier, Theory of
    Elasticity, §136.
    """

    E: float
    nu: float
    b: float
    c: float
    delta: float
    E1: float = np.inf
    nu1: float = 0.0

    def __post_init__(self) -> None:
        elastic(E=self.E, nu=self.nu)
        _core(self.E1, self.nu1)
        ascending(b=self.b, c=self.c)
        positive(delta=self.delta)

    @property
    def p(self) -> float:
        """Pressure [Pa], uniform."""
        core = (1 - 2 * self.nu1) / self.E1 * self.b
        return self.delta / (self._radial_per_pressure(np.array(self.b)).item() + core)

    @property
    def force(self) -> float:
        """4πb²p, the pressure summed over the whole sphere [N]."""
        return 4 * np.pi * self.b**2 * self.p

    def displacement(self, points: ArrayLike) -> Floats:
        """u of the shell at points (n, 3), the centre at the origin, or (u_r, u_z) at points (r, z) (n, 2) [m]."""
        points = as_points(points, 2, 3)
        r = radius(points)
        return points * (self.p * self._radial_per_pressure(r) / r)[:, None]

    def displacement_core(self, points: ArrayLike) -> Floats:
        """u of the core at points (n, 3), or (u_r, u_z) at points (r, z) (n, 2) [m]."""
        return -self.p * (1 - 2 * self.nu1) / self.E1 * as_points(points, 2, 3)

    def _radial_per_pressure(self, r: Floats) -> Floats:
        b3, c3 = self.b**3, self.c**3
        return b3 / (self.E * (c3 - b3)) * ((1 - 2 * self.nu) * r + (1 + self.nu) * c3 / (2 * r**2))


@dataclass(frozen=True, kw_only=True)
class ShrinkFit:
    """Tube a < r < b + δ pressed into the tube b < r < c, plane strain, no friction, δ ≪ b.

    p = δ/{b[(c²+b²)/(c²−b²)+ν₂′]/E₂′ + b[(b²+a²)/(b²−a²)−ν₁′]/E₁′}, E′ = E/(1−ν²), ν′ = ν/(1−ν): both tubes are linear
    on the common radius b.

    Parameters
    ----------
    E1, nu1 : inner tube [Pa]
    E2, nu2 : outer tube [Pa]
    a, b, c : radii [m]
    delta : interference of the radii at b [m]

    Checked: the displacements differ by δ at b, against the formula; the plug as the limit E₁ → ∞; the catalogue's p.
    Source: Timoshenko & Goodier, Theory of Elasticity, §28.
    """

    E1: float
    nu1: float
    E2: float
    nu2: float
    a: float
    b: float
    c: float
    delta: float

    def __post_init__(self) -> None:
        elastic(E=self.E1, nu=self.nu1, body="1")
        elastic(E=self.E2, nu=self.nu2, body="2")
        ascending(a=self.a, b=self.b, c=self.c)
        positive(delta=self.delta)

    @property
    def p(self) -> float:
        """Pressure at r = b [Pa], uniform."""
        b = np.array(self.b)
        return self.delta / (self._outer(b, pressure=1.0) - self._inner(b, pressure=1.0)).item()

    def displacement_inner(self, points: ArrayLike) -> Floats:
        """(u_x, u_y) of the inner tube at points (n, 2), shape (n, 2) [m]."""
        points = as_points(points, 2)
        r = radius(points)
        return points * (self._inner(r, self.p) / r)[:, None]

    def displacement_outer(self, points: ArrayLike) -> Floats:
        """(u_x, u_y) of the outer tube at points (n, 2), shape (n, 2) [m]."""
        points = as_points(points, 2)
        r = radius(points)
        return points * (self._outer(r, self.p) / r)[:, None]

    def _inner(self, r: Floats, pressure: float) -> Floats:
        return tube(r, self.E1, self.nu1, self.a, self.b, inner=0.0, outer=pressure)

    def _outer(self, r: Floats, pressure: float) -> Floats:
        return tube(r, self.E2, self.nu2, self.b, self.c, inner=pressure, outer=0.0)


def _core(E1: float, nu1: float) -> None:
    """ValueError unless the core is elastic, or rigid (E₁ = ∞)."""
    if not np.isposinf(E1):
        elastic(E=E1, nu=nu1, body="1")


def tube(r: Floats, E: float, nu: float, b: float, c: float, *, inner: float, outer: float) -> Floats:
    """u_r of the tube b < r < c in plane strain under the pressures `inner` and `outer` (Lamé)."""
    uniform = (1 - 2 * nu) * (inner * b**2 - outer * c**2) * r
    return (1 + nu) / (E * (c**2 - b**2)) * (uniform + (inner - outer) * b**2 * c**2 / r)
