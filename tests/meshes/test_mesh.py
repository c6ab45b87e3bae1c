"""Mesh: what it refuses, how it orients facets, how it numbers."""

from __future__ import annotations

import numpy as np
import pytest
from integrals import surface, volume

from meshes.mesh import Mesh
from meshes.structured import grid, interval, quadratic

SQUARE = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]])
TWO = np.array([[0, 1, 2], [0, 2, 3]])


def cube(order, n=3):
    axis = np.linspace(0, 1, n + 1)
    return grid([axis] * 3, [("left", "right"), ("front", "back"), ("bottom", "top")], order)


def test_properties_and_read_only_arrays():
    mesh = Mesh(SQUARE, TWO, {"low": np.array([[0, 1]])}, {"half": np.array([1])})
    assert (mesh.dim, mesh.order) == (2, 1)
    for array in (mesh.points, mesh.cells, mesh.facets["low"], mesh.regions["half"]):
        with pytest.raises(ValueError, match="read-only"):
            array[0] = 0


def test_the_callers_arrays_stay_writeable():
    points = SQUARE.copy()
    mesh = Mesh(points, TWO)
    points[0] = 9
    assert mesh.points[0, 0] == 0


def test_unused_nodes_are_dropped_and_facets_follow():
    points = np.insert(SQUARE, 1, [[np.nan, np.nan]], axis=0)
    number = np.array([0, 2, 3, 4])
    mesh = Mesh(points, number[TWO], {"low": number[np.array([[0, 1]])]})
    np.testing.assert_array_equal(mesh.points, SQUARE)
    np.testing.assert_array_equal(mesh.cells, TWO)
    np.testing.assert_array_equal(mesh.facet("low"), [[0, 1]])


def test_a_facet_is_turned_outward_and_gets_its_middle_nodes():
    points, cells = quadratic(SQUARE, TWO)
    mesh = Mesh(points, cells, {"low": np.array([[1, 0]]), "cut": np.array([[2, 0]])})
    low = mesh.facet("low")[0]
    np.testing.assert_array_equal(mesh.points[low], [[0, 0], [1, 0], [0.5, 0]])
    np.testing.assert_array_equal(mesh.points[mesh.facet("cut")[0]], [[1, 1], [0, 0], [0.5, 0.5]])  # out of cell 0
    np.testing.assert_array_equal(mesh.facet_cells(mesh.facet("cut")), [0])


@pytest.mark.parametrize("order", [1, 2])
def test_boundary_of_curved_cube_points_outward(order):
    """Gauss's theorem holds exactly for any conforming isoparametric mesh: ∮ n = 0, ∮ x·n = 3 V."""
    straight = cube(order)
    x, y, z = straight.points.T
    bent = straight.points + 0.05 * np.column_stack([np.sin(3 * y + z), np.cos(2 * z + x), np.sin(2 * x * y)])
    mesh = Mesh(bent, straight.cells, straight.facets)
    _, n, flux = surface(mesh.points, mesh.boundary())
    np.testing.assert_allclose(n, 0, atol=1e-14)
    assert flux == pytest.approx(3 * volume(mesh.points, mesh.cells), rel=1e-13)
    named = sum(surface(mesh.points, mesh.facet(tag))[2] for tag in mesh.facets)
    assert named == pytest.approx(flux, rel=1e-13)
    assert sum(len(f) for f in mesh.facets.values()) == len(mesh.boundary()) == 6 * 2 * 9


def test_boundary_in_one_dimension():
    np.testing.assert_array_equal(interval(2.0, 3, order=2).boundary(), [[0], [3]])


@pytest.mark.parametrize("order", [1, 2])
def test_inverted_cells_are_counted_and_located(order):
    points, cells = SQUARE, np.array([[0, 1, 2], [0, 3, 2]])
    if order == 2:
        points, cells = quadratic(points, cells)
    with pytest.raises(ValueError, match=r"1 of 2 .* first is cell 1 .* \(0\.333333, 0\.666667\)"):
        Mesh(points, cells)


def test_degenerate_cell():
    with pytest.raises(ValueError, match="1 of 2 are inverted or degenerate"):
        Mesh(np.array([[0.0, 0], [1, 0], [1, 1], [0.5, 0.5]]), TWO)


def test_a_cell_inverted_at_one_node_only():
    """A middle node beyond a quarter of its edge folds the corner; the determinant at the centroid stays positive."""
    points, cells = quadratic(SQUARE[:3], TWO[:1])
    low = int(np.flatnonzero((points == [0.5, 0]).all(axis=1))[0])
    points[low] = [0.26, 0]
    Mesh(points, cells)
    points[low] = [0.24, 0]
    with pytest.raises(ValueError, match="inverted"):
        Mesh(points, cells)


@pytest.mark.parametrize("scale", [1e-9, 1e9])
def test_cells_of_any_scale(scale):
    assert volume((mesh := Mesh(scale * SQUARE, TWO)).points, mesh.cells) == pytest.approx(scale**2, rel=1e-14)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"points": np.where(SQUARE == 1, np.nan, SQUARE)}, "points: 3 of 4 have coordinates that are not finite"),
        ({"points": np.zeros((4, 4))}, "points: shape"),
        ({"cells": np.array([[0, 1, 2, 3]])}, r"cells: shape \(1, 4\): must be \(m, 3\) or \(m, 6\)"),
        ({"cells": np.empty((0, 3), dtype=int)}, "cells: none"),
        ({"cells": TWO * 1.0}, "cells: float64 values"),
        ({"cells": TWO + 1}, r"cells: node 4: must be in 0 \.\. 3"),
        ({"cells": TWO - 1}, r"cells: node -1"),
        ({"cells": np.array([[0, 1, 2]] * 3)}, "3 facets belong to more than two cells, the first to cell 0"),
        ({"facets": {"low": np.array([[0, 1], [1, 3]])}}, r"facets 'low': 1 of 2 .* no cell.* \[1, 3\]"),
        ({"facets": {"low": np.array([[0, 9]])}}, "facets 'low': 1 of 1"),
        ({"facets": {"low": np.array([0, 1])}}, "facets 'low': shape"),
        ({"regions": {"all": np.array([2])}}, "regions 'all': cell"),
    ],
)
def test_refused(change, message):
    with pytest.raises(ValueError, match=message) as error:
        Mesh(**{"points": SQUARE, "cells": TWO, **change})
    assert "\n" not in str(error.value)


def test_an_unknown_tag_lists_those_that_exist():
    mesh = Mesh(SQUARE, TWO, {"low": np.array([[0, 1]]), "high": np.array([[2, 3]])})
    with pytest.raises(ValueError, match=r"'side': must be one of high, low"):
        mesh.facet("side")
