"""What decides whether a problem is solved, whatever the method that solved it."""

from __future__ import annotations

import numpy as np

from contact.solvers.columns import FormedColumns
from contact.solvers.problem import SOLVED, ContactNotConvergedError, ContactProblem, Floats, Solution


def length(q: Floats, *motions: Floats) -> float:
    """ℓ = max(max(−q)₊, max|motions|), what gaps are measured by [m]; max|q| or 1 where nothing moves or penetrates."""
    moved = max(float(np.abs(motion).max(initial=0.0)) for motion in motions)
    return max(float(-q.min(initial=0.0)), moved) or float(np.abs(q).max(initial=0.0)) or 1.0


def scaled(pull: Floats, delta: Floats, ell: float) -> float:
    """max|min(Wᵢᵢ λᵢ, δᵢ)|/ℓ for `pull` = Wᵢᵢ λᵢ."""
    return float(np.abs(np.minimum(pull, delta)).max(initial=0.0)) / ell


def residual(problem: ContactProblem, solution: Solution) -> float:
    """The scale-free complementarity residual max|min(Wᵢᵢ λᵢ, δᵢ)|/ℓ, recomputed from λ and α.

    ℓ = max(max(−q)₊, max|Wλ|, max|Gα|). Asks for the columns of W where λ ≠ 0; finite always.
    """
    columns, carrying = FormedColumns(problem.W), np.flatnonzero(solution.lam)
    columns.form(carrying)
    elastic = columns.product(solution.lam)
    rigid = np.zeros_like(elastic) if problem.G is None else problem.G @ solution.alpha
    pull = np.zeros_like(elastic)
    pull[carrying] = columns.diagonal(carrying) * solution.lam[carrying]
    return scaled(pull, problem.q + elastic + rigid, length(problem.q, elastic, rigid))


def accepted(
    W: Floats,
    q: Floats,
    lam: Floats,
    iterations: int,
    reason: str,
    details: dict[str, float] | None = None,
    claimed: bool = False,
) -> Solution:
    """The solution λ of a method that has all of W.

    Raises
    ------
    ContactNotConvergedError
        With the method's `reason`, where the residual of λ is above `SOLVED`, even if it has `claimed` a solution.
        Where some Wᵢᵢ is negative, as that of no stable state is, the residual cannot refute a claim: it is not kept.
    """
    elastic = W @ lam
    delta = elastic + q
    reached = scaled(np.diagonal(W) * lam, delta, length(q, elastic))
    if not reached <= SOLVED:
        refuted = claimed and bool(np.all(np.diagonal(W) >= 0))
        raise ContactNotConvergedError(reason, iterations, reached, lam, refuted)
    return Solution(lam, np.empty(0), delta, iterations, details or {})
