"""Rigid obstacles as implicit surfaces: g(x) > 0 where a body may be, 0 on the surface, < 0 inside the obstacle.

To add a surface, write a class with the three methods of `Surface` and list it in `SURFACES` for scene files.
Distances to the plane, the sphere and the cylinder are exact; elsewhere `closest_points` finds the foot point.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable
from typing import NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import null_space

Floats = NDArray[np.float64]


class Foot(NamedTuple):
    """The closest points of a surface.

    distance : signed, positive on the allowed side, (q) [m]
    point, normal : closest point y and the unit normal there, which is the gradient of the distance at x, (q, D)
    curvature : the Hessian of the distance at x, (q, D, D) [1/m]
    """

    distance: Floats
    point: Floats
    normal: Floats
    curvature: Floats


class Surface(Protocol):
    """An implicit surface in D dimensions; x has shape (points, D) [m].

    A surface that knows its closest points or first roots better than `detection` does has methods
    ``nearest(x, guess)``, of which a distance may be NaN where a guess leads nowhere, or
    ``first_root(start, end, tolerance)`` of its own; one that knows what fits, ``inradius``.
    """

    def potential(self, x: Floats) -> Floats:
        """g(x), (points)."""

    def gradient(self, x: Floats) -> Floats:
        """∇g(x), (points, D)."""

    def lipschitz(self, a: Floats, b: Floats) -> Floats:
        """A bound of |∇g| on each segment from a to b, (points)."""

    def hessian(self, x: Floats) -> Floats:
        """∇²g(x), (points, D, D)."""

    def lower_bound(self, x: Floats) -> Floats:
        """A signed distance that is nowhere larger in magnitude than the true one, cheap, (points) [m]."""


class _Distance(ABC):
    """What follows where g is the signed distance itself.

    `inradius` is the radius of the largest ball on the allowed side [m].
    """

    inradius: float = np.inf

    @abstractmethod
    def potential(self, x: Floats) -> Floats:
        """g(x), (points)."""

    @abstractmethod
    def gradient(self, x: Floats) -> Floats:
        """∇g(x), (points, D)."""

    @abstractmethod
    def hessian(self, x: Floats) -> Floats:
        """∇²g(x), (points, D, D)."""

    def lipschitz(self, a: Floats, b: Floats) -> Floats:
        """One."""
        return np.ones(len(a))

    def lower_bound(self, x: Floats) -> Floats:
        """The distance."""
        return self.potential(x)

    def nearest(self, x: Floats, guess: Floats | None = None) -> Foot:
        """x − g ∇g, without iterations."""
        g, n = self.potential(x), self.gradient(x)
        return Foot(g, x - g[:, None] * n, n, self.hessian(x))


class Plane(_Distance):
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

    def hessian(self, x: Floats) -> Floats:
        """Zero."""
        return np.zeros((len(x), len(self.normal), len(self.normal)))


class Sphere(_Distance):
    """A ball (or disc in 2D) of `radius` about `centre`; bodies stay outside, or inside where `inside`."""

    def __init__(self, centre: Floats, radius: float, inside: bool = False) -> None:
        self.centre, self.radius = np.asarray(centre, dtype=float), radius
        self.sign = -1.0 if inside else 1.0
        self.inradius = radius if inside else np.inf
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

    def hessian(self, x: Floats) -> Floats:
        """±(I − n nᵀ)/|x − c| in the round directions; zero at the centre."""
        d = self._offset(x)
        r = _radius(d)[:, None, None]
        n = self.gradient(x) @ self.across
        across = np.eye(n.shape[1]) - n[:, :, None] * n[:, None, :]
        bent = self.sign * np.divide(across, r, out=np.zeros_like(across), where=r > 0)
        hessian: Floats = self.across @ bent @ self.across.T
        return hessian


class Cylinder(Sphere):
    """An endless circular cylinder about the line through `point` along `axis`."""

    def __init__(self, point: Floats, axis: Floats, radius: float, inside: bool = False) -> None:
        super().__init__(point, radius, inside)
        self.across = null_space(np.atleast_2d(np.asarray(axis, dtype=float)))


class Torus(_Distance):
    """A tube of `radius` whose axis is the circle of radius `bend` about `centre`, across `axis`."""

    def __init__(self, centre: Floats, axis: Floats, bend: float, radius: float, inside: bool = False) -> None:
        a = np.asarray(axis, dtype=float)
        self.centre, self.axis = np.asarray(centre, dtype=float), a / np.linalg.norm(a)
        self.bend, self.radius, self.sign = bend, radius, -1.0 if inside else 1.0
        self.inradius = radius if inside else np.inf

    def _polar(self, x: Floats) -> tuple[Floats, Floats, Floats, Floats]:
        """Distance from the axis and the unit vector away from it; the same for the circle."""
        p = x - self.centre
        height = p @ self.axis
        p -= height[:, None] * self.axis
        rho = _radius(p)
        out = np.divide(p, rho[:, None], out=np.zeros_like(p), where=rho[:, None] > 0)
        q = (rho - self.bend)[:, None] * out + height[:, None] * self.axis
        s = np.hypot(rho - self.bend, height)
        # On the circle every direction across it leads to the wall.
        away = np.divide(q, s[:, None], out=np.tile(self.axis, (len(x), 1)), where=s[:, None] > 0)
        return rho, out, s, away

    def potential(self, x: Floats) -> Floats:
        """±(√((ρ − R)² + z²) − r)."""
        return self.sign * (self._polar(x)[2] - self.radius)

    def gradient(self, x: Floats) -> Floats:
        """The unit vector away from the circle, or towards it."""
        return self.sign * self._polar(x)[3]

    def hessian(self, x: Floats) -> Floats:
        """±[b bᵀ/s + (ρ − R)/(s ρ) t tᵀ], t along the circle, b across t and the gradient; zero on the circle."""
        rho, out, s, away = self._polar(x)
        t = np.cross(self.axis, out)
        b = np.cross(t, away)
        around = np.divide(1.0, s, out=np.zeros_like(s), where=s > 0)
        along = np.divide((rho - self.bend) * around, rho, out=np.zeros_like(s), where=rho > 0)
        bent: Floats = around[:, None, None] * b[:, :, None] * b[:, None, :]
        bent += along[:, None, None] * t[:, :, None] * t[:, None, :]
        return self.sign * bent


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

    def hessian(self, x: Floats) -> Floats:
        """−∇²φ by central differences of ∇φ with steps of 6e-6 of the distance from the pole."""
        y = (x - self.origin)[:, :-1]
        hessian = np.zeros((len(x), x.shape[1], x.shape[1]))
        hessian[:, :-1, :-1] = -_differences(self.slope, y)
        return hessian

    def lower_bound(self, x: Floats) -> Floats:
        """g/√(1 + sup|∇φ|²) over |g| about x: no point of the graph is further away than along its height."""
        g, y = self.potential(x), (x - self.origin)[:, :-1]
        r = _radius(y)
        y[r == 0, 0] = 1e-300
        furthest = y * (1 + np.abs(g) / np.maximum(r, 1e-300))[:, None]
        steepest = self.steepest(furthest, furthest)
        bound: Floats = g / np.sqrt(1 + steepest**2)
        return bound


def _differences(gradient: Callable[[Floats], Floats], x: Floats) -> Floats:
    """The symmetric part of central differences of a gradient."""
    step = 6e-6 * np.maximum(_radius(x), 1e-3)
    columns = []
    for e in np.eye(x.shape[1]):
        d = step[:, None] * e
        columns.append((gradient(x + d) - gradient(x - d)) / (2 * step[:, None]))
    H = np.stack(columns, axis=2)
    symmetric: Floats = (H + H.transpose(0, 2, 1)) / 2
    return symmetric


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

    def hessian(self, x: Floats) -> Floats:
        """Central differences of ∇g with steps of 6e-6 |x|."""
        return _differences(self.gradient, x)

    def lower_bound(self, x: Floats) -> Floats:
        """g over the bound of |∇g|."""
        g: Floats = self.potential(x) / self._bound
        return g
