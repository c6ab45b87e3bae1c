"""Bodies as pictures: cells as filled patches and curves, outlines, shading and contact forces on matplotlib axes."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from contact.record import Grid
from fem.elements import order_of, shape
from meshes.mesh import face_keys, face_table, faces_of
from meshes.simplices import face_nodes

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.cm import ScalarMappable

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

# Okabe and Ito's palette, distinct to colour-blind readers (jfly.uni-koeln.de/color, 2008).
BLUE, VERMILLION, GREEN, ORANGE, SKY, PURPLE = "#0072B2", "#D55E00", "#009E73", "#E69F00", "#56B4E9", "#CC79A7"
GREY = "0.6"

MANY = 5000
"""From this many cells on, mesh lines are left out and cells are subdivided less."""

ARROW = 0.14
"""Length of the largest force over the diagonal of the bodies."""

CREASE = np.cos(np.deg2rad(30))
"""Faces that meet at a larger angle than this form an edge of the outline."""


class Patches(NamedTuple):
    """Simplices of one dimension and order. nodes : (m, k) in VTK's order; cell : (m,) the grid's cells they show."""

    nodes: Ints
    cell: Ints


@dataclass(frozen=True, eq=False)
class Bodies:
    """What a picture of deformed bodies shows.

    Attributes
    ----------
    grid : Grid
    displacement : (n, 3) [m]
    values : (n,) at the points or (cells,) in the cells
    label : str
        Name and unit of `values`.
    """

    grid: Grid
    displacement: Floats
    values: Floats
    label: str

    @property
    def positions(self) -> Floats:
        """Deformed positions (n, 3) [m]."""
        return np.asarray(self.grid.points + self.displacement)

    @cached_property
    def faces(self) -> list[Patches]:
        """The triangles of plane bodies and the outer faces of solids."""
        return [
            Patches(nodes, cells) if len(nodes[0]) in (3, 6) else outer_faces(nodes, cells)
            for nodes, cells in (self._cells(kind) for kind in (5, 22, 10, 24))
            if len(nodes)
        ]

    @cached_property
    def curves(self) -> list[Patches]:
        """The lines and polylines of one-dimensional bodies."""
        owner = np.repeat(np.arange(len(self.grid.types)), np.diff(self.grid.offsets))
        inside = (owner[:-1] == owner[1:]) & np.isin(self.grid.types[owner[:-1]], (3, 4))
        pairs = np.stack([self.grid.connectivity[:-1], self.grid.connectivity[1:]], axis=1)
        found = [Patches(pairs[inside], owner[:-1][inside]), Patches(*self._cells(21))]
        return [patches for patches in found if len(patches.nodes)]

    @cached_property
    def space(self) -> bool:
        """Whether three dimensions are needed: solids, and surfaces that leave the plane z = 0."""
        return bool(np.isin(self.grid.types, (10, 24)).any() or (self.faces and self.positions[:, 2].any()))

    def _cells(self, kind: int) -> tuple[Ints, Ints]:
        """Nodes and numbers of the cells of a VTK type."""
        cells = np.flatnonzero(self.grid.types == kind)
        starts, sizes = self.grid.offsets[cells], np.diff(self.grid.offsets)[cells]
        size = int(sizes[0]) if len(sizes) else 1
        return np.asarray(self.grid.connectivity[starts[:, None] + np.arange(size)]), cells

    def on(self, patches: Patches, parts: int) -> Floats:
        """`values` at the points of the subdivided patches, (m, q)."""
        if len(self.values) == len(self.grid.types) != len(self.grid.points):
            return np.repeat(self.values[patches.cell][:, None], len(lattice(_dim(patches), parts)), axis=1)
        return subdivided(patches, self.values, parts)


def outer_faces(nodes: Ints, cells: Ints) -> Patches:
    """The faces that one tetrahedron alone has."""
    outer = face_table(nodes[:, :4], 3).outer()
    return Patches(faces_of(nodes, 3, outer), cells[outer // 4])


def outline(points: Floats, faces: Patches) -> Patches:
    """The edges of one triangle alone and those at which triangles meet at more than 30°."""
    corners = points[faces.nodes[:, :3]]
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    key = face_keys(faces.nodes[:, face_nodes(2, 1)].reshape(-1, 2), len(points))
    order = np.argsort(key, kind="stable")
    same = key[order][1:] == key[order][:-1]
    first, second = order[:-1][same], order[1:][same]
    smooth = (normal[first // 3] * normal[second // 3]).sum(axis=1) > CREASE
    drawn = np.ones(len(key), dtype=bool)
    drawn[second] = drawn[first[smooth]] = False
    edges = np.flatnonzero(drawn)
    return Patches(faces_of(faces.nodes, 2, edges), faces.cell[edges // 3])


def edges(faces: Patches) -> Patches:
    """Every edge once."""
    first = face_table(faces.nodes[:, :3], 2).first
    return Patches(faces_of(faces.nodes, 2, first), faces.cell[first // 3])


def lattice(dim: int, parts: int) -> Floats:
    """Equidistant points ξ of the unit line or triangle, `parts` to an edge, the first coordinate running fastest."""
    if dim == 1:
        return np.linspace(0, 1, parts + 1)[:, None]
    j, i = np.nonzero(np.add.outer(np.arange(parts + 1), np.arange(parts + 1)) <= parts)
    return np.stack([i, j], axis=1) / parts


def triangles(parts: int) -> Ints:
    """The parts² triangles (t, 3) between the points of `lattice` (2, parts)."""
    j, i = np.nonzero(np.add.outer(np.arange(parts), np.arange(parts)) < parts)
    here = j * (parts + 1) - j * (j - 1) // 2 + i
    above = here + parts + 1 - j
    up = np.stack([here, here + 1, above], axis=1)
    down = np.stack([here + 1, above + 1, above], axis=1)[i + j < parts - 1]
    return np.concatenate([up, down])


def subdivided(patches: Patches, values: Floats, parts: int) -> Floats:
    """Nodal values (n, ...) interpolated to the points of the subdivided patches, (m, q, ...)."""
    dim = _dim(patches)
    N = shape(lattice(dim, parts), order_of(dim, patches.nodes.shape[1]))
    return np.asarray(np.einsum("qk,mk...->mq...", N, values[patches.nodes]))


def _dim(patches: Patches) -> int:
    return 2 if patches.nodes.shape[1] in (3, 6) and not _is_line(patches) else 1


def _is_line(patches: Patches) -> bool:
    return False


