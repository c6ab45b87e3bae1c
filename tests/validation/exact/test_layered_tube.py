"""The two-layer tube: limits of one tube, and the radial boundary-value problem solved by scipy."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.integrate import solve_bvp

from validation.exact.cylinders import Plug
from validation.exact.layered_tube import LayeredTube


def test_equal_layers_are_one_tube():
    """The interface vanishes, wherever it is; the press fit is that of `Plug`."""
    plug = Plug(E=3.0, nu=0.35, b=1.0, c=1.5, delta=0.01)
    for b in (1.1, 1.4):
        wall = LayeredTube(E1=3.0, nu1=0.35, E2=3.0, nu2=0.35, a=1.0, b=b, c=1.5)
        assert wall.press_fit(0.01) == pytest.approx(plug.p, rel=1e-12)
        points = np.array([[1.0, 0.0], [0.3, 1.2], [-1.2, 0.9]])
        assert_allclose(wall.displacement(points, plug.p), plug.displacement(points), rtol=1e-12)


def test_the_limits_of_the_surrounding():
    """Springs without stiffness press with nothing; as k grows u(c) falls as 1/k, to a rigid mould."""
    parameters = {"E1": 2.0, "nu1": 0.45, "E2": 1.0, "nu2": 0.3, "a": 1.0, "b": 1.2, "c": 1.5}
    assert LayeredTube(**parameters, k=0.0).pressures(1.0)[1] == 0
    at_c = [float(LayeredTube(**parameters, k=k).radial(1.5, 1.0)) for k in (1e6, 1e8)]
    assert at_c[1] == pytest.approx(at_c[0] / 100, rel=1e-4)
    with pytest.raises(ValueError, match=r"k = -1\.0: must be >= 0"):
        LayeredTube(**parameters, k=-1.0)


@pytest.mark.parametrize("k", [0.0, 0.7, 40.0])
@pytest.mark.parametrize("nu2", [0.1, 0.49])
def test_the_radial_boundary_value_problem(k, nu2):
    """(r σ_rr)′ = σ_θθ with Hooke's law in both layers, −p inside, −k u outside, u and σ_rr continuous at b."""
    a, b, c, p = 1.0, 1.25, 1.6, 0.3
    E1, nu1, E2 = 4.0, 0.3, 1.5
    wall = LayeredTube(E1=E1, nu1=nu1, E2=E2, nu2=nu2, a=a, b=b, c=c, k=k)

    def moduli(E, nu):
        return E * nu / ((1 + nu) * (1 - 2 * nu)), E / (2 * (1 + nu))

    # Both layers on 0 < t < 1 at once: u and σ_rr of the inner one, then of the outer one.
    def layer(u, sigma, r, width, E, nu):
        lam, G = moduli(E, nu)
        slope = (sigma - lam * u / r) / (lam + 2 * G)
        hoop = lam * slope + (lam + 2 * G) * u / r
        return width * slope, width * (hoop - sigma) / r

    def rates(t, y):
        inner = layer(y[0], y[1], a + (b - a) * t, b - a, E1, nu1)
        outer = layer(y[2], y[3], b + (c - b) * t, c - b, E2, nu2)
        return np.vstack([*inner, *outer])

    def ends(y0, y1):
        return np.array([y0[1] + p, y1[0] - y0[2], y1[1] - y0[3], y1[3] + k * y1[2]])

    t = np.linspace(0, 1, 21)
    solved = solve_bvp(rates, ends, t, np.zeros((4, 21)), tol=1e-10)
    assert solved.success
    y = solved.sol(t)
    assert_allclose(wall.radial(a + (b - a) * t, p), y[0], rtol=1e-8)
    assert_allclose(wall.radial(b + (c - b) * t[1:], p), y[2, 1:], rtol=1e-8)
    q, s = wall.pressures(p)
    assert_allclose([q, s], [-y[3, 0], -y[3, -1]], rtol=1e-7, atol=1e-10)
