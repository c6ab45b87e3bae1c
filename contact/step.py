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
    tolerances, iterations = tolerances or Tolerances(), 0

    system.free_motion(t)
    free = system.state()
    contacts = system.detect()

    for number in range(1, max_passes + 1):
        system.restore(free)
        problem = system.problem(contacts)
        with system.clock("solve"):
            solution = solve(problem, method, contacts.on_rows(start))
        system.correct(contacts, solution)
        corrected = system.detect()

        lam, iterations = contacts.full(solution.lam), iterations + solution.iterations
        certificate = certify(system, contacts, lam, contacts.full(problem.q, np.inf), corrected)
        if certificate.within(tolerances):
            system.accept()
            gap = system.gaps()
            return StepResult(lam, gap, contacts, problem, certificate, number, iterations, solution.details)
        start, contacts = lam, corrected

    worst = max(certificate.complementarity, certificate.equilibrium)
    raise ContactNotConvergedError("the passes of detection and correction did not settle", iterations, worst)
