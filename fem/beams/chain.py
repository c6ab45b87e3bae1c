"""The iteration matrix of a beam: 6 × 6 blocks along a chain, solved by its own elimination or by PETSc."""

from __future__ import annotations

from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray
from petsc4py import PETSc

from fem.beams import chain_kernels

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]
Bools = NDArray[np.bool_]


def matrix_of(fixed: Bools) -> Chain:
    """The matrix of a beam whose `fixed` unknowns (6 N) are prescribed.

    Where the command line has options ``-free_…`` a PETSc KSP solves with it, as it does for solids.
    """
    return KspChain(fixed) if PETSc.Options("free_").getAll() else Chain(fixed)


class Chain:
    """A symmetric block-tridiagonal matrix and its elimination; see `fem.beams.chain_kernels`.

    `definite` says whether the factor has shown the matrix to be positive definite.
    """

    definite = False

    def __init__(self, fixed: Bools) -> None:
        nodes = len(fixed) // 6
        self.fixed = fixed
        self._factor = chain_kernels.room(nodes)
        self._diagonal, self._upper = np.zeros((nodes, 6, 6)), np.zeros((nodes - 1, 6, 6))

    def fill(self, diagonal: Floats, upper: Floats) -> None:
        """Take the blocks (N, 6, 6) and (N − 1, 6, 6) over, with unit rows at prescribed unknowns."""
        chain_kernels.hold(diagonal, upper, self.fixed)
        self._diagonal, self._upper = diagonal, upper
        self.__dict__.pop("A", None)

    def adopt(self, diagonal: Floats, upper: Floats, factor: Floats, shown: int) -> None:
        """Take over a matrix with the unit rows in it, and its factor, which has `shown` what `factor` would return."""
        self._diagonal, self._upper, self._factor = diagonal, upper, factor
        self.definite = shown == chain_kernels.DEFINITE
        self.__dict__.pop("A", None)

    def factor(self) -> None:
        """Eliminate; ArithmeticError where the matrix is singular."""
        verdict = chain_kernels.factor(self._diagonal, self._upper, self._factor)
        if verdict >= 0:
            raise ArithmeticError(f"the iteration matrix of a beam is singular at node {verdict}")
        self.definite = verdict == chain_kernels.DEFINITE

    def solve(self, B: Floats) -> Floats:
        """A⁻¹ B, (6 N, k), zero at prescribed unknowns."""
        X: Floats = chain_kernels.solve(self._factor, self.fixed, np.ascontiguousarray(B.T))
        return X.T

    def delassus(self, values: Floats, elements: Ints) -> Floats | None:
        """H A⁻¹ Hᵀ (c, c) for rows with entries (c, 12) on given elements, zero at prescribed unknowns."""
        if chain_kernels.rising(elements):
            W: Floats = chain_kernels.delassus(values, elements, self._factor)
            return W
        order = np.argsort(elements, kind="stable")
        back = np.argsort(order)
        sorted_W: Floats = chain_kernels.delassus(values[order], elements[order], self._factor)
        return sorted_W[np.ix_(back, back)]

    @cached_property
    def A(self) -> Any:
        """The matrix as PETSc's SeqBAIJ."""
        nodes = len(self._diagonal)
        counts = np.full(nodes, 3)
        counts[0] = counts[-1] = 2
        pointer = np.append(0, np.cumsum(counts)).astype(PETSc.IntType)
        around = np.arange(nodes)[:, None] + np.array([-1, 0, 1])
        inside = (around >= 0) & (around < nodes)
        blocks = np.zeros((nodes, 3, 6, 6))
        blocks[:, 1], blocks[:-1, 2], blocks[1:, 0] = self._diagonal, self._upper, np.swapaxes(self._upper, 1, 2)
        csr = pointer, around[inside].astype(PETSc.IntType), blocks[inside].ravel()
        return PETSc.Mat().createBAIJ((6 * nodes, 6 * nodes), 6, csr=csr, comm=PETSc.COMM_SELF)

    def close(self) -> None:
        """Destroy the PETSc matrix, if there is one."""
        if "A" in self.__dict__:
            self.__dict__.pop("A").destroy()


class KspChain(Chain):
    """The same matrix behind a KSP with the options prefix ``free_``; by default its LU in natural order."""

    def factor(self) -> None:
        """Set the KSP up."""
        self._ksp.setOperators(self.A)
        self._ksp.setUp()

    @cached_property
    def _ksp(self) -> Any:
        ksp = PETSc.KSP().create(PETSc.COMM_SELF)
        ksp.setOptionsPrefix("free_")
        ksp.setOperators(self.A)
        ksp.setType(PETSc.KSP.Type.PREONLY)
        pc = ksp.getPC()
        pc.setType(PETSc.PC.Type.LU)
        pc.setFactorOrdering(PETSc.Mat.OrderingType.NATURAL)
        ksp.setTolerances(rtol=1e-12, max_it=10_000)
        ksp.setFromOptions()
        ksp.setErrorIfNotConverged(True)
        return ksp

    def solve(self, B: Floats) -> Floats:
        """A⁻¹ B by the KSP."""
        B = np.asfortranarray(np.where(self.fixed[:, None], 0.0, B))
        if self._ksp.getType() != PETSc.KSP.Type.PREONLY:
            return np.stack([self._column(column) for column in B.T], axis=1)
        rhs = PETSc.Mat().createDense(B.shape, array=B, comm=PETSc.COMM_SELF)
        X = PETSc.Mat().createDense(B.shape, comm=PETSc.COMM_SELF)
        X.setUp()
        rhs.assemble()
        self._ksp.matSolve(rhs, X)
        result: Floats = X.getDenseArray().copy()
        rhs.destroy()
        X.destroy()
        self._check()
        return result

    def _check(self) -> None:
        """ArithmeticError for a solve that stopped early: after an error PETSc does not always raise another."""
        if (reason := self._ksp.getConvergedReason()) < 0:
            raise ArithmeticError(f"the solver of the free motion stopped with reason {reason}")

    def _column(self, b: Floats) -> Floats:
        """A⁻¹ b by an iterative KSP, which takes blocks column by column and leaves them locked where it fails."""
        rhs = PETSc.Vec().createWithArray(b, comm=PETSc.COMM_SELF)
        x = rhs.duplicate()
        try:
            self._ksp.solve(rhs, x)
            self._check()
            result: Floats = x.array.copy()
        finally:
            rhs.destroy()
            x.destroy()
        return result

    def delassus(self, values: Floats, elements: Ints) -> Floats | None:
        """None: its entries come from solves."""
        return None

    def close(self) -> None:
        """Destroy the solver and the matrix."""
        if "_ksp" in self.__dict__:
            self.__dict__.pop("_ksp").destroy()
        super().close()
