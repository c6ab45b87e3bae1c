"""The layer's symbol, the indentation of the computed pressure, the limits, and the catalogue."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.special import roots_chebyu, roots_legendre

from validation.exact.hertz_line import HertzLine
from validation.exact.layer import Layer, _symbol_minus_one

from .transformed_layer import indentation_on_base

BASES = ["frictionless", "bonded"]


def catalogue(base):
    return Layer(E=1 - 0.3**2, nu=0.3, R=1, H=1, a=0.5, base=base)


def smoothed_displacement(layer, x, eps):
    """u(x) averaged with the weight exp(−(s/2ε)²), from p alone: (1/π) ∫ û cos kx e^{−(εk)²} dk with û = 2Lp̂/E*k."""
    s, w = roots_chebyu(400)
    node, weight = roots_legendre(700)
    k_max = 6.5 / eps
    k, weight = 0.5 * k_max * (1 + node), 0.5 * k_max * weight
    p_hat = np.cos(layer.a * np.outer(k, s)) @ (w * layer.a * layer.pressure(layer.a * s) / np.sqrt(1 - s**2))
    L = 1 + _symbol_minus_one(k * layer.H, layer.base, layer.nu)
    density = weight * np.exp(-((eps * k) ** 2)) * 2 * L * p_hat / (layer.E_star * k)
    return np.cos(np.outer(x, k)) @ density / np.pi


@pytest.mark.parametrize(("base", "P", "p0", "delta"), [
    ("frictionless", 0.2204177, 0.2815118, 0.2200777),
    ("bonded", 0.2289700, 0.2930436, 0.2049802),
])  # fmt: skip
def test_layer_of_the_catalogue(base, P, p0, delta):
    layer = catalogue(base)
    assert_allclose([layer.P, layer.p0, layer.delta], [P, p0, delta], atol=5.1e-8)


@pytest.mark.parametrize("base", BASES)
@pytest.mark.parametrize("nu", [0.0, 0.3, 0.49])
def test_symbol_is_that_of_the_transformed_equations(base, nu):
    for omega in (0.05, 0.7, 2.0, 5.0):
        L = indentation_on_base(omega / 2, 2.0, 3.0, nu, base) * 3 / (1 - nu**2) * (omega / 2) / 2
        assert_allclose(1 + _symbol_minus_one(np.array([omega]), base, nu)[0], L, rtol=1e-9)


@pytest.mark.parametrize("base", BASES)
@pytest.mark.parametrize(("a", "nu"), [(0.5, 0.3), (2.0, 0.3), (1.0, 0.5)])
def test_pressure_presses_the_parabola(base, a, nu):
    """The average of δ − x²/2R is itself less ε²/R, as long as the edge is many ε away."""
    layer, eps = Layer(E=2, nu=nu, R=3, H=1.3, a=a, base=base), 0.02 * a
    x = a * np.array([0, 0.2, 0.5, 0.7])
    assert_allclose(smoothed_displacement(layer, x, eps), layer.delta - (x**2 + 2 * eps**2) / 6, atol=1e-9 * a**2)
    assert np.all(layer.pressure(a * np.linspace(-0.999, 0.999, 99)) > 0)
    assert np.all(layer.pressure(a * np.array([-1, 1, 1.5, -7])) == 0)


def test_force_is_the_sum_of_the_pressure():
    layer = catalogue("bonded")
    s, w = roots_chebyu(50)
    assert_allclose(w @ (layer.pressure(0.5 * s) / np.sqrt(1 - s**2)) * 0.5, layer.P, rtol=1e-13)


@pytest.mark.parametrize("base", BASES)
def test_expansion_is_converged(base):
    layer = Layer(E=1, nu=0.3, R=1, H=1, a=3, base=base)
    fine = layer._collocate(64)
    assert_allclose([layer.P, layer.delta], [1.5 * np.pi * fine.c[0], fine.delta], rtol=1e-9)


@pytest.mark.parametrize("base", BASES)
def test_thick_layer_is_a_half_space(base):
    """P → πa²E*/4R with an error of order (a/H)²."""
    hertz = HertzLine(E=2, nu=0.3, a=0.3, R=1)
    error = [Layer(E=2, nu=0.3, R=1, H=H, a=0.3, base=base).P / hertz.P - 1 for H in (10, 20, 40)]
    assert abs(error[2]) < 1e-4
    assert_allclose(np.array(error[:-1]) / error[1:], 4, rtol=2e-2)
    layer = Layer(E=2, nu=0.3, R=1, H=300, a=0.3, base=base)
    x = np.linspace(0, 0.3, 9)
    assert_allclose(layer.pressure(x), hertz.pressure(x), atol=1e-6 * hertz.p0)


@pytest.mark.parametrize("base", BASES)
def test_thin_layer_is_a_winkler_foundation(base):
    """P → ⅔Ma³/RH, M = E* or the bonded layer's E(1−ν)/((1+ν)(1−2ν)); the edges contribute at the order H/a."""
    nu = 0.3
    M = 1 / (1 - nu**2) if base == "frictionless" else (1 - nu) / ((1 + nu) * (1 - 2 * nu))
    error = [Layer(E=1, nu=nu, R=1, H=1, a=a, base=base).P * 3 / (2 * M * a**3) - 1 for a in (5.0, 10.0)]
    assert abs(error[1]) < 0.1
    assert_allclose(error[0] / error[1], 2, rtol=0.15)


@pytest.mark.parametrize("base", BASES)
@pytest.mark.parametrize("delta", [0.01, 0.2200777, 1.5])
def test_approach_determines_the_contact(base, delta):
    layer = Layer.from_delta(E=1, nu=0.4, R=2, H=1.5, delta=delta, base=base)
    assert_allclose(layer.delta, delta, rtol=1e-11)


def test_units_scale_exactly():
    one, other = (Layer(E=E, nu=0.3, R=2 * m, H=m, a=0.5 * m, base="bonded") for E, m in ((1.0, 1.0), (1e6, 1e-3)))
    assert_allclose(other.P, one.P * 1e6 * 1e-3, rtol=1e-13)
    assert_allclose(other.delta, one.delta * 1e-3, rtol=1e-13)


@pytest.mark.parametrize(
    ("bad", "message"),
    [
        ({"H": 0.0}, "H = 0.0"),
        ({"base": "glued"}, "base = 'glued': must be 'frictionless' or 'bonded'"),
        ({"a": -1.0}, "a = -1.0"),
    ],
)
def test_parameters_outside_the_formula_are_refused(bad, message):
    with pytest.raises(ValueError, match=message):
        Layer(**{"E": 1.0, "nu": 0.3, "R": 1.0, "H": 1.0, "a": 0.5, "base": "bonded"} | bad)


def test_contact_too_wide_for_the_expansion_raises(monkeypatch):
    monkeypatch.setattr("validation.exact.layer.LARGEST_EXPANSION", 16)
    with pytest.raises(RuntimeError, match="a/H = 20"):
        _ = Layer(E=1, nu=0.3, R=1, H=1, a=20, base="bonded").P
