"""Convolution surfaces against closed forms, quadrature, differences and brute force."""

import numpy as np
import pytest
from numpy.typing import NDArray

from contact.surfaces import surface_kernels as kernels
from contact.surfaces.cauchy import CauchySurface
from contact.surfaces.convolution import ConvolutionSurface, bulge
from contact.surfaces.detection import closest_points, first_root, nearest
from contact.surfaces.surface_newton import outward

Floats = NDArray[np.float64]


def _line(a: Floats, b: Floats, r: Floats) -> Floats:
    """Segments between len(r) points from a to b."""
    s = np.linspace(0, 1, len(r))[:, None]
    x = (1 - s) * np.asarray(a) + s * np.asarray(b)
    return np.column_stack([x[:-1], x[1:], r[:-1], r[1:]])


def _arch() -> Floats:
    """A bent and twisted tube with a varying radius."""
    s = np.linspace(0, np.pi, 30)
    x = np.column_stack([10 * np.cos(s), 10 * np.sin(s), 2 * np.sin(s)])
    r = 2 + 0.4 * np.sin(3 * s)
    return np.column_stack([x[:-1], x[1:], r[:-1], r[1:]])


def _mixture() -> ConvolutionSurface:
    rng = np.random.default_rng(0)
    segments = np.column_stack([rng.uniform(0, 3, (5, 6)), rng.uniform(0.5, 1, (5, 2))])
    return ConvolutionSurface(
        segments,
        np.array([0, 0, 1, 1, 2]),
        np.array([[0.0, 0, 0, 2, 0, 0, 0, 2, 1, 0.5]]),
        np.array([[1.0, 1, 1, 0.8]]),
        np.array([[1.0, 1, 1.5, 1.0, 0.4]]),
    )


def _near(surface: ConvolutionSurface, count: int, low: float, high: float, seed: int = 0) -> Floats:
    x = np.random.default_rng(seed).uniform(low, high, (count, 3))
    return x[kernels.potentials(surface.net, x)[:, 0] > 0.55]


@pytest.mark.parametrize("pieces", [1, 7, 40])
def test_a_straight_tube_has_its_radius(pieces: int) -> None:
    """To 1e-12 one support from its ends, however it is divided; its potential is (r² − ρ²)/2r throughout."""
    r, axis = 0.7, np.array([1.0, 2.0, -2.0]) / 3
    surface = ConvolutionSurface(_line(0 * axis, 9 * axis, np.full(pieces + 1, r)))
    across = np.cross(axis, [0.0, 0, 1])
    across /= np.linalg.norm(across)
    s = np.linspace(1.5 * r, 9 - 1.5 * r, 50)[:, None]
    for rho in (0.0, 0.4, r, 0.8):
        g = surface.potential(s * axis + rho * across)
        np.testing.assert_allclose(g, (r**2 - rho**2) / (2 * r), atol=1e-12)
    outside = nearest(surface, s * axis + 0.8 * across, s * axis + 0.75 * across)
    np.testing.assert_allclose(outside.distance, r - 0.8, atol=1e-12)


def test_a_foot_does_not_stay_on_the_opposite_wall() -> None:
    """Where a point goes through the axis in a plane: from the foot of before it is the nearer wall, or none."""
    surface = ConvolutionSurface(_line([0.0, 0, 0], [9.0, 0, 0], np.full(8, 0.7)))
    foot, lost = np.array([[4.0, 0.7, 0.0]]), 0
    for y in np.linspace(0.65, -0.65, 14):
        x = np.array([[4.0, y, 0.0]])
        lost += int(np.isnan(surface.nearest(x, foot).distance[0]))
        found = nearest(surface, x, foot)
        foot = found.point
        np.testing.assert_allclose(found.distance, 0.7 - abs(y), atol=1e-12)
    assert lost == 1


def test_quadrature_of_tapered_segments() -> None:
    """Pieces of four points integrate a radius that halves over its length to 1e-7: against 300 points."""
    a, t, r0, taper, k = np.zeros(3), np.array([1.0, 0, 0]), 1.0, -0.25, 1.5
    surface = ConvolutionSurface(_line(a, 2 * t, np.array([1.0, 0.5])))
    x = np.random.default_rng(0).uniform([-0.5, 0, 0], [2.5, 1, 0], (300, 3))
    s, w = np.polynomial.legendre.leggauss(300)
    s = s + 1
    r = r0 + taper * s
    d2 = (x[:, :1] - s) ** 2 + x[:, 1:2] ** 2
    weight = 35 / (32 * k * (1 - k**-2) ** 3.5)
    f = weight * (np.maximum(1 - d2 / (k * r) ** 2, 0) ** 3 / r) @ w
    F = kernels.potentials(surface.net, x)[:, 0]
    assert np.max(np.abs(F - f ** (2 / 7))[f > 0.088]) < 1e-7


def test_a_plate_is_as_thick_as_asked() -> None:
    """Away from its rim a plate of two triangles has half the thickness r, and its integral is that of a quadrature."""
    r, corners = 0.3, np.array([[0.0, 0, 0], [4, 0, 0], [4, 4, 0], [0, 4, 0]])
    rows = np.array([[*corners[[0, 1, 2]].ravel(), r], [*corners[[0, 2, 3]].ravel(), r]])
    surface = ConvolutionSurface(triangles=rows)
    x = np.random.default_rng(1).uniform(1, 3, (100, 3))
    x[:, 2] = r
    np.testing.assert_allclose(surface.potential(x), 0, atol=1e-12)
    one = ConvolutionSurface(triangles=rows[:1], reach=3.0)
    s = (np.arange(400) + 0.5) / 100
    u, v = np.meshgrid(s, s, indexing="ij")
    y = np.stack([u[v < u], v[v < u], 0 * u[v < u]], axis=1)
    at = np.array([[3.7, 3.4, 0.2], [4.2, 2.0, 0.1], [2.0, 0.1, 0.4], [3.0, 1.5, 0.0]])
    f = np.array([(np.maximum(1 - ((p - y) ** 2).sum(1) / 0.81, 0) ** 3).sum() / 1e4 for p in at])
    f *= 4 / (np.pi * 9 * (1 - 1 / 9) ** 4) / r**2
    np.testing.assert_allclose(kernels.potentials(one.net, at)[:, 0], f ** (2 / 7), rtol=5e-3)


def test_balls_are_balls() -> None:
    """A ball alone is exact, at any distance within reach."""
    surface = ConvolutionSurface(balls=np.array([[1.0, 2, 3, 0.5]]), inside=False)
    n = np.random.default_rng(0).normal(size=(50, 3))
    n /= np.linalg.norm(n, axis=1)[:, None]
    for rho in (0.3, 0.5, 0.6):
        foot = nearest(surface, [1.0, 2, 3] + rho * n, [1.0, 2, 3] + 0.55 * n)
        np.testing.assert_allclose(foot.distance, rho - 0.5, atol=1e-13)
        np.testing.assert_allclose(foot.curvature, (np.eye(3) - n[:, :, None] * n[:, None, :]) / rho, atol=1e-9)


def test_derivatives() -> None:
    """Gradients and Hessians of a mixture of everything against central differences."""
    surface = _mixture()
    x = _near(surface, 1000, -0.5, 3)
    assert len(x) > 300
    eps = 1e-5
    gradient = np.stack([(surface.potential(x + eps * e) - surface.potential(x - eps * e)) for e in np.eye(3)], 1)
    np.testing.assert_allclose(surface.gradient(x), gradient / (2 * eps), atol=1e-6)
    hessian = np.stack([(surface.gradient(x + eps * e) - surface.gradient(x - eps * e)) for e in np.eye(3)], 1)
    np.testing.assert_allclose(surface.hessian(x), hessian / (2 * eps), atol=1e-5)


def test_bounds_of_derivatives() -> None:
    """The cells' bounds of |∇F| and of −∂²F hold at every point where they are used."""
    surface = _mixture()
    x = _near(surface, 20000, -0.5, 3)
    n, v = surface.net, kernels.potentials(surface.net, x)
    cell = kernels.cells_at(n, x)
    assert np.all(np.linalg.norm(v[:, 1:4], axis=1) <= n.bounds[cell, 0])
    least = np.linalg.eigvalsh(v[:, [4, 5, 6, 5, 7, 8, 6, 8, 9]].reshape(-1, 3, 3))[:, 0]
    assert np.all(-least[v[:, 0] >= 1] <= (n.bounds[cell, 1] * (1 + 1e-12))[v[:, 0] >= 1])
    bound = surface.lower_bound(x)
    within = x[bound > 0]
    for ray in np.random.default_rng(1).normal(size=(20, 3)):
        ray *= 3 / np.linalg.norm(ray)
        root = first_root(surface, within, within + ray, 1e-3)
        assert not np.any(3 * root < bound[bound > 0])


def test_nearest_in_an_arch() -> None:
    """Feet to round-off from rough guesses; normals and curvatures are the derivatives of the distance."""
    surface = ConvolutionSurface(_arch())
    rng = np.random.default_rng(0)
    middle, _ = surface.radius_error()
    i = rng.integers(5, 24, 300)
    d = rng.normal(size=(300, 3))
    x = middle[i] + 1.4 * d / np.linalg.norm(d, axis=1)[:, None]
    x = x[kernels.potentials(surface.net, x)[:, 0] < 1.6]
    foot = nearest(surface, x)
    again = nearest(surface, x, foot.point + 0.1 * rng.normal(size=x.shape))
    np.testing.assert_allclose(again.distance, foot.distance, atol=1e-12)
    np.testing.assert_allclose(surface.potential(foot.point), 0, atol=1e-13)
    np.testing.assert_allclose(foot.point + foot.distance[:, None] * foot.normal, x, atol=1e-12)
    eps = 1e-4
    step = [(nearest(surface, x + eps * e, foot.point), nearest(surface, x - eps * e, foot.point)) for e in np.eye(3)]
    slopes = np.stack([(a.distance - b.distance) / (2 * eps) for a, b in step], axis=1)
    turns = np.stack([(a.normal - b.normal) / (2 * eps) for a, b in step], axis=1)
    np.testing.assert_allclose(slopes, foot.normal, atol=1e-6)
    np.testing.assert_allclose(turns, foot.curvature, atol=1e-5)
    generic = closest_points(surface, x[:40])
    np.testing.assert_allclose(np.linalg.norm(x[:40] - generic, axis=1), np.abs(foot.distance[:40]), atol=1e-9)


def test_far_away_is_harmless() -> None:
    """Where nothing reaches, the point is outside, bounds are finite, and feet are found from the axes."""
    surface = ConvolutionSurface(_arch())
    x = np.array([[0.0, 0, 0], [1e3, 0, 0], [-1e12, 5, 1e12], [10, 0, 30]])
    assert np.all(surface.potential(x) < 0)
    assert np.all(surface.lower_bound(x) <= 0)
    assert np.all(np.isfinite(surface.lower_bound(x)))
    foot = nearest(surface, x[[0, 1, 3]])
    assert np.all(foot.distance < 0)
    assert np.all(first_root(surface, x, x + 1.0, 1e-3) == 0)


def _first_by_brute_force(
    surface: ConvolutionSurface, a: Floats, b: Floats, count: int, depth: float
) -> tuple[Floats, Floats]:
    """The first of `count` samples that is deeper than `depth` (NaN without), and the least potential."""
    s = np.linspace(0, 1, count)
    g = np.stack([surface.potential(a + t * (b - a)) for t in s], axis=1)
    return np.where((g < -depth).any(1), s[np.argmax(g < -depth, axis=1)], np.nan), g.min(axis=1)


@pytest.mark.parametrize("inside", [True, False])
def test_first_roots_of_random_segments(inside: bool) -> None:
    """50,000 segments each, against 33 samples of each: no excursion deeper than a tenth of the tolerance is missed."""
    surface = ConvolutionSurface(_arch()[:12], inside=inside)
    rng = np.random.default_rng(3)
    middle, _ = surface.radius_error(2)
    a, b = (middle[rng.integers(0, 12, 50000)] + rng.uniform(-2.5, 2.5, (50000, 3)) for _ in range(2))
    b = a + (b - a) * rng.uniform(0.05, 1, (50000, 1))
    tolerance = 1e-2
    root = first_root(surface, a, b, tolerance)
    sampled, least = _first_by_brute_force(surface, a, b, 33, 0.1 * tolerance)
    met = np.isfinite(root)
    assert np.all(met[least < -0.1 * tolerance])
    assert (least < -0.1 * tolerance).sum() > 10000
    both = met & np.isfinite(sampled)
    assert np.all(root[both] <= sampled[both] + 1e-12)
    at = a + np.where(met, root, 0)[:, None] * (b - a)
    np.testing.assert_allclose(surface.potential(at)[met & (root > 0)], 0, atol=1e-13)


def test_grazing_segments() -> None:
    """Chords of a straight tube's obstacle, and lumen walls, shifted by a depth: met where it is a tenth or more."""
    r, rng = 0.7, np.random.default_rng(5)
    for inside in (False, True):
        surface = ConvolutionSurface(_line([0, 0, 0], [0, 0, 9], np.full(10, r)), inside=inside)
        depth = 1e-3 * rng.choice([-1, -1e-3, 0.101, 1.0], 2000)
        angle, z = rng.uniform(0, 2 * np.pi, 2000), rng.uniform(2, 7, 2000)
        n = np.stack([np.cos(angle), np.sin(angle), 0 * z], axis=1)
        t = np.stack([-np.sin(angle), np.cos(angle), 0 * z], axis=1)
        up = z[:, None] * np.array([0.0, 0, 1])
        if inside:
            a, b = 0.2 * n + up, (r + depth)[:, None] * n + up
        else:
            a, b = (r - depth)[:, None] * n - 0.4 * t + up, (r - depth)[:, None] * n + 0.5 * t + up
        root = first_root(surface, a, b, 1e-3)
        assert np.all(np.isfinite(root[depth > 0]))
        assert np.all(np.isnan(root[depth < 0]))


def test_union_bulges_no_more_than_stated() -> None:
    """Two tubes that cross, and two that coincide: no wall beyond r (1 + bulge), which is 2.7 %."""
    assert bulge(2, 1.5, 16.0) == pytest.approx(0.0263, abs=1e-3)
    line = _line([-4.0, 0, 0], [4.0, 0, 0], np.ones(9))
    twice = ConvolutionSurface(np.concatenate([line, line]), np.repeat([0, 1], 8))
    foot = nearest(twice, np.array([[0.0, 0.9, 0]]))
    assert foot.point[0, 1] == pytest.approx(1 + bulge(2, 1.5, 16.0), abs=1e-12)
    cross = ConvolutionSurface(np.concatenate([line, line[:, [1, 0, 2, 4, 3, 5, 6, 7]]]), np.repeat([0, 1], 8))
    x = np.random.default_rng(0).uniform(-2, 2, (20000, 3))
    beyond = np.minimum(np.hypot(x[:, 1], x[:, 2]), np.hypot(x[:, 0], x[:, 2])) - 1
    assert np.all(cross.potential(x)[beyond > bulge(2, 1.5, 16.0)] < 0)
    assert np.all(cross.potential(x)[beyond < 0] > 0)


def test_radius_error() -> None:
    """Round-off in a straight tube, and about 1 % in the arch, whose radius varies by 0.12 per length."""
    straight = ConvolutionSurface(_line([0.0, 0, 0], [0, 0, 20.0], np.ones(21)))
    assert np.abs(straight.radius_error()[1][2:-2]).max() < 1e-12
    assert 1e-3 < np.abs(ConvolutionSurface(_arch()).radius_error()[1][4:-4]).max() < 0.015


def test_cost_does_not_grow_with_the_network() -> None:
    """As many primitives to evaluate, to 20 %, for 10,000 segments as for 10: a query looks at one cell."""
    found = []
    for count in (1, 1000):
        rows = np.concatenate([_line([0.0, 6.0 * i, 0], [10.0, 6.0 * i, 0], np.ones(11)) for i in range(count)])
        n = ConvolutionSurface(rows, np.repeat(np.arange(count), 10)).net
        x = np.column_stack([np.linspace(2, 8, 300), 6.0 * (count // 2) + 0.8 + 0 * np.arange(300), np.zeros(300)])
        ends = n.cells[kernels.cells_at(n, x)]
        assert np.all(ends[:, 2] - ends[:, 0] == 1)
        group = n.groups[ends[:, 0]]
        found.append((group[:, 2] - group[:, 1]).mean())
    assert found[0] > 0
    assert found[1] <= 1.2 * found[0]


def _reference(segments: Floats, chains: NDArray[np.int64], balls: Floats, dents: Floats, x: Floats) -> Floats:
    """F by the definitions in plain numpy, with 400 points on each segment."""
    k, p, total = 1.5, 16.0, np.zeros(len(x))
    s, w = np.polynomial.legendre.leggauss(400)
    s, w = (s + 1) / 2, w / 2
    for chain in np.unique(chains):
        f = np.zeros(len(x))
        for *ends, r_a, r_b in segments[chains == chain]:
            a, b = np.array(ends[:3]), np.array(ends[3:])
            r = r_a + s * (r_b - r_a)
            away2 = ((x[:, None] - a - s[:, None] * (b - a)) ** 2).sum(axis=2)
            f += np.maximum(1 - away2 / (k * r) ** 2, 0) ** 3 @ (w / r) * np.linalg.norm(b - a)
        total += (35 / (32 * k * (1 - k**-2) ** 3.5) * f) ** (2 * p / 7)
    for ball in balls:
        e = np.maximum(1 - ((x - ball[:3]) ** 2).sum(axis=1) / (k * ball[3]) ** 2, 0)
        total += (e / (1 - k**-2)) ** p
    F: Floats = total ** (1 / p)
    for dent in dents:
        F = F - dent[4] * np.maximum(1 - ((x - dent[:3]) ** 2).sum(axis=1) / dent[3] ** 2, 0) ** 3
    return F


def test_kernels_are_the_definitions() -> None:
    """Chains, balls and dents joined as stated, to the quadrature's 1e-7; all three kernels give the same F."""
    rng = np.random.default_rng(2)
    segments = np.column_stack([rng.uniform(0, 3, (6, 6)), rng.uniform(0.6, 1, (6, 2))])
    chains, balls = np.array([0, 0, 0, 1, 1, 2]), np.array([[1.0, 1, 1, 0.8]])
    dents = np.array([[1.0, 1, 1.5, 1.0, 0.4]])
    surface = ConvolutionSurface(segments, chains, balls=balls, dents=dents)
    x = _near(surface, 800, -0.5, 3.5, seed=4)
    F = kernels.values(surface.net, x)
    np.testing.assert_allclose(F, _reference(segments, chains, balls, dents, x), rtol=3e-7)
    np.testing.assert_allclose(kernels.potentials(surface.net, x)[:, 0], F, rtol=1e-14)


@pytest.mark.parametrize("warm", [False, True])
def test_nearest_always_finds_a_wall(warm: bool) -> None:
    """From within half a radius of the wall, on axes, at a junction and beyond reach: a foot on the wall, finite."""
    side = _line([0.0, 0, 0], [6.0, 4.0, 0], np.linspace(0.8, 0.6, 9))
    surface = ConvolutionSurface(
        np.concatenate([_line([-8.0, 0, 0], [8.0, 0, 0], np.linspace(1.2, 0.9, 17)), side]), np.repeat([0, 1], [16, 8])
    )
    rng = np.random.default_rng(0)
    u = rng.uniform(0, 1, (6000, 1))
    i = rng.integers(0, 24, 6000)
    axis = (1 - u) * surface.segments[i, :3] + u * surface.segments[i, 3:6]
    d = rng.normal(size=(6000, 3))
    off = rng.choice([0, 1e-9, 0.5, 0.8, 1.3], (6000, 1))
    x = axis + off * d / np.linalg.norm(d, axis=1)[:, None]
    x = np.concatenate([x, rng.uniform(-20, 20, (50, 3))])
    foot = nearest(surface, x)
    if warm:
        foot = nearest(surface, x, foot.point + 0.01 * rng.normal(size=x.shape))
    assert all(np.isfinite(part).all() for part in foot)
    np.testing.assert_allclose(surface.potential(foot.point), 0, atol=1e-12)
    np.testing.assert_allclose(np.linalg.norm(x - foot.point, axis=1), np.abs(foot.distance), rtol=1e-6, atol=1e-9)
    # Off the axes the foot is the nearest one: in 50 directions F stays above 1 up to its distance.
    within = (foot.distance > 0) & np.append(off[:, 0] >= 0.5, np.zeros(50, dtype=bool))
    for ray in rng.normal(size=(50, 3)):
        ray *= 2 / np.linalg.norm(ray)
        root = 2 * first_root(surface, x[within], x[within] + ray, 1e-4)
        assert not np.any(root < 0.999 * foot.distance[within])


def test_starts_for_feet_are_on_the_wall_in_sight() -> None:
    """Across the axis of the tube or from the centre of the ball that a point is deepest in; itself where none says."""
    surface = ConvolutionSurface(
        np.array([[0, 0, 0, 4, 0, 0, 0.5, 0.5], [4, 0, 0, 8, 0, 0, 0.5, 0.5]]), balls=np.array([[4, 2.0, 0, 1.0]])
    )
    x = np.array([[2.0, 0.1, 0.0], [5.5, 0, -0.7], [4, 1.6, 0.3], [4, 0.4, 0], [2, 0, 0], [50.0, 0, 0]])
    expected = x.copy()
    expected[0, 1], expected[1, 2], expected[2, 1:], expected[3, 1] = 0.5, -0.5, [1.2, 0.6], 0.5
    np.testing.assert_allclose(outward(surface.net, x), expected, atol=1e-15)


def test_starts_do_not_lie_beyond_the_end_of_a_chain() -> None:
    """Before the end of a wide tube, in the narrow one that leads into it, the narrow wall is the one in sight."""
    both = np.array([[0, 0, 0, 4, 0, 0, 0.2, 0.2], [4, 0, 0, 9, 0, 0, 2.0, 2.0]])
    surface = ConvolutionSurface(both, np.array([0, 1]))
    start = outward(surface.net, np.array([[3.5, 0.05, 0]]))
    np.testing.assert_allclose(start, [[3.5, 0.2, 0]], atol=1e-15)


def test_cauchy_line() -> None:
    """The catalogue's radius, gradients and Hessians."""
    line = CauchySurface(np.array([[[-500.0, 0, 0], [500, 0, 0]]]), 2.0, 0.5)
    assert line.radius == pytest.approx(0.2963460, abs=1e-7)
    foot = nearest(line, np.array([[0.1, 0.4, 0.0]]))
    assert foot.distance[0] == pytest.approx(0.4 - line.radius, abs=1e-9)
    surface = CauchySurface(np.array([[[-1.0, 0, 0], [1, 0, 0]], [[0, 0, 0], [1, 2, 0.5]]]), 2.0, 0.5)
    x, eps = np.random.default_rng(0).uniform(-1, 2, (200, 3)), 1e-5
    slopes = np.stack([(surface.potential(x + eps * e) - surface.potential(x - eps * e)) for e in np.eye(3)], 1)
    np.testing.assert_allclose(surface.gradient(x), slopes / (2 * eps), atol=1e-7)
    bends = np.stack([(surface.gradient(x + eps * e) - surface.gradient(x - eps * e)) for e in np.eye(3)], 1)
    np.testing.assert_allclose(surface.hessian(x), bends / (2 * eps), atol=1e-7)
    a, b = x[:100], x[100:]
    bound = surface.lipschitz(a, b) * np.linalg.norm(b - a, axis=1)
    assert np.all(np.abs(surface.potential(a) - surface.potential(b)) <= bound)
