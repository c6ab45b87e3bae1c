"""The saddle-point system of displacements and contact forces, solved directly."""

from __future__ import annotations

from typing import Any

import numpy as np

from contact.solvers.certificate import length
from contact.solvers.columns import FormedColumns, extend
from contact.solvers.dual import PETSc, failures
from contact.solvers.floating import Modes
from contact.solvers.problem import SOLVED, ContactNotConvergedError, ContactProblem, Floats, Ints, Primal, Solution


def solve(problem: ContactProblem, start: Floats | None = None, tolerance: float = 1e-12) -> Solution:
    """Solve for displacements and forces on the contacts that the status method finds, without W.

    On a maximal independent subset a of the active rows, chosen by pivoted Cholesky,

        [A   0   −H_aᵀ] [x  ]   [ 0  ]
        [0   0    U ᵀ ] [γ  ] = [−ρ′ ]
        [H_a U    0   ] [λ_a]   [−q_a]

    with A of all bodies and, for rigid modes, U γ = G_a α, Uᵀλ_a + ρ′ = 0 in an orthonormal basis. One LU by MUMPS,
    options prefix `kkt_`, and one refinement. δ = H x + G α + q is formed from x: W has no part in the result but the
    choice of a. `details["difference"]` is max|λ − λ_status|/max λ. Collective on the communicator of `problem.primal`,
    whose matrices must share it.

    Raises
    ------
    ValueError
        The problem has no primal side, or a body without a matrix.
    InfeasibleError, ContactNotConvergedError
        From the status method; the latter also where δ or λ contradict it by more than 1e-9.
    """
    from contact.solvers import METHODS

    if problem.primal is None or any(A is None for A in problem.primal.A):
        raise ValueError("method = 'kkt': allowed only where the matrices behind W are given (problem.primal)")
    found = METHODS["status"](problem, start, tolerance)
    active = np.flatnonzero(found.lam)
    if not len(active):
        return found
    modes = Modes(problem) if problem.G is not None else None
    Q, load = (modes.Q, modes.load) if modes is not None else (np.empty((len(problem.q), 0)), np.empty(0))
    columns = FormedColumns(problem.W)
    columns.form(active)
    softness = columns.diagonal(active).max() * len(problem.q) or 1.0
    augmented = columns.block(active, active) + softness * Q[active] @ Q[active].T
    rows = np.sort(active[extend(np.empty((0, 0)), augmented, columns.pivot)[1]])

    # motions that these contacts leave free keep the amplitude that `status` gave them
    U, S, Vt = np.linalg.svd(Q[rows], full_matrices=False)
    held = S > 1e-10
    U, S, Vt = U[:, held], S[held], Vt[held]
    rigid = problem.q * 0 if modes is None else Q @ modes.coordinates(found.alpha)
    system = _Saddle(problem.primal, rows, U)
    try:
        with failures():
            elastic, gamma, forces = system.solve(-(Vt @ load) / S, -(problem.q + rigid)[rows])
    finally:
        system.destroy()
    change = Vt.T @ (gamma / S)
    rigid = rigid + Q @ change
    lam, delta = np.zeros_like(found.lam), problem.q + elastic + rigid
    lam[rows] = forces
    alpha = found.alpha if modes is None else found.alpha + modes.amplitudes(change)
    gaps = np.abs(np.where(lam != 0, delta, np.minimum(delta, 0.0))).max() / length(problem.q, elastic, rigid)
    wrong = max(float(gaps), float(-forces.min() / np.abs(forces).max()))
    if not wrong <= SOLVED:
        raise ContactNotConvergedError("the saddle-point system contradicts the status method", 1, wrong, lam)
    difference = float(np.abs(lam - found.lam).max() / found.lam.max())
    return Solution(lam, alpha, delta, found.iterations, {"difference": difference, "rows": len(rows)})


class _Saddle:
    """The saddle-point matrix as PETSc AIJ, assembled from a nest of the bodies' blocks."""

    def __init__(self, primal: Primal, rows: Ints, U: Floats) -> None:
        comm = self.comm = primal.A[0].comm
        first, last = primal.H[0].getOwnershipRange()
        mine = rows[(rows >= first) & (rows < last)]
        here = PETSc.IS().createGeneral(mine.astype(PETSc.IntType), comm=comm)
        self.H = primal.H
        H = [body.createSubMatrix(here) for body in primal.H]
        minus = [self._transposed(block, -1.0) for block in H]
        k = U.shape[1] if comm.rank == 0 else 0
        bodies = len(H)
        blocks: list[list[Any]] = [[None] * (bodies + 1) for _ in range(bodies + 1)]
        for b in range(bodies):
            blocks[b][b], blocks[b][bodies], blocks[bodies][b] = primal.A[b], minus[b], H[b]
        own = [*H, *minus, here]
        if U.shape[1]:
            modes = PETSc.Mat().createAIJ(((len(mine), len(rows)), (k, U.shape[1])), nnz=U.shape[1], comm=comm)
            begin, end = modes.getOwnershipRange()
            modes.setValues(range(begin, end), range(U.shape[1]), U[begin:end])
            modes.assemble()
            balance = self._transposed(modes, 1.0)
            blocks = [[*row[:-1], None, row[-1]] for row in blocks]
            blocks[-1][bodies] = modes
            blocks.insert(bodies, [None] * (bodies + 1) + [balance])
            own += [modes, balance]
        nest = PETSc.Mat().createNest(blocks, comm=comm)
        self.parts = [part.indices.copy() for part in nest.getNestISs()[0]]
        self.matrix = nest.convert("aij", PETSc.Mat())
        for item in (nest, *own):
            item.destroy()
        self.ksp = PETSc.KSP().create(comm)
        self.ksp.setOptionsPrefix("kkt_")
        self.ksp.setType("preonly")
        self.ksp.getPC().setType("lu")
        self.ksp.getPC().setFactorSolverType("mumps")
        self.ksp.setErrorIfNotConverged(True)
        self.ksp.setFromOptions()
        self.ksp.setOperators(self.matrix)

    @staticmethod
    def _transposed(block: Any, factor: float) -> Any:
        """`factor` times the transpose."""
        result = block.transpose(PETSc.Mat())
        result.scale(factor)
        return result

    def solve(self, load: Floats, gaps: Floats) -> tuple[Floats, Floats, Floats]:
        """H x (c), γ and λ_a for the right-hand sides of the modes and of the contacts, on every rank."""
        x, b = self.matrix.createVecs()
        step = x.duplicate()
        bodies = len(self.H)
        try:
            counts = self.comm.tompi4py().allgather(len(self.parts[-1]))
            before = sum(counts[: self.comm.rank])
            b.setValues(self.parts[-1], gaps[before : before + len(self.parts[-1])])
            if len(load) and self.comm.rank == 0:
                b.setValues(self.parts[bodies], load)
            b.assemble()
            self.ksp.solve(b, x)
            self.matrix.mult(x, step)
            b.axpy(-1.0, step)
            self.ksp.solve(b, step)
            x.axpy(1.0, step)
            local = x.array_r
            begin = x.getOwnershipRange()[0]
            elastic = np.zeros(self.H[0].getLocalSize()[0])
            for body, part in zip(self.H, self.parts, strict=False):
                right, left = body.createVecs()
                right.array[:] = local[part - begin]
                body.mult(right, left)
                elastic += left.array_r
                right.destroy()
                left.destroy()
            gamma = local[self.parts[bodies] - begin] if len(load) else np.empty(0)
            return self._everywhere(elastic), self._everywhere(gamma), self._everywhere(local[self.parts[-1] - begin])
        finally:
            for vec in (x, b, step):
                vec.destroy()

    def _everywhere(self, values: Floats) -> Floats:
        """The ranks' values one after the other, on every rank."""
        return np.concatenate(self.comm.tompi4py().allgather(np.array(values)))

    def destroy(self) -> None:
        """Destroy the PETSc objects."""
        self.ksp.destroy()
        self.matrix.destroy()
