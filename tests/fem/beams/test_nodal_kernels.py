"""The compiled work on the nodes of a beam against the same formulas on whole arrays."""

from __future__ import annotations

import numpy as np

from fem.beams import nodal_kernels

RNG = np.random.default_rng(0)
N = 7


def test_inertia_forces() -> None:
    """M (factor · moved − rate · v) with the tridiagonal M, and J (factor · turned − rate · w)."""
    f, (moved, turned, v, w) = RNG.normal(size=(N, 6)), RNG.normal(size=(4, N, 3))
    nodes, links, J = RNG.uniform(1, 2, N), RNG.uniform(0, 1, N - 1), RNG.normal(size=(N, 3, 3))
    M = np.diag(nodes) + np.diag(links, 1) + np.diag(links, -1)
    expected = f.copy()
    expected[:, :3] += M @ (3.0 * moved - 0.5 * v)
    expected[:, 3:] += np.einsum("nij,nj->ni", J, 3.0 * turned - 0.5 * w)
    nodal_kernels.add_inertia_forces(f, moved, turned, v, w, nodes, links, J, 3.0, 0.5)
    np.testing.assert_allclose(f, expected, rtol=1e-13, atol=1e-13)


def test_line_moments() -> None:
    """ℓ²/12 (t₁ × q, −t₂ × q) of each element."""
    f, R = RNG.normal(size=(N, 6)), RNG.normal(size=(N, 3, 3))
    length, q = RNG.uniform(0.5, 1, N - 1), RNG.normal(size=(N - 1, 3))
    expected, arms = f.copy(), length[:, None] ** 2 / 12
    expected[:-1, 3:] += arms * np.cross(R[:-1, :, 0], q)
    expected[1:, 3:] -= arms * np.cross(R[1:, :, 0], q)
    nodal_kernels.add_line_moments(f, R, length, q)
    np.testing.assert_allclose(f, expected, rtol=1e-13, atol=1e-13)


def test_norms() -> None:
    """Of the imbalance at free unknowns, and of each force, by the unit of each unknown."""
    inner, outer, contact = RNG.normal(size=(3, 6 * N))
    fixed, unit = RNG.random(6 * N) < 0.3, RNG.uniform(1, 2, 6 * N)
    rest = np.where(fixed, 0.0, inner - outer - contact)
    expected = [np.linalg.norm(unit * f) for f in (rest, inner, outer, contact)]
    np.testing.assert_allclose(nodal_kernels.norms(inner, outer, contact, fixed, unit), expected, rtol=1e-14)


def test_spatial_inertia() -> None:
    """R diag(rotary) Rᵀ of each node."""
    R, rotary = RNG.normal(size=(N, 3, 3)), RNG.uniform(size=(N, 3))
    expected = np.einsum("nik,nk,njk->nij", R, rotary, R)
    np.testing.assert_allclose(nodal_kernels.spatial_inertia(R, rotary), expected, rtol=1e-13, atol=1e-14)


def test_furthest() -> None:
    """The largest components, of either sign."""
    d = RNG.normal(size=(N, 6))
    expected = np.abs(d[:, :3]).max(), np.abs(d[:, 3:]).max()
    assert nodal_kernels.furthest(d) == expected
    assert nodal_kernels.furthest(-d) == expected
