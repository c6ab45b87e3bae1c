"""Obstacle problems of a string and of membranes under unit tension: −Δu = f beside the obstacle."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike
from scipy.optimize import brentq

from validation.exact.common import Floats, positive, radius

BALL_TANGENT = 0.9  # radius beyond which the ball is continued by its tangent cone


@dataclass(frozen=True, kw_only=True)
class MembraneBall:
    """Membrane without load stretched over the unit ball: u = √(1−r²) for r < a, u = −A log r + B beyond.

    u(R) = 0; u and u′ are continuous at a: a²(log R − log a) = 1−a², A = a²/√(1−a²), B = √(1−a²) + A log a.
    The obstacle is √(1−r²) up to r = .9 and its tangent cone beyond, so a <= .9, that is R >= 1.138.
    The catalogue's instance is R = 2 on the square [−2, 2]², with u imposed on its boundary.

    Checked: the free boundary by shooting for the radial equation; u above the obstacle; the catalogue's a, A, B, 2πA.
    Source: PETSc's example `ex9.c` of SNESVI (Bueler, PETSc for Partial Differential Equations, ch. 12).
    """

    R: float = 2.0

    def __post_init__(self) -> None:
        positive(R=self.R)
        lowest = BALL_TANGENT * np.exp(1 / BALL_TANGENT**2 - 1)
        if lowest > self.R:
            raise ValueError(f"R = {self.R}: must be >= {lowest:.6f}, else the contact passes r = {BALL_TANGENT}")

    @cached_property
    def a(self) -> float:
        """Radius of the contact."""
        return float(brentq(lambda a: a**2 * np.log(self.R / a) - 1 + a**2, 1e-9, 1, xtol=1e-16, rtol=1e-15))

    @property
    def A(self) -> float:
        """a²/√(1−a²): minus the slope of u against log r."""
        return float(self.a**2 / np.sqrt(1 - self.a**2))

    @property
    def B(self) -> float:
        """√(1−a²) + A log a."""
        return float(np.sqrt(1 - self.a**2) + self.A * np.log(self.a))

    @property
    def force(self) -> float:
        """Contact force 2πA (tension 1)."""
        return 2 * np.pi * self.A

    def displacement(self, points: ArrayLike) -> Floats:
        """u at points (n, 2), shape (n)."""
        r = radius(points)
        outside = -self.A * np.log(np.maximum(r, self.a)) + self.B
        return np.where(r < self.a, np.sqrt(np.maximum(1 - r**2, 0)), outside)

    def obstacle(self, points: ArrayLike) -> Floats:
        """The lower bound of u at points (n, 2), shape (n)."""
        r = radius(points)
        height = np.sqrt(1 - BALL_TANGENT**2)
        cone = height - BALL_TANGENT / height * (r - BALL_TANGENT)
        return np.where(r < BALL_TANGENT, np.sqrt(np.maximum(1 - r**2, 0)), cone)


@dataclass(frozen=True, kw_only=True)
class MembraneDisc:
    """Membrane on r < R, u(R) = 0, pressed by f against a flat obstacle: −Δu = f beside it, u <= d.

    u = f(R²−r²)/4 − ½fa² log(R/r) for r > a, where f(R²−a²)/4 − ½fa² log(R/a) = d; a = 0 if d >= fR²/4 (no contact).

    Parameters
    ----------
    R, f, d : radius, load per area over tension, depth of the obstacle; all > 0

    Checked: the free boundary by scipy's `solve_bvp`; the catalogue's a at R=f=1, d=.1.
    """

    R: float
    f: float
    d: float

    def __post_init__(self) -> None:
        positive(R=self.R, f=self.f, d=self.d)

    @cached_property
    def a(self) -> float:
        """Radius of the contact."""
        depth = 4 * self.d / (self.f * self.R**2)
        if depth >= 1:
            return 0.0
        s = brentq(lambda s: 1 - s + s * np.log(s) - depth, 1e-300, 1, xtol=1e-17, rtol=1e-15)  # s = (a/R)²
        return float(self.R * np.sqrt(s))

    @property
    def force(self) -> float:
        """Contact force fπa²."""
        return self.f * np.pi * self.a**2

    def displacement(self, points: ArrayLike) -> Floats:
        """u at points (n, 2), shape (n)."""
        r = radius(points)
        if self.a == 0:
            return self.f * (self.R**2 - r**2) / 4
        beside: Floats = np.maximum(r, self.a)
        return self.f * (self.R**2 - beside**2) / 4 - 0.5 * self.f * self.a**2 * np.log(self.R / beside)


@dataclass(frozen=True, kw_only=True)
class String:
    """String between supports u(0) = u(L) = 0, pressed by f per length towards a floor: −u″ = f beside it, u <= d.

    The free length at either support is a = √(2d/f): u = d − ½f(a−x)² for x < a, u = d between, and the floor carries
    f per length there, f(L−2a) in all; nothing concentrated. No contact if 2a >= L, where u = ½f x(L−x).

    Parameters
    ----------
    L, f, d : length, load per length over tension, depth of the floor; all > 0

    Checked: −u″ = f beside the floor and u′ = 0 at it by finite differences; balance of the forces.
    """

    L: float
    f: float
    d: float

    def __post_init__(self) -> None:
        positive(L=self.L, f=self.f, d=self.d)

    @property
    def a(self) -> float:
        """Free length at a support (half the string if it does not touch)."""
        return float(min(np.sqrt(2 * self.d / self.f), 0.5 * self.L))

    @property
    def force(self) -> float:
        """Contact force f(L−2a)."""
        return self.f * (self.L - 2 * self.a)

    def displacement(self, x: ArrayLike) -> Floats:
        """u(x)."""
        x = np.asarray(x, dtype=float)
        near: Floats = np.minimum(np.minimum(x, self.L - x), self.a)
        return 0.5 * self.f * near * (2 * self.a - near)
