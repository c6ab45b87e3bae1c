"""Impacts of elastic bars by d'Alembert's waves: pressure, times, impulse and motion."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from validation.exact.common import Floats, positive


def pushed(push: Callable[[Floats], Floats], x: Floats, t: Floats, *, c: float, L: float) -> Floats:
    """Displacement at x of a bar 0 <= x <= L at rest and free, pressed at x = 0.

    u = Σ_j S(t − (x+2jL)/c) + S(t − (2(j+1)L−x)/c), j = 0, 1, … With S(t) = ∫₀ᵗ p dt/(ρc) the travel of the end of an
    infinite bar, 0 for t < 0; either end reflects it with its sign.
    """
    u = np.zeros(np.broadcast_shapes(x.shape, t.shape))
    for j in range(int(np.max(t, initial=0) * c / (2 * L)) + 1):
        u = u + push(np.maximum(t - (x + 2 * j * L) / c, 0)) + push(np.maximum(t - (2 * (j + 1) * L - x) / c, 0))
    return u


@dataclass(frozen=True, kw_only=True)
class BarWaves(ABC):
    """A bar 0 <= x <= L (x = 0 is the end that makes contact), ρ ü = E u″; displacements point away from the obstacle.

    All forces are per area of the section: pressures [Pa], impulses [Pa s], energies [J/m²].

    Parameters
    ----------
    E : Young's modulus [Pa]
    rho : density [kg/m³]
    L : length [m]
    """

    E: float
    rho: float
    L: float

    def __post_init__(self) -> None:
        positive(E=self.E, rho=self.rho, L=self.L)

    @property
    def c(self) -> float:
        """Wave speed √(E/ρ) [m/s]."""
        return float(np.sqrt(self.E / self.rho))

    @property
    def round_trip(self) -> float:
        """2L/c [s]."""
        return 2 * self.L / self.c

    @property
    @abstractmethod
    def contact(self) -> tuple[float, float]:
        """Begin and end of the first contact with a force [s]."""

    @property
    @abstractmethod
    def impulse(self) -> float:
        """∫ p dt of the first contact [Pa s]."""

    @abstractmethod
    def pressure(self, t: ArrayLike) -> Floats:
        """Contact pressure p(t) [Pa]."""

    @abstractmethod
    def displacement(self, x: ArrayLike, t: ArrayLike) -> Floats:
        """u(x, t); x and t broadcast [m]."""


@dataclass(frozen=True, kw_only=True)
class BarImpact(BarWaves):
    """A free bar that flies at v₀ towards a rigid wall at the distance h₀, without gravity.

    Contact from h₀/v₀ for 2L/c with p = ρcv₀; then the bar is stress-free and flies off with v₀: restitution 1.

    Parameters
    ----------
    h0 : distance of the wall [m], >= 0
    v0 : velocity [m/s]

    Checked: the gap is never negative, is closed while p > 0; momentum and energy by quadrature of the field; the
    catalogue's figures. Source: Doyen, Ern & Piperno, SIAM J. Sci. Comput. 33 (2011) 223.
    """

    h0: float
    v0: float

    def __post_init__(self) -> None:
        super().__post_init__()
        positive(v0=self.v0)
        if not (np.isfinite(self.h0) and self.h0 >= 0):
            raise ValueError(f"h0 = {self.h0}: must be >= 0")

    @property
    def contact(self) -> tuple[float, float]:
        """[h₀/v₀, h₀/v₀ + 2L/c] [s]."""
        return self.h0 / self.v0, self.h0 / self.v0 + self.round_trip

    @property
    def peak_pressure(self) -> float:
        """ρcv₀ [Pa]."""
        return self.rho * self.c * self.v0

    @property
    def impulse(self) -> float:
        """2ρLv₀ [Pa s]."""
        return 2 * self.rho * self.L * self.v0

    @property
    def energy(self) -> float:
        """½ρLv₀² [J/m²], constant."""
        return 0.5 * self.rho * self.L * self.v0**2

    def implicit_euler_impulse_error(self, dt: float) -> float:
        """√(cΔt/πL): the first order of the relative loss of impulse with implicit Euler on a fine mesh.

        A step delays a wave by an exponential law of deviation Δt, so after 2L/c the front is a normal law's with
        σ = √(2LΔt/c). It takes p₀ − 2p₀Φ(τ/σ) from the pressure p₀, cut at 0: the loss is 2p₀σ/√2π.
        """
        positive(dt=dt)
        return float(np.sqrt(self.c * dt / (np.pi * self.L)))

    def implicit_euler_restitution(self, dt: float) -> float:
        """1 − 2√(cΔt/πL), from the impulse mv₀(1+e)."""
        return 1 - 2 * self.implicit_euler_impulse_error(dt)

    def pressure(self, t: ArrayLike) -> Floats:
        """ρcv₀ in contact, 0 else [Pa]."""
        start, end = self.contact
        t = np.asarray(t, dtype=float)
        return np.where((t >= start) & (t < end), self.peak_pressure, 0.0)

    def displacement(self, x: ArrayLike, t: ArrayLike) -> Floats:
        """Position less x: h₀ − v₀t and the reflections of the contact's push [m]."""
        x, t = np.asarray(x, dtype=float), np.asarray(t, dtype=float)

        def push(time: Floats) -> Floats:
            return self.v0 * np.minimum(time, self.round_trip)

        return self.h0 - self.v0 * t + pushed(push, x, t - self.contact[0], c=self.c, L=self.L)


@dataclass(frozen=True, kw_only=True)
class BouncingBar(BarWaves):
    """A free bar dropped from rest at the height h₀ on a rigid floor, under gravity: periodic.

    v₀ = √(2gh₀), τ₁ = 2L/c. First contact for τ₁, p = ρc(v₀+gτ), after which the bar flies off with v₀ and with the
    strain 2g(x−L)/c², twice what its weight does to it standing, which vibrates freely; the flight 2v₀/g is k
    vibrations, so it lands as it left: second contact for τ₁, p = ρcv₀ + 2ρgL − ρcgτ, and it flies off unstressed as
    it came.
    Period 4v₀/g + 4L/c from first to third contact.

    Parameters
    ----------
    h0 : height of the drop [m]
    g : gravity [m/s²]

    Raises
    ------
    ValueError : a parameter outside its range; v₀ <= 2gL/c, where the end touches at once; 2v₀/g no multiple of 2L/c.

    Checked: gap and pressure are complementary over two periods by superposition of all reflections (no piece is joined
    by hand); energy by quadrature of the field. Source: Doyen, Ern & Piperno, SIAM J. Sci. Comput. 33 (2011) 223.
    """

    h0: float
    g: float

    def __post_init__(self) -> None:
        super().__post_init__()
        positive(h0=self.h0, g=self.g)
        lowest = 2 * self.g * self.L / self.c
        if self.v0 <= lowest:
            raise ValueError(f"h0 = {self.h0}: must be > {lowest**2 / (2 * self.g):.6g}, so that v0 > 2gL/c")
        waves = self.flight / self.round_trip
        if abs(waves - round(waves)) > 1e-9 * waves:
            nearest = (round(waves) * self.g * self.round_trip / 2) ** 2 / (2 * self.g)
            raise ValueError(f"h0 = {self.h0}: must make 2 v0/g a multiple of 2L/c, {nearest:.9g} is the nearest")

    @property
    def v0(self) -> float:
        """Velocity of impact √(2gh₀) [m/s]."""
        return float(np.sqrt(2 * self.g * self.h0))

    @property
    def flight(self) -> float:
        """Time between two contacts 2v₀/g [s]."""
        return 2 * self.v0 / self.g

    @property
    def period(self) -> float:
        """4v₀/g + 4L/c [s]."""
        return 2 * (self.flight + self.round_trip)

    @property
    def contact(self) -> tuple[float, float]:
        """[v₀/g, v₀/g + 2L/c] [s]."""
        return self.v0 / self.g, self.v0 / self.g + self.round_trip

    @property
    def second_contact(self) -> tuple[float, float]:
        """The next one, a flight later [s]."""
        start = self.contact[1] + self.flight
        return start, start + self.round_trip

    @property
    def impulse(self) -> float:
        """ρL(2v₀ + 2gL/c) [Pa s], of either contact."""
        return self.rho * self.L * (2 * self.v0 + self.g * self.round_trip)

    @property
    def energy(self) -> float:
        """ρLgh₀ [J/m²] over the unstressed bar on the floor, constant."""
        return self.rho * self.L * self.g * self.h0

    def pressure(self, t: ArrayLike) -> Floats:
        """p(t) [Pa]."""
        t = np.asarray(t, dtype=float) - self.contact[0]
        tau = np.mod(t, self.period)
        later = tau - self.round_trip - self.flight
        first = self.rho * self.c * (self.v0 + self.g * tau)
        second = self.rho * self.c * (self.v0 + self.g * (self.round_trip - later))
        pressing = np.where(
            tau < self.round_trip, first, np.where((later >= 0) & (later < self.round_trip), second, 0.0)
        )
        return np.where(t >= 0, pressing, 0.0)

    def displacement(self, x: ArrayLike, t: ArrayLike) -> Floats:
        """Position less x: h₀ − gt²/2 and the reflections of all contacts' pushes [m]."""
        x, t = np.asarray(x, dtype=float), np.asarray(t, dtype=float)
        return self.h0 - 0.5 * self.g * t**2 + pushed(self._push, x, t - self.contact[0], c=self.c, L=self.L)

    def _push(self, t: Floats) -> Floats:
        """∫p dt/(ρc) since the first touch [m]."""
        cycles, tau = np.divmod(t, self.period)
        first = np.minimum(tau, self.round_trip)
        second = np.clip(tau - self.round_trip - self.flight, 0, self.round_trip)
        once = self.v0 * self.round_trip + 0.5 * self.g * self.round_trip**2
        push: Floats = 2 * once * cycles + self.v0 * (first + second) + 0.5 * self.g * first**2
        push += self.g * second * (self.round_trip - 0.5 * second)
        return push


@dataclass(frozen=True, kw_only=True)
class HangingBar(BarWaves):
    """A bar fixed at x = L, stretched so that u = h₀(1 − x/L) and released over a rigid floor at u(0) = 0.

    The free end falls with h₀c/L; contact from L/c to 2L/c with p = Eh₀/L; the bar is back where it began at 3L/c.

    Parameters
    ----------
    h0 : gap of the end at the start, away from the floor [m] (the bar is compressed by as much)

    Checked: the field satisfies the wave equation's characteristics, the end conditions and complementarity; energy by
    quadrature. Source: Doyen, Ern & Piperno, SIAM J. Sci. Comput. 33 (2011) 223, with E=ρ=L=1, h₀=½.
    """

    h0: float

    def __post_init__(self) -> None:
        super().__post_init__()
        positive(h0=self.h0)

    @property
    def contact(self) -> tuple[float, float]:
        """[L/c, 2L/c] [s]."""
        return self.L / self.c, 2 * self.L / self.c

    @property
    def peak_pressure(self) -> float:
        """Eh₀/L [Pa]."""
        return self.E * self.h0 / self.L

    @property
    def period(self) -> float:
        """3L/c [s]."""
        return 3 * self.L / self.c

    @property
    def impulse(self) -> float:
        """ρch₀ [Pa s]."""
        return self.rho * self.c * self.h0

    @property
    def energy(self) -> float:
        """½Eh₀²/L [J/m²], constant."""
        return 0.5 * self.E * self.h0**2 / self.L

    def implicit_euler_impulse_error(self, dt: float) -> float:
        """2√(cΔt/πL): as for `BarImpact` (the same front after 2L/c), over a contact half as long."""
        positive(dt=dt)
        return float(2 * np.sqrt(self.c * dt / (np.pi * self.L)))

    def pressure(self, t: ArrayLike) -> Floats:
        """p(t) [Pa]."""
        tau = np.mod(np.asarray(t, dtype=float), self.period)
        start, end = self.contact
        return np.where((tau >= start) & (tau < end), self.peak_pressure, 0.0)

    def displacement(self, x: ArrayLike, t: ArrayLike) -> Floats:
        """u(x, t) [m]."""
        xi = np.asarray(x, dtype=float) / self.L
        tau = np.mod(np.asarray(t, dtype=float), self.period) * self.c / self.L
        falling = 1 - xi - np.maximum(tau - xi, 0)
        held = 1 - tau + np.maximum(tau - 1 - xi, 0) + np.maximum(tau - 2 + xi, 0)
        rising = tau - 2 - np.maximum(tau - 3 + xi, 0)
        u: Floats = self.h0 * np.where(tau < 1, falling, np.where(tau < 2, held, rising))
        return u


@dataclass(frozen=True, kw_only=True)
class TwoBarImpact:
    """A free bar of length L₁ flies at v₀ into one of length L₂ at rest, of the same material; gap 0 at t = 0.

    p = ½ρcv₀ for 2L/c, L = min(L₁, L₂). With L₁ = L₂ they part with exchanged velocities. Else the ends stay together
    without a force until 2max(L₁, L₂)/c, when the longer bar's reflected wave parts them.

    Parameters
    ----------
    E : Young's modulus [Pa]
    rho : density [kg/m³]
    L1, L2 : lengths [m]
    v0 : velocity [m/s]

    Pressures and impulses are per area, x is the distance from the interface in either bar.

    Checked: gap and pressure are complementary, by superposition of all reflections; momentum and energy by quadrature.
    """

    E: float
    rho: float
    L1: float
    L2: float
    v0: float

    def __post_init__(self) -> None:
        positive(E=self.E, rho=self.rho, L1=self.L1, L2=self.L2, v0=self.v0)

    @property
    def c(self) -> float:
        """Wave speed √(E/ρ) [m/s]."""
        return float(np.sqrt(self.E / self.rho))

    @property
    def peak_pressure(self) -> float:
        """½ρcv₀ [Pa]."""
        return 0.5 * self.rho * self.c * self.v0

    @property
    def contact_end(self) -> float:
        """2min(L₁, L₂)/c, when the force ends [s]."""
        return 2 * min(self.L1, self.L2) / self.c

    @property
    def parting(self) -> float:
        """2max(L₁, L₂)/c, when the gap opens [s]."""
        return 2 * max(self.L1, self.L2) / self.c

    @property
    def impulse(self) -> float:
        """ρ min(L₁, L₂) v₀ [Pa s]."""
        return self.peak_pressure * self.contact_end

    @property
    def energy(self) -> float:
        """½ρL₁v₀² [J/m²], constant."""
        return 0.5 * self.rho * self.L1 * self.v0**2

    def implicit_euler_impulse_error(self, dt: float) -> float:
        """√(cΔt/πL) if L₁ = L₂ = L, where both reflections meet as in `BarImpact`; else 0 at this order.

        With L₁ ≠ L₂ one reflection takes p₀Φ(τ/σ) from p₀, which stays positive: grazing returns what is lost.
        """
        positive(dt=dt)
        return float(np.sqrt(self.c * dt / (np.pi * self.L1))) if self.L1 == self.L2 else 0.0

    def pressure(self, t: ArrayLike) -> Floats:
        """p(t) [Pa]."""
        t = np.asarray(t, dtype=float)
        return np.where((t >= 0) & (t < self.contact_end), self.peak_pressure, 0.0)

    def displacement_1(self, x: ArrayLike, t: ArrayLike) -> Floats:
        """Of the first bar along v₀, x from the interface [m]."""
        x, t = np.asarray(x, dtype=float), np.asarray(t, dtype=float)
        return self.v0 * t - pushed(self._push, x, t, c=self.c, L=self.L1)

    def displacement_2(self, x: ArrayLike, t: ArrayLike) -> Floats:
        """Of the second bar along v₀, x from the interface [m]."""
        return pushed(self._push, np.asarray(x, dtype=float), np.asarray(t, dtype=float), c=self.c, L=self.L2)

    def _push(self, t: Floats) -> Floats:
        return 0.5 * self.v0 * np.minimum(t, self.contact_end)
