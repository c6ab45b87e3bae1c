"""A record as text for people and as JSON for programs."""

from __future__ import annotations

import json
import os
from collections.abc import Mapping

import numpy as np

from contact.record.layout import CERTIFICATE, Array
from contact.record.reader import RecordReader


def show(
    path: str | os.PathLike[str], *, steps: bool = False, contact: int | None = None, as_json: bool = False
) -> str:
    """What the record at `path` holds.

    Parameters
    ----------
    path : path-like
    steps : bool
        The rows of ``/steps`` instead of a summary.
    contact : int or None
        The contacts of this step, counted from 0, instead of a summary; with `steps`, after the steps.
    as_json : bool
        One JSON object instead of text. A table is an object of columns, named as in the file;
        with both tables they stand under ``steps`` and ``contact``.

    Raises
    ------
    ValueError
        If `path` is no record or has no such step.
    """
    with RecordReader(path) as record:
        tables: dict[str, Mapping[str, Array]] = {}
        if steps:
            tables["steps"] = record.steps()
        if contact is not None:
            tables["contact"] = record.contact(contact)
        if not tables:
            content = summary(record)
            return json.dumps(content) if as_json else _listing(content)
    if not as_json:
        return "\n\n".join(table(columns) for columns in tables.values())
    objects = {name: jsonable(columns) for name, columns in tables.items()}
    return json.dumps(objects if len(objects) > 1 else next(iter(objects.values())))


def summary(record: RecordReader) -> dict[str, object]:
    """Sizes, time span, totals, worst residuals, steps that missed their certificate and the run's own description."""
    grid, columns = record.grid(), record.steps()
    content: dict[str, object] = {
        "file": str(record.path),
        "points": len(grid.points),
        "cells": len(grid.types),
        "bodies": len(np.unique(grid.body)),
        "steps": record.count,
        "not converged": np.flatnonzero(~columns["converged"]).tolist(),
    }
    if record.count:
        content |= {
            "time": [float(columns["time"][0]), float(columns["time"][-1])],
            "contacts, at most": int(columns["contacts"].max()),
            "active, at most": int(columns["active"].max()),
            "iterations": int(columns["iterations"].sum()),
            "certificate, worst": {name: float(columns[name].max()) for name in CERTIFICATE},
            "seconds": {
                name.removeprefix("seconds/"): float(values.sum())
                for name, values in columns.items()
                if name.startswith("seconds/")
            },
        }
    return content | {"run": record.run}


def table(columns: Mapping[str, Array]) -> str:
    """Columns of equal length as aligned text, one line per row; a vector takes a column per component."""
    cells = {"#": [str(row) for row in range(len(next(iter(columns.values()))))]}
    for name, values in columns.items():
        if values.ndim == 1:
            cells[name] = [_number(value) for value in values]
        else:
            for axis, component in zip("xyz", values.T, strict=True):
                cells[f"{name}.{axis}"] = [_number(value) for value in component]
    widths = {name: max(map(len, [name, *column])) for name, column in cells.items()}
    header = "  ".join(name.rjust(width) for name, width in widths.items())
    rows = zip(*cells.values(), strict=True)
    return "\n".join(
        [
            header,
            *("  ".join(cell.rjust(width) for cell, width in zip(row, widths.values(), strict=True)) for row in rows),
        ]
    )


def jsonable(columns: Mapping[str, Array]) -> dict[str, list[object]]:
    """Columns as lists."""
    return {name: values.tolist() for name, values in columns.items()}


def _listing(content: Mapping[str, object], indent: str = "") -> str:
    lines = []
    for name, value in content.items():
        if isinstance(value, Mapping):
            lines += [f"{indent}{name}", _listing(value, indent + "  ")] if value else []
        else:
            text = ", ".join(map(_text, value)) or "none" if isinstance(value, list) else _text(value)
            lines.append(f"{indent}{name}: {text}")
    return "\n".join(lines)


def _text(value: object) -> str:
    return f"{value:.6g}" if isinstance(value, float) else str(value)


def _number(value: np.generic) -> str:
    return f"{value:.6g}" if isinstance(value, np.floating) else str(value)
