"""Rigid obstacles as implicit surfaces: g(x) > 0 where a body may be, 0 on the surface, < 0 inside the obstacle.

To add a surface, write a class with the three methods of `Surface` and list it in `SURFACES` for scene files.
Distances to the plane, the sphere and the cylinder are exact; elsewhere `closest_points` finds the foot point.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Protocol

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import null_space

Floats = NDArray[np.float64]


class Surface(Protocol):
    """An implicit surface in D dimensions; x has shape (points, D) [m]."""

    def potential(self, x: Floats) -> Floats:
        """g(x), (points)."""

    def gradient(self, x: Floats) -> Floats:
        """∇g(x), (points, D)."""

    def lipschitz(self, a: Floats, b: Floats) -> Floats:
        """A bound of |∇g| on each segment from a to b, (points)."""


class Plane:
    """The half-space n·(x − p) ≥ 0, with `normal` n pointing to the allowed side."""

    def __init__(self, point: Floats, normal: Floats) -> None:
        n = np.asarray(normal, dtype=float)
        self.point, self.normal = np.asarray(point, dtype=float), n / np.linalg.norm(n)

    def potential(self, x: Floats) -> Floats:
        """Signed distance to the plane."""
        g: Floats = (x - self.point) @ self.normal
        return g

    def gradient(self, x: Floats) -> Floats:
        """The normal."""
        return np.tile(self.normal, (len(x), 1))

    def lipschitz(self, a: Floats, b: Floats) -> Floats:
        """One."""
        return np.ones(len(a))


class Sphere:
    """A ball (or disc in 2D) of `radius` about `centre`; bodies stay outside, or inside where `inside`."""

    def __init__(self, centre: Floats, radius: float, inside: bool = False) -> None:
        self.centre, self.radius = np.asarray(centre, dtype=float), radius
        self.sign = -1.0 if inside else 1.0
        self.across = np.eye(len(self.centre))

    def _offset(self, x: Floats) -> Floats:
        """x − c in the basis `across` of the directions that the surface is round in."""
        d: Floats = (x - self.centre) @ self.across
        return d

    def potential(self, x: Floats) -> Floats:
        """±(|x − c| − R)."""
        return self.sign * (_radius(self._offset(x)) - self.radius)

    def gradient(self, x: Floats) -> Floats:
        """±(x − c)/|x − c|; at the centre, where every direction would do, one of them."""
        d = self._offset(x)
        d[_radius(d) == 0, 0] = 1.0
        gradient: Floats = self.sign * (d / _radius(d)[:, None]) @ self.across.T
        return gradient

    def lipschitz(self, a: Floats, b: Floats) -> Floats:
        """One."""
        return np.ones(len(a))


class Cylinder(Sphere):
    """An endless circular cylinder about the line through `point` along `axis`."""

    def __init__(self, point: Floats, axis: Floats, radius: float, inside: bool = False) -> None:
        super().__init__(point, radius, inside)
        self.across = null_space(np.atleast_2d(np.asarray(axis, dtype=float)))


class Graph:
    """The region above the graph of φ: g(x) = ±(x_D − o_D) − φ(x' − o'), with x' all coordinates but the last.

    Parameters
    ----------
    origin : o, where the graph's own origin stands [m]
    height, slope : φ(x') and ∇φ(x'), vectorised over rows
    steepest : a bound of |∇φ| over the rows of two arrays of x', in between as well
    downward : the obstacle is above and the body below it (the minus sign)
    """

    def __init__(
        self,
        origin: Floats,
        height: Callable[[Floats], Floats],
        slope: Callable[[Floats], Floats],
        steepest: Callable[[Floats, Floats], Floats],
        downward: bool = False,
    ) -> None:
        self.origin = np.asarray(origin, dtype=float)
        self.height, self.slope, self.steepest = height, slope, steepest
        self.sign = -1.0 if downward else 1.0

    def potential(self, x: Floats) -> Floats:
        """±(x_D − o_D) − φ(x' − o')."""
        y = x - self.origin
        g: Floats = self.sign * y[:, -1] - self.height(y[:, :-1])
        return g

    def gradient(self, x: Floats) -> Floats:
        """(−∇φ, ±1)."""
        y = x - self.origin
        return np.column_stack([-self.slope(y[:, :-1]), np.full(len(x), self.sign)])

    def lipschitz(self, a: Floats, b: Floats) -> Floats:
        """√(1 + sup|∇φ|²)."""
        steepest = self.steepest((a - self.origin)[:, :-1], (b - self.origin)[:, :-1])
        bound: Floats = np.sqrt(1 + steepest**2)
        return bound


def _furthest(a: Floats, b: Floats) -> Floats:
    return np.maximum(_radius(a), _radius(b))


def _radius(y: Floats) -> Floats:
    r: Floats = np.linalg.norm(y, axis=1)
    return r


def paraboloid(origin: Floats, radius: float, downward: bool = False) -> Graph:
    """A parabola or paraboloid φ = −r²/2R of curvature 1/R at its pole."""
    return Graph(
        origin,
        lambda y: -(y**2).sum(axis=1) / (2 * radius),
        lambda y: -y / radius,
        lambda a, b: _furthest(a, b) / radius,
        downward,
    )


def cone(origin: Floats, slope: float, downward: bool = False) -> Graph:
    """A wedge (2D) or cone φ = −r tan α with surface slope tan α; at the tip its gradient is taken along the axis."""
    return Graph(
        origin,
        lambda y: -slope * _radius(y),
        lambda y: -slope * y / np.maximum(_radius(y), 1e-300)[:, None],
        lambda a, b: np.full(len(a), slope),
        downward,
    )


def sinusoid(origin: Floats, amplitude: float, wavelength: float, downward: bool = False) -> Graph:
    """Waves φ = −Δ (1 − cos 2πx/λ) along the first coordinate, crests at the origin."""
    k = 2 * np.pi / wavelength

    def slope(y: Floats) -> Floats:
        result = np.zeros_like(y)
        result[:, 0] = -amplitude * k * np.sin(k * y[:, 0])
        return result

    return Graph(
        origin,
        lambda y: -amplitude * (1 - np.cos(k * y[:, 0])),
        slope,
        lambda a, b: np.full(len(a), amplitude * k),
        downward,
    )


def dome(origin: Floats, radius: float, rim: float, downward: bool = False) -> Graph:
    """A hemisphere φ = √(R² − r²) up to r = `rim`, continued by its tangent cone."""
    edge = np.sqrt(radius**2 - rim**2)
    steep = rim / edge

    def height(y: Floats) -> Floats:
        r = _radius(y)
        z: Floats = np.where(r < rim, np.sqrt(np.maximum(radius**2 - r**2, edge**2)), edge - steep * (r - rim))
        return z

    def slope(y: Floats) -> Floats:
        r = _radius(y)
        rate = np.where(r < rim, -1 / np.sqrt(np.maximum(radius**2 - r**2, edge**2)), -steep / np.maximum(r, rim))
        slopes: Floats = rate[:, None] * y
        return slopes

    return Graph(origin, height, slope, lambda a, b: np.full(len(a), steep), downward)


class Potential:
    """Any surface given by Python functions g and ∇g and a bound of |∇g| near the motion."""

    def __init__(
        self, potential: Callable[[Floats], Floats], gradient: Callable[[Floats], Floats], lipschitz: float
    ) -> None:
        self.potential, self.gradient, self._bound = potential, gradient, lipschitz

    def lipschitz(self, a: Floats, b: Floats) -> Floats:
        """The bound given."""
        return np.full(len(a), self._bound)
