"""What decides whether a problem is solved, whatever the method that solved it."""

from __future__ import annotations

import numpy as np

from contact.solvers.columns import FormedColumns
from contact.solvers.problem import SOLVED, ContactNotConvergedError, ContactProblem, Floats, Solution


def length(motion: Floats, q: Floats) -> float:
    """ℓ = max(max(−q)₊, max|δ − q|), what gaps are measured by [m]; max|q| or 1 where nothing moves or penetrates."""
    free = np.abs(q).max(initial=0.0)
    return float(max(-q.min(initial=0.0), np.abs(motion).max(initial=0.0)) or free or 1.0)


def scaled(pull: Floats, delta: Floats, q: Floats) -> float:
    """max|min(Wᵢᵢ λᵢ, δᵢ)|/ℓ for `pull` = Wᵢᵢ λᵢ."""
    return float(np.abs(np.minimum(pull, delta)).max(initial=0.0)) / length(delta - q, q)


def residual(problem: ContactProblem, solution: Solution) -> float:
    """The scale-free complementarity residual max|min(Wᵢᵢ λᵢ, δᵢ)|/ℓ, recomputed from λ and α.

    ℓ = max(max(−q)₊, max|Wλ + Gα|). Asks for the columns of W where λ ≠ 0; finite always.
    """
    columns, carrying = FormedColumns(problem.W), np.flatnonzero(solution.lam)
    columns.form(carrying)
    motion = columns.product(solution.lam)
    if problem.G is not None:
        motion = motion + problem.G @ solution.alpha
    pull = np.zeros_like(solution.lam)
    pull[carrying] = columns.diagonal(carrying) * solution.lam[carrying]
    return scaled(pull, problem.q + motion, problem.q)


def accepted(
    W: Floats, q: Floats, lam: Floats, iterations: int, reason: str, details: dict[str, float] | None = None
) -> Solution:
    """The solution λ of a method that has all of W.

    Raises
    ------
    ContactNotConvergedError
        With the method's `reason`, where the residual of λ is above `SOLVED`, whatever the method claims.
    """
    delta = W @ lam + q
    reached = scaled(np.diagonal(W) * lam, delta, q)
    if not reached <= SOLVED:
        raise ContactNotConvergedError(reason, iterations, reached, lam)
    return Solution(lam, np.empty(0), delta, iterations, details or {})
