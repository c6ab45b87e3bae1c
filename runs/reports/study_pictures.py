"""Pictures of a study: error over seconds and over unknowns, slopes drawn; matplotlib is loaded only here."""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING, Any

import numpy as np

from runs.plot import COLOURS, MARKERS, new_figure
from validation.study.plan import METHODS
from validation.study.rates import FLOOR, slope
from validation.study.tables import WITHIN, Row, Tables

if TYPE_CHECKING:
    from matplotlib.figure import Figure

QUANTITIES = 3  # of a case that are drawn at most
SMALLEST = 1e-16  # is where an error of 0 is drawn


def case_figure(found: Tables, case: str) -> Figure:
    """Errors of a case's quantities over the seconds of a run and over its unknowns, one row each.

    Second-order elements are filled and drawn through, first-order ones hollow and dashed. The dotted lines have the
    slopes that the claimed rate gives with the measured growth of the unknowns, and of the seconds on the last three
    meshes; without a claim, the fitted rate of the highest order does.
    """
    from matplotlib.ticker import NullFormatter

    rows = _rows(found, case)
    names = _names(found, case, rows)
    figure = new_figure((10.0, 1.0 + 2.9 * len(names)))
    axes = figure.subplots(len(names), 2, squeeze=False, sharey="row", sharex="col")
    for line, name in zip(axes, names, strict=True):
        chosen = [row for row in rows if row["quantity"] == name]
        for place, key in zip(line, ("total", "unknowns"), strict=True):
            _draw(place, chosen, key)
            _slopes(place, found, chosen, case, name, key)
        errors = [max(row["error"], SMALLEST) for row in chosen if row["error"] is not None]
        bottom = line[0].get_ylim()[0] / 2  # room for what is written at the slopes
        if errors and min(errors) < 100 * FLOOR:
            bottom = min(bottom, FLOOR / 3)
            for place in line:
                place.axhline(FLOOR, color="0.6", linewidth=0.8, linestyle=(0, (1, 2)), zorder=0)
            line[1].annotate(
                "certificate", (1, FLOOR), xycoords=("axes fraction", "data"), xytext=(-3, 2),
                textcoords="offset points", ha="right", fontsize=7, color="0.4",
            )  # fmt: skip
        line[0].set_ylim(bottom=bottom)
        line[0].set_ylabel(f"{_words(name)}\nrelative error [–]")
    for second in WITHIN:
        for place in axes[:, 0]:
            if place.get_xlim()[0] < second < place.get_xlim()[1]:
                place.axvline(second, color="0.8", linewidth=0.8, zorder=0)
    for place in axes[-1]:
        if place.get_xlim()[1] > 12 * place.get_xlim()[0]:
            place.xaxis.set_minor_formatter(NullFormatter())
    axes[-1, 0].set_xlabel("time on one core [s]")
    axes[-1, 1].set_xlabel("unknowns [–]")
    handles = _handles(rows)
    figure.legend(handles=handles, loc="outside lower center", ncols=min(len(handles), 5), frameon=False, fontsize=8)
    figure.suptitle(case, fontsize=12)
    return figure


def _rows(found: Tables, case: str) -> list[Row]:
    """The quantities of the case's runs with what those took."""
    runs = found["runs"]
    return [{**runs[q["run"]], **q} for q in found["quantities"] if runs[q["run"]]["case"] == case]


def _names(found: Tables, case: str, rows: list[Row]) -> list[str]:
    """The quantities that are drawn: those with a claimed rate first."""
    claimed = [r["quantity"] for r in found["rates"] if r["case"] == case and r["theory"] is not None]
    return list(dict.fromkeys([*claimed, *(row["quantity"] for row in rows)]))[:QUANTITIES]


def _draw(axes: Any, rows: list[Row], key: str) -> None:
    axes.set(xscale="log", yscale="log")
    for method, order in dict.fromkeys((row["method"], row["order"]) for row in rows):
        mine = [r for r in rows if (r["method"], r["order"]) == (method, order) and r["error"] is not None]
        mine = sorted((row for row in mine if row[key] is not None), key=lambda row: row["level"])
        if not mine:
            continue
        x, y = np.array([row[key] for row in mine]), np.array([max(row["error"], SMALLEST) for row in mine])
        if key == "total":
            spread = [[row["total"] - row["least"] for row in mine], [row["most"] - row["total"] for row in mine]]
            axes.errorbar(x, y, xerr=spread, fmt="none", ecolor=_colour(method), elinewidth=0.8, alpha=0.6)
        axes.loglog(x, y, **_style(method, order))
    axes.grid(alpha=0.3, linewidth=0.6)
    axes.tick_params(labelsize=8)


def _slopes(axes: Any, found: Tables, rows: list[Row], case: str, name: str, key: str) -> None:
    """A dotted line below each order's curve, with its slope written on it."""
    for rate in found["rates"]:
        if (rate["case"], rate["quantity"]) != (case, name) or not rate["unknowns_over_h"]:
            continue
        if rate["theory"] is None and rate["order"] < max(row["order"] for row in rows):
            continue
        p = rate["theory"] if rate["theory"] is not None else rate["rate"]
        exponent = None if p is None else p / rate["unknowns_over_h"]
        mine = [r for r in rows if (r["method"], r["order"]) == (rate["method"], rate["order"])]
        mine = [r for r in mine if r["error"] and r[key] is not None][: rate["levels"]][-3:]
        if key == "total" and exponent is not None:
            growth = slope([r["unknowns"] for r in mine], [r["total"] for r in mine])
            exponent = exponent / growth if growth > 0.2 else None
        if exponent is None or exponent > -0.1 or len(mine) < 2:
            continue
        x = np.array([mine[0][key], mine[-1][key]])
        y = 0.4 * mine[-1]["error"] * (x / x[1]) ** exponent
        axes.loglog(x, y, color="0.25", linewidth=1.0, linestyle=":", zorder=1)
        symbol = "t" if key == "total" else "N"
        kind = "" if rate["theory"] is not None else ", fitted"
        axes.annotate(
            f"${symbol}^{{{exponent:.2f}}}$ ($h^{{{p:.3g}}}${kind})", (x[1], y[1]), xytext=(0, -2),
            textcoords="offset points", ha="right", va="top", fontsize=7.5, color="0.25",
        )  # fmt: skip


def _handles(rows: list[Row]) -> list[Any]:
    """The legend: a line for each method and order."""
    from matplotlib.lines import Line2D

    several = len({row["order"] for row in rows}) > 1
    found = dict.fromkeys((row["method"], row["order"]) for row in sorted(rows, key=lambda r: (r["order"], r["run"])))
    return [Line2D([], [], label=f"{m}, order {o}" if several else m, **_style(m, o)) for m, o in found]


def _style(method: str, order: int) -> dict[str, Any]:
    colour = _colour(method)
    return {
        "color": colour,
        "marker": MARKERS[_index(method) % len(MARKERS)],
        "markersize": 4.5,
        "markerfacecolor": colour if order == 2 else "white",
        "markeredgewidth": 1.0,
        "linewidth": 1.8 if method == "status" else 1.0,
        "linestyle": "-" if order == 2 else "--",
        "zorder": 4 if method == "status" else 3,
    }


def _colour(method: str) -> str:
    return COLOURS[_index(method) % len(COLOURS)]


def _index(method: str) -> int:
    return METHODS.index(method) if method in METHODS else len(METHODS)


def _words(name: str) -> str:
    return name.replace("_", " ")


def cases(found: Tables) -> Iterable[str]:
    """The cases of a study, with their parameters, as `case_figure` names them."""
    return dict.fromkeys(run["case"] for run in found["runs"])
