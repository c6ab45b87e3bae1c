"""Distribution of a mesh over ranks."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from meshes.mesh import Mesh
from meshes.parameters import count


@dataclass(frozen=True, eq=False)
class Piece:
    """What one rank holds of a mesh: its cells, and all their nodes.

    Nodes have new global numbers, contiguous per rank. A rank's local nodes are those that it owns, in global order,
    and then the ghosts, in global order too. Cells and facets are in the order of the mesh.

    Parameters
    ----------
    points : (n, d) float64 [m]
    cells : (m, k) int64, local nodes
    facets : dict of str to (f, kf) int64, local nodes
        Facets of this rank's cells; each facet is on one rank. Every tag is there on every rank.
    regions : dict of str to (r,) int64, local cells
    nodes : (n,) int64, new global numbers of the local nodes; nodes[:owned] = offset … offset + owned − 1
    owned : int
    offset : int
    total : int
        Nodes of the whole mesh.
    original : (n,) int64, numbers of the local nodes in the mesh
    """

    points: NDArray[np.float64]
    cells: NDArray[np.int64]
    facets: Mapping[str, NDArray[np.int64]]
    regions: Mapping[str, NDArray[np.int64]]
    nodes: NDArray[np.int64]
    owned: int
    offset: int
    total: int
    original: NDArray[np.int64]


def partition(mesh: Mesh, parts: int) -> NDArray[np.int64]:
    """The part (m,) of each cell: recursive bisection of centroids across the longest extent (Berger & Bokhari, 1987).

    Parts differ by one cell at most; the same mesh always gives the same parts.

    Raises
    ------
    ValueError
        `parts` is not positive.
    """
    m = len(mesh.cells)
    count("parts", parts)
    centroids = mesh.points[mesh.cells[:, : mesh.dim + 1]].mean(axis=1)
    part = np.empty(m, dtype=np.int64)
    ends = np.arange(parts + 1) * m // parts  # how many cells the first parts have
    todo = [(np.arange(m), 0, parts)]
    while todo:
        cells, first, last = todo.pop()
        if last - first == 1 or not cells.size:
            part[cells] = first
            continue
        middle = (first + last) // 2
        axis = np.argmax(np.ptp(centroids[cells], axis=0))
        cells = cells[np.argsort(centroids[cells, axis], kind="stable")]
        lower = ends[middle] - ends[first]
        todo += [(np.sort(cells[:lower]), first, middle), (np.sort(cells[lower:]), middle, last)]
    return part


def split(mesh: Mesh, parts: int) -> list[Piece]:
    """The pieces of a mesh for ranks 0 … parts − 1.

    A node belongs to the lowest rank among the cells that touch it, a facet to the rank of the cell behind it.
    """
    part = partition(mesh, parts)
    owner = np.full(len(mesh.points), parts)
    np.minimum.at(owner, mesh.cells, part[:, None])
    by_number = np.argsort(owner, kind="stable")
    number = np.empty_like(by_number)
    number[by_number] = np.arange(len(by_number))
    offsets = np.searchsorted(owner[by_number], np.arange(parts + 1))
    facet_parts = {tag: part[mesh.facet_cells(facets)] for tag, facets in mesh.facets.items()}

    pieces = []
    for rank in range(parts):
        cells = np.flatnonzero(part == rank)
        offset, end = int(offsets[rank]), int(offsets[rank + 1])
        touched = np.unique(number[mesh.cells[cells]])  # every owned node is among them
        nodes = np.concatenate([np.arange(offset, end), touched[(touched < offset) | (touched >= end)]])
        original = by_number[nodes]
        local = np.full(len(mesh.points), -1)
        local[original] = np.arange(len(original))
        pieces.append(
            Piece(
                points=mesh.points[original],
                cells=local[mesh.cells[cells]],
                facets={tag: local[mesh.facets[tag][where == rank]] for tag, where in facet_parts.items()},
                regions={tag: np.flatnonzero(np.isin(cells, region)) for tag, region in mesh.regions.items()},
                nodes=nodes,
                owned=end - offset,
                offset=offset,
                total=len(mesh.points),
                original=original,
            )
        )
    return pieces
