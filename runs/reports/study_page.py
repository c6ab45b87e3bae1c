"""The page about a study, for a reader who has only the page."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterable
from pathlib import Path
from statistics import median
from typing import Any

from runs.reports.page import Cell, Entry, Page
from runs.reports.study_pictures import case_figure, cases
from validation.case import CASES
from validation.study.plan import METHODS, treatments
from validation.study.tables import SECONDS, Row, Tables

PETSC = {"vi-rsls", "vi-ssls", "tao", "vi-primal"}
SOLVER = {
    "status": "the active-set method of this program, ratio-tested, safeguarded on singular W",
    "gauss-seidel": "projected Gauss–Seidel on W",
    "lemke": "Lemke's pivoting on W",
    "kkt": "the saddle-point system on the rows that `status` finds",
    "vi-rsls": "PETSc SNES `vinewtonrsls` on λ ≥ 0",
    "vi-ssls": "PETSc SNES `vinewtonssls` on λ ≥ 0",
    "tao": "PETSc TAO `bnls` on ½ λᵀWλ + qᵀλ, λ ≥ 0",
    "vi-primal": "PETSc SNES `vinewtonrsls` on the displacements, where contacts are bounds on single unknowns",
}
# Reasons of SNES and TAO for stopping.
REASONS = {
    "-1": "function domain", "-2": "iterations or evaluations used up", "-3": "linear solve failed",
    "-4": "not a number", "-5": "iterations or evaluations used up", "-6": "line search failed",
    "-7": "inner solve failed", "-8": "local minimum of the merit function", "-9": "diverged",
}  # fmt: skip
DPI = 100
BENT = -1e-9  # an eigenvalue of W below it, of 1 on the diagonal, is not one of round-off


def write_page(folder: Path, facts: dict[str, Any], found: Tables) -> None:
    """Write study.html and the pictures of the cases into the folder.

    Raises
    ------
    ImportError
        where the library that draws is missing.
    """
    names = list(cases(found))
    page = Page(
        "Error against run time",
        f"What signorini reaches on {len(names)} contact problems with known answers, in what time, by which method, "
        "and how PETSc's solvers for variational inequalities compare.",
    )
    _summary(page, found, names)
    _conditions(page, facts, found)
    for name in names:
        page.section(name)
        page.text(CASES[name.split()[0]].summary)
        if any(found["runs"][q["run"]]["case"] == name for q in found["quantities"]):
            figure = case_figure(found, name)
            figure.savefig(folder / f"study-{name.replace(' ', '-').replace('=', '-')}.png", dpi=DPI)
            page.picture(
                figure,
                "Error over the time of a run and over its unknowns. Filled and drawn through: second-order elements; "
                "hollow and dashed: first-order. Horizontal bars: least and most of the repeats. Dotted: slopes.",
                f"Two log-log diagrams for each quantity of {name}",
            )
        _case(page, found, name)
    _comparison(page, found, names)
    page.section("Every run")
    page.text(
        "Medians of the repeats, seconds of one core. `memory` is the peak of the process that made the run, with the "
        "interpreter and its libraries. All digits, the least and the most of the repeats and every quantity's "
        "computed and exact value, and why a run has no answer, are in `study.json` and `study.h5` beside this page."
    )
    for name in names:
        _runs(page, found, name)
    page.write(folder / "study.html")


def _summary(page: Page, found: Tables, names: list[str]) -> None:
    page.section("Summary")
    page.text(
        "The error that is reached within 1 s and within 10 s on one core, from the scene to the certified answer, by "
        "the best method and element order; errors are relative to the exact value, or absolute where that is 0. An "
        "error counts only if all finer meshes of the study keep it: a zero crossed by luck is no accuracy."
    )
    rows: list[list[Entry]] = []
    for near, far in zip(found["reached"][::2], found["reached"][1::2], strict=True):
        finest = _finest(found, near["case"])
        rows.append([near["case"], near["quantity"], *_reached(near), *_reached(far), _seconds(finest)])
    page.table(
        ("case", "quantity", "error in 1 s", "by", "error in 10 s", "by", "finest run [s]"), rows,
        "Where the finest run takes less than the time, its error is what is shown: the study holds no finer one.",
    )  # fmt: skip
    page.heading("Which method wins where")
    page.points([*(_winner(found, name) for name in names), *_fastest(found)])
    claimed = [rate for rate in found["rates"] if rate["passed"] is not None]
    missed = [rate for rate in claimed if not rate["passed"]]
    if claimed:
        page.heading("Rates")
        verdict = f"{len(claimed) - len(missed)} of {len(claimed)} rates that theory gives are met."
        page.text(verdict + "".join(f" Missed: {r['case']}, {r['quantity']}, order {r['order']}." for r in missed))
    lies = [run for run in (*found["runs"], *found["problems"]) if run["claimed"]]
    page.text(
        f"Answers that PETSc's solvers called solved and their recomputed residual denies: {len(lies)}; the comparison "
        "below names them." if lies else "No solver called an answer solved that its recomputed residual denies."
    )  # fmt: skip


def _finest(found: Tables, case: str) -> float | None:
    """The seconds of the fastest method on the finest mesh."""
    solved = [r for r in found["runs"] if r["case"] == case and r["total"] is not None]
    if not solved:
        return None
    order = max(r["order"] for r in solved)
    level = max(r["level"] for r in solved if r["order"] == order)
    return float(min(r["total"] for r in solved if (r["order"], r["level"]) == (order, level)))


def _reached(row: Row) -> list[Entry]:
    if row["error"] is None:
        return [None, "–"]
    return [f"{row['error']:.1e}", f"{row['method']}, order {row['order']}, h = {row['h']:.3g}, {row['seconds']:.2g} s"]


def _winner(found: Tables, case: str) -> str:
    """Who is fastest on the finest mesh that more than one method has solved."""
    solved = [r for r in found["runs"] if r["case"] == case and r["total"] is not None]
    places: dict[tuple[int, int], list[Row]] = defaultdict(list)
    for run in solved:
        places[run["order"], run["level"]].append(run)
    shared = [place for place, runs in places.items() if len(runs) > 1]
    if not shared:
        return f"{case}: {'solved by ' + solved[0]['method'] + ' alone' if solved else 'no method solved it'}."
    order, level = max(shared)
    runs = sorted(places[order, level], key=lambda r: r["total"])
    best = runs[0]
    equal = [r["method"] for r in runs[1:] if r["least"] <= best["most"]]
    rest = [f"{r['method']} {_ratio(r['total'] / best['total'])}×" for r in runs[1:] if r["method"] not in equal]
    tie = f" (not told apart from {', '.join(equal)})" if equal else ""
    behind = f"; {', '.join(rest)} as long" if rest else ""
    size = f"order {order}, {best['unknowns']} unknowns, {best['contacts']} contacts"
    return f"{case}, {size}: {best['method']} with {best['total']:.2g} s{tie}{behind}."


def _ratio(value: float) -> str:
    return f"{value:.2g}" if value < 100 else f"{value:.0f}"


def _fastest(found: Tables) -> list[str]:
    """For each recorded scene the methods that solve every convex problem, and their median times from a cold start."""
    words = []
    for scene in dict.fromkeys(p["scene"] for p in found["problems"]):
        mine = [p for p in _convex(found, scene) if not p["method"].endswith("warm")]
        whole = {p["method"] for p in mine} - {p["method"] for p in mine if p["outcome"] != "solved"}
        times = sorted((median(p["seconds"] for p in mine if p["method"] == method), method) for method in whole)
        listed = ", ".join(f"{method} {1e3 * seconds:.2g} ms" for seconds, method in times)
        words.append(f"Devices, {scene}, by those that solve all problems: {listed or 'none'} (median).")
    return words


def _convex(found: Tables, scene: str) -> list[Row]:
    """The problems of a scene but those whose W has a negative eigenvalue."""
    every = [p for p in found["problems"] if p["scene"] == scene]
    return [p for p in every if p["least_eigenvalue"] is None or p["least_eigenvalue"] >= BENT]


def _conditions(page: Page, facts: dict[str, Any], found: Tables) -> None:
    settings, known = facts["settings"], facts["versions"]
    page.section("What was run, and how")
    rest = "".join(f" --set {key}={value}" for key, value in settings["changes"])
    rest += " -- " + " ".join(settings["options"]) if "options" in settings else ""
    page.text(
        f"`signorini study {' '.join(settings['cases'])} --methods {','.join(settings['methods'])} "
        f"--levels {settings['levels']} --repeat {settings['repeats']} --limit {settings['limit']:g} "
        f"--record {settings['recording'] if settings['scenes'] else 0:g} --seed {settings['seed']}{rest}`"
    )
    page.facts({**facts["machine"], **known})
    page.text(
        "Each case is solved on a sequence of meshes with every element order that it allows and by every method. "
        "Every accepted answer carries a certificate, residuals recomputed from its forces and distances; one that "
        "misses a tolerance is not an answer and has no point in the pictures.",
        "A timed run is alone on its machine: it holds a lock that the study's other runs must share, so that however "
        "many processes take part (`--jobs`, or ranks under MPI) no other run of a study goes on beside it; runs of "
        "which only the answer counts share the machine. Each sequence of meshes has a process of its own with one "
        "thread, which first solves the coarsest mesh untimed, so that kernels are compiled. A run is repeated up to "
        f"{settings['repeats']} times, fewer once its repeats have used a quarter of the limit of "
        f"{settings['limit']:g} s. Times are of the process's CPU and are the median of the repeats, from the scene "
        "to the certified answer, meshes included; what the comparison with the exact answer takes is not in them. "
        + _idle(found),
        f"The order of the sequences is random, from the seed {settings['seed']}; nothing else is random.",
    )
    page.table(("method", "what it is"), [(f"`{m}`", SOLVER.get(m, "")) for m in settings["methods"]])


def _idle(found: Tables) -> str:
    """How much longer runs took on the wall than on the CPU: whether the machine was idle."""
    long = [r["wall_over_cpu"] for r in found["runs"] if r["wall_over_cpu"] is not None and r["total"] > 0.1]
    if not long:
        return ""
    ratio = median(long)
    busy = " The machine had other work to do: caches and memory were shared." if ratio > 1.1 else ""
    return (
        f"On the wall, runs of more than .1 s took {ratio:.2f} times their CPU time (median, {len(long)} runs).{busy}"
    )


def _case(page: Page, found: Tables, case: str) -> None:
    rates: list[list[Entry]] = []
    for r in found["rates"]:
        if r["case"] == case:
            verdict = {True: Cell("met", "good"), False: Cell("missed", "bad"), None: Cell("–", "quiet")}[r["passed"]]
            theory = None if r["theory"] is None else f"{r['theory']:g} ± {r['tolerance']:g}"
            rates.append([r["quantity"], r["order"], r["levels"], r["rate"], theory, verdict, r["error_over_seconds"]])
    page.table(
        ("quantity", "order", "meshes", "rate in h", "theory", "", "slope over seconds"), rates,
        "Rates by least squares over the meshes whose error is above the certificate's floor of 1e-8.",
    )  # fmt: skip
    ways: dict[str, list[Entry]] = {}
    for row in found["cheapest"]:
        if row["case"] == case:
            way = "–"
            if row["error"] is not None:
                way = f"{row['seconds']:.2g} s: {row['method']}, order {row['order']}, h = {row['h']:.3g}"
            ways.setdefault(row["quantity"], [row["quantity"]]).append(way)
    targets = dict.fromkeys(row["target"] for row in found["cheapest"])
    page.table(("quantity", *(f"{t:.0e}" for t in targets)), ways.values(), "The cheapest way to an error.")


def _comparison(page: Page, found: Tables, names: Iterable[str]) -> None:
    page.section("The comparison with PETSc's variational-inequality solvers")
    page.text(
        "PETSc's solvers get the same contact problem as the others, its diagonal and its largest gap scaled to 1, "
        "since their tolerances are absolute, and tolerances of 1e-12. Whatever they report, the residual "
        "max|min(Wᵢᵢ λᵢ, δᵢ)|/ℓ is recomputed from their λ: above 1e-9 the answer is refused. `vi-primal` needs "
        "contacts that are bounds on single unknowns and refuses other problems. Iterations are as each method counts."
    )
    page.heading("On the cases")
    rows: list[list[Entry]] = []
    for name in names:
        runs = [r for r in found["runs"] if r["case"] == name]
        for method in dict.fromkeys(r["method"] for r in runs):
            rows.append([name, method, *_on_case([r for r in runs if r["method"] == method])])
    page.table(
        ("case", "method", "certified", "unknowns", "contacts", "iterations", "method [s]", "columns of W [s]",
         "whole run [s]", "where it stops"), rows,
        "How many of the meshes and orders end certified; sizes, iterations and times are of the finest of those.",
    )  # fmt: skip
    if found["problems"]:
        _recorded(page, found)
    lies = [(f"{r['case']}, order {r['order']}, h = {r['h']:.3g}", r) for r in found["runs"] if r["claimed"]]
    lies += [(f"{r['scene']}, step {r['step']}", r) for r in found["problems"] if r["claimed"]]
    page.heading("Claims that the certificate denies")
    if lies:
        page.points(
            f"{where}: `{r['method']}` claims convergence ({r['reason']}); its residual is {r['residual']:.1e}, "
            "allowed are 1e-9."
            for where, r in lies
        )
    else:
        page.text("None in this study.")


def _on_case(runs: list[Row]) -> list[Entry]:
    solved = [r for r in runs if r["outcome"] == "solved"]
    share = f"{len(solved)} of {len(runs)}"
    mark = "good" if len(solved) == len(runs) else "fair" if solved else "bad"
    why = _failures(r for r in runs if r["outcome"] not in ("solved", "not tried"))
    last = max(solved, key=lambda r: (r["order"], r["level"]), default=dict.fromkeys(runs[0]))
    times: list[Entry] = [_seconds(last[name]) for name in ("solve", "delassus", "total")]
    entries: list[Entry] = [last["unknowns"], last["contacts"], last["iterations"], *times]
    return [Cell(share, mark), *entries, why]  # type: ignore[arg-type]


def _failures(runs: Iterable[Row]) -> str:
    """Why some runs have no answer, each reason once, how often, and the residuals that were left."""
    found: dict[str, list[Row]] = defaultdict(list)
    for run in runs:
        found[_why(run)].append(run)
    words = []
    for why, those in found.items():
        left = [r["residual"] for r in those if r["residual"] is not None]
        times = f"{len(those)}× " if len(those) > 1 else ""
        spread = f"{min(left):.0e}" + (f" to {max(left):.0e}" if max(left) > min(left) else "") if left else ""
        words.append(f"{times}{why}{f', residual {spread}' if left else ''}")
    return "; ".join(words)


def _why(run: Row) -> str:
    """The outcome and the reason, PETSc's in words."""
    if not run["reason"]:
        return str(run["outcome"])
    solver, _, number = run["reason"].partition(" reason ")
    if run["claimed"]:
        return f"{solver} claims convergence"
    reason = f"{solver}: {REASONS[number]}" if number in REASONS else run["reason"]
    return reason if run["outcome"] in ("failed", "not converged") else f"{run['outcome']}: {reason}"


def _recorded(page: Page, found: Tables) -> None:
    page.heading("On contact problems of devices in vessels")
    page.text(
        "Recorded from the first part of scenes that the program ships with, each the first problem of a step. `warm` "
        "starts from the forces that the step started with, as the program does; the others start from 0. "
        "`line search`: of PETSc's SNES, in place of its default."
    )
    order = list(treatments(METHODS))
    for scene in dict.fromkeys(p["scene"] for p in found["problems"]):
        mine = _convex(found, scene)
        bent = {p["step"] for p in found["problems"] if p["scene"] == scene} - {p["step"] for p in mine}
        known = [p for p in mine if p["active"] is not None]
        rows: list[list[Entry]] = []
        names = {p["method"] for p in mine}
        for method in sorted(names, key=lambda name: (order.index(name) if name in order else len(order), name)):
            its = [p for p in mine if p["method"] == method]
            solved = [p for p in its if p["outcome"] == "solved"]
            mark = "good" if len(solved) == len(its) else "fair" if solved else "bad"
            row: list[Entry] = [method, Cell(f"{len(solved)} of {len(its)}", mark)]  # type: ignore[arg-type]
            if solved:
                times = [1e3 * p["seconds"] for p in solved]
                row += [f"{median(times):.3g}", f"{max(times):.3g}", f"{median(p['iterations'] for p in solved):g}"]
                row.append(f"{max(p['residual'] for p in solved):.0e}")
            else:
                row += [None, None, None, None]
            rows.append([*row, _failures(p for p in its if p["outcome"] != "solved")])
        conditions = [p["condition"] for p in known if p["condition"]]
        kappa = f", condition of the active block {min(conditions):.0e} to {max(conditions):.0e}" if conditions else ""
        sizes = [p["candidates"] for p in mine if p["candidates"]]
        active = [p["active"] for p in known]
        spread = f"{min(active)} to {max(active)}" if active else "unknown"
        steps = {p["step"] for p in mine if p["step"] >= 0}
        page.table(
            ("method", "certified", "median [ms]", "slowest [ms]", "iterations", "residual", "why not"), rows,
            f"`runs/{scene}.toml`: {len(steps)} problems; candidates {min(sizes, default=0)} to "
            f"{max(sizes, default=0)}, active {spread}{kappa}.",
        )  # fmt: skip
        if bent:
            steps_bent = ", ".join(map(str, sorted(bent)))
            page.text(
                f"Left out: step {steps_bent}, whose W has a negative eigenvalue, from the curvature of a wall under a "
                "compressed wire. No method promises anything there; where the step's own finds nothing, the program "
                "divides the step."
            )


def _runs(page: Page, found: Tables, case: str) -> None:
    errors: dict[int, dict[str, float]] = defaultdict(dict)
    for q in found["quantities"]:
        errors[q["run"]][q["quantity"]] = q["error"]
    mine = [(i, r) for i, r in enumerate(found["runs"]) if r["case"] == case]
    names = list(dict.fromkeys(name for i, _ in mine for name in errors[i]))
    head = ["order", "h", "method", "unknowns", *names, *SECONDS, "spread", "MiB", "iterations", "certificate"]
    rows = []
    for i, r in mine:
        if r["outcome"] != "solved":
            said = Cell(r["outcome"], "quiet" if r["outcome"] == "not tried" else "bad")
            rows.append([r["order"], f"{r['h']:.3g}", r["method"], said, *[None] * (len(head) - 4)])
            continue
        worst = max(r[k] for k in ("complementarity", "equilibrium", "surface_error", "penetration"))
        spread = None if r["most"] is None else f"{r['least']:.2g}–{r['most']:.2g}"
        rows.append([
            r["order"], f"{r['h']:.3g}", r["method"], r["unknowns"],
            *(None if errors[i].get(n) is None else f"{errors[i][n]:.1e}" for n in names),
            *(_seconds(r[p]) for p in SECONDS), spread, None if r["memory"] is None else f"{r['memory']:.0f}",
            r["iterations"], f"{worst:.0e}",
        ])  # fmt: skip
    page.table(head, rows, case)


def _seconds(value: float | None) -> Entry:
    return None if value is None else f"{value:.2g}"
