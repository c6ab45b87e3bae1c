"""Bars and springs against their boundary-value problems and balances, in exact arithmetic where that is possible."""

from __future__ import annotations

from fractions import Fraction

import numpy as np
import pytest
from numpy.testing import assert_allclose

from validation.exact.bars import BarStop, Slit, TwoBars, v_groove


@pytest.mark.parametrize(("F", "q", "g"), [(3.0, 0.0, 0.2), (0.0, 4.0, 0.1), (1.0, -0.5, 0.3), (0.2, 0.1, 2.0)])
def test_bar_stop_solves_its_boundary_value_problem(F, q, g):
    """−EA u″ = q, u(0) = 0, EA u′(L) = F − λ, complementarity; differences are exact for a quadratic."""
    bar = BarStop(E=7, A=0.5, L=2, F=F, q=q, g=g)
    EA, h, L = 3.5, 1e-3, 2.0
    x = np.linspace(0.1, 1.9, 7)
    second = (bar.displacement(x + h) - 2 * bar.displacement(x) + bar.displacement(x - h)) / h**2
    assert_allclose(EA * second, -q, atol=1e-8)
    assert bar.displacement(0.0) == 0
    slope = (3 * bar.displacement(L) - 4 * bar.displacement(L - h) + bar.displacement(L - 2 * h)) / (2 * h)
    assert_allclose(EA * slope, F - bar.reaction, atol=1e-10)
    gap = g - bar.displacement(L)
    assert bar.reaction >= 0 and gap >= -1e-15
    assert abs(bar.reaction * gap) < 1e-15


def test_bar_stop_of_the_catalogue():
    assert_allclose(BarStop(E=2, A=3, L=4, F=5, g=0.5).reaction, 5 - 2 * 3 * 0.5 / 4, rtol=1e-15)
    assert_allclose(BarStop(E=2, A=3, L=4, q=5, g=0.5).reaction, 5 * 4 / 2 - 2 * 3 * 0.5 / 4, rtol=1e-15)


def test_bar_stop_grazing_and_without_load():
    grazing = BarStop(E=2, A=3, L=4, F=0.75, g=0.5)
    assert (grazing.reaction, grazing.end_displacement) == (0, 0.5)
    idle = BarStop(E=2, A=3, L=4, g=0)
    assert (idle.reaction, idle.end_displacement) == (0, 0)


def test_duplicated_stop_shares_the_force():
    bar = BarStop(E=2, A=3, L=4, F=5, g=0.5)
    lam = bar.duplicated(7)
    assert_allclose(lam.sum(), bar.reaction, rtol=1e-15)
    assert np.all(lam == lam[0])
    with pytest.raises(ValueError, match="N = 0"):
        bar.duplicated(0)


@pytest.mark.parametrize("F", [-3.0, 0.0, 1.0, 1.5, 1.8, 2.0, 9.0])
@pytest.mark.parametrize("w", [0.0, 0.1])
def test_slit_balances_and_is_complementary(F, w):
    slit = Slit(k=4, F=F, g=0.4, w=w)
    u, difference = slit.displacement, slit.reaction_difference
    assert_allclose(4 * u, F - difference, atol=1e-15)
    assert 0.4 <= u <= 0.4 + w
    upper, lower = max(difference, 0), max(-difference, 0)
    assert abs(upper * (0.4 + w - u)) < 1e-15 and abs(lower * (u - 0.4)) < 1e-15


def test_slit_of_zero_width_is_exact_and_of_negative_width_infeasible():
    assert Slit(k=4, F=9, g=0.4).displacement == 0.4
    with pytest.raises(ValueError, match=r"w = -0\.1: must be >= 0"):
        Slit(k=4, F=9, g=0.4, w=-0.1)


@pytest.mark.parametrize(("k1", "k2", "F", "g"), [(1, 10**12, 2, 1), (1, 1, 2, 1), (3, 2, 1, 1), (10**12, 1, 5, 0)])
def test_two_bars_in_rational_arithmetic(k1, k2, F, g):
    lam = max(Fraction(k2 * (F - k1 * g), k1 + k2), Fraction(0))
    bars = TwoBars(k1=k1, k2=k2, F=F, g=g)
    assert_allclose(bars.reaction, float(lam), rtol=4e-16)
    assert_allclose(bars.u2, float(lam / k2), rtol=4e-16)
    assert_allclose(bars.u1, float((F - lam) / k1), rtol=4e-16)


def test_two_bars_of_the_catalogue():
    bars = TwoBars(F=2, g=1, k1=1, k2=1e12)
    assert_allclose([bars.reaction, bars.u1], [1 - 1e-12, 1 + 1e-12], rtol=3e-16)


def test_v_groove_balances_the_weight():
    for beta in np.radians([10, 45, 60, 90]):
        N = v_groove(F=3, beta=beta)
        walls = N * np.array([[np.cos(beta), np.sin(beta)], [-np.cos(beta), np.sin(beta)]])
        assert_allclose(walls.sum(axis=0), [0, 3], atol=1e-14)


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: BarStop(E=1, A=0, L=1, g=0), "A = 0: must be > 0"),
        (lambda: BarStop(E=1, A=1, L=1, g=np.nan), "g = nan"),
        (lambda: TwoBars(k1=1, k2=-1, F=1, g=0), "k2 = -1"),
        (lambda: v_groove(F=1, beta=0), "beta = 0"),
        (lambda: v_groove(F=-1, beta=1), "F = -1"),
    ],
)
def test_parameters_outside_the_formula_are_refused(make, message):
    with pytest.raises(ValueError, match=message):
        make()
