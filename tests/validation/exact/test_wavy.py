"""The wavy half-plane: elasticity, the profile, and the slope of its surface by Hilbert's periodic transform."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.integrate import quad

from validation.exact.wavy import Wavy

from .checks import assert_elastic, on_surface

CATALOGUE = Wavy(E=1, nu=0.3, wavelength=1, amplitude=0.01, a=0.3)  # half of the pair with E₁ = E₂ = 2
BODIES = [CATALOGUE, Wavy(E=3, nu=0.45, wavelength=2.5, amplitude=0.02, a=0.2)]


@pytest.mark.parametrize("body", BODIES, ids=repr)
def test_fields_satisfy_elasticity_in_the_body(body):
    """∇u is u's, σ is Hooke's of ∇u in plane strain, div σ = 0; inside half a period and near its edges."""
    half = body.wavelength / 2
    x, y = np.meshgrid(np.linspace(-0.98 * half, 0.98 * half, 15), half * np.linspace(0.2, 4, 9))
    points = np.column_stack([x.ravel(), y.ravel()])
    assert_elastic(body, points, 1e-13, 1e-7)


@pytest.mark.parametrize("body", BODIES, ids=repr)
def test_surface_sides_and_far_field(body):
    """Pressure on the surface, rollers on the sides, uniaxial compression far away, mean pressure p̄."""
    half = body.wavelength / 2
    x = np.linspace(-0.99 * half, 0.99 * half, 301)
    _, yy, xy = body.stress(on_surface(x)).T
    assert_allclose(-yy, body.pressure(x), atol=1e-13 * body.p0)
    assert np.all(xy == 0)
    y = np.linspace(0, 4 * half, 9)
    for side in (-half, half):
        points = np.column_stack([np.full_like(y, side), y])
        assert_allclose(body.displacement(points)[:, 0], 0, atol=1e-15)
        assert_allclose(body.stress(points)[:, 2], 0, atol=1e-13 * body.p0)
    far = body.stress([[0.3 * half, 9 * body.wavelength]])[0]
    assert_allclose(far, [-body.nu / (1 - body.nu) * body.p_mean, -body.p_mean, 0], atol=1e-13 * body.p_mean)
    assert_allclose(quad(body.pressure, -body.a, body.a)[0], body.p_mean * body.wavelength, rtol=1e-8)
    assert_allclose(body.pressure(0.0), body.p0, rtol=1e-15)


@pytest.mark.parametrize("body", BODIES, ids=repr)
def test_contact_follows_the_waves(body):
    half = body.wavelength / 2
    x = np.linspace(-half, half, 401)
    gap = body.displacement(on_surface(x))[:, 1] + body.amplitude * (1 - np.cos(np.pi * x / half))
    contact = np.abs(x) <= body.a * (1 + 1e-9)
    assert_allclose(gap[contact], 0, atol=1e-15)
    assert np.all(gap[~contact] > 0)
    assert_allclose(gap[[0, -1]], body.valley, rtol=1e-12)


@pytest.mark.parametrize("body", BODIES, ids=repr)
def test_slope_is_the_periodic_transform_of_the_pressure(body):
    """u_y′(x) = −(2/E*λ) ⨍ p(t) cot(π(x−t)/λ) dt, for a point out of contact and, by the waves' slope, within."""
    k = np.pi / body.wavelength

    def transform(x):
        singular = float(body.pressure(x))

        def integrand(t):
            return (body.pressure(t) - singular) / np.tan(k * (x - t))

        regular = sum(
            quad(integrand, *ends, epsabs=1e-13, limit=400)[0] for ends in ((-body.a, x), (x, body.a))
        ) if abs(x) < body.a else quad(integrand, -body.a, body.a, epsabs=1e-13, limit=400)[0]  # fmt: skip
        ends = np.log(abs(np.sin(k * (x + body.a)) / np.sin(k * (x - body.a)))) / k
        return -2 / (body.E_star * body.wavelength) * (regular + singular * ends)

    for x in (0.3 * body.a, 0.7 * body.a, 0.5 * (body.a + body.wavelength / 2)):
        slope = body.displacement_gradient([[x, 0.0]])[0, 1, 0]
        assert_allclose(transform(x), slope, rtol=1e-6)
    assert_allclose(slope_of_waves(body, 0.4 * body.a), transform(0.4 * body.a), rtol=1e-6)


def slope_of_waves(body, x):
    k = 2 * np.pi / body.wavelength
    return -body.amplitude * k * np.sin(k * x)


def test_wavy_of_the_catalogue():
    """E₁ = E₂ = 2: E* = 1/.91, as of one body with E = 1 on a rigid obstacle."""
    found = [CATALOGUE.p_mean, CATALOGUE.p0, CATALOGUE.valley]
    assert_allclose(found, [0.02259559, 0.05585938, 0.002929324], rtol=2e-7)


def test_parameters_outside_the_formula_are_refused():
    with pytest.raises(ValueError, match=r"a = 0.5: must be < wavelength/2"):
        Wavy(E=1, nu=0.3, wavelength=1, amplitude=0.01, a=0.5)
    with pytest.raises(ValueError, match="amplitude = 0"):
        Wavy(E=1, nu=0.3, wavelength=1, amplitude=0.0, a=0.3)
