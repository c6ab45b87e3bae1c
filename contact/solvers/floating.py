"""Bodies that only contact holds: their rigid modes as unknowns, for every method on W."""

from __future__ import annotations

import numpy as np
from scipy.linalg import cho_solve
from scipy.optimize import nnls

from contact.solvers import status
from contact.solvers.certificate import length
from contact.solvers.columns import EPSILON, TINY, FormedColumns, extend
from contact.solvers.problem import (
    SOLVED,
    ContactNotConvergedError,
    ContactProblem,
    Floats,
    InfeasibleError,
    Ints,
    Method,
    Solution,
)

# s grows by GROWTH from W's size to SOFTEST times that; for rigid bodies it is RIGID times what moves them far enough.
GROWTH, SOFTEST, RIGID = 4.0, 1e6, 1000.0
OUTER = 50
BALANCED = 1e-10


def solve(method: Method, problem: ContactProblem, start: Floats | None, tolerance: float) -> Solution:
    """Find λ, α with 0 ≤ δ = W λ + G α + q ⊥ λ ≥ 0 and Gᵀλ + r = 0 by `method`, which treats W and q only.

    Augmented Lagrangian on the modes in an orthonormal basis (`Modes`): each outer iteration solves with W + s QQᵀ and
    q + Qβ + s Qρ, then adds s (Qᵀλ + ρ) to β. As soon as λ has the right support, the saddle system [W Q; Qᵀ 0] on it
    gives λ and β exactly, and the iteration ends when that is verified. The bodies are first moved by `status` as if
    they were rigid, until they touch: so s need only suit the elastic motion, which may be smaller by any factor. s is
    the compliance of springs that hold the bodies where they are; it begins at W's size, so that contact spreads from
    where they touch, and grows, so that bodies that slide arrive.

    Besides the columns that `method` asks for, those of a few rows that could carry the load are formed, for s.

    Raises
    ------
    InfeasibleError
        No λ ≥ 0 balances the load to a relative 1e-10, or no position satisfies the constraints.
    ContactNotConvergedError
        `method` failed, or the residual of gap or balance stays above 1e-9.

    Source: Rockafellar, SIAM J. Control Optim. 14 (1976), for the finite convergence.
    """
    modes = Modes(problem)
    if not problem.W.size:
        return Solution(np.empty(0), modes.amplitudes(np.zeros(modes.size)), np.empty(0), 0)
    columns = FormedColumns(problem.W)
    compliance = _compliance(columns, modes.bearing, problem.q)
    load, free = float(np.linalg.norm(modes.load)), float(np.abs(problem.q).max())
    rigid = RIGID * np.sqrt(columns.size) * free / load if free and load else 1.0
    run = _Augmented(problem, modes, tolerance)
    beta = np.zeros(modes.size)
    if compliance and free and load:
        try:
            _, beta, _ = run.solve(status.solve, None, (rigid, SOFTEST * rigid), beta, None)
        except (InfeasibleError, ContactNotConvergedError):
            # what does not fit as a rigid body may fit as an elastic one
            beta = np.zeros(modes.size)
    elastic = compliance * columns.size
    # a motion that is rounding of the gaps is no length to measure by; where all gaps are zero and nothing deforms
    # there is none but that of the augmentation
    run.least = 1e-12 * free if free or compliance else rigid * load
    softness = (elastic, SOFTEST * elastic) if compliance else (rigid, SOFTEST * rigid)
    lam, beta, iterations = run.solve(method, columns, softness, beta, start)
    return Solution(lam, modes.amplitudes(beta), run.gap(columns, lam, beta), iterations)


def _compliance(columns: FormedColumns, rows: Ints, q: Floats) -> float:
    """The largest Wᵢᵢ of `rows` or, where they lie on rigid bodies, of further ones with the least gaps [m/N]."""
    order = np.concatenate([rows, np.setdiff1d(np.argsort(q), rows, assume_unique=True)])
    while True:
        columns.form(order[: len(rows)])
        largest = float(columns.diagonal(order[: len(rows)]).max())
        if largest > 0 or len(rows) >= len(q):
            return largest
        rows = order[: 4 * len(rows)]


class Modes:
    """range(G) in an orthonormal basis: G α = Q β, and Gᵀλ + r = 0 becomes Qᵀλ + ρ = 0.

    `Q` (c, k) [-], `load` ρ (k) [N], `bearing` at most k rows whose forces balance the load. G's columns are scaled
    first, so that translations and rotations compare. Modes that no contact sees get no amplitude.

    Raises
    ------
    InfeasibleError
        No λ ≥ 0 balances r.
    """

    def __init__(self, problem: ContactProblem) -> None:
        G, r = np.asarray(problem.G, float), np.asarray(problem.r, float)
        norms = np.linalg.norm(G, axis=0)
        self.scale = np.where(norms > 0, norms, 1.0)
        U, S, Vt = np.linalg.svd(G / self.scale, full_matrices=False)
        U[np.abs(U) < 4 * EPSILON] = 0.0  # a contact that does not see a mode must not see its rounding
        seen = S / S.max(initial=TINY) > 1e-12
        self.Q, self.S, self.Vt = U[:, seen], S[seen], Vt[seen]
        self.size = len(self.S)
        scaled_load = r / self.scale
        unseen = scaled_load - self.Vt.T @ (self.Vt @ scaled_load)
        if np.abs(unseen).max(initial=0.0) > BALANCED * np.abs(scaled_load).max(initial=0.0):
            raise InfeasibleError("a body is loaded along a motion that no contact resists")
        self.load: Floats = self.Vt @ scaled_load / self.S
        self.bearing: Ints = np.array([np.argmin(problem.q)]) if len(problem.q) else np.empty(0, np.int64)
        size = float(np.abs(self.load).max(initial=0.0))
        if size > 0:
            forces, left = nnls(self.Q.T, -self.load / size)
            if left > BALANCED:
                raise InfeasibleError(f"no contact forces balance the load: {left:.2g} of it is left")
            self.bearing = np.flatnonzero(forces)

    def amplitudes(self, beta: Floats) -> Floats:
        """α from β."""
        return np.asarray(self.Vt.T @ (beta / self.S) / self.scale)

    def coordinates(self, alpha: Floats) -> Floats:
        """β from α."""
        return np.asarray(self.S * (self.Vt @ (self.scale * alpha)))


class _Augmented:
    """The outer iteration."""

    def __init__(self, problem: ContactProblem, modes: Modes, tolerance: float) -> None:
        self.q, self.Q, self.load, self.tolerance = np.asarray(problem.q, float), modes.Q, modes.load, tolerance
        self.least = 0.0

    def solve(
        self,
        method: Method,
        W: FormedColumns | None,
        softness: tuple[float, float],
        beta: Floats,
        lam: Floats | None,
    ) -> tuple[Floats, Floats, int]:
        """λ, β and the iterations of `method` in all, with the first and last s; W is None if rigid."""
        s, iterations, best = softness[0], 0, (np.inf, self.q, beta)
        for _ in range(OUTER):
            operator = _Operator(W, self.Q, s)
            q = self.q + self.Q @ (beta + s * self.load)
            solution = method(ContactProblem(operator, q), lam, self.tolerance)
            iterations += solution.iterations
            lam = solution.lam
            beta = beta + s * (self.Q.T @ lam + self.load)
            exact = self.saddle(operator, lam, beta, solution.gap)
            best = min(best, (self.residual(operator, *exact), *exact), key=lambda candidate: candidate[0])
            if best[0] <= self.tolerance:
                break
            s = min(GROWTH * s, softness[1])
        if not best[0] <= SOLVED:
            raise ContactNotConvergedError("the rigid motion does not settle", iterations, best[0], best[1])
        return best[1], best[2], iterations

    def gap(self, W: FormedColumns | None, lam: Floats, beta: Floats) -> Floats:
        """δ = W λ + Q β + q."""
        motion = self.Q @ beta
        return np.asarray(self.q + (motion if W is None else motion + W.product(lam)))

    def residual(self, operator: _Operator, lam: Floats, beta: Floats) -> float:
        """The larger of the residuals of complementarity and of balance, both relative."""
        gap = self.gap(operator.W, lam, beta)
        balance = np.abs(self.Q.T @ lam + self.load).max(initial=0.0)
        forces = float((np.abs(self.Q).T @ lam + np.abs(self.load)).max(initial=0.0))
        # a contact that carries must be closed, however stiff its bodies
        error = np.where(lam > 0, np.abs(gap), np.maximum(-gap, 0.0)).max()
        rigid = self.Q @ beta
        ell = max(length(self.q, rigid, gap - self.q - rigid), self.least)
        if not self.load.any():
            # nothing to compare λ with: a force is as small as the motion that it would cause
            forces = max(forces, ell / operator.softness)
        return max(float(error) / ell, float(balance / forces) if balance else 0.0)

    def saddle(self, operator: _Operator, lam: Floats, beta: Floats, gap: Floats) -> tuple[Floats, Floats]:
        """Solve [W Q; Qᵀ 0] (λ, β) = −(q, ρ) on the closed rows, refining λ and β.

        Eliminates with the factor of W + s QQᵀ on a maximal independent subset; other closed rows keep their λ.
        """
        diagonal = operator.diagonal(np.flatnonzero(lam))
        pull = np.zeros_like(lam)
        pull[np.flatnonzero(lam)] = diagonal * lam[np.flatnonzero(lam)]
        rows = np.flatnonzero(pull > np.maximum(gap, 0.0))
        L, kept = extend(np.empty((0, 0)), operator.columns(rows)[rows], operator.pivot)
        lam, rows = np.where(pull > np.maximum(gap, 0.0), lam, 0.0), rows[kept]
        Q, factor = self.Q[rows], (L, True)
        Y = cho_solve(factor, Q)
        # the eigenvalues of s QᵀY are at most 1, and 0 for motions that these rows do not resist
        w, V = np.linalg.eigh(operator.softness * Q.T @ Y)
        resisted = w > 1e-12
        inverse = operator.softness * (V[:, resisted] / w[resisted]) @ V[:, resisted].T
        for _ in range(3):
            unbalanced = self.Q.T @ lam + self.load
            z = cho_solve(factor, -self.gap(operator.W, lam, beta)[rows] - operator.softness * Q @ unbalanced)
            step = inverse @ (Q.T @ z + unbalanced)
            lam[rows] += z - Y @ step
            beta = beta + step
        beta[np.abs(beta) < 1e-12 * self.least] = 0.0
        return np.maximum(lam, 0.0), beta


class _Operator:
    """W + s QQᵀ by its columns; those of W are asked for once."""

    def __init__(self, W: FormedColumns | None, Q: Floats, softness: float) -> None:
        self.W, self.Q, self.softness, self.size = W, Q, softness, len(Q)
        self.pivot = W.pivot if W is not None else 1e-13

    def columns(self, rows: Ints) -> Floats:
        """(W + s QQᵀ)[:, rows]."""
        rigid = self.softness * self.Q @ self.Q[rows].T
        if self.W is None:
            return np.asarray(rigid)
        self.W.form(rows)
        return np.asarray(rigid + self.W.values[self.W.slot[rows]].T)

    def diagonal(self, rows: Ints) -> Floats:
        """Its diagonal entries on `rows`."""
        rigid = self.softness * (self.Q[rows] ** 2).sum(axis=1)
        return np.asarray(rigid if self.W is None else rigid + self.W.diagonal(rows))
