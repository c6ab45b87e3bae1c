"""One step of the method: free motion, detection, status, correction, detection again."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from contact.certificate import Certificate, Tolerances, certify
from contact.solvers import solve
from contact.solvers.problem import ContactNotConvergedError, ContactProblem
from contact.system import Linearisation, System

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class StepResult:
    """What a step found: forces `lam` and true gaps `gap` on all constraints, and how it went.

    `problem` is the contact problem of its last pass.
    """

    lam: Floats
    gap: Floats
    linearisation: Linearisation
    problem: ContactProblem
    certificate: Certificate
    passes: int
    iterations: int
    details: dict[str, float]


def step(
    system: System,
    t: float,
    method: str = "status",
    start: Floats | None = None,
    tolerances: Tolerances | None = None,
    max_passes: int = 20,
) -> StepResult:
    """Advance the system to time t with contact.

    Raises
    ------
    ContactNotConvergedError
        where the certificate is missed after `max_passes` passes, or the contact method stops early.
    InfeasibleError
        where no contact force balances the load.
    """
    tolerances = tolerances or Tolerances()
    iterations = 0

    system.free_motion(t)
    free = system.state()

    present = system.detect()
    for number in range(1, max_passes + 1):
        contacts = present
        system.restore(free)
        problem = system.problem(contacts)
        with system.clock("solve"):
            warm = None if start is None or len(start) != len(contacts.offset) else start[contacts.rows]
            solution = solve(problem, method, warm)
        system.correct(contacts, solution)

        lam, iterations = contacts.full(solution.lam), iterations + solution.iterations
        free_gaps = np.full(len(contacts.offset), np.inf)
        free_gaps[contacts.rows] = problem.q
        present = system.detect()
        certificate = certify(system, contacts, lam, free_gaps, present)
        if certificate.within(tolerances):
            gap = np.concatenate([np.empty(0), *[pair.gaps() for pair in system.pairs]])
            system.accept()
            return StepResult(lam, gap, contacts, problem, certificate, number, iterations, solution.details)
        start = lam

    worst = max(certificate.complementarity, certificate.equilibrium)
    raise ContactNotConvergedError("the passes of detection and correction did not settle", iterations, worst)
