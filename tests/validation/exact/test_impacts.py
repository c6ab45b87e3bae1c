"""Ball: each step's complementarity problem, rational. Sphere: its equation of motion. Spring on a tube."""

from __future__ import annotations

from fractions import Fraction

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.integrate import quad, solve_ivp

from validation.exact.impacts import BallDrop, HertzImpact
from validation.exact.surfaces import SpringSurface


def implicit_euler(m, g, x0, dt, steps):
    """x, v, p of 0 <= x_n ⊥ p_n >= 0, rational."""
    m, g, x, h = (Fraction(str(value)) for value in (m, g, x0, dt))
    v, rows = Fraction(0), [(x, Fraction(0), Fraction(0))]
    for _ in range(steps):
        free = x + h * (v - h * g)
        p = max(-free, Fraction(0)) * m / h
        v = v - h * g + p / m
        x = x + h * v
        rows.append((x, v, p))
    return np.array(rows, dtype=float).T


@pytest.mark.parametrize(
    ("m", "g", "x0", "dt"),
    [
        (1, 9.81, 1, 0.1),
        (1, 10, 1, 0.1),
        (2.5, 10, 0.3, 0.1),
        (3, 1.62, 7, 0.013),
        (1, 10, 0, 0.1),
        (1, 9.81, 0.001, 1),
    ],
)
def test_ball_drop_is_implicit_euler(m, g, x0, dt):
    ball = BallDrop(m=m, g=g, x0=x0, dt=dt)
    steps = ball.contact_step + 5
    x, v, p = implicit_euler(m, g, x0, dt, steps)
    assert_allclose(ball.positions(steps), x, rtol=1e-15)
    assert_allclose(ball.velocities(steps), v, rtol=1e-15)
    assert_allclose(ball.impulses(steps), p, rtol=1e-15)
    assert_allclose(ball.rest_impulse, m * g * dt, rtol=1e-14)


def test_ball_drop_of_the_catalogue():
    ball = BallDrop(m=1, g=9.81, x0=1, dt=0.1)
    assert (ball.contact_step, ball.grazing) == (5, False)
    assert_allclose(ball.impulses(8)[4:], [0, 4.715, 1.171, 0.981, 0.981], rtol=1e-15)


def test_ball_drop_grazes_exactly():
    ball = BallDrop(m=1, g=10, x0=1, dt=0.1)
    assert (ball.contact_step, ball.grazing) == (4, True)
    assert ball.positions(4)[4] == 0
    assert_allclose(ball.impulses(7)[4:], [0, 5, 1, 1], rtol=1e-15)


def test_hertz_impact_by_its_equation_of_motion():
    impact = HertzImpact(m=2, v0=0.7, R=3, E=50, nu=0.3)
    stiffness = 4 / 3 * 50 / 0.91 * np.sqrt(3)

    def leaves(t, y):
        return y[0] + 1e-300 if t > 1e-6 else 1.0

    leaves.terminal, leaves.direction = True, -1
    path = solve_ivp(
        lambda t, y: [y[1], -stiffness * max(y[0], 0) ** 1.5 / 2],
        (0, 100),
        [0, 0.7],
        events=leaves,
        rtol=1e-11,
        atol=1e-13,
        method="DOP853",
        dense_output=True,
    )
    assert_allclose(impact.duration, path.t_events[0][0], rtol=1e-8)
    t = np.linspace(0, impact.duration, 21)
    assert_allclose(impact.approach(t), path.sol(t)[0], atol=1e-8 * impact.delta)
    assert_allclose(impact.approach(impact.duration / 2), impact.delta, rtol=1e-14)
    assert_allclose(quad(impact.force, 0, impact.duration)[0], impact.impulse, rtol=1e-7)
    assert_allclose(impact.peak_force, stiffness * impact.delta**1.5, rtol=1e-13)
    assert np.all(impact.force([-1.0, impact.duration + 1]) == 0)
    for part in (0.1, 0.5, 1.0):
        times = impact.passes(part * impact.peak_force)
        assert_allclose(impact.force(times), part * impact.peak_force, rtol=1e-12)
        assert sum(times) == pytest.approx(impact.duration)
    assert np.isnan(impact.passes(1.1 * impact.peak_force)).all()


def test_hertz_impact_of_the_catalogue():
    impact = HertzImpact(m=2, v0=0.7, R=3, E=50, nu=0.3)
    assert_allclose(impact.duration, 2.8682657 * (4 / (3 * (50 / 0.91) ** 2 * 0.7)) ** 0.2, rtol=2e-8)
    assert_allclose(impact.delta, (15 * 2 * 0.49 / (16 * np.sqrt(3) * 50 / 0.91)) ** 0.4, rtol=1e-14)


def test_spring_surface_by_quadrature():
    spring = SpringSurface(k=3, d=0.2, s=2, T=0.5)
    assert_allclose(spring.radius, 0.2963460, atol=5e-8)
    assert_allclose(spring.reaction, 0.6, rtol=1e-15)
    for rho in (0.0, 0.1, spring.radius, 1.0):
        total = quad(lambda z, rho=rho: (1 + 4 * (rho**2 + z**2)) ** -2, -np.inf, np.inf, epsabs=1e-13)[0]
        assert_allclose(spring.potential(rho), total, rtol=1e-11)
    assert_allclose(spring.potential(spring.radius), 0.5, rtol=1e-14)


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: BallDrop(m=1, g=10, x0=-1, dt=0.1), "x0 = -1"),
        (lambda: BallDrop(m=0, g=10, x0=1, dt=0.1), "m = 0"),
        (lambda: HertzImpact(m=1, v0=1, R=1, E=1, nu=0.6), r"nu = 0\.6"),
        (lambda: SpringSurface(k=1, d=1, s=2, T=1), r"T = 1: must be < pi/\(2 s\) = 0\.785398"),
    ],
)
def test_parameters_outside_the_formula_are_refused(make, message):
    with pytest.raises(ValueError, match=message):
        make()
