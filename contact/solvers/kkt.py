"""The saddle-point system of displacements and contact forces, solved directly."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from contact.solvers.certificate import length, scaled
from contact.solvers.columns import FormedColumns, extend
from contact.solvers.floating import Modes
from contact.solvers.problem import SOLVED, ContactNotConvergedError, ContactProblem, Floats, Ints, Primal, Solution
from fem import petsc  # noqa: F401  arranges the order in which MPI and PETSc are imported

from petsc4py import PETSc  # isort: skip


def solve(problem: ContactProblem, start: Floats | None = None, tolerance: float = 1e-12) -> Solution:
    """Solve the saddle-point system on the contacts that the status method finds, without W.

    On a maximal independent subset a of the active rows (pivoted Cholesky of W on them)

        [A    0    −H_aᵀ] [x  ]   [ 0  ]
        [0    0     Q_aᵀ] [β  ] = [−ρ  ]
        [H_a  Q_a    0  ] [λ_a]   [−q_a]

    with A of all bodies and the rigid modes Q, ρ of `floating.Modes`; one LU by MUMPS, options prefix `kkt_`, one refinement.
    δ = H x + G α + q comes from x. For the paper's claim that both formulations agree; `details["difference"]` is the
    largest |λ − λ_status| over max λ. Collective on the communicator of `problem.primal`.

    Raises
    ------
    ValueError
        The problem has no primal side.
    InfeasibleError, ContactNotConvergedError
        From the status method; the latter also where δ or λ on the other side of the system misses 1e-9.
    """
    from contact.solvers import METHODS

    if problem.primal is None:
        raise ValueError("method = 'kkt': allowed only where the matrices behind W are given (problem.primal)")
    found = METHODS["status"](problem, start, tolerance)
    if not len(found.lam):
        return found
    columns, modes = FormedColumns(problem.W), Modes(problem) if problem.G is not None else None
    active = np.flatnonzero(found.lam)
    columns.form(active)
    Q, load = (modes.Q, modes.load) if modes is not None else (np.empty((len(problem.q), 0)), np.empty(0))
    stiffness = 100.0 * columns.diagonal(active).max(initial=0.0) * len(problem.q) or 1.0
    block = columns.block(active, active) + stiffness * Q[active] @ Q[active].T
    rows = np.sort(active[extend(np.empty((0, 0)), block, columns.pivot)[1]])
    # motions that the active contacts leave free keep the amplitude that `status` gave them
    U, S, Vt = np.linalg.svd(Q[rows], full_matrices=False)
    held = S > 1e-10
    lam, delta = np.zeros_like(found.lam), np.asarray(problem.q, float)
    motion = Q @ (modes.coordinates(found.alpha) if modes is not None else np.empty(0))
    system = _Saddle(problem.primal, rows, U[:, held], S[held])
    try:
        lam[rows], elastic, beta = system.solve(-(problem.q + motion)[rows], -Vt[held] @ load / S[held])
    finally:
        system.destroy()
    change = Vt[held].T @ (beta / S[held])
    rigid = motion + Q @ change
    delta = problem.q + elastic + rigid
    alpha = found.alpha if modes is None else found.alpha + modes.amplitudes(change)
    residual = scaled(np.where(lam != 0, np.sign(lam) * np.inf, 0.0), delta, length(problem.q, elastic, rigid))
    if not residual <= SOLVED:
        raise ContactNotConvergedError("the saddle-point system contradicts the status method", 1, residual, lam)
    difference = float(np.abs(lam - found.lam).max() / found.lam.max(initial=0.0)) if len(rows) else 0.0
    return Solution(lam, alpha, delta, found.iterations, {"difference": difference, "rows": float(len(rows))})
