"""Rows of H on a wall that devices touch: −n shared out to the points of its surface."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from contact.rows import columns_of
from fem import wall_kernels as kernels
from fem.wall import Wall

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]
Bools = NDArray[np.bool_]


@dataclass(frozen=True)
class WallRows:
    """Rows −n_i ⊗ shares_i on points of a wall, replicated; what is summed over ranks is rank 0's.

    points, shares : (c, k)
    normals : of the wall, zero in empty rows, (c, 3)
    fixed : owned unknowns whose columns are empty; None for none
    """

    wall: Wall
    points: Ints
    shares: Floats
    normals: Floats
    fixed: Bools | None = None

    def apply(self, u: Floats) -> Floats:
        """H u for other unknowns than the present ones."""
        product: Floats = self.sparse() @ u
        return product

    def at(self, body: Any) -> Floats:
        """H u of the wall as it is: from the displacements of its points."""
        gaps = self.displacements()
        return gaps if self.wall.comm.rank == 0 else np.zeros_like(gaps)

    def displacements(self) -> Floats:
        """The same on every rank."""
        along: Floats = kernels.along(self.points, self.shares, self.normals, self.wall.displacement_of_points())
        return along

    def free_motion(self, body: Any, lam: Floats) -> None:
        """The free motion with forces λ."""
        self.wall.free_motion()
        self.wall.push(self.points, self.shares, self.normals, lam)

    def correct(self, body: Any, lam: Floats, increment: Floats) -> None:
        """Move by A⁻¹ Hᵀ λ; a wall has no rigid motion to add."""
        self.wall.push(self.points, self.shares, self.normals, lam)

    def add(self, body: Any, lam: Floats) -> None:
        """Move by A⁻¹ Hᵀ λ."""
        self.correct(body, lam, np.empty(0))

    def apply_transpose(self, lam: Floats) -> Floats:
        """Hᵀ λ."""
        forces = np.zeros_like(self.wall.places)
        kernels.sum_forces(self.points, self.shares, self.normals, lam, forces)
        owned = self.wall.owned_forces(forces)
        return owned if self.fixed is None else np.where(self.fixed, 0.0, owned)

    def take(self, rows: Ints) -> WallRows:
        """Some of the rows."""
        return replace(self, points=self.points[rows], shares=self.shares[rows], normals=self.normals[rows])

    def without(self, fixed: Bools) -> WallRows:
        """The rows with the columns of unknowns marked emptied."""
        return replace(self, fixed=fixed if self.fixed is None else fixed | self.fixed)

    def touching(self) -> Bools:
        """Rows that are not empty, on rank 0."""
        touching: Bools = self.normals.any(axis=1)
        return touching if self.wall.comm.rank == 0 else np.zeros_like(touching)

    def blank(self, count: int) -> WallRows:
        """Empty rows."""
        width = self.points.shape[1]
        points, shares = np.zeros((count, width), dtype=np.int64), np.zeros((count, width))
        return replace(self, points=points, shares=shares, normals=np.zeros((count, 3)))

    def join(self, others: Sequence[WallRows]) -> WallRows:
        """One below the other."""
        every = [self, *others]
        width = max(rows.points.shape[1] for rows in every)

        def joined[T: np.generic](parts: list[NDArray[T]]) -> NDArray[T]:
            if any(part.shape[1] < width for part in parts):
                parts = [np.pad(part, [(0, 0), (0, width - part.shape[1])]) for part in parts]
            return np.concatenate(parts)

        return replace(
            self,
            points=joined([rows.points for rows in every]),
            shares=joined([rows.shares for rows in every]),
            normals=np.concatenate([rows.normals for rows in every]),
        )

    def solve(self, body: Any, rows: Ints) -> Floats:
        """H A⁻¹ Hᵀ for the columns `rows`, on rank 0."""
        W = self.compliance(body)[:, rows]
        return W if self.wall.comm.rank == 0 else np.zeros_like(W)

    def compliance(self, body: Any) -> Floats:
        """H A⁻¹ Hᵀ from kept columns."""
        return self.wall.point_delassus(self.points, self.shares, self.normals)

    def sparse(self) -> sp.csr_array:
        """The owned columns as a sparse matrix."""
        rows = self.wall.rows_of(self.points, self.shares, self.normals)
        return rows if self.fixed is None else columns_of(rows, ~self.fixed)
