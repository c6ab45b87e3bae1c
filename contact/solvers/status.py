"""The status method: which contacts carry force, found by a safeguarded active set on columns of W formed on demand."""

from __future__ import annotations

import numpy as np
from scipy.linalg import cho_solve

from contact.solvers.certificate import length, scaled
from contact.solvers.columns import FormedColumns, extend
from contact.solvers.problem import (
    SOLVED,
    ContactNotConvergedError,
    ContactProblem,
    DenseDelassus,
    Floats,
    InfeasibleError,
    Ints,
    Solution,
)

# A block of rows enters at once; while that works the next block is this many times larger.
GROWTH = 4
# Block steps end when the infeasibility exceeds this many times the least one seen.
WORSE = 2.0
STEPS = 40
REFINEMENTS = 3


def solve(problem: ContactProblem, start: Floats | None = None, tolerance: float = 1e-12) -> Solution:
    """Find λ with 0 ≤ δ = W λ + q ⊥ λ ≥ 0 by the status method.

    Contacts whose multiplier is negative leave and violated ones enter (the paper's rule), in two phases:

    1. Block steps. All negative multipliers leave and the most violated rows enter, 1, 4, 16, … at a time, each block
       with one request for columns. This suits solids, whose contacts are nearly independent: the contact zone grows
       from the deepest penetration outwards. It ends without a solution at a set already seen, when the infeasibility
       grows, or when the set stays violated because rows depend on one another.
    2. `kernels.ratio_tested`, one row at a time, from the better of the last feasible λ and max(λ, 0): λ stays
       nonnegative and the dual objective decreases, so that it cannot cycle; W may be singular.

    Where all of W is known and a guess is given, `warm` begins with phase 2: between the passes of a step few rows
    change. Columns are asked for only when their row enters the set, each at most once. All comparisons are relative,
    to ℓ = max(max(−q)₊, max|Wλ|) and to W's diagonal, so that units do not matter.

    Parameters
    ----------
    problem : with W and q; its G must be None, `floating` handles free rigid modes
    start : (c) a guess whose positive entries are the first set [N]
    tolerance : on the gaps, relative to ℓ; never below the rounding of W λ

    Returns
    -------
    Solution, `iterations` counting the linear solves; `details`: `columns` formed (all of a DenseDelassus),
    `factorisations` (the Cholesky work in units of one factorisation of the final set), `blocks` (steps of phase 1),
    `departures`.

    Raises
    ------
    InfeasibleError
        The dual objective is unbounded: some z ≥ 0 has W z = 0 and qᵀz < 0.
    ContactNotConvergedError
        The complementarity residual is above 1e-9.

    Source: the paper, section 2.3, and the references of `kernels.ratio_tested`.
    """
    q = np.ascontiguousarray(problem.q, float)
    if start is not None and isinstance(problem.W, DenseDelassus) and (start > 0).any():
        from contact.solvers import warm  # numba: only where it is needed

        found = warm.solve(problem.W, q, np.maximum(start, 0.0), tolerance)
        if found is not None:
            return found
    columns = FormedColumns(problem.W)
    first = np.flatnonzero(start > 0) if start is not None else np.empty(0, np.int64)
    blocks = _BlockSteps(columns, q, tolerance, start)
    if not blocks.run(first):
        _ratio_tested(blocks)
    lam, delta, rows = blocks.lam, blocks.delta, columns.rows
    pull = np.zeros_like(lam)
    pull[rows] = columns.diagonal(rows) * lam[rows]
    residual = scaled(pull, delta, length(q, delta - q))
    if not residual <= SOLVED:
        reason = "violated contacts depend on the active ones"
        if (columns.diagonal(rows) < 0).any():
            reason = "W has a negative diagonal entry: A is not positive definite"
        raise ContactNotConvergedError(reason, blocks.iterations, residual, lam)
    details = {
        "columns": float(len(rows)),
        "factorisations": float(blocks.work / max(int(np.count_nonzero(lam)), 1) ** 3),
        "blocks": float(blocks.steps),
        "departures": float(blocks.departures),
    }
    return Solution(lam, np.empty(0), delta, blocks.iterations, details)


class _BlockSteps:
    """Phase 1, and the state that it leaves to phase 2: the set `rows`, its Cholesky factor L, λ and δ."""

    def __init__(self, columns: FormedColumns, q: Floats, tolerance: float, start: Floats | None = None) -> None:
        self.columns, self.q, self.tolerance = columns, q, tolerance
        self.start = np.zeros_like(q) if start is None else np.maximum(start, 0.0)
        self.rows: Ints = np.empty(0, np.int64)
        self.L: Floats = np.empty((0, 0))
        self.lam: Floats = np.zeros_like(q)
        self.delta: Floats = q
        self.iterations, self.steps, self.departures, self.work = 0, 0, 0, 0.0

    def run(self, first: Ints) -> bool:
        """Take block steps from the set `first`; True if they reached the solution."""
        feasible, least, block = np.zeros_like(self.q), np.inf, 1
        wanted = np.zeros(len(self.q), bool)
        wanted[first] = True
        seen = {wanted.tobytes()}
        if len(first):
            self.change(first)
            if len(self.rows) == len(first):
                feasible = self.start  # λ ≥ 0 on independent rows
        while True:
            rounding, scale = self.rounding(), length(self.q, self.delta - self.q)
            candidates = [feasible]
            if rounding > SOLVED * scale:
                break
            negative, violated, worst = self.wrong(max(self.tolerance * scale, rounding))
            if not len(negative):
                feasible = self.lam
                if not len(violated):
                    return True
            candidates = [feasible, np.maximum(self.lam, 0.0)]
            least = min(least, worst)
            entering = violated[np.argsort(self.delta[violated])[:block]]
            wanted = self.lam > 0
            wanted[entering] = True
            key = wanted.tobytes()
            if worst > WORSE * least or key in seen or self.steps == STEPS:
                break
            seen.add(key)
            self.steps += 1
            self.departures += len(negative)
            self.change(entering)
            block *= GROWTH
        self.restart(min(candidates, key=self.objective))
        return False

    def rounding(self) -> float:
        """What the errors of W's entries may make of W λ: accuracy × Σⱼ |λⱼ| maxᵢ |Wᵢⱼ| [m]."""
        return float(self.columns.accuracy * (self.columns.peak(self.rows) @ np.abs(self.lam[self.rows])))

    def wrong(self, small: float) -> tuple[Ints, Ints, float]:
        """Active rows with λ ≤ 0, other rows with δ < −`small`, and the largest of Wᵢᵢ|λᵢ| and |δᵢ| there [m]."""
        active = np.zeros(len(self.q), bool)
        active[self.rows] = True
        negative = self.rows[self.lam[self.rows] <= 0]
        violated = np.flatnonzero(~active & (self.delta < -small))
        pulls = self.columns.diagonal(negative) * -self.lam[negative]
        return negative, violated, max(float(pulls.max(initial=0.0)), float(-self.delta[violated].min(initial=0.0)))

    def change(self, entering: Ints) -> None:
        """Let rows with λ ≤ 0 leave and `entering` enter; solve W λ + q = 0 on the rows that are independent.

        Rows that may leave next stand last, so that the leading part of the factor is kept.
        """
        leaving = np.flatnonzero(self.lam[self.rows] <= 0)
        p = leaving[0] if len(leaving) else len(self.rows)
        tail = self.rows[p:]
        tail = tail[self.lam[tail] > 0]
        self.columns.form(entering)
        self.factorise(p, np.concatenate([self.rows[:p], tail[np.argsort(-self.lam[tail])], entering]))
        self.lam, self.delta = np.zeros_like(self.q), self.q
        for _ in range(REFINEMENTS):
            self.lam[self.rows] -= cho_solve((self.L, True), self.delta[self.rows], check_finite=False)
            self.delta = self.q + self.columns.product(self.lam)
            self.iterations += 1
            left = np.abs(self.delta[self.rows]).max(initial=0.0)
            if left <= self.tolerance * length(self.q, self.delta - self.q):
                break

    def factorise(self, p: int, rows: Ints) -> None:
        """Make L the factor of the independent among `rows`, the first `p` of which it has already."""
        self.L, kept = extend(self.L[:p, :p], self.columns.block(rows, rows[p:]), self.columns.pivot)
        self.rows = rows[kept]
        self.work += len(kept) ** 3 - p**3

    def objective(self, lam: Floats) -> float:
        """½ λᵀWλ + qᵀλ."""
        return float(lam @ (self.columns.product(lam) / 2 + self.q))

    def restart(self, lam: Floats) -> None:
        """Begin again from λ ≥ 0, whose support is independent."""
        self.lam, self.delta = lam, self.q + self.columns.product(lam)
        self.factorise(0, np.flatnonzero(lam))


def _ratio_tested(blocks: _BlockSteps) -> None:
    """Phase 2: overwrites the λ, δ and rows of `blocks`."""
    from contact.solvers import kernels  # numba: only where it is needed

    columns, q, c, n = blocks.columns, blocks.q, len(blocks.q), len(blocks.rows)
    size = 2 * n + 16
    order, U = np.empty(size, np.int64), np.empty((size, size))
    order[:n], U[:n, :n] = blocks.rows, blocks.L.T
    active = np.zeros(c, np.int64)
    active[blocks.rows] = 1
    peak = np.zeros(c)
    peak[blocks.rows] = columns.peak(blocks.rows)
    state, limit = np.array([n, -1, 0, 0]), 100 + 20 * c
    blocks.lam, blocks.delta = blocks.lam.copy(), blocks.delta.copy()
    while True:
        verdict = kernels.ratio_tested(
            columns.values, columns.slot, q, blocks.lam, blocks.delta, order, U, active, peak, state,
            blocks.tolerance, columns.pivot, columns.accuracy, limit,
        )  # fmt: skip
        if verdict != kernels.WANTED:
            break
        n, wanted = state[0], state[1]
        columns.form(np.array([wanted]))
        if n == len(U):
            order, U = np.pad(order, (0, n)), np.pad(U, (0, n))
    blocks.iterations += int(state[2])
    blocks.departures += int(state[3])
    if verdict == kernels.INFEASIBLE:
        raise InfeasibleError(
            f"contact {state[1]} cannot be satisfied together with the active ones: the walls overlap"
        )
