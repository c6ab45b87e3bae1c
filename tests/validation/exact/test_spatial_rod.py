"""The rod in space against shooting with rotation matrices, convergence in the tolerance, and the planar elastica."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.integrate import solve_ivp
from scipy.optimize import root

from validation.exact.elastica import CantileverElastica
from validation.exact.spatial_rod import ArcRod


def shoot(rod):
    """Tip by DOP853 on (x, Q, m) from the clamp, its moment unknown, the force raised in four steps."""
    Q0 = np.array([[0.0, 1, 0], [1, 0, 0], [0, 0, -1]])
    give = np.array([1 / rod.EA, 1 / rod.GA, 1 / rod.GA])

    def end(m0, F):
        def rhs(s, y):
            Q, m = y[3:12].reshape(3, 3), y[12:]
            slope = Q @ (np.array([1, 0, 0]) + give * (Q.T @ F))
            k = Q.T @ m / np.array([rod.GJ, rod.EI, rod.EI]) + [0, 0, 1 / rod.R]
            hat = np.array([[0, -k[2], k[1]], [k[2], 0, -k[0]], [-k[1], k[0], 0]])
            return np.concatenate([slope, (Q @ hat).ravel(), -np.cross(slope, F)])

        start = np.concatenate([np.zeros(3), Q0.ravel(), m0])
        return solve_ivp(rhs, (0, rod.L), start, method="DOP853", rtol=1e-10, atol=1e-10).y[:, -1]

    m0, scale = np.zeros(3), rod.EI / rod.L
    for part in (0.25, 0.5, 0.75, 1):
        F = part * np.array([rod.Fx, rod.Fy, rod.Fz])
        result = root(lambda z, F=F: end(z * scale, F)[12:] / scale, m0 / scale, tol=1e-10)
        m0 = result.x * scale
    assert np.abs(result.fun).max() < 1e-8
    return end(m0, F)[:3], m0


@pytest.mark.parametrize(
    "rod",
    [
        ArcRod.bathe_bolourchi(P=600),
        ArcRod(EI=2, GJ=1.5, R=1, angle=1.2, Fx=1.0, Fy=-0.7, Fz=1.1),
    ],
)
def test_tip_and_moment_by_shooting(rod):
    tip, moment = shoot(rod)
    assert_allclose(rod.tip, tip, rtol=1e-7)
    assert_allclose(rod.clamp_moment, moment, atol=1e-7 * np.abs(moment).max())
    assert_allclose(np.cross(rod.tip, [rod.Fx, rod.Fy, rod.Fz]), moment, atol=1e-7 * np.abs(moment).max())
    assert_allclose(rod.tip_frame.T @ rod.tip_frame, np.eye(3), atol=1e-9)


def test_bathe_bolourchi_converges_to_the_published_tips():
    """The tolerance's figures settle; Simo & Vu-Quoc (eight elements) are within .2 % of R."""
    for P, published in ((300, [22.33, 58.84, 40.08]), (600, [15.79, 47.23, 53.37])):
        rod = ArcRod.bathe_bolourchi(P=P)
        tips = [rod.L * rod.solve(tolerance)(np.array([1.0]))[:3, 0] for tolerance in (1e-3, 1e-5, 1e-7)]
        errors = [np.linalg.norm(tip - rod.tip) / rod.L for tip in tips]
        assert errors[0] < 1e-3 and errors[1] < 1e-5 and errors[2] < 1e-7
        assert np.linalg.norm(rod.tip - published) < 0.002 * rod.R


def test_bathe_bolourchi_at_rest():
    rod = ArcRod.bathe_bolourchi(P=0)
    c = np.sqrt(0.5)
    assert_allclose(rod.tip, [100 * (1 - c), 100 * c, 0], atol=1e-7)
    assert_allclose(rod.tip_frame, [[c, c, 0], [c, -c, 0], [0, 0, -1]], atol=1e-9)


def test_straight_rod_is_the_planar_elastica():
    rod = ArcRod(EI=1, GJ=1, R=1e6, angle=1e-6, Fx=1.0)
    x, y = CantileverElastica(EI=1, L=1, P=1).tip
    assert_allclose(rod.tip, [y, x, 0], atol=2e-6)


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: ArcRod(EI=1, GJ=0, R=1, angle=1), "GJ = 0"),
        (lambda: ArcRod(EI=1, GJ=1, R=1, angle=1, EA=-1), "EA = -1"),
        (lambda: ArcRod(EI=1, GJ=1, R=1, angle=1, Fz=np.inf), "Fz = inf"),
    ],
)
def test_parameters_outside_the_formula_are_refused(make, message):
    with pytest.raises(ValueError, match=message):
        make()
