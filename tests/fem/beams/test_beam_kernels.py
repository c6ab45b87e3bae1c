"""The compiled beam element against its oracle, and points between nodes against finite differences."""

from __future__ import annotations

import numpy as np
import pytest
from beam_examples import random_chain, scatter

from fem import rotations
from fem.beams import beam_kernels as kernels
from fem.beams import beam_points, frame_kernels, nodal_kernels
from fem.beams.beam_element import forces, stiffness, strains
from meshes.centrelines import helix


@pytest.mark.parametrize("elements", [1, 8, 19])
@pytest.mark.parametrize("angle", [0.0, 1e-6, 0.3, 0.49, 0.51, 1.5, 2.8])
def test_assembly_is_the_oracle(angle, elements):
    """Forces and blocks are the sums of the elements' forces and matrices, to 1e-12."""
    edges, R, data = random_chain(elements, angle, seed=2)
    f, K = scatter(forces(edges, R, data), stiffness(edges, R, data))
    stress, _, _ = kernels.rest_in_motion(edges, R, data, 0.0)
    diagonal, upper = kernels.assemble_blocks(edges, R, data, stress)
    blocks = K.reshape(elements + 1, 6, elements + 1, 6).transpose(0, 2, 1, 3)
    i = np.arange(elements + 1)
    np.testing.assert_allclose(diagonal, blocks[i, i], atol=1e-12)
    np.testing.assert_allclose(upper, blocks[i[:-1], i[1:]], atol=1e-12)
    np.testing.assert_allclose(kernels.assemble_forces(edges, R, data).ravel(), f, atol=1e-12)
    for found, exact in zip(kernels.strains(edges, R), strains(edges, R), strict=True):
        np.testing.assert_allclose(found, exact, atol=1e-14)


def test_rest_in_motion():
    """The stress, and the rest shape between its own and the present one."""
    edges, R, data = random_chain(13, 0.8, seed=4)
    gamma, psi = strains(edges, R)
    stress, chord, twist = kernels.rest_in_motion(edges, R, data, 3.0)
    expected = np.hstack([data.axial * (gamma - data.chord), data.bending * (psi - data.twist)])
    np.testing.assert_allclose(stress, expected, atol=1e-13)
    np.testing.assert_allclose(chord, 0.25 * data.chord + 0.75 * gamma, atol=1e-14)
    np.testing.assert_allclose(twist, 0.25 * data.twist + 0.75 * psi, atol=1e-14)


@pytest.mark.parametrize("angle", [0.0, 0.3, 0.49, 0.51, 1.5, 2.8])
def test_extrapolated_stress_is_linear(angle):
    """What the stress of a motion by ε d, less that without, tends to over ε: by central differences."""
    edges, R, data = random_chain(17, angle, seed=3)
    x, d = np.vstack([np.zeros(3), np.cumsum(edges, axis=0)]), np.random.default_rng(4).normal(size=(18, 6))

    def stress(part):
        _, turned, moved = frame_kernels.update(x, R, edges, part * d)
        gamma, psi = strains(moved, turned)
        return np.hstack([data.axial * (gamma - data.chord), data.bending * (psi - data.twist)])

    expected = stress(0.0) + (stress(1e-5) - stress(-1e-5)) / 2e-5
    found = kernels.extrapolated_stress(edges, R, data, d)
    np.testing.assert_allclose(found, expected, rtol=1e-7, atol=1e-7 * np.abs(expected).max())


def test_a_half_turn_is_no_number():
    """An element whose ends are turned by π against each other has no mean frame, and says so."""
    edges, R, data = random_chain(1, 1.0)
    R[1] = R[0] @ np.diag([1.0, -1.0, -1.0])
    assert not np.isfinite(kernels.assemble_forces(edges, R, data)).all()


def test_update_composes():
    rng = np.random.default_rng(0)
    x, R, d = rng.normal(size=(19, 3)), rotations.exp(rng.normal(size=(19, 3))), rng.normal(size=(19, 6))
    d[0] = 0.0
    x_new, R_new, edges = frame_kernels.update(x, R, np.diff(x, axis=0), d)
    np.testing.assert_array_equal(x_new, x + d[:, :3])
    np.testing.assert_allclose(R_new, rotations.composed(d[:, 3:], R), atol=1e-15)
    np.testing.assert_allclose(edges, np.diff(x_new, axis=0), atol=1e-15)
    np.testing.assert_allclose(
        frame_kernels.relative_rotations(R, R_new), rotations.log(rotations.exp(d[:, 3:])), atol=1e-13
    )


def test_turn_to_a_prescribed_frame():
    rng = np.random.default_rng(5)
    R, start = rotations.exp(rng.normal(scale=0.5, size=(2, 1, 3)))
    for theta in (rng.normal(scale=0.5, size=3), np.zeros(3)):
        expected = rotations.log(rotations.exp(theta) @ start[0] @ R[0].T)
        np.testing.assert_allclose(frame_kernels.turn_to(R, start, theta), expected, atol=1e-14)


def test_edges_keep_their_digits_far_from_the_origin():
    """At 1e6 from the origin positions lose six digits of an edge, updated edges none."""
    x, R = np.array([[1e6, 0, 0], [1e6 + 1, 0, 0]]), np.tile(np.eye(3), (2, 1, 1))
    d = np.zeros((2, 6))
    d[1, 0] = 1e-14
    _, _, edges = frame_kernels.update(x, R, np.array([[1.0, 0, 0]]), d)
    assert edges[0, 0] == 1 + 1e-14


def test_inertia_and_element_blocks_add_up():
    """Both are sums in the matrix of the chain; elements may repeat."""
    rng = np.random.default_rng(1)
    blocks = rng.normal(size=(3, 12, 12))
    blocks += np.swapaxes(blocks, 1, 2)
    elements = np.array([1, 0, 1])
    diagonal, upper = np.zeros((3, 6, 6)), np.zeros((2, 6, 6))
    kernels.add_element_blocks(diagonal, upper, elements, blocks)
    _, K = scatter(np.zeros((2, 12)), np.stack([blocks[1], blocks[0] + blocks[2]]))
    np.testing.assert_allclose(
        np.vstack(diagonal), np.vstack([K[6 * i : 6 * i + 6, 6 * i : 6 * i + 6] for i in range(3)])
    )
    np.testing.assert_allclose(upper, [K[:6, 6:12], K[6:12, 12:]])
    nodes, links, J = rng.uniform(1, 2, 3), rng.uniform(1, 2, 2), rng.normal(size=(3, 3, 3))
    before = diagonal.copy(), upper.copy()
    nodal_kernels.add_inertia(diagonal, upper, nodes, links, J, 2.0)
    np.testing.assert_allclose((diagonal - before[0])[:, :3, :3], 2 * nodes[:, None, None] * np.eye(3))
    np.testing.assert_allclose((diagonal - before[0])[:, 3:, 3:], 2 * J)
    np.testing.assert_allclose((upper - before[1])[:, :3, :3], 2 * links[:, None, None] * np.eye(3), atol=1e-15)
    assert (diagonal == before[0])[:, :3, 3:].all()


def sample():
    rng = np.random.default_rng(5)
    x, R = rng.normal(size=(5, 3)), rotations.exp(rng.normal(size=(5, 3)))
    return (
        x,
        R,
        np.array([0, 3, 3, 2]),
        np.array([0.0, 0.3, 0.8, 1.0]),
        rng.uniform(0.5, 1.5, 4),
        rng.normal(size=(4, 3)),
    )


def shifted(x, R, element, i, d):
    """Nodes and frames after the unknowns of the i-th point's element move by d (12)."""
    x, R, e = x.copy(), R.copy(), element[i]
    x[e : e + 2] += d.reshape(2, 6)[:, :3]
    R[e : e + 2] = rotations.exp(d.reshape(2, 6)[:, 3:]) @ R[e : e + 2]
    return x, R


def test_points_meet_the_nodes_and_a_straight_element():
    x, R, element, xi, length, _ = sample()
    p = beam_points.centreline_points(x, R, element, xi, length)
    np.testing.assert_allclose(p[[0, 3]], x[[0, 3]], rtol=1e-15)
    line = np.array([[0.0, 0, 0], [2, 0, 0]])
    p = beam_points.centreline_points(line, np.tile(np.eye(3), (2, 1, 1)), np.zeros(4, int), xi, np.array([2.0]))
    np.testing.assert_allclose(p, np.outer(2 * xi, [1, 0, 0]), atol=1e-15)


def test_points_of_a_helix_are_of_fourth_order():
    """Hermite's interpolation of a rest shape: ℓ⁴/384 |x⁗|, |x⁗| = aω⁴ on a helix of radius a."""
    a, b = 0.4, 0.1
    for n in (20, 40):
        line, fine = (helix(3.0, k, a, 2 * np.pi * b) for k in (n, 2 * n))
        ell = np.full(n, 3.0 / n)
        p = beam_points.centreline_points(line.points, line.frames, np.arange(n), np.full(n, 0.5), ell)
        bound = ell[0] ** 4 / 384 * a / (a**2 + b**2) ** 2
        np.testing.assert_allclose(np.linalg.norm(p - fine.points[1::2], axis=1), bound, rtol=0.05)


def test_rows_are_derivatives_of_the_points():
    x, R, element, xi, length, n = sample()
    rows = beam_points.point_rows(n, R, element, xi, length)
    for i in range(4):
        for k, d in enumerate(1e-5 * np.eye(12)):
            ends = [
                beam_points.centreline_points(*shifted(x, R, element, i, s * d), element, xi, length)[i]
                for s in (-1, 1)
            ]
            np.testing.assert_allclose(rows[i, k], n[i] @ (ends[1] - ends[0]) / 2e-5, atol=1e-9)


def test_blocks_are_second_derivatives_of_the_distance():
    """−λ ∂²g for g(p) = n·(p − p₀) + ½ (p − p₀)·C(p − p₀), along random directions of all unknowns."""
    rng = np.random.default_rng(8)
    x, R, element, xi, length, n = sample()
    C = rng.normal(size=(4, 3, 3))
    C += np.swapaxes(C, 1, 2)
    force = rng.uniform(1, 2, 4)
    blocks = beam_points.point_blocks(force, n, C, R, element, xi, length)
    np.testing.assert_allclose(blocks, np.swapaxes(blocks, 1, 2), atol=1e-14)
    at = beam_points.centreline_points(x, R, element, xi, length)

    def g(i, d):
        p = beam_points.centreline_points(*shifted(x, R, element, i, d), element, xi, length)[i] - at[i]
        return n[i] @ p + p @ C[i] @ p / 2

    for i in range(4):
        for d in rng.normal(size=(8, 12)):
            h = 1e-3
            second = (-g(i, 2 * h * d) + 16 * g(i, h * d) + 16 * g(i, -h * d) - g(i, -2 * h * d)) / (12 * h**2)
            np.testing.assert_allclose(d @ blocks[i] @ d, -force[i] * second, rtol=1e-6, atol=1e-7)
