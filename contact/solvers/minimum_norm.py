"""Of all contact forces that solve a contact problem, those of least norm."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from scipy.linalg import cho_solve

from contact.solvers import status
from contact.solvers.certificate import length
from contact.solvers.columns import EPSILON, FormedColumns, independent
from contact.solvers.floating import BALANCED, Modes
from contact.solvers.problem import (
    SOLVED,
    ContactNotConvergedError,
    ContactProblem,
    DenseDelassus,
    Floats,
    InfeasibleError,
    Method,
    Solution,
)

SMALL = 1e-12  # a force below this part of √Σλ² is rounding


def minimum_norm(method: Method) -> Method:
    """`method`, and from the solution that it finds on to the one of least norm."""

    def solve(problem: ContactProblem, start: Floats | None = None, tolerance: float = 1e-12) -> Solution:
        return least(problem, method(problem, start, tolerance))

    return solve


def least(problem: ContactProblem, found: Solution) -> Solution:
    """Of all λ that solve `problem` the one with the least √Σλᵢ² [N], from one of them, λ*.

    W is semidefinite, so that all have the same W λ and Gᵀλ, and none has a force where δ > 0. With an orthonormal
    basis N of the forces on closed rows, δ ≤ 1e-9 ℓ, that do nothing, W N = 0 and Gᵀ N = 0, they are

        λ = λ₀ + N z ≥ 0,    λ₀ = (I − N Nᵀ) λ*,

    and the least z is sought. It is 0 if λ₀ ≥ 0, and else Nᵀμ with 0 ≤ N Nᵀ μ + λ₀ ⊥ μ ≥ 0: a contact problem again.
    Forms the columns of W of closed rows.

    Every row counts alike, by its force: mortar rows too, which are divided by their weights. So copies of a row share
    its force in equal parts, and a contact stated on two meshes is shared out by forces, not by pressures.

    Raises
    ------
    ContactNotConvergedError
        The status method finds no μ, or the forces found would change a gap by more than 1e-9 ℓ or the balance by more
        than 1e-9: δ, and with it the certificate of the solution, stays what it is.
    """
    columns, carrying = FormedColumns(problem.W), np.flatnonzero(found.lam)
    if not len(carrying):
        return found
    columns.form(carrying)
    Q = np.empty((len(found.lam), 0)) if problem.G is None else Modes(problem).Q
    rounding = columns.accuracy * float(columns.peak(carrying) @ found.lam[carrying])
    closing = max(SOLVED * length(problem.q, found.gap - problem.q), rounding)
    closed = np.flatnonzero(found.gap <= closing)
    columns.form(closed)
    N = _idle(columns.block(closed, closed), columns.pivot, Q[closed])
    if not N.size:
        return found
    size = float(np.linalg.norm(found.lam))
    forces = found.lam[closed] / size
    forces = forces - N @ (N.T @ forces)
    if forces.min() < -SMALL:
        try:
            mu = status.solve(ContactProblem(DenseDelassus(N @ N.T), forces)).lam
        except InfeasibleError:  # but λ* is there: rounding
            raise ContactNotConvergedError("the least forces are not found", found.iterations, np.inf) from None
        forces = np.where(mu > 0, 0.0, forces + N @ (N.T @ mu))
    lam = found.lam.copy()  # a method that stops inside λ > 0 leaves rounding on open rows
    lam[closed] = size * np.where((forces > SMALL) | ~N.any(axis=1), forces, 0.0)

    motion, unbalanced = columns.product(lam - found.lam), Q.T @ (lam - found.lam) / size
    wrong = SOLVED * float(np.abs(motion).max()) / closing, float(np.abs(unbalanced).max(initial=0.0))
    if not max(wrong) <= SOLVED:
        raise ContactNotConvergedError("the least forces move a body", found.iterations, max(wrong), found.lam)
    return replace(found, lam=lam, gap=found.gap + motion)


def _idle(W: Floats, pivot: float, Q: Floats) -> Floats:
    """An orthonormal basis of the forces with W N = 0 and QᵀN = 0, (n, k).

    Of the dependent rows d each is a combination of the independent ones i, N = [−W_ii⁻¹ W_id; I], with the `pivot` by
    which the methods decide what is dependent. Of these forces the ones count that change the balance by less than the
    part of it, 1e-10, up to which a load is balanced.
    """
    # Pivots in a given order may be rounding above `pivot` where those before them are small.
    L, kept = independent(W, np.sqrt(np.abs(np.diagonal(W))), pivot)
    dependent = np.setdiff1d(np.arange(len(W)), kept)
    N = np.zeros((len(W), len(dependent)))
    N[dependent, np.arange(len(dependent))] = 1.0
    if len(kept) and len(dependent):
        combination = cho_solve((L, True), W[np.ix_(kept, dependent)])
        # a row that has no part in a combination must not see its rounding
        N[kept] = -np.where(np.abs(combination) < 4 * EPSILON, 0.0, combination)
    N = np.linalg.qr(N)[0]
    if Q.size and N.size:
        _, S, Vt = np.linalg.svd(Q.T @ N)
        N = N @ Vt[np.count_nonzero(S > BALANCED) :].T
    return N
