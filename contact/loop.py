"""The time loop: steps to the end of the scene, halved where they do not settle, each handed to a sink."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from contact.certificate import Tolerances, certify
from contact.scene.schema import Scene
from contact.solvers import METHODS, ContactNotConvergedError, InfeasibleError, Method
from contact.step import StepResult, step
from contact.system import System

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class AcceptedStep:
    """One step of the scene: its number and time, how it was divided, what it found and the seconds it took."""

    number: int
    time: float
    dt: float
    substeps: int
    result: StepResult
    converged: bool
    seconds: dict[str, float]


Sink = Callable[[AcceptedStep], None]


def tolerances(scene: Scene) -> Tolerances:
    """The tolerances that a scene asks for."""
    s = scene.solver
    return Tolerances(s.complementarity, s.equilibrium, s.surface_error, s.penetration)


def method(scene: Scene) -> Method:
    """The contact method that a scene asks for."""
    found = METHODS[scene.solver.method]
    if not scene.solver.minimum_norm:
        return found
    from contact.solvers.minimum_norm import minimum_norm

    return minimum_norm(found)


def march(system: System, scene: Scene, sink: Sink, first: int = 0, start: Floats | None = None) -> None:
    """Run the steps from number `first` on; `start` are the contact forces to start from. Collective.

    Raises
    ------
    ContactNotConvergedError, InfeasibleError
        after the sink got the state reached, marked as not converged.
    """
    solver, limits, solve = scene.solver, tolerances(scene), method(scene)
    advance = system.advance or step
    size = scene.time.end / scene.time.steps
    for number in range(first, scene.time.steps):
        now, target = number * size, (number + 1) * size
        dt, substeps, passes, iterations = size, 0, 0, 0
        while now < target:
            before = system.state()
            whole, last = substeps == 0 and dt == size, now + 1.0000001 * dt >= target
            t = target if last else now + dt
            span = target - now if last and not whole else dt  # free of round-off where a step is not divided
            try:
                with system.clock("assemble"):
                    result = advance(system, t, span, solve, start, limits, solver.max_passes)
            except (ContactNotConvergedError, InfeasibleError, ArithmeticError) as error:
                infeasible = isinstance(error, InfeasibleError) and (system.linear or error.proven)
                hopeless = infeasible or dt <= size / 2**solver.max_halvings
                if hopeless:
                    sink(_unfinished(system, number, t, dt, substeps))
                    if isinstance(error, ArithmeticError):
                        raise ContactNotConvergedError(str(error), 0, np.inf) from None
                    if isinstance(error, InfeasibleError) and not infeasible:
                        # it is so of the tangent planes of one pass, which proves nothing of the walls
                        raise ContactNotConvergedError(f"in the last pass {error}", 0, np.inf) from None
                    raise
                system.restore(before)
                dt /= 2
                continue
            now, substeps, start = t, substeps + 1, result.lam
            passes, iterations = passes + result.passes, iterations + result.iterations
            dt = min(2 * dt, size)
        total = result if substeps == 1 else replace(result, passes=passes, iterations=iterations)
        sink(AcceptedStep(number, target, size, substeps, total, True, system.clock.lap()))


def _unfinished(system: System, number: int, t: float, dt: float, substeps: int) -> AcceptedStep:
    """The present state without contact forces, marked as not converged."""
    contacts = system.detect()
    lam = np.zeros(len(contacts.offset))
    gap = system.gaps()
    certificate = certify(system, contacts, lam, gap[contacts.rows])
    result = StepResult(lam, gap, contacts, system.problem(contacts), contacts.rows, certificate, 0, 0, {})
    return AcceptedStep(number, t, dt, substeps, result, False, system.clock.lap())
