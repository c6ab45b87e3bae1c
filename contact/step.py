"""One step of the method: free motion, detection, status, correction, detection again."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from contact.certificate import Certificate, Tolerances, certify
from contact.linearisation import Linearisation
from contact.solvers import Method, solve
from contact.solvers.problem import ContactNotConvergedError, ContactProblem, InfeasibleError
from contact.system import System

Floats = NDArray[np.float64]

SURE = 0.1  # of a tolerance: a pass that would leave that much settles the step
CALM = 0.1  # a residual up to which a pass moves bodies little


@dataclass(frozen=True)
class StepResult:
    """What a step found: forces `lam` and true gaps `gap` on all constraints, and how it went.

    `problem` is the contact problem of its last pass, on the constraints `rows`.
    """

    lam: Floats
    gap: Floats
    linearisation: Linearisation
    problem: ContactProblem
    rows: NDArray[np.int64]
    certificate: Certificate
    passes: int
    iterations: int
    details: dict[str, float]


def step(
    system: System,
    t: float,
    dt: float = 1.0,
    method: str | Method = "status",
    start: Floats | None = None,
    tolerances: Tolerances | None = None,
    max_passes: int = 20,
) -> StepResult:
    """Advance the system by dt to time t with contact.

    Raises
    ------
    ContactNotConvergedError
        where the certificate is missed after `max_passes` passes, the contact method stops early, or a point would pass
        through a wall.
    InfeasibleError
        where no contact force balances the load, or a support holds a point inside a wall.
    """
    tolerances, iterations, residual = tolerances or Tolerances(), 0, 1.0
    lam = start

    system.begin(t, dt, start)
    system.free_motion(start)
    contacts = system.detect()

    for number in range(1, max_passes + 1):
        problem = system.problem(contacts, residual <= CALM)
        try:
            with system.clock("solve"):
                solution = solve(problem, method, contacts.on_rows(lam), system.precision)
        except InfeasibleError as error:
            if number == 1 or not system.linear:
                raise
            # Planes of a state on the way say nothing about the load: a smaller step may get there.
            raise ContactNotConvergedError(f"in pass {number} {error}", iterations, residual) from None
        lam = system.correct(contacts, solution)
        corrected = system.detect()

        iterations += solution.iterations
        certificate = certify(system, contacts, lam, problem.q, corrected)
        if certificate.within(tolerances):
            if wall := system.crossed():
                raise ContactNotConvergedError(f"a point of {wall!r} passes through a wall", iterations, np.inf)
            gap = system.gaps()
            system.accept()
            return StepResult(
                lam, gap, corrected, problem, contacts.rows, certificate, number, iterations, solution.details
            )
        deep = certificate.penetration > tolerances.penetration
        if deep and (wall := system.driven_into(corrected, tolerances.penetration)):
            raise InfeasibleError(f"a support puts a point of {wall!r} into the wall at t = {t:.6g}", proven=True)
        # A pass with the same A contracts about as well as the last one.
        settling = certificate.residual**2 <= SURE * min(tolerances.complementarity, tolerances.equilibrium) * residual
        progress, residual = certificate.residual / residual, certificate.residual
        contacts = system.relinearise(contacts, corrected, lam, settling, progress)

    missed = certificate.beyond(tolerances)
    raise ContactNotConvergedError(f"the passes of detection and correction leave {missed}", iterations, residual)
