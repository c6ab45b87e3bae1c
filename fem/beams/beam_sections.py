"""Cross-sections of beams: stiffness and inertia along a section of a device."""

from __future__ import annotations

from dataclasses import dataclass
from math import inf, isfinite
from typing import NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]


class CrossSections(NamedTuple):
    """Properties of m cross-sections, each (m).

    EA, GJ, EI2, EI3 : stiffness against stretch [N], torsion and bending about d₂ and d₃ [N m²]
    GA2, GA3 : stiffness against shear along d₂ and d₃ [N], infinite where there is none
    mass : mass per length [kg/m]
    polar, I2, I3 : rotary inertia per length about t, d₂ and d₃ [kg m]
    """

    EA: Floats
    GJ: Floats
    EI2: Floats
    EI3: Floats
    GA2: Floats
    GA3: Floats
    mass: Floats
    polar: Floats
    I2: Floats
    I3: Floats


class Profile(Protocol):
    """The cross-sections along one section of a device."""

    def at(self, s: Floats) -> CrossSections:
        """Their properties at the places s (m), from 0 at the start to 1 at the end of the section."""
        ...


def _check(name: str, value: float, allowed: bool, rule: str) -> None:
    if not (isfinite(value) and allowed):
        raise ValueError(f"{name} = {value!r}: must be {rule}")


@dataclass(frozen=True)
class Section:
    """A wire or tube: E, and ν or G; radii; density.

    EA = Eπ(r² − a²), EI = Eπ(r⁴ − a⁴)/4, GJ = Gπ(r⁴ − a⁴)/2 with the outer radius r and the inner radius a; the shear
    stiffness is κGA with Cowper's κ = 6(1+ν)(1+m²)²/[(7+6ν)(1+m²)² + (20+12ν)m²], m = a/r.

    Parameters
    ----------
    E : Young's modulus [Pa]
    outer_radius, inner_radius : [m]
    nu, G : Poisson's ratio [-] or shear modulus [Pa]: one of them
    density : [kg/m³]
    end_radius : outer radius at the section's end [m], from which it tapers linearly; none for a constant one
    shear : whether the beam shears (Timoshenko) or not (Euler-Bernoulli)

    Raises
    ------
    ValueError
        A modulus or radius that is not positive, an inner radius beyond the outer one, both or none of ν and G.

    Source: Cowper, J. Appl. Mech. 33 (1966).
    """

    E: float
    outer_radius: float
    inner_radius: float = 0.0
    nu: float | None = None
    G: float | None = None
    density: float = 0.0
    end_radius: float | None = None
    shear: bool = False

    def __post_init__(self) -> None:
        _check("E", self.E, self.E > 0, "a positive number")
        _check("density", self.density, self.density >= 0, "at least 0")
        for name, radius in (("outer_radius", self.outer_radius), ("end_radius", self._end)):
            _check(name, radius, radius > 0, "a positive number")
        least = min(self.outer_radius, self._end)
        _check("inner_radius", self.inner_radius, 0 <= self.inner_radius < least, f"from 0 to below {least!r}")
        if (self.nu is None) == (self.G is None):
            raise ValueError(f"nu, G = {self.nu!r}, {self.G!r}: must be one and not the other")
        if self.nu is not None:
            _check("nu", self.nu, -1 < self.nu <= 0.5, "above -1 and at most 0.5")
        if self.G is not None:
            _check("G", self.G, self.G > 0, "a positive number")

    @property
    def _end(self) -> float:
        return self.outer_radius if self.end_radius is None else self.end_radius

    @property
    def shear_modulus(self) -> float:
        """G [Pa]."""
        return self.G if self.G is not None else self.E / (2 * (1 + (self.nu or 0.0)))

    def radius(self, s: Floats) -> Floats:
        """Outer radius at the places s (m) [m]."""
        return np.asarray(self.outer_radius + (self._end - self.outer_radius) * s)

    def at(self, s: Floats) -> CrossSections:
        """Properties of the places s (m)."""
        G, r, a = self.shear_modulus, self.radius(s), self.inner_radius
        nu = self.E / (2 * G) - 1
        area, second = np.pi * (r**2 - a**2), np.pi * (r**4 - a**4) / 4
        m2 = (a / r) ** 2
        kappa = 6 * (1 + nu) * (1 + m2) ** 2 / ((7 + 6 * nu) * (1 + m2) ** 2 + (20 + 12 * nu) * m2)
        GA = kappa * G * area if self.shear else np.full_like(r, inf)
        EI, inertia = self.E * second, self.density * second
        return CrossSections(
            self.E * area, 2 * G * second, EI, EI, GA, GA, self.density * area, 2 * inertia, inertia, inertia
        )


@dataclass(frozen=True)
class Stiffness:
    """A section given by its stiffnesses; EI, GA and inertia hold for both directions, or are pairs for d₂ and d₃.

    Parameters
    ----------
    EA, GJ, EI : [N], [N m²], [N m²], positive
    mass : per length [kg/m]
    inertia : rotary, per length, about d₂ and d₃ [kg m]; their sum is the one about t
    GA : shear stiffness [N]; infinite for no shear

    Raises
    ------
    ValueError
        A stiffness that is not positive, a negative mass or inertia.
    """

    EA: float
    GJ: float
    EI: float | tuple[float, float]
    mass: float = 0.0
    inertia: float | tuple[float, float] = 0.0
    GA: float | tuple[float, float] = inf

    def __post_init__(self) -> None:
        for name in ("EA", "GJ", "EI"):
            for value in np.broadcast_to(getattr(self, name), 2).tolist():
                _check(name, value, value > 0, "a positive number")
        for name in ("mass", "inertia"):
            for value in np.broadcast_to(getattr(self, name), 2).tolist():
                _check(name, value, value >= 0, "at least 0")
        if not min(np.broadcast_to(self.GA, 2).tolist()) > 0:
            raise ValueError(f"GA = {self.GA!r}: must be a positive number")

    def at(self, s: Floats) -> CrossSections:
        """The same properties at all places s (m)."""
        (EI2, EI3), (GA2, GA3), (I2, I3) = (np.broadcast_to(v, 2) for v in (self.EI, self.GA, self.inertia))
        values = (self.EA, self.GJ, EI2, EI3, GA2, GA3, self.mass, I2 + I3, I2, I3)
        return CrossSections(*(np.full(np.shape(s), float(v)) for v in values))
