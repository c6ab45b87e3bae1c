"""The iteration matrix A = m M + k K of a linear body: formed once for each time step, and kept."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray
from petsc4py import PETSc

from fem.factor import Factor
from fem.inertia import Inertia
from fem.model import Model
from fem.space import Space

Floats = NDArray[np.float64]
FACTORS = 4  # kept at a time: a step that is halved and recovers finds the matrix of its dt again


class IterationMatrices:
    """The matrices A of a body for the last few pairs (m, k), with their solvers; it owns them.

    Parameters
    ----------
    space : the body's unknowns
    near_null : motions (owned, r) that K hardly resists, for multigrid

    Attributes
    ----------
    unit : of each owned unknown in A: pressures get one with which A is the same in all units
    """

    def __init__(self, space: Space, near_null: Floats) -> None:
        self.space, self.near_null = space, near_null
        self.unit = np.ones(space.owned)
        self._kept: dict[tuple[float, float], Factor] = {}

    def find(self, multiples: tuple[float, float]) -> Factor | None:
        """The matrix of these (m, k), where it is kept."""
        return self._kept.get(multiples)

    def form(
        self, multiples: tuple[float, float], model: Model, inertia: Inertia | None, held: NDArray[np.bool_]
    ) -> Factor:
        """A = m M + k K with unit rows at `held` unknowns (owned), unless it is kept. Collective."""
        if (kept := self._kept.pop(multiples, None)) is None:
            kept = self._new(*multiples, model, inertia, held)
            while len(self._kept) >= FACTORS:
                self._kept.pop(next(iter(self._kept))).close()
        self._kept[multiples] = kept  # the last used is the last to go
        return kept

    def _new(self, m: float, k: float, model: Model, inertia: Inertia | None, held: NDArray[np.bool_]) -> Factor:
        space, piece = self.space, self.space.piece
        K = k * model.stiffness(piece.points, piece.cells)
        if inertia is not None:
            inertia.add(K, m)
        if model.mixed:
            self._scale_pressures(K)
        A = space.sum_matrices(K)
        diagonal = A.getDiagonal()
        scale = diagonal.norm(PETSc.NormType.NORM_INFINITY) or 1.0
        diagonal.destroy()
        A.zeroRowsColumns((space.first + np.flatnonzero(held)).astype(PETSc.IntType), diag=scale)
        if not model.mixed:
            A.setOption(PETSc.Mat.Option.SPD, True)
        basis = [self._vec(column) for column in self.near_null.T]
        near = PETSc.NullSpace().create(vectors=_orthonormal(basis), comm=space.comm)
        A.setNearNullSpace(near)
        near.destroy()
        for v in basis:
            v.destroy()
        return Factor(A, scale, held, self.unit, space.dim)

    def _scale_pressures(self, K: Floats) -> None:
        """Give pressures a unit with which their rows weigh as those of forces do."""
        space = self.space
        nu = space.components * space.piece.cells.shape[1]
        parts = [float(np.abs(K[:, :nu, part]).max(initial=0.0)) for part in (slice(nu), slice(nu, None))]
        stiffness, coupling = space.comm.allreduce(np.array(parts), op=np.maximum)
        unit = stiffness / coupling
        K[:, nu:] *= unit
        K[:, :, nu:] *= unit
        # A matrix that is kept solves in its own units.
        self.unit = np.where(np.arange(space.owned) < space.components * space.piece.owned, 1.0, unit)

    def _vec(self, owned: Floats) -> Any:
        v = PETSc.Vec().createMPI((self.space.owned, self.space.size), comm=self.space.comm)
        v.array[:] = owned
        return v

    def close(self) -> None:
        """Destroy the matrices and their solvers. Collective."""
        for factor in self._kept.values():
            factor.close()
        self._kept.clear()


def _orthonormal(basis: list[Any]) -> list[Any]:
    """Gram–Schmidt, in place."""
    for i, v in enumerate(basis):
        for w in basis[:i]:
            v.axpy(-v.dot(w), w)
        v.normalize()
    return basis
