"""PETSc's semismooth Newton method on the dual."""

from __future__ import annotations

from contact.solvers.dual import semismooth
from contact.solvers.problem import ContactProblem, Floats, Solution


def solve(problem: ContactProblem, start: Floats | None = None, tolerance: float = 1e-12) -> Solution:
    """Find λ with 0 ≤ Wλ + q ⊥ λ ≥ 0 by SNES `vinewtonssls`, options prefix `vi_ssls_`.

    Newton with a line search on Fischer–Burmeister's reformulation.

    Raises
    ------
    ContactNotConvergedError
        The residual, recomputed, is above 1e-9.

    Source: Munson, Facchinei, Ferris, Fischer & Kanzow, INFORMS J. Comput. 13 (2001).
    """
    return semismooth("vinewtonssls", "vi_ssls_", problem, start, tolerance)
