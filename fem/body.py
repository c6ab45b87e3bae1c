"""A deformable body: its unknowns, supports and loads, its iteration matrix and the solver for it."""

from __future__ import annotations

from collections.abc import Sequence
from types import TracebackType
from typing import Any, Protocol, Self

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray
from petsc4py import PETSc

from fem.loads import Load, Support, evaluate, external_forces
from fem.rigid import floating_modes, pin, rigid_modes
from fem.space import Space

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]
SURFACE = "surface"


class Model(Protocol):
    """What a body is made of: element matrices and, independently of them, internal forces."""

    @property
    def axisymmetric(self) -> bool:
        """Whether x = (r, z)."""

    @property
    def mixed(self) -> bool:
        """Whether pressures stand beside the displacements."""

    def stiffness(self, points: Floats, cells: Ints) -> Floats:
        """Element matrices (m, n, n)."""

    def forces(self, points: Floats, cells: Ints, u: Floats) -> Floats:
        """Internal forces of cells (m, n) at their unknowns u (m, n)."""


class Body:
    """A linear body: A u = b with A the stiffness matrix, factorised once.

    Parameters
    ----------
    name : names it in scenes, messages and records
    space, model : unknowns and material
    frame : (components, D), the direction in space of each displacement component; None where they are the axes
    supports, loads : what holds it and what acts on it

    Attributes
    ----------
    u : local unknowns (ghosts included), displacements [m] then pressures [Pa]
    load : f_ext at the owned unknowns [N]
    modes : the rigid motions that no support holds, (owned, m)

    deformable : whether it has a matrix A and a solver

    Creating, updating and solving are collective on the body's communicator; close it to destroy its PETSc objects.
    """

    deformable = True

    def __init__(
        self,
        name: str,
        space: Space,
        model: Model,
        supports: Sequence[Support] = (),
        loads: Sequence[Load] = (),
        frame: Floats | None = None,
    ) -> None:
        self.name, self.space, self.model = name, space, model
        self.supports, self.loads = list(supports), list(loads)
        self.frame = np.eye(space.dim) if frame is None else np.asarray(frame, dtype=float)
        if len(self.frame) != space.components:
            raise ValueError(f"body {name!r}: frame has {len(self.frame)} directions for {space.components} components")
        if (space.components != space.dim or space.dim == 1) and any(load.kind == "pressure" for load in self.loads):
            raise ValueError(f"body {name!r}: kind = 'pressure': only a solid has a pressure on its sides")
        inmost = space.comm.allreduce(float(space.piece.points[:, 0].min(initial=0.0)), op=min)
        if model.axisymmetric and inmost < -1e-12 * self.size:
            raise ValueError(f"body {name!r}: its mesh reaches r = {inmost:.6g}: must be r >= 0 in axisymmetry")
        self.u = np.zeros(len(space.local_dofs))
        self.load = np.zeros(space.owned)
        self._loaded_at: float | None = None
        self._unit = np.ones(space.owned)  # of each unknown in A
        self.fixed = self._fixed()
        self._R = self.rigid_modes()
        self.modes = floating_modes(space.comm, self._R, self.fixed)
        self.pins = pin(space.comm, self.modes)
        self._stiffness = 0.0
        self.A: Any = None
        self._ksp: Any = None

    def rigid_modes(self) -> Floats:
        """The motions without strain at the owned unknowns, (owned, m)."""
        return rigid_modes(self.space, self.model.axisymmetric)

    # --- geometry -------------------------------------------------------------------------------------------------

    @property
    def points(self) -> Floats:
        """Undeformed positions of the local nodes in space, (nodes, D) [m]."""
        X = self.space.piece.points
        D = self.frame.shape[1]
        return np.hstack([X, np.zeros((len(X), D - X.shape[1]))])

    @property
    def displacement(self) -> Floats:
        """Displacements of the local nodes in space, (nodes, D) [m]."""
        return self.u[self.space.displacements].reshape(-1, self.space.components) @ self.frame

    @property
    def size(self) -> float:
        """The body's largest extent [m]."""
        X = self.space.piece.points
        low = self.space.comm.allreduce(X.min(axis=0, initial=np.inf), op=np.minimum)
        high = self.space.comm.allreduce(X.max(axis=0, initial=-np.inf), op=np.maximum)
        return float((high - low).max())

    def facets(self, tag: str) -> Ints:
        """Local nodes of the facets that carry `tag` on this rank, (f, k).

        A body that moves across its own plane (string, membrane) touches with its cells, under the tag ``surface``.
        """
        if tag == SURFACE and self.frame.shape[1] > self.space.dim:
            cells: Ints = self.space.piece.cells
            return cells
        if tag not in self.space.piece.facets:
            known = ", ".join(sorted(self.space.piece.facets)) or "none"
            raise ValueError(f"body {self.name!r}: its mesh has no tag {tag!r} (it has: {known})")
        facets: Ints = self.space.piece.facets[tag]
        return facets

    # --- supports and loads ---------------------------------------------------------------------------------------

    def _support_dofs(self, support: Support) -> tuple[Ints, Ints]:
        nodes = np.unique(self.facets(support.tag))
        c = self.space.components
        if support.component is not None and not 0 <= support.component < c:
            raise ValueError(f"body {self.name!r}: support on {support.tag!r} has no component {support.component}")
        parts = np.arange(c) if support.component is None else np.array([support.component])
        return nodes, c * nodes[:, None] + parts

    def _fixed(self) -> NDArray[np.bool_]:
        marks = np.zeros(len(self.space.local_dofs))
        for support in self.supports:
            marks[self._support_dofs(support)[1].ravel()] = 1
        return self.space.sum(marks) > 0

    def _prescribe(self, t: float) -> None:
        if not self.supports:
            return
        owned = self.owned(self.u)
        # One support after the other: where two disagree the later one holds, on whichever ranks their facets are.
        for support in self.supports:
            values, marks = np.zeros_like(self.u), np.zeros_like(self.u)
            nodes, dofs = self._support_dofs(support)
            value = evaluate(support.value, self.space.piece.points[nodes], t, dofs.shape[1])
            values[dofs], marks[dofs] = value, 1
            total, count = self.space.sum(values), self.space.sum(marks)
            owned = np.where(count > 0, total / np.maximum(count, 1), owned)
        self.u = self.space.local(owned)

    def update(self, t: float) -> None:
        """Set the prescribed displacements and the loads of time t [s]."""
        self._prescribe(t)
        if self.loads and self._loaded_at != t:
            loads = [
                (load, self.space.piece.cells if load.tag is None else self.facets(load.tag)) for load in self.loads
            ]
            self.load = external_forces(self.space, self.model.axisymmetric, loads, t)
            self._loaded_at = t
        finite = np.isfinite(self.u).all() and np.isfinite(self.load).all()
        if not self.space.comm.allreduce(bool(finite), op=min):
            raise ValueError(f"body {self.name!r}: a support or load is not finite at t = {t:.6g}")

    # --- forces and solves ----------------------------------------------------------------------------------------

    def owned(self, local: Floats) -> Floats:
        """The entries of a local vector that this rank owns."""
        first, mine = self.space.first, self.space.local_dofs - self.space.first
        owned = np.empty(self.space.owned)
        inside = (self.space.local_dofs >= first) & (mine < self.space.owned)
        owned[mine[inside]] = local[inside]
        return owned

    def internal_forces(self) -> Floats:
        """f_int(u) at the owned unknowns [N], from the stresses of the cells and not from A."""
        piece = self.space.piece
        return self.space.sum_cells(self.model.forces(piece.points, piece.cells, self.u[self.space.cell_dofs]))

    def residual(self) -> Floats:
        """f_ext − f_int(u) at the owned unknowns, zero where displacements are prescribed."""
        return np.where(self.fixed, 0.0, self.load - self.internal_forces())

    @property
    def held(self) -> NDArray[np.bool_]:
        """Owned unknowns that A does not move: the prescribed ones and the pins of a floating body."""
        held = self.fixed.copy()
        held[self.pins] = True
        return held

    def imbalance(self, contact: Floats) -> float:
        """‖f_int − f_ext − Hᵀλ‖ of free unknowns / (‖f_int‖ + ‖f_ext‖ + ‖Hᵀλ‖), for contact forces Hᵀλ. Collective."""
        inner = self.internal_forces()
        rest = np.where(self.fixed, 0.0, inner - self.load - contact)
        # Below eps ‖A‖ × size forces are round-off of positions, not to be measured against themselves: with this floor
        # a residual within the default tolerance of 1e-8 is at most that.
        moved = self.owned(self.u)[: self.space.components * self.space.piece.owned]
        length = max(self.size, float(np.sqrt(self.space.comm.allreduce(float(moved @ moved)))))
        forces = (self._unit * f for f in (rest, inner, self.load, contact))
        return self._ratio(*forces, least=1e-8 * self._stiffness * length)

    def _ratio(self, rest: Floats, *forces: Floats, least: float = 0.0) -> float:
        squares = self.space.comm.allreduce(np.array([v @ v for v in (rest, *forces)]))
        rest_norm, *norms = np.sqrt(squares)
        scale = max(sum(norms), least)
        return float(rest_norm / scale) if scale > 0 else 0.0

    def assemble(self) -> None:
        """Form A: the stiffness matrix with unit rows where displacements are prescribed or pinned."""
        piece = self.space.piece
        K = self.model.stiffness(piece.points, piece.cells)
        if self.model.mixed:
            self._scale_pressures(K)
        self.A = self.space.sum_matrices(K)
        rows = (self.space.first + np.flatnonzero(self.held)).astype(PETSc.IntType)
        diagonal = self.A.getDiagonal()
        scale = diagonal.norm(PETSc.NormType.NORM_INFINITY) or 1.0
        diagonal.destroy()
        self._stiffness = scale
        self.A.zeroRowsColumns(rows, diag=scale)
        if not self.model.mixed:
            self.A.setOption(PETSc.Mat.Option.SPD, True)
        basis = [self._vec(column) for column in self._R.T]
        near = PETSc.NullSpace().create(vectors=_orthonormal(basis), comm=self.space.comm)
        self.A.setNearNullSpace(near)
        near.destroy()
        for v in basis:
            v.destroy()

    def _scale_pressures(self, K: Floats) -> None:
        """Give pressures a unit with which A is the same in all units, and their rows weigh as forces do."""
        nu = self.space.components * self.space.piece.cells.shape[1]
        parts = [float(np.abs(K[:, :nu, part]).max(initial=0.0)) for part in (slice(nu), slice(nu, None))]
        stiffness, coupling = self.space.comm.allreduce(np.array(parts), op=np.maximum)
        unit = stiffness / coupling
        K[:, nu:] *= unit
        K[:, :, nu:] *= unit
        self._unit[self.space.components * self.space.piece.owned :] = unit

    def factor(self) -> None:
        """Set up the KSP for A: a direct factorisation, or what the options ``-free_ksp_…`` ask for."""
        ksp = PETSc.KSP().create(self.space.comm)
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
            if self.space.dim == 3:
                # Blocked fronts without any dropping (CNTL(7) = 0): exact, and the plain symmetric update runs at a
                # fraction of the speed of the matrix product where BLAS has a slow GEMMT (measured 24 s against 10 s).
                factor.setMumpsIcntl(35, 1)
        ksp.setErrorIfNotConverged(True)
        ksp.setUp()
        self._ksp = ksp

    def solve(self, B: Floats) -> Floats:
        """X = A⁻¹ B for a block of right-hand sides at the owned unknowns, (owned, k). Collective."""
        k = B.shape[1]
        sizes = ((self.space.owned, self.space.size), (PETSc.DECIDE, k))
        B = np.asfortranarray(np.where(self.held, 0.0, self._unit)[:, None] * B)
        rhs = PETSc.Mat().createDense(sizes, array=B, comm=self.space.comm)
        X = PETSc.Mat().createDense(sizes, comm=self.space.comm)
        X.setUp()
        rhs.assemble()
        try:
            self._ksp.matSolve(rhs, X)
            result: Floats = np.multiply(X.getDenseArray(), self._unit[:, None], order="F")
        finally:
            rhs.destroy()
            X.destroy()
        return result

    def solve_rows(self, H: sp.csr_array) -> Floats:
        """X = A⁻¹ Hᵀ for sparse rows H on displacements that A moves, (owned, k). Collective.

        MUMPS passes over the branches of the factor that a sparse right-hand side does not reach, which halves its
        time; it takes such right-hand sides from one rank only, so that on several ranks they are dense.
        """
        factor = self._ksp.getPC()
        sparse = self.space.comm.size == 1 and self._ksp.getType() == PETSc.KSP.Type.PREONLY
        if not (sparse and factor.getFactorSolverType() == PETSc.Mat.SolverType.MUMPS):
            return self.solve(H.toarray().T)
        k = H.shape[0]
        csr = H.indptr.astype(PETSc.IntType), H.indices.astype(PETSc.IntType), H.data
        rows = PETSc.Mat().createAIJ((k, self.space.size), csr=csr, comm=self.space.comm)
        columns = PETSc.Mat().createTranspose(rows)
        X = PETSc.Mat().createDense((self.space.size, k), comm=self.space.comm)
        X.setUp()
        try:
            factor.getFactorMatrix().matSolve(columns, X)
            result: Floats = np.multiply(X.getDenseArray(), self._unit[:, None], order="F")
        finally:
            for matrix in (columns, rows, X):
                matrix.destroy()
        return result

    def free_motion(self) -> None:
        """u ← u₀ + A⁻¹ (f_ext − f_int(u₀)): the motion without contact, up to the rigid modes of a floating body.

        u₀ has the present rigid motion and prescribed displacements only: round-off of the last shape would stay.
        """
        u, comm = self.owned(self.u), self.space.comm
        gram, along = (
            comm.allreduce(self.modes.T @ self.modes),
            comm.allreduce(self.modes.T @ np.where(self.fixed, 0.0, u)),
        )
        self.u = self.space.local(np.where(self.fixed, u, self.modes @ np.linalg.solve(gram, along)))
        self.correct(self.solve(self.residual()[:, None])[:, 0])

    def correct(self, increment: Floats) -> None:
        """Add an increment, given at the owned unknowns."""
        self.u += self.space.local(increment)

    def _vec(self, owned: Floats) -> Any:
        v = PETSc.Vec().createMPI((self.space.owned, self.space.size), comm=self.space.comm)
        v.array[:] = owned
        return v

    def close(self) -> None:
        """Destroy the matrix and the solver. Collective."""
        for thing in (self._ksp, self.A):
            if thing is not None:
                thing.destroy()
        self._ksp = self.A = None
        self.space.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()


def _orthonormal(basis: list[Any]) -> list[Any]:
    """Gram–Schmidt, in place."""
    for i, v in enumerate(basis):
        for w in basis[:i]:
            v.axpy(-v.dot(w), w)
        v.normalize()
    return basis
