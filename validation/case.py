"""A case of the catalogue: parameters, resolution, a scene, and quantities with known values."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import asdict, dataclass, field
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

from contact.certificate import Tolerances
from contact.clock import PHASES, Clock
from contact.loop import AcceptedStep, march, method
from contact.pairs import FiniteSliding, SmallSliding
from contact.points import ContactPoints
from contact.scene.build import build
from contact.scene.schema import Scene
from contact.step import StepResult, step
from contact.system import System

Floats = NDArray[np.float64]
Parameter = float | str
Rates = dict[str, dict[int, tuple[float, float]]]


@dataclass(frozen=True)
class Quantity:
    """A computed number beside its exact value; the error is relative unless the exact value is 0."""

    name: str
    computed: float
    exact: float
    tolerance: float

    @property
    def error(self) -> float:
        """|computed − exact| / |exact|."""
        return abs(self.computed - self.exact) / (abs(self.exact) or 1.0)

    @property
    def passed(self) -> bool:
        """Whether the error is at most the tolerance; never for NaN."""
        return self.error <= self.tolerance


@dataclass(frozen=True)
class Case:
    """A case: `solve`(run) builds a scene, solves it through the run and returns the quantities.

    parameters : the symbols of the catalogue with their default values, and words such as ``constraint``
    levels : default mesh sizes h [m], coarse to fine, or a function of the parameters; empty where no mesh is to choose
    variants : changes of the parameters that a run without any goes through
    studied : changes of the parameters that a study of error against run time goes through; the first variant if empty
    study : as `levels`, the mesh sizes of such a study; if empty they follow from `levels`
    rates : for quantities whose convergence is claimed over the levels, by order of the elements: (rate, tolerance);
        or a function of the parameters
    """

    name: str
    solve: Callable[[Run], list[Quantity]]
    parameters: dict[str, Parameter]
    levels: tuple[float, ...] | Callable[[dict[str, Parameter]], tuple[float, ...]] = ()
    variants: tuple[dict[str, Parameter], ...] = ({},)
    studied: tuple[dict[str, Parameter], ...] = ()
    study: tuple[float, ...] | Callable[[dict[str, Parameter]], tuple[float, ...]] = ()
    orders: tuple[int, ...] = (2,)
    rates: Rates | Callable[[dict[str, Parameter]], Rates] = field(default_factory=dict)
    n_to_h: Callable[[int], float] | None = None
    method: str = "status"

    @property
    def summary(self) -> str:
        """The first line of the case's docstring."""
        return (self.solve.__doc__ or "").strip().split("\n")[0]

    def sizes(self, parameters: dict[str, Parameter]) -> tuple[float, ...]:
        """The default mesh sizes for these parameters."""
        levels = self.levels(parameters) if callable(self.levels) else self.levels
        return levels or (1.0,)

    def claims(self, parameters: dict[str, Parameter]) -> Rates:
        """The rates claimed for these parameters."""
        return self.rates(parameters) if callable(self.rates) else self.rates

    def configure(self, changes: dict[str, Parameter]) -> dict[str, Parameter]:
        """The parameters after `changes`.

        Raises
        ------
        ValueError
            where the case has no such parameter, or the value is of another type.
        """
        result = dict(self.parameters)
        for key, value in changes.items():
            if key not in result:
                raise ValueError(f"{self.name}: {key} = {value}: unknown, must be one of {', '.join(result)}")
            if isinstance(result[key], str) != isinstance(value, str) or (
                not isinstance(value, str) and not math.isfinite(value)
            ):
                kind = "a word" if isinstance(result[key], str) else "a finite number"
                raise ValueError(f"{self.name}: {key} = {value}: must be {kind}")
            result[key] = value
        return result


CASES: dict[str, Case] = {}


def case(
    name: str,
    parameters: dict[str, Parameter],
    **options: Any,
) -> Callable[[Callable[[Run], list[Quantity]]], Callable[[Run], list[Quantity]]]:
    """Enter a function into the catalogue as the case `name`; `options` are the other fields of `Case`."""

    def register(solve: Callable[[Run], list[Quantity]]) -> Callable[[Run], list[Quantity]]:
        CASES[name] = Case(name, solve, parameters, **options)
        return solve

    return register


@dataclass
class Solved:
    """A scene's system after its step, or its last one; `observed` is what a case looked at after each."""

    system: System
    result: StepResult
    observed: list[Any] = field(default_factory=list)

    def forces(self, contact: int = 0) -> Floats:
        """λ of one contact of the scene, (c) [N]."""
        counts = [c.count for c in self.result.linearisation.constraints]
        start = sum(counts[:contact])
        lam: Floats = self.result.lam[start : start + counts[contact]]
        return lam

    def places(self, contact: int = 0) -> Floats:
        """Undeformed positions of one contact's constraints, (c, D) [m]."""
        places: Floats = self.result.linearisation.constraints[contact].places
        return places

    def points(self, contact: int = 0) -> ContactPoints:
        """The points of one contact against a surface."""
        pair = self.system.pairs[contact]
        assert isinstance(pair, SmallSliding | FiniteSliding)
        return pair.points

    def resultant(self, contact: int = 0) -> Floats:
        """Σ λ n of one contact [N], (D)."""
        force: Floats = self.forces(contact) @ self.result.linearisation.constraints[contact].normals
        return force


class Run:
    """One case at one level: parameters, resolution and method; it solves the case's scene and keeps what that took.

    `seconds` are those of all its steps by phase, `building` those from the scenes to bodies and contacts, meshes
    included; `now` tells the time, that on the wall if it is not given. Collective on `comm`.
    """

    def __init__(
        self,
        case: Case,
        comm: Any,
        parameters: dict[str, Parameter],
        h: float,
        order: int,
        method: str,
        now: Callable[[], float] | None = None,
    ) -> None:
        self.case, self.comm, self.parameters = case, comm, parameters
        self.h, self.order, self.method = h, order, method
        self.solved: Solved | None = None
        self.seconds = dict.fromkeys((*PHASES, "total"), 0.0)
        self.building = 0.0
        self._now = now

    def __getitem__(self, name: str) -> Any:
        return self.parameters[name]

    def values(self, *names: str) -> dict[str, Any]:
        """Some parameters as keyword arguments."""
        return {name: self.parameters[name] for name in names}

    def solve(self, **scene: Any) -> Solved:
        """Build and solve a scene given by its tables, to residuals of 1e-8. Collective."""
        clock = Clock(self._now)
        model = self._scene(scene)
        system = build(model, self.comm, clock=clock)
        self.building += clock.lap()["total"]
        system.prepare()
        exact = Tolerances(surface_error=1e-8, penetration=1e-8)
        end = model.time.end
        with clock("assemble"):
            self.solved = Solved(system, step(system, end, end, method(model), tolerances=exact))
        self._count(clock.lap())
        return self.solved

    def _scene(self, tables: dict[str, Any]) -> Scene:
        """The scene of these tables, solved by this run's method unless they say another."""
        return Scene.model_validate({**tables, "solver": {"method": self.method, **tables.get("solver", {})}})

    def _count(self, seconds: dict[str, float]) -> None:
        for phase, spent in seconds.items():
            self.seconds[phase] += spent

    def march(
        self,
        observe: Callable[[System, AcceptedStep], Any],
        begin: Callable[[System], None] = lambda system: None,
        **scene: Any,
    ) -> Solved:
        """Build a scene and run its steps, each looked at by `observe`. Collective.

        `begin` may change the state in which the scene starts.
        """
        clock = Clock(self._now)
        model = self._scene(scene)
        system = build(model, self.comm, clock=clock)
        self.building += clock.lap()["total"]
        begin(system)
        system.prepare()
        observed, last = [], None

        def sink(accepted: AcceptedStep) -> None:
            nonlocal last
            last = accepted.result
            self._count(accepted.seconds)
            if accepted.converged:
                observed.append(observe(system, accepted))

        march(system, model, sink)
        assert last is not None
        self.solved = Solved(system, last, observed)
        return self.solved

    def close(self) -> None:
        """Destroy the PETSc objects of the run. Collective."""
        if self.solved is not None:
            self.solved.system.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def report(self, quantities: list[Quantity]) -> dict[str, Any]:
        """The object that ``validate --json`` prints."""
        assert self.solved is not None
        result = self.solved.result
        seconds = {k: v for k, v in self.seconds.items() if k != "output"}
        return {
            "case": self.case.name,
            "parameters": self.parameters,
            "method": self.method,
            "order": self.order,
            "h": self.h,
            "dofs": sum(body.space.size for body in self.solved.system.bodies),
            "contacts": len(result.lam),
            "quantities": {q.name: quantity_entry(q) for q in quantities},
            "certificate": asdict(result.certificate),
            "iterations": result.iterations,
            "time": seconds,
            "passed": all(q.passed for q in quantities),
        }


def quantity_entry(q: Quantity) -> dict[str, Any]:
    """A quantity as ``validate --json`` prints it."""
    return {"computed": q.computed, "exact": q.exact, "error": q.error, "tolerance": q.tolerance, "passed": q.passed}


def plain(value: Any) -> Any:
    """A report as JSON takes it: numpy's scalars as plain ones, and None for what is not a number."""
    if isinstance(value, dict):
        return {key: plain(entry) for key, entry in value.items()}
    if isinstance(value, list | tuple):
        return [plain(entry) for entry in value]
    value = value.item() if hasattr(value, "item") else value
    return None if isinstance(value, float) and not math.isfinite(value) else value


def fitted_rate(h: list[float], errors: list[float]) -> float:
    """The slope of log(error) over log(h) by least squares."""
    return float(np.polyfit(np.log(h), np.log(errors), 1)[0])
