"""The simplices of one, two and three dimensions: numbering of nodes, edges and faces, and the Jacobian at the nodes.

Nodes are in VTK's order: the vertices, then for quadratic simplices one mid node per edge in the order of `EDGES`.
"""

from __future__ import annotations

from functools import cache

import numpy as np
from numpy.typing import NDArray

EDGES = {
    0: (),
    1: ((0, 1),),
    2: ((0, 1), (1, 2), (2, 0)),
    3: ((0, 1), (1, 2), (0, 2), (0, 3), (1, 3), (2, 3)),
}
"""Vertices of the edges by dimension."""

FACES = {
    1: ((0,), (1,)),
    2: ((0, 1), (1, 2), (2, 0)),
    3: ((1, 2, 3), (0, 3, 2), (0, 1, 3), (0, 2, 1)),
}
"""Vertices of the faces by dimension; the right-hand rule points out of a simplex of positive volume."""

NAMES = {
    "vertex": (0, 1),
    "line": (1, 1),
    "triangle": (2, 1),
    "tetra": (3, 1),
    "line3": (1, 2),
    "triangle6": (2, 2),
    "tetra10": (3, 2),
}
"""Dimension and order by the name that VTK and meshio use."""


def nodes_per_simplex(dim: int, order: int) -> int:
    """Number of nodes of a simplex."""
    return dim + 1 + (len(EDGES[dim]) if order == 2 else 0)


@cache
def face_nodes(dim: int, order: int) -> NDArray[np.int64]:
    """Local nodes of the faces, outward oriented and in VTK's order.

    Returns
    -------
    (dim + 1, kf) int64
    """
    mid = {frozenset(edge): dim + 1 + i for i, edge in enumerate(EDGES[dim])}
    middles = [[mid[frozenset((face[a], face[b]))] for a, b in EDGES[dim - 1]] for face in FACES[dim]]
    return np.array(
        [[*face, *(middle if order == 2 else ())] for face, middle in zip(FACES[dim], middles, strict=True)]
    )


@cache
def _gradients(dim: int, order: int) -> NDArray[np.float64]:
    """∂N_k/∂ξ_a at the nodes q, (q, k, dim); one q for linear simplices, whose gradients are constant."""
    slope = np.vstack([-np.ones(dim), np.eye(dim)])  # of the barycentric coordinates L
    if order == 1:
        return slope[None]
    edges = np.array(EDGES[dim])
    L = np.vstack([np.eye(dim + 1), (np.eye(dim + 1)[edges[:, 0]] + np.eye(dim + 1)[edges[:, 1]]) / 2])
    vertices = (4 * L - 1)[:, :, None] * slope  # N_i = L_i (2 L_i - 1)
    i, j = edges.T
    middles = 4 * (L[:, i, None] * slope[j] + L[:, j, None] * slope[i])  # N_ij = 4 L_i L_j
    return np.concatenate([vertices, middles], axis=1)


def jacobians(points: NDArray[np.float64], cells: NDArray[np.int64]) -> NDArray[np.float64]:
    """Smallest Jacobian determinant min_q det(∂x/∂ξ)(ξ_q) over the nodes q of each simplex.

    Parameters
    ----------
    points : (n, d)
    cells : (m, k)

    Returns
    -------
    (m,) [m^d]; d! times the signed volume where the simplex is straight.
    """
    dim = points.shape[1]
    X = points[cells]
    order = 1 if cells.shape[1] == dim + 1 else 2
    smallest = np.full(len(cells), np.inf)
    for slope in _gradients(dim, order):  # node by node: all at once would hold k times the memory
        np.minimum(smallest, _determinant(slope.T @ X), out=smallest)
    return smallest


def _determinant(J: NDArray[np.float64]) -> NDArray[np.float64]:
    """Determinants of (m, d, d) matrices, d = 1, 2, 3, many times faster than LAPACK's."""
    if J.shape[1] == 1:
        return np.asarray(J[:, 0, 0])
    if J.shape[1] == 2:
        return J[:, 0, 0] * J[:, 1, 1] - J[:, 0, 1] * J[:, 1, 0]
    (a, b, c), (d, e, f), (g, h, i) = J.transpose(1, 2, 0)
    return np.asarray(a * (e * i - f * h) - b * (d * i - f * g) + c * (d * h - e * g))
