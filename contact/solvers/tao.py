"""PETSc's bound-constrained optimisation on the dual."""

from __future__ import annotations

from typing import Any

from contact.solvers.dual import PETSc, dual
from contact.solvers.problem import ContactProblem, Floats, Solution


def solve(problem: ContactProblem, start: Floats | None = None, tolerance: float = 1e-12) -> Solution:
    """Minimise ½ λᵀWλ + qᵀλ over λ ≥ 0 by TAO, options prefix `tao_`; the type is `bnls`.

    Newton with a line search and an active set, which also treats a semidefinite W (`gpcg` and `tron` do not).

    Raises
    ------
    ContactNotConvergedError
        The residual, recomputed, is above 1e-9.

    Source: Kelley, Iterative Methods for Optimization (1999), section 5.5.
    """
    with dual(problem, start) as scaled:
        tao = PETSc.TAO().create(PETSc.COMM_SELF)
        hessian = scaled.W.duplicate(copy=True)
        try:

            def objective(_: Any, y: Any, gradient: Any) -> float:
                scaled.W.mult(y, gradient)
                value = 0.5 * y.dot(gradient) + y.dot(scaled.q)
                gradient.axpy(1.0, scaled.q)
                return float(value)

            def second(_: Any, y: Any, H: Any, P: Any) -> None:
                scaled.W.copy(P)

            tao.setOptionsPrefix("tao_")
            tao.setType("bnls")
            tao.setObjectiveGradient(objective, None)
            tao.setHessian(second, hessian)
            tao.setVariableBounds((scaled.low, scaled.high))
            tao.setTolerances(gatol=tolerance, grtol=0.0, gttol=0.0)
            tao.setMaximumIterations(2000)
            tao.setFromOptions()
            tao.solve(scaled.y)
            return scaled.solution(tao.getIterationNumber(), "TAO", tao.getConvergedReason())
        finally:
            tao.destroy()
            hessian.destroy()
