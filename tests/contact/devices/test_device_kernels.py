"""The compiled work on the contact points of a device against the same formulas on whole arrays."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from contact.devices import device_kernels
from contact.devices.row_kernels import braced, concave_part
from contact.surfaces.implicit import Foot
from fem.beams import beam_points

Floats = NDArray[np.float64]
RNG = np.random.default_rng(0)
C = 9


def feet(n: int) -> Foot:
    """Random numbers in the shapes of feet."""
    return Foot(RNG.normal(size=n), RNG.normal(size=(n, 3)), RNG.normal(size=(n, 3)), RNG.normal(size=(n, 3, 3)))


def test_bounds() -> None:
    """A gap falls by no more than its point and the surface have moved."""
    (known, drift), (at, seen) = RNG.normal(size=(2, C)), RNG.normal(size=(2, C, 3))
    way = np.linalg.norm(at - seen, axis=1)
    np.testing.assert_allclose(device_kernels.ways(seen, at), way, rtol=1e-14)
    np.testing.assert_allclose(device_kernels.bounds(known, at, seen, drift), known - way - drift, rtol=1e-14)


def test_gaps() -> None:
    """Those of candidates are known, the others fall by no more than their points and the surface have moved."""
    candidates, (known, drift), (at, seen) = RNG.random(C) < 0.5, RNG.normal(size=(2, C)), RNG.normal(size=(2, C, 3))
    expected = np.where(candidates, known, known - np.linalg.norm(at - seen, axis=1) - drift)
    np.testing.assert_allclose(device_kernels.gaps(candidates, known, at, seen, drift), expected, rtol=1e-14)


def test_split() -> None:
    """In rising order both."""
    chosen, followed = RNG.random((2, 50)) < 0.5
    rows, others = device_kernels.split(chosen, followed)
    np.testing.assert_array_equal(rows, np.flatnonzero(chosen & followed))
    np.testing.assert_array_equal(others, np.flatnonzero(chosen & ~followed))


def test_moved_along() -> None:
    """Places, and feet by ∂y = I − n nᵀ − d ∇²d."""
    (at, seen), foot, rows = RNG.normal(size=(2, C, 3)), feet(C), np.array([1, 4, 5, 8])
    motion, n = (at - seen)[rows], foot.normal[rows]
    turn = np.eye(3) - n[:, :, None] * n[:, None, :] - foot.distance[rows, None, None] * foot.curvature[rows]
    x, guess = device_kernels.moved_along(rows, at, seen, foot)
    np.testing.assert_array_equal(x, at[rows])
    np.testing.assert_allclose(guess, foot.point[rows] + (turn @ motion[:, :, None])[:, :, 0], rtol=1e-13)


def test_settle() -> None:
    """What is found for some points is written there, and nowhere else; gaps that change too much are told."""
    rows, x, radius = np.array([0, 3, 7]), RNG.normal(size=(3, 3)), RNG.uniform(size=C)
    all_feet, found, known, seen = feet(C), feet(3), RNG.normal(size=C), RNG.normal(size=(C, 3))
    gaps, way = found.distance - radius[rows], np.linalg.norm(x - seen[rows], axis=1)
    drift = RNG.uniform(size=C)
    known[3] = gaps[1] + way[1] + drift[3] + 0.3
    known[7] = gaps[2] + way[2] + drift[7] + 0.1
    expected = [part.copy() for part in (*all_feet, known, seen, np.ones(C, dtype=bool), drift)]
    for part, new in zip(expected, (*found, gaps, x, gaps <= 0.2, 0.0), strict=True):
        part[rows] = new
    jumped, followed = np.flatnonzero(np.abs(gaps - known[rows]) > way + drift[rows] + 0.2), np.ones(C, dtype=bool)
    assert 1 in jumped
    assert 2 not in jumped
    lost = device_kernels.settle(rows, x, found, radius, all_feet, known, seen, followed, drift, 0.2, 0.2)
    np.testing.assert_array_equal(lost, jumped)
    for part, wanted in zip((*all_feet, known, seen, followed, drift), expected, strict=True):
        np.testing.assert_array_equal(part, wanted)


def test_planes() -> None:
    """n·(p − y) − a and n·∂p of candidates; the others are infinitely far and have no row."""
    candidates, at, foot, radius = RNG.random(C) < 0.5, RNG.normal(size=(C, 3)), feet(C), RNG.uniform(size=C)
    R, element, xi, length = RNG.normal(size=(5, 3, 3)), RNG.integers(0, 4, C), RNG.random(C), RNG.random(4)
    offset, normal, rows = device_kernels.planes(candidates, at, foot, radius, R, element, xi, length)
    expected = np.where(candidates, ((at - foot.point) * foot.normal).sum(axis=1) - radius, np.inf)
    np.testing.assert_allclose(offset, expected, rtol=1e-13)
    np.testing.assert_array_equal(normal, foot.normal)
    every = beam_points.point_rows(foot.normal, R, element, xi, length)
    np.testing.assert_array_equal(rows, np.where(candidates[:, None], every, 0.0))


def curvatures() -> tuple[Floats, Floats]:
    """Curvatures of every sign, (60, 3, 3), and their normals."""
    n = RNG.normal(size=(60, 3))
    n /= np.linalg.norm(n, axis=1)[:, None]
    flat = np.eye(3) - n[:, :, None] * n[:, None, :]
    S = RNG.normal(size=(60, 3, 3))
    return flat @ (S + np.swapaxes(S, 1, 2) + RNG.normal(scale=2, size=60)[:, None, None] * np.eye(3)) @ flat, n


def test_concave_part() -> None:
    """The negative part by eigenvalues, of curvatures of every sign."""
    curvature, n = curvatures()
    values, vectors = np.linalg.eigh(curvature)
    expected = (vectors * np.minimum(values, 0.0)[:, None, :]) @ np.swapaxes(vectors, 1, 2)
    assert (values[:, 2] > 1e-9).any() and (values[:, 2] < 1e-9).any() and (values[:, 0] > -1e-9).any()
    np.testing.assert_allclose(concave_part(curvature, n), expected, atol=1e-13)


def test_braced() -> None:
    """The largest eigenvalue, where it is positive, is taken away along the normal."""
    curvature, n = curvatures()
    largest = np.linalg.eigvalsh(curvature)[:, 2]
    assert (largest > 1e-9).any() and (largest < 1e-9).any()
    found, brace = braced(curvature, n, 7.0)
    np.testing.assert_allclose(brace, 7.0 * np.maximum(largest, 0.0), atol=1e-13)
    np.testing.assert_allclose(found, curvature - brace[:, None, None] * n[:, :, None] * n[:, None, :], atol=1e-13)
