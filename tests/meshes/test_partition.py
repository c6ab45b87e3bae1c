"""Partition: balance, and pieces that make up the whole."""

from __future__ import annotations

import numpy as np
import pytest
from integrals import surface, volume

from meshes.blocks import box
from meshes.generators import ring, sphere_octant
from meshes.mesh import Mesh
from meshes.partition import partition, split
from meshes.structured import interval


@pytest.fixture(scope="module", params=["interval", "ring", "sphere"])
def mesh(request):
    if request.param == "interval":
        return interval(1.0, 17, order=2)
    plain = ring(1, 2, h=0.2, order=2) if request.param == "ring" else sphere_octant(1, h=0.3, order=2)
    cut = plain.cells[::3, [0, 1, 2][: plain.dim]]  # facets inside, on the borders of parts too
    return Mesh(plain.points, plain.cells, {**plain.facets, "cut": cut}, {"third": np.arange(0, len(plain.cells), 3)})


@pytest.mark.parametrize("parts", [1, 2, 3, 5, 8, 17])
def test_parts_are_balanced_within_one_cell(mesh, parts):
    part = partition(mesh, parts)
    sizes = np.bincount(part, minlength=parts)
    assert len(part) == len(mesh.cells)
    assert len(sizes) == parts
    assert np.ptp(sizes) <= 1
    np.testing.assert_array_equal(part, partition(mesh, parts))


def test_the_longest_extent_is_cut_first():
    mesh = box((4, 1), n=(8, 2), structured=True)
    x = mesh.points[mesh.cells].mean(axis=1)[:, 0]
    np.testing.assert_array_equal(partition(mesh, 4), (x // 1).astype(int))


@pytest.mark.parametrize("parts", [0, 1.0])
def test_refused(parts):
    with pytest.raises(ValueError, match=f"parts = {parts}"):
        partition(interval(1.0, 34), parts)


@pytest.mark.parametrize("parts", [1, 2, 3, 7])
def test_pieces_number_every_node_once(mesh, parts):
    pieces = split(mesh, parts)
    owned = np.concatenate([p.nodes[: p.owned] for p in pieces])
    np.testing.assert_array_equal(owned, np.arange(len(mesh.points)))
    original = np.concatenate([p.original[: p.owned] for p in pieces])
    np.testing.assert_array_equal(np.sort(original), np.arange(len(mesh.points)))
    part = partition(mesh, parts)
    for rank, p in enumerate(pieces):
        assert p.total == len(mesh.points)
        assert p.offset == sum(q.owned for q in pieces[:rank])
        ghosts = p.nodes[p.owned :]
        assert (np.diff(ghosts) > 0).all()
        assert ((ghosts < p.offset) | (ghosts >= p.offset + p.owned)).all()
        np.testing.assert_array_equal(original[p.nodes], p.original)
        np.testing.assert_array_equal(p.points, mesh.points[p.original])
        np.testing.assert_array_equal(p.original[p.cells], mesh.cells[part == rank])
        np.testing.assert_array_equal(np.unique(p.cells), np.arange(len(p.nodes)))
        for node in p.original[p.owned :]:
            assert (part[(mesh.cells == node).any(axis=1)] < rank).any()


@pytest.mark.parametrize("parts", [2, 3, 7])
def test_pieces_have_the_same_integrals(mesh, parts):
    pieces = split(mesh, parts)

    def f(x):
        return np.exp(x.sum(axis=-1))

    whole = volume(mesh.points, mesh.cells, f)
    assert sum(volume(p.points, p.cells, f) for p in pieces) == pytest.approx(whole, rel=1e-13)
    for tag, facets in mesh.facets.items():
        rows = np.concatenate([p.original[p.facets[tag]] for p in pieces])
        np.testing.assert_array_equal(np.unique(rows, axis=0), np.unique(facets, axis=0))
        assert len(rows) == len(facets)
        if mesh.dim > 1:
            flux = sum(surface(p.points, p.facets[tag])[2] for p in pieces)
            assert flux == pytest.approx(surface(mesh.points, facets)[2], rel=1e-12, abs=1e-12)
    for tag, region in mesh.regions.items():
        size = sum(volume(p.points, p.cells[p.regions[tag]]) for p in pieces)
        assert size == pytest.approx(volume(mesh.points, mesh.cells[region]), rel=1e-12)


def test_one_part_is_the_mesh_itself(mesh):
    (piece,) = split(mesh, 1)
    for array in (piece.nodes, piece.original):
        np.testing.assert_array_equal(array, np.arange(len(mesh.points)))
    np.testing.assert_array_equal(piece.cells, mesh.cells)
    for tag in mesh.facets:
        np.testing.assert_array_equal(piece.facets[tag], mesh.facets[tag])
    assert (piece.owned, piece.offset, piece.total) == (len(mesh.points), 0, len(mesh.points))
