"""The process in which a study's runs are made, one level after the other, each timed by the process's own CPU time.

    echo REQUEST | python -m validation.study.worker

REQUEST is one JSON object: options (``petsc``), and a chain of levels (``case``), a scene to record problems from
(``scene``) or recorded problems for a method to solve (``files``). Answers are JSON Lines, one as soon as it is known;
before each run a line says since which time of the process's CPU it goes on, so that who asked can end a process whose
run takes too long.
"""

from __future__ import annotations

import gc
import json
import os
import resource
import sys
from collections.abc import Iterator
from contextlib import suppress
from dataclasses import asdict
from pathlib import Path
from time import perf_counter, process_time
from typing import Any

from fem import petsc

ENOUGH = 1 / 4  # of the limit: a run is not repeated when its repeats have taken that together


def main() -> None:
    """Answer the request on standard input."""
    # What libraries print must not come between the answers.
    answers = os.fdopen(os.dup(1), "w", buffering=1, encoding="utf8")
    os.dup2(2, 1)
    request = json.load(sys.stdin)
    petsc.initialise(request.pop("petsc"))
    if "case" in request:
        lines = _levels(**request)
    elif "scene" in request:
        lines = _record(**request)
    else:
        lines = _problems(**request)
    answers.write(json.dumps({"begin": process_time()}) + "\n")
    for line in lines:
        answers.write(json.dumps(line) + "\n" + json.dumps({"begin": process_time()}) + "\n")


def _levels(
    case: str,
    changes: list[list[Any]],
    order: int,
    method: str,
    sizes: list[float],
    levels: list[int],
    repeats: int,
    limit: float,
) -> Iterator[dict[str, Any]]:
    """Run some levels; before them the coarsest once, untimed, so that kernels are compiled and libraries loaded.

    An answer without entries says that this is done.
    """
    import validation.cases  # noqa: F401  enters the cases into the catalogue
    from validation.case import CASES

    spec = case, dict(map(tuple, changes)), order, method
    CASES[case].configure(spec[1])
    _attempt(*spec, sizes[0], 1, limit)
    yield {}
    for level in levels:
        yield {"level": level, **_attempt(*spec, sizes[level], repeats, limit)}


def _attempt(
    case: str, changes: dict[str, Any], order: int, method: str, h: float, repeats: int, limit: float
) -> dict[str, Any]:
    """What came out of one level: a report with its times and memory, or why there is none."""
    from mpi4py import MPI

    from contact.solvers import ContactNotConvergedError, InfeasibleError
    from validation.case import CASES, Run, plain

    entry = CASES[case]
    parameters = entry.configure(changes)
    times: list[dict[str, float]] = []
    memory, base = 0.0, _begin_peak()
    report: dict[str, Any] = {}
    while len(times) < repeats and sum(t["total"] for t in times) <= ENOUGH * limit:
        run = Run(entry, MPI.COMM_SELF, parameters, h, order, method, now=process_time)
        begun, wall = process_time(), perf_counter()
        try:
            report = plain(run.report(entry.solve(run)))
        except ContactNotConvergedError as error:
            why = {"outcome": "not converged", "reason": error.reason, "iterations": error.iterations}
            why |= {"residual": plain(error.residual), "claimed": error.claimed}
            return {**why, "spent": process_time() - begun}
        except InfeasibleError as error:
            return {"outcome": "infeasible", "reason": str(error), "spent": process_time() - begun}
        except (ValueError, ArithmeticError) as error:
            return {"outcome": "refused", "reason": str(error), "spent": process_time() - begun}
        finally:
            memory = memory or _peak()
            run.close()
        spent = report.pop("time")
        spent = {"build": run.building, **spent, "total": run.building + spent["total"]}
        times.append({**spent, "process": process_time() - begun, "wall": perf_counter() - wall})
    return {"outcome": "solved", "report": report, "times": times, "memory": memory, "base": base}


def _record(scene: str, files: str, problems: int, seconds: float) -> Iterator[dict[str, Any]]:
    """Record contact problems from the first part of a scene."""
    from contact.scene.schema import read_scene
    from validation.recorded import record

    path, folder = Path(scene), Path(files)
    folder.mkdir(parents=True, exist_ok=True)
    ended = record(read_scene(path)[0], path.parent, folder, problems=problems, limit=seconds, now=process_time)
    yield {"outcome": "recorded", "ended": ended, "files": sorted(p.name for p in folder.glob("step_*.npz"))}


def _problems(files: list[str], method: str, options: dict[str, str], repeats: int) -> Iterator[dict[str, Any]]:
    """Solve recorded problems by a method, named as `plan.treatments` does, with options of PETSc."""
    import numpy as np
    from petsc4py import PETSc

    from validation.case import plain
    from validation.recorded import answer, recorded

    for key, value in options.items():
        PETSc.Options()[key] = value
    for number, file in enumerate(files):
        problem, start = recorded(Path(file))
        if not number:
            answer(problem, method, start, 1e-12, 0.0, process_time)
        # many short solves are better known than one: at least a tenth of a second of them
        found = answer(problem, method, start, 1e-12, 0.1 * repeats, process_time)
        entry = {k: v for k, v in asdict(found).items() if k not in ("lam", "error")}
        entry |= {"file": Path(file).name, "candidates": problem.W.size, "residual": plain(found.residual)}
        entry |= _conditions(problem.W.columns(np.arange(problem.W.size)), None if found.failure else found.lam)
        yield {"outcome": "failed" if found.failure else "solved", **entry}
        problem.primal.destroy()  # type: ignore[union-attr]


def _conditions(W: Any, lam: Any) -> dict[str, Any]:
    """The least eigenvalue of W, and, of a solution λ, the active rows and the condition number of their block.

    The diagonal of W is scaled to 1. A method that stops inside λ > 0 leaves forces of round-off that do not count.
    """
    import numpy as np

    from validation.case import plain

    S = 1 / np.sqrt(np.maximum(np.abs(np.diag(W)), np.finfo(float).tiny))
    scaled = S[:, None] * W * S
    found = {"least_eigenvalue": plain(np.linalg.eigvalsh(scaled)[0]), "active": None, "condition": None}
    if lam is not None:
        pull = np.asarray(lam) / S
        active = np.flatnonzero(pull > 1e-8 * pull.max(initial=0.0))
        found |= {"active": len(active)}
        if len(active):
            found["condition"] = plain(np.linalg.cond(scaled[np.ix_(active, active)]))
    return found


def _begin_peak() -> float:
    """Begin to look for the peak of the process's memory; its memory now [MiB]."""
    gc.collect()
    with suppress(OSError):  # without it, it is the peak since the process began
        Path("/proc/self/clear_refs").write_text("5")
    return _peak()


def _peak() -> float:
    """The peak of the process's resident memory [MiB]."""
    try:
        status = Path("/proc/self/status").read_text(encoding="utf8")
        return int(status.split("VmHWM:")[1].split()[0]) / 1024
    except (OSError, IndexError):
        return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024


if __name__ == "__main__":
    main()
