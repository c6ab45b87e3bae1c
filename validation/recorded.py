"""Contact problems recorded from the steps of a scene, and what each contact method makes of them."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from time import perf_counter
from typing import Any

import numpy as np
import scipy.sparse as sp
from mpi4py import MPI
from petsc4py import PETSc

from contact import step as _step
from contact.loop import AcceptedStep, march
from contact.scene.build import build
from contact.scene.schema import Scene
from contact.solvers import (
    METHODS,
    ContactNotConvergedError,
    ContactProblem,
    DenseDelassus,
    InfeasibleError,
    Solution,
    residual,
)
from contact.solvers.problem import Floats
from contact.system import System

# whose `solve` is looked at
STEP: Any = _step
REPEATS = 7  # at most, of one solve


class Solves:
    """In the place of `contact.step.solve` for a ``with``: the same, with somebody who watches."""

    def __init__(self, watch: Callable[[ContactProblem, Floats | None], None]) -> None:
        self._solve, self._watch = STEP.solve, watch

    def __call__(self, problem: ContactProblem, method: str, start: Floats | None, *rest: float) -> Solution:
        """`contact.solvers.solve`."""
        self._watch(problem, start)
        solution: Solution = self._solve(problem, method, start, *rest)
        return solution

    def __enter__(self) -> Solves:
        STEP.solve = self
        return self

    def __exit__(self, *_: object) -> None:
        STEP.solve = self._solve


class _OutOfTimeError(Exception):
    """The run has taken as long as it may."""


def run(
    scene: Scene,
    folder: Path,
    steps: int | None,
    sink: Callable[[System, AcceptedStep], None],
    limit: float = math.inf,
    now: Callable[[], float] = perf_counter,
) -> tuple[System, str]:
    """March through a scene, or its first steps, or for `limit` [s]; the system, and why it ended early, or "".

    What the sink does counts as output, not as step. The first step, which may compile kernels, is beside the limit.
    """
    if steps is not None and steps < scene.time.steps:
        end = scene.time.end * steps / scene.time.steps
        scene = scene.model_copy(update={"time": scene.time.model_copy(update={"end": end, "steps": steps})})
    begun = math.nan
    system = build(scene, MPI.COMM_SELF, folder)
    system.prepare()

    def timed(accepted: AcceptedStep) -> None:
        nonlocal begun
        with system.clock("output"):
            sink(system, accepted)
        if math.isnan(begun):
            begun = now()
        if now() - begun > limit:
            raise _OutOfTimeError

    try:
        march(system, scene, timed)
    except _OutOfTimeError:
        return system, f"after {limit:g} s"
    except (ContactNotConvergedError, InfeasibleError) as error:
        return system, str(error)
    return system, ""


@dataclass(frozen=True)
class Matrices:
    """`contact.solvers.Primal` of a recorded problem."""

    A: list[Any]
    H: list[Any]

    def destroy(self) -> None:
        """Destroy the PETSc objects."""
        for part in (*self.A, *self.H):
            part.destroy()


def record(
    scene: Scene,
    folder: Path,
    files: Path,
    steps: int | None = None,
    problems: int = 20,
    limit: float = math.inf,
    now: Callable[[], float] = perf_counter,
) -> str:
    """Keep the contact problem of the first pass of some steps, spread evenly over the run, as step_NUMBER.npz.

    The scene has one beam, `limit` is in [s]. Returns why the run ended early, or "".
    """
    plain = scene.solver.model_copy(update={"compiled": False})  # whose problems can be watched
    scene = scene.model_copy(update={"solver": plain})
    count = min(scene.time.steps, steps or scene.time.steps)
    wanted = set((np.arange(1, problems + 1) * count // problems - 1).tolist())
    number = 0

    def watch(problem: ContactProblem, start: Floats | None) -> None:
        if number in wanted and problem.W.size:
            wanted.remove(number)
            ((body, H),) = problem.W.H.items()  # type: ignore[attr-defined]
            A = body.A.convert("aij", PETSc.Mat())
            indptr, indices, data = A.getValuesCSR()
            A.destroy()
            W = problem.W.columns(np.arange(problem.W.size))
            np.savez(
                files / f"step_{number:05d}.npz",
                W=W,
                q=problem.q,
                start=np.zeros(len(W)) if start is None else start,
                H=H.sparse().toarray(),
                indptr=indptr,
                indices=indices,
                data=data,
            )

    def sink(system: System, accepted: AcceptedStep) -> None:
        nonlocal number
        number = accepted.number + 1

    with Solves(watch):
        system, ended = run(scene, folder, steps, sink, limit, now)
    system.close()
    return ended


def recorded(file: Path) -> tuple[ContactProblem, Floats]:
    """A problem, whose `primal` the caller destroys, and the forces that the step started from."""
    with np.load(file) as stored:
        n = len(stored["indptr"]) - 1
        A = PETSc.Mat().createAIJ(
            (n, n), csr=(stored["indptr"], stored["indices"], stored["data"]), comm=PETSc.COMM_SELF
        )
        rows = sp.csr_array(stored["H"])
        csr = rows.indptr.astype(PETSc.IntType), rows.indices.astype(PETSc.IntType), rows.data
        H = PETSc.Mat().createAIJ(rows.shape, csr=csr, comm=PETSc.COMM_SELF)
        return ContactProblem(DenseDelassus(stored["W"]), stored["q"], primal=Matrices([A], [H])), stored["start"]


@dataclass
class Answer:
    """What a method made of one problem: forces, its times [s], its own count, the residual recomputed from λ.

    `failure` is why it gave up, or "". Where a library's solver calls a solution what is none, `claimed` is set too.
    """

    lam: Floats | None
    times: list[float]
    iterations: int
    residual: float
    failure: str = ""
    claimed: bool = False
    error: float = math.nan

    @property
    def seconds(self) -> float:
        """The median time [s]."""
        return float(np.median(self.times))


def answer(
    problem: ContactProblem,
    method: str,
    start: Floats,
    tolerance: float,
    budget: float = 0.5,
    now: Callable[[], float] = perf_counter,
) -> Answer:
    """Solve, more than once while that takes less than `budget` seconds; from `start` by the `method` ``NAME, warm``.

    What else stands behind a comma is for the reader.

    A solve that ends with an error, of a method that cannot treat the problem too, is a failure.
    """
    name, _, kind = method.partition(", ")
    times: list[float] = []
    failure, iterations, claimed = "", 0, False
    lam: Floats | None = None
    while not times or (sum(times) < budget and len(times) < REPEATS):
        begun = now()
        try:
            found = METHODS[name](problem, start if kind == "warm" else None, tolerance)
            lam, iterations = found.lam, found.iterations
        except ContactNotConvergedError as error:
            lam, iterations, failure, claimed = error.lam, error.iterations, error.reason, error.claimed
        except (InfeasibleError, ArithmeticError, ValueError, PETSc.Error) as error:
            failure = str(error).splitlines()[0]
        times.append(now() - begun)
        if failure:
            break
    reached = math.inf if lam is None else residual(problem, Solution(lam, np.empty(0), np.empty(0), 0))
    return Answer(lam, times, iterations, reached, failure, claimed)
