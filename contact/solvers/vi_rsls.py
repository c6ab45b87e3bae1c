"""PETSc's reduced-space Newton method on the dual."""

from __future__ import annotations

from contact.solvers.dual import semismooth
from contact.solvers.problem import ContactProblem, Floats, Solution


def solve(problem: ContactProblem, start: Floats | None = None, tolerance: float = 1e-12) -> Solution:
    """Find λ with 0 ≤ Wλ + q ⊥ λ ≥ 0 by SNES `vinewtonrsls`, options prefix `vi_rsls_`.

    The rows that the last iterate holds at zero are fixed and the others solved for: an active set without safeguard,
    sound on well-conditioned W.

    Raises
    ------
    ContactNotConvergedError
        The residual, recomputed, is above 1e-9.

    Source: Benson & Munson, Optim. Methods Softw. 21 (2006).
    """
    return semismooth("vinewtonrsls", "vi_rsls_", problem, start, tolerance)
