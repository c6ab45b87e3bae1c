"""Where a moving point first meets a surface, and which point of the surface is closest to it."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from contact.surfaces import Surface

Floats = NDArray[np.float64]


def first_root(surface: Surface, start: Floats, end: Floats, tolerance: float) -> Floats:
    """The smallest s in [0, 1] with g(start + s (end − start)) ≤ 0 for each point, NaN where there is none, (points).

    From a point with potential g no root is nearer than g/L, with L a bound of |∇g| on the motion, so that each
    advance by (g + τ)/L passes over no excursion deeper than τ: a tenth of `tolerance` [m] (Hart 1996, sphere
    tracing). The crossing is then closed in on by bisection to round-off.
    """
    motion = end - start
    rate = surface.lipschitz(start, end) * np.linalg.norm(motion, axis=1)
    depth = 0.1 * tolerance * surface.lipschitz(start, end)
    s = np.zeros(len(start))
    root = np.full(len(start), np.nan)
    before = np.zeros(len(start))
    moving = np.arange(len(start))
    while moving.size:
        g = surface.potential(start[moving] + s[moving, None] * motion[moving])
        inside = g <= 0
        root[moving[inside]] = s[moving[inside]]
        moving, g = moving[~inside], g[~inside]
        going = (s[moving] < 1) & (rate[moving] > 0)
        moving, g = moving[going], g[going]
        before[moving] = s[moving]
        s[moving] = np.minimum(s[moving] + (g + depth[moving]) / rate[moving], 1.0)
    crossed = np.flatnonzero(root > 0)
    low, high = before[crossed], root[crossed]
    for _ in range(60):
        middle = (low + high) / 2
        inside = surface.potential(start[crossed] + middle[:, None] * motion[crossed]) <= 0
        low, high = np.where(inside, low, middle), np.where(inside, middle, high)
    root[crossed] = high
    return root


def closest_points(surface: Surface, x: Floats, iterations: int = 100) -> Floats:
    """The point of the surface nearest to each x, (points, D).

    Alternates the projection of x on the tangent plane of the last guess with a step along the gradient back to the
    surface: the secant update of the method's source, whose limit satisfies (x − y) × ∇g(y) = 0 and g(y) = 0.
    It contracts where |x − y| is below the surface's radius of curvature.
    """
    y = _onto(surface, x.copy())
    for _ in range(iterations):
        normal = _unit(surface.gradient(y))
        target = x - np.einsum("pd,pd->p", x - y, normal)[:, None] * normal
        moved = _onto(surface, target)
        change = np.abs(moved - y).max(axis=1, initial=0.0)
        y = moved
        if np.all(change <= 1e-15 * (1e-300 + np.abs(x).max(initial=0.0))):
            break
    return y


def root_along(surface: Surface, x: Floats, direction: Floats, reach: float) -> Floats:
    """The signed distance s from each x to the surface along −`direction`: g(x − s d) = 0, positive on the allowed side.

    Newton's method safeguarded by a bracket within ±`reach` [m]; where the surface is not met within reach, s = ±reach.
    """
    d = direction / np.linalg.norm(direction)
    low, high = np.full(len(x), -reach), np.full(len(x), reach)
    s = np.clip(surface.potential(x), -reach, reach)
    for _ in range(100):
        at = x - s[:, None] * d
        g, slope = surface.potential(at), -surface.gradient(at) @ d
        low, high = np.where(g > 0, s, low), np.where(g > 0, high, s)
        with np.errstate(divide="ignore", invalid="ignore"):
            newton = s - g / slope
        inside = (newton > low) & (newton < high)
        new = np.where(g == 0, s, np.where(inside, newton, (low + high) / 2))
        change, s = np.abs(new - s), new
        if np.all(change <= 1e-16 * reach):
            break
    return s


def _onto(surface: Surface, y: Floats) -> Floats:
    """Newton steps along the gradient to g = 0."""
    for _ in range(50):
        g, gradient = surface.potential(y), surface.gradient(y)
        step = g / np.einsum("pd,pd->p", gradient, gradient)
        y = y - step[:, None] * gradient
        if np.all(np.abs(g) <= 1e-16 * (1e-300 + np.abs(y).max(initial=0.0))):
            break
    return y


def _unit(v: Floats) -> Floats:
    return v / np.linalg.norm(v, axis=1)[:, None]
