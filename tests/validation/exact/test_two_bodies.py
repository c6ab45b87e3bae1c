"""Two bodies: the surfaces of both, each from its own field, close the common gap; one pressure on both."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.integrate import quad

from validation.exact.hertz_line import HertzLine
from validation.exact.hertz_point import HertzPoint
from validation.exact.two_bodies import TwoBodies, below

from .checks import gradient, hooke

PAIRS = [
    TwoBodies(E1=1, nu1=0.3, E2=1, nu2=0.3),
    TwoBodies(E1=10, nu1=0.2, E2=1, nu2=0.45),
    TwoBodies(E1=1e6, nu1=0.3, E2=1, nu2=0.3),
]


def on_plane(x, y=0.0):
    return np.column_stack([x, np.full_like(x, y)])


@pytest.mark.parametrize("pair", PAIRS, ids=repr)
def test_contact_modulus_and_shares(pair):
    assert_allclose(1 / pair.E_star, (1 - pair.nu1**2) / pair.E1 + (1 - pair.nu2**2) / pair.E2, rtol=1e-15)
    assert_allclose(sum(pair.shares), 1, rtol=1e-15)


@pytest.mark.parametrize("pair", PAIRS, ids=repr)
@pytest.mark.parametrize("kind", [HertzLine, HertzPoint])
def test_hertz_closes_the_common_parabola(pair, kind):
    """Gap x²/2R − approach + u₁ − u₂ = 0 in contact and > 0 elsewhere; both have p₀ and P by E*, a and R."""
    a, R = 0.3, 1.7
    one, two = (
        kind(E=E, nu=nu, a=a, R=R / share)
        for E, nu, share in zip((pair.E1, pair.E2), (pair.nu1, pair.nu2), pair.shares, strict=True)
    )
    x = np.linspace(0.01, 0.6, 60)
    lower = below(two.displacement)(on_plane(x))
    approach = a**2 / R if kind is HertzPoint else 0.0
    gap = x**2 / (2 * R) - approach + one.displacement(on_plane(x))[:, 1] - lower[:, 1]
    assert_allclose(gap[x <= a], 0, atol=1e-14)
    assert np.all(gap[x > a] > 0)
    assert_allclose(one.pressure(x), two.pressure(x), rtol=1e-12, atol=1e-15 * one.p0)
    assert_allclose([one.P, two.P], np.pi * a**2 * pair.E_star / (4 * R) if kind is HertzLine
                    else 4 * pair.E_star * a**3 / (3 * R), rtol=1e-13)  # fmt: skip
    if kind is HertzLine:
        assert_allclose(quad(two.pressure, -a, a)[0], one.P, rtol=1e-8)


def test_the_body_below_is_the_mirror_image():
    """σ_yy of the field below at (x, −y) is that above at (x, y), the shear its opposite; the force is on y = 0."""
    body = HertzLine(E=2, nu=0.3, a=0.3, R=1)
    x = np.linspace(-0.5, 0.5, 9)
    sigma = hooke(gradient(below(body.displacement), on_plane(x, -0.4)), body.E, body.nu)
    xx, yy, xy = body.stress(on_plane(x, 0.4)).T
    scale = body.p0
    assert_allclose(sigma[:, 1, 1], yy, atol=1e-8 * scale)
    assert_allclose(sigma[:, 0, 0], xx, atol=1e-8 * scale)
    assert_allclose(sigma[:, 0, 1], -xy, atol=1e-8 * scale)


def test_parameters_outside_the_formula_are_refused():
    with pytest.raises(ValueError, match="E2 = 0"):
        TwoBodies(E1=1, nu1=0.3, E2=0, nu2=0.3)
    with pytest.raises(ValueError, match=r"nu1 = 0\.6"):
        TwoBodies(E1=1, nu1=0.6, E2=1, nu2=0.3)
