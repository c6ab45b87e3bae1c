"""Bars: complementarity and energy of the superposed waves, the wave equation, and implicit Euler's own error."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.linalg import solveh_banded

from validation.exact.bar_impacts import BarImpact, BouncingBar, HangingBar, TwoBarImpact

IMPACT = BarImpact(E=900, rho=1, L=10, h0=5, v0=10)
BOUNCE = BouncingBar(E=900, rho=1, L=10, h0=5, g=10)
HANGING = HangingBar(E=1, rho=1, L=1, h0=0.5)


def energy(displacement, t, *, E, rho, L, g=0.0, n=2000):
    """∫½ρu̇² + ½Eu′² + ρgu at time t by the midpoint rule; the fields are piecewise smooth."""
    x, h, k = (np.arange(n) + 0.5) * L / n, 1e-6 * L, 1e-6 * L / np.sqrt(E / rho)
    rate = (displacement(x, t + k) - displacement(x, t - k)) / (2 * k)
    strain = (displacement(x + h, t) - displacement(x - h, t)) / (2 * h)
    return np.mean(0.5 * rho * rate**2 + 0.5 * E * strain**2 + rho * g * displacement(x, t)) * L


@pytest.mark.parametrize(("bar", "end", "g"), [(IMPACT, 3.0, 0), (BOUNCE, 13.0, 10), (HANGING, 7.0, 0)])
def test_gap_and_pressure_are_complementary_and_energy_is_constant(bar, end, g):
    t = np.linspace(0, end, 100003)
    gap, p = bar.displacement(np.array(0.0), t), bar.pressure(t)
    size = np.abs(gap).max()
    assert np.all(p >= 0) and np.all(gap >= -1e-12 * size) and np.all(np.abs(gap[p > 0]) <= 1e-12 * size)
    for time in np.array([0.0131, 0.1717, 0.3313, 0.6171, 0.9113]) * end:
        assert_allclose(energy(bar.displacement, time, E=bar.E, rho=bar.rho, L=bar.L, g=g), bar.energy, rtol=2e-3)


@pytest.mark.parametrize("bar", [IMPACT, BOUNCE, HANGING])
def test_impulse_is_the_integral_of_pressure(bar):
    start, end = bar.contact
    t = start + (np.arange(1000) + 0.5) * (end - start) / 1000
    assert_allclose(bar.pressure(t).mean() * (end - start), bar.impulse, rtol=1e-12)
    assert_allclose(bar.pressure([start - 1e-9, end + 1e-9]), 0)


@pytest.mark.parametrize(("bar", "end", "g"), [(IMPACT, 2.0, 0), (BOUNCE, 6.0, 10), (HANGING, 3.0, 0)])
def test_waves_by_the_parallelogram_rule(bar, end, g):
    """u(x, t+k) + u(x, t−k) − u(x+ck, t) − u(x−ck, t) = −gk², fronts included; −Eu′ = p at x = 0, u′ or u = 0 at L."""
    rng = np.random.default_rng(1)
    k = 0.2 * rng.random(500) * bar.L / bar.c
    x = bar.c * k + rng.random(500) * (bar.L - 2 * bar.c * k)
    t = k + rng.random(500) * end
    u, ck = bar.displacement, bar.c * k
    assert_allclose(u(x, t + k) + u(x, t - k) - u(x + ck, t) - u(x - ck, t), -g * k**2, atol=1e-11)
    h = 1e-6 * bar.L
    strain = (u(np.array(h), t) - u(np.array(0.0), t)) / h
    near_front = np.abs(bar.pressure(t + 2 * h / bar.c) - bar.pressure(t - 2 * h / bar.c)) > 1e-3 * bar.E
    assert near_front.sum() < 5
    assert_allclose(-bar.E * strain[~near_front], bar.pressure(t)[~near_front], atol=2e-3)
    top = u(np.array(bar.L), t)
    held = 0 if bar is HANGING else u(np.array(bar.L - h), t)
    assert_allclose(top, held, atol=1e-4 * h)


def test_figures_of_the_catalogue():
    assert_allclose(IMPACT.contact, [0.5, 1.16667], atol=4e-6)
    assert_allclose(IMPACT.pressure(0.8), 300, rtol=1e-15)
    assert_allclose(IMPACT.displacement([0.0, 10.0], 1.5), 10 * (1.5 - IMPACT.contact[1]), rtol=1e-13)
    assert_allclose([*HANGING.contact, HANGING.pressure(1.5), HANGING.period], [1, 2, 0.5, 3], rtol=1e-15)
    x = np.linspace(0, 1, 5)
    assert_allclose(HANGING.displacement(x, 0.0), 0.5 - x / 2, atol=1e-16)
    two = TwoBarImpact(E=4, rho=1, L1=3, L2=6, v0=5)
    assert_allclose([two.pressure(1.0), two.contact_end, two.parting], [0.5 * 2 * 5, 3, 6], rtol=1e-15)


def test_bouncing_bar_pressures_and_period():
    """First ρc(v₀+gτ), second ρcv₀ + 2ρgL − ρcgτ, period 4v₀/g + 4L/c; the third contact repeats the first."""
    (start, _), (again, _) = BOUNCE.contact, BOUNCE.second_contact
    assert_allclose(BOUNCE.period, 4 + 4 / 3, rtol=1e-14)
    tau = np.array([0.1, 0.5])
    assert_allclose(BOUNCE.pressure(start + tau), 30 * (10 + 10 * tau), rtol=1e-13)
    assert_allclose(BOUNCE.pressure(again + tau), 300 + 200 - 300 * tau, rtol=1e-13)
    x = np.linspace(0, 10, 7)
    for t in (0.3, 1.2, 2.9, 4.0):
        t = t + 1
        assert_allclose(BOUNCE.displacement(x, t + BOUNCE.period), BOUNCE.displacement(x, t), atol=1e-11)
    momentum = (BOUNCE.displacement(x, 1.7) - BOUNCE.displacement(x, 1.68)) / 0.02
    assert_allclose(BOUNCE.impulse, 10 * (10 + 10 + 10 * BOUNCE.round_trip), rtol=1e-14)
    assert momentum.mean() > 0


@pytest.mark.parametrize(("L1", "L2"), [(1.0, 2.0), (1.0, 1.0), (2.0, 1.3), (1.0, 3.5)])
def test_two_bars(L1, L2):
    bars = TwoBarImpact(E=4, rho=1, L1=L1, L2=L2, v0=5)
    t = np.linspace(0, bars.parting + 2, 20001)
    gap = bars.displacement_2(np.array(0.0), t) - bars.displacement_1(np.array(0.0), t)
    assert np.all(np.abs(gap[t <= bars.parting]) < 1e-12)
    assert np.all(gap[t > bars.parting + 1e-3] > 0)
    assert np.all(np.abs(gap[bars.pressure(t) > 0]) < 1e-12)
    for time in (0.37, 1.13, bars.parting + 0.71):
        total = energy(bars.displacement_1, time, E=4, rho=1, L=L1) + energy(
            bars.displacement_2, time, E=4, rho=1, L=L2
        )
        assert_allclose(total, bars.energy, rtol=3e-3)
    x1, x2 = (np.arange(2000) + 0.5) * L1 / 2000, (np.arange(2000) + 0.5) * L2 / 2000
    after, k = bars.parting + 1, 1e-6
    rates = [
        np.mean((u(x, after + k) - u(x, after - k)) / (2 * k))
        for u, x in ((bars.displacement_1, x1), (bars.displacement_2, x2))
    ]
    assert_allclose(np.array(rates) * [L1, L2], [L1 * 5 - bars.impulse, bars.impulse], atol=0.01)


def stopped_end(dt, *, bar, n, steps, u, v, fixed):
    """∫ p dt of implicit Euler with n linear elements (consistent mass) and the floor u(0) >= 0, per density 1."""
    h = bar.L / n
    mass, stiffness = np.full(n + 1, 2 * h / 3), np.full(n + 1, 2.0 / h)
    mass[[0, -1]] /= 2
    stiffness[[0, -1]] /= 2
    band = np.zeros((2, n + 1))
    band[1] = mass + dt**2 * bar.E * stiffness
    band[0, 1:] = h / 6 - dt**2 * bar.E / h
    if fixed:
        band[1, -1], band[0, -1] = 1.0, 0.0
    unit = np.eye(n + 1)[0]
    answer = solveh_banded(band, unit)

    def apply(diagonal, off, w):
        r = diagonal * w
        r[:-1] += off * w[1:]
        r[1:] += off * w[:-1]
        return r

    total = 0.0
    for _ in range(steps):
        rhs = apply(mass, h / 6, v) - dt * bar.E * apply(stiffness, -1 / h, u)
        if fixed:
            rhs[-1] = 0.0
        v = solveh_banded(band, rhs)
        impulse = max(-(u[0] + dt * v[0]) / (dt * answer[0]), 0.0)
        v = v + impulse * answer
        u = u + dt * v
        total += impulse
    return total, v


def test_bar_impact_with_implicit_euler():
    """The relative loss of impulse tends to √(cΔt/πL), the restitution to 1 − 2√(cΔt/πL)."""
    bar, ratios = BarImpact(E=900, rho=1, L=10, h0=0, v0=10), []
    for dt in (1 / 150, 1 / 600, 1 / 2400):
        n = 400
        steps = round(1.3 * bar.round_trip / dt)
        total, v = stopped_end(dt, bar=bar, n=n, steps=steps, u=np.zeros(n + 1), v=np.full(n + 1, -10.0), fixed=False)
        ratios.append((1 - total / bar.impulse) / bar.implicit_euler_impulse_error(dt))
        e = (np.mean(v[1:] + v[:-1]) / 2) / 10
        assert_allclose(1 + e, 2 * total / bar.impulse, rtol=1e-9)
        assert_allclose(e, bar.implicit_euler_restitution(dt), atol=0.1 * (1 - e))
        if dt == 1 / 150:
            assert_allclose(e, 0.84055, atol=2e-3)
    assert_allclose(ratios, 1, atol=0.1)


def test_hanging_bar_with_implicit_euler():
    bar, n = HANGING, 400
    x = np.linspace(0, 1, n + 1)
    for dt in (1 / 100, 1 / 400, 1 / 1600):
        total, _ = stopped_end(dt, bar=bar, n=n, steps=round(3 / dt), u=0.5 - x / 2, v=0 * x, fixed=True)
        assert_allclose(1 - total / bar.impulse, bar.implicit_euler_impulse_error(dt), rtol=0.01)


def test_two_bars_with_implicit_euler():
    """Equal bars are symmetric about their centre of mass: each meets a rigid wall at v₀/2."""
    equal, dt, n = TwoBarImpact(E=1, rho=1, L1=1, L2=1, v0=2), 1 / 400, 400
    half = BarImpact(E=1, rho=1, L=1, h0=0, v0=1)
    total, _ = stopped_end(dt, bar=half, n=n, steps=1200, u=np.zeros(n + 1), v=np.full(n + 1, -1.0), fixed=False)
    assert_allclose(1 - total / equal.impulse, equal.implicit_euler_impulse_error(dt), rtol=0.02)


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: BarImpact(E=900, rho=1, L=10, h0=-1, v0=10), "h0 = -1"),
        (lambda: BouncingBar(E=900, rho=1, L=10, h0=2, g=10), r"h0 = 2: must be > 2\.22222"),
        (lambda: BouncingBar(E=900, rho=1, L=10, h0=5.1, g=10), r"h0 = 5\.1: must make .*, 5 is the nearest"),
        (lambda: HangingBar(E=1, rho=1, L=1, h0=0), "h0 = 0"),
        (lambda: TwoBarImpact(E=1, rho=0, L1=1, L2=1, v0=1), "rho = 0"),
    ],
)
def test_parameters_outside_the_formula_are_refused(make, message):
    with pytest.raises(ValueError, match=message):
        make()
