"""The course of a run: forces, contacts, passes and computing times over all steps of a record."""

from __future__ import annotations

import os
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from contact.record import RecordReader
from runs.pictures.plane import BLUE, GREY, VERMILLION, Floats, Ints

if TYPE_CHECKING:
    from matplotlib.figure import Figure


@dataclass(frozen=True, eq=False)
class History:
    """All steps of a record, (steps,).

    Attributes
    ----------
    time, seconds : of the step's end in the scene [s], and of its computation
    total, largest : Σλ and max λ [N]
    candidates, active, passes, substeps : numbers
    """

    time: Floats
    seconds: Floats
    total: Floats
    largest: Floats
    candidates: Ints
    active: Ints
    passes: Ints
    substeps: Ints

    @classmethod
    def read(cls, path: str | os.PathLike[str]) -> History:
        """From a record's ``/steps`` and ``/contact``."""
        with RecordReader(path) as record:
            rows = record.steps()
            lam = np.concatenate([np.zeros(0), *record.slabs("/contact/lambda")])
            ends = np.concatenate([*record.slabs("/contact/offsets")])
        step = np.repeat(np.arange(record.count), np.diff(ends))
        largest = np.zeros(record.count)
        np.maximum.at(largest, step, lam)
        return cls(
            rows["time"], rows["seconds/total"], np.bincount(step, lam, record.count), largest, rows["contacts"],
            rows["active"], rows["passes"], rows["substeps"],
        )  # fmt: skip


def _unit(force: float) -> tuple[float, str]:
    """The factor and the unit in which a force [N] reads best."""
    power = int(np.clip(-np.floor(np.log10(max(force, 1e-300)) / 3), 0, 3))
    return 10.0 ** (3 * power), ("N", "mN", "µN", "nN")[power]


def draw_history(figure: Figure, place: Any, history: History, time: float) -> None:
    """Forces, contacts, passes and times in four panels side by side; `time` [s] is marked in each."""
    columns = place.subgridspec(1, 4)
    axes = [figure.add_subplot(columns[i]) for i in range(4)]
    factor, unit = _unit(float(history.total.max(initial=0.0)))
    axes[0].plot(history.time, factor * history.total, color=BLUE, linewidth=1, label="sum")
    axes[0].plot(history.time, factor * history.largest, color=VERMILLION, linewidth=1, label="largest")
    axes[0].set_ylim(bottom=0)
    axes[0].set_title(f"contact force [{unit}]", fontsize=9)
    draw_contacts(axes[1], history)
    axes[2].plot(history.time, history.passes, ".", color=BLUE, markersize=3, label="passes")
    axes[2].plot(history.time, history.substeps, ".", color=VERMILLION, markersize=3, label="substeps")
    axes[2].set_title("a step's passes and substeps", fontsize=9)
    axes[2].set_ylim(bottom=0)
    axes[3].plot(history.time, 1e3 * history.seconds, ".", color=BLUE, markersize=3)
    median = 1e3 * float(np.median(history.seconds))
    axes[3].axhline(median, color=VERMILLION, linewidth=1, label=f"median {median:.3g} ms")
    axes[3].set_yscale("log")
    axes[3].set_title("computing time of a step [ms]", fontsize=9)
    for panel in axes:
        panel.axvline(time, color="black", linewidth=0.7, zorder=0)
        panel.set_xlabel("time t [s]", fontsize=8)
        panel.tick_params(labelsize=8)
        panel.grid(alpha=0.3)
        panel.legend(fontsize=7, framealpha=0.6)


def draw_contacts(axes: Any, history: History) -> None:
    """How many candidates there are, and how many of them carry a force."""
    axes.plot(history.time, history.candidates, color=GREY, linewidth=1, label="candidates")
    axes.plot(history.time, history.active, color=BLUE, linewidth=1, label="with force")
    axes.set_title("contacts", fontsize=9)
    axes.set_ylim(bottom=0)
