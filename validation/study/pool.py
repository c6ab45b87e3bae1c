"""Processes that share a study: workers on this machine, or the ranks of an MPI run through mpi4py.futures.

A run that is timed is alone on its machine: it holds a lock that runs of which only the answer counts share.
"""

from __future__ import annotations

import fcntl
import json
import math
import os
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Callable, Iterator
from concurrent.futures import Executor, ThreadPoolExecutor
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any, cast

from mpi4py import MPI

from validation.study.journal import Journal
from validation.study.plan import Chain, Settings

# Variables by which an MPI launcher makes a process one of its ranks; a worker is a program of its own.
LAUNCHER = ("PMI", "PMIX", "MPI", "HYD", "OMPI", "SLURM_PROCID")
THREADS = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "NUMBA_NUM_THREADS")
POLL = 0.2  # seconds between two looks at a worker
SLOW = 20.0  # times its limit of CPU is what a worker may take on the wall
_STOP = threading.Event()
_TICK = os.sysconf("SC_CLK_TCK")


@contextmanager
def executor(jobs: int, comm: Any = MPI.COMM_WORLD) -> Iterator[Executor | None]:
    """An executor with `jobs` threads; with more than one rank, on rank 0 that of all others, on which it is None."""
    if comm.size > 1:
        from mpi4py.futures import MPICommExecutor

        with MPICommExecutor(comm, root=0) as shared:
            yield cast("Executor | None", shared)
    else:
        with ThreadPoolExecutor(jobs) as local:
            yield local


def run_chain(journal: str, chain: Chain, levels: list[int], settings: Settings, alone: bool) -> None:
    """Run levels of a chain in a process of their own and enter each into the journal; once only unless `alone`.

    Where the method cannot treat the problem, or not within the limit, on one mesh, finer ones are not tried.
    """
    entries, left = Journal(Path(journal)), list(levels)
    name = {"chain": chain.key, "alone": alone}
    request = {"case": chain.case, "changes": [list(c) for c in chain.changes], "order": chain.order}
    request |= {"method": chain.method, "sizes": list(chain.sizes), "levels": levels}
    request |= {"repeats": settings.repeats if alone else 1, "limit": settings.limit, "petsc": settings.options}

    def enter(line: dict[str, Any]) -> bool:
        if "level" not in line:
            return True
        left.remove(line["level"])
        entries.append({**name, **line})
        return not (line["outcome"] == "refused" and line["reason"].startswith("method = "))

    ended = converse(request, enter, settings.limit, alone)
    if ended and left:
        entries.append({**name, "level": left.pop(0), **ended})
    why = f"{ended['outcome']} on a coarser mesh" if ended else "refused on a coarser mesh"
    for level in left:
        entries.append({**name, "level": level, "outcome": "not tried", "reason": why})


def run_request(journal: str, name: dict[str, Any], request: dict[str, Any], limit: float, alone: bool) -> None:
    """Answer a request of another kind; every line of it is entered under `name`, at the end one that says so."""
    entries = Journal(Path(journal))

    def enter(line: dict[str, Any]) -> bool:
        entries.append({**name, **line})
        return True

    ended = converse(request, enter, limit, alone)
    entries.append({**name, "finished": True, **ended})


def stop() -> None:
    """End all workers of this process; what they were at is not entered."""
    _STOP.set()


class _StoppedError(RuntimeError):
    """The study was interrupted."""


def converse(
    request: dict[str, Any], enter: Callable[[dict[str, Any]], bool], limit: float, alone: bool
) -> dict[str, Any]:
    """Start a worker and hand each of its answers to `enter` while that returns True.

    Returns the outcome and the reason where the worker ended before it had answered all, else nothing.
    """
    with _machine(alone), tempfile.TemporaryFile() as errors:
        worker = subprocess.Popen(
            [sys.executable, "-P", "-m", "validation.study.worker"],
            stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=errors, env=_environment(), text=True,
            # an interrupt from the keyboard is for the study, which ends its workers
            start_new_session=True,
        )  # fmt: skip
        watch = _Watch(worker, limit)
        assert worker.stdin is not None
        assert worker.stdout is not None
        try:
            with suppress(BrokenPipeError):
                worker.stdin.write(json.dumps(request))
                worker.stdin.close()
            for text in worker.stdout:
                line = json.loads(text)
                if "begin" in line:
                    watch.begin(line["begin"])
                elif not enter(line):
                    return {}
            code = worker.wait()
        finally:
            watch.end()
            worker.kill()
            worker.wait()
        if _STOP.is_set():
            raise _StoppedError
        if watch.verdict:
            return {"outcome": "time limit", "reason": watch.verdict}
        if code:
            errors.seek(0)
            said = errors.read().decode("utf8", "replace").strip().splitlines()
            return {"outcome": "failed", "reason": f"exit code {code}: {said[-1] if said else ''}"}
        return {}


class _Watch(threading.Thread):
    """Ends a worker whose present run has taken more CPU than it may, or far more time than that on the wall."""

    def __init__(self, worker: subprocess.Popen[str], limit: float) -> None:
        super().__init__(daemon=True)
        self.verdict = ""
        self._worker, self._limit, self._done = worker, limit, threading.Event()
        self._cpu, self._wall = 0.0, time.monotonic()
        self.start()

    def begin(self, cpu: float) -> None:
        """A run begins at this CPU time of the worker."""
        self._cpu, self._wall = cpu, time.monotonic()

    def end(self) -> None:
        """Look no longer."""
        self._done.set()
        self.join()

    def run(self) -> None:
        """Look until the end."""
        while not self._done.wait(POLL):
            if _cpu_seconds(self._worker.pid) - self._cpu > self._limit:
                self.verdict = f"more than {self._limit:g} s of CPU"
            elif time.monotonic() - self._wall > SLOW * self._limit:
                self.verdict = f"more than {SLOW * self._limit:g} s on the wall"
            if self.verdict or _STOP.is_set():
                self._worker.kill()
                return


def _cpu_seconds(pid: int) -> float:
    """CPU time of a process so far [s], of the user and of the system; −∞ where it is gone or cannot be known."""
    try:
        words = Path(f"/proc/{pid}/stat").read_text(encoding="utf8").rpartition(")")[2].split()
    except OSError:
        return -math.inf
    return (int(words[11]) + int(words[12])) / _TICK


@contextmanager
def _machine(alone: bool) -> Iterator[None]:
    """Share this machine with other runs of studies, or have it alone."""
    with (Path(tempfile.gettempdir()) / f"signorini-study-{os.getuid()}.lock").open("w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX if alone else fcntl.LOCK_SH)
        yield


def _environment() -> dict[str, str]:
    """This environment with one thread a process, and without what makes a process a rank of an MPI run."""
    kept = {name: value for name, value in os.environ.items() if not name.startswith(LAUNCHER)}
    return {**kept, **dict.fromkeys(THREADS, "1")}
