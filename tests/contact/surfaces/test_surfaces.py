"""Implicit surfaces: gradients, bounds of the gradient, distances, and the points where a gradient has no direction."""

from collections.abc import Callable

import numpy as np
import pytest
from numpy.typing import NDArray

from contact.surfaces.detection import nearest
from contact.surfaces.implicit import (
    Cylinder,
    Plane,
    Potential,
    Sphere,
    Surface,
    Torus,
    cone,
    dome,
    paraboloid,
    sinusoid,
)

Floats = NDArray[np.float64]


def _wavy(x: Floats) -> Floats:
    value: Floats = np.sin(x).sum(axis=1) + 2 * x[:, -1]
    return value


def _slope(x: Floats) -> Floats:
    slope: Floats = np.cos(x)
    slope[:, -1] += 2
    return slope


SURFACES: dict[str, Callable[[int], Surface]] = {
    "plane": lambda D: Plane(np.full(D, 0.1), np.arange(1.0, D + 1)),
    "sphere": lambda D: Sphere(np.full(D, 0.2), 0.7),
    "sphere inside": lambda D: Sphere(np.full(D, 0.2), 3.0, inside=True),
    "cylinder": lambda D: Cylinder(np.full(D, 0.1), np.arange(1.0, D + 1), 0.5),
    "cylinder inside": lambda D: Cylinder(np.full(D, 0.1), np.arange(1.0, D + 1), 3.0, inside=True),
    "paraboloid": lambda D: paraboloid(np.full(D, 0.1), 0.4),
    "paraboloid above": lambda D: paraboloid(np.full(D, 0.1), 0.4, downward=True),
    "cone": lambda D: cone(np.full(D, 0.1), 0.8),
    "sinusoid": lambda D: sinusoid(np.full(D, 0.1), 0.2, 0.9),
    "dome": lambda D: dome(np.full(D, 0.1), 1.0, 0.9),
    "potential": lambda D: Potential(_wavy, _slope, np.sqrt(D + 8.0)),
}
surfaces = pytest.mark.parametrize("name", SURFACES)
dimensions = pytest.mark.parametrize("D", [2, 3])


@surfaces
@dimensions
def test_gradient_is_the_derivative(name: str, D: int) -> None:
    """∇g equals central differences of g."""
    surface = SURFACES[name](D)
    x = np.random.default_rng(0).uniform(-2, 2, (500, D))
    eps = 1e-6
    differences = [(surface.potential(x + eps * e) - surface.potential(x - eps * e)) / (2 * eps) for e in np.eye(D)]
    np.testing.assert_allclose(surface.gradient(x), np.stack(differences, axis=1), atol=1e-7)


@surfaces
@dimensions
def test_bound_of_the_gradient(name: str, D: int) -> None:
    """|∇g| never exceeds the bound anywhere on a segment, and |g(b) − g(a)| never the bound times |b − a|."""
    surface = SURFACES[name](D)
    rng = np.random.default_rng(1)
    a, b = rng.uniform(-2, 2, (2, 2000, D))
    bound = surface.lipschitz(a, b) * (1 + 1e-12)
    assert np.all(np.abs(surface.potential(b) - surface.potential(a)) <= bound * np.linalg.norm(b - a, axis=1))
    for s in np.linspace(0, 1, 21):
        assert np.all(np.linalg.norm(surface.gradient(a + s * (b - a)), axis=1) <= bound)


@dimensions
def test_signed_distances(D: int) -> None:
    """The potentials of planes, spheres and cylinders are distances, positive where bodies may be."""
    e, f = np.eye(D)[0], np.eye(D)[-1]
    n = (e + f) / np.sqrt(2)
    at = lambda surface, x: surface.potential(np.array([x]))[0]  # noqa: E731
    assert at(Plane(e, 7 * n), e + 2.5 * n - 3 * (e - f)) == pytest.approx(2.5)
    assert at(Sphere(e, 2.0), e + 5 * n) == pytest.approx(3.0)
    assert at(Sphere(e, 2.0, inside=True), e + 5 * n) == pytest.approx(-3.0)
    assert at(Cylinder(e, 3 * n, 2.0), e + 9 * n + 3 * (e - f) / np.sqrt(2)) == pytest.approx(1.0)
    assert at(Cylinder(e, -n, 2.0, inside=True), e + 9 * n) == pytest.approx(2.0)


def test_heights() -> None:
    """The graphs' own formulas at chosen places, upright and upside down."""
    at = lambda surface, *x: surface.potential(np.array([x]))[0]  # noqa: E731
    o = np.array([1.0, 2.0, 3.0])
    assert at(paraboloid(o, 2.0), 4.0, 6.0, 3.0) == pytest.approx(25 / 4)
    assert at(paraboloid(o, 2.0, downward=True), 4.0, 6.0, 3.0) == pytest.approx(25 / 4)
    assert at(cone(o, 0.5), 4.0, 6.0, 3.0) == pytest.approx(2.5)
    assert at(sinusoid(o, 0.1, 2.0), 2.0, 9.0, 3.0) == pytest.approx(0.2)
    assert at(dome(o, 1.0, 0.9), 1.6, 2.0, 4.0) == pytest.approx(1 - 0.8)
    # beyond the rim: the tangent cone, of slope tan(asin .9)
    assert at(dome(o, 1.0, 0.9), 1.0, 2.9 + 0.5, 3.0) == pytest.approx(-np.sqrt(0.19) + 0.5 * 0.9 / np.sqrt(0.19))


@dimensions
def test_centres_have_a_direction(D: int) -> None:
    """At a centre, or on the axis of a tube, the gradient is a unit vector towards one of the closest points."""
    x = np.full((1, D), 0.2)
    gradient = Sphere(x[0], 0.7, inside=True).gradient(x)
    assert np.linalg.norm(gradient) == pytest.approx(1.0)
    axis = np.sqrt(np.arange(2.0, D + 2))
    x = x + np.linspace(-5, 5, 50)[:, None] * axis
    gradient = Cylinder(x[0], axis, 0.7, inside=True).gradient(x)
    np.testing.assert_allclose(np.linalg.norm(gradient, axis=1), 1.0)
    np.testing.assert_allclose(gradient @ axis, 0.0, atol=1e-14)


@surfaces
def test_gradients_may_be_changed(name: str) -> None:
    """A caller that normalises a gradient in place changes neither the surface nor another call."""
    surface = SURFACES[name](2)
    x = np.array([[0.3, 0.4], [0.5, -0.6]])
    first = surface.gradient(x)
    expected = first.copy()
    first /= 10.0
    np.testing.assert_array_equal(surface.gradient(x), expected)


@surfaces
@dimensions
def test_hessian_is_the_derivative(name: str, D: int) -> None:
    """∇²g equals central differences of ∇g, where the surface has one."""
    surface = SURFACES[name](D)
    x = np.random.default_rng(2).uniform(0.3, 0.7, (200, D))
    eps = 1e-6
    differences = [(surface.gradient(x + eps * e) - surface.gradient(x - eps * e)) / (2 * eps) for e in np.eye(D)]
    np.testing.assert_allclose(surface.hessian(x), np.stack(differences, axis=1), atol=2e-6)


@pytest.mark.parametrize("inside", [False, True])
def test_torus(inside: bool) -> None:
    """Distances and feet known in its meridian plane; gradient and Hessian by differences."""
    axis = np.array([1.0, 2.0, 2.0]) / 3
    surface = Torus(np.full(3, 0.1), axis, 2.0, 0.5, inside)
    out = np.array([2.0, 1.0, -2.0]) / 3
    x = 0.1 + 2.3 * out + 0.4 * axis
    assert surface.potential(x[None])[0] == pytest.approx(0.0, abs=1e-15)
    sign = -1 if inside else 1
    assert surface.potential((0.1 + 2.6 * out + 0.8 * axis)[None])[0] == pytest.approx(sign * 0.5)
    np.testing.assert_allclose(surface.nearest((0.1 + 2.6 * out + 0.8 * axis)[None]).point[0], x, atol=1e-15)
    y = np.random.default_rng(0).uniform(-3, 3, (300, 3))
    eps = 1e-6
    slopes = [(surface.potential(y + eps * e) - surface.potential(y - eps * e)) / (2 * eps) for e in np.eye(3)]
    bends = [(surface.gradient(y + eps * e) - surface.gradient(y - eps * e)) / (2 * eps) for e in np.eye(3)]
    np.testing.assert_allclose(surface.gradient(y), np.stack(slopes, axis=1), atol=1e-8)
    np.testing.assert_allclose(surface.hessian(y), np.stack(bends, axis=1), atol=1e-7)


def test_nearest_of_a_potential() -> None:
    """The generic Newton method, warm and cold, finds a sphere given as |x|² − 1, its normals and its curvature."""
    ball = Potential(lambda x: (x**2).sum(axis=1) - 1, lambda x: 2 * x, 10.0)
    n = np.random.default_rng(0).normal(size=(100, 3))
    n /= np.linalg.norm(n, axis=1)[:, None]
    for guess in (None, n + 0.05):
        foot = nearest(ball, 1.3 * n, guess)
        np.testing.assert_allclose(foot.distance, 0.3, atol=1e-13)
        np.testing.assert_allclose(foot.point, n, atol=1e-13)
        np.testing.assert_allclose(foot.curvature, (np.eye(3) - n[:, :, None] * n[:, None, :]) / 1.3, atol=1e-6)
