"""Matrices in rows of eight numbers: their products are those of dense algebra, and what lies beside stays."""

from __future__ import annotations

import numpy as np

from fem.beams import block_products as blocks

A, B, C = np.random.default_rng(0).normal(size=(3, 6, 6))


def laid_out(*matrices):
    """Matrices one after the other, in rows of eight."""
    return np.concatenate([np.pad(matrix, [(0, 0), (0, 2)]).ravel() for matrix in matrices])


def matrix(F, number):
    """One of them back, and its padding."""
    both = F.reshape(-1, 6, 8)[number]
    return both[:, :6], both[:, 6:]


def test_product():
    F = laid_out(A, B, C)
    blocks.product(-1.0, blocks.rows(F, 0), F, blocks.MATRIX, 2 * blocks.MATRIX)
    for number, expected in enumerate((A, B, -A @ B)):
        found, padding = matrix(F, number)
        np.testing.assert_allclose(found, expected, atol=1e-14)
        assert not padding.any()


def test_product_of_a_weighed_transpose_is_added():
    p = np.arange(1.0, 7.0)
    F = laid_out(A, B, C)
    blocks.add_product(-2.0, blocks.weighed(blocks.columns(F, 0), tuple(p)), F, blocks.MATRIX, 2 * blocks.MATRIX)
    np.testing.assert_allclose(matrix(F, 2)[0], C - 2 * A.T @ np.diag(p) @ B, atol=1e-13)


def test_transpose_and_copy():
    F, G = laid_out(A, B), np.full(3 * blocks.MATRIX, np.nan)
    blocks.transpose(F, 0, G, blocks.MATRIX)
    blocks.copy(F, blocks.MATRIX, G, 2 * blocks.MATRIX)
    assert np.isnan(G[: blocks.MATRIX]).all()
    for number, expected in ((1, A.T), (2, B)):
        found, padding = matrix(G, number)
        np.testing.assert_array_equal(found, expected)
        assert not padding.any()
