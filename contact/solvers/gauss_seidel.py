"""Projected Gauss–Seidel on W."""

from __future__ import annotations

import time

import numpy as np

from contact.solvers.certificate import length, scaled
from contact.solvers.columns import EPSILON, dense
from contact.solvers.problem import SOLVED, ContactNotConvergedError, ContactProblem, Floats, Solution

TIME_LIMIT = 60.0
STILL = 1000  # sweeps that change nothing but the last digits, after which more will not either


def solve(problem: ContactProblem, start: Floats | None = None, tolerance: float = 1e-12) -> Solution:
    """Find λ with 0 ≤ Wλ + q ⊥ λ ≥ 0 by λᵢ ← max(0, λᵢ − δᵢ/Wᵢᵢ), row after row.

    Forms all of W. Stops where max|min(Wᵢᵢ λᵢ, δᵢ)|/ℓ ≤ `tolerance`, or ≤ 1e-9 once sweeps change no more than the last
    digits of λ: masses in a ratio of 1e6 leave that. `iterations` counts sweeps.

    Raises
    ------
    ContactNotConvergedError
        After `TIME_LIMIT` seconds, or where λ stands still with a larger residual, with the λ reached.

    Source: Cryer, SIAM J. Control 9 (1971).
    """
    from contact.solvers import kernels

    W, q = dense(problem.W), np.ascontiguousarray(problem.q, float)
    lam = np.zeros_like(q) if start is None else np.maximum(start, 0.0)
    diagonal, sweeps, block = np.diagonal(W), 0, 1
    begun, still = time.perf_counter(), False
    while True:
        elastic = W @ lam
        delta = elastic + q
        residual = scaled(diagonal * lam, delta, length(q, elastic))
        if residual <= tolerance:
            return Solution(lam, np.empty(0), delta, sweeps)
        if time.perf_counter() - begun > TIME_LIMIT:
            raise ContactNotConvergedError("out of time", sweeps, residual, lam)
        if still:
            if residual <= SOLVED:
                return Solution(lam, np.empty(0), delta, sweeps)
            raise ContactNotConvergedError("sweeps change no more than the last digits", sweeps, residual, lam)
        before = lam.copy()
        kernels.gauss_seidel(W, q, lam, block)
        sweeps += block
        still = block >= STILL and bool(np.all(np.abs(lam - before) <= 4 * EPSILON * lam.max(initial=0.0)))
        # look at the residual often at first, later after some 10⁸ operations
        block = min(2 * block, 1 + 10**8 // len(q) ** 2)
