"""Reference simplices: Lagrange shape functions of order 1 and 2, and quadrature.

Nodes are in VTK order: vertices, then the middles of the edges as listed in `meshes.simplices.EDGES`.
"""

from __future__ import annotations

from functools import cache
from itertools import product

import numpy as np
from numpy.typing import NDArray
from scipy.special import roots_jacobi

from meshes.simplices import EDGES

Floats = NDArray[np.float64]


def order_of(dim: int, nodes: int) -> int:
    """The order of a simplex from its number of nodes."""
    return 1 if nodes == dim + 1 else 2


def _barycentric(xi: Floats) -> tuple[Floats, Floats]:
    dim = xi.shape[1]
    gradients = np.vstack([-np.ones(dim), np.eye(dim)])
    return np.column_stack([1.0 - xi.sum(axis=1), xi]), gradients


def shape(xi: Floats, order: int) -> Floats:
    """N_a(ξ), shape (points, nodes); ξ in the unit simplex, shape (points, dim)."""
    L, _ = _barycentric(xi)
    if order == 1:
        return L
    edges = np.array(EDGES[xi.shape[1]], dtype=int).reshape(-1, 2)
    return np.hstack([L * (2 * L - 1), 4 * L[:, edges[:, 0]] * L[:, edges[:, 1]]])


def shape_gradient(xi: Floats, order: int) -> Floats:
    """∂N_a/∂ξ_i, shape (points, nodes, dim)."""
    L, dL = _barycentric(xi)
    if order == 1:
        return np.broadcast_to(dL, (len(xi), *dL.shape)).copy()
    edges = np.array(EDGES[xi.shape[1]], dtype=int).reshape(-1, 2)
    i, j = edges[:, 0], edges[:, 1]
    at_vertices = (4 * L - 1)[:, :, None] * dL
    at_edges = 4 * (L[:, i, None] * dL[j] + L[:, j, None] * dL[i])
    return np.concatenate([at_vertices, at_edges], axis=1)


@cache
def quadrature(dim: int, degree: int) -> tuple[Floats, Floats]:
    """Points and weights that integrate polynomials of total degree `degree` over the unit simplex exactly.

    Symmetric rules where they are cheaper (degree 2: Hammer and Stroud; triangle, degree 4: Dunavant 1985;
    tetrahedron, degree 5: Walkington 2000), else Gauss–Jacobi rules collapsed from the cube (Stroud and Secrest).
    """
    if dim == 0:
        return np.zeros((1, 0)), np.ones(1)
    if degree <= 1:
        return np.full((1, dim), 1 / (dim + 1)), np.array([1 / (1, 1, 2, 6)[dim]])
    if dim == 2 and degree == 2:
        return _orbits(2, [(1 / 6, 1 / 6)])
    if dim == 2 and degree in (3, 4):
        return _orbits(
            2, [(0.445948490915964886, 0.111690794839005733), (0.0915762135097707435, 0.0549758718276609338)]
        )
    if dim == 3 and degree == 2:
        return _orbits(3, [((5 - 5**0.5) / 20, 1 / 24)])
    if dim == 3 and degree in (3, 4, 5):
        a, b, c = 0.310885919263300610, 0.0927352503108912264, 0.0455037041256496495
        points, weights = _orbits(3, [(a, 0.0187813209530026418), (b, 0.0122488405193936583)])
        pairs = np.array([[c if k in pair else 0.5 - c for k in range(1, 4)] for pair in EDGES[3]])
        return np.vstack([points, pairs]), np.append(weights, np.full(6, 0.00709100346284691107))
    return _collapsed(dim, degree)


def _orbits(dim: int, rules: list[tuple[float, float]]) -> tuple[Floats, Floats]:
    """Rules whose points have all barycentric coordinates but one equal to a."""
    vertices = np.vstack([np.zeros(dim), np.eye(dim)])
    points = [a + (1 - (dim + 1) * a) * vertices for a, _ in rules]
    return np.vstack(points), np.repeat([w for _, w in rules], dim + 1)


def _collapsed(dim: int, degree: int) -> tuple[Floats, Floats]:
    n = degree // 2 + 1
    axes = [roots_jacobi(n, dim - 1 - k, 0) for k in range(dim)]
    points, weights = [], []
    for index in product(range(n), repeat=dim):
        rest, weight, point = 1.0, 1.0, []
        for k, i in enumerate(index):
            t = (axes[k][0][i] + 1) / 2
            weight *= axes[k][1][i] / 2 ** (dim - k)
            point.append(rest * t)
            rest *= 1 - t
        points.append(point)
        weights.append(weight)
    return np.array(points), np.array(weights)
