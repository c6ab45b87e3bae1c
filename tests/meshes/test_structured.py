"""Structured meshes: counts, coordinates, grading."""

from __future__ import annotations

import time

import numpy as np
import pytest
from integrals import volume

from meshes.blocks import box, layer
from meshes.structured import interval


@pytest.mark.parametrize("order", [1, 2])
def test_interval(order):
    mesh = interval(2.0, 4, order=order, origin=-1.0)
    assert (mesh.dim, mesh.order, len(mesh.points)) == (1, order, 4 * order + 1)
    np.testing.assert_allclose(mesh.points[mesh.facet("start")], [[[-1.0]]])
    np.testing.assert_allclose(mesh.points[mesh.facet("end")], [[[1.0]]])
    assert volume(mesh.points, mesh.cells) == pytest.approx(2.0, rel=1e-15)
    assert volume(mesh.points, mesh.cells, lambda x: x[..., 0] ** 2) == pytest.approx(2 / 3, rel=1e-14)


@pytest.mark.parametrize("order", [1, 2])
@pytest.mark.parametrize(("size", "n"), [((2.0, 1.0), (5, 3)), ((2.0, 1.0, 3.0), (2, 3, 4))])
def test_box(size, n, order):
    mesh = box(size, n=n, order=order, origin=[1.0] * len(size), structured=True)
    dim = len(size)
    assert len(mesh.cells) == np.prod(n) * [0, 1, 2, 6][dim]
    assert len(mesh.points) == np.prod([order * k + 1 for k in n])
    assert volume(mesh.points, mesh.cells) == pytest.approx(np.prod(size), rel=1e-14)
    sides = {"left": (0, 0), "right": (0, 1), "front": (1, 0), "back": (1, 1), "bottom": (-1, 0), "top": (-1, 1)}
    assert set(mesh.facets) == set(sides) - (set() if dim == 3 else {"front", "back"})
    for tag in mesh.facets:
        axis, end = sides[tag]
        assert (mesh.points[mesh.facet(tag)][..., axis] == 1 + end * size[axis]).all()
    assert sum(len(facets) for facets in mesh.facets.values()) == len(mesh.boundary())


def test_cells_of_a_square_are_equal_right_triangles():
    mesh = box((1, 1), n=4, structured=True)
    x = mesh.points[mesh.cells]
    sides = np.sort(np.linalg.norm(x - np.roll(x, 1, axis=1), axis=2), axis=1)
    np.testing.assert_allclose(sides, np.tile([0.25, 0.25, 0.25 * 2**0.5], (32, 1)), rtol=1e-14)
    np.testing.assert_allclose(mesh.points[:6, 0], [0, 0.25, 0.5, 0.75, 1, 0])  # x runs fastest


def test_257_by_257_nodes_take_well_under_a_second():
    start = time.process_time()
    mesh = box((4, 4), n=256, origin=(-2, -2), structured=True)
    assert time.process_time() - start < 1.0
    assert len(mesh.points) == 257**2


def test_h_gives_the_number_of_cells():
    assert len(box((1, 0.3), h=0.1, structured=True).cells) == 2 * 10 * 3


def test_geometric_grading():
    mesh = box((1, 1), n=(11, 5), structured=True, grading=(8.0, 1.0))
    x = np.unique(mesh.points[:, 0])
    steps = np.diff(x)
    np.testing.assert_allclose(steps[1:] / steps[:-1], 8 ** (1 / 10), rtol=1e-12)
    assert (x[0], x[-1]) == (0, 1)
    np.testing.assert_allclose(np.diff(np.unique(mesh.points[:, 1])), 0.2, rtol=1e-13)


def test_grading_by_a_function():
    mesh = box((2, 1), n=8, structured=True, grading=lambda s: s**2)
    np.testing.assert_allclose(np.unique(mesh.points[:, 0]), 2 * (np.arange(9) / 8) ** 2, rtol=1e-14)


def test_layer_is_graded_to_the_origin_at_its_top():
    mesh = layer(3.0, 1.0, n=(6, 5), structured=True, grading=4.0, order=2)
    assert volume(mesh.points, mesh.cells) == pytest.approx(3.0, rel=1e-14)
    y = np.unique(mesh.points[mesh.facet("axis")][..., 1])[::2]
    assert (y[0], y[-1]) == (-1, 0)
    assert np.diff(y)[0] / np.diff(y)[-1] == pytest.approx(4.0)
    for tag, axis, value in [("axis", 0, 0), ("far", 0, 3), ("bottom", 1, -1), ("top", 1, 0)]:
        assert (mesh.points[mesh.facet(tag)][..., axis] == value).all()


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"h": 0.1}, "h, n = .*one and not the other"),
        ({"n": None}, "h, n"),
        ({"n": 0}, "n = 0"),
        ({"n": 2.5}, "n = 2.5: must be a positive whole number"),
        ({"n": (2, 3, 4)}, "n = .*list of 2"),
        ({"grading": -1.0}, "grading = -1.0: must be a positive number"),
        ({"grading": lambda s: 1 - s}, "grading = .*increasing map"),
        ({"structured": 1}, "structured = 1"),
        ({"structured": False}, "n = 4.*structured = true"),
        ({"order": 3}, "order = 3: must be 1 or 2"),
    ],
)
def test_refused(change, message):
    with pytest.raises(ValueError, match=message):
        box((1, 1), **{"n": 4, "structured": True, **change})
