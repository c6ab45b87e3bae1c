"""The page about a stability campaign, for a reader who has only the page."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from runs.plot import DPI
from runs.reports.page import Cell, Mark, Page
from runs.reports.stability_pictures import curves, trials_figure, verdict_map

TOGETHER = 6  # sweeps in one picture of curves
MARKS: dict[str, Mark] = {"right": "good", "refused": "fair", "wrong": "bad"}


def write_page(folder: Path, report: dict[str, Any]) -> None:
    """Write stability.html and stability.png, the map of verdicts, into the folder.

    Raises
    ------
    ImportError
        where the library that draws is missing.
    """
    sweeps, trials = report["sweeps"], report["trials"]
    page = Page(
        "Stability",
        "What signorini makes of contact problems from one extreme to the other: right, refused with a reason, wrong.",
    )
    _summary(page, report)
    page.section("Verdicts")
    figure = verdict_map(sweeps)
    figure.savefig(folder / "stability.png", dpi=DPI)
    page.picture(figure, "Each row is a sweep, each square one of its points, coloured by verdict.")
    _refusals(page, sweeps)
    if trials:
        _trials(page, trials)
    page.section("Sweeps")
    page.text(
        "Left: the largest error of a point's quantities over its tolerance; above the dashed line it would be wrong. "
        "Right: iterations of the contact method. Vertical lines are points without an answer, coloured as in the map."
    )
    for first in range(0, len(sweeps), TOGETHER):
        part = sweeps[first : first + TOGETHER]
        page.picture(curves(part), ", ".join(sweep["name"] for sweep in part))
    _table(page, sweeps)
    page.section("Where and how")
    page.facts({"seed": report["seed"], **report["machine"], **report["versions"]})
    page.write(folder / "stability.html")


def _summary(page: Page, report: dict[str, Any]) -> None:
    page.section("Summary")
    names = {"points": "points of the stiff and extreme set", "trials": "random problems and scenes"}
    rows = [
        [
            names[part],
            counts["all"],
            Cell(str(counts["right"]), "good"),
            Cell(str(counts["refused"]), "fair" if counts["refused"] else ""),
            Cell(str(counts["wrong"]), "bad" if counts["wrong"] else "good"),
            counts["feasible"],
            f"{counts['feasible refused']} ({counts['share refused']:.2%})",
            f"{counts['seconds']:.0f}",
        ]
        for part, counts in report["summary"].items()
        if counts["all"]
    ]
    head = ("", "all", "right", "refused", "wrong", "feasible", "of these refused", "CPU seconds")
    page.table(head, rows, "Everything that was tried.")
    page.text(
        "Right is an answer that agrees with a formula or an independent solver within the tolerance stated, with "
        "its certificate, or, where there is no solution, the program's word that there is none. Refused is the word "
        "that no answer was reached. Wrong is any claim that is not so: an answer outside its tolerance, one to what "
        "has none, or `infeasible` of what has one.",
        f"All of it follows from the seed {report['seed']}.",
    )
    if report["failures"]:
        page.heading("Not as it must be")
        page.points(report["failures"])


def _refusals(page: Page, sweeps: list[dict[str, Any]]) -> None:
    rows = [
        [sweep["name"], f"{p['value']:.6g}", Cell(p["verdict"], MARKS[p["verdict"]]), p["reason"]]
        for sweep in sweeps
        for p in sweep["points"]
        if p["verdict"] != "right"
    ]
    if rows:
        page.table(("sweep", "value", "verdict", "reason"), rows, "All points that are not right, and why.")


def _trials(page: Page, trials: list[dict[str, Any]]) -> None:
    page.section("Random trials")
    page.text(
        "Contact problems of 1 to 2,000 contacts, log-uniform: definite, semidefinite, ill-conditioned to 1e14, of "
        "beams and half-spaces, repeated, floating, recorded from a wire in a vessel and perturbed; with rows that "
        "oppose one another at a positive, no, or a negative distance; small solids, and wires in tubes. Residuals "
        "are recomputed in extended precision; whether a problem has a solution is known by construction, or decided "
        "by Farkas' alternative."
    )
    page.picture(trials_figure(trials), "Verdicts by family, and the time of each problem over its size.")
    rows = [
        [t["family"], t["number"], t["contacts"], {True: "yes", False: "no", None: "?"}[t["feasible"]],
         Cell(t["verdict"], MARKS[t["verdict"]]), t["reason"]]
        for t in trials
        if t["verdict"] != "right"
    ]  # fmt: skip
    if rows:
        head = ("family", "number", "contacts", "feasible", "verdict", "reason")
        page.table(head, rows, "All trials that are not right. Number and seed give the problem again.")


def _table(page: Page, sweeps: list[dict[str, Any]]) -> None:
    rows = []
    for sweep in sweeps:
        points = sweep["points"]
        verdicts = [point["verdict"] for point in points]
        errors = [point["error"] for point in points if point["error"] is not None]
        residuals = [value for point in points for value in point["certificate"].values()]
        rows.append(
            [
                sweep["name"],
                sweep["summary"],
                len(points),
                *(verdicts.count(verdict) for verdict in MARKS),
                f"{max(errors, default=0.0):.1e}",
                f"{max(residuals, default=0.0):.1e}",
                max(point["iterations"] for point in points),
                f"{max(point['condition'] for point in points):.0e}",
                f"{sum(point['seconds'] for point in points):.1f}",
            ]
        )
    head = ("sweep", "what it is", "points", *MARKS, "worst error / tolerance", "worst residual", "most iterations",
            "largest condition of W", "CPU s")  # fmt: skip
    page.table(head, rows, "Residuals are those of the certificate; a condition of 0 is that of rigid bodies.")
