"""Impacts of points and spheres: implicit Euler's own sequence, and Hertz's quasi-static contact."""

from __future__ import annotations

from dataclasses import dataclass
from fractions import Fraction
from functools import cached_property
from math import isqrt

import numpy as np
from numpy.typing import ArrayLike
from scipy.special import beta, betainc, betaincinv

from validation.exact.common import ElasticBody, Floats, positive


@dataclass(frozen=True, kw_only=True)
class BallDrop:
    """A point mass dropped from the height x₀ on a floor, as implicit Euler computes it: exact, no limit Δt → 0.

    v_n = v_{n−1} − hg + p_n/m, x_n = x_{n−1} + h v_n, 0 <= x_n ⊥ p_n >= 0, h = Δt. Free: x_n = x₀ − gh²n(n+1)/2. In the
    first step N that would end below the floor v_N = −x_{N−1}/h, p_N = m(v_N − v_{N−1} + hg); then
    p_{N+1} = m(hg + x_{N−1}/h), and mgh for ever. Where x_N = 0 without a force (a grazing step) p_N = 0.

    Floats stand for the decimal numbers they are written as, all is rational: x₄ = 0 exactly for g=10, x₀=1, h=.1.

    Parameters
    ----------
    m : mass [kg]
    g : gravity [m/s²]
    x0 : height [m], >= 0
    dt : time step h [s]

    Checked: against the complementarity problem of each step in rational arithmetic; the catalogue's impulses.
    """

    m: float
    g: float
    x0: float
    dt: float

    def __post_init__(self) -> None:
        positive(m=self.m, g=self.g, dt=self.dt)
        if not (np.isfinite(self.x0) and self.x0 >= 0):
            raise ValueError(f"x0 = {self.x0}: must be >= 0")

    @cached_property
    def contact_step(self) -> int:
        """N, the first step that ends on the floor: the smallest with gh²N(N+1)/2 >= x₀."""
        _, g, x0, h = self._rationals
        root = isqrt(int(8 * x0 / (g * h**2)))
        return next(n for n in range(max(root // 2 - 1, 1), root + 2) if g * h**2 * n * (n + 1) >= 2 * x0)

    @property
    def grazing(self) -> bool:
        """Whether the step N ends on the floor without a force."""
        return self._impulse(self.contact_step) == 0

    @property
    def rest_impulse(self) -> float:
        """mgh [N s], from step N+2 on."""
        return self._impulse(self.contact_step + 2)

    def positions(self, steps: int) -> Floats:
        """x₀ … x_steps, shape (steps + 1) [m]."""
        return np.array([float(self._position(n)) for n in range(steps + 1)])

    def velocities(self, steps: int) -> Floats:
        """v₀ … v_steps, shape (steps + 1) [m/s]."""
        return np.array([float(self._velocity(n)) for n in range(steps + 1)])

    def impulses(self, steps: int) -> Floats:
        """p₀ = 0, p₁ … p_steps, shape (steps + 1) [N s]; the contact force is p/h."""
        return np.array([0.0] + [self._impulse(n) for n in range(1, steps + 1)])

    @cached_property
    def _rationals(self) -> tuple[Fraction, Fraction, Fraction, Fraction]:
        m, g, x0, h = (Fraction(repr(float(v))) for v in (self.m, self.g, self.x0, self.dt))
        return m, g, x0, h

    def _position(self, n: int) -> Fraction:
        _, g, x0, h = self._rationals
        return x0 - g * h**2 * n * (n + 1) / 2 if n < self.contact_step else Fraction(0)

    def _velocity(self, n: int) -> Fraction:
        return (self._position(n) - self._position(n - 1)) / self._rationals[3] if n > 0 else Fraction(0)

    def _impulse(self, n: int) -> float:
        m, g, _, h = self._rationals
        return float(m * (self._velocity(n) - self._velocity(n - 1) + h * g))


@dataclass(frozen=True, kw_only=True)
class HertzImpact(ElasticBody):
    """An elastic sphere that meets a rigid plane with v₀, its contact quasi-static: m δ̈ = −(4/3) E*√R δ^{3/2}.

    δ_max = (15mv₀²/16E*√R)^{2/5}; t(δ) = (2/5)(δ_max/v₀) B(2/5, 1/2) I_z(2/5, 1/2), z = (δ/δ_max)^{5/2}, which gives
    T = 2t(δ_max) = 2.8682657 (m²/RE*²v₀)^{1/5}. Restitution 1: the impulse is 2mv₀. No gravity.

    Parameters
    ----------
    m : mass [kg]
    v0 : velocity of impact [m/s]
    R : radius of the sphere [m]
    E, nu : Young's modulus [Pa] and Poisson's ratio of the sphere, E* = E/(1−ν²)

    Checked: by integrating the equation of motion. Source: Johnson, Contact Mechanics, §11.4.
    """

    m: float
    v0: float
    R: float
    nu: float = 0.0

    def __post_init__(self) -> None:
        super().__post_init__()
        positive(m=self.m, v0=self.v0, R=self.R)

    @property
    def delta(self) -> float:
        """Largest approach [m]."""
        return float((15 * self.m * self.v0**2 / (16 * np.sqrt(self.R) * self.E_star)) ** 0.4)

    @property
    def peak_force(self) -> float:
        """(4/3) E*√R δ_max^{3/2} [N]."""
        return float(self.force(self.duration / 2))

    @property
    def duration(self) -> float:
        """T [s]."""
        return float(0.8 * self.delta / self.v0 * beta(0.4, 0.5))

    @property
    def impulse(self) -> float:
        """2mv₀ [N s]."""
        return 2 * self.m * self.v0

    def approach(self, t: ArrayLike) -> Floats:
        """δ(t), t from the first touch [m]; 0 outside [0, T]."""
        phase = 1 - np.abs(2 * np.asarray(t, dtype=float) / self.duration - 1)
        return self.delta * np.asarray(betaincinv(0.4, 0.5, np.maximum(phase, 0))) ** 0.4

    def passes(self, force: float) -> tuple[float, float]:
        """When the contact force passes `force` on its way up and on its way down [s]; NaN above its peak."""
        part = (force / self.peak_force) ** (2 / 3)
        rise = self.duration / 2 * float(betainc(0.4, 0.5, part**2.5)) if part <= 1 else np.nan
        return rise, self.duration - rise

    def force(self, t: ArrayLike) -> Floats:
        """Contact force [N]."""
        force: Floats = 4 / 3 * self.E_star * np.sqrt(self.R) * self.approach(t) ** 1.5
        return force
