"""The status method where all of W is known and a guess is close: the ratio-tested phase alone, on a kept factor."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from scipy.linalg import lapack

from contact.solvers import kernels
from contact.solvers.certificate import length, scaled
from contact.solvers.columns import EPSILON, PIVOT
from contact.solvers.problem import SOLVED, DenseDelassus, Floats, InfeasibleError, Ints, Solution

ROOM = 16  # rows that may enter before the factor needs a larger array
BLOCKS = 3


@dataclass
class Memo:
    """What problems with the same W share: maxᵢ |Wᵢⱼ|, and the rows and upper Cholesky factor of the last solution."""

    peak: Floats
    slot: Ints
    n: int = 0
    order: Ints = field(default_factory=lambda: np.empty(0, np.int64))
    U: Floats = field(default_factory=lambda: np.empty((0, 0)))

    def take(self, W: Floats, first: Ints) -> bool:
        """Hold the factor of rows `first`; False where they depend on one another."""
        n = len(first)
        if n == self.n and np.array_equal(np.sort(self.order[:n]), first):
            return True
        block = W.take(first, axis=0).take(first, axis=1)
        L, info = lapack.dpotrf(block.T, lower=1, clean=0)
        if info or np.any(np.diagonal(L) ** 2 <= PIVOT * np.diagonal(block)):
            return False
        self.n, self.order, self.U = n, np.empty(n + ROOM, np.int64), np.empty((n + ROOM, n + ROOM))
        self.order[:n], self.U[:n, :n] = first, L.T
        return True


def solve(W: DenseDelassus, q: Floats, start: Floats, tolerance: float) -> Solution | None:
    """The solution found from `start` ≥ 0, or None where its rows are dependent or the residual stays above 1e-9.

    Raises
    ------
    InfeasibleError
        as `kernels.ratio_tested` finds it.
    """
    c, values = len(q), W.W
    memo = W.memo = W.memo or Memo(np.abs(values).max(axis=0), np.arange(c))
    lam, delta = _block_steps(memo, values, q, start, tolerance)
    if lam is None:
        return None
    if delta is not None:
        return Solution(lam, np.empty(0), delta, 1, {"columns": float(c), "departures": 0.0})
    n, order, U = memo.n, memo.order, memo.U
    active = np.zeros(c, np.int64)
    active[order[:n]] = 1
    state, accuracy = np.array([n, -1, 0, 0]), max(W.noise, 4 * EPSILON)
    delta = q + values @ lam
    while True:
        verdict = kernels.ratio_tested(
            values, memo.slot, q, lam, delta, order, U, active, memo.peak, state,
            tolerance, PIVOT, accuracy, 100 + 20 * c,
        )  # fmt: skip
        if verdict != kernels.WANTED:
            break
        order, U = np.pad(order, (0, len(U))), np.pad(U, (0, len(U)))
    memo.n, memo.order, memo.U = int(state[0]), order, U
    if verdict == kernels.INFEASIBLE:
        raise InfeasibleError(
            f"contact {state[1]} cannot be satisfied together with the active ones: the walls overlap"
        )
    if not scaled(np.diagonal(values) * lam, delta, length(q, delta - q)) <= SOLVED:
        return None
    return Solution(lam, np.empty(0), delta, int(state[2]), {"columns": float(c), "departures": float(state[3])})


def _block_steps(
    memo: Memo, W: Floats, q: Floats, start: Floats, tolerance: float
) -> tuple[Floats | None, Floats | None]:
    """λ ≥ 0 on independent rows, whose factor `memo` then holds, and δ where that is the solution within `tolerance`.

    λ is None where the guess has dependent rows.

    All rows with a negative multiplier leave and all violated ones enter at once, a few times (a primal-dual active
    set). Where that does not end at a λ ≥ 0, it is the guess.
    """
    rows = first = np.flatnonzero(start)
    for _ in range(BLOCKS):
        if not len(rows) or not memo.take(W, rows):
            break
        n = memo.n
        order, x = memo.order[:n], -q[memo.order[:n]]
        kernels.solve_transposed(memo.U, n, x)
        kernels.solve_upper(memo.U, n, x)
        lam = np.zeros_like(q)
        lam[order] = x
        delta = q + W @ lam
        small = tolerance * length(q, delta - q)
        negative = x <= 0
        if not negative.any():
            solved = delta.min() >= -small and np.abs(delta[order]).max() <= small
            return lam, delta if solved else None
        wanted = delta < -small
        wanted[order[~negative]] = True
        rows = np.flatnonzero(wanted)
    return (start.copy() if memo.take(W, first) else None), None
