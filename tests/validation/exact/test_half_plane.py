"""Transition, line contact and wedge: the fields of `HalfPlane` and their boundary conditions."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.integrate import quad

from validation.exact.hertz_line import HertzLine
from validation.exact.punches import Wedge
from validation.exact.transition import Transition

from .checks import assert_elastic, on_surface

TRANSITION = Transition(E=1, nu=0.3, C=1, x0=np.pi / 30)
HERTZ = HertzLine(E=1, nu=0.3, a=0.3, R=1)
WEDGE = Wedge(E=2.5, nu=0.2, alpha=0.15, a=0.4)
BODIES = [TRANSITION, HERTZ, WEDGE, HertzLine(E=3, nu=0.45, a=0.7, R=2), Transition(E=2, nu=-0.2, C=0.3, x0=-0.4)]

X, Y = np.meshgrid(np.linspace(-1.1, 1.2, 24), np.linspace(0.1, 1.3, 11))
INTERIOR = np.column_stack([X.ravel(), Y.ravel()])


@pytest.mark.parametrize("body", BODIES, ids=repr)
def test_fields_satisfy_elasticity_in_the_body(body):
    """∇u is u's, σ is Hooke's of ∇u in plane strain, div σ = 0."""
    assert_elastic(body, INTERIOR, 1e-14, 1e-8)
    grad = body.displacement_gradient(INTERIOR)
    assert_allclose(body.strain(INTERIOR)[:, 2], 0.5 * (grad[:, 0, 1] + grad[:, 1, 0]), atol=1e-15)


@pytest.mark.parametrize("body", BODIES, ids=repr)
def test_surface_carries_the_pressure_and_no_shear(body):
    x = np.linspace(-1.03, 1.01, 401)
    xx, yy, xy = body.stress(on_surface(x)).T
    scale = np.nanmax(body.pressure(x))
    assert_allclose(-yy, body.pressure(x), atol=1e-14 * scale)
    assert_allclose(xx, yy, atol=1e-14 * scale)
    assert np.all(xy == 0)


@pytest.mark.parametrize("body", BODIES, ids=repr)
def test_rounding_below_the_surface_changes_no_branch(body):
    x = np.linspace(-1.03, 1.01, 41)
    for y in (-0.0, -1e-17):
        points = np.column_stack([x, np.full_like(x, y)])
        assert_allclose(body.displacement(points), body.displacement(on_surface(x)), atol=1e-15)
    with pytest.raises(ValueError, match="y = "):
        body.displacement([[0.5, -1e-3]])


def test_transition_rests_on_the_line_and_lifts_off():
    x = np.linspace(-1, 1, 201)
    uy = TRANSITION.displacement(on_surface(x))[:, 1]
    assert_allclose(uy, TRANSITION.lift(x), atol=1e-15)
    assert np.all(TRANSITION.lift(x)[x < TRANSITION.x0] > 0)
    assert_allclose(TRANSITION.force(0.8), quad(TRANSITION.pressure, TRANSITION.x0, 0.8)[0], rtol=1e-9)
    assert TRANSITION.force(0.0) == 0


def test_transition_at_its_own_singular_point():
    edge = [[TRANSITION.x0, 0.0]]
    assert_allclose(TRANSITION.stress(edge), 0, atol=1e-300)
    assert_allclose(TRANSITION.displacement_gradient(edge), 0, atol=1e-300)


def test_h1_seminorm_of_the_catalogue():
    assert_allclose(TRANSITION.h1_seminorm(-1, 1, 1), 2.608, atol=5e-4)


@pytest.mark.parametrize("body", [TRANSITION, HERTZ, WEDGE], ids=repr)
def test_h1_seminorm_adds_up_over_parts_of_the_box(body):
    """Parts are swept about other points than the whole, so that agreement is agreement of two quadratures."""
    whole = body.h1_seminorm(-1, 1, 1) ** 2
    for cut in (-0.2, 0.53):
        assert_allclose(body.h1_seminorm(-1, cut, 1) ** 2 + body.h1_seminorm(cut, 1, 1) ** 2, whole, rtol=1e-12)


def test_h1_seminorm_by_a_product_rule_away_from_singularities():
    body = Transition(E=1, nu=0.3, C=1, x0=-2)
    s, w = np.polynomial.legendre.leggauss(20)
    points = np.stack(np.meshgrid(s, 0.5 * (1 + s), indexing="ij"), axis=-1).reshape(-1, 2)
    squared = np.sum(body.displacement_gradient(points) ** 2, axis=(1, 2))
    assert_allclose(body.h1_seminorm(-1, 1, 1) ** 2, np.outer(w, 0.5 * w).ravel() @ squared, rtol=1e-12)


def test_hertz_line_of_the_catalogue():
    assert_allclose([HERTZ.p0, HERTZ.P], [0.1648352, 0.07767674], rtol=3e-7)


@pytest.mark.parametrize("body", [HERTZ, BODIES[3]], ids=repr)
def test_hertz_line_follows_the_parabola_and_balances(body):
    x = np.linspace(-2, 2, 201) * body.a
    ux, uy = body.displacement(on_surface(x)).T
    assert_allclose(uy, -(x**2) / (2 * body.R) + body.lift(x), atol=1e-14)
    assert np.all(body.lift(x)[np.abs(x) > body.a] > 0)
    assert_allclose(ux, -ux[::-1], atol=1e-15)
    section = quad(lambda s: body.stress([[s, 0.2]])[0, 1], -np.inf, np.inf, epsabs=1e-12, limit=200)[0]
    assert_allclose(section, -body.P, rtol=1e-9)
    assert_allclose(quad(body.pressure, -body.a, body.a)[0], body.P, rtol=1e-8)


def test_hertz_line_far_away_is_the_line_load():
    """u_x,y etc. of Flamant's solution: σ_rr = −(2P/π) cos θ/r, with θ from the y axis."""
    theta, r = np.linspace(-1.5, 1.5, 13), 1e6
    xx, yy, _ = HERTZ.stress(r * np.column_stack([np.sin(theta), np.cos(theta)])).T
    assert_allclose(xx + yy, -2 * HERTZ.P / np.pi * np.cos(theta) / r, rtol=1e-9)


def test_wedge_follows_its_profile_and_balances():
    x = np.linspace(-1, 1, 201)
    uy = WEDGE.displacement(on_surface(x))[:, 1]
    profile = -np.abs(x) * np.tan(WEDGE.alpha)
    contact = np.abs(x) <= WEDGE.a
    assert_allclose(uy[contact], profile[contact], atol=1e-14)
    assert np.all(uy[~contact] > profile[~contact])
    assert_allclose(WEDGE.P, 2 * quad(WEDGE.pressure, 0, WEDGE.a)[0], rtol=1e-10)
    assert_allclose(WEDGE.P, WEDGE.E_star * WEDGE.a * np.tan(WEDGE.alpha), rtol=1e-15)


@pytest.mark.parametrize(
    ("cls", "bad", "message"),
    [
        (Transition, {"E": 0.0}, "E = 0.0: must be > 0"),
        (Transition, {"nu": 0.6}, "nu = 0.6"),
        (Transition, {"C": np.nan}, "C = nan"),
        (Transition, {"x0": np.inf}, "x0 = inf"),
        (HertzLine, {"a": -1.0}, "a = -1.0: must be > 0"),
        (HertzLine, {"nu": -1.0}, "nu = -1.0"),
        (Wedge, {"alpha": 2.0}, "alpha = 2.0"),
    ],
)
def test_parameters_outside_the_formula_are_refused(cls, bad, message):
    good = {"E": 1.0, "nu": 0.3} | {
        Transition: {"C": 1.0, "x0": 0.0},
        HertzLine: {"a": 1.0, "R": 1.0},
        Wedge: {"alpha": 0.1, "a": 1.0},
    }[cls]
    with pytest.raises(ValueError, match=message):
        cls(**good | bad)
