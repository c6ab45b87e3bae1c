"""Isoparametric maps: weights, shape functions and their gradients at the quadrature points of cells and facets."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fem.elements import order_of, quadrature, shape, shape_gradient
from meshes.simplices import EDGES

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]


@dataclass(frozen=True)
class MappedCells:
    """m cells with k nodes at q quadrature points each.

    weights : w |J|, times 2πr in axisymmetry, (m, q) [m^dim]
    values : N_a, (q, k)
    gradients : ∂N_a/∂x_i, (m, q, k, dim) [1/m]
    points : (m, q, dim) [m]
    """

    weights: Floats
    values: Floats
    gradients: Floats
    points: Floats


@dataclass(frozen=True)
class MappedFacets:
    """f facets with k nodes at q quadrature points each; `normals` (f, q, d) are unit vectors out of the body."""

    weights: Floats
    values: Floats
    normals: Floats
    points: Floats


def is_straight(points: Floats, cells: Ints) -> bool:
    """Whether every cell is the affine image of the reference simplex."""
    dim = points.shape[1]
    if order_of(dim, cells.shape[1]) == 1:
        return True
    nodes = shape(np.vstack([np.zeros(dim), np.eye(dim)]), 1)
    edges = np.array(EDGES[dim])
    middles = (nodes[edges[:, 0]] + nodes[edges[:, 1]]) / 2
    x = points[cells]
    corners = x[:, : dim + 1]
    sizes = np.ptp(corners, axis=1).max(axis=1)
    return bool(np.all(np.abs(x[:, dim + 1 :] - middles @ corners).max(axis=(1, 2)) <= 1e-10 * sizes))


def map_cells(points: Floats, cells: Ints, degree: int, axisymmetric: bool = False) -> MappedCells:
    """Map a quadrature rule of the given degree to `cells`; in axisymmetry x = (r, z)."""
    dim = points.shape[1]
    order = order_of(dim, cells.shape[1])
    xi, w = quadrature(dim, degree)
    x = points[cells]
    reference = shape_gradient(xi, order)
    J = np.einsum("qai,maj->mqij", reference, x, optimize=True)
    inverse, determinant = _inverse(J)
    gradients = np.matmul(reference[None], inverse.swapaxes(2, 3))
    values = shape(xi, order)
    at = np.matmul(values, x)
    weights = w * determinant
    if axisymmetric:
        weights = weights * 2 * np.pi * at[:, :, 0]
    return MappedCells(weights, values, gradients, at)


def _inverse(J: Floats) -> tuple[Floats, Floats]:
    """J⁻¹ and |J| of many small matrices by cofactors, several times faster than one LAPACK call for each."""
    d = J.shape[-1]
    if d == 1:
        return 1 / J, J[..., 0, 0]
    if d == 2:
        cofactors = np.stack([J[..., ::-1, 1] * [1.0, -1.0], J[..., ::-1, 0] * [-1.0, 1.0]], axis=-2)
    else:
        a, b, c = J[..., 0, :], J[..., 1, :], J[..., 2, :]
        cofactors = np.stack([np.cross(b, c), np.cross(c, a), np.cross(a, b)], axis=-1)
    determinant = np.einsum("...i,...i->...", J[..., 0, :], cofactors[..., :, 0])
    return cofactors / determinant[..., None, None], determinant


def map_facets(points: Floats, facets: Ints, degree: int, axisymmetric: bool = False) -> MappedFacets:
    """Map a quadrature rule to facets, whose nodes run so that the normal points out of the body."""
    dim = points.shape[1]
    xi, w = quadrature(dim - 1, degree)
    order = order_of(dim - 1, facets.shape[1])
    values = shape(xi, order)
    x = points[facets]
    at = np.matmul(values, x)
    tangents = np.einsum("qai,fad->fqid", shape_gradient(xi, order), x)
    if dim == 1:
        normals = np.ones((len(facets), len(xi), 1))
    elif dim == 2:
        t = tangents[:, :, 0]
        normals = np.stack([t[..., 1], -t[..., 0]], axis=-1)
    else:
        normals = np.cross(tangents[:, :, 0], tangents[:, :, 1])
    area = np.linalg.norm(normals, axis=-1)
    weights = w * area
    if axisymmetric:
        weights = weights * 2 * np.pi * at[:, :, 0]
    return MappedFacets(weights, values, normals / area[..., None], at)
