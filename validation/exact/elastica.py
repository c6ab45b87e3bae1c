"""The planar elastica (inextensible, unshearable) by elliptic integrals: tips of cantilevers, columns between walls."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np
from scipy.optimize import brentq, minimize_scalar
from scipy.special import ellipe, ellipeinc, ellipk, ellipkinc, expit

from validation.exact.columns import euler_load
from validation.exact.common import Floats, Regime, positive


class Swing(NamedTuple):
    """k∫ds, k∫cos χ ds, k∫sin χ ds of an arc of χ″ = −k² sin χ; `sine` is also the curvature χ′/k where it begins."""

    length: float
    cosine: float
    sine: float


def swing(chi: float, rise: float) -> Swing:
    """The arc from the angle χ to the point of no moment at a = χ + rise, |χ| <= a < π: sin(χ/2) = sin(a/2) sin φ.

    K − F(φ) = F(φ′) and E − E(φ) = E(φ′) − m sin φ sin φ′ with tan φ tan φ′ = 1/√(1−m) leave no cancellation.
    """
    p = np.sin(0.5 * (chi + rise))
    sin_phi = np.sin(0.5 * chi) / p
    cos_phi = np.sqrt(max(np.sin(chi + 0.5 * rise) * np.sin(0.5 * rise), 0.0)) / p
    dual = np.arctan2(cos_phi, np.cos(0.5 * (chi + rise)) * sin_phi)
    length = ellipkinc(dual, p**2)
    cosine = 2 * (ellipeinc(dual, p**2) - p**2 * sin_phi * np.sin(dual)) - length
    return Swing(float(length), float(cosine), float(2 * p * cos_phi))


@dataclass(frozen=True, kw_only=True)
class CantileverElastica:
    """Cantilever along x, clamped at the origin, with a dead tip force P at the angle ω (π/2 across, π push).

    EI θ″ = −P sin(ω−θ), θ(0) = 0, θ′(L) = 0; χ = θ − ω + π is a pendulum's angle and rests at the tip. The branch
    is the one without inner points of inflection. Pushed by less than Euler's load it stays straight.

    Parameters
    ----------
    EI : bending stiffness [N m²]
    L : length [m]
    P : force [N]; kL = L√(P/EI) up to 15
    omega : its direction [rad], in (0, π]

    Checked: by shooting; Mattiasson's tables. Source: Bisshopp & Drucker, Q. Appl. Math. 3 (1945) 272;
    Mattiasson, Int. J. Numer. Meth. Eng. 17 (1981) 145.
    """

    EI: float
    L: float
    P: float
    omega: float = np.pi / 2

    def __post_init__(self) -> None:
        positive(EI=self.EI, L=self.L, P=self.P)
        if not 0 < self.omega <= np.pi:
            raise ValueError(f"omega = {self.omega}: must be an angle in radians, > 0 and <= pi")
        if self._kL > 15:
            raise ValueError(f"P = {self.P}: must be <= {225 * self.EI / self.L**2:.6g}, so that kL <= 15")

    @property
    def _kL(self) -> float:
        return float(self.L * np.sqrt(self.P / self.EI))

    @cached_property
    def tip_angle(self) -> float:
        """θ(L) [rad]."""
        chi = np.pi - self.omega
        if chi == 0 and self._kL <= np.pi / 2:
            return 0.0

        def excess(z: float) -> float:
            return swing(chi, self.omega * expit(z)).length - self._kL

        return float(self.omega * expit(brentq(excess, -80, 32, xtol=1e-14, rtol=1e-15)))

    @property
    def tip(self) -> Floats:
        """(x, y) of the tip [m]."""
        if self.tip_angle == 0:
            return np.array([self.L, 0.0])
        arc, turn = swing(np.pi - self.omega, self.tip_angle), self.omega - np.pi
        x = arc.cosine * np.cos(turn) - arc.sine * np.sin(turn)
        y = arc.cosine * np.sin(turn) + arc.sine * np.cos(turn)
        return self.L / self._kL * np.array([x, y])

    @property
    def clamp_moment(self) -> float:
        """EI θ′(0) [N m]."""
        if self.tip_angle == 0:
            return 0.0
        return self.EI * self._kL / self.L * swing(np.pi - self.omega, self.tip_angle).sine


def rolled_tip(*, EI: float, L: float, M: float) -> Floats:
    """(x, y, θ) of the tip of a cantilever rolled by the end moment M [m, m, rad]: a circle when ML = 2πEI."""
    positive(EI=EI, L=L)
    angle = M * L / EI
    half = 0.5 * angle
    chord = L * np.sinc(half / np.pi)
    return np.array([chord * np.cos(half), chord * np.sin(half), angle])


@dataclass(frozen=True, kw_only=True)
class ColumnElastica:
    """Pinned column of constant length L buckled by the dead axial load P between walls ±d, first mode, any slope.

    EI θ″ = −P sin θ + V cos θ from a pin (θ′ = 0) to the contact (θ = 0, y = d), V the pin's lateral force. With
    tan α = V/P and k² = P/(EI cos α), θ − α is a pendulum's angle that rests at the pin.
    free : y = 2 sin(θ₀/2)/k in the middle, K(sin²θ₀/2) = kL/2, is at most d.
    point : the arc has the length L/2; R = 2V.
    line : θ′ = 0 at the contact too, so θ₀ = 2α, s = 2K/k and d = s(2E/K−1) sin α, m = sin²(α/2); a force V = P tan α
    at either end of the flat part, no pressure on it (the walls' forces are lateral, its compression is P).

    Parameters
    ----------
    EI : bending stiffness [N m²]
    L : length [m]
    P : axial load [N]
    d : clearance between the straight column and a wall [m]

    Raises
    ------
    ValueError : a parameter outside its range; P below Euler's load; P that buckles the flat part; no contact with
        slopes below π/2 though P passes the load at which the column reaches the wall.

    Checked: by shooting; against `rods.ColumnWalls` as d → 0; the shortening by dE = P dΔ; the catalogue's figures.
    """

    EI: float
    L: float
    P: float
    d: float

    def __post_init__(self) -> None:
        positive(EI=self.EI, L=self.L, P=self.P, d=self.d)
        lowest = euler_load(EI=self.EI, L=self.L)
        if lowest >= self.P:
            raise ValueError(f"P = {self.P}: must be > {lowest:.6g}, else the column is straight")
        flat = self.L - 2 * self.s
        if flat * np.sqrt(self.P / self.EI) >= 2 * np.pi:
            raise ValueError(
                f"P = {self.P}: must be < {(2 * np.pi / flat) ** 2 * self.EI:.6g}, which buckles the flat part"
            )

    @property
    def regime(self) -> Regime:
        """free, point (the middle) or line."""
        return self._solution[0]

    @property
    def end_angle(self) -> float:
        """θ₀, the slope at the pin [rad]."""
        return self._solution[2]

    @property
    def s(self) -> float:
        """Length between a pin and the first contact, or the middle [m]."""
        return min(self._arc.length / self._k(self._solution[1]), self.L / 2)

    @property
    def pin_force(self) -> float:
        """V: lateral force of one pin [N]."""
        return float(self.P * np.tan(self._solution[1]))

    @property
    def reaction(self) -> float:
        """Concentrated force [N]: R of the middle in point contact, each of the two in line contact."""
        return self.pin_force * (1 if self.regime == "line" else 2)

    @property
    def force(self) -> float:
        """Total contact force 2V [N]."""
        return 2 * self.pin_force

    @property
    def amplitude(self) -> float:
        """Largest deflection [m]; d in contact."""
        return self._height(*self._solution[1:])

    @property
    def shortening(self) -> float:
        """Approach of the pins [m]."""
        alpha, arc = self._solution[1], self._arc
        return float(2 * (arc.length - arc.cosine * np.cos(alpha) + arc.sine * np.sin(alpha)) / self._k(alpha))

    @property
    def contact_load(self) -> float:
        """P at which the middle reaches the wall [N]; infinite if it never does."""
        p_peak = _peak(lambda p: p / ellipk(p**2))
        if p_peak / ellipk(p_peak**2) <= self.d / self.L:
            return np.inf
        p = _root(lambda p: p / ellipk(p**2) - self.d / self.L, 0, p_peak)
        return float(self.EI * (2 * ellipk(p**2) / self.L) ** 2)

    @property
    def line_contact_load(self) -> float:
        """P at which the middle lies flat [N]: EI cos α (4K/L)², (2E/K−1) sin α = 2d/L."""

        def excess(alpha: float) -> float:
            m = np.sin(alpha / 2) ** 2
            return float((2 * ellipe(m) / ellipk(m) - 1) * np.sin(alpha) - 2 * self.d / self.L)

        alpha_peak = _peak(lambda alpha: excess(np.pi / 2 * alpha)) * np.pi / 2
        if excess(alpha_peak) <= 0:
            return np.inf
        alpha = _root(excess, 0, alpha_peak)
        return float(self.EI * np.cos(alpha) * (4 * ellipk(np.sin(alpha / 2) ** 2) / self.L) ** 2)

    def _k(self, alpha: float) -> float:
        return float(np.sqrt(self.P / (self.EI * np.cos(alpha))))

    @property
    def _arc(self) -> Swing:
        _, alpha, theta0 = self._solution
        return swing(-alpha, theta0)

    def _height(self, alpha: float, theta0: float) -> float:
        arc = swing(-alpha, theta0)
        return float((arc.cosine * np.sin(alpha) + arc.sine * np.cos(alpha)) / self._k(alpha))

    @cached_property
    def _solution(self) -> tuple[Regime, float, float]:
        """Regime, α and θ₀."""
        kl = self._k(0) * self.L / 2
        free = 2 * _root(lambda half: ellipk(np.sin(half) ** 2) - kl, 0, np.pi / 2 - 1e-9)
        if self.contact_load >= self.P:
            return "free", 0.0, free

        peak = _peak(lambda beta: self._height(np.pi / 2 * beta, np.pi * beta)) * np.pi / 2
        if self._height(peak, 2 * peak) >= self.d:
            alpha = _root(lambda alpha: self._height(alpha, 2 * alpha) - self.d, 1e-12, peak)
            if swing(-alpha, 2 * alpha).length < self._k(alpha) * self.L / 2:
                return "line", alpha, 2 * alpha

        # θ₀, not α, orders the point contacts of one P: R vanishes at d → 0 and where the middle leaves the wall.
        def inclination(theta0: float) -> float:
            def excess(alpha: float) -> float:
                return swing(-alpha, theta0).length - self._k(alpha) * self.L / 2

            if excess(0) >= 0 or excess(theta0 / 2) <= 0:  # the ends of the range, up to rounding
                return 0.0 if excess(0) >= 0 else theta0 / 2
            return _root(excess, 0, theta0 / 2)

        def flat(alpha: float) -> float:
            return swing(-alpha, 2 * alpha).length - self._k(alpha) * self.L / 2

        highest = free
        if kl < np.pi and flat(min(free / 2, 1.5)) < 0:
            highest = 2 * _root(flat, 1e-9, min(free / 2, 1.5))
        if kl >= np.pi or self._height(inclination(highest), highest) < self.d:
            raise ValueError(f"d = {self.d}: no contact of the first mode with slopes below pi/2 at P = {self.P}")
        theta0 = _root(lambda theta0: self._height(inclination(theta0), theta0) - self.d, 1e-9, highest)
        return "point", inclination(theta0), theta0


def _root(function: Callable[[float], float], low: float, high: float) -> float:
    return float(brentq(function, low, high, xtol=1e-24, rtol=1e-15))


def _peak(function: Callable[[float], float]) -> float:
    """Where a function with one maximum in [0, 1) has it."""
    options = {"xatol": 1e-10}
    return float(minimize_scalar(lambda x: -function(x), bounds=(0, 1 - 1e-9), method="bounded", options=options).x)
