"""Beams against flat walls: scipy's boundary-value solver with unknown free boundary, finite differences, limits."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.integrate import solve_bvp

from validation.exact.rods import BeamStop, CantileverFloor, HeavyBeam, WireTube

from .checks import fourth, second


def free_span(load, start, end, guess):
    """(w, w′, w″, w‴) at both ends of w⁗ = load over the unknown length s, two conditions at 0 and three at s."""

    def rhs(x, y, p):
        return p[0] * np.vstack([y[1], y[2], y[3], load + 0 * x])

    def ends(a, b, p):
        return np.array([*start(a), *end(b)])

    x = np.linspace(0, 1, 11)
    result = solve_bvp(rhs, ends, x, np.vstack([0.5 * x, 0.5 + 0 * x, 0 * x, 0 * x]) * 1e-3, p=[guess], tol=1e-10)
    assert result.success
    return result.p[0], result.y[:, 0], result.y[:, -1]


def test_cantilever_floor_of_the_catalogue():
    beam = CantileverFloor(EI=1, L=1, q=1, d=1e-3)
    assert beam.regime == "line"
    assert_allclose([beam.s, beam.reaction, beam.force], [0.5180040, 0.1726680, 0.6546640], atol=5e-8)


def test_cantilever_floor_by_its_free_boundary():
    beam = CantileverFloor(EI=2, L=3, q=5, d=0.01)
    s, clamp, edge = free_span(5 / 2, lambda a: (a[0], a[1]), lambda b: (b[0] - 0.01, b[1], b[2]), guess=0.8 * beam.s)
    assert_allclose(beam.s, s, rtol=1e-8)
    # EI w‴ jumps by the force that the floor applies, and vanishes on the flat part.
    assert_allclose([beam.reaction, beam.clamp_force], [2 * edge[3], -2 * clamp[3]], rtol=1e-7)
    assert_allclose(beam.clamp_moment, 2 * clamp[2], rtol=1e-7)
    assert_allclose(beam.force + beam.clamp_force, 5 * 3, rtol=1e-14)


@pytest.mark.parametrize("load", [5.0, 30.0, 100.0])
def test_cantilever_floor_deflection(load):
    """EI w⁗ = q on the free span, w <= d, and the end conditions of each regime."""
    beam = CantileverFloor(EI=2, L=1.5, q=load * 2 * 0.01 / 1.5**4, d=0.01)
    assert beam.regime == {5.0: "free", 30.0: "point", 100.0: "line"}[load]
    w, s, h = beam.deflection, beam.s, 0.01
    x = np.linspace(0.05, s - 0.05, 9)
    assert_allclose(2 * fourth(w, x, h), beam.q, rtol=1e-5)
    assert np.all(w(np.linspace(0, 1.5, 200)) <= 0.01 * (1 + 1e-14))
    assert_allclose(w(np.array([0.0, 1e-6])), 0, atol=1e-12)
    if load != 5:
        assert_allclose(w(np.array([s, 1.5])), 0.01, rtol=1e-14)
    shear = 2 * (w(s) - 3 * w(s - h) + 3 * w(s - 2 * h) - w(s - 3 * h)) / h**3 + 1.5 * h * beam.q
    assert_allclose(shear, beam.reaction, atol=1e-6 * beam.q)


def test_cantilever_floor_regimes_meet():
    for load in (8, 72):
        below, above = (CantileverFloor(EI=1, L=1, q=load * (1 + e), d=1) for e in (-1e-9, 1e-9))
        assert below.regime != above.regime
        assert_allclose([above.reaction, above.force, above.s], [below.reaction, below.force, below.s], atol=1e-6)


def test_heavy_beam_by_its_free_boundary():
    beam = HeavyBeam(EI=2, L=3, q=5, H=0.01)
    s, lifted, edge = free_span(-5 / 2, lambda a: (a[0] - 0.01, a[2]), lambda b: (b[0], b[1], b[2]), guess=0.8 * beam.s)
    assert_allclose(beam.s, s, rtol=1e-8)
    assert_allclose([beam.lift_force, beam.lift_force], [2 * lifted[3], -2 * edge[3]], rtol=1e-7)
    assert_allclose(beam.lift_force + beam.force, 5 * 3, rtol=1e-14)
    # Moments about the lifted end: the floor's qs/2 at s and q from s to L against the weight.
    assert_allclose(beam.lift_force * s + 5 * (9 - s**2) / 2, 5 * 9 / 2, rtol=1e-7)
    x = np.linspace(0.05, beam.s - 0.05, 9)
    assert_allclose(2 * fourth(beam.height, x, 0.01), -5, rtol=1e-5)
    assert_allclose(beam.height([0, beam.s, 3]), [0.01, 0, 0], rtol=1e-14)


def test_beam_stop_by_its_free_boundary():
    beam = BeamStop(EI=2, L=3, q=5, d=0.01)
    s, support, edge = free_span(5 / 2, lambda a: (a[0], a[2]), lambda b: (b[0] - 0.01, b[1], b[2]), guess=0.8 * beam.s)
    assert beam.regime == "line"
    assert_allclose(beam.s, s, rtol=1e-8)
    assert_allclose([beam.reaction, beam.support_force], [2 * edge[3], -2 * support[3]], rtol=1e-7)
    assert_allclose(beam.force + 2 * beam.support_force, 15, rtol=1e-14)


@pytest.mark.parametrize("load", [50.0, 200.0, 500.0])
def test_beam_stop_deflection(load):
    beam = BeamStop(EI=2, L=1.5, q=load * 2 * 0.01 / 1.5**4, d=0.01)
    assert beam.regime == {50.0: "free", 200.0: "point", 500.0: "line"}[load]
    w, h = beam.deflection, 0.01
    x = np.linspace(0.05, beam.s - 0.05, 9)
    assert_allclose(2 * fourth(w, x, h), beam.q, rtol=1e-5)
    assert_allclose(w(1.5 - x), w(x), rtol=1e-13)
    assert_allclose(w(0), 0, atol=1e-16)
    assert np.all(w(np.linspace(0, 1.5, 200)) <= 0.01 * (1 + 1e-13))
    if load != 50:
        assert_allclose(w(np.array([beam.s, 0.75])), 0.01, rtol=1e-12)
        assert_allclose((w(beam.s) - w(beam.s - 1e-5)) / 1e-5, 0, atol=2e-6)
    half_shear = 2 * (w(beam.s) - 3 * w(beam.s - h) + 3 * w(beam.s - 2 * h) - w(beam.s - 3 * h)) / h**3
    half_shear += 1.5 * h * beam.q
    assert_allclose(half_shear, beam.reaction / (1 if load == 500 else 2), atol=1e-6 * beam.q)


def test_beam_stop_regimes_meet():
    for load in (76.8, 384):
        below, above = (BeamStop(EI=1, L=1, q=load * (1 + e), d=1) for e in (-1e-9, 1e-9))
        assert below.regime != above.regime
        assert_allclose([above.force, above.s], [below.force, below.s], atol=1e-6)


def test_wire_tube_of_the_catalogue():
    wire = WireTube(EI=1, L=1, R=1, c=1e-3)
    assert_allclose([wire.s, wire.tip_force], [0.1095445, 9.128709], atol=5e-7)
    assert wire.regime == "line"


@pytest.mark.parametrize(("L", "regime"), [(0.15, "point"), (0.21, "point"), (0.3, "line")])
def test_wire_tube_shape(L, regime):
    """(v″ + 1/R)″ = 0 off the contacts; |v| <= c with the contacts at ±c; no moment at the tips; EI v‴ = −T."""
    wire = WireTube(EI=2, L=L, R=1, c=1e-3)
    assert wire.regime == regime
    v, h, tip = wire.offset, 1e-3, L / 2
    x = tip - wire.s + np.linspace(0.2, 0.8, 7) * wire.s
    assert_allclose(fourth(v, x, h), 0, atol=1e-2)
    assert np.all(np.abs(v(np.linspace(-tip, tip, 400))) <= 1e-3 * (1 + 1e-12))
    assert_allclose(v([0, tip - wire.s, tip, -tip]), [1e-3, 1e-3, -1e-3, -1e-3], rtol=1e-12)
    moment = 2 * (second(v, x, h) + 1)
    assert_allclose(moment, wire.tip_force * (tip - x), rtol=1e-6)
    assert_allclose(wire.force, 4 * wire.tip_force)


def test_wire_tube_regimes_meet():
    for limit in (16, 48):
        below, above = (WireTube(EI=1, L=np.sqrt(limit * 1e-3) * (1 + e), R=1, c=1e-3) for e in (-1e-9, 1e-9))
        assert below.regime != above.regime
        assert_allclose(above.tip_force, below.tip_force, atol=1e-5)
    with pytest.raises(ValueError, match=r"L = 0\.1: must be > 0\.126491"):
        WireTube(EI=1, L=0.1, R=1, c=1e-3).offset(0)


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: CantileverFloor(EI=0, L=1, q=1, d=1), "EI = 0: must be > 0"),
        (lambda: HeavyBeam(EI=1, L=0.5, q=1, H=0.01), r"L = 0\.5: must be >= s = 0\.699927"),
        (lambda: BeamStop(EI=1, L=1, q=1, d=-1), "d = -1"),
    ],
)
def test_parameters_outside_the_formula_are_refused(make, message):
    with pytest.raises(ValueError, match=message):
        make()
