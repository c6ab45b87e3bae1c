"""Helices: Kirchhoff's equations by finite differences in space, energies, torque about the tube's axis."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.optimize import minimize_scalar

from validation.exact.helices import CoilTube, HelixTube

from .checks import gradient

COIL = {"EI": 1, "GJ": 1 / 1.3, "r": 1, "radius": 1.5, "beta": np.radians(80)}
RODS = [
    HelixTube(EI=1, r=1, beta=np.radians(20)),
    HelixTube(EI=2, r=0.7, beta=0.9, F=5.0),
    CoilTube.from_natural_helix(**COIL),
    CoilTube(EI=2, GJ=3, r=0.4, kappa0=1.5, tau0=0.2),
]


def test_helix_tube_of_the_catalogue():
    rod = HelixTube(EI=1, r=1, beta=np.radians(20))
    assert_allclose([rod.compression, rod.f], [0.2198463, 0.0136838], atol=6e-8)
    assert_allclose(rod.f, np.sin(np.radians(20)) ** 4, rtol=1e-14)


def test_coil_tube_of_the_catalogue():
    coil = CoilTube.from_natural_helix(**COIL)
    assert_allclose(np.degrees(coil.angle), 64.8563, atol=5e-5)
    assert_allclose(coil.f, 0.2217587, atol=5e-8)
    assert_allclose(coil.natural_radius, 1.5, rtol=1e-15)


@pytest.mark.parametrize("rod", RODS)
def test_kirchhoffs_equations(rod):
    """x′ = t, t′ = κN, m′ + t×n = 0, n′ + fN = 0 at points along the rod."""
    xi = np.array([[0.0], [0.4], [1.7]])
    t, N, _ = np.moveaxis(rod.frame(xi[:, 0]), -1, 0)

    def along(field):
        return gradient(lambda p: field(p[:, 0]), xi)[..., 0]

    assert_allclose(along(rod.position), t, atol=1e-10)
    assert_allclose(along(lambda s: rod.frame(s)[..., 0]), rod.kappa * N, atol=1e-10)
    assert_allclose(along(lambda s: rod.frame(s)[..., 2]), -rod.tau * N, atol=1e-10)
    assert_allclose(along(rod.moment_vector), -np.cross(t, rod.force_vector(xi[:, 0])), atol=1e-9)
    assert_allclose(along(rod.force_vector), -rod.f * N, atol=1e-9)
    assert_allclose(rod.force_vector(xi[:, 0])[:, 2], -rod.compression, atol=1e-14)
    assert_allclose(np.hypot(*rod.position(xi[:, 0])[:, :2].T), rod.r, rtol=1e-14)
    turn = rod.position(2 * np.pi * rod.r / np.sin(rod.angle))[0]
    assert_allclose(turn, [rod.r, 0, rod.pitch], atol=1e-13)


def test_formulae_of_the_catalogue():
    helix = HelixTube(EI=2, r=0.7, beta=0.9, F=5.0)
    s, c = np.sin(0.9), np.cos(0.9)
    assert_allclose(helix.f, s**2 / 0.7 * (5 / c - 2 * s**2 / 0.49), rtol=1e-14)
    coil = CoilTube(EI=2, GJ=3, r=0.4, kappa0=1.5, tau0=0.2)
    s, c = np.sin(coil.angle), np.cos(coil.angle)
    f = 2 * (s**2 / 0.4 - 1.5) * s**2 / 0.16 + 3 * (s * c / 0.4 - 0.2) * s * c / 0.16
    assert_allclose(coil.f, f, rtol=1e-13)


@pytest.mark.parametrize("rod", [RODS[0], RODS[2], RODS[3]])
def test_selected_helices_carry_no_torque(rod):
    """(x×n + m)·e_z = 0: the ends may turn about the tube's axis."""
    x, n, m = rod.position(0.3)[0], rod.force_vector(0.3)[0], rod.moment_vector(0.3)[0]
    assert_allclose((np.cross(x, n) + m)[2], 0, atol=1e-13)


def test_helix_force_minimises_its_energy():
    rod, F = RODS[0], RODS[0].compression
    best = minimize_scalar(
        lambda b: 0.5 * np.sin(b) ** 4 + F * np.cos(b), bounds=(0.1, 0.6), method="bounded", options={"xatol": 1e-12}
    )
    assert_allclose(best.x, rod.beta, atol=1e-6)


def test_helix_of_small_angle_is_lubinskis():
    rod = HelixTube(EI=3, r=0.01, beta=1e-3)
    assert_allclose(rod.compression, 8 * np.pi**2 * 3 / rod.pitch**2, rtol=2e-6)


@pytest.mark.parametrize("coil", RODS[2:])
def test_coil_minimises_and_presses_by_its_energy(coil):
    """U has no lower value over β; at the minimum f = −dU/dr (the work of the wall per length and radius)."""
    assert np.all(coil.energy(np.linspace(0, np.pi / 2, 3000)) >= coil.energy(coil.angle) - 1e-15)

    def least(r):
        moved = CoilTube(EI=coil.EI, GJ=coil.GJ, r=r, kappa0=coil.kappa0, tau0=coil.tau0)
        return moved.energy(moved.angle)

    h = 1e-4
    assert_allclose(-(least(coil.r + h) - least(coil.r - h)) / (2 * h), coil.f, rtol=1e-6)


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: HelixTube(EI=1, r=1, beta=2), "beta = 2"),
        (lambda: HelixTube(EI=1, r=1, beta=0.5, F=0.1), r"F = 0\.1: must be >= 0\.2017"),
        (lambda: CoilTube.from_natural_helix(**{**COIL, "r": 2}), "r = 2: must be <= 1.5"),
        (lambda: CoilTube(EI=1, GJ=1, r=1, kappa0=1, tau0=-1), "tau0 = -1"),
    ],
)
def test_parameters_outside_the_formula_are_refused(make, message):
    with pytest.raises(ValueError, match=message):
        make()
