"""Triangulated surfaces given a thickness: the prism over each triangle, layer by layer, is cut into tetrahedra."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from meshes.mesh import Mesh
from meshes.parameters import bad, choice, count, number

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

LEAST_LAYERS = 2
"""Cells through a wall: one alone bends as a plate of a single element does."""

# The prism over a triangle a < b < c, base 0 and top 1, as three tetrahedra along the diagonals from the lower number
# at the base to the higher one at the top: neighbours cut their common side alike (Dompierre et al. 1999).
_PRISM = (((0, 0), (1, 0), (2, 0), (2, 1)), ((0, 0), (1, 0), (2, 1), (1, 1)), ((0, 0), (0, 1), (1, 1), (2, 1)))
_SIDE = (((0, 0), (1, 0), (1, 1)), ((0, 0), (1, 1), (0, 1)))
_EDGES = ((0, 1), (1, 2), (0, 2), (0, 3), (1, 3), (2, 3))
_BASE = {(0, 0): 0, (1, 1): 1, (2, 2): 2, (0, 1): 3, (1, 2): 4, (0, 2): 5}


def triangles_of(index: Ints, order: int) -> Ints:
    """Triangles (t, 3) or (t, 6) on a lattice of nodes (i, j), oriented from i to j.

    The diagonals alternate, so that a mesh with an even number of cells each way has no preferred hand.

    Parameters
    ----------
    index : (order·m + 1, order·n + 1), the node at each place; a closed lattice repeats its first row as the last
    """
    o = order
    i, j = np.meshgrid(*(np.arange(size // o) * o for size in np.subtract(index.shape, 1)), indexing="ij")
    i, j = i.ravel(), j.ravel()
    corners = np.stack([[i, j], [i + o, j], [i + o, j + o], [i, j + o]])  # (corner, axis, cell)
    turned = ((i + j) // o) % 2 == 1
    corners = np.where(turned, np.roll(corners, -1, axis=0), corners)
    at = np.concatenate([corners[[0, 1, 2]], corners[[0, 2, 3]]], axis=2)
    if o == 2:
        at = np.concatenate([at, (at + at[[1, 2, 0]]) // 2])
    return np.asarray(index[at[:, 0], at[:, 1]].T)


def edges_of(line: Ints, order: int) -> Ints:
    """Edges (e, 2) or (e, 3) along a line of nodes, middles last."""
    ends = [line[:-1:order], line[order::order]]
    return np.stack([*ends, line[1::2]] if order == 2 else ends, axis=1)


def through(layers: int, media: float | None, order: int) -> tuple[Floats, dict[str, Ints]]:
    """Levels of nodes through a wall, from 0 at the lumen to 1 outside, and by region its layers of cells.

    Parameters
    ----------
    layers : of cells through the wall, at least `LEAST_LAYERS`
    media : the inner region's part of the thickness, between 0 and 1; None where the wall is of one material
    """
    if count("layers", layers) < LEAST_LAYERS:
        raise bad("layers", layers, f"a whole number of at least {LEAST_LAYERS}")
    cuts, regions = np.linspace(0, 1, layers + 1), {}
    if media is not None:
        if not 0 < number("media", media) < 1:
            raise bad("media", media, "between 0 and 1, the media's part of the thickness")
        inner = min(max(round(media * layers), 1), layers - 1)
        cuts = np.append(np.linspace(0, media, inner + 1), np.linspace(media, 1, layers - inner + 1)[1:])
        regions = {"media": np.arange(inner), "adventitia": np.arange(inner, layers)}
    if order == 2:
        cuts = np.insert(cuts, np.arange(1, layers + 1), (cuts[:-1] + cuts[1:]) / 2)
    return cuts, regions


def thicken(
    triangles: Ints,
    rims: Mapping[str, Ints],
    points: Floats,
    faces: tuple[str, str] = ("lumen", "outer"),
    regions: Mapping[str, Ints] | None = None,
) -> Mesh:
    """The solid between a surface and the levels above it.

    Parameters
    ----------
    triangles : (t, 3) or (t, 6), oriented so that the levels rise along their normal
    rims : by tag, edges (e, 2) or (e, 3) of the surface, over which a side of the solid stands
    points : (levels, n, 3) [m], each node of the surface at each level; of a quadratic one every other level is middle
    faces : tags of the first and of the last level
    regions : by name, layers of cells, counted from 0
    """
    order = choice("order", 1 if triangles.shape[1] == 3 else 2, (1, 2))
    levels, n, _ = points.shape
    bases = n * np.arange(0, levels - 1, order)
    low, odd = _ascending(triangles)
    cells = np.stack([_nodes(low, corners, n, order) for corners in _PRISM], axis=1)
    cells[odd] = _mirrored(cells[odd])
    cells = cells.reshape(-1, cells.shape[2])
    per_layer = len(cells)
    sides = {}
    for tag, edges in rims.items():
        ends = np.sort(edges[:, :2], axis=1)
        vertices = np.concatenate([_nodes(ends, corners, n, order, middles=False) for corners in _SIDE])
        sides[tag] = np.concatenate([vertices + base for base in bases])
    return Mesh(
        points.reshape(-1, 3),
        np.concatenate([cells + base for base in bases]),
        {faces[0]: triangles[:, :3], faces[1]: triangles[:, :3] + n * (levels - 1), **sides},
        {
            name: np.concatenate([np.arange(k * per_layer, (k + 1) * per_layer) for k in which])
            for name, which in (regions or {}).items()
        },
    )


def _ascending(triangles: Ints) -> tuple[Ints, NDArray[np.bool_]]:
    """Triangles with their vertices in ascending order, and which of them that turns over."""
    order = np.argsort(triangles[:, :3], axis=1)
    result = np.take_along_axis(triangles[:, :3], order, axis=1)
    if triangles.shape[1] == 6:
        ends = np.sort(np.stack([order, np.roll(order, -1, axis=1)]), axis=0)
        middle = np.array([[0, 0, 2], [0, 0, 1], [2, 1, 0]])  # of the vertices 0 1, 1 2 and 2 0
        result = np.hstack([result, np.take_along_axis(triangles[:, 3:], middle[ends[0], ends[1]], axis=1)])
    a, b, c = order.T
    return result, (a - b) * (b - c) * (c - a) < 0


def _nodes(low: Ints, corners: tuple[tuple[int, int], ...], n: int, order: int, middles: bool = True) -> Ints:
    """Nodes (t, k) of the simplices with these corners (vertex, end) of prisms over `low`."""
    columns = [low[:, vertex] + n * order * end for vertex, end in corners]
    if order == 2 and middles:
        for p, q in _EDGES:
            (i, up), (j, down) = corners[p], corners[q]
            columns.append(low[:, _BASE[min(i, j), max(i, j)]] + n * (up + down))
    return np.stack(columns, axis=1)


def _mirrored(cells: Ints) -> Ints:
    """The same tetrahedra with their last two vertices exchanged."""
    swapped = [0, 1, 3, 2] if cells.shape[2] == 4 else [0, 1, 3, 2, 4, 8, 7, 6, 5, 9]
    return np.asarray(cells[:, :, swapped])
