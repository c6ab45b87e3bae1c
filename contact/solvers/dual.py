"""The dual problem as PETSc objects, for the methods that PETSc brings."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import numpy as np

from contact.solvers.certificate import accepted
from contact.solvers.columns import dense
from contact.solvers.problem import ContactNotConvergedError, ContactProblem, Floats, Solution
from fem import petsc  # noqa: F401  arranges the order in which MPI and PETSc are imported

from petsc4py import PETSc as _PETSc  # isort: skip

# petsc4py's stubs refuse much of what petsc4py accepts
PETSc: Any = _PETSc

# Added to the Jacobian's unit diagonal, not to the equations: a factor for rows that depend on one another.
SHIFT = 1e-12


class Dual:
    """0 ≤ W₁ y + q₁ ⊥ y ≥ 0 with W₁ = S W S of unit diagonal, q₁ = S q / s, max|q₁| = 1, λ = s S y.

    PETSc's tolerances are absolute, so nothing but the scaled problem may be given to them. `W` is a dense Mat, `q` and
    the bounds `low`, `high` are Vecs, all on COMM_SELF.
    """

    def __init__(self, problem: ContactProblem, start: Floats | None) -> None:
        self.dense, self.free = dense(problem.W), np.asarray(problem.q, float)
        diagonal = np.diagonal(self.dense)
        self.S = 1 / np.sqrt(np.where(diagonal > 0, diagonal, 1.0))
        self.s = float(np.abs(self.S * self.free).max()) or 1.0
        c = len(self.S)
        scaled = self.S[:, None] * self.dense * self.S
        self.W = PETSc.Mat().createDense([c, c], array=np.asfortranarray(scaled), comm=PETSc.COMM_SELF)
        self.q = self.vector(self.S * self.free / self.s)
        self.low, self.high = self.vector(np.zeros(c)), self.vector(np.full(c, PETSc.INFINITY))
        self.y = self.vector(np.zeros(c) if start is None else np.maximum(start, 0.0) / (self.s * self.S))

    @staticmethod
    def vector(values: Floats) -> Any:
        """A Vec that owns a copy of `values`."""
        vec = PETSc.Vec().createSeq(len(values), comm=PETSc.COMM_SELF)
        vec.array[:] = values
        return vec

    def destroy(self) -> None:
        """Destroy the PETSc objects."""
        for item in (self.W, self.q, self.low, self.high, self.y):
            item.destroy()

    def solution(self, iterations: int, solver: str, reason: int) -> Solution:
        """λ from y, if its residual is small: it decides, not the reason that PETSc's solver gives (above 0: solved).

        Raises
        ------
        ContactNotConvergedError
        """
        lam = np.maximum(self.s * self.S * self.y.array_r, 0.0)
        return accepted(self.dense, self.free, lam, iterations, f"{solver} reason {reason}", claimed=reason > 0)


@contextmanager
def dual(problem: ContactProblem, start: Floats | None) -> Iterator[Dual]:
    """The dual problem for the length of a `with`, under `failures`."""
    scaled = Dual(problem, start)
    try:
        with failures():
            yield scaled
    finally:
        scaled.destroy()


@contextmanager
def failures() -> Iterator[None]:
    """PETSc's errors (a zero pivot, a solver set to fail loudly) as ContactNotConvergedError."""
    try:
        yield
    except PETSc.Error as error:
        raise ContactNotConvergedError(f"PETSc error {error.ierr}", 0, np.inf) from error


@contextmanager
def options(prefix: str, defaults: dict[str, Any]) -> Iterator[None]:
    """Defaults that have no function of their own, in PETSc's database where the user has said nothing."""
    database = PETSc.Options(prefix)
    ours = [name for name in defaults if not database.hasName(name)]
    for name in ours:
        database[name] = defaults[name]
    try:
        yield
    finally:
        for name in ours:
            database.delValue(name)


def semismooth(kind: str, prefix: str, problem: ContactProblem, start: Floats | None, tolerance: float) -> Solution:
    """Solve the dual by a SNES for variational inequalities: Newton on F(y) = W₁ y + q₁ with y ≥ 0.

    `kind` is PETSc's type, `prefix` that of its options. Steps are solved with a dense LU.
    """
    with dual(problem, start) as scaled:
        snes = PETSc.SNES().create(PETSc.COMM_SELF)
        J, F = scaled.W.duplicate(copy=True), scaled.q.duplicate()
        try:

            def function(_: Any, y: Any, f: Any) -> None:
                scaled.W.multAdd(y, scaled.q, f)

            def jacobian(_: Any, y: Any, J: Any, P: Any) -> None:
                # filled anew: SSLS scales it in place
                scaled.W.copy(P)
                P.shift(SHIFT)

            snes.setOptionsPrefix(prefix)
            snes.setType(kind)
            snes.setFunction(function, F)
            snes.setJacobian(jacobian, J)
            snes.setVariableBounds(scaled.low, scaled.high)
            snes.setTolerances(rtol=0.0, atol=tolerance, stol=0.0, max_it=500)
            ksp = snes.getKSP()
            ksp.setType("preonly")
            ksp.getPC().setType("lu")
            with options(prefix, {"snes_vi_zero_tolerance": 1e-12}):
                snes.setFromOptions()
            snes.solve(None, scaled.y)
            return scaled.solution(snes.getIterationNumber(), "SNES", snes.getConvergedReason())
        finally:
            for item in (snes, J, F):
                item.destroy()
