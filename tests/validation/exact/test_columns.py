"""Columns: finite differences of their equations, eigenvalue problems, quadrature, the catalogue's figures."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.integrate import quad
from scipy.linalg import eigh

from validation.exact.columns import ColumnWalls, DawsonPaslay, euler_load

from .checks import fourth, second


def test_column_walls_of_the_catalogue():
    point = ColumnWalls(EI=1, L=1, P=2 * np.pi**2, d=1e-3)
    assert_allclose(point.reaction, 0.0496159, atol=5e-8)
    assert_allclose(point.shortening / 1e-6, 2.566635, atol=5e-7)
    line = ColumnWalls(EI=1, L=1, P=6 * np.pi**2, d=1e-3)
    assert_allclose([line.s, line.reaction], [0.408248, 0.145053], atol=5e-7)


@pytest.mark.parametrize("multiple", [1.2, 2.0, 3.9, 4.5, 15.0])
def test_column_walls_shape(multiple):
    """EI w⁗ + P w″ = 0, moment-free pins, tangent to the wall, the pins' force EI w‴ + P w′, the shortening."""
    column = ColumnWalls(EI=2, L=1.5, P=multiple * euler_load(EI=2, L=1.5), d=0.01)
    w, s, h = column.deflection, column.s, 4e-3
    x = np.linspace(0.05, s - 0.05, 9)
    assert_allclose(
        2 * fourth(w, x, h) + column.P * second(w, x, h), 0, atol=2e-3 * column.P * np.abs(second(w, x, h)).max()
    )
    assert_allclose(w(np.array([s, 0.75])), 0.01, rtol=1e-13)
    assert_allclose((w(s) - w(s - 1e-6)) / 1e-6, 0, atol=1e-5)

    def shear(x):
        return 2 * (second(w, x + h, h) - second(w, x - h, h)) / (2 * h) + column.P * (w(x + h) - w(x - h)) / (2 * h)

    assert_allclose(shear(np.array([0.1, 0.2])), column.pin_force, rtol=2e-3)
    assert_allclose(column.force, 2 * column.pin_force)
    length = 2 * quad(lambda x: 0.5 * ((w(x + 1e-5) - w(x - 1e-5)) / 2e-5) ** 2, 2e-5, s)[0]
    assert_allclose(column.shortening, length, rtol=2e-3)


def test_column_walls_is_refused_outside_its_loads():
    for P in (9.8, 158.0):
        with pytest.raises(ValueError, match=rf"P = {P}: must be between 9\.8696 .* 157\.914"):
            ColumnWalls(EI=1, L=1, P=P, d=1e-3)


def test_euler_loads_by_finite_differences():
    """The first eigenvalue of −w″ = (P/EI) w for the pinned column; the others by the length of the half wave."""
    n = 400
    matrix = (np.diag(2 * np.ones(n - 1)) - np.diag(np.ones(n - 2), 1) - np.diag(np.ones(n - 2), -1)) * n**2
    lowest = eigh(matrix, subset_by_index=[0, 0], eigvals_only=True)[0]
    assert_allclose(euler_load(EI=3, L=2), 3 * lowest / 4, rtol=1e-5)
    assert_allclose(euler_load(EI=3, L=2, ends="cantilever"), euler_load(EI=3, L=4), rtol=1e-15)
    assert_allclose(euler_load(EI=3, L=2, ends="clamped"), euler_load(EI=3, L=1), rtol=1e-15)


def test_dawson_paslay_of_the_catalogue():
    rod = DawsonPaslay(EI=1, w=1, r=0.1, L=5.299942)
    assert rod.n == 3
    assert_allclose([rod.P, rod.infinite_load], [6.324555, 2 * np.sqrt(10)], atol=5e-7)


@pytest.mark.parametrize("L", [1.0, 3.0, 4.5, 9.0])
def test_dawson_paslay_by_its_eigenvalue_problem(L):
    """EI D⁴ u + (w/r) u = −P D² u by finite differences, u = u″ = 0 at the ends; the mode besides."""
    rod, n = DawsonPaslay(EI=2, w=3, r=0.1, L=L), 300
    D2 = (np.diag(2 * np.ones(n - 1)) - np.diag(np.ones(n - 2), 1) - np.diag(np.ones(n - 2), -1)) * (n / L) ** 2
    P, u = eigh(2 * D2 @ D2 + 30 * np.eye(n - 1), D2, subset_by_index=[0, 0])
    assert_allclose(rod.P, P[0], rtol=2e-3)
    assert rod.infinite_load <= rod.P
    mode = rod.mode(np.linspace(0, L, n + 1)[1:-1])
    assert_allclose(abs(u[:, 0] @ mode) / np.linalg.norm(u[:, 0]) / np.linalg.norm(mode), 1, rtol=1e-9)
    assert all(rod.load(k) >= rod.P for k in range(1, 30))


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: euler_load(EI=1, L=1, ends="glued"), "ends = glued"),
        (lambda: DawsonPaslay(EI=1, w=1, r=1, L=1).load(0), "n = 0"),
    ],
)
def test_parameters_outside_the_formula_are_refused(make, message):
    with pytest.raises(ValueError, match=message):
        make()
