"""Maps of cells and facets: volumes, areas, normals, and which cells are straight."""

import numpy as np
import pytest
from fem_examples import block

from fem.geometry import is_straight, map_cells, map_facets
from meshes.generators import generate


@pytest.mark.parametrize("dim", [2, 3])
@pytest.mark.parametrize("order", [1, 2])
def test_divergence_theorem(dim: int, order: int) -> None:
    """On curved cells too: ∫ dx = 1, ∫ n ds = 0, ∫ x·n ds = d ∫ dx, and Σ_a ∇N_a = 0, Σ_a x_a ∇N_a = I."""
    mesh = block(dim, order, bend=0.05)
    cells = map_cells(mesh.points, mesh.cells, 6)
    facets = map_facets(mesh.points, mesh.boundary(), 4)
    assert cells.weights.sum() == pytest.approx(1, rel=1e-13)
    np.testing.assert_allclose(np.einsum("fq,fqd->d", facets.weights, facets.normals), 0, atol=1e-14)
    assert np.einsum("fq,fqd,fqd->", facets.weights, facets.normals, facets.points) == pytest.approx(dim, rel=1e-13)
    np.testing.assert_allclose(cells.gradients.sum(axis=2), 0, atol=1e-11)
    identity = np.einsum("mqai,maj->mqij", cells.gradients, mesh.points[mesh.cells])
    np.testing.assert_allclose(identity, np.broadcast_to(np.eye(dim), identity.shape), atol=1e-12)


def test_weights_of_revolution() -> None:
    """∫ 2πr ds over a disc about (2, 0) is Pappus' volume and area of the torus."""
    disc = generate("disc", radius=0.5, h=0.1, order=2)
    points = disc.points + np.array([2.0, 0.0])
    volume = map_cells(points, disc.cells, 6, axisymmetric=True).weights.sum()
    area = map_facets(points, disc.boundary(), 6, axisymmetric=True).weights.sum()
    assert volume == pytest.approx((2 * np.pi * 2) * (np.pi * 0.5**2), rel=1e-5)
    assert area == pytest.approx((2 * np.pi * 2) * (2 * np.pi * 0.5), rel=1e-5)


@pytest.mark.parametrize("dim", [1, 2, 3])
def test_values_follow_the_map(dim: int) -> None:
    """Σ_a N_a f(x_a) at the points is f for the polynomials that the element holds."""
    mesh = generate("interval", length=1.0, n=3, order=2) if dim == 1 else block(dim, 2)
    mapped = map_cells(mesh.points, mesh.cells, 2)
    nodal = (mesh.points.sum(axis=1) + 2) ** 2
    np.testing.assert_allclose(nodal[mesh.cells] @ mapped.values.T, (mapped.points.sum(axis=2) + 2) ** 2, rtol=1e-13)


@pytest.mark.parametrize("dim", [2, 3])
def test_is_straight(dim: int) -> None:
    """A mid node out of place by a ten-millionth of the cell makes a curved cell; first-order cells are straight."""
    mesh = block(dim, 2)
    assert is_straight(mesh.points, mesh.cells)
    points = mesh.points.copy()
    points[mesh.cells[0, -1]] += 1e-7
    assert not is_straight(points, mesh.cells)
    first = block(dim, 1)
    assert is_straight(first.points, first.cells)
