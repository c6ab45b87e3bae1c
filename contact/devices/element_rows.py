"""Short rows of H at neighbouring unknowns of a beam; apart from other rows because they are compiled."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from contact.devices import row_kernels
from contact.rows import Solved

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]
Bools = NDArray[np.bool_]


@dataclass(frozen=True)
class ElementRows(Solved):
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
        found: Bools = row_kernels.touching(self.values)
        return found

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

    def compliance(self, body: Any) -> Floats | None:
        """H A⁻¹ Hᵀ from the inverse's blocks along the chain, where the body has them."""
        W: Floats | None = body.delassus(self.values, self.first // 6)
        return W

    def sparse(self) -> sp.csr_array:
        """The rows as a sparse matrix."""
        c, w = self.values.shape
        columns = self.first[:, None] + np.arange(w)
        return sp.csr_array((self.values.ravel(), columns.ravel(), w * np.arange(c + 1)), shape=(c, self.size))
