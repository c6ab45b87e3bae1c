"""An iteration matrix A and the KSP that solves with it: a direct factorisation, or what options ask for."""

from __future__ import annotations

from typing import Any

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray
from petsc4py import PETSc

Floats = NDArray[np.float64]


class Factor:
    """A of one body, symmetric, and its solver; it owns both.

    Parameters
    ----------
    A : PETSc matrix with unit rows, times `scale`, where unknowns are held
    held : those owned unknowns
    unit : of each owned unknown in A
    dim : of the body's mesh

    Attributes
    ----------
    scale : the largest entry of A's diagonal [N/m]
    """

    def __init__(self, A: Any, scale: float, held: NDArray[np.bool_], unit: Floats, dim: int) -> None:
        self.A, self.scale = A, scale
        self.ksp: Any = None
        self._held, self._unit, self._dim = held, unit, dim
        self._sizes = A.getSizes()[0]
        self._comm = A.getComm()

    def setup(self) -> None:
        """Factorise, or set up what the options ``-free_ksp_…`` ask for; once. Collective."""
        if self.ksp is not None:
            return
        ksp = PETSc.KSP().create(self._comm)
        ksp.setOptionsPrefix("free_")
        ksp.setOperators(self.A)
        ksp.setType(PETSc.KSP.Type.PREONLY)
        pc = ksp.getPC()
        pc.setType(PETSc.PC.Type.CHOLESKY)
        pc.setFactorSolverType(PETSc.Mat.SolverType.MUMPS)
        # The prefix is shared by all bodies: users set options for 'the free motion', not for one of its blocks.
        ksp.setTolerances(rtol=1e-12, max_it=10_000)
        ksp.setFromOptions()
        if pc.getType() == PETSc.PC.Type.CHOLESKY and pc.getFactorSolverType() == PETSc.Mat.SolverType.MUMPS:
            pc.setFactorSetUpSolverType()
            factor = pc.getFactorMatrix()
            factor.setMumpsIcntl(7, 5)  # METIS: fill far below that of minimum degree in 3D
            if self._dim == 3:
                # Blocked fronts without any dropping (CNTL(7) = 0): exact, and the plain symmetric update runs at a
                # fraction of the speed of the matrix product where BLAS has a slow GEMMT (measured 24 s against 10 s).
                factor.setMumpsIcntl(35, 1)
        ksp.setErrorIfNotConverged(True)
        ksp.setUp()
        self.ksp = ksp

    def solve(self, B: Floats) -> Floats:
        """X = A⁻¹ B for a block of right-hand sides at the owned unknowns, (owned, k). Collective."""
        sizes = (self._sizes, (PETSc.DECIDE, B.shape[1]))
        B = np.asfortranarray(np.where(self._held, 0.0, self._unit)[:, None] * B)
        rhs = PETSc.Mat().createDense(sizes, array=B, comm=self._comm)
        X = PETSc.Mat().createDense(sizes, comm=self._comm)
        X.setUp()
        rhs.assemble()
        try:
            self.ksp.matSolve(rhs, X)
            result: Floats = np.multiply(X.getDenseArray(), self._unit[:, None], order="F")
        finally:
            rhs.destroy()
            X.destroy()
        return result

    def solve_rows(self, H: sp.csr_array) -> Floats:
        """X = A⁻¹ Hᵀ for sparse rows H on displacements that A moves, (owned, k). Collective.

        MUMPS passes over the branches of the factor that a sparse right-hand side does not reach, which halves its
        time; it takes such right-hand sides from the first rank.
        """
        factor = self.ksp.getPC()
        direct = self.ksp.getType() == PETSc.KSP.Type.PREONLY
        if not (direct and factor.getFactorSolverType() == PETSc.Mat.SolverType.MUMPS):
            return self.solve(H.toarray().T)
        k, (owned, size) = H.shape[0], self._sizes
        H = self._on_first_rank(H)
        csr = H.indptr.astype(PETSc.IntType), H.indices.astype(PETSc.IntType), H.data
        rows = PETSc.Mat().createAIJ(((H.shape[0], k), (H.shape[1], size)), csr=csr, comm=self._comm)
        columns = PETSc.Mat().createTranspose(rows)
        X = PETSc.Mat().createDense(((owned, size), (H.shape[0], k)), comm=self._comm)
        X.setUp()
        try:
            factor.getFactorMatrix().matSolve(columns, X)
            result: Floats = np.multiply(X.getDenseArray(), self._unit[:, None], order="F")
        finally:
            for matrix in (columns, rows, X):
                matrix.destroy()
        return result

    def _on_first_rank(self, H: sp.csr_array) -> sp.csr_array:
        """All columns of H on rank 0, (k, size), nothing elsewhere, (0, 0). Collective."""
        if self._comm.size == 1:
            return H
        entries, first = H.tocoo(), self.A.getOwnershipRange()[0]
        parts = self._comm.tompi4py().gather((entries.data, entries.row, entries.col + first))
        if parts is None:
            return sp.csr_array((0, 0))
        data, row, column = (np.concatenate(part) for part in zip(*parts, strict=True))
        return sp.csr_array((data, (row, column)), shape=(H.shape[0], self._sizes[1]))

    def close(self) -> None:
        """Destroy the matrix and the solver. Collective."""
        for thing in (self.ksp, self.A):
            if thing is not None:
                thing.destroy()
        self.ksp = self.A = None
