"""Press fits: Hooke's law, equilibrium and boundary tractions of the displacement fields by finite differences."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.testing import assert_allclose

from validation.exact.cylinders import BallShell, Plug, ShrinkFit

from .checks import divergence, gradient, hooke

ANGLES = np.linspace(0.2, 5.9, 7)


def ring(r):
    return np.asarray(r) * np.column_stack([np.cos(ANGLES), np.sin(ANGLES)])


def sphere(r):
    return r * np.column_stack(
        [np.cos(ANGLES) * np.sin(2 * ANGLES), np.sin(ANGLES) * np.sin(2 * ANGLES), np.cos(2 * ANGLES)]
    )


def radial_traction(displacement, points, E, nu):
    """n·σn and the magnitude of what else the traction has."""
    n = points / np.linalg.norm(points, axis=1)[:, None]
    t = np.einsum("pij,pj->pi", hooke(gradient(displacement, points), E, nu), n)
    normal = np.sum(t * n, axis=1)
    return normal, np.abs(t - normal[:, None] * n).max()


def largest_divergence(displacement, points, E, nu):
    return np.abs(divergence(lambda x: hooke(gradient(displacement, x), E, nu), points)).max()


@pytest.mark.parametrize(
    ("body", "surface"),
    [
        (Plug(E=1, nu=0.3, b=2, c=3, delta=0.1), ring),
        (Plug(E=7, nu=0.49, b=1, c=1.5, delta=0.02), ring),
        (BallShell(E=1, nu=0.3, b=1, c=2, delta=0.01), sphere),
        (BallShell(E=5, nu=0.1, b=2, c=2.5, delta=0.03), sphere),
    ],
    ids=repr,
)
def test_rigid_core_in_a_shell(body, surface):
    """u_r(b) = δ; σ_rr = −p at b and 0 at c; no shear; div σ = 0."""
    E, nu = body.E, body.nu
    at_b = surface(body.b)
    assert_allclose(body.displacement(at_b), body.delta * at_b / body.b, atol=1e-15)
    inner, shear = radial_traction(body.displacement, at_b, E, nu)
    assert_allclose(inner, -body.p, rtol=1e-9)
    assert shear < 1e-9 * body.p
    assert_allclose(radial_traction(body.displacement, surface(body.c), E, nu)[0], 0, atol=1e-9 * body.p)
    assert largest_divergence(body.displacement, surface(0.5 * (body.b + body.c)), E, nu) < 1e-8 * body.p


@pytest.mark.parametrize(
    ("body", "surface"),
    [
        (Plug(E=1, nu=0.3, b=2, c=3, delta=0.1, E1=3, nu1=0.2), ring),
        (BallShell(E=1, nu=0.3, b=1, c=2, delta=0.01, E1=0.5, nu1=0.4), sphere),
    ],
    ids=repr,
)
def test_elastic_core_in_a_shell(body, surface):
    """u_r differs by δ at b; σ_rr = −p on both sides of it; the core in equilibrium."""
    at_b = surface(body.b)
    jump = (body.displacement(at_b) - body.displacement_core(at_b)) * at_b / body.b
    assert_allclose(jump.sum(axis=1), body.delta, rtol=1e-13)
    for displacement, E, nu in ((body.displacement, body.E, body.nu), (body.displacement_core, body.E1, body.nu1)):
        assert_allclose(radial_traction(displacement, at_b, E, nu)[0], -body.p, rtol=1e-9)
    assert largest_divergence(body.displacement_core, surface(0.5 * body.b), body.E1, body.nu1) < 1e-8 * body.p
    assert body.p < type(body)(E=1, nu=0.3, b=body.b, c=body.c, delta=body.delta).p


def test_core_of_the_same_material_in_an_infinite_body():
    """p = Eδ/2(1−ν²)b of a cylinder and 2Eδ/3(1−ν)b of a ball: a misfit in an infinite body (Eshelby)."""
    plug = Plug(E=2, nu=0.3, b=1, c=1e6, delta=0.01, E1=2, nu1=0.3)
    assert_allclose(plug.p, 2 * 0.01 / (2 * 0.91), rtol=1e-11)
    ball = BallShell(E=2, nu=0.3, b=1, c=1e5, delta=0.01, E1=2, nu1=0.3)
    assert_allclose(ball.p, 2 * 2 * 0.01 / (3 * 0.7), rtol=1e-11)


@pytest.mark.parametrize(("nu", "p"), [(0.3, 0.01814224), (0.4999, 0.01851811)])
def test_plug_of_the_catalogue(nu, p):
    plug = Plug(E=1, nu=nu, b=2, c=3, delta=0.1)
    assert_allclose(plug.p, p, rtol=3e-7)
    E_, nu_ = 1 / (1 - nu**2), nu / (1 - nu)
    assert_allclose(plug.p, 0.1 / (2 * ((9 + 4) / (9 - 4) + nu_) / E_), rtol=1e-13)
    assert_allclose(plug.force, 4 * np.pi * plug.p, rtol=1e-15)


def test_plug_without_compressibility_conserves_volume():
    plug = Plug(E=1, nu=0.5, b=2, c=3, delta=0.1)
    assert_allclose(np.linalg.norm(plug.displacement(ring(2.5)), axis=1), 0.1 * 2 / 2.5, rtol=1e-14)


def test_ball_shell_of_the_catalogue_in_space_and_in_section():
    """p = E·.01·7/((1−2ν) + 4(1+ν)) = .0125 for E = 1, ν = .3."""
    shell = BallShell(E=1, nu=0.3, b=1, c=2, delta=0.01)
    assert_allclose(shell.p, 0.0125, rtol=1e-13)
    rz = np.column_stack([np.sin(ANGLES / 2), np.cos(ANGLES / 2)]) * 1.4
    in_space = shell.displacement(np.column_stack([rz[:, 0], 0 * ANGLES, rz[:, 1]]))
    assert_allclose(shell.displacement(rz), in_space[:, [0, 2]], rtol=1e-15)


def test_thick_shell_is_a_cavity_in_space():
    """c → ∞: u(b) = (1+ν) p b/2E."""
    shell = BallShell(E=2, nu=0.3, b=1, c=1e5, delta=0.01)
    assert_allclose(shell.p, 0.01 * 2 * 2 / 1.3, rtol=1e-10)


def test_shrink_fit_of_the_catalogue():
    fit = ShrinkFit(E1=1000, nu1=0.3, E2=1000, nu2=0.3, a=1, b=2, c=3, delta=0.002)
    assert_allclose(fit.p, 0.2575549, rtol=2e-7)


def test_shrink_fit_closes_the_interference_and_balances():
    fit = ShrinkFit(E1=900, nu1=0.25, E2=400, nu2=0.4, a=0.8, b=2, c=3.1, delta=0.003)
    at_b = ring(fit.b)
    jump = (fit.displacement_outer(at_b) - fit.displacement_inner(at_b)) * at_b / fit.b
    assert_allclose(jump.sum(axis=1), fit.delta, rtol=1e-12)
    for displacement, E, nu, free in (
        (fit.displacement_inner, fit.E1, fit.nu1, fit.a),
        (fit.displacement_outer, fit.E2, fit.nu2, fit.c),
    ):
        assert_allclose(radial_traction(displacement, at_b, E, nu)[0], -fit.p, rtol=1e-8)
        assert_allclose(radial_traction(displacement, ring(free), E, nu)[0], 0, atol=1e-8 * fit.p)
        assert largest_divergence(displacement, ring(0.5 * (free + fit.b)), E, nu) < 1e-7 * fit.p
    (a, b, c), (n1, n2) = (fit.a, fit.b, fit.c), (0.25 / 0.75, 0.4 / 0.6)
    outer = b * ((c**2 + b**2) / (c**2 - b**2) + n2) * (1 - 0.4**2) / 400
    inner = b * ((b**2 + a**2) / (b**2 - a**2) - n1) * (1 - 0.25**2) / 900
    assert_allclose(fit.p, 0.003 / (outer + inner), rtol=1e-13)


def test_elastic_plug_is_the_shrink_fit_of_a_tube_with_a_small_bore():
    plug = Plug(E=400, nu=0.4, b=2, c=3, delta=0.01, E1=900, nu1=0.25)
    fit = ShrinkFit(E1=900, nu1=0.25, E2=400, nu2=0.4, a=1e-6, b=2, c=3, delta=0.01)
    assert_allclose(fit.p, plug.p, rtol=1e-11)


def test_plug_is_the_shrink_fit_on_a_rigid_tube():
    plug = Plug(E=1, nu=0.3, b=2, c=3, delta=0.1)
    fit = ShrinkFit(E1=1e12, nu1=0.3, E2=1, nu2=0.3, a=1, b=2, c=3, delta=0.1)
    assert_allclose(fit.p, plug.p, rtol=1e-11)


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: Plug(E=1, nu=0.3, b=3, c=2, delta=0.1), "c = 2: must be > b = 3"),
        (lambda: Plug(E=1, nu=0.3, b=2, c=3, delta=-0.1), "delta = -0.1"),
        (lambda: Plug(E=1, nu=0.3, b=2, c=3, delta=0.1, E1=-1.0), "E1 = -1.0"),
        (lambda: BallShell(E=1, nu=0.7, b=1, c=2, delta=0.1), "nu = 0.7"),
        (lambda: ShrinkFit(E1=1, nu1=0.3, E2=0, nu2=0.3, a=1, b=2, c=3, delta=0.1), "E2 = 0"),
    ],
)
def test_parameters_outside_the_formula_are_refused(make, message):
    with pytest.raises(ValueError, match=message):
        make()
