"""The commands `run` and `explain`."""

from __future__ import annotations

import argparse
import sys
from importlib.metadata import version
from pathlib import Path
from typing import Any

from mpi4py import MPI
from petsc4py import PETSc
from tqdm import tqdm

from contact.loop import AcceptedStep, march
from contact.ranks import on_root
from contact.record import Record, RecordReader
from contact.record.output import Gatherer
from contact.scene.build import build
from contact.scene.explain import explain
from contact.scene.schema import Scene, read_scene
from runs.reports.machine import commit


def command(arguments: argparse.Namespace, petsc_options: list[str]) -> int:
    """Run or explain a scene."""
    path = Path(arguments.scene)
    changes = list(arguments.changes)
    if arguments.command == "explain":
        scene, _ = read_scene(path, changes)
        print(explain(scene))
        return 0
    if arguments.method:
        changes.append(f'solver.method="{arguments.method}"')
    scene, text = read_scene(path, changes)
    # The record keeps what was run: a resumed run must be of the same scene with the same changes.
    text += "".join(f"\n# --set {change}" for change in changes)
    target = Path(arguments.resume or arguments.output or path.with_suffix(".vtkhdf").name)
    _check_file("-o", target)
    if arguments.plot:
        _check_file("--plot", Path(arguments.plot), ".png")
    run = {"petsc_options": " ".join(petsc_options), "folder": str(path.parent.resolve())}
    try:
        _run(scene, path.parent, text, target, bool(arguments.resume), run)
    except ValueError as error:
        raise ValueError(f"{path}: {error}") from None
    if arguments.plot:
        from runs.plot import plot_record

        on_root(MPI.COMM_WORLD, lambda: plot_record(target, arguments.plot))
    return 0


def _check_file(argument: str, file: Path, suffix: str = "") -> None:
    """ValueError, before anything is computed, where `file` cannot be written."""
    if not file.parent.is_dir():
        raise ValueError(f"{argument} {file}: there is no folder {file.parent}")
    if file.is_dir() or suffix not in ("", file.suffix):
        raise ValueError(f"{argument} {file}: must be a file{suffix and f' *{suffix}'}")


def _run(scene: Scene, folder: Path, text: str, target: Path, resume: bool, run: dict[str, Any]) -> None:
    """Build, prepare and march; the record begins with its first step, when the input has proved good."""
    comm = MPI.COMM_WORLD
    system = build(scene, comm, folder)
    try:
        system.prepare()
        gather = Gatherer(system)
        first, start, record, begun = 0, None, None, False
        if resume:
            first, state = _checkpoint(target, text, comm)
            start = gather.restore(state) if first else None
        grid = gather.grid()
        unknowns = sum(body.space.size for body in system.bodies)
        facts = {**_facts(comm), **run, "unknowns": unknowns, "explain": explain(scene)}
        bar = tqdm(total=scene.time.steps, initial=first, unit="step", disable=comm.rank > 0 or not sys.stderr.isatty())

        def begin() -> Record:
            assert grid is not None
            return Record.resume(target) if resume else Record.create(target, grid, text, facts)

        def sink(accepted: AcceptedStep) -> None:
            nonlocal record, begun
            with system.clock("output"):
                row = gather.step(accepted)
                if not begun:
                    record, begun = on_root(comm, begin), True
                on_root(comm, lambda: record.append(row) if record and row else None)
            bar.update()

        try:
            march(system, scene, sink, first, start)
        finally:
            bar.close()
            if record is not None:
                record.close()
        if comm.rank == 0:
            print(target)
    finally:
        system.close()


def _checkpoint(target: Path, text: str, comm: Any) -> tuple[int, dict[str, Any] | None]:
    """The number of finished steps and the state after them (on rank 0); ValueError where the run cannot go on."""

    def read() -> tuple[int, dict[str, Any] | None]:
        with RecordReader(target) as old:
            if old.scene != text:
                raise ValueError(f"{target}: is the record of another scene")
            if old.count and not old.steps()["converged"][-1]:
                raise ValueError(f"{target}: its last step did not converge; nothing to go on from")
            return old.count, old.checkpoint() if old.count else None

    count, state = on_root(comm, read) or (0, None)
    return comm.bcast(count), state


def _facts(comm: Any) -> dict[str, Any]:
    """Versions, commit and ranks of this run."""
    return {
        "signorini": version("signorini"),
        "petsc": ".".join(str(n) for n in PETSc.Sys.getVersion()),
        "numpy": version("numpy"),
        "commit": commit(),
        "ranks": comm.size,
    }
