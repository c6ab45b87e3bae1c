"""Paraboloid, cone and flat punch: the fields of `AxisymmetricContact` and their boundary conditions."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.integrate import quad

from validation.exact.hertz_point import HertzPoint
from validation.exact.punches import Cone, FlatPunch

from .checks import divergence, gradient, hooke

HERTZ = HertzPoint(E=1, nu=0.3, a=0.3, R=1)
CONE = Cone(E=2, nu=0.2, alpha=0.2, delta=0.1)
FLAT = FlatPunch(E=3, nu=0.45, a=0.4, delta=0.02)
BODIES = [HERTZ, CONE, FLAT]

R_, Z_ = np.meshgrid(np.linspace(0.05, 1.5, 16), np.linspace(0.12, 1.4, 12))
SECTION = np.column_stack([R_.ravel(), Z_.ravel()])
TURN = np.linspace(0, 6, len(SECTION))
SPACE = np.column_stack([SECTION[:, 0] * np.cos(TURN), SECTION[:, 0] * np.sin(TURN), SECTION[:, 1]])


def profile(body, r):
    if body is HERTZ:
        return body.delta - r**2 / (2 * body.R)
    return body.delta - (r * np.tan(body.alpha) if body is CONE else 0 * r)


def by_quadrature(body, r, z):
    """u_r and u_z of the catalogue's integrals in t, by Gauss quadrature on either side of the kink."""
    F = {
        HERTZ: lambda t: np.pi * body.p0 / (2 * body.a) * (body.a**2 - t**2),
        CONE: lambda t: body.E_star * (body.delta - 0.5 * np.pi * t * np.tan(body.alpha)),
        FLAT: lambda t: body.E_star * body.delta + 0 * t,
    }[body]
    s, w = np.polynomial.legendre.leggauss(200)
    t, w = 0.5 * body.a * (1 + s), 0.5 * body.a * w
    zeta = z[:, None] + 1j * t
    D = np.sqrt(r[:, None] ** 2 + zeta**2)
    psi, psi_z = 2 * (1 / D).real @ (w * F(t)), -2 * (zeta / D**3).real @ (w * F(t))
    psi_r, chi_r = -2 * r * ((1 / D**3).real @ (w * F(t))), 2 * r * ((1 / (D * (zeta + D))).real @ (w * F(t)))
    ur = -((1 - 2 * body.nu) * chi_r + z * psi_r)
    return np.column_stack([ur, 2 * (1 - body.nu) * psi - z * psi_z]) / (4 * np.pi * body.G)


@pytest.mark.parametrize("body", BODIES, ids=repr)
def test_displacement_is_the_integral_over_t(body):
    """At points at least 0.3a away from the contact, where the quadrature in t converges."""
    points = np.concatenate([SECTION, [[0.0, 0.3], [2.0, 0.0], [1.3 * body.a, 0.0], [3.0, 4.0]]])
    expected = by_quadrature(body, *points.T)
    assert_allclose(body.displacement(points), expected, atol=1e-13 * np.abs(expected).max())


@pytest.mark.parametrize("body", BODIES, ids=repr)
def test_section_and_space_agree(body):
    u, v = body.displacement(SECTION), body.displacement(SPACE)
    assert_allclose(v[:, 0] * np.cos(TURN) + v[:, 1] * np.sin(TURN), u[:, 0], atol=1e-15)
    assert_allclose(v[:, 2], u[:, 1], atol=1e-15)
    assert_allclose(
        body.displacement_gradient(SECTION), gradient(body.displacement, SECTION), atol=1e-9 * np.abs(u).max() / body.a
    )


@pytest.mark.parametrize("body", BODIES, ids=repr)
def test_fields_satisfy_elasticity_in_the_body(body):
    """∇u is u's in space; Hooke's law and both equations of equilibrium in the section."""
    grad = body.displacement_gradient(SPACE)
    assert_allclose(grad, gradient(body.displacement, SPACE), atol=1e-8 * np.abs(grad).max())
    in_plane = body.displacement_gradient(SECTION)
    hoop = body.displacement(SECTION)[:, 0] / SECTION[:, 0]
    sigma = hooke(in_plane, body.E, body.nu, hoop)
    rr, zz, tt, rz = body.stress(SECTION).T
    scale = np.abs(sigma).max()
    assert_allclose([rr, zz, rz], [sigma[:, 0, 0], sigma[:, 1, 1], sigma[:, 0, 1]], atol=1e-13 * scale)
    strain = np.array([in_plane[:, 0, 0], in_plane[:, 1, 1], hoop])
    assert_allclose(body.E * hoop, tt - body.nu * (rr + zz), atol=1e-13 * scale)
    assert_allclose(rr + zz + tt, body.E / (1 - 2 * body.nu) * strain.sum(axis=0), atol=1e-12 * scale)

    def tensor(points):
        return body.stress(points)[:, [0, 3, 3, 1]].reshape(-1, 2, 2)

    div = divergence(tensor, SECTION) + np.column_stack([rr - tt, rz]) / SECTION[:, :1]
    assert np.abs(div).max() < 1e-8 * scale / body.a


@pytest.mark.parametrize("body", BODIES, ids=repr)
def test_surface_follows_the_punch_and_carries_its_pressure(body):
    r = np.linspace(0.01, 3, 200) * body.a
    surface = np.column_stack([r, np.zeros_like(r)])
    inside = r < body.a
    _, zz, _, rz = body.stress(surface).T
    assert_allclose(-zz, body.pressure(r), atol=1e-14 * body.pressure(r).max())
    assert np.all(body.pressure(r)[~inside] == 0)
    assert np.all(rz == 0)
    uz = body.displacement(surface)[:, 1]
    assert_allclose(uz[inside], profile(body, r[inside]), rtol=1e-13)
    assert np.all(uz[~inside] < body.delta) if body is FLAT else np.all(uz[~inside] > profile(body, r[~inside]))
    assert_allclose(quad(lambda s: 2 * np.pi * s * body.pressure(s), 0, body.a)[0], body.P, rtol=1e-9)


@pytest.mark.parametrize("body", BODIES, ids=repr)
def test_axis_is_the_limit_and_z_rounds_to_the_surface(body):
    z = np.array([0.2, 0.7, 3.0])
    near, on = (np.column_stack([np.full(3, r), z]) for r in (1e-7, 0.0))
    assert_allclose(body.displacement(on), body.displacement(near), atol=1e-7 * body.delta)
    assert_allclose(body.displacement_gradient(on), body.displacement_gradient(near), atol=1e-6 * body.delta / body.a)
    assert_allclose(body.displacement([[0.0, 0.0]])[0], [0, body.delta], atol=1e-15)
    assert_allclose(body.displacement([[0.1, -1e-17]]), body.displacement([[0.1, 0.0]]), rtol=1e-15)
    with pytest.raises(ValueError, match="z = "):
        body.displacement([[0.5, -1e-3]])
    with pytest.raises(ValueError, match="shape"):
        body.displacement([0.5, 1e-3])


@pytest.mark.parametrize("body", BODIES, ids=repr)
def test_far_away_is_the_point_load(body):
    """Boussinesq on the surface: u_z = P/(πE*r), to the order (a/r)²."""
    r = np.array([20.0, 40.0])
    u = body.displacement(np.column_stack([r, 0 * r]))[:, 1]
    error = u * np.pi * body.E_star * r / body.P - 1
    assert np.all(np.abs(error) < (body.a / r) ** 2)
    assert_allclose(error[0] / error[1], 4, rtol=1e-2)


def test_hertz_is_regular_at_the_edge_of_contact():
    assert_allclose(HERTZ.stress([[HERTZ.a, 0.0]])[0, [1, 3]], 0, atol=1e-9)
    assert np.all(np.isfinite(HERTZ.displacement_gradient([[0, 0, 0], [0, HERTZ.a, 0]])))


def test_hertz_point_of_the_catalogue():
    assert_allclose([HERTZ.p0, HERTZ.P, HERTZ.delta], [0.2098747, 0.03956044, 0.09], rtol=3e-7)


def test_forces_of_the_punches():
    """The P–δ laws of Love, Boussinesq and Hertz against P = ∫ F dt."""
    tan = np.tan(CONE.alpha)
    assert_allclose(CONE.P, 2 * CONE.E_star * CONE.delta**2 / (np.pi * tan), rtol=1e-14)
    assert_allclose(CONE.a, 2 * CONE.delta / (np.pi * tan), rtol=1e-14)
    assert_allclose(FLAT.P, 2 * FLAT.a * FLAT.E_star * FLAT.delta, rtol=1e-14)
    assert_allclose(HERTZ.P, 4 * HERTZ.E_star * HERTZ.a**3 / (3 * HERTZ.R), rtol=1e-14)


def test_incompressible_limit_is_continuous():
    near, at = (HertzPoint(E=1, nu=nu, a=0.3, R=1) for nu in (0.5 - 1e-9, 0.5))
    assert_allclose(at.stress(SECTION), near.stress(SECTION), atol=1e-8)
    assert_allclose(np.trace(at.displacement_gradient(SPACE), axis1=1, axis2=2), 0, atol=1e-15)


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: HertzPoint(E=-1, nu=0.3, a=1, R=1), "E = -1"),
        (lambda: HertzPoint(E=1, nu=0.3, a=1, R=0), "R = 0"),
        (lambda: Cone(E=1, nu=0.3, alpha=20, delta=1), "alpha = 20: must be an angle in radians"),
        (lambda: FlatPunch(E=1, nu=0.3, a=1, delta=np.inf), "delta = inf"),
    ],
)
def test_parameters_outside_the_formula_are_refused(make, message):
    with pytest.raises(ValueError, match=message):
        make()
