"""Free boundaries against scipy's boundary-value solver, and the obstacle problems' inequalities."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.integrate import solve_bvp

from validation.exact.membranes import MembraneBall, MembraneDisc, String


def radial_free_boundary(load, contact, slope, R, guess):
    """The radius a of −(r u′)′/r = load on a < r < R, u(R) = 0, u and u′ given at a."""
    s = np.linspace(0, 1, 41)

    def rhs(s, y, p):
        width = R - p[0]
        return width * np.vstack([y[1], -load - y[1] / (p[0] + width * s)])

    def bc(ya, yb, p):
        return np.array([ya[0] - contact(p[0]), ya[1] - slope(p[0]), yb[0]])

    start = np.vstack([contact(guess) * (1 - s), 0 * s - contact(guess) / (R - guess)])
    result = solve_bvp(rhs, bc, s, start, p=[guess], tol=1e-9, max_nodes=10000)
    assert result.success
    return result.p[0], lambda r: result.sol((r - result.p[0]) / (R - result.p[0]))[0]


def laplacian(u, points, h=1e-3):
    shifts = h * np.array([[1, 0], [-1, 0], [0, 1], [0, -1]])
    return (sum(u(points + s) for s in shifts) - 4 * u(points)) / h**2


GRID = np.stack(np.meshgrid(np.linspace(-2, 2, 83), np.linspace(-2, 2, 81)), axis=-1).reshape(-1, 2)
RADIUS = np.linalg.norm(GRID, axis=1)


def test_membrane_ball_of_the_catalogue():
    ball = MembraneBall()
    assert_allclose(ball.a, 0.6979651482233736, rtol=1e-15)
    assert_allclose(ball.A, 0.6802594118917169, rtol=1e-14)
    assert_allclose(ball.B, 0.4715198934021101, rtol=1e-14)
    assert_allclose(ball.force, 4.274195941868662, rtol=1e-14)


@pytest.mark.parametrize("R", [1.3, 2.0, 5.0])
def test_membrane_ball_by_its_differential_equation(R):
    ball = MembraneBall(R=R)
    a, u = radial_free_boundary(
        0, lambda a: np.sqrt(1 - a**2), lambda a: -a / np.sqrt(1 - a**2), R, guess=ball.a + 0.03
    )
    assert_allclose(ball.a, a, rtol=1e-8)
    r = np.linspace(a, R, 9)
    assert_allclose(ball.displacement(np.column_stack([r, 0 * r])), u(r), atol=1e-8)


def test_membrane_ball_solves_the_inequality():
    """u ≥ ψ; harmonic off the contact; superharmonic on it, with 2πA = ∫ −Δu over the contact."""
    ball = MembraneBall()
    u = ball.displacement(GRID)
    assert np.all(u >= ball.obstacle(GRID) - 1e-15)
    lap = laplacian(ball.displacement, GRID)
    assert_allclose(lap[ball.a + 2e-3 < RADIUS], 0, atol=3e-5)
    assert np.all(lap[ball.a - 2e-3 > RADIUS] < -1.9)
    r, w = np.polynomial.legendre.leggauss(40)
    r, w = 0.5 * ball.a * (1 + r), 0.5 * ball.a * w
    minus_laplacian = (2 - r**2) / (1 - r**2) ** 1.5
    assert_allclose(w @ (2 * np.pi * r * minus_laplacian), ball.force, rtol=1e-12)


def test_membrane_ball_obstacle_is_smooth_where_the_cone_begins():
    r = np.array([0.9 - 1e-6, 0.9, 0.9 + 1e-6])
    psi = MembraneBall().obstacle(np.column_stack([r, 0 * r]))
    assert_allclose(np.diff(psi), -0.9 / np.sqrt(0.19) * 1e-6, rtol=1e-4)


def test_membrane_disc_of_the_catalogue():
    disc = MembraneDisc(R=1, f=1, d=0.1)
    assert_allclose(disc.a, 0.5024743571, atol=5e-11)
    assert_allclose(disc.force, np.pi * disc.a**2, rtol=1e-15)


@pytest.mark.parametrize(("R", "f", "d"), [(1, 1, 0.1), (2, 0.7, 0.3), (1, 1, 0.01)])
def test_membrane_disc_by_its_differential_equation(R, f, d):
    disc = MembraneDisc(R=R, f=f, d=d)
    a, u = radial_free_boundary(f, lambda a: d, lambda a: 0.0, R, guess=0.95 * disc.a)
    assert_allclose(disc.a, a, rtol=1e-7)
    r = np.linspace(a, R, 9)
    assert_allclose(disc.displacement(np.column_stack([r, 0 * r])), u(r), atol=1e-8)
    assert_allclose(disc.displacement([[0.0, 0.0], [0.5 * a, 0.0]]), d, rtol=1e-14)


def test_membrane_disc_without_contact_is_free():
    disc = MembraneDisc(R=2, f=0.5, d=0.5)
    assert (disc.a, disc.force) == (0, 0)
    points = np.array([[0.0, 0.0], [0.3, 0.4], [2.0, 0.0]])
    assert_allclose(disc.displacement(points), [0.5, 0.5 * 3.75 / 4, 0], atol=1e-15)


def test_string_solves_its_inequality_and_balances():
    string = String(L=3, f=0.8, d=0.2)
    assert_allclose(string.a, np.sqrt(2 * 0.2 / 0.8), rtol=1e-15)
    x, h = np.linspace(0.01, 2.99, 150), 1e-4
    u = string.displacement(x)
    second = (string.displacement(x + h) - 2 * u + string.displacement(x - h)) / h**2
    free = (x < string.a - h) | (x > string.L - string.a + h)
    assert_allclose(second[free], -string.f, atol=1e-6)
    assert_allclose(u[~free], string.d, atol=1e-8)
    assert np.all(u <= string.d + 1e-15)
    pulls = (string.displacement(np.array([h])) + string.displacement(np.array([string.L - h]))) / h
    assert_allclose(pulls + string.force, string.f * string.L, rtol=1e-3)
    edge = np.array([string.a - h, string.a + h])
    assert_allclose(np.diff(string.displacement(edge)) / (2 * h), 0, atol=1e-4)


def test_string_that_does_not_reach_the_floor():
    string = String(L=1, f=1, d=0.2)
    assert string.force == 0
    assert_allclose(string.displacement(np.array([0, 0.25, 0.5, 1])), [0, 0.09375, 0.125, 0], atol=1e-16)


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: MembraneBall(R=1.1), "R = 1.1: must be >= 1.1379"),
        (lambda: MembraneDisc(R=1, f=0, d=1), "f = 0"),
        (lambda: String(L=1, f=1, d=-1), "d = -1"),
    ],
)
def test_parameters_outside_the_formula_are_refused(make, message):
    with pytest.raises(ValueError, match=message):
        make()
