"""The command `stability`: the stiff and extreme set, random trials, and a page about them."""

from __future__ import annotations

import argparse
import json
import sys
from pathlib import Path
from typing import Any

from mpi4py import MPI
from tqdm import tqdm

from contact.ranks import on_root
from runs.reports.machine import machine, versions
from validation.case import plain
from validation.stability import campaign
from validation.stability.campaign import SWEEPS

TRIALS = 10_000


def command(arguments: argparse.Namespace) -> int:
    """Run the campaign; 1 on a wrong verdict, a refusal in a row of the extreme set, too many refusals. Collective."""
    comm = MPI.COMM_WORLD
    names = list(dict.fromkeys(arguments.sweeps)) or list(SWEEPS)
    for name in names:
        if name not in SWEEPS:
            raise ValueError(f"sweep {name!r}: unknown, must be one of {', '.join(SWEEPS)}")
    trials = arguments.trials if arguments.trials is not None else 0 if arguments.sweeps else TRIALS
    for key, value, least in (("seed", arguments.seed, 0), ("trials", trials, 0), ("jobs", arguments.jobs, 1)):
        if value < least:
            raise ValueError(f"--{key} {value}: must be at least {least}")
    if arguments.list:
        _list(names, comm)
        return 0
    folder = Path(arguments.output) if arguments.output else None
    if folder and folder.exists() and not folder.is_dir():
        raise ValueError(f"-o {folder}: is a file, must be a folder")
    wanted = campaign.tasks(names, arguments.seed, trials)
    bar = tqdm(unit="", leave=False, disable=comm.rank > 0 or not sys.stderr.isatty())
    bar.reset(sum(max(1, last - first) for _, _, first, last in wanted))
    found = campaign.run(wanted, arguments.jobs, lambda number: bar.update(number) and None, comm)
    bar.close()
    failed = campaign.failures(found)
    report = {
        "seed": arguments.seed,
        "machine": machine(),
        "versions": versions(),
        "summary": campaign.summary(found),
        "failures": failed,
        "sweeps": [_sweep(name, found["points"]) for name in names],
        "trials": found["trials"],
    }
    on_root(comm, lambda: _write(folder, report, arguments.json))
    return 1 if failed else 0


def _sweep(name: str, points: list[dict[str, Any]]) -> dict[str, Any]:
    sweep = SWEEPS[name]
    own = [{k: v for k, v in point.items() if k != "sweep"} for point in points if point["sweep"] == name]
    return {"name": name, "summary": sweep.summary, "swept": sweep.swept, "row": sweep.row, "points": own}


def _write(folder: Path | None, report: dict[str, Any], as_json: bool) -> None:
    """Print the report, and write stability.json, stability.html and stability.png into the folder."""
    text = json.dumps(plain(report))
    if folder:
        from runs.reports.stability_page import write_page

        folder.mkdir(parents=True, exist_ok=True)
        (folder / "stability.json").write_text(text + "\n", encoding="utf8")
        write_page(folder, report)
    if as_json:
        print(text)
        return
    for sweep in report["sweeps"]:
        verdicts = [point["verdict"] for point in sweep["points"]]
        counts = ", ".join(f"{verdicts.count(v)} {v}" for v in ("right", "refused", "wrong") if v in verdicts)
        seconds = sum(point["seconds"] for point in sweep["points"])
        print(f"{sweep['name']:<26} {len(verdicts):>3} points: {counts}  {seconds:.1f} s")
        for point in sweep["points"]:
            if point["verdict"] != "right":
                print(f"    {point['value']:.6g}: {point['verdict']}: {point['reason']}")
    for part, counts in report["summary"].items():
        if counts["all"]:
            print(
                f"{counts['all']} {part}: {counts['right']} right, {counts['refused']} refused, "
                f"{counts['wrong']} wrong; {counts['feasible refused']} of {counts['feasible']} feasible refused; "
                f"{counts['seconds']:.0f} s of CPU"
            )
    for line in report["failures"]:
        print("not as it must be:", line)


def _list(names: list[str], comm: Any) -> None:
    if comm.rank == 0:
        for name in names:
            sweep = SWEEPS[name]
            print(f"{name}: {len(sweep.values)} points, {sweep.swept}\n    {sweep.summary}")
