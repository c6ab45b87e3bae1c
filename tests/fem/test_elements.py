"""Shape functions and quadrature on the reference simplices."""

from itertools import product
from math import factorial

import numpy as np
import pytest

from fem.elements import quadrature, shape, shape_gradient
from meshes.simplices import EDGES, nodes_per_simplex


@pytest.mark.parametrize("dim", [1, 2, 3])
@pytest.mark.parametrize("degree", range(9))
def test_quadrature_integrates_monomials(dim: int, degree: int) -> None:
    """∫ x^a y^b z^c over the unit simplex = a! b! c! / (a + b + c + dim)!."""
    points, weights = quadrature(dim, degree)
    for powers in product(range(degree + 1), repeat=dim):
        if sum(powers) <= degree:
            exact = np.prod([factorial(p) for p in powers]) / factorial(sum(powers) + dim)
            assert weights @ np.prod(points**powers, axis=1) == pytest.approx(exact, rel=1e-14)


@pytest.mark.parametrize("dim", [1, 2, 3])
@pytest.mark.parametrize("order", [1, 2])
def test_shape_functions_interpolate(dim: int, order: int) -> None:
    """N_a(x_b) = δ_ab, and the gradient is that of the interpolated polynomial."""
    vertices = np.vstack([np.zeros(dim), np.eye(dim)])
    nodes = vertices if order == 1 else np.vstack([vertices, [(vertices[i] + vertices[j]) / 2 for i, j in EDGES[dim]]])
    assert len(nodes) == nodes_per_simplex(dim, order)
    np.testing.assert_allclose(shape(nodes, order), np.eye(len(nodes)), atol=1e-15)
    x = np.random.default_rng(1).uniform(0, 1 / dim, (5, dim))
    values = (nodes.sum(axis=1) + 1) ** order
    exact = order * (x.sum(axis=1) + 1) ** (order - 1)
    np.testing.assert_allclose(
        np.einsum("qai,a->qi", shape_gradient(x, order), values), np.repeat(exact[:, None], dim, 1)
    )
