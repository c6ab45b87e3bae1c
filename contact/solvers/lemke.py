"""Lemke's complementary pivoting."""

from __future__ import annotations

import numpy as np
from scipy.linalg import cho_solve

from contact.solvers.certificate import accepted
from contact.solvers.columns import PIVOT, dense, extend
from contact.solvers.problem import (
    ContactNotConvergedError,
    ContactProblem,
    Floats,
    InfeasibleError,
    Ints,
    Solution,
)

# Entries of the scaled tableau below the first are rounding; ratios that differ by less than the second are equal.
ZERO, TIE = 1e-9, 1e-12


def solve(problem: ContactProblem, start: Floats | None = None, tolerance: float = 1e-12) -> Solution:
    """Find z with w = W z + q + z₀ e, w, z, z₀ ≥ 0, w ⊥ z, following the path along which z₀ goes to 0.

    The tableau of w − W z − z₀ e = q, scaled to a unit diagonal and max|q| = 1, is updated by rank-one pivots; ties in
    the ratio test are broken lexicographically, so that the path does not return. Forms all of W; `start` and
    `tolerance` have no meaning for a path.

    Raises
    ------
    InfeasibleError
        The path ends in a ray z ≥ 0 with W z = 0, qᵀz < 0: no position satisfies the constraints.
    ContactNotConvergedError
        The path was lost to rounding.

    Source: Cottle, Pang & Stone, The Linear Complementarity Problem (1992), sections 4.4 and 4.9.
    """
    W, q = dense(problem.W), np.asarray(problem.q, float)
    c = len(q)
    diagonal = np.diagonal(W)
    scale = 1 / np.sqrt(np.where(diagonal > 0, diagonal, 1.0))
    W1, q1 = scale[:, None] * W * scale, scale * q
    size = float(np.abs(q1).max(initial=0.0)) or 1.0
    q1 = q1 / size
    basis, values, pivots, ray = _path(W1, q1)
    if ray is not None:
        longest = np.abs(ray).max()
        if np.abs(W1 @ ray).max() <= 1e-8 * longest and q1 @ ray < -1e-10 * longest:
            raise InfeasibleError("Lemke's path ends in a ray: the walls overlap")
        raise ContactNotConvergedError("the path ended in a ray that proves nothing", pivots, np.inf)
    # the tableau has gathered rounding: refine λ with W itself on the rows that it chose
    carrying = (basis >= c) & (basis < 2 * c)
    lam, rows = np.zeros(c), basis[carrying] - c
    lam[rows] = size * scale[rows] * values[carrying]
    L, kept = extend(np.empty((0, 0)), W[np.ix_(rows, rows)], PIVOT)
    rows = rows[kept]
    for _ in range(3):
        lam[rows] -= cho_solve((L, True), W[rows] @ lam + q[rows])
    return accepted(W, q, np.maximum(lam, 0.0), pivots, "the path was lost to rounding")


def _path(W: Floats, q: Floats) -> tuple[Ints, Floats, int, Floats | None]:
    """The last basis (variables 0…c−1 are w, c…2c−1 are z, 2c is z₀), its values, the pivots, and the ray or None."""
    c = len(q)
    T = np.hstack([np.eye(c), -W, -np.ones((c, 1)), q[:, None]])
    basis = np.arange(c)
    if q.min(initial=0.0) >= 0:
        return basis, q, 0, None
    # the row that leaves first makes all right-hand sides lexicographically positive
    row, entering = int(np.flatnonzero(q == q.min())[-1]), 2 * c
    for pivots in range(1, 50 * c + 50):
        leaving = basis[row]
        pivot_row = T[row] / T[row, entering]
        T -= np.outer(T[:, entering], pivot_row)
        T[row] = pivot_row
        basis[row] = entering
        if leaving == 2 * c:
            return basis, T[:, -1], pivots, None
        entering = leaving + c if leaving < c else leaving - c
        column = T[:, entering]
        rows = np.flatnonzero(column > ZERO)
        if not len(rows):
            ray = np.zeros(2 * c + 1)
            ray[basis], ray[entering] = np.maximum(-column, 0.0), 1.0
            return basis, T[:, -1], pivots, ray[c : 2 * c]
        row = _least(T, basis, rows, column)
    raise ContactNotConvergedError("too many pivots", pivots, np.inf)


def _least(T: Floats, basis: Ints, rows: Ints, column: Floats) -> int:
    """The row whose (q, B⁻¹)/column is lexicographically least; z₀ leaves as soon as it can."""
    c = len(basis)
    for j in (-1, *range(c)):
        ratio = T[rows, j] / column[rows]
        rows = rows[ratio <= ratio.min() + TIE * max(1.0, abs(ratio.min()))]
        artificial = rows[basis[rows] == 2 * c]
        if j == -1 and len(artificial):
            return int(artificial[0])
        if len(rows) == 1:
            break
    return int(rows[0])
