"""Rows of H = ∂δ/∂u on one body, and those of any shape, as a sparse matrix."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Protocol, Self

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray
from petsc4py import PETSc

from fem.space import Space

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]
Bools = NDArray[np.bool_]


class Rows(Protocol):
    """The columns of H that belong to one body's owned unknowns, (c, n)."""

    def apply(self, u: Floats) -> Floats:
        """H u, (c)."""

    def at(self, body: Any) -> Floats:
        """H u at the body's present unknowns, as far as this rank's make it, (c)."""

    def free_motion(self, body: Any, lam: Floats) -> None:
        """Bring the body to its free configuration with the forces Hᵀ λ in it. Collective."""

    def correct(self, body: Any, lam: Floats, increment: Floats) -> None:
        """Move the body by A⁻¹ Hᵀ λ and an increment (n). Collective."""

    def add(self, body: Any, lam: Floats) -> None:
        """Add A⁻¹ Hᵀ λ to the body's present unknowns. Collective."""

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

    def compliance(self, body: Any) -> Floats | None:
        """H A⁻¹ Hᵀ, (c, c), where the body knows it without a solve; None where it does not."""

    def sparse(self) -> sp.csr_array:
        """The same as a sparse matrix."""


class Solved(ABC):
    """Of rows whose forces move a body by a solve."""

    @abstractmethod
    def apply(self, u: Floats) -> Floats:
        """H u."""

    @abstractmethod
    def apply_transpose(self, lam: Floats) -> Floats:
        """Hᵀ λ."""

    def at(self, body: Any) -> Floats:
        """H u at the body's coordinates."""
        return self.apply(body.coordinates())

    def free_motion(self, body: Any, lam: Floats) -> None:
        """The free motion with contact forces Hᵀ λ."""
        body.free_motion(self.apply_transpose(lam))

    def correct(self, body: Any, lam: Floats, increment: Floats) -> None:
        """Move by A⁻¹ Hᵀ λ + increment."""
        body.correct(increment + body.solve(self.apply_transpose(lam)[:, None])[:, 0])

    def add(self, body: Any, lam: Floats) -> None:
        """Add A⁻¹ Hᵀ λ by a solve."""
        body.add(body.solve(self.apply_transpose(lam)[:, None])[:, 0])


@dataclass(frozen=True)
class SparseRows(Solved):
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
        return SparseRows(columns_of(self.matrix, ~fixed))

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

    def compliance(self, body: Any) -> None:
        """None: it takes solves."""
        return

    def sparse(self) -> sp.csr_array:
        """The matrix."""
        return self.matrix


def owned_rows(space: Space, count: int, rows: Ints, unknowns: Ints, values: Floats) -> sp.csr_array:
    """The matrix (count, owned) that sums `values` at (rows, global unknowns) over the ranks. Collective.

    PETSc sends entries to the owners of their unknowns.
    """
    if space.comm.size == 1:
        return sp.csr_array((values, (rows, unknowns)), shape=(count, space.owned))
    Ht = PETSc.Mat().create(space.comm)
    Ht.setSizes(((space.owned, space.size), (PETSc.DECIDE, count)))
    Ht.setType("aij")
    Ht.setPreallocationCOO(unknowns.astype(PETSc.IntType), rows.astype(PETSc.IntType))
    Ht.setValuesCOO(values)
    pointer, indices, data = Ht.getValuesCSR()
    Ht.destroy()
    return sp.csr_array((data, indices, pointer), shape=(space.owned, count)).T.tocsr()


def columns_of(matrix: sp.csr_array, which: Bools) -> sp.csr_array:
    """The matrix with the other columns emptied."""
    result = matrix @ sp.diags_array(which.astype(float), format="csr")
    result.eliminate_zeros()
    return result.tocsr()
