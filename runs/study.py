"""The command `study`: error against run time of cases of the catalogue, and a page about it."""

from __future__ import annotations

import argparse
import math
import random
import sys
from concurrent.futures import Executor, Future, wait
from pathlib import Path
from typing import Any

from mpi4py import MPI
from tqdm import tqdm

import validation.cases  # noqa: F401  enters the cases into the catalogue
from contact.ranks import on_root
from contact.solvers import METHODS
from runs.reports.machine import machine, versions
from runs.validate import change
from validation.case import CASES
from validation.study import pool, tables
from validation.study.journal import Journal, difference
from validation.study.plan import Chain, Settings, chains, treatments

SCENES = ("tube", "coil", "guidewire")
PROBLEMS = 8  # recorded from each scene
SPARE = 60.0  # seconds beyond those for recording, until a scene is given up
INTERRUPTED = 130


def command(arguments: argparse.Namespace, petsc_options: list[str]) -> int:
    """Run or go on with a study.

    1 where a claimed rate is missed, 3 where a case's own method did not converge; that another method fails is a
    finding of the study. Collective.
    """
    comm, settings = MPI.COMM_WORLD, _settings(arguments, tuple(petsc_options))
    planned = chains(settings)
    folder = Path(arguments.output)
    meshes = {chain.label: list(chain.sizes) for chain in planned}
    head = {"settings": {**settings.as_dict(), "meshes": meshes}, "machine": machine(), "versions": versions()}
    head = comm.bcast(on_root(comm, lambda: _begin(folder, head, settings, planned)))
    code = 0
    with pool.executor(arguments.jobs) as shared:
        if shared is not None:
            code = _study(shared, settings, planned, folder, comm.size == 1 and arguments.jobs == 1)
    code = comm.bcast(code)
    if comm.rank == 0 and code != INTERRUPTED:
        code = _report(folder, head, planned, arguments.json)
    return int(comm.bcast(code))


def _settings(arguments: argparse.Namespace, options: tuple[str, ...]) -> Settings:
    """The settings that the arguments ask for; ValueError where one is not allowed."""
    for name in arguments.cases:
        if name not in CASES:
            raise ValueError(f"case {name!r}: unknown, must be one of {', '.join(CASES)}")
    given = {"cases": tuple(dict.fromkeys(arguments.cases)), "levels": arguments.levels, "seed": arguments.seed}
    if arguments.methods is not None:
        names = tuple(dict.fromkeys(arguments.methods.split(",")))
        for name in names:
            if name not in METHODS:
                raise ValueError(f"--methods {name!r}: unknown, must be one of {', '.join(METHODS)}")
        given["methods"] = names
    for name, value in (("levels", arguments.levels), ("jobs", arguments.jobs), ("repeat", arguments.repeat)):
        if value < 1:
            raise ValueError(f"--{name} {value}: must be at least 1")
    if not 0 < arguments.limit < math.inf:
        raise ValueError(f"--limit {arguments.limit}: must be a positive number")
    if not 0 <= arguments.record < math.inf:
        raise ValueError(f"--record {arguments.record}: must be 0 or a positive number")
    if arguments.record:
        given |= {"scenes": SCENES, "recording": arguments.record}
    changes = tuple(change(text) for text in arguments.changes)
    return Settings(repeats=arguments.repeat, limit=arguments.limit, changes=changes, options=options, **given)


def _begin(folder: Path, head: dict[str, Any], settings: Settings, planned: list[Chain]) -> dict[str, Any]:
    """Make the folder, or make sure that it holds the same study; under what that was begun.

    A study goes on only on the machine and with the versions that it was begun with; one that is complete can be
    looked at with others.
    """
    if folder.exists() and not folder.is_dir():
        raise ValueError(f"-o {folder}: is a file, must be a folder")
    journal = _journal(folder)
    if folder.is_dir() and any(folder.iterdir()) and not journal.path.exists():
        raise ValueError(f"-o {folder}: is a folder with other files, must be new, empty or a study's")
    folder.mkdir(parents=True, exist_ok=True)
    old = journal.begin(head)
    for part in ("machine", "versions"):
        other = difference(old[part], head[part])
        if other and not _complete(journal, settings, planned):
            raise ValueError(f"{folder}: holds a study begun with {other}; name another folder with -o")
    return old


def _complete(journal: Journal, settings: Settings, planned: list[Chain]) -> bool:
    """Whether nothing of a study is missing."""
    finished = {(line["problems_of"], line.get("method")) for line in journal.lines() if "finished" in line}
    wanted = {(scene, method) for scene in settings.scenes for method in (None, *treatments(settings.methods))}
    return wanted <= finished and not any(a or b for a, b in _missing(journal, planned).values())


def _journal(folder: Path) -> Journal:
    return Journal(folder / "runs.jsonl")


def _missing(journal: Journal, planned: list[Chain]) -> dict[str, tuple[list[int], list[int]]]:
    """For each chain's key the levels without an answer, and those solved that were not timed alone."""
    answered: set[tuple[str, int]] = set()
    solved, alone = set(answered), set(answered)
    for line in journal.lines():
        if "chain" in line:
            place = line["chain"], line["level"]
            answered.add(place)
            if line["outcome"] == "solved":
                (alone if line["alone"] else solved).add(place)
    found = {}
    for chain in planned:
        levels = range(len(chain.sizes))
        unanswered = [level for level in levels if (chain.key, level) not in answered]
        found[chain.key] = unanswered, [level for level in levels if (chain.key, level) in solved - alone]
    return found


def _study(shared: Executor, settings: Settings, planned: list[Chain], folder: Path, single: bool) -> int:
    """Run what is missing."""
    study = _Study(shared, settings, folder)
    try:
        if single:
            study.levels("runs", planned, 0, alone=True)
        else:
            study.levels("answers", planned, 0, alone=False)
        study.levels("timing", planned, 1, alone=True)
        study.record()
        study.solve()
    except KeyboardInterrupt:
        pool.stop()
        shared.shutdown(wait=True, cancel_futures=True)
        print("signorini: interrupted; the same command goes on", file=sys.stderr)
        return INTERRUPTED
    return 0


class _Study:
    """The parts of a study, each shared by the executor's processes and entered into the journal as it is finished."""

    def __init__(self, shared: Executor, settings: Settings, folder: Path) -> None:
        self._shared, self._settings, self._folder = shared, settings, folder
        self._journal = _journal(folder)
        self._path = str(self._journal.path.resolve())
        # Chains in a random order: a machine that slows down does so for no method or case in particular.
        self._random = random.Random(settings.seed)

    def levels(self, what: str, planned: list[Chain], which: int, alone: bool) -> None:
        """Run the levels that are missing: without an answer (0), or not timed alone (1)."""
        levels = {key: missing[which] for key, missing in _missing(self._journal, planned).items()}
        todo = [chain for chain in planned if levels[chain.key]]
        self._random.shuffle(todo)
        tasks = [(pool.run_chain, self._path, c, levels[c.key], self._settings, alone) for c in todo]
        self._share(what, tasks, sum(map(len, levels.values())))

    def record(self) -> None:
        """Record the problems of the scenes."""
        limit, tasks = self._settings.recording + SPARE, []
        for scene in self._settings.scenes:
            name = {"problems_of": scene}
            if not self._finished(name):
                path = Path(__file__).parent / f"{scene}.toml"
                request: dict[str, Any] = {
                    "scene": str(path),
                    "files": str(self._problems(scene)),
                    "problems": PROBLEMS,
                }
                request |= {"seconds": self._settings.recording, "petsc": self._settings.options}
                tasks.append((pool.run_request, self._path, name, request, limit, False))
        self._share("scenes", tasks, 2 * len(tasks))

    def solve(self) -> None:
        """Solve the recorded problems in every way."""
        tasks, count = [], 0
        for scene in self._settings.scenes:
            files = sorted(str(path) for path in self._problems(scene).glob("step_*.npz"))
            for method, options in treatments(self._settings.methods).items():
                name = {"problems_of": scene, "method": method}
                if files and not self._finished(name):
                    request: dict[str, Any] = {"files": files, "method": method, "options": options}
                    request |= {"repeats": self._settings.repeats, "petsc": self._settings.options}
                    tasks.append((pool.run_request, self._path, name, request, self._settings.limit, True))
                    count += len(files) + 1
        self._random.shuffle(tasks)
        self._share("problems", tasks, count)

    def _problems(self, scene: str) -> Path:
        return self._folder.resolve() / "problems" / scene

    def _finished(self, name: dict[str, Any]) -> bool:
        return any({**name, "finished": True}.items() <= line.items() and ("method" in name) == ("method" in line)
                   for line in self._journal.lines())  # fmt: skip

    def _share(self, what: str, tasks: list[tuple[Any, ...]], lines: int) -> None:
        """Run the tasks, of which so many lines in the journal are expected."""
        if not tasks:
            return
        before = len(self._journal.lines())
        pending: set[Future[None]] = {self._shared.submit(*task) for task in tasks}
        with tqdm(total=lines, desc=what, unit="run", leave=False, disable=not sys.stderr.isatty()) as bar:
            while pending:
                done, pending = wait(pending, timeout=0.5)
                for future in done:
                    future.result()
                bar.update(len(self._journal.lines()) - before - bar.n)


def _report(folder: Path, head: dict[str, Any], planned: list[Chain], as_json: bool) -> int:
    """Write the tables, the pictures and the page, and print what the study found."""
    from runs.reports.study_page import write_page

    found = tables.tables(planned, _journal(folder).lines())
    tables.write(folder, head, found)
    write_page(folder, head, found)
    if as_json:
        print((folder / "study.json").read_text(encoding="utf8"))
    else:
        for line in summary(found):
            print(line)
        print(folder / "study.html")
    return verdict(planned, found)


def verdict(planned: list[Chain], found: tables.Tables) -> int:
    """The exit code: 3 where a case's own method did not converge, 1 where a claimed rate is missed, else 0."""
    own = {chain.label: CASES[chain.case].method for chain in planned}
    lost = {"not converged", "infeasible", "failed"}
    if any(run["outcome"] in lost and run["method"] == own[run["case"]] for run in found["runs"]):
        return 3
    return 1 if any(rate["passed"] is False for rate in found["rates"]) else 0


def summary(found: tables.Tables) -> list[str]:
    """What each case reaches, a line each quantity, and the claimed rates that were missed."""
    lines = []
    for near, far in zip(found["reached"][::2], found["reached"][1::2], strict=True):
        words = [_reached(near), _reached(far)]
        lines.append(f"{near['case']:<28} {near['quantity']:<16} {words[0]:<44} {words[1]}")
    for rate in found["rates"]:
        if rate["passed"] is False:
            lines.append(
                f"{rate['case']}: rate of {rate['quantity']}, order {rate['order']}: {rate['rate']:.3g}, "
                f"claimed {rate['theory']:g} ± {rate['tolerance']:g}"
            )
    return lines


def _reached(row: tables.Row) -> str:
    if row["error"] is None:
        return f"nothing in {row['within']:g} s"
    return f"{row['error']:.1e} in {row['within']:g} s ({row['seconds']:.2g} s, {row['method']}, order {row['order']})"
