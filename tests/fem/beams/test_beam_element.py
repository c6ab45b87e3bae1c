"""The beam element: exact derivatives, objectivity, the textbook matrix, and beams with known answers."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from beam_examples import moved, random_chain, scatter, solve
from scipy.integrate import solve_bvp
from scipy.optimize import brentq

from fem.beams.beam_element import BeamData, beam_data, coefficients, energy, forces, stiffness, strains, tangent
from fem.beams.beam_sections import Section, Stiffness
from fem.rotations import exp
from meshes.centrelines import arc, helix, join, straight

ANGLES = [1e-6, 0.1, 0.49, 0.51, 1.5, 2.8]
CLAMPED = np.arange(6)


def derivative(function, unknowns):
    """Central differences with one step of Richardson's extrapolation, (..., unknowns)."""
    columns = []
    for i in range(unknowns):
        d = np.zeros(unknowns)
        d[i] = 1.0
        coarse, fine = ((function(h * d) - function(-h * d)) / (2 * h) for h in (1e-3, 5e-4))
        columns.append((4 * fine - coarse) / 3)
    return np.stack(columns, axis=-1)


@pytest.mark.parametrize("angle", ANGLES)
def test_forces_are_the_gradient_of_the_energy(angle):
    edges, R, data = random_chain(1, angle)
    fd = derivative(lambda d: energy(*moved(edges, R, d.reshape(2, 6)), data)[0], 12)
    np.testing.assert_allclose(forces(edges, R, data)[0], fd, atol=1e-10 * np.abs(fd).max())


@pytest.mark.parametrize("angle", ANGLES)
def test_tangent_is_the_derivative_of_the_forces(angle):
    """So is the matrix the solver gets, but for a skew part that is a moment's: [f_θ]^/2."""
    edges, R, data = random_chain(1, angle, seed=1)
    fd = derivative(lambda d: forces(*moved(edges, R, d.reshape(2, 6)), data)[0], 12)
    K = tangent(edges, R, data)[0]
    np.testing.assert_allclose(K, fd, atol=1e-10 * np.abs(fd).max())
    S = stiffness(edges, R, data)[0]
    skew = K - S
    f = forces(edges, R, data)[0]
    for node in (3, 9):
        turn = skew[node : node + 3, node : node + 3]
        np.testing.assert_allclose([turn[2, 1], turn[0, 2], turn[1, 0]], f[node : node + 3] * turn[2, 1] / f[node])
        skew[node : node + 3, node : node + 3] = 0
    np.testing.assert_allclose(skew, 0, atol=1e-12 * np.abs(K).max())


def test_functions_of_the_angle_agree_where_series_end():
    """Series and closed forms meet at θ² = ¼, and both are right at 1 and at small angles."""
    below, above = (np.array(coefficients(np.array([t]))) for t in (0.25 * (1 - 1e-15), 0.25 * (1 + 1e-15)))
    np.testing.assert_allclose(below, above, rtol=2e-11)
    np.testing.assert_allclose(below[:4], above[:4], rtol=1e-13)
    t, h = np.array([0.04, 0.2, 1.0, 4.0]), 1e-3
    s, r, q, ds, dr, dq = coefficients(t)
    theta = np.sqrt(t)
    np.testing.assert_allclose(s, theta / 2 / np.sin(theta / 2), rtol=1e-14)
    np.testing.assert_allclose(q, np.tan(theta / 4) / (2 * theta), rtol=1e-14)
    np.testing.assert_allclose(s + r * t, 1, rtol=1e-14)
    for k, rate in enumerate((ds, dr, dq)):
        f = [coefficients((theta + i * h) ** 2)[k] for i in (-2, -1, 1, 2)]
        np.testing.assert_allclose(rate * theta, (f[0] - 8 * f[1] + 8 * f[2] - f[3]) / (12 * h), rtol=1e-7, atol=1e-11)


def test_rigid_motions_change_nothing():
    """Objectivity: the strains stay, forces and tangent turn with the element."""
    edges, R, data = random_chain(5, 1.0)
    Q = exp(np.array([2.0, -1.0, 0.5]))
    turn = np.kron(np.eye(4), Q)
    for before, after in zip(strains(edges, R), strains(edges @ Q.T, Q @ R), strict=True):
        np.testing.assert_allclose(after, before, atol=1e-14)
    turned = edges @ Q.T, Q @ R, data
    np.testing.assert_allclose(forces(*turned), forces(edges, R, data) @ turn.T, atol=1e-13)
    np.testing.assert_allclose(stiffness(*turned), turn @ stiffness(edges, R, data) @ turn.T, atol=1e-13)


@pytest.mark.parametrize("GA", [np.inf, (3.0, 7.0)])
def test_straight_element_is_the_textbook_matrix(GA):
    """Przemieniecki (1968), eq. 5.116: Φ = 12EI/(GAₛℓ²) in both planes, at rest."""
    EA, GJ, EI2, EI3, length = 2.0, 3.0, 5.0, 11.0, 0.7
    GA2, GA3 = np.broadcast_to(GA, 2)
    line = straight(length, 1)
    data = beam_data(line, [Stiffness(EA, GJ, (EI2, EI3), GA=GA)])
    expected = np.zeros((12, 12))
    for i, k in ((0, EA), (3, GJ)):
        expected[np.ix_([i, i + 6], [i, i + 6])] = k / length * np.array([[1, -1], [-1, 1]])
    for v, theta, sign, EI, GAs in ((1, 5, 1, EI3, GA2), (2, 4, -1, EI2, GA3)):
        phi = 12 * EI / (GAs * length**2)
        a, b, c, d = 12 / length**2, 6 / length * sign, 4 + phi, 2 - phi
        block = EI / length / (1 + phi) * np.array([[a, b, -a, b], [b, c, -b, d], [-a, -b, a, -b], [b, d, -b, c]])
        expected[np.ix_([v, theta, v + 6, theta + 6], [v, theta, v + 6, theta + 6])] = block
    K = stiffness(np.diff(line.points, axis=0), line.frames, data)[0]
    np.testing.assert_allclose(K, expected, rtol=1e-13, atol=1e-13)


def test_circle_by_an_end_moment():
    """M = 2πEI/L rolls a cantilever of 20 elements up: its end returns to the clamp, turned once, to round-off.

    The nodes lie on a circle, whose radius is off L/2π by 7θ⁴/5760, θ = 2π/20: what Z leaves out of S.
    """
    n, EI = 20, 2.0
    line = straight(1.0, n)
    data = beam_data(line, [Stiffness(100.0, 1.5, EI)])
    moment = np.zeros(6 * (n + 1))
    moment[-1] = 2 * np.pi * EI
    x, R = solve(line.points, line.frames, data, lambda _, part: part * moment, CLAMPED, steps=8)
    np.testing.assert_allclose(x[-1], 0, atol=1e-9)
    np.testing.assert_allclose(R[-1], np.eye(3), atol=1e-9)
    radii = np.linalg.norm(x[:-1] - x[:-1].mean(axis=0), axis=1)
    np.testing.assert_allclose(2 * np.pi * radii - 1, 7 / 5760 * (2 * np.pi / n) ** 4, rtol=0.02)


def test_elastica():
    """A cantilever under a dead tip force F = 4EI/L²: the tip of the elastica, to fourth order.

    x′ = (1 + ε) cos θ, y′ = (1 + ε) sin θ, EI θ″ = −(1 + ε) F cos θ with the stretch ε = F sin θ/EA.
    """
    EA = 1e6

    def slopes(s, y):
        stretch = 1 + 4 * np.sin(y[2]) / EA
        return np.stack([stretch * np.cos(y[2]), stretch * np.sin(y[2]), y[3], -4 * stretch * np.cos(y[2])])

    s = np.linspace(0, 1, 21)
    guess = np.stack([s, 0 * s, s, 1 - s])
    rod = solve_bvp(slopes, lambda a, b: np.append(a[:3], b[3]), s, guess, tol=1e-10, max_nodes=20000)
    assert rod.success
    errors = []
    for n in (4, 8, 16):
        line = straight(1.0, n)
        force = np.zeros(6 * (n + 1))
        force[-5] = 4.0
        data = beam_data(line, [Stiffness(EA, 1.0, 1.0)])
        x, _ = solve(line.points, line.frames, data, lambda _, part, f=force: part * f, CLAMPED, steps=4)
        errors.append(np.linalg.norm(x[-1, :2] - rod.y[:2, -1]))
    assert errors[1] < 1e-5
    np.testing.assert_allclose(np.log2(np.divide(errors[:-1], errors[1:])), 4, atol=0.2)


def bend(elements):
    """The tip of Bathe & Bolourchi's bend: 45° of radius 100 in a plane, unit square section, 600 across the plane."""
    line = arc(100 * np.pi / 4, elements, 100.0).placed((0, 0, 0), (1, 0, 0))
    data = beam_data(line, [BEND])
    load = np.zeros(6 * (elements + 1))
    load[-4] = 600.0
    x, _ = solve(line.points, line.frames, data, lambda _, part: part * load, CLAMPED, steps=12)
    return x[-1]


BEND = Stiffness(EA=1e7, GJ=1e7 / 2 * 0.1405770, EI=1e7 / 12, GA=5e6 * 5 / 6)


def rod_bend():
    """The same from the equations of a geometrically exact rod: x′ = R(e₁ + γ), R′ = R k^, n′ = 0, m′ = −x′ × n."""
    force = np.array([0.0, 0.0, 600.0])

    def slopes(s, y):
        q = y[3:7] / np.linalg.norm(y[3:7], axis=0)
        w, v = q[0], q[1:]
        frame = np.array([_turn(w, v, e) for e in np.eye(3)])  # columns, (3, 3, n)
        n = np.einsum("kin,i->kn", frame, force)
        m = np.einsum("kin,in->kn", frame, y[7:])
        gamma = n / np.array([[BEND.EA], [BEND.GA], [BEND.GA]])
        gamma[0] += 1
        k = m / np.array([[BEND.GJ], [BEND.EI], [BEND.EI]])
        k[2] += 1 / 100
        rate = np.einsum("kin,kn->in", frame, gamma)
        spin = np.einsum("kin,kn->in", frame, k)
        dq = np.concatenate([[-(spin * v).sum(axis=0)], w * spin + np.cross(spin, v, axis=0)]) / 2
        return np.concatenate([rate, dq, -np.cross(rate, force[:, None], axis=0)])

    s = np.linspace(0, 100 * np.pi / 4, 41)
    guess = np.zeros((10, 41))
    guess[:3] = [100 * np.sin(s / 100), 100 * (1 - np.cos(s / 100)), 0 * s]
    guess[3], guess[6] = np.cos(s / 200), np.sin(s / 200)
    start = np.array([0, 0, 0, 1, 0, 0, 0])
    rod = solve_bvp(slopes, lambda a, b: np.concatenate([a[:7] - start, b[7:]]), s, guess, tol=1e-9, max_nodes=20000)
    assert rod.success
    return rod.y[:3, -1]


def _turn(w, v, e):
    first = np.cross(v, e[:, None], axis=0)
    return e[:, None] + 2 * w * first + 2 * np.cross(v, first, axis=0)


def test_bathe_bolourchi_bend():
    """Within 1e-5 of the rod with 32 elements; of order 2, as torsion and bending mix along a curved element."""
    exact = rod_bend()
    errors = [np.linalg.norm(bend(n) - exact) / np.linalg.norm(exact - [70.71, 29.29, 0]) for n in (8, 16, 32)]
    assert errors[-1] < 1e-5
    np.testing.assert_allclose(np.log2(np.divide(errors[:-1], errors[1:])), 2, atol=0.1)


def test_euler_buckling():
    """A clamped column under an end force: K's smallest eigenvalue changes sign at π²EI/4L², to fourth order."""
    exact, EA = np.pi**2 / 4, 1e9

    def smallest(P, n):
        line = straight(1.0, n)
        data = beam_data(line, [Stiffness(EA, 1.0, 1.0)])
        edges = np.diff(line.points, axis=0) * (1 - P / EA)
        _, K = scatter(forces(edges, line.frames, data), stiffness(edges, line.frames, data))
        return np.linalg.eigvalsh(K[6:, 6:])[0]

    assert smallest(exact * (1 - 1e-5), 16) > 0 > smallest(exact * (1 + 1e-5), 16)
    errors = [brentq(smallest, 2, 3, args=(n,), xtol=1e-12) / exact - 1 for n in (2, 4, 8)]
    np.testing.assert_allclose(np.log2(np.divide(errors[:-1], errors[1:])), 4, atol=0.1)


def test_sections_are_free_of_stress_at_rest():
    """Three sections of different stiffness and curvature: no forces, and six motions without energy."""
    line = join([straight(1.0, 4), arc(1.0, 5, 0.4, 0.3), helix(2.0, 9, 0.2, 0.15)])
    line = line.placed((1, 2, 3), (1, -1, 2), 0.4)
    profiles = [Section(70e9, 4e-4, nu=0.3, end_radius=2e-4), Section(5e9, 2e-4, 1e-4, G=2e9), Stiffness(1e3, 1.0, 2.0)]
    data = beam_data(line, profiles)
    edges = np.diff(line.points, axis=0)
    assert np.abs(forces(edges, line.frames, data)).max() < 1e-12 * data.axial.max()
    _, K = scatter(forces(edges, line.frames, data), stiffness(edges, line.frames, data))
    arm = line.points - line.points.mean(axis=0)
    for axis in np.eye(3):
        for motion in (
            np.pad(np.tile(axis, (19, 1)), ((0, 0), (0, 3))),
            np.hstack([np.cross(axis, arm), arm * 0 + axis]),
        ):
            assert np.abs(K @ motion.ravel()).max() < 1e-12 * np.abs(K).max()


def test_sections_of_tubes():
    """A = π(r² − a²), I = π(r⁴ − a⁴)/4, J = 2I; Cowper's factor is 6(1+ν)/(7+6ν) for a wire, and (2+2ν)/(4+3ν) thin."""
    tube = Section(E=3.0, outer_radius=2.0, inner_radius=1.0, nu=0.25, density=5.0)
    p = tube.at(np.array([0.0, 1.0]))
    np.testing.assert_allclose(p.EA, 9 * np.pi, rtol=1e-15)
    np.testing.assert_allclose([p.EI2, p.EI3], 3 * 15 * np.pi / 4, rtol=1e-15)
    np.testing.assert_allclose(p.GJ, 1.2 * 15 * np.pi / 2, rtol=1e-15)
    np.testing.assert_allclose([p.mass, p.polar], [[15 * np.pi] * 2, [5 * 15 * np.pi / 2] * 2], rtol=1e-15)
    assert np.isinf(p.GA2).all()
    wire = replace(tube, inner_radius=0.0, shear=True).at(np.zeros(1))
    np.testing.assert_allclose(wire.GA2, 7.5 / 8.5 * 1.2 * 4 * np.pi, rtol=1e-15)
    thin = replace(tube, inner_radius=2 - 1e-9, shear=True).at(np.zeros(1))
    np.testing.assert_allclose(thin.GA3, 2.5 / 4.75 * 1.2 * np.pi * 4e-9, rtol=1e-6)


def test_taper_follows_the_arc_of_its_own_section():
    """Radius 2 to 1 over the second section: the elements' middles have 1.75 and 1.25."""
    line = join([straight(1.0, 3), straight(4.0, 2)])
    data = beam_data(line, [Stiffness(1, 1, 1), Section(1.0, 2.0, nu=0.0, end_radius=1.0)])
    np.testing.assert_allclose(data.axial[3:, 0], np.pi * np.array([1.75, 1.25]) ** 2 / 2, rtol=1e-14)
    np.testing.assert_allclose(data.axial[:3, 0], 3, rtol=1e-14)


def test_tapered_cantilever():
    """Tip deflection under a tip force F of a cone r(1 → ½): F∫(L−s)²/EI ds by quadrature, to second order."""
    section = Section(4 / np.pi, 1.0, nu=0.3, end_radius=0.5)
    s = (np.polynomial.legendre.leggauss(30)[0] + 1) / 2
    exact = (np.polynomial.legendre.leggauss(30)[1] / 2 * (1 - s) ** 2 / (1 - s / 2) ** 4).sum()
    errors = []
    for n in (8, 16, 32):
        line = straight(1.0, n)
        K = scatter(
            np.zeros((n, 12)), stiffness(np.diff(line.points, axis=0), line.frames, beam_data(line, [section]))
        )[1]
        f = np.zeros(6 * n)
        f[-5] = 1.0
        errors.append(abs(np.linalg.solve(K[6:, 6:], f)[-5] / exact - 1))
    np.testing.assert_allclose(np.log2(np.divide(errors[:-1], errors[1:])), 2, atol=0.1)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"E": 0.0}, "E = 0.0: must be a positive number"),
        ({"outer_radius": -1.0}, "outer_radius = -1.0"),
        ({"inner_radius": 1.0}, "inner_radius = 1.0: must be from 0 to below 1.0"),
        ({"end_radius": float("nan")}, "end_radius = nan"),
        ({"nu": 0.6}, "nu = 0.6: must be above -1 and at most 0.5"),
        ({"G": 1.0}, "nu, G = 0.3, 1.0: must be one"),
        ({"nu": None}, "nu, G = None, None"),
        ({"nu": None, "G": -1.0}, "G = -1.0"),
        ({"density": -1.0}, "density = -1.0: must be at least 0"),
    ],
)
def test_refused_sections(change, message):
    with pytest.raises(ValueError, match=message):
        Section(**{"E": 1.0, "outer_radius": 1.0, "nu": 0.3, **change})


@pytest.mark.parametrize("change", [{"EA": 0.0}, {"EI": (1.0, -1.0)}, {"mass": -1.0}, {"GA": 0.0}])
def test_refused_stiffnesses(change):
    with pytest.raises(ValueError, match=next(iter(change))):
        Stiffness(**{"EA": 1.0, "GJ": 1.0, "EI": 1.0, **change})


def test_refused_elements():
    with pytest.raises(ValueError, match="sections: 2 profiles: must be 1"):
        beam_data(straight(1.0, 2), [Stiffness(1, 1, 1)] * 2)
    with pytest.raises(ValueError, match=r"elements: 2 turn by more than 0.9 π"):
        beam_data(arc(2.0, 2, 0.34), [Stiffness(1, 1, 1)])


def test_data_is_that_of_the_centreline():
    data = beam_data(arc(1.0, 4, 0.5), [Stiffness(1, 1, 1)])
    assert isinstance(data, BeamData)
    np.testing.assert_allclose(data.twist, np.tile([0, 0, 0.5], (4, 1)), atol=1e-14)
    np.testing.assert_allclose(data.chord, np.tile([np.sin(0.25) * (1 + 0.25 / 24), 0, 0], (4, 1)), atol=1e-14)
