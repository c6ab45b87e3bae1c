"""The planar elastica in a tube, by shooting: a straight wire in a circular tube, an arc in a straight tube."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np
from scipy.integrate import solve_ivp
from scipy.optimize import brentq, root

from validation.exact.common import Floats, Regime, positive
from validation.exact.rods import WireTube


class State(NamedTuple):
    """Position, inclination and moment of a wire's section, in units of EI and of the length 1/curvature."""

    x: float
    y: float
    theta: float
    m: float


class Shot(NamedTuple):
    """The right half of the wire: middle, contact next to the tip, tip; forces of that contact and of the tip."""

    middle: State
    contact: State
    tip: State
    inner: float
    outer: float
    s: float


def march(start: State, length: float, force: Floats, curvature: float = 0.0) -> State:
    """Integrate θ′ = m + curvature, m′ = f_x sin θ − f_y cos θ under the constant force f of the part beyond."""

    def rhs(_: float, y: Floats) -> list[float]:
        cos, sin = np.cos(y[2]), np.sin(y[2])
        return [cos, sin, y[3] + curvature, force[0] * sin - force[1] * cos]

    end = solve_ivp(rhs, (0, length), start, method="DOP853", rtol=1e-13, atol=1e-16).y[:, -1]
    return State(*map(float, end))


def shoot(residual: Callable[[Floats], list[float]], guess: list[float]) -> Floats:
    """The zero of `residual`; raises RuntimeError if none is found."""
    result = root(lambda z: residual(z * guess), np.ones(len(guess)), tol=1e-13)
    if np.abs(result.fun).max() > 1e-9:
        raise RuntimeError(f"shooting stopped at the residual {np.abs(result.fun).max():.1e}: {result.message}")
    solution: Floats = result.x * guess
    return solution


@dataclass(frozen=True, kw_only=True)
class WireTubeElastica:
    """Straight inextensible wire with free ends in a circular tube, both in one plane, without friction.

    The wire's axis stays between the circles R−c and R+c (a whole torus: the wire may be longer than any arc of it
    that is modelled). EI θ″ = f_x sin θ − f_y cos θ; a tip feels the outer wall's force T towards the centre and no
    moment.
    free : L² <= 16cR, exactly: the middle touches R−c with the tips on R+c.
    point : the middle touches R−c with a curvature below 1/(R−c) there.
    line : beyond the length at which that curvature is reached. The name is the linear theory's: the part T sin η of
    the tip force (near EI/R² for small c) compresses the wire, which lifts it off the inner wall by `bow` between two
    contacts of force Q, each `s` from a tip, with λ = 0 between them. The bow grows like the fourth power of their
    distance over R³, whatever c: only where it is far below c is the middle the linear theory's.

    Parameters
    ----------
    EI : bending stiffness [N m²]
    L : length of the wire [m]
    R : radius of the tube's axis [m]
    c : clearance, tube radius less wire radius [m], <= R/10

    Raises
    ------
    ValueError : a parameter outside its range; the wire between the inner contacts bows to the outer wall.
    RuntimeError : the shooting does not converge.

    Checked: by elliptic integrals and by the minimum of the bending energy of a chain between the walls; against
    `rods.WireTube` as c → 0; balance of forces; the catalogue's figures.
    """

    EI: float
    L: float
    R: float
    c: float

    def __post_init__(self) -> None:
        positive(EI=self.EI, L=self.L, R=self.R, c=self.c)
        if self.c > self.R / 10:
            raise ValueError(f"c = {self.c}: must be <= R/10 = {self.R / 10}, where the shooting converges")
        if self.bow > 2 * self.c:
            raise ValueError(f"L = {self.L}: must be shorter, the middle bows by {self.bow:.3g} > 2c to the outer wall")

    @property
    def regime(self) -> Regime:
        """free, point (three points) or line (tips and two inner points, see the class)."""
        if 16 * self.c * self.R >= self.L**2:
            return "free"
        return "point" if self.line_contact_length >= self.L else "line"

    @property
    def tip_force(self) -> float:
        """T, of the outer wall on a tip [N]."""
        return self.EI / self.R**2 * self._shot.outer if self._shot else 0.0

    @property
    def inner_force(self) -> float:
        """Of the inner wall: 2T cos η on the middle in point contact, Q on each of the two contacts of a line [N]."""
        return self.EI / self.R**2 * self._shot.inner if self._shot else 0.0

    @property
    def force(self) -> float:
        """Sum of all contact forces [N]."""
        return 2 * self.tip_force + self.inner_force * (2 if self.regime == "line" else 1)

    @property
    def s(self) -> float:
        """Length between a tip and the next contact [m]."""
        return self.R * self._shot.s if self._shot else self.L / 2

    @property
    def tip_polar_angle(self) -> float:
        """η, from the middle to a tip as seen from the tube's centre [rad]; raises ValueError without contact."""
        tip = self._contact.tip
        return float(np.arctan2(tip.x, -tip.y))

    @property
    def middle_curvature(self) -> float:
        """θ′ of the middle [1/m]."""
        return self._shot.middle.m / self.R if self._shot else 0.0

    @property
    def bow(self) -> float:
        """Distance of the middle from the inner wall [m]: 0 in point contact."""
        return self.R * -self._shot.middle.y - (self.R - self.c) if self._shot else 0.0

    @cached_property
    def line_contact_length(self) -> float:
        """L at which the middle's curvature is the inner wall's [m]."""
        linear = WireTube(EI=1, L=2 * np.sqrt(48 * self._c), R=1, c=self._c)
        T, s = linear.tip_force, linear.s

        def residual(z: Floats) -> list[float]:
            tip = march(State(0, self._c - 1, 0, 1 / (1 - self._c)), z[0], z[1:])
            return self._tip_conditions(tip, z[1:])

        return float(2 * self.R * shoot(residual, [s, -s * T, T])[0])

    @property
    def _c(self) -> float:
        return self.c / self.R

    @property
    def _contact(self) -> Shot:
        if self._shot is None:
            raise ValueError(f"L = {self.L}: must be > {4 * np.sqrt(self.c * self.R):.6g}, else the wire lies anywhere")
        return self._shot

    @cached_property
    def _shot(self) -> Shot | None:
        if self.regime == "free":
            return None
        linear = WireTube(EI=1, L=self.L / self.R, R=1, c=self._c)
        return self._three_points(linear) if self.regime == "point" else self._two_inner_points()

    def _tip_conditions(self, tip: State, force: Floats) -> list[float]:
        """No moment, on the outer wall, the force along the radius; each of order one."""
        radial = (np.hypot(tip.x, tip.y) - 1 - self._c) / self._c
        return [tip.m, radial, (tip.x * force[1] - tip.y * force[0]) / np.hypot(*force)]

    def _three_points(self, linear: WireTube) -> Shot:
        half, start = linear.L / 2, State(0, self._c - 1, 0, 0)

        def residual(z: Floats) -> list[float]:
            return self._tip_conditions(march(start._replace(m=z[0]), half, z[1:]), z[1:])

        T = 3 * (half**2 / 2 - 2 * self._c) / half**3
        m, *force = shoot(residual, [T * half, -T * half, T])
        middle = start._replace(m=float(m))
        return Shot(
            middle, middle, march(middle, half, np.array(force)), 2 * float(force[1]), float(np.hypot(*force)), half
        )

    def _two_inner_points(self) -> Shot:
        half, inner = self.L / (2 * self.R), 1 - self._c

        def halves(z: Floats) -> tuple[State, State, State, Floats]:
            m, compression, s, Q = z
            contact = march(State(0, 0, 0, m), half - s, np.array([-compression, 0.0]))
            level = -inner * np.cos(contact.theta) - contact.y
            force = np.array([-compression - Q * np.sin(contact.theta), Q * np.cos(contact.theta)])
            contact = contact._replace(y=contact.y + level)
            return State(0, level, 0, m), contact, march(contact, s, force), force

        def residual(z: Floats) -> list[float]:
            _, contact, tip, force = halves(z)
            tangency = contact.x / (inner * np.sin(contact.theta)) - 1
            return [tangency, *self._tip_conditions(tip, force)]

        s = self.line_contact_length / (2 * self.R)
        z = shoot(residual, [1 / inner, 1.0, s, 1 / s])
        middle, contact, tip, force = halves(z)
        return Shot(middle, contact, tip, float(z[3]), float(np.hypot(*force)), float(z[2]))


@dataclass(frozen=True, kw_only=True)
class ArcTubeElastica:
    """Inextensible arc of natural curvature κ₀ with free ends in a straight tube, in its plane, without friction.

    EI θ″ = −T cos θ, θ′ = κ₀ at the tips, which one wall presses with T; the middle touches the other, 2c away.
    free : 2c >= (1 − cos(κ₀L/2))/κ₀, the sagitta (κ₀L <= π).
    point : the middle carries 2T. line : the middle lies flat, without pressure, between forces T at s from the tips;
    T and s do not depend on L.

    Parameters
    ----------
    EI : bending stiffness [N m²]
    L : length of the wire [m]
    kappa0 : natural curvature [1/m]
    c : clearance, tube radius less wire radius [m]; in line contact 2cκ₀ < 1/2, so that the tips' slopes stay below π/2

    Raises
    ------
    ValueError : a parameter outside its range.
    RuntimeError : the shooting does not converge.

    Checked: the first integral; against `rods.WireTube` with R = 1/κ₀ as c → 0.
    """

    EI: float
    L: float
    kappa0: float
    c: float

    def __post_init__(self) -> None:
        positive(EI=self.EI, L=self.L, kappa0=self.kappa0, c=self.c)
        if self.regime == "free" and self.kappa0 * self.L > np.pi:
            raise ValueError(f"L = {self.L}: must be <= pi/kappa0 = {np.pi / self.kappa0:.6g} without contact")
        if self.regime == "line" and self._gap >= 0.5:
            raise ValueError(
                f"c = {self.c}: must be < 1/(4 kappa0) = {0.25 / self.kappa0:.6g}, else the ends fold back"
            )

    @property
    def regime(self) -> Regime:
        """free, point (three points) or line."""
        half = self.kappa0 * self.L / 2
        if half <= np.pi / 2 and 1 - np.cos(half) <= self._gap:
            return "free"
        return "point" if self._gap < 0.5 and self.line_contact_length >= self.L else "line"

    @property
    def tip_force(self) -> float:
        """T [N]."""
        return self.EI * self.kappa0**2 * self._solution[1]

    @property
    def force(self) -> float:
        """Sum of all contact forces 4T [N]."""
        return 4 * self.tip_force

    @property
    def s(self) -> float:
        """Length between a tip and the next contact [m]."""
        return self._solution[0] / self.kappa0

    @property
    def middle_curvature(self) -> float:
        """θ′ of the middle [1/m]; 0 in line contact."""
        return self.kappa0 * (1 + self._solution[2])

    @cached_property
    def line_contact_length(self) -> float:
        """L at which the middle is flat [m]."""
        return float(2 * self._flat_end[0] / self.kappa0)

    @property
    def _gap(self) -> float:
        return 2 * self.c * self.kappa0

    @cached_property
    def _flat_end(self) -> Floats:
        """s and T, in units of κ₀ and EI, of an end that begins flat."""

        def residual(z: Floats) -> list[float]:
            tip = march(State(0, 0, 0, -1), z[0], np.array([0, -z[1]]), curvature=1.0)
            return [tip.m, tip.y / self._gap - 1]

        s = np.sqrt(6 * self._gap)
        return shoot(residual, [s, 1 / s])

    @cached_property
    def _solution(self) -> tuple[float, float, float]:
        """s, T and the moment of the middle, in units of κ₀ and EI."""
        half = self.kappa0 * self.L / 2
        if self.regime == "free":
            return half, 0.0, 0.0
        if self.regime == "line":
            s, T = self._flat_end
            return float(s), float(T), -1.0

        def tip(T: float, m: float) -> State:
            return march(State(0, 0, 0, m), half, np.array([0, -T]), curvature=1.0)

        def moment(T: float) -> float:
            return float(brentq(lambda m: tip(T, m).m, -T * half - 1e-9, 1e-9, xtol=1e-16))

        T = brentq(lambda T: tip(T, moment(T)).y - self._gap, 0, 1.5 / half, xtol=1e-16)
        return half, float(T), moment(T)
