"""The status method where all of W is known and a guess is close: block steps, then the ratio-tested phase alone."""

from __future__ import annotations

import numpy as np

from contact.solvers import kernels
from contact.solvers.certificate import length, scaled
from contact.solvers.columns import EPSILON, PIVOT
from contact.solvers.problem import SOLVED, DenseDelassus, Floats, InfeasibleError, Ints, Solution

BLOCKS = 8


class Memo:
    """What problems with the same W (c, c) share: the active rows of the last solution and their upper factor."""

    def __init__(self, c: int) -> None:
        self.n = 0
        self.order: Ints = np.empty(c, np.int64)
        self.U: Floats = np.empty((c, c))


def solve(W: DenseDelassus, q: Floats, start: Floats, tolerance: float) -> Solution | None:
    """The solution found from `start` ≥ 0, or None where its rows are dependent or the residual stays above 1e-9.

    Raises
    ------
    InfeasibleError
        as `kernels.ratio_tested` finds it.
    """
    c, values = len(q), W.W
    memo = W.memo = W.memo or Memo(c)
    lam, delta, order, U = np.empty(c), np.empty(c), memo.order, memo.U
    state = np.array([memo.n, -1, 0, 0])
    verdict = kernels.block_steps(values, q, start, lam, delta, order, U, state, tolerance, PIVOT, BLOCKS)
    memo.n = max(int(state[0]), 0)
    if verdict == kernels.DEPENDENT:
        return None
    if verdict == kernels.GUESS:
        active = np.zeros(c, np.int64)
        active[order[: memo.n]] = 1
        verdict = kernels.ratio_tested(
            values, np.arange(c), q, lam, delta, order, U, active, np.abs(values).max(axis=0), state,
            tolerance, PIVOT, max(W.noise, 4 * EPSILON), 100 + 20 * c,
        )  # fmt: skip
        memo.n = int(state[0])
        if verdict == kernels.INFEASIBLE:
            raise InfeasibleError(
                f"contact {state[1]} cannot be satisfied together with the active ones: the walls overlap"
            )
        if not scaled(np.diagonal(values) * lam, delta, length(q, delta - q)) <= SOLVED:
            return None
    return Solution(lam, np.empty(0), delta, int(state[2]) or 1, {"columns": float(c), "departures": float(state[3])})
