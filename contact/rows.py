"""Rows of H = ∂δ/∂u on one body: as a sparse matrix, or as short rows at neighbouring unknowns of a beam."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Protocol, Self

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from contact import row_kernels

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]
Bools = NDArray[np.bool_]


class Rows(Protocol):
    """The columns of H that belong to one body's owned unknowns, (c, n)."""

    def apply(self, u: Floats) -> Floats:
        """H u, (c)."""

    def apply_transpose(self, lam: Floats) -> Floats:
        """Hᵀ λ, (n)."""

    def take(self, rows: Ints) -> Self:
        """Some of the rows."""

    def without(self, fixed: Bools) -> Self:
        """The rows with zero entries at the unknowns marked."""

    def touching(self) -> Bools:
        """Which rows have an entry that is not zero, (c)."""

    def blank(self, count: int) -> Self:
        """As many rows of zeros."""

    def join(self, others: Sequence[Self]) -> Self:
        """These rows, and below them the others."""

    def solve(self, body: Any, rows: Ints) -> Floats:
        """H A⁻¹ Hᵀ for the columns `rows` as far as this rank's unknowns make it, (c, k). Collective."""

    def sparse(self) -> sp.csr_array:
        """The same as a sparse matrix."""


@dataclass(frozen=True)
class SparseRows:
    """Rows of any shape, `matrix` (c, n)."""

    matrix: sp.csr_array

    def apply(self, u: Floats) -> Floats:
        """H u."""
        product: Floats = self.matrix @ u
        return product

    def apply_transpose(self, lam: Floats) -> Floats:
        """Hᵀ λ."""
        product: Floats = self.matrix.T @ lam
        return product

    def take(self, rows: Ints) -> SparseRows:
        """Some of the rows."""
        return SparseRows(self.matrix[rows])

    def without(self, fixed: Bools) -> SparseRows:
        """The rows with the columns of unknowns marked emptied."""
        result = self.matrix @ sp.diags_array((~fixed).astype(float), format="csr")
        result.eliminate_zeros()
        return SparseRows(result.tocsr())

    def touching(self) -> Bools:
        """Rows with entries."""
        entries = np.abs(self.matrix).sum(axis=1) > 0
        return np.asarray(entries)

    def blank(self, count: int) -> SparseRows:
        """Rows without entries."""
        return SparseRows(sp.csr_array((count, self.matrix.shape[1])))

    def join(self, others: Sequence[SparseRows]) -> SparseRows:
        """One below the other."""
        if not others:
            return self
        return SparseRows(sp.vstack([self.matrix, *[other.matrix for other in others]], format="csr"))

    def solve(self, body: Any, rows: Ints) -> Floats:
        """H (A⁻¹ Hᵀ) for sparse right-hand sides."""
        product: Floats = self.matrix @ body.solve_rows(self.matrix[rows])
        return product

    def sparse(self) -> sp.csr_array:
        """The matrix."""
        return self.matrix


@dataclass(frozen=True)
class ElementRows:
    """Rows with entries at neighbouring unknowns: of points on a chain of elements.

    values : (c, w) the entries of each row
    first : (c) the unknown of its first entry
    size : n
    """

    values: Floats
    first: Ints
    size: int

    def apply(self, u: Floats) -> Floats:
        """H u."""
        product: Floats = row_kernels.apply(self.values, self.first, u)
        return product

    def apply_transpose(self, lam: Floats) -> Floats:
        """Hᵀ λ."""
        product: Floats = row_kernels.apply_transpose(self.values, self.first, lam, self.size)
        return product

    def take(self, rows: Ints) -> ElementRows:
        """Some of the rows."""
        return ElementRows(self.values[rows], self.first[rows], self.size)

    def without(self, fixed: Bools) -> ElementRows:
        """The rows with zeros at the unknowns marked."""
        return ElementRows(row_kernels.without(self.values, self.first, ~fixed), self.first, self.size)

    def touching(self) -> Bools:
        """Rows that are not zero."""
        return np.asarray(self.values.any(axis=1))

    def blank(self, count: int) -> ElementRows:
        """Rows of zeros."""
        return ElementRows(np.zeros((count, self.values.shape[1])), np.zeros(count, dtype=np.int64), self.size)

    def join(self, others: Sequence[ElementRows]) -> ElementRows:
        """One below the other."""
        if not others:
            return self
        every = [self, *others]
        return ElementRows(
            np.concatenate([r.values for r in every]), np.concatenate([r.first for r in every]), self.size
        )

    def solve(self, body: Any, rows: Ints) -> Floats:
        """H (A⁻¹ Hᵀ) for dense right-hand sides: a beam's factor is so narrow that they are as fast as sparse ones."""
        X = body.solve(row_kernels.columns(self.values, self.first, rows, self.size).T)
        product: Floats = row_kernels.product(self.values, self.first, X.T).T
        return product

    def sparse(self) -> sp.csr_array:
        """The rows as a sparse matrix."""
        c, w = self.values.shape
        columns = self.first[:, None] + np.arange(w)
        return sp.csr_array((self.values.ravel(), columns.ravel(), w * np.arange(c + 1)), shape=(c, self.size))
