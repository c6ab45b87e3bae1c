"""The numbering of unknowns and the assembled matrix."""

import numpy as np
import pytest
from fem_examples import block
from mpi4py import MPI

from fem.elasticity import Elasticity
from fem.space import Space


@pytest.mark.parametrize(("dim", "order", "mixed"), [(2, 1, False), (2, 2, True), (3, 1, False), (3, 2, True)])
def test_matrix_is_the_sum_of_its_cells(dim: int, order: int, mixed: bool) -> None:
    """`sum_matrices` and `sum_cells` equal a loop over the cells, and one block is one node's components."""
    mesh = block(dim, order, n=2)
    space = Space(MPI.COMM_SELF, mesh, dim, mixed)
    vertices = len(np.unique(mesh.cells[:, : dim + 1])) if mixed else 0
    assert space.size == space.owned == dim * len(mesh.points) + vertices
    np.testing.assert_array_equal(np.sort(space.local_dofs), np.arange(space.size))

    model = Elasticity(2.0, 0.3, "plane-strain" if dim == 2 else "3d", mixed)
    K = model.stiffness(space.piece.points, space.piece.cells)
    dense, vector = np.zeros((space.size, space.size)), np.zeros(space.size)
    for matrix, local in zip(K, space.cell_dofs, strict=True):
        dofs = space.local_dofs[local]
        dense[np.ix_(dofs, dofs)] += matrix
        vector[dofs] += matrix[0]
    A = space.sum_matrices(K)
    np.testing.assert_allclose(A[:, :], dense, atol=1e-14 * np.abs(dense).max())
    np.testing.assert_allclose(space.sum_cells(K[:, 0]), vector, atol=1e-14 * np.abs(vector).max())
    assert A.getBlockSize() == (1 if mixed else dim)
    A.destroy()


def test_local_and_sum_are_transposed() -> None:
    """sum(v)·w = v·local(w) for every v and w."""
    space = Space(MPI.COMM_SELF, block(2, 2), 2, mixed=True)
    rng = np.random.default_rng(0)
    v, w = rng.normal(size=len(space.local_dofs)), rng.normal(size=space.owned)
    assert space.sum(v) @ w == pytest.approx(v @ space.local(w), rel=1e-13)


def test_dofs_of_nodes() -> None:
    """The unknowns of nodes a, b are c a, c a + 1, …, c b, c b + 1, … ."""
    space = Space(MPI.COMM_SELF, block(3, 1, n=1), 3)
    np.testing.assert_array_equal(
        space.dofs_of(np.array([[0, 2], [5, 1]])), [[0, 1, 2, 6, 7, 8], [15, 16, 17, 3, 4, 5]]
    )
