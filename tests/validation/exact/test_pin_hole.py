"""Persson's pin: the gap that its pressure leaves, and the fields of plate and pin by finite differences."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.integrate import quad

from validation.exact import pin_hole
from validation.exact.pin_hole import PinHole

from .checks import divergence, gradient

PINS = [PinHole(E=1, nu=0.3, R=1, delta=0.01, eps=eps) for eps in (30, 60)]
PINS += [PinHole(E=3, nu=0.1, R=2, delta=0.02, eps=75)]


def circle(r, points=7):
    angles = np.linspace(0.2, 6.0, points)
    return r * np.column_stack([np.cos(angles), np.sin(angles)])


def stress(pin, field):
    """Hooke's law in plane stress."""

    def sigma(points):
        g = gradient(field, points)
        eps = 0.5 * (g + np.swapaxes(g, 1, 2))
        trace = np.trace(eps, axis1=1, axis2=2)[:, None, None]
        return pin.E / (1 - pin.nu**2) * ((1 - pin.nu) * eps + pin.nu * trace * np.eye(2))

    return sigma


@pytest.mark.parametrize(("eps", "ratio"), [(30, 7.9435397), (60, 1.0672024)])
def test_persson_of_the_catalogue(eps, ratio):
    assert_allclose(PinHole(E=2, nu=0.3, R=3, delta=0.1, eps=eps).ratio, ratio, rtol=5e-8)


@pytest.mark.parametrize("pin", PINS, ids=repr)
def test_contact_is_closed_and_the_rest_is_open(pin):
    """The integral equation g(θ) = 0, which the formulas of ΔR and p were not derived from here."""
    for theta in np.linspace(0.05, 0.97, 6) * pin.angle:
        assert abs(pin.gap(theta)) < 1e-8 * pin.delta
    for theta in np.linspace(1.05, 1.9, 5) * pin.angle:
        assert pin.gap(theta) > 0
    force = quad(lambda t: pin.pressure(t) * np.cos(t) * pin.R, -pin.angle, pin.angle, epsabs=0, epsrel=1e-9)[0]
    assert_allclose(force, pin.Q, rtol=1e-7)
    assert pin.p0 == max(pin.pressure(np.linspace(-1, 1, 41) * pin.angle))


@pytest.mark.parametrize("pin", PINS, ids=repr)
def test_fields_satisfy_elasticity_and_carry_the_force(pin):
    """div σ = 0, and the resultant of the tractions on circles in the plate and in the pin is Q along x."""
    angles = 2 * np.pi * (np.arange(120) + 0.5) / 120
    normals = np.column_stack([np.cos(angles), np.sin(angles)])
    for field, r in ((pin.displacement_plate, 1.6 * pin.R), (pin.displacement_pin, 0.5 * pin.R)):
        sigma = stress(pin, field)
        scale = np.abs(sigma(circle(r))).max()
        assert np.abs(divergence(sigma, circle(r))).max() < 1e-7 * scale / pin.R
        force = np.einsum("pij,pj->i", sigma(r * normals), normals) * 2 * np.pi * r / 120
        assert_allclose(force, [-pin.Q, 0], atol=1e-8 * pin.Q)


def test_fields_meet_on_the_circle(monkeypatch):
    """At r = R: u_r of the plate less that of the pin is the gap, tractions are −p and no shear, as the series ends."""
    monkeypatch.setattr(pin_hole, "TERMS", 1500)
    pin = PinHole(E=1, nu=0.3, R=1, delta=0.01, eps=60)
    theta = np.array([0.1, 0.5, 0.9, 1.3, 2.0, 3.0])
    normals = np.column_stack([np.cos(theta), np.sin(theta)])
    apart = np.sum((pin.displacement_plate(normals) - pin.displacement_pin(normals)) * normals, axis=1)
    gap = np.array([pin.gap(t) for t in theta])
    assert_allclose(apart + pin.delta * (1 - np.cos(theta)), gap, atol=1e-5 * pin.delta)
    for field, r in ((pin.displacement_plate, 1.01), (pin.displacement_pin, 0.99)):
        t = np.einsum("pij,pj->pi", stress(pin, field)(r * normals), normals)
        assert_allclose(np.sum(t * normals, axis=1), -pin.pressure(theta), atol=0.03 * pin.p0)
        assert np.abs(t[:, 1] * normals[:, 0] - t[:, 0] * normals[:, 1]).max() < 0.03 * pin.p0


def test_parameters_outside_the_formula_are_refused():
    with pytest.raises(ValueError, match="eps = 88: must be below"):
        PinHole(E=1, nu=0.3, R=1, delta=0.01, eps=88)
    with pytest.raises(ValueError, match=r"delta = 0"):
        PinHole(E=1, nu=0.3, R=1, delta=0.0, eps=30)
