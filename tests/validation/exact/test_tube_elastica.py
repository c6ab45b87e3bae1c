"""Shooting against elliptic integrals, against the least bending energy of a chain, and against the linear wire."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.integrate import solve_ivp
from scipy.optimize import minimize, root

from validation.exact.elastica import swing
from validation.exact.rods import WireTube
from validation.exact.tube_elastica import ArcTubeElastica, WireTubeElastica


def test_wire_tube_of_the_catalogue():
    for L, c, force in ((0.5, 0.01, 2.222957), (0.2, 1e-3, 9.027276)):
        wire = WireTubeElastica(EI=1, R=1, L=L, c=c)
        assert wire.regime == "point"
        assert_allclose(wire.tip_force, force, atol=6e-7)


@pytest.mark.parametrize(("L", "c"), [(0.5, 0.01), (0.65, 0.01), (0.2, 1e-3), (1.6, 0.1)])
def test_wire_tube_by_elliptic_integrals(L, c):
    """In the frame of the tip's radius: (R+c−C, −S) is the middle, at (R−c)(sin β, −cos β)."""
    wire = WireTubeElastica(EI=1, R=1, L=L, c=c)

    def residual(z):
        beta, rise = z
        arc = swing(beta, rise)
        scale = 0.5 * L / arc.length
        return [1 + c - scale * arc.cosine - (1 - c) * np.sin(beta), scale * arc.sine - (1 - c) * np.cos(beta)]

    beta, rise = root(residual, [np.pi / 2 - 0.5 * L, 0.3 * L], tol=1e-14).x
    assert np.abs(residual([beta, rise])).max() < 1e-12
    assert_allclose(wire.tip_force, (swing(beta, rise).length / (0.5 * L)) ** 2, rtol=1e-8)
    assert_allclose(wire.tip_polar_angle, np.pi / 2 - beta, rtol=1e-9)
    assert_allclose(wire.inner_force, 2 * wire.tip_force * np.cos(wire.tip_polar_angle), rtol=1e-10)


@pytest.mark.parametrize(("L", "c", "regime"), [(0.5, 0.01, "point"), (0.9, 0.002, "line")])
def test_wire_tube_by_the_energy_of_a_chain(L, c, regime):
    """The least ½Σκ²h of a chain of half the wire between the walls; the tip's force by dE/dc, its error O(h²)."""
    wire = WireTubeElastica(EI=1, R=1, L=L, c=c)
    assert wire.regime == regime

    def energy(c, n):
        h = 0.5 * L / n

        def places(z):
            x = np.cumsum(h * np.cos(z[1:]))
            y = z[0] + np.cumsum(h * np.sin(z[1:]))
            return np.concatenate([[0], x]), np.concatenate([z[:1], y])

        def bending(z):
            kinks = np.concatenate([[2 * z[1]], np.diff(z[1:])])
            weight = np.concatenate([[0.5], np.ones(n - 1)])
            return weight @ kinks**2 / h

        def walls(z):
            r2 = np.hypot.reduce(places(z)) ** 2
            return np.concatenate([r2 - (1 - c) ** 2, (1 + c) ** 2 - r2]) / c

        def wall_slopes(z):
            x, y = places(z)
            after = np.tri(n + 1, n, -1)
            slope = 2 * h * (-x[:, None] * np.sin(z[1:]) + y[:, None] * np.cos(z[1:])) * after
            slope = np.column_stack([2 * y, slope]) / c
            return np.concatenate([slope, -slope])

        def bending_slope(z):
            kinks = np.concatenate([[2 * z[1]], np.diff(z[1:])])
            g = np.zeros(n + 1)
            g[1:] += 2 * kinks / h
            g[1:-1] -= 2 * kinks[1:] / h
            return g

        start = np.concatenate([[c - 1], 0.95 * (np.arange(n) + 0.5) * h])
        constraints = {"type": "ineq", "fun": walls, "jac": wall_slopes}
        options = {"maxiter": 500, "ftol": 1e-11}
        result = minimize(bending, start, jac=bending_slope, constraints=constraints, method="SLSQP", options=options)
        assert result.success, result.message
        return result.fun, result.x, places(result.x)

    step = 0.02 * c
    n = 40
    slope = (energy(c + step, n)[0] - energy(c - step, n)[0]) / (2 * step)
    # Both walls move by dc: the outer's tips and the inner's contacts do work on both halves.
    assert_allclose(-slope, wire.force, rtol=4e-3)
    _, z, (_, y) = energy(c, n)
    assert_allclose(-y[0] - (1 - c), wire.bow, atol=0.05 * c)
    assert_allclose(z[1] / (0.25 * L / n), wire.middle_curvature, rtol=5e-3)


@pytest.mark.parametrize(("L", "c"), [(0.9, 0.002), (0.4, 1e-3), (1.0, 0.01)])
def test_two_inner_contacts_balance_and_stay_between_the_walls(L, c):
    """Forces of the half wire balance with the middle's compression; the shape stays between the walls."""
    wire = WireTubeElastica(EI=1, R=1, L=L, c=c)
    assert wire.regime == "line" and 0 < wire.bow < 2 * c
    shot = wire._shot
    eta, at = wire.tip_polar_angle, shot.contact.theta
    assert_allclose(wire.inner_force * np.cos(at), wire.tip_force * np.cos(eta), rtol=1e-9)
    compression = wire.tip_force * np.sin(eta) - wire.inner_force * np.sin(at)
    assert compression > 0
    for start, length, force in (
        (shot.middle, L / 2 - wire.s, (-compression, 0)),
        (shot.contact, wire.s, wire.tip_force * np.array([-np.sin(eta), np.cos(eta)])),
    ):
        s = np.linspace(0, length, 200)
        rhs = lambda _, y, f=force: [np.cos(y[2]), np.sin(y[2]), y[3], f[0] * np.sin(y[2]) - f[1] * np.cos(y[2])]  # noqa: E731
        path = solve_ivp(rhs, (0, length), start, t_eval=s, rtol=1e-11, atol=1e-13).y
        r = np.hypot(path[0], path[1])
        assert np.all(r >= 1 - c - 1e-9) and np.all(r <= 1 + c + 1e-9)
    assert_allclose(r[[0, -1]], [1 - c, 1 + c], rtol=1e-9)
    assert_allclose(path[3, -1], 0, atol=1e-8)


def test_wire_tube_regimes_meet():
    wire = WireTubeElastica(EI=1, R=2, L=1.0, c=0.02)
    limit = wire.line_contact_length
    below, above = (WireTubeElastica(EI=1, R=2, L=limit * (1 + e), c=0.02) for e in (-1e-4, 1e-3))
    assert (below.regime, above.regime) == ("point", "line")
    assert_allclose(below.middle_curvature, 1 / 1.98, rtol=1e-3)
    assert_allclose([above.tip_force, above.force], [below.tip_force, below.force], rtol=5e-3)
    free = WireTubeElastica(EI=1, R=2, L=0.79, c=0.02)
    assert (free.regime, free.force) == ("free", 0)
    with pytest.raises(ValueError, match=r"L = 0\.79: must be > 0\.8"):
        _ = free.tip_polar_angle


@pytest.mark.parametrize("multiple", [5.0, 10.0])
@pytest.mark.parametrize("make", [WireTubeElastica, ArcTubeElastica])
def test_elasticas_tend_to_the_linear_wire(make, multiple):
    """L = multiple √(cR): the difference falls as c/R."""
    errors = []
    for c in (4e-3, 2e-3, 1e-3):
        L = multiple * np.sqrt(c)
        exact = make(EI=1, L=L, c=c, **({"R": 1} if make is WireTubeElastica else {"kappa0": 1}))
        linear = WireTube(EI=1, L=L, R=1, c=c)
        assert exact.regime == linear.regime
        errors.append([exact.tip_force / linear.tip_force - 1, exact.force / linear.force - 1])
    assert_allclose(np.log2(np.abs(np.divide(errors[:-1], errors[1:]))), 1, atol=0.1)


@pytest.mark.parametrize(("L", "c"), [(0.5, 0.01), (0.6, 0.01), (1.5, 0.01), (2.0, 0.1)])
def test_arc_tube_by_its_first_integral(L, c):
    """EI θ′²/2 + T sin θ is constant, θ′ = κ₀ at the tip; the height 2c and the length by quadrature over θ."""
    arc = ArcTubeElastica(EI=1, L=L, kappa0=1, c=c)
    T, k = arc.tip_force, arc.middle_curvature
    top = np.arcsin((k**2 - 1) / (2 * T)) if T else 0.0
    # θ = top (1 − τ²): the integrand is regular although θ′ may vanish at the start in line contact.
    assert top < 0
    node, weight = np.polynomial.legendre.leggauss(200)
    tau, weight = 0.5 * (1 + node), 0.5 * weight
    theta = top * tau**2
    speed = np.sqrt(k**2 - 2 * T * np.sin(theta))
    ds = np.abs(top) * 2 * tau * weight / speed
    assert_allclose([ds.sum(), abs(ds @ np.sin(theta))], [arc.s, 2 * c], rtol=1e-8)


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: WireTubeElastica(EI=1, R=1, L=1, c=1), "c = 1: must be <= R/10"),
        (lambda: WireTubeElastica(EI=1, R=1, L=2.5, c=1e-3), r"L = 2\.5: must be shorter, the middle bows"),
        (lambda: ArcTubeElastica(EI=1, kappa0=1, L=3, c=0.3), r"c = 0\.3: must be < 1/\(4 kappa0\)"),
        (lambda: ArcTubeElastica(EI=1, kappa0=0, L=3, c=0.3), "kappa0 = 0"),
    ],
)
def test_parameters_outside_the_formula_are_refused(make, message):
    with pytest.raises(ValueError, match=message):
        make()
