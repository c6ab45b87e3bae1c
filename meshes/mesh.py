"""A mesh of simplices with named facets and regions."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from meshes.simplices import face_nodes, jacobians, nodes_per_simplex

FLAT = 1e-12
"""A Jacobian determinant at or below this multiple of the cell's size to the power d counts as degenerate."""


class FaceTable(NamedTuple):
    """The distinct faces of some cells, sorted by key.

    key : (F,) int64, the sorted vertices as one number.
    first : (F,) int64, (cell)(d + 1) + (local face) of the lowest cell that has the face.
    cells : (F,) int64, how many cells have it.
    """

    key: NDArray[np.int64]
    first: NDArray[np.int64]
    cells: NDArray[np.int64]

    def outer(self) -> NDArray[np.int64]:
        """The faces of one cell alone, as `first` numbers them, in the order of the cells."""
        return np.sort(self.first[self.cells == 1])


def face_keys(faces: NDArray[np.int64], nodes: int) -> NDArray[np.int64]:
    """One number per face, the same for every order of its vertices; faces (f, d), nodes below `nodes`."""
    return np.asarray(np.ravel_multi_index(tuple(np.sort(faces, axis=1).T), (nodes,) * faces.shape[1]))


def face_table(cells: NDArray[np.int64], dim: int) -> FaceTable:
    """Distinct faces of the cells (m, k) of dimension `dim`."""
    faces = cells[:, face_nodes(dim, 1)].reshape(-1, dim)
    return FaceTable(*np.unique(face_keys(faces, int(cells.max()) + 1), return_index=True, return_counts=True))


def faces_of(cells: NDArray[np.int64], dim: int, which: NDArray[np.int64]) -> NDArray[np.int64]:
    """Nodes (f, kf) of the faces `which` = (cell)(d + 1) + (local face), outward oriented."""
    order = 1 if cells.shape[1] == dim + 1 else 2
    cell, local = np.divmod(which, dim + 1)
    return cells[cell[:, None], face_nodes(dim, order)[local]]


@dataclass(frozen=True, eq=False)
class Mesh:
    """Simplices with named facets and regions; the arrays are read-only.

    Nodes that no cell uses are dropped and the others renumbered. A facet may be given by its vertices alone; it is
    kept with all its nodes, oriented by the right-hand rule (in the plane: normal to the right of the direction) out of
    the cell behind it, the lower-numbered one where there are two. Facets and regions are kept sorted by cell, each
    once.

    Parameters
    ----------
    points : (n, d) float64 [m], d = 1, 2 or 3
    cells : (m, k) int64
        Simplices of dimension d, linear (k = d + 1) or quadratic (line3, triangle6, tetra10), in VTK's node order.
    facets : dict of str to (f, kf) int64
        By name, the nodes of facets of dimension d - 1.
    regions : dict of str to (r,) int64
        By name, indices into `cells`.

    Raises
    ------
    ValueError
        Wrong shapes, coordinates that are not finite, indices out of range, a facet of no cell, a facet of more than
        two cells, inverted or degenerate cells: det(∂x/∂ξ) ≤ `FLAT` s^d at a node, s² the sum of the squared lengths
        of the edges at the first vertex.
    """

    points: NDArray[np.float64]
    cells: NDArray[np.int64]
    facets: Mapping[str, NDArray[np.int64]] = field(default_factory=dict)
    regions: Mapping[str, NDArray[np.int64]] = field(default_factory=dict)

    def __post_init__(self) -> None:
        points = np.array(self.points, dtype=np.float64)
        cells = _integers("cells", self.cells)
        _check_shapes(points, cells)
        used = np.zeros(len(points), dtype=bool)
        used[cells] = True
        number = np.where(used, np.cumsum(used) - 1, -1)
        self._keep(points=points[used], cells=number[cells])
        self._check_cells()
        self._keep(
            facets={tag: self._named_facets(tag, given, number) for tag, given in self.facets.items()},
            regions={tag: self._named_cells(tag, given) for tag, given in self.regions.items()},
        )

    def _keep(self, **values: NDArray[np.generic] | dict[str, NDArray[np.int64]]) -> None:
        for name, value in values.items():
            for array in value.values() if isinstance(value, dict) else [value]:
                array.flags.writeable = False
            object.__setattr__(self, name, value)

    @property
    def dim(self) -> int:
        """Dimension of the space and of the cells."""
        return int(self.points.shape[1])

    @property
    def order(self) -> int:
        """1 for linear cells, 2 for quadratic ones."""
        return 1 if self.cells.shape[1] == self.dim + 1 else 2

    def facet(self, tag: str) -> NDArray[np.int64]:
        """Nodes (f, kf) of the facets named `tag`; ValueError if there is no such name."""
        if tag not in self.facets:
            raise ValueError(f"facet tag {tag!r}: must be one of {', '.join(sorted(self.facets)) or '(none: no tags)'}")
        return self.facets[tag]

    def boundary(self) -> NDArray[np.int64]:
        """Nodes (f, kf) of all facets that belong to one cell, outward oriented."""
        return faces_of(self.cells, self.dim, self._faces.outer())

    def facet_cells(self, facets: NDArray[np.int64]) -> NDArray[np.int64]:
        """The cell (f,) behind each of the facets (f, kf), the lower-numbered one where there are two."""
        return self._find(facets) // (self.dim + 1)

    @cached_property
    def _faces(self) -> FaceTable:
        return face_table(self.cells, self.dim)

    def _find(self, facets: NDArray[np.int64]) -> NDArray[np.int64]:
        """(cell)(d + 1) + (local face) of facets, -1 where no cell has them."""
        vertices = facets[:, : self.dim]
        top = int(self.cells.max())
        known = ((vertices >= 0) & (vertices <= top)).all(axis=1)
        key = face_keys(np.where(known[:, None], vertices, 0), top + 1)
        at = np.minimum(np.searchsorted(self._faces.key, key), len(self._faces.key) - 1)
        return np.where(known & (self._faces.key[at] == key), self._faces.first[at], -1)

    def _named_facets(self, tag: str, given: ArrayLike, number: NDArray[np.int64]) -> NDArray[np.int64]:
        facets = _integers(f"facets {tag!r}", given)
        kf = nodes_per_simplex(self.dim - 1, self.order)
        if facets.size == 0:
            return np.empty((0, kf), dtype=np.int64)
        if facets.ndim != 2 or facets.shape[1] not in (self.dim, kf):
            raise ValueError(f"facets {tag!r}: shape {facets.shape}: must be (f, {self.dim}) or (f, {kf})")
        inside = (facets >= 0) & (facets < len(number))
        which = self._find(np.where(inside, number[np.where(inside, facets, 0)], -1))
        if (lost := np.flatnonzero(which < 0)).size:
            raise ValueError(
                f"facets {tag!r}: {lost.size} of {len(facets)} are facets of no cell, "
                f"the first has the nodes {facets[lost[0]].tolist()}"
            )
        return faces_of(self.cells, self.dim, np.unique(which))

    def _named_cells(self, tag: str, given: ArrayLike) -> NDArray[np.int64]:
        cells = np.unique(_integers(f"regions {tag!r}", given))
        if cells.size and (cells[0] < 0 or cells[-1] >= len(self.cells)):
            raise ValueError(f"regions {tag!r}: cell {cells[[0, -1]].tolist()}: must be in 0 .. {len(self.cells) - 1}")
        return cells

    def _check_cells(self) -> None:
        if (bad := np.flatnonzero(~np.isfinite(self.points).all(axis=1))).size:
            raise ValueError(f"points: {bad.size} of {len(self.points)} have coordinates that are not finite numbers")
        vertices = self.points[self.cells[:, : self.dim + 1]]
        edges = vertices[:, 1:] - vertices[:, :1]
        size = np.sqrt(np.einsum("mij,mij->m", edges, edges))
        bad = np.flatnonzero(jacobians(self.points, self.cells) <= FLAT * size**self.dim)
        if bad.size:
            centroid = ", ".join(f"{x:.6g}" for x in vertices[bad[0]].mean(axis=0))
            raise ValueError(
                f"cells: {bad.size} of {len(self.cells)} are inverted or degenerate (Jacobian not positive at every "
                f"node), the first is cell {bad[0]} with its centroid at ({centroid})"
            )
        if (many := np.flatnonzero(self._faces.cells > 2)).size:
            cell = self._faces.first[many].min() // (self.dim + 1)
            raise ValueError(f"cells: {many.size} facets belong to more than two cells, the first to cell {cell}")


def _integers(name: str, given: ArrayLike) -> NDArray[np.int64]:
    values = np.asarray(given)
    if values.size and not np.issubdtype(values.dtype, np.integer):
        raise ValueError(f"{name}: {values.dtype} values: must be integers")
    return values.astype(np.int64)


def _check_shapes(points: NDArray[np.float64], cells: NDArray[np.int64]) -> None:
    if points.ndim != 2 or points.shape[1] not in (1, 2, 3):
        raise ValueError(f"points: shape {points.shape}: must be (n, 1), (n, 2) or (n, 3)")
    dim = points.shape[1]
    allowed = [nodes_per_simplex(dim, order) for order in (1, 2)]
    if cells.ndim != 2 or cells.shape[1] not in allowed:
        raise ValueError(
            f"cells: shape {cells.shape}: must be (m, {allowed[0]}) or (m, {allowed[1]}) in dimension {dim}"
        )
    if len(cells) == 0:
        raise ValueError("cells: none: must be at least one")
    for node in (cells.min(), cells.max()):
        if not 0 <= node < len(points):
            raise ValueError(f"cells: node {node}: must be in 0 .. {len(points) - 1}")
