"""The Delassus operator: its entries, which columns it solves for, and a size that it refuses."""

import os
from collections.abc import Callable

import numpy as np
import pytest
import scipy.sparse as sp
from contact_examples import box, held, solid
from numpy.typing import NDArray

from contact.delassus import CompliantDelassus
from contact.points import nodal
from contact.rows import SparseRows
from fem.body import Body
from fem.loads import Support

Floats = NDArray[np.float64]
Rows = sp.csr_array
Solve = Callable[[Rows], Floats]


@pytest.fixture(scope="module")
def bodies() -> list[Body]:
    """Two bodies held on their right sides; the second floats."""
    first = solid(box(2, 2), "plane-strain", Support("right"))
    second = solid(box(2, 1), "plane-strain", Support("right", 0))
    return [held(first), held(second)]


def _operator(bodies: list[Body]) -> tuple[CompliantDelassus, Floats]:
    """H about the bottoms, oblique, of both bodies in common rows, and W by dense algebra."""
    H, W = {}, 0.0
    count = nodal(bodies[1], "bottom").count
    for body, sign in zip(bodies, (1, -1), strict=True):
        points = nodal(body, "bottom")
        h = points.matrix(np.tile([0.6 * sign, 0.8 * sign], (len(points.nodes), 1)))[:count].tolil()
        h[:, body.held] = 0
        matrix = h.tocsr()
        matrix.eliminate_zeros()
        H[body] = SparseRows(matrix)
        h = matrix.toarray()
        W = W + h @ np.linalg.solve(body.A[:, :], h.T)
    return CompliantDelassus(H, count), W


def test_entries(bodies: list[Body]) -> None:
    """W = Σ_b H_b A_b⁻¹ H_bᵀ, symmetric, and its diagonal."""
    operator, W = _operator(bodies)
    rows = np.arange(operator.size)
    np.testing.assert_allclose(operator.columns(rows), W, atol=1e-13 * np.abs(W).max())
    np.testing.assert_allclose(operator.columns(rows), operator.columns(rows).T, atol=1e-13 * np.abs(W).max())
    np.testing.assert_array_equal(operator.diagonal(rows), np.diag(operator.columns(rows)))


def test_diagonal_costs_no_solve(bodies: list[Body]) -> None:
    """Entries whose columns were not formed are infinite."""
    operator, W = _operator(bodies)
    assert np.all(np.isinf(operator.diagonal(np.arange(4))))
    operator.columns(np.array([2]))
    np.testing.assert_allclose(operator.diagonal(np.array([1, 2])), [np.inf, W[2, 2]], rtol=1e-12)
    assert operator.solved == 1


def test_each_column_is_solved_for_once(bodies: list[Body], monkeypatch: pytest.MonkeyPatch) -> None:
    """Columns are formed for the rows asked for, in their order, repeated or not, and kept."""
    operator, W = _operator(bodies)
    counts = dict.fromkeys(bodies, 0)
    for body in bodies:

        def counting(H: Rows, body: Body = body, solve: Solve = body.solve_rows) -> Floats:
            counts[body] += H.shape[0]
            return solve(H)

        monkeypatch.setattr(body, "solve_rows", counting)
    for rows, solved in [([2, 0], 2), ([0, 2, 2], 2), ([1, 2], 3), ([], 3), ([3, 2, 1, 0], 4)]:
        found = operator.columns(np.array(rows, dtype=int))
        np.testing.assert_allclose(found, W[:, rows], atol=1e-13 * np.abs(W).max())
        assert operator.solved == solved
        assert all(count <= solved for count in counts.values())
    # the corner of the first body is held: no row moves it
    assert list(counts.values()) == [3, 4]


def test_blocks_are_bounded(bodies: list[Body], monkeypatch: pytest.MonkeyPatch) -> None:
    """With room for one right-hand side the columns come one by one, and are the same."""
    operator, W = _operator(bodies)
    monkeypatch.setattr("contact.delassus.BLOCK_BYTES", 1)
    widths = []
    solve = bodies[0].solve_rows
    monkeypatch.setattr(bodies[0], "solve_rows", lambda H: widths.append(H.shape[0]) or solve(H))
    np.testing.assert_allclose(operator.columns(np.arange(operator.size)), W, atol=1e-13 * np.abs(W).max())
    assert set(widths) == {1}


def test_a_body_that_a_row_does_not_touch_is_not_solved(bodies: list[Body], monkeypatch: pytest.MonkeyPatch) -> None:
    """A column of W costs a solve only on the bodies that its row moves."""
    operator, _ = _operator(bodies)
    H = {bodies[0]: operator.H[bodies[0]], bodies[1]: operator.H[bodies[1]].blank(operator.size)}
    monkeypatch.setattr(bodies[1], "solve_rows", lambda H: pytest.fail("solved"))
    assert CompliantDelassus(H, operator.size).columns(np.array([1])).shape == (operator.size, 1)


def test_too_large_is_refused_with_its_size(bodies: list[Body], monkeypatch: pytest.MonkeyPatch) -> None:
    """The message names columns, rows and gigabytes, and nothing is solved."""
    operator, _ = _operator(bodies)
    real = os.sysconf
    monkeypatch.setattr(
        os, "sysconf", lambda name: 5 if name == "SC_PHYS_PAGES" else 10 if name == "SC_PAGE_SIZE" else real(name)
    )
    with pytest.raises(ValueError, match=r"needs 3 columns of 4 rows, 9.6e-08 GB.*memory \(2.5e-08 GB\)"):
        operator.columns(np.arange(3))
    assert operator.solved == 0
