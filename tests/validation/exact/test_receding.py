"""Receding contact: the symbols, the flat bottom under the computed pressure, and the catalogue."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.special import roots_chebyu, roots_legendre

from validation.exact.receding import Receding, _symbols_minus_one

from .transformed_layer import indentation_of_both_faces


@pytest.mark.parametrize(
    ("b", "a", "p0"), [(0, 0.856994, 0.960333), (0.5, 1.007782, 0.789588), (1, 1.402159, 0.523389)]
)
def test_receding_of_the_catalogue_in_any_units(b, a, p0):
    contact = Receding(b=b, H=2.5, P=1e6)
    assert_allclose([contact.a / 2.5, contact.p0 * 2.5 / 1e6], [a, p0], atol=5.1e-7)


@pytest.mark.parametrize("nu", [0.0, 0.3, 0.49])
def test_symbols_are_those_of_the_transformed_equations(nu):
    for omega in (0.2, 0.7, 2.0, 7.0):
        symbols = np.array(_symbols_minus_one(np.array([omega])))[:, 0] + 1
        compliance = 2 * (1 - nu**2) / (3.0 * omega / 2)
        expected = [indentation_of_both_faces(omega / 2, 2.0, 3.0, nu, sign) / compliance for sign in (1, -1)]
        assert_allclose(symbols, expected, rtol=1e-9)


@pytest.mark.parametrize("b", [0, 0.5, 1])
def test_bottom_is_flat_in_contact_and_lifts_off_outside(b):
    """The bottom's slope, averaged with the weight exp(−(s/2ε)²): 0 away from the edge, upwards beyond it."""
    contact, eps = Receding(b=b), 0.02
    s, w = roots_chebyu(400)
    p_dx = w * contact.a * contact.pressure(contact.a * s) / np.sqrt(1 - s**2)
    assert_allclose(p_dx.sum(), 1, rtol=1e-12)
    node, weight = roots_legendre(900)
    k, weight = 160 * (1 + node), 160 * weight
    moment = -2 * np.sin(0.5 * contact.a * np.outer(k, s)) ** 2 @ p_dx  # p̂ − P, accurate for small k
    top = np.sinc(b * k / np.pi) - 1
    symmetric, antisymmetric = (1 + symbol for symbol in _symbols_minus_one(k))
    density = symmetric * (2 + moment + top) + antisymmetric * (moment - top)

    def slope(x):
        return -np.sin(np.outer(x, k)) @ (weight * np.exp(-((eps * k) ** 2)) * density) / np.pi

    scale = np.abs(slope(1.3 * contact.a)).max()
    assert_allclose(slope(contact.a * np.array([0.1, 0.3, 0.5, 0.6])), 0, atol=1e-8 * scale)
    assert np.all(slope(contact.a * np.array([1.1, 1.3, 2.0])) > 0)


@pytest.mark.parametrize("b", [0, 1])
def test_pressure_is_positive_and_converged(b):
    contact = Receding(b=b)
    assert np.all(contact.pressure(contact.a * np.linspace(-0.999, 0.999, 99)) > 0)
    assert np.all(contact.pressure(contact.a * np.array([1, -1.5])) == 0)
    beta, c = contact._collocate(contact.a, 48)
    assert abs(beta) < 1e-9
    assert_allclose(c @ (-1.0) ** np.arange(48), contact.p0, rtol=1e-9)


def test_wide_load_is_carried_below_itself():
    contact = Receding(b=2.5)
    assert_allclose(contact.p0, 1 / 5, rtol=1e-2)
    assert 2.5 < contact.a < 3


@pytest.mark.parametrize(("bad", "message"), [({"b": -0.1}, "b = -0.1"), ({"H": 0}, "H = 0"), ({"P": -1}, "P = -1")])
def test_parameters_outside_the_formula_are_refused(bad, message):
    with pytest.raises(ValueError, match=message):
        Receding(**{"b": 0} | bad)
