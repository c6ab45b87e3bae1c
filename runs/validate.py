"""The command `validate`: solve cases of the catalogue and hold them against their known answers."""

from __future__ import annotations

import argparse
import json
import math
import sys
from pathlib import Path
from typing import Any

from mpi4py import MPI
from pydantic import ValidationError
from tqdm import tqdm

import validation.cases  # noqa: F401  enters the cases into the catalogue
from contact.scene.schema import first_error
from contact.solvers.problem import ContactNotConvergedError, InfeasibleError
from validation.case import CASES, Case, Parameter, Quantity, Run, fitted_rate, plain, quantity_entry


def command(arguments: argparse.Namespace) -> int:
    """Run the cases; 1 where a quantity is outside its tolerance, 3 where a method does not converge."""
    comm = MPI.COMM_WORLD
    names = arguments.cases or list(CASES)
    for name in names:
        if name not in CASES:
            raise ValueError(f"case {name!r}: unknown, must be one of {', '.join(CASES)}")
    if arguments.list:
        _list(names, comm)
        return 0
    changes = dict(change(text) for text in arguments.changes)
    runs = [run for name in names for run in plan(CASES[name], comm, changes, arguments)]
    folder = Path(arguments.output) if arguments.output else None
    if folder:
        folder.mkdir(parents=True, exist_ok=True)
    reports: list[dict[str, Any]] = []
    bar = tqdm(runs, unit="case", leave=False, disable=comm.rank > 0 or not sys.stderr.isatty())
    for run in bar:
        bar.set_description(run.case.name)
        report = solve(run)
        history = [r for r in reports if (r["case"], r["parameters"]) == (report["case"], report["parameters"])]
        following = runs[runs.index(run) + 1] if run is not runs[-1] else None
        last = following is None or (following.case, following.parameters) != (run.case, run.parameters)
        if last and "error" not in report:
            _add_rates(run, [*history, report])
        reports.append(report)
        if comm.rank == 0:
            bar.clear()
            print(_json(report) if arguments.json else text_of(report), flush=True)
    if folder and comm.rank == 0:
        (folder / "validate.jsonl").write_text("".join(_json(r) + "\n" for r in reports), encoding="utf8")
    failed = [r["case"] for r in reports if not r["passed"]]
    if comm.rank == 0 and not arguments.json:
        rest = f"; not: {', '.join(failed)}" if failed else ""
        print(f"{len(reports) - len(failed)} of {len(reports)} passed{rest}")
    if any("error" in r for r in reports):
        return 3
    return 1 if failed else 0


def plan(case: Case, comm: Any, changes: dict[str, Parameter], arguments: argparse.Namespace) -> list[Run]:
    """The runs of a case: its default levels, or the one that the arguments ask for."""
    order = arguments.order or case.orders[-1]
    if order not in case.orders:
        raise ValueError(f"{case.name}: order = {order}: must be one of {', '.join(map(str, case.orders))}")
    if arguments.h is not None and not 0 < arguments.h < math.inf:
        raise ValueError(f"--h {arguments.h}: must be a positive number")
    if arguments.n is not None and (case.n_to_h is None or arguments.n < 3):
        raise ValueError(f"--n {arguments.n}: must be at least 3, and {case.name} on a grid of points; else use --h")
    method = arguments.method or case.method
    runs: list[Run] = []
    for variant in [changes] if changes else case.variants:
        parameters = case.configure(variant)
        sizes = case.sizes(parameters)
        if arguments.h is not None:
            sizes = (arguments.h,)
        elif arguments.n is not None and case.n_to_h is not None:
            sizes = (case.n_to_h(arguments.n),)
        runs.extend(Run(case, comm, parameters, h, order, method) for h in sizes)
    return runs


def solve(run: Run) -> dict[str, Any]:
    """The report of a run; one whose method fails says so under ``error``."""
    try:
        return run.report(run.case.solve(run))
    except (ContactNotConvergedError, InfeasibleError) as error:
        return {
            "case": run.case.name,
            "parameters": run.parameters,
            "method": run.method,
            "order": run.order,
            "h": run.h,
            "error": f"{type(error).__name__}: {error}",
            "passed": False,
        }
    except ValidationError as error:
        raise ValueError(f"{run.case.name}: {first_error(error)}") from None
    except ValueError as error:
        raise ValueError(f"{run.case.name}: {str(error).removeprefix(f'{run.case.name}: ')}") from None
    finally:
        run.close()


def _add_rates(run: Run, reports: list[dict[str, Any]]) -> None:
    """The fitted rates over the levels, as quantities of the last report."""
    last = reports[-1]
    for name, claims in run.case.claims(run.parameters).items():
        if len(reports) < 3 or run.order not in claims:
            continue
        rate, tolerance = claims[run.order]
        computed = fitted_rate([r["h"] for r in reports], [r["quantities"][name]["error"] for r in reports])
        quantity = Quantity(f"rate of {name}", computed, rate, tolerance / rate)
        last["quantities"][quantity.name] = quantity_entry(quantity)
        last["passed"] = last["passed"] and quantity.passed


def change(text: str) -> tuple[str, Parameter]:
    """A parameter and its value from KEY=VALUE; ValueError where it is none."""
    key, equals, value = text.partition("=")
    if not equals:
        raise ValueError(f"--set {text!r}: must be KEY=VALUE")
    try:
        return key, float(value)
    except ValueError:
        return key, value


def _list(names: list[str], comm: Any) -> None:
    if comm.rank:
        return
    for name in names:
        case = CASES[name]
        print(f"{name}: {case.summary}")
        print(
            "   ", " ".join(f"{k}={v:.6g}" if isinstance(v, float) else f"{k}={v}" for k, v in case.parameters.items())
        )


def _json(report: dict[str, Any]) -> str:
    """A report on one line."""
    return json.dumps(plain(report))


def text_of(report: dict[str, Any]) -> str:
    """A report for people."""
    case = CASES[report["case"]]
    changed = "".join(f" {k}={v}" for k, v in report["parameters"].items() if v != case.parameters[k])
    head = f"{report['case']}{changed}  h={report['h']:.4g}  order={report['order']}  {report['method']}"
    if "error" in report:
        return f"{head}  {report['error']}"
    c = report["certificate"]
    lines = [
        f"{head}  {report['dofs']} unknowns, {report['contacts']} contacts, {report['iterations']} iterations, "
        f"{report['time']['total']:.2f} s; "
        f"complementarity {c['complementarity']:.0e}, equilibrium {c['equilibrium']:.0e}"
    ]
    for name, q in report["quantities"].items():
        verdict = "ok" if q["passed"] else "OUTSIDE"
        lines.append(
            f"    {name:<22} {q['computed']:>14.8g}  exact {q['exact']:>14.8g}  "
            f"error {q['error']:.1e}  (at most {q['tolerance']:.1e})  {verdict}"
        )
    return "\n".join(lines)
