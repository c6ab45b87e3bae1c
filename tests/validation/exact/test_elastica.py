"""Elliptic integrals against shooting, tables, energy and the linear column."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.integrate import solve_ivp
from scipy.optimize import root

from validation.exact.columns import ColumnWalls, euler_load
from validation.exact.elastica import CantileverElastica, ColumnElastica, rolled_tip


def shoot(theta0, kappa0, length, force):
    """(x, y, θ, θ′, ∫½θ′²) of EI = 1, θ″ = f_x sin θ − f_y cos θ from (0, 0, θ₀, κ₀)."""

    def rhs(s, y):
        bend = force[0] * np.sin(y[2]) - force[1] * np.cos(y[2])
        return [np.cos(y[2]), np.sin(y[2]), y[3], bend, 0.5 * y[3] ** 2]

    return solve_ivp(rhs, (0, length), [0, 0, theta0, kappa0, 0], method="DOP853", rtol=1e-12, atol=1e-14).y[:, -1]


@pytest.mark.parametrize(("P", "x", "y", "angle"), [(1, 0.94357, 0.30172, 0.46135), (10, 0.44500, 0.81061, 1.43029)])
def test_cantilever_across_by_mattiassons_table(P, x, y, angle):
    cantilever = CantileverElastica(EI=1, L=1, P=P)
    assert_allclose([*cantilever.tip, cantilever.tip_angle], [x, y, angle], atol=6e-6)


@pytest.mark.parametrize("omega", [0.3, np.pi / 2, 2.5, np.pi])
@pytest.mark.parametrize("P", [0.7, 3.0, 12.0])
def test_cantilever_ends_without_moment(P, omega):
    """Shooting from the clamp with the elliptic moment gives the tip, its angle and no moment there."""
    cantilever = CantileverElastica(EI=2, L=1.5, P=2 * P, omega=omega)
    end = shoot(0, cantilever.clamp_moment / 2, 1.5, P * np.array([np.cos(omega), np.sin(omega)]))
    assert_allclose(end[:4], [*cantilever.tip, cantilever.tip_angle, 0], atol=1e-9)
    if omega == np.pi:
        assert (cantilever.tip_angle > 0) == (euler_load(EI=2, L=1.5, ends="cantilever") < 2 * P)


def test_cantilever_of_small_load_is_linear():
    cantilever = CantileverElastica(EI=1, L=1, P=1e-6)
    assert_allclose([cantilever.tip[1], cantilever.tip_angle], [1e-6 / 3, 1e-6 / 2], rtol=1e-9)


def test_rolled_tip_is_a_circle():
    assert_allclose(rolled_tip(EI=3, L=2, M=3 * np.pi), [0, 0, 2 * np.pi], atol=1e-15)
    end = shoot(0, 0.7, 2, np.zeros(2))
    assert_allclose(rolled_tip(EI=3, L=2, M=2.1), end[:3], rtol=1e-11)
    assert_allclose(rolled_tip(EI=3, L=2, M=0), [2, 0, 0])


def test_column_elastica_of_the_catalogue():
    column = ColumnElastica(EI=1, L=1, P=25, d=0.05)
    assert_allclose(column.reaction, 3.874906, atol=5e-7)
    assert_allclose(column.shortening, 0.006633738, atol=5e-10)
    assert_allclose(column.line_contact_load, 39.32908, atol=5e-6)
    assert_allclose(ColumnElastica(EI=1, L=1, P=25, d=0.1).line_contact_load, 38.86474, atol=5e-6)


@pytest.mark.parametrize("P", [10.0, 15.0, 25.0, 38.0])
@pytest.mark.parametrize("d", [0.01, 0.05, 0.15, 0.25])
def test_column_elastica_in_point_contact_by_shooting(P, d):
    """From the pin with unknown slope and force to the middle: θ = 0, y = d, the first mode from the linear guess."""
    column = ColumnElastica(EI=2, L=1, P=2 * P, d=d)
    if column.regime == "free":
        end = shoot(column.end_angle, 0, 0.5, np.array([-P, 0]))
        assert_allclose(end[1:3], [column.amplitude, 0], atol=1e-9)
        assert column.amplitude <= d and column.force == 0 and column.contact_load >= 2 * P
        return
    if column.regime == "line":
        assert column.line_contact_load < 2 * P
        return
    # A root of the residual near the linear solution, not near the tested one.
    linear = ColumnWalls(EI=1, L=1, P=P, d=d)
    guess = [np.pi * d, linear.pin_force]

    def residual(z):
        end = shoot(z[0], 0, 0.5, np.array([-P, -z[1]]))
        return [end[1] - d, end[2]]

    theta0, V = root(residual, guess, tol=1e-12).x
    end = shoot(theta0, 0, 0.5, np.array([-P, -V]))
    assert_allclose(end[1:3], [d, 0], atol=1e-10)
    assert_allclose([column.end_angle, column.pin_force, column.reaction], [theta0, 2 * V, 4 * V], rtol=1e-7)
    assert_allclose(column.shortening, 1 - 2 * end[0], rtol=1e-7)
    assert end[3] < 0, "the middle curves away from its wall"


@pytest.mark.parametrize(("P", "d"), [(39.4, 0.05), (60.0, 0.05), (60.0, 0.1), (38.9, 0.1)])
def test_column_elastica_in_line_contact_by_shooting(P, d):
    """At s from the pin the wire is flat, straight and on the wall."""
    column = ColumnElastica(EI=1, L=1, P=P, d=d)
    assert column.regime == "line" and column.s < 0.5 and column.line_contact_load < P
    end = shoot(column.end_angle, 0, column.s, np.array([-P, -column.pin_force]))
    assert_allclose(end[1:4], [d, 0, 0], atol=1e-9)
    assert_allclose(column.shortening, 2 * (column.s - end[0]), rtol=1e-9)


def test_column_elastica_regimes_meet():
    column = ColumnElastica(EI=1, L=1, P=25, d=0.05)
    for load in (column.contact_load, column.line_contact_load):
        below, above = (ColumnElastica(EI=1, L=1, P=load * (1 + e), d=0.05) for e in (-1e-8, 1e-8))
        assert below.regime != above.regime
        assert_allclose([above.force, above.shortening, above.s], [below.force, below.shortening, below.s], atol=2e-4)


def test_column_elastica_work_is_energy():
    """P dΔ = d(bending energy) while the column slides on the wall, for central differences in P."""

    def state(P):
        column = ColumnElastica(EI=1, L=1, P=P, d=0.05)
        end = shoot(column.end_angle, 0, column.s, np.array([-P, -column.pin_force]))
        return 2 * end[4], column.shortening

    for P in (15.0, 25.0, 38.0, 50.0):
        (low, shorter), (high, longer) = state(P - 0.01), state(P + 0.01)
        assert_allclose((high - low) / (longer - shorter), P, rtol=1e-4)


def test_column_elastica_tends_to_the_linear_column():
    """The difference falls as d²."""
    for multiple in (2, 3.5, 6):
        P, errors = multiple * np.pi**2, []
        for d in (0.02, 0.01, 0.005):
            linear, exact = ColumnWalls(EI=1, L=1, P=P, d=d), ColumnElastica(EI=1, L=1, P=P, d=d)
            errors.append(
                [exact.reaction / linear.reaction - 1, exact.shortening / linear.shortening - 1, exact.s / linear.s - 1]
            )
        used = slice(0, 2) if multiple < 4 else slice(None)
        rates = np.log2(np.abs(np.array(errors[:-1])[:, used] / np.array(errors[1:])[:, used]))
        assert_allclose(rates, 2, atol=0.05)


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: CantileverElastica(EI=1, L=1, P=1, omega=0), "omega = 0"),
        (lambda: CantileverElastica(EI=1, L=1, P=300), "P = 300: must be <= 225"),
        (lambda: ColumnElastica(EI=1, L=1, P=9, d=0.1), r"P = 9: must be > 9\.8696"),
        (lambda: ColumnElastica(EI=1, L=1, P=200, d=0.01), "P = 200: must be < .* buckles the flat part"),
        (lambda: ColumnElastica(EI=1, L=1, P=60, d=0.3), r"d = 0\.3: no contact of the first mode"),
    ],
)
def test_parameters_outside_the_formula_are_refused(make, message):
    with pytest.raises(ValueError, match=message):
        make()
