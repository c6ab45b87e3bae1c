"""PETSc's reduced-space Newton method on the displacements, where contacts are bounds on single unknowns."""

from __future__ import annotations

from typing import Any

import numpy as np

from contact.solvers.certificate import length
from contact.solvers.dual import PETSc, failures, options
from contact.solvers.problem import (
    SOLVED,
    ContactNotConvergedError,
    ContactProblem,
    Floats,
    InfeasibleError,
    Ints,
    Primal,
    Solution,
)


def solve(problem: ContactProblem, start: Floats | None = None, tolerance: float = 1e-12) -> Solution:
    """Find x with A x = Hᵀλ, 0 ≤ δ = H x + q ⊥ λ ≥ 0 by SNES `vinewtonrsls` on x, options prefix `vi_primal_`.

    Row i of H must have one entry h at one unknown x_k: δᵢ ≥ 0 is a bound on x_k, from below for h > 0. λᵢ = (A x)_k/h
    goes to the row whose bound is reached, the first of equal ones. The SNES sees A/max|A| and x/max|q|. Collective on
    the communicator of `problem.primal`; W and `start` are not used.

    Raises
    ------
    ValueError
        There is no primal side, a body is free or without a matrix, or a row of H has not exactly one entry.
    InfeasibleError
        The bounds on an unknown leave no value.
    ContactNotConvergedError
        max|F| on free unknowns, or the violation of a sign, exceeds 1e-9 of the largest force.
    """
    if problem.primal is None or problem.G is not None or any(A is None for A in problem.primal.A):
        raise ValueError(
            "method = 'vi-primal': allowed only for supported bodies given by their matrices (problem.primal)"
        )
    bounds = _Bounds(problem.primal, np.asarray(problem.q, float))
    try:
        return bounds.solve(tolerance)
    finally:
        bounds.destroy()


class _Bounds:
    """A of all bodies as one matrix, scaled, and where each row's unknown is in it."""

    def __init__(self, primal: Primal, q: Floats) -> None:
        self.q, self.comm = q, primal.A[0].comm
        self.entry = np.zeros(len(q))
        self.unknown = np.full(len(q), -1)
        nest = PETSc.Mat().createNest(
            [[A if a == b else None for a, A in enumerate(primal.A)] for b in range(len(primal.A))], comm=self.comm
        )
        for H, part in zip(primal.H, nest.getNestISs()[1], strict=True):
            whole = part.allGather()
            self._read(H, whole.indices)
            whole.destroy()
        self.A = nest.convert("aij", PETSc.Mat())
        nest.destroy()
        if np.any(self.unknown < 0):
            raise ValueError(self._refusal(int(np.argmin(self.unknown)), "no entry"))
        diagonal = self.A.getDiagonal()
        self.stiffness = float(diagonal.norm(PETSc.NormType.INFINITY))
        diagonal.destroy()
        self.A.scale(1 / self.stiffness)
        self.size = float(np.abs(q).max(initial=0.0)) or 1.0

    @staticmethod
    def _refusal(row: int, found: str) -> str:
        return f"method = 'vi-primal': row {row} of H has {found}; allowed is exactly one (a bound on a single unknown)"

    def _read(self, H: Any, numbering: Ints) -> None:
        """Take over the entries of one body's H, from all ranks."""
        pointers, columns, values = H.getValuesCSR()
        rows = np.repeat(np.arange(len(pointers) - 1), np.diff(pointers)) + H.getOwnershipRange()[0]
        kept = values != 0
        parts = self.comm.tompi4py().allgather((rows[kept], columns[kept], values[kept]))
        rows, columns, values = (np.concatenate(items) for items in zip(*parts, strict=True))
        count = np.bincount(rows, minlength=len(self.q)) + (self.unknown >= 0)
        if np.any(count > 1):
            raise ValueError(self._refusal(int(np.argmax(count > 1)), "several entries"))
        self.unknown[rows], self.entry[rows] = numbering[columns], values

    def solve(self, tolerance: float) -> Solution:
        """Solve and recover λ."""
        x, F = self.A.createVecs()
        low, high = x.duplicate(), x.duplicate()
        snes, J = PETSc.SNES().create(self.comm), self.A.duplicate(copy=True)
        try:
            self._set(low, high)
            snes.setOptionsPrefix("vi_primal_")
            snes.setType("vinewtonrsls")
            snes.setFunction(lambda _, y, f: self.A.mult(y, f), F)
            snes.setJacobian(lambda _, y, J, P: self.A.copy(P), J)
            snes.setVariableBounds(low, high)
            snes.setTolerances(rtol=0.0, atol=tolerance, stol=0.0, max_it=1000)
            ksp = snes.getKSP()
            ksp.setType("preonly")
            ksp.getPC().setType("lu")
            ksp.getPC().setFactorSolverType("mumps")
            with options("vi_primal_", {"snes_vi_zero_tolerance": 1e-12}):
                snes.setFromOptions()
            with failures():
                snes.solve(None, x)
            self.A.mult(x, F)
            return self._solution(
                self._everywhere(x), self._everywhere(F), snes.getIterationNumber(), snes.getConvergedReason()
            )
        finally:
            for item in (snes, J, x, F, low, high):
                item.destroy()

    def _set(self, low: Any, high: Any) -> None:
        """The tightest bounds on each unknown."""
        bound = -self.q / self.entry / self.size
        below, above = np.full(self.A.size[0], -np.inf), np.full(self.A.size[0], np.inf)
        from_below = self.entry > 0
        np.maximum.at(below, self.unknown[from_below], bound[from_below])
        np.minimum.at(above, self.unknown[~from_below], bound[~from_below])
        if np.any(below > above):
            raise InfeasibleError(f"the bounds on unknown {np.argmax(below > above)} leave no value: the walls overlap")
        first, last = low.getOwnershipRange()
        low.array[:] = np.maximum(below[first:last], PETSc.NINFINITY)
        high.array[:] = np.minimum(above[first:last], PETSc.INFINITY)

    def _solution(self, x: Floats, F: Floats, iterations: int, reason: int) -> Solution:
        """λ from the residual F = A x, and the check of everything."""
        motion = self.size * self.entry * x[self.unknown]
        delta = self.q + motion
        force = self.stiffness * self.size * F[self.unknown] / self.entry
        ell = length(self.q, motion)
        # of the rows whose bound an unknown has reached, the closest carries
        closed = np.flatnonzero((force > 0) & (delta <= SOLVED * ell))
        closed = closed[np.argsort((delta / np.abs(self.entry))[closed], kind="stable")]
        closed = closed[np.unique(self.unknown[closed], return_index=True)[1]]
        lam = np.zeros_like(delta)
        lam[closed] = force[closed]
        left = F.copy()
        left[self.unknown[closed]] = 0.0
        wrong = max(
            float(np.abs(left).max(initial=0.0) / (np.abs(F).max(initial=0.0) or 1.0)),
            float(np.abs(np.where(lam > 0, delta, np.minimum(delta, 0.0))).max(initial=0.0) / ell),
        )
        if not wrong <= SOLVED:
            raise ContactNotConvergedError(f"SNES reason {reason}", iterations, wrong, lam, reason > 0)
        return Solution(lam, np.empty(0), delta, iterations)

    def _everywhere(self, vec: Any) -> Floats:
        """A vector's values on every rank."""
        return np.concatenate(self.comm.tompi4py().allgather(vec.array_r.copy()))

    def destroy(self) -> None:
        """Destroy the PETSc objects."""
        self.A.destroy()
