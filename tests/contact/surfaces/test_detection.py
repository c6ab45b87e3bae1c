"""First roots on segments, closest points and distances along a direction, against closed forms and brute force."""

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.optimize import minimize_scalar

from contact.surfaces.detection import closest_points, first_root, nearest, root_along
from contact.surfaces.implicit import (
    Cylinder,
    Graph,
    Plane,
    Potential,
    Sphere,
    Surface,
    cone,
    dome,
    paraboloid,
    sinusoid,
)

Floats = NDArray[np.float64]
TOLERANCE = 1e-3


def _quadratic_root(a: Floats, b: Floats, c: Floats) -> tuple[Floats, Floats]:
    """The smallest s in [0, 1] with a s² + b s + c ≤ 0 (NaN without), and the least value on [0, 1]."""
    with np.errstate(divide="ignore", invalid="ignore"):
        d = np.sqrt(b**2 - 4 * a * c)
        q = -0.5 * (b + np.where(b >= 0, d, -d))
        roots = np.sort(np.stack([q / a, c / q, np.where(c <= 0, 0.0, np.nan)]), axis=0)
        # Between two roots a parabola that opens upwards is negative: it enters at the smaller one.
        s = np.where((roots >= 0) & (roots <= 1), roots, np.nan)
        lowest = np.clip(np.where(a > 0, -b / (2 * a), np.where(b + a < 0, 1.0, 0.0)), 0, 1)
    least = np.minimum(a * lowest**2 + b * lowest + c, np.minimum(c, a + b + c))
    return np.fmin(np.fmin(s[0], s[1]), s[2]), least


def _segments(count: int, D: int, seed: int) -> tuple[Floats, Floats]:
    start, end = np.random.default_rng(seed).uniform(-1, 1, (2, count, D))
    return start, end


@pytest.mark.parametrize("D", [2, 3])
@pytest.mark.parametrize("kind", ["plane", "sphere", "cylinder", "paraboloid"])
def test_first_root_of_random_segments(kind: str, D: int) -> None:
    """100,000 segments against the roots of quadratics: none that goes deeper than a tenth of the tolerance is missed,
    none is found where there is none, and what is found is the first crossing to round-off."""
    start, end = _segments(12_500, D, seed=D)
    m = end - start
    n = np.arange(1.0, D + 1) / np.linalg.norm(np.arange(1.0, D + 1))
    surface: Surface
    if kind == "plane":
        surface = Plane(np.full(D, 0.1), n)
        form = np.zeros(len(m)), m @ n, (start - 0.1) @ n
        depth = lambda g: g  # noqa: E731
    elif kind == "paraboloid":
        R = 0.3
        surface = paraboloid(np.zeros(D), R)
        r, dr = start[:, :-1], m[:, :-1]
        form = (dr**2).sum(1) / (2 * R), m[:, -1] + (r * dr).sum(1) / R, start[:, -1] + (r**2).sum(1) / (2 * R)
        depth = lambda g: g / np.sqrt(1 + 2 * (D - 1) / R**2)  # noqa: E731  a distance is at least that
    else:
        R = 0.5
        across = np.eye(D) - (np.outer(n, n) if kind == "cylinder" else 0)
        surface = Sphere(np.zeros(D), R) if kind == "sphere" else Cylinder(np.zeros(D), n, R)
        p, dp = start @ across, m @ across
        form = (dp**2).sum(1), 2 * (p * dp).sum(1), (p**2).sum(1) - R**2
        depth = lambda g: g / (2 * R)  # noqa: E731  R − √(R² + g) ≥ −g/2R
    exact, least = _quadratic_root(*form)
    found = first_root(surface, start, end, TOLERANCE)

    deep = depth(least) < -0.1 * TOLERANCE
    assert deep.sum() > 1000
    assert np.all(np.isfinite(found[deep]))
    assert np.all(np.isnan(found[least > 1e-14]))
    both = np.isfinite(found) & np.isfinite(exact)
    # round-off ε of the potential moves the root by ε/|slope|, or √ε where it grazes
    a, b, c = form
    slope = np.maximum(np.sqrt(np.maximum(b**2 - 4 * a * c, 0)), 1e-7)
    assert np.all(np.abs(found - exact)[both] <= 1e-14 / slope[both] + 1e-15)


@pytest.mark.parametrize("inside", [False, True])
def test_grazing_segments(inside: bool) -> None:
    """Tangents of a circle shifted by a depth: met where deeper than a tenth of the tolerance, never where outside."""
    rng = np.random.default_rng(5)
    count = 2000
    angle = rng.uniform(0, 2 * np.pi, count)
    n, t = np.stack([np.cos(angle), np.sin(angle)], 1), np.stack([-np.sin(angle), np.cos(angle)], 1)
    depth = TOLERANCE * rng.choice([-1, -0.1, -1e-3, 1e-3, 0.101, 0.2, 1.0], count)
    if inside:  # chords of the circle that bodies stay in end outside it by `depth`
        start = rng.uniform(0, 0.5, count)[:, None] * n
        end = (1 + depth)[:, None] * n
    else:
        foot = (1 - depth)[:, None] * n
        start = foot - rng.uniform(0.3, 2, count)[:, None] * t
        end = foot + rng.uniform(0.3, 2, count)[:, None] * t
    found = first_root(Sphere(np.zeros(2), 1.0, inside), start, end, TOLERANCE)
    assert np.all(np.isfinite(found[depth > 0.1 * TOLERANCE]))
    assert np.all(np.isnan(found[depth < 0]))


def test_exact_grazing_ends() -> None:
    """A tangent is met or not, as round-off has it, and at its point; a segment in the plane is met at its start."""
    found = first_root(Sphere(np.zeros(2), 1.0), np.array([[-1.0, 1.0]]), np.array([[1.0, 1.0]]), TOLERANCE)
    assert np.isnan(found[0]) or found[0] == pytest.approx(0.5, abs=1e-7)
    found = first_root(Plane(np.zeros(2), np.array([0.0, 1.0])), np.zeros((1, 2)), np.array([[1.0, 0.0]]), TOLERANCE)
    assert found[0] == 0.0


def test_first_root_among_many_waves() -> None:
    """Between crests the first of several crossings is found: against 4,001 samples of each of 2,000 segments."""
    surface = sinusoid(np.zeros(2), 0.05, 0.2)
    start, end = _segments(2000, 2, seed=9)
    start[:, 1], end[:, 1] = 0.1 * np.abs(start[:, 1]), -0.1 * np.abs(end[:, 1])
    found = first_root(surface, start, end, TOLERANCE)
    s = np.linspace(0, 1, 4001)
    x = start[:, None] + s[None, :, None] * (end - start)[:, None]
    g = surface.potential(x.reshape(-1, 2)).reshape(len(start), -1)
    # the first sample that is deeper than a tenth of the tolerance bounds the root from above
    deep = g < -0.1 * TOLERANCE * np.sqrt(1 + (0.05 * 2 * np.pi / 0.2) ** 2)
    first = np.where(deep.any(axis=1), s[np.argmax(deep, axis=1)], np.inf)
    sampled = np.where((g <= 0).any(axis=1), s[np.argmax(g <= 0, axis=1)], np.inf)
    assert np.all(np.isfinite(found[np.isfinite(first)]))
    has = np.isfinite(found) & np.isfinite(first)
    assert has.sum() > 500
    assert np.all(found[has] <= first[has])
    assert np.all(np.abs(surface.potential(start + found[:, None] * (end - start)))[has & (found > 0)] < 1e-14)
    # and nearly always it is the very first crossing
    assert np.mean(np.abs(found - sampled)[has] <= s[1]) > 0.98


def test_first_root_of_points_at_rest() -> None:
    """A point that does not move is met at once where it is inside, and never where it is outside."""
    x = np.array([[0.0, 0.5], [0.0, -0.5], [0.0, 0.0]])
    found = first_root(Plane(np.zeros(2), np.array([0.0, 1.0])), x, x.copy(), TOLERANCE)
    np.testing.assert_array_equal(found, [np.nan, 0.0, 0.0])
    assert len(first_root(Plane(np.zeros(2), np.array([0.0, 1.0])), x[:0], x[:0], TOLERANCE)) == 0


# --- closest points ---------------------------------------------------------------------------------------------------


GRAPHS: dict[str, Graph] = {
    "paraboloid": paraboloid(np.array([0.1, -0.2]), 1.0),
    "sharp paraboloid": paraboloid(np.array([0.1, -0.2]), 0.05),
    "sinusoid": sinusoid(np.array([0.1, -0.2]), 0.01, 1.0),
    "dome": dome(np.array([0.1, -0.2]), 1.0, 0.9),
}


@pytest.mark.parametrize("name", GRAPHS)
def test_closest_points_of_graphs(name: str) -> None:
    """The distances of points far above and a little below are the least ones by SciPy's scalar minimisation."""
    surface = GRAPHS[name]
    rng = np.random.default_rng(2)
    x = rng.uniform(-1, 1, (60, 2))
    x[:, 1] = surface.height(x[:, :1] - surface.origin[:1]) + surface.origin[1] + rng.uniform(-0.01, 2.0, 60)
    y = closest_points(surface, x)
    np.testing.assert_allclose(surface.potential(y), 0, atol=1e-14)
    normal = surface.gradient(y)
    normal /= np.linalg.norm(normal, axis=1)[:, None]
    away = x - y
    along = np.einsum("pd,pd->p", away, normal)
    np.testing.assert_allclose(away, along[:, None] * normal, atol=1e-12)
    np.testing.assert_array_equal(np.sign(along), np.sign(surface.potential(x)))
    grid = np.linspace(-4, 4, 801)
    for at, distance in zip(x, np.linalg.norm(away, axis=1), strict=True):

        def apart(s: float | Floats, at: Floats = at) -> Floats:
            s = np.atleast_1d(s)
            height = surface.origin[1] + surface.height(s[:, None] - surface.origin[:1])
            return np.hypot(s - at[0], height - at[1])

        best = grid[np.argmin(apart(grid))]
        least = minimize_scalar(
            lambda s: float(apart(s)[0]), bounds=(best - 0.01, best + 0.01), method="bounded", options={"xatol": 1e-10}
        ).fun
        assert distance == pytest.approx(min(least, apart(best)[0]), rel=1e-9)


@pytest.mark.parametrize("radius", [0.05, 1.0, 20.0])
def test_closest_points_of_a_paraboloid(radius: float) -> None:
    """In space the closest point lies in the meridian plane, at the root of r³/2R² + r (1 + z/R) = ρ."""
    x = np.random.default_rng(4).uniform(-1, 1, (300, 3))
    x[:, 2] = np.abs(x[:, 2])
    y = closest_points(paraboloid(np.zeros(3), radius), x)
    rho = np.hypot(x[:, 0], x[:, 1])
    exact = np.array(
        [np.roots([1 / (2 * radius**2), 0, 1 + z / radius, -p]) for p, z in zip(rho, x[:, 2], strict=True)]
    )
    r = np.array([roots[np.argmin(np.abs(roots.imag))].real for roots in exact])
    np.testing.assert_allclose(np.hypot(y[:, 0], y[:, 1]), r, atol=1e-12)
    np.testing.assert_allclose(x[:, 0] * y[:, 1] - x[:, 1] * y[:, 0], 0, atol=1e-12)


def test_closest_points_of_round_surfaces() -> None:
    """Known for spheres and tubes, from any distance, and from the centre itself at the radius."""
    x = np.random.default_rng(0).uniform(-3, 3, (500, 3))
    for inside in (False, True):
        y = closest_points(Sphere(np.ones(3), 0.5, inside), x)
        np.testing.assert_allclose(y, 1 + 0.5 * (x - 1) / np.linalg.norm(x - 1, axis=1)[:, None], atol=1e-14)
        tube = Cylinder(np.zeros(3), np.array([0.0, 0.0, 2.0]), 0.5, inside)
        y = closest_points(tube, x)
        across = x[:, :2] / np.hypot(x[:, 0], x[:, 1])[:, None]
        np.testing.assert_allclose(y, np.column_stack([0.5 * across, x[:, 2]]), atol=1e-14)
    axis = np.array([1.0, 2.0, 3.0])
    on_axis = np.linspace(-1, 1, 11)[:, None] * axis
    y = closest_points(Cylinder(np.zeros(3), axis, 0.5, inside=True), on_axis)
    np.testing.assert_allclose(np.linalg.norm(y - on_axis, axis=1), 0.5, atol=1e-14)
    np.testing.assert_allclose((y - on_axis) @ axis, 0, atol=1e-14)


@pytest.mark.parametrize("R", [0.7, 1.0])
def test_a_foot_does_not_stay_on_the_opposite_wall(R: float) -> None:
    """Where a point goes through a tube's axis in a plane the old wall is stationary still, and another is nearer."""
    tube = Potential(lambda x: (R**2 - x[:, 1] ** 2 - x[:, 2] ** 2) / 2, lambda x: -x * [0.0, 1.0, 1.0], 2 * R)
    foot = np.array([[0.0, R, 0.0]])
    for y in np.linspace(0.65, -0.65, 14) * R:
        found = nearest(tube, np.array([[0.0, y, 0.0]]), foot)
        foot = found.point
        np.testing.assert_allclose(found.distance, R - abs(y), atol=1e-12)
        np.testing.assert_allclose(found.curvature[0, 2, 2], -1 / abs(y), rtol=1e-6)


def test_closest_point_of_an_edge() -> None:
    """Above a wedge the closest point is its tip where no face is nearer."""
    x = np.array([[0.0, 1.0], [0.05, 1.0], [2.0, 0.5]])
    y = closest_points(cone(np.zeros(2), 0.5), x)
    np.testing.assert_allclose(y[:2], 0, atol=1e-6)
    np.testing.assert_allclose(y[2], np.array([1.0, -0.5]) * (2.0 - 0.25) / 1.25, atol=1e-14)


# --- along a direction ------------------------------------------------------------------------------------------------


def test_root_along_a_direction() -> None:
    """The distance along d, negative inside: oblique planes, parabolas, the near side of spheres."""
    x = np.random.default_rng(6).uniform(-0.5, 0.5, (400, 2))
    d = np.array([0.6, 0.8])
    n = np.array([0.0, 1.0])
    np.testing.assert_allclose(root_along(Plane(np.zeros(2), n), x, 3 * d, 10.0), x[:, 1] / 0.8, atol=1e-14)
    parabola = paraboloid(np.zeros(2), 0.7)
    np.testing.assert_allclose(root_along(parabola, x, n, 10.0), x[:, 1] + x[:, 0] ** 2 / 1.4, atol=1e-14)
    half = np.sqrt(0.6**2 - x[:, 0] ** 2)
    above = x + 2 * n
    np.testing.assert_allclose(root_along(Sphere(np.zeros(2), 0.6), above, n, 10.0), above[:, 1] - half, atol=1e-14)
    np.testing.assert_allclose(
        root_along(Sphere(np.zeros(2), 0.6), x / 2, n, 10.0), x[:, 1] / 2 - np.sqrt(0.36 - x[:, 0] ** 2 / 4), atol=1e-14
    )


def test_root_beyond_reach() -> None:
    """Where the surface is not met, the reach with the sign of the side."""
    ball = Sphere(np.zeros(2), 0.5)
    up = np.array([0.0, 1.0])
    np.testing.assert_allclose(root_along(ball, np.array([[3.0, 1.0]]), up, 10.0), [10.0])
    plane = Plane(np.zeros(2), up)
    np.testing.assert_allclose(root_along(plane, np.array([[0.0, 30.0], [0.0, -30.0]]), up, 10.0), [10.0, -10.0])
