"""What a study runs: chains of levels, one for each case, parameters, element order and method."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass
from typing import Any

from validation.case import CASES, Case, Parameter

LEVELS = 5
METHODS = ("status", "gauss-seidel", "lemke", "vi-rsls", "vi-ssls", "tao", "vi-primal")
# PETSc's Newton methods depend on their line search: on recorded problems they are tried with others than the default.
SEARCHES = ("l2", "basic")
COARSER = 2**3  # times the mesh size of a case with a single level is where its study begins


@dataclass(frozen=True)
class Settings:
    """What decides the numbers of a study; a study can only go on with the same.

    cases : names of the catalogue
    methods : names of `contact.solvers.METHODS`
    levels : mesh sizes a case, from the coarsest, at most
    repeats : timed runs each, at most
    seed : of the order in which chains are run
    limit : seconds of CPU that one run may take
    changes : parameters other than those of the study's cases
    scenes : names of scenes whose contact problems are recorded
    recording : seconds of CPU for which each of them is run
    options : words for PETSc, given to every run
    """

    cases: tuple[str, ...]
    methods: tuple[str, ...] = METHODS
    levels: int = LEVELS
    repeats: int = 3
    seed: int = 0
    limit: float = 30.0
    changes: tuple[tuple[str, Parameter], ...] = ()
    scenes: tuple[str, ...] = ()
    recording: float = 10.0
    options: tuple[str, ...] = ()

    def as_dict(self) -> dict[str, Any]:
        """As JSON keeps it; `options` only if there are any."""
        entries = {k: list(map(_listed, v)) if isinstance(v, tuple) else v for k, v in asdict(self).items()}
        return {key: value for key, value in entries.items() if key != "options" or value}


def _listed(value: Any) -> Any:
    return list(value) if isinstance(value, tuple) else value


@dataclass(frozen=True)
class Chain:
    """The levels of one case with one order and method, coarse to fine: what one process runs.

    `changes` are the parameters other than the case's own.
    """

    case: str
    changes: tuple[tuple[str, Parameter], ...]
    order: int
    method: str
    sizes: tuple[float, ...]

    @property
    def key(self) -> str:
        """Names the chain within a study."""
        return "|".join([self.label, str(self.order), self.method])

    @property
    def label(self) -> str:
        """The case and the parameters that are not its own."""
        return label(self.case, self.changes)


def label(case: str, changes: Sequence[tuple[str, Parameter]]) -> str:
    """A case and changed parameters in words."""
    words = [f"{key}={value:g}" if isinstance(value, float) else f"{key}={value}" for key, value in changes]
    return " ".join([case, *words])


def sizes(case: Case, parameters: dict[str, Parameter], levels: int) -> tuple[float, ...]:
    """The mesh sizes of a study, coarse to fine: one where the case has no mesh to choose, else `levels`.

    They are the case's own for a study, then no more than those. Without any, a case with several levels goes through
    them, and one with a single level begins `COARSER` times coarser; the finest is halved until there are enough.
    """
    own = case.study(parameters) if callable(case.study) else case.study
    if own or not case.levels:
        return own[:levels] or case.sizes(parameters)
    given = case.sizes(parameters)[:levels]
    if len(case.sizes(parameters)) == 1:
        given = (COARSER * given[0],)
    return (*given, *(given[-1] / 2**k for k in range(1, levels - len(given) + 1)))


def chains(settings: Settings) -> list[Chain]:
    """All chains, in the order of the settings.

    Raises
    ------
    ValueError
        where a case has no such parameter.
    """
    found = []
    for name in settings.cases:
        case = CASES[name]
        variants = [dict(settings.changes)] if settings.changes else list(case.studied or case.variants[:1])
        for changes in variants:
            parameters = case.configure(changes)
            levels = sizes(case, parameters, settings.levels)
            found += [
                Chain(name, tuple(changes.items()), order, method, levels)
                for order in case.orders
                for method in settings.methods
            ]
    return found


def treatments(methods: Sequence[str]) -> dict[str, dict[str, str]]:
    """How recorded problems are solved: names, each with the options of PETSc that it sets.

    A name is a method, alone or with what sets it apart behind a comma: ``status, warm`` starts from the forces that
    the step started with.
    """
    found: dict[str, dict[str, str]] = {}
    for method in methods:
        found[method] = {}
        if method == "status":
            found["status, warm"] = {}
        if method in ("vi-rsls", "vi-ssls"):
            key = f"{method.replace('-', '_')}_snes_linesearch_type"
            found |= {f"{method}, line search {search}": {key: search} for search in SEARCHES}
    return found
