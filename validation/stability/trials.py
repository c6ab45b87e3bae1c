"""Random contact problems: a certificate or a truthful refusal, always.

Trial k of a seed is drawn from (seed, k) alone. Each knows by construction whether it is feasible: a motion x opens all
gaps, or a row that others, positively combined, oppose lacks a gap; where it does not, `judge` decides when the program
refuses. W is handed over whole or column by column, with no guess, a random one, or one near the solution.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass
from functools import cache

import numpy as np
from numpy.typing import NDArray

from contact.solvers import (
    ContactNotConvergedError,
    ContactProblem,
    DenseDelassus,
    InfeasibleError,
    Solution,
    solve,
)
from validation.stability import generators
from validation.stability.generators import Problem, Random
from validation.stability.judge import balance, gap_residual, opened, opposed
from validation.stability.point import Verdict, verdict_on

Floats = NDArray[np.float64]

LARGEST = 2000
WHOLE = 300  # rows up to which W may be handed over whole
LIMIT = 1e-8


@dataclass(frozen=True)
class Trial:
    """A random problem and its verdict.

    feasible : whether it has a solution; None where the program found one and nobody asked
    residual : by `judge`, of a solution
    """

    number: int
    family: str
    contacts: int
    feasible: bool | None
    verdict: str
    reason: str
    residual: float | None
    iterations: int
    seconds: float


class FactorDelassus:
    """W = FFᵀ by columns."""

    def __init__(self, F: Floats) -> None:
        self.F = F

    @property
    def size(self) -> int:
        """The number of rows."""
        return len(self.F)

    def columns(self, rows: NDArray[np.int64]) -> Floats:
        """W[:, rows]."""
        return np.asarray(self.F @ self.F[rows].T)


@dataclass(frozen=True)
class Drawn:
    """A problem: W = FFᵀ, q, and G, r where bodies float; `feasible` if that is known."""

    family: str
    F: Floats
    q: Floats
    feasible: bool | None
    G: Floats | None = None
    r: Floats | None = None


def draw(rng: Random) -> Drawn:
    """A problem of any family, with c log-uniform in 1 … 2,000."""
    c = int(np.exp(rng.uniform(0, np.log(LARGEST + 1))))
    names = list(_KINDS)
    name = names[int(rng.integers(len(names)))]
    drawn = _KINDS[name](rng, c)
    F, q = drawn.F, drawn.q
    if drawn.G is None and name != "recorded" and rng.random() < 0.6:
        F, q, feasible = _bounded(rng, F, q)
        drawn = Drawn(name, F, q, feasible)
    stiffness, size = 10.0 ** rng.uniform(-6, 6), 10.0 ** rng.uniform(-9, 9)
    G, r = drawn.G, drawn.r
    if r is not None:
        r = r * size * stiffness**2
    return Drawn(name, drawn.F / stiffness, drawn.q * size, drawn.feasible, G, r)


def _bounded(rng: Random, F: Floats, q: Floats) -> tuple[Floats, Floats, bool]:
    """Gaps that a motion opens, and perhaps rows that oppose others, at a positive, no, or a negative distance."""
    x = rng.standard_normal(F.shape[1]) / np.sqrt(F.shape[1])
    spare = np.maximum(rng.standard_normal(len(F)), 0.0) * rng.uniform(0, 1)
    q = spare - F @ x
    depth = float(np.abs(q).max()) or 1.0
    width = float(rng.choice([1.0, 1e-3, 0.0, -1e-3, -1.0])) * depth
    if rng.random() < 0.5 or len(F) == LARGEST:
        return F, q, True
    chosen = rng.choice(len(F), min(len(F), int(rng.integers(1, 4))), replace=False)
    weights = rng.uniform(0.3, 1, len(chosen))
    row = -weights @ F[chosen]
    q[chosen] = -F[chosen] @ x
    if not row.any():
        return F, q, True
    return np.vstack([F, row]), np.append(q, -row @ x + width), width >= 0


def _plain(name: str) -> Callable[[Random, int], Drawn]:
    def kind(rng: Random, c: int) -> Drawn:
        F, q = generators.FAMILIES[name](rng, min(c, 900) if name == "half-space" else c)
        return Drawn(name, F, q, True if name == "half-space" else None)

    return kind


def _semidefinite(rng: Random, c: int) -> Drawn:
    """Rank at most a third of the rows."""
    n = max(1, min(int(rng.integers(1, max(2, c // 3 + 1))), 200))
    return Drawn("semidefinite", rng.standard_normal((c, n)), rng.standard_normal(c) - rng.uniform(0, 1), None)


def _ill_conditioned(rng: Random, c: int) -> Drawn:
    """Conditions to 1e14."""
    F, q = generators.conditioned(rng, min(c, 200), 10.0 ** rng.uniform(0, 14))
    return Drawn("ill-conditioned", F, q, True)


@cache
def recorded() -> list[Problem]:
    """Factors and free gaps from the steps of a wire that is pushed through a vessel."""
    from validation.recorded import Solves
    from validation.stability.beams import insertion

    kept: list[Problem] = []

    def watch(problem: ContactProblem, start: Floats | None) -> None:
        W = problem.W.columns(np.arange(problem.W.size))
        w, V = np.linalg.eigh((W + W.T) / 2)
        if len(W) > 3 and w[0] > -1e-12 * w[-1]:
            kept.append((V * np.sqrt(np.maximum(w, 0.0)), problem.q.copy()))

    with Solves(watch):
        insertion(2.0)
    return kept[:: max(1, len(kept) // 100)]


def _recorded(rng: Random, c: int) -> Drawn:
    """A recorded problem with its compliances and gaps changed by some percent."""
    problems = recorded()
    F, q = problems[int(rng.integers(len(problems)))]
    size = 10.0 ** rng.uniform(-6, -1)
    F = (1 + size * rng.standard_normal(len(q)))[:, None] * F
    return Drawn("recorded", F, q + size * np.abs(q).max() * rng.standard_normal(len(q)), None)


def _floating(rng: Random, c: int) -> Drawn:
    """A plane body that only contact holds, rigid or elastic; its load balanced by contacts, or along a way out."""
    c = min(c, 60)
    angle = rng.uniform(0, 2 * np.pi, c)
    n, at = np.stack([np.cos(angle), np.sin(angle)], axis=1), rng.uniform(-1, 1, (c, 2))
    G = np.column_stack([n, at[:, 0] * n[:, 1] - at[:, 1] * n[:, 0]])
    F = rng.standard_normal((c, 2 * c)) / np.sqrt(2 * c) * (0.0 if rng.random() < 0.3 else 10.0 ** rng.uniform(-4, 0))
    way = rng.standard_normal(3)
    bounded = rng.random() < 0.7
    if not bounded:
        G *= np.where(G @ way >= 0, 1.0, -1.0)[:, None]  # `way` opens all gaps
    q = np.maximum(rng.standard_normal(c), 0.0) * rng.uniform(0, 1) - G @ rng.standard_normal(3)
    lam = np.where(rng.random(c) < 0.5, rng.uniform(0.1, 1, c), 0.0)
    lam[0] = 1.0
    balanced = bounded or rng.random() < 0.5
    load = G.T @ lam
    r = -load if balanced else load * (1.0 if load @ way > 0 else -1.0)
    return Drawn("floating", F, q, balanced, G, r)


_KINDS: dict[str, Callable[[Random, int], Drawn]] = {
    **{name: _plain(name) for name in generators.FAMILIES},
    "semidefinite": _semidefinite,
    "ill-conditioned": _ill_conditioned,
    "recorded": _recorded,
    "floating": _floating,
}


def try_problem(seed: int, number: int) -> Trial:
    """Draw a problem, solve it and judge what is claimed of it."""
    rng = np.random.default_rng([seed, number])
    drawn, begun = draw(rng), time.process_time()
    F, q, c = drawn.F, drawn.q, len(drawn.q)
    whole = c <= WHOLE and rng.random() < 0.7
    W = DenseDelassus(F @ F.T) if whole else FactorDelassus(F)
    problem = ContactProblem(W, q, drawn.G, drawn.r)
    start: Floats | None = None
    if rng.random() < 0.3:
        start = np.maximum(rng.standard_normal(c), 0.0) * float(np.abs(q).max()) / float((F**2).sum() or 1.0)
    guess = rng.random() < 0.3
    iterations, residual, feasible = 0, None, drawn.feasible
    try:
        found = solve(problem, "status", start)
        if guess:
            near = found.lam * (1 + 0.1 * rng.standard_normal(c)) * (rng.random(c) < 0.9)
            found = solve(problem, "status", np.maximum(near, 0.0))
        iterations, residual = found.iterations, _residual(drawn, found)
        verdict, reason = _claimed(feasible, residual)
    except (InfeasibleError, ContactNotConvergedError) as error:
        feasible = _decided(drawn)
        verdict, reason = verdict_on(error, feasible)
        reason += " (undecided)" if feasible is None else ""
    except Exception as error:
        verdict, reason = verdict_on(error, feasible)
    seconds = time.process_time() - begun
    return Trial(number, drawn.family, c, feasible, verdict.value, reason, residual, iterations, seconds)


def _claimed(feasible: bool | None, residual: float) -> tuple[Verdict, str]:
    """The verdict on a claimed solution."""
    if not residual <= LIMIT:
        return Verdict.WRONG, f"residual {residual:.2g}"
    return (Verdict.WRONG, "a solution of what has none") if feasible is False else (Verdict.RIGHT, "")


def _residual(drawn: Drawn, found: Solution) -> float:
    """The worse of the residuals of gaps and of balance, by `judge`."""
    rigid = None if drawn.G is None else drawn.G @ found.alpha
    worst = gap_residual(drawn.F, drawn.q, found.lam, rigid)
    if drawn.G is not None and drawn.r is not None:
        worst = max(worst, balance(drawn.G, drawn.r, found.lam))
    return worst


def _decided(drawn: Drawn) -> bool | None:
    """Whether the problem is feasible: as constructed, by a motion that opens all gaps, or by Farkas' alternative."""
    if drawn.feasible is not None:
        return drawn.feasible
    if opened(drawn.F, drawn.q):
        return True
    return False if opposed(drawn.F, drawn.q) else None
