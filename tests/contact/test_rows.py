"""Short rows at neighbouring unknowns do what the same rows do as a sparse matrix."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from contact.devices.element_rows import ElementRows
from contact.rows import SparseRows

SIZE, WIDTH = 48, 12


def example(count=9, seed=0):
    """Rows at element boundaries, the first and the last unknown among them, one all zero, and the same as a matrix."""
    rng = np.random.default_rng(seed)
    values = rng.normal(size=(count, WIDTH))
    first = 6 * rng.integers(0, (SIZE - WIDTH) // 6 + 1, count)
    if count > 3:
        first[:2], values[3] = (0, SIZE - WIDTH), 0.0
    short = ElementRows(values, first, SIZE)
    return short, SparseRows(short.sparse())


def dense(rows):
    return rows.sparse().toarray()


def test_sparse():
    """Row i has its entries from the unknown `first[i]` on."""
    short, _ = example()
    exact = np.zeros((9, SIZE))
    for row, values, first in zip(exact, short.values, short.first, strict=True):
        row[first : first + WIDTH] = values
    np.testing.assert_array_equal(dense(short), exact)


@pytest.mark.parametrize("count", [0, 1, 9, 60])
def test_products(count):
    short, matrix = example(count)
    rng = np.random.default_rng(1)
    u, lam = rng.normal(size=SIZE), rng.normal(size=count)
    np.testing.assert_allclose(short.apply(u), matrix.apply(u), atol=1e-14)
    np.testing.assert_allclose(short.apply_transpose(lam), matrix.apply_transpose(lam), atol=1e-13)
    lam[::2] = 0.0
    np.testing.assert_allclose(short.apply_transpose(lam), matrix.apply_transpose(lam), atol=1e-13)


def test_parts():
    """Chosen rows in any order, rows with columns emptied, and which rows are left; the originals stay."""
    short, matrix = example()
    before = dense(short)
    chosen = np.array([8, 1, 1, 3])
    np.testing.assert_array_equal(dense(short.take(chosen)), dense(matrix.take(chosen)))
    fixed = np.zeros(SIZE, dtype=bool)
    fixed[:WIDTH] = True
    np.testing.assert_array_equal(dense(short.without(fixed)), dense(matrix.without(fixed)))
    np.testing.assert_array_equal(short.without(fixed).touching(), matrix.without(fixed).touching())
    assert not short.without(fixed).touching()[[0, 3]].any()
    assert short.touching().sum() == 8
    np.testing.assert_array_equal(dense(short), before)


def test_join():
    """One below the other, blank rows between."""
    short, matrix = example()
    other, other_matrix = example(4, seed=2)
    joined = short.join([short.blank(3), other])
    exact = matrix.join([matrix.blank(3), other_matrix])
    np.testing.assert_array_equal(dense(joined), dense(exact))
    assert not joined.touching()[9:12].any()
    assert short.join([]) is short
    u = np.random.default_rng(3).normal(size=SIZE)
    np.testing.assert_allclose(joined.apply(u), exact.apply(u), atol=1e-14)


@pytest.mark.parametrize("chosen", [[], [5], [0, 8, 3, 2]], ids=str)
def test_columns_of_the_delassus_operator(chosen):
    """H A⁻¹ Hᵀ for some columns, by the dense and by the sparse interface of a body."""
    short, matrix = example()
    G = np.random.default_rng(4).normal(size=(SIZE, SIZE))
    A = G @ G.T + np.eye(SIZE)
    body = SimpleNamespace(
        solve=lambda B: np.linalg.solve(A, B), solve_rows=lambda rows: np.linalg.solve(A, rows.toarray().T)
    )
    rows = np.array(chosen, dtype=np.int64)
    H = dense(short)
    exact = H @ np.linalg.solve(A, H[rows].T)
    np.testing.assert_allclose(short.solve(body, rows), exact, atol=1e-11)
    np.testing.assert_allclose(matrix.solve(body, rows), exact, atol=1e-11)
