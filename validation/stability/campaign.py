"""The whole campaign: all points and trials, shared by processes, and what they amount to."""

from __future__ import annotations

import multiprocessing
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from dataclasses import asdict
from typing import Any

from validation.stability import beams, operators, solids, springs, steps, units
from validation.stability.point import SWEEPS, Verdict, try_point

__all__ = ["PARTS", "REFUSED", "SWEEPS", "Task", "failures", "run", "summary", "tasks", "tried"]

FAMILIES = (springs, operators, solids, beams, steps, units)
# Random scenes beside the contact problems: one for so many of these.
PARTS = {"problem": 1, "solid": 50, "wire": 100}
CHUNK = 25  # contact problems a task
REFUSED = {"points": 0.02, "trials": 0.01}  # of what is feasible, the share that may be refused

Task = tuple[str, Any, int, int]


def tasks(sweeps: Iterable[str], seed: int, trials: int) -> list[Task]:
    """What there is to do: (sweep, value, 0, 0) or (kind of trial, seed, first number, one past the last)."""
    points: list[Task] = [(name, value, 0, 0) for name in sweeps for value in SWEEPS[name].values]
    drawn: list[Task] = []
    for kind, share in PARTS.items():
        number = -(-trials // share)
        size = CHUNK if kind == "problem" else 1
        drawn += [(kind, seed, k, min(k + size, number)) for k in range(0, number, size)]
    return points + drawn


def tried(task: Task) -> list[dict[str, Any]]:
    """The points or trials of a task, as plain dictionaries."""
    name, value, first, last = task
    if name in SWEEPS:
        return [asdict(try_point(SWEEPS[name], value))]
    if name == "problem":
        from validation.stability.trials import try_problem

        return [asdict(try_problem(value, k)) for k in range(first, last)]
    from validation.stability.scenes import try_scene

    return [asdict(try_scene(name, value, k)) for k in range(first, last)]


def run(
    wanted: list[Task], jobs: int, done: Callable[[int], None] = lambda number: None, comm: Any = None
) -> dict[str, list[dict[str, Any]]]:
    """Points and trials of all tasks, in their order, whatever shares them: processes, or the ranks of `comm`.

    Collective on `comm`; every rank gets all of them.
    """
    results: list[list[dict[str, Any]]]
    if comm is not None and comm.size > 1:
        mine = []
        for k in range(comm.rank, len(wanted), comm.size):
            mine.append((k, tried(wanted[k])))
            done(len(mine[-1][1]))
        gathered = [pair for part in comm.allgather(mine) for pair in part]
        results = [found for _, found in sorted(gathered, key=lambda pair: pair[0])]
    else:
        results = []
        with _map(jobs) as each:
            for found in each(tried, wanted):
                results.append(found)
                done(len(found))
    points = [p for task, found in zip(wanted, results, strict=True) if task[0] in SWEEPS for p in found]
    trials = [t for task, found in zip(wanted, results, strict=True) if task[0] not in SWEEPS for t in found]
    return {"points": points, "trials": trials}


@contextmanager
def _map(jobs: int) -> Iterator[Callable[..., Iterable[list[dict[str, Any]]]]]:
    """`map`, by fresh processes where there are to be several: MPI and PETSc do not survive a fork."""
    if jobs == 1:
        yield map
    else:
        with multiprocessing.get_context("spawn").Pool(jobs, _begin) as pool:
            yield pool.imap
            pool.close()  # not terminated: PETSc has a word to say on that
            pool.join()


def _begin() -> None:
    from fem import petsc

    petsc.initialise([])


def summary(found: dict[str, list[dict[str, Any]]]) -> dict[str, dict[str, Any]]:
    """Counts by verdict of points and trials: all, feasible, refused of these, their share, CPU seconds."""
    result = {}
    for part, entries in found.items():
        # a trial that was solved is feasible, whether or not that was known before
        feasible = [e for e in entries if e["feasible"] or (e["feasible"] is None and e["verdict"] != Verdict.WRONG)]
        refused = sum(e["verdict"] == Verdict.REFUSED for e in feasible)
        result[part] = {
            "all": len(entries),
            **{verdict.value: sum(e["verdict"] == verdict for e in entries) for verdict in Verdict},
            "feasible": len(feasible),
            "feasible refused": refused,
            "share refused": refused / len(feasible) if feasible else 0.0,
            "seconds": sum(e["seconds"] for e in entries),
        }
    return result


def failures(found: dict[str, list[dict[str, Any]]]) -> list[str]:
    """What the campaign must not show: a wrong verdict, a refusal in a row of the extreme set, too many refusals."""
    lines = [
        f"{point['sweep']} at {point['value']:.6g}: {point['verdict']}: {point['reason']}"
        for point in found["points"]
        if point["verdict"] == Verdict.WRONG or (point["verdict"] == Verdict.REFUSED and SWEEPS[point["sweep"]].row)
    ]
    lines += [
        f"trial {trial['number']} ({trial['family']}): wrong: {trial['reason']}"
        for trial in found["trials"]
        if trial["verdict"] == Verdict.WRONG
    ]
    for part, counts in summary(found).items():
        if counts["share refused"] >= REFUSED[part]:
            lines.append(f"{counts['share refused']:.2%} of the feasible {part} refused, at most {REFUSED[part]:.0%}")
    return lines
