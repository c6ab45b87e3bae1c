"""Where a moving point first meets a surface, and which point of the surface is closest to it."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from contact.surfaces.implicit import Foot, Surface

Floats = NDArray[np.float64]


def first_root(surface: Surface, start: Floats, end: Floats, tolerance: float) -> Floats:
    """The smallest s in [0, 1] with g(start + s (end − start)) ≤ 0 for each point, NaN where there is none, (points).

    From a point with potential g no root is nearer than g/L, with L a bound of |∇g| on the motion, so that each
    advance by (g + τ)/L passes over no excursion deeper than τ: a tenth of `tolerance` [m] (Hart 1996, sphere
    tracing). The crossing is then closed in on by bisection to round-off. Newton's method alone would step over a
    short excursion and settle on a later root, or on none.

    A convolution surface has the same search with second-order steps of its own: as long as it is outside the wall, a
    point with potential g and slope g′ along the motion stays outside while g + g′s − M s²/2 > 0, M a bound of −g″ in
    the cells near. A motion as long as the device is wide that starts as far from the wall takes one evaluation.
    """
    own = getattr(surface, "first_root", None)
    if own is not None:
        found: Floats = own(start, end, tolerance)
        return found
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


def nearest(surface: Surface, x: Floats, guess: Floats | None = None) -> Foot:
    """Signed distance, closest point, normal and Hessian of the distance for each x, by Newton's method.

    Solves y − x + μ∇g(y) = 0, g(y) = 0 from `guess` (the feet of nearby points), with the multiplier's least-squares
    estimate μ = d/|∇g|, d = n·(x − y). With S = P ∇²g P/|∇g|, P = I − n nᵀ, the distance has the Hessian
    S (I + d S)⁻¹. Where there is no guess, or Newton's method does not settle on a nearer point, `closest_points`
    finds one. Plain surfaces and convolution surfaces have a `nearest` of their own.
    """
    own = getattr(surface, "nearest", None)
    if own is not None:
        foot: Foot = own(x, guess)
        lost = np.flatnonzero(np.isnan(foot.distance))
        if lost.size:
            for mine, found in zip(foot, own(x[lost], None), strict=True):
                mine[lost] = found
        return foot
    if guess is None:
        return _feet(surface, x, closest_points(surface, x))
    y = guess.copy()
    rounding = 1e-14 * (1e-300 + np.abs(x).max(axis=1, initial=0.0))
    moving = np.arange(len(x))
    for _ in range(12):
        at = y[moving]
        S, n, size = _shape(surface, at)
        d = _dot(x[moving] - at, n)
        M = _bent(S, d)
        along = (-surface.potential(at) / size)[:, None] * n
        tangential = x[moving] - at - d[:, None] * n
        step = np.linalg.solve(M, (tangential - _times(M, along) + along)[:, :, None])[:, :, 0]
        step += (_dot(along, n) - _dot(step, n))[:, None] * n
        y[moving] += step
        moving = moving[np.linalg.norm(step, axis=1) > rounding[moving]]
        if not moving.size:
            break
    # Four times round-off may remain where the surface is steep; what is further off has not settled.
    if moving.size:
        y[moving] = closest_points(surface, x[moving])
    foot = _feet(surface, x, y)
    # On a wall beyond its focus the distance is stationary, but no bound: another is nearer, as a rule opposite.
    curvature = np.where(np.isfinite(foot.curvature), foot.curvature, 0.0)
    beyond = np.flatnonzero(foot.distance * np.linalg.eigvalsh(curvature)[:, -1] > 1 + 1e-9)
    if beyond.size:
        for mine, found in zip(foot, nearest(surface, x[beyond]), strict=True):
            mine[beyond] = found
    return foot


def follow(surface: Surface, x: Floats, guess: Floats) -> Foot:
    """`nearest` from a guess; the distance may be NaN where that does not lead to a foot."""
    foot: Foot = surface.nearest(x, guess) if hasattr(surface, "nearest") else nearest(surface, x, guess)
    return foot


def _feet(surface: Surface, x: Floats, y: Floats) -> Foot:
    S, n, _ = _shape(surface, y)
    d = _dot(x - y, n)
    return Foot(d, y, n, np.linalg.solve(_bent(S, d), S))


def _shape(surface: Surface, y: Floats) -> tuple[Floats, Floats, Floats]:
    """S, n and |∇g|."""
    gradient = surface.gradient(y)
    size = np.linalg.norm(gradient, axis=1)
    n = gradient / size[:, None]
    P = np.eye(y.shape[1]) - n[:, :, None] * n[:, None, :]
    return P @ surface.hessian(y) @ P / size[:, None, None], n, size


def _bent(S: Floats, d: Floats) -> Floats:
    """I + d S, or I where that is singular."""
    flat = np.eye(S.shape[1])
    M: Floats = flat + d[:, None, None] * S
    M[np.abs(np.linalg.det(M)) < 1e-6] = flat
    return M


def _times(M: Floats, v: Floats) -> Floats:
    product: Floats = np.einsum("pij,pj->pi", M, v)
    return product


def closest_points(surface: Surface, x: Floats, iterations: int = 100) -> Floats:
    """A point y of the surface nearest to each x, (points, D): g(y) = 0 and (x − y) × ∇g(y) = 0.

    Projects x on the tangent plane of the last guess and goes back to the surface along the gradient: the secant update
    of the method's source, which contracts where |x − y| is below the surface's radius of curvature. Beyond that its
    step is too long: it is shortened where it leads away from x, and its length adapted to the curvature that it finds
    (Barzilai and Borwein 1988), so that |x − y| never grows and convergence is superlinear.
    """
    y = _onto(surface, x)
    t = _tangential(surface, x, y)
    length = np.ones(len(x))
    rounding = 1e-15 * np.abs(x).max(axis=1, initial=0.0)
    moving = np.arange(len(x))
    for _ in range(iterations):
        step = length[moving] * np.linalg.norm(t[moving], axis=1)
        moving = moving[step > rounding[moving]]
        if not moving.size:
            break
        at, old, pull = x[moving], y[moving], t[moving]
        new = _onto(surface, old + length[moving, None] * pull)
        left = _tangential(surface, at, new)
        nearer = np.linalg.norm(at - new, axis=1) <= np.linalg.norm(at - old, axis=1) + rounding[moving]
        moved = new - old
        bent = _dot(moved, pull - left)
        with np.errstate(divide="ignore", invalid="ignore"):
            adapted = np.where(bent > 0, _dot(moved, moved) / bent, 1.0)
        y[moving] = np.where(nearer[:, None], new, old)
        t[moving] = np.where(nearer[:, None], left, pull)
        length[moving] = np.where(nearer, adapted, length[moving] / 4)
    return y


def root_along(surface: Surface, x: Floats, direction: Floats, reach: float) -> Floats:
    """The signed distance s of each x from the surface along `direction` d: g(x − s d) = 0, s > 0 on the allowed side.

    Newton's method safeguarded by a bracket within ±`reach` [m]; where the surface is not met within reach, s = ±reach.
    """
    d = direction / np.linalg.norm(direction)
    low, high = np.full(len(x), -reach), np.full(len(x), reach)
    s = np.clip(surface.potential(x), -reach, reach)
    rounding = 1e-16 * (reach + np.abs(x).max(initial=0.0))
    for _ in range(100):
        at = x - s[:, None] * d
        g, slope = surface.potential(at), -surface.gradient(at) @ d
        low, high = np.where(g > 0, s, low), np.where(g > 0, high, s)
        with np.errstate(divide="ignore", invalid="ignore"):
            newton = s - g / slope
        inside = (newton > low) & (newton < high)
        # A step of round-off ends the search: bisection would leave the root, and may not find it again behind a ball.
        settled = np.abs(g) <= rounding * np.abs(slope)
        new = np.where(settled, s, np.where(inside, newton, (low + high) / 2))
        change, s = np.abs(new - s), new
        if np.all(change <= rounding):
            break
    return s


def _onto(surface: Surface, x: Floats) -> Floats:
    """Newton steps along the gradient to g = 0; what a step leaves is of the order of its square."""
    y = x.copy()
    moving = np.arange(len(x))
    for _ in range(50):
        gradient = surface.gradient(y[moving])
        step = (surface.potential(y[moving]) / _dot(gradient, gradient))[:, None] * gradient
        y[moving] -= step
        moving = moving[np.abs(step).max(axis=1, initial=0.0) > 1e-12 * np.abs(y[moving]).max(axis=1, initial=0.0)]
        if not moving.size:
            break
    return y


def _tangential(surface: Surface, x: Floats, y: Floats) -> Floats:
    """The part of x − y in the tangent plane at y."""
    normal = surface.gradient(y)
    away = x - y
    part: Floats = away - (_dot(away, normal) / _dot(normal, normal))[:, None] * normal
    return part


def _dot(a: Floats, b: Floats) -> Floats:
    product: Floats = np.einsum("pd,pd->p", a, b)
    return product
