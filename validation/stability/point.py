"""A sweep of the stability campaign: points with known answers, and the verdict on each.

A point is right where its answer agrees with one found by a formula or an independent solver, with a certificate; or,
where none exists, where the program says so. It is refused where the program says that it has no answer, and wrong
where what the program claims is not so: a number outside its tolerance, a certificate that is missed, "infeasible" of
what can be satisfied, an answer to what cannot, or an error that is none of the program's own.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import asdict, dataclass, field
from enum import StrEnum
from typing import Any

import numpy as np
from mpi4py import MPI
from numpy.typing import NDArray

import validation.cases  # noqa: F401  enters the cases into the catalogue
from contact.solvers import ContactNotConvergedError, ContactProblem, DenseDelassus, InfeasibleError, Solution, solve
from contact.step import StepResult
from validation.case import CASES, Case, Parameter, Quantity, Run
from validation.stability.judge import complementarity

Floats = NDArray[np.float64]

LIMITS = {"complementarity": 1e-8, "equilibrium": 1e-8, "surface_error": 1e-3, "penetration": 1e-3}
DENSE = 200  # rows up to which the condition of W is taken


class Verdict(StrEnum):
    """What a point shows."""

    RIGHT = "right"
    REFUSED = "refused"
    WRONG = "wrong"


@dataclass(frozen=True)
class Answer:
    """What the program found at a point, beside what is right.

    certificate : its residuals, as the program recomputes them, or of a bare contact problem that of `judge`
    condition : of W, as `condition_of` takes it
    """

    quantities: list[Quantity]
    certificate: dict[str, float]
    iterations: int
    contacts: int
    condition: float = 0.0


@dataclass(frozen=True)
class Sweep:
    """Points over one parameter.

    swept : the parameter with its unit
    solve : from its value to the answer
    feasible : whether an answer exists
    row : the row of the catalogue's extreme set that this is; there a refusal will not do
    """

    name: str
    swept: str
    values: tuple[float, ...]
    solve: Callable[[float], Answer]
    feasible: Callable[[float], bool]
    row: str = ""

    @property
    def summary(self) -> str:
        """The first line of the sweep's docstring."""
        return (self.solve.__doc__ or "").strip().split("\n")[0]


SWEEPS: dict[str, Sweep] = {}


def sweep(
    name: str,
    swept: str,
    values: tuple[float, ...],
    feasible: Callable[[float], bool] = lambda value: True,
    row: str = "",
) -> Callable[[Callable[[float], Answer]], Callable[[float], Answer]]:
    """Enter a function into the campaign as the sweep `name`."""

    def register(solve: Callable[[float], Answer]) -> Callable[[float], Answer]:
        SWEEPS[name] = Sweep(name, swept, values, solve, feasible, row)
        return solve

    return register


@dataclass(frozen=True)
class Point:
    """One point of a sweep and its verdict, as the campaign's JSON has it.

    error : the largest of the quantities' errors over their tolerances; None without an answer
    reason : of a refusal or of an infeasible point what the program says, of a wrong point what is wrong
    """

    sweep: str
    value: float
    feasible: bool
    verdict: str
    reason: str
    error: float | None
    quantities: dict[str, dict[str, Any]] = field(default_factory=dict)
    certificate: dict[str, float] = field(default_factory=dict)
    iterations: int = 0
    contacts: int = 0
    condition: float = 0.0
    seconds: float = 0.0


def try_point(sweep: Sweep, value: float) -> Point:
    """Solve a point and judge it; never raises."""
    feasible, begun = sweep.feasible(value), time.process_time()
    answer: Answer | None = None
    try:
        answer = sweep.solve(value)
        verdict, reason = _judged(answer, feasible)
    except Exception as error:
        verdict, reason = verdict_on(error, feasible)
    seconds = time.process_time() - begun
    point = Point(sweep.name, value, feasible, verdict.value, " ".join(reason.split()), None, seconds=seconds)
    if answer is None:
        return point
    quantities = {
        q.name: {"computed": q.computed, "exact": q.exact, "error": q.error, "tolerance": q.tolerance}
        for q in answer.quantities
    }
    found = {
        "error": max((q.error / q.tolerance for q in answer.quantities), default=0.0),
        "quantities": quantities,
        "certificate": answer.certificate,
        "iterations": answer.iterations,
        "contacts": answer.contacts,
        "condition": answer.condition,
    }
    return Point(**{**asdict(point), **found})


def _judged(answer: Answer, feasible: bool) -> tuple[Verdict, str]:
    """The verdict on an answer."""
    if not feasible:
        return Verdict.WRONG, "an answer to what has none"
    missed = [f"{k} {v:.2g}" for k, v in answer.certificate.items() if not v <= LIMITS[k]]
    outside = [
        f"{q.name} {q.computed:.8g} for {q.exact:.8g}, error {q.error:.2g} above {q.tolerance:.2g}"
        for q in answer.quantities
        if not q.passed
    ]
    wrong = [*missed, *outside]
    return (Verdict.WRONG, "; ".join(wrong)) if wrong else (Verdict.RIGHT, "")


def verdict_on(error: Exception, feasible: bool | None) -> tuple[Verdict, str]:
    """What it shows that there is no answer; `feasible` is None where nobody knows."""
    if isinstance(error, InfeasibleError):
        return (Verdict.RIGHT if feasible is False else Verdict.WRONG), f"infeasible: {error}"
    if isinstance(error, ContactNotConvergedError):
        return Verdict.REFUSED, str(error)
    return Verdict.WRONG, f"{type(error).__name__}: {error}"


def of_case(name: str, h: float = 1.0, **changes: Parameter) -> Answer:
    """The answer of a catalogue's case."""
    case = CASES[name]
    with Run(case, MPI.COMM_SELF, case.configure(changes), h, case.orders[-1], case.method) as run:
        return of_run(run, case.solve(run))


def bench(method: str = "status", parameters: dict[str, Parameter] | None = None) -> Run:
    """A run for a scene that is no case, or for a case's parameters; close it."""
    return Run(Case("scene", lambda run: [], {}), MPI.COMM_SELF, parameters or {}, 1.0, 1, method)


def of_run(run: Run, quantities: list[Quantity]) -> Answer:
    """The answer of a run that has solved its scene, before it is closed."""
    assert run.solved is not None
    result = run.solved.result
    return Answer(quantities, asdict(result.certificate), result.iterations, len(result.lam), condition_of(result))


def condition_of(result: StepResult) -> float:
    """The condition of W of the last contact problem, of many rows on those that carry force."""
    W, rows = result.problem.W, result.linearisation.rows
    if W.size > DENSE and len(rows) != W.size:
        return 0.0
    taken = np.arange(W.size) if W.size <= DENSE else np.flatnonzero(result.lam[rows] > 0)
    return condition(W.columns(taken)[taken])


def condition(W: Floats) -> float:
    """The largest over the smallest eigenvalue of W, at most 1/ε; 0 of no W, a rigid one, or too large a one."""
    if not 0 < len(W) <= DENSE or not W.any():
        return 0.0
    w = np.linalg.eigvalsh((W + W.T) / 2)
    return float(w[-1] / max(w[0], np.finfo(float).eps * w[-1]))


def of_problem(
    W: Floats,
    q: Floats,
    compare: Callable[[Solution], list[Quantity]],
    method: str = "status",
    G: Floats | None = None,
    r: Floats | None = None,
) -> Answer:
    """The answer to a contact problem whose W is given."""
    solution = solve(ContactProblem(DenseDelassus(W), q, G, r), method)
    taken = np.arange(len(q)) if len(q) <= DENSE else np.flatnonzero(solution.lam > 0)
    rigid = 0.0 if G is None else G @ solution.alpha
    return Answer(
        compare(solution),
        {"complementarity": complementarity(W, q + rigid, solution.lam)},
        solution.iterations,
        len(q),
        condition(W[np.ix_(taken, taken)]),
    )


def decades(first: int, last: int, each: int = 1) -> tuple[float, ...]:
    """10^first … 10^last, `each` a decade."""
    return tuple(float(f"{10 ** (k / each):.6g}") for k in range(first * each, last * each + 1))
