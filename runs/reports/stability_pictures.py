"""Pictures of a stability campaign: the map of verdicts, and errors and iterations over what is swept."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from runs.pictures.plane import BLUE, GREY, ORANGE, SKY, VERMILLION
from runs.plot import new_figure

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

KINDS = {
    "right": (BLUE, "right"),
    "infeasible": (SKY, "infeasible, and reported so"),
    "refused": (ORANGE, "refused"),
    "wrong": (VERMILLION, "wrong"),
}
SMALLEST = 1e-8  # is where an error of 0 is drawn, over its tolerance

Sweep = dict[str, Any]


def kind(point: dict[str, Any]) -> str:
    """The colour of a point: its verdict, but what has no solution is a colour of its own where that is found."""
    return "infeasible" if point["verdict"] == "right" and not point["feasible"] else str(point["verdict"])


def verdict_map(sweeps: list[Sweep]) -> Figure:
    """A row for each sweep, a square for each of its points, coloured by verdict."""
    longest = max(len(sweep["points"]) for sweep in sweeps)
    figure = new_figure((9.0, 1.3 + 0.2 * len(sweeps)))
    axes = figure.subplots()
    for row, sweep in enumerate(sweeps):
        for column, point in enumerate(sweep["points"]):
            colour = KINDS[kind(point)][0]
            axes.add_patch(_square(column, row, colour))
        first, last = sweep["points"][0]["value"], sweep["points"][-1]["value"]
        axes.text(longest + 0.4, row + 0.5, f"{sweep['swept']}: {first:.3g} … {last:.3g}", va="center", fontsize=6.5)
    axes.set_xlim(0, longest + 0.2)
    axes.set_ylim(len(sweeps), 0)
    axes.set_yticks(np.arange(len(sweeps)) + 0.5, [sweep["name"] for sweep in sweeps], fontsize=7)
    axes.set_xticks([])
    axes.set_xlabel("points of the sweep, from its first value to its last")
    axes.tick_params(length=0)
    for spine in axes.spines.values():
        spine.set_visible(False)
    found = {kind(point) for sweep in sweeps for point in sweep["points"]}
    handles = [_square(0, 0, colour, label) for key, (colour, label) in KINDS.items() if key in found or key == "wrong"]
    figure.legend(handles=handles, loc="outside upper center", ncols=4, frameon=False, fontsize=8)
    return figure


def _square(column: int, row: int, colour: str, label: str = "") -> Any:
    from matplotlib.patches import Rectangle

    return Rectangle((column + 0.05, row + 0.08), 0.9, 0.84, facecolor=colour, label=label)


def curves(sweeps: list[Sweep]) -> Figure:
    """Of each sweep the largest error over its tolerance, and the iterations, over the swept parameter."""
    figure = new_figure((9.0, 0.4 + 1.75 * len(sweeps)))
    axes = figure.subplots(len(sweeps), 2, squeeze=False)
    for (left, right), sweep in zip(axes, sweeps, strict=True):
        points = sweep["points"]
        values = np.array([point["value"] for point in points])
        answered = [point["error"] is not None for point in points]
        errors = np.array([max(point["error"] or 0.0, SMALLEST) for point in points])
        for place, heights, name in (
            (left, errors, "error / tolerance [–]"),
            (right, np.array([max(point["iterations"], 0) for point in points], float), "iterations [–]"),
        ):
            place.plot(values[answered], heights[answered], "-", color=GREY, linewidth=0.8, zorder=1)
            for key, (colour, _) in KINDS.items():
                chosen = np.array([kind(point) == key for point in points]) & answered
                place.plot(values[chosen], heights[chosen], "o", color=colour, markersize=3.5)
                silent = np.array([kind(point) == key for point in points]) & ~np.array(answered)
                for value in values[silent]:
                    place.axvline(value, color=colour, linewidth=1.2, alpha=0.7, zorder=0)
            _scale(place, values)
            place.set_xlabel(sweep["swept"], fontsize=7)
            place.set_ylabel(name, fontsize=7)
            place.tick_params(labelsize=6.5)
        left.set_yscale("log")
        left.set_ylim(SMALLEST / 3, 30)
        left.axhline(1.0, color=VERMILLION, linewidth=0.8, linestyle="--")
        left.set_title(sweep["name"], fontsize=8, loc="left")
        if max((point["iterations"] for point in points), default=0) > 100:
            right.set_yscale("symlog", linthresh=1)
    return figure


def _scale(axes: Axes, values: Any) -> None:
    """A logarithmic axis where values cover decades; of both signs, linear about 0 up to the least."""
    sizes = np.abs(values[values != 0])
    if sizes.size and sizes.max() > 100 * sizes.min():
        if values.min() > 0:
            axes.set_xscale("log")
        else:
            axes.set_xscale("symlog", linthresh=float(sizes.min()))
            ends = [v for v in (values.min(), 0.0, values.max()) if v in values]
            axes.set_xticks(sorted({*ends, *np.median(values[values > 0], keepdims=True)[:1]} & set(values)))


def trials_figure(trials: list[dict[str, Any]]) -> Figure:
    """Trials by family and size: what was found, and how long it took."""
    figure = new_figure((9.0, 3.4))
    left, right = figure.subplots(1, 2)
    families = sorted({trial["family"] for trial in trials})
    for row, family in enumerate(families):
        start = 0.0
        own = [
            kind(trial | {"feasible": trial["feasible"] is not False}) for trial in trials if trial["family"] == family
        ]
        for key, (colour, _) in KINDS.items():
            share = own.count(key) / len(own)
            left.barh(row, share, left=start, color=colour, height=0.8)
            start += share
        left.text(1.01, row, f"{len(own)}", va="center", fontsize=7)
    left.set_yticks(range(len(families)), families, fontsize=8)
    left.set_xlim(0, 1)
    left.invert_yaxis()
    left.set_xlabel("share of the trials [–], number on the right")
    problems = [trial for trial in trials if trial["contacts"] > 0]
    for key, (colour, label) in KINDS.items():
        chosen = [t for t in problems if kind(t | {"feasible": t["feasible"] is not False}) == key]
        if chosen:
            x, y = [t["contacts"] for t in chosen], [max(t["seconds"], 1e-5) for t in chosen]
            right.loglog(x, y, "o", color=colour, markersize=2, alpha=0.5, label=label, rasterized=True)
    right.set_xlabel("contacts c [–]")
    right.set_ylabel("time, drawing and judging included [s]")
    right.legend(frameon=False, fontsize=7)
    return figure
