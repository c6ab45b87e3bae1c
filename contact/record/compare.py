"""The first thing in which two records differ, and by how much."""

from __future__ import annotations

import os
from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from contact.record.layout import GRID, Array
from contact.record.reader import RecordReader


@dataclass(frozen=True)
class Difference:
    """Where two records differ.

    Attributes
    ----------
    name : str
        The data set.
    absolute, relative : float
        max|a − b|, and that over max(|a|, |b|); infinite where one has no counterpart for what the other has.
    reason : str
        One line for the user.
    """

    name: str
    absolute: float
    relative: float
    reason: str

    def __str__(self) -> str:
        return f"{self.name}: {self.reason}"


def compare(
    path_a: str | os.PathLike[str], path_b: str | os.PathLike[str], tolerance: float = 0.0
) -> Difference | None:
    """First data set of the finished steps in which two records differ; seconds and ``/run`` do not count.

    The order is: ``/steps``, ``/contact``, fields, geometry, ``/checkpoint``, ``/scene``.

    Parameters
    ----------
    path_a, path_b : path-like
    tolerance : float
        A data set differs when max|a − b| > tolerance · max(|a|, |b|), both maxima over the whole data set.

    Returns
    -------
    Difference or None

    Raises
    ------
    ValueError
        If one of the paths is not a record.
    """
    with RecordReader(path_a) as a, RecordReader(path_b) as b:
        for name in sorted(_compared(a) | _compared(b), key=_order):
            difference = _dataset(a, b, name, tolerance)
            if difference is not None:
                return difference
        difference = _checkpoint(a, b, tolerance)
        if difference is None and a.scene != b.scene:
            difference = _unlike("/scene", "the texts differ")
        return difference


def _compared(record: RecordReader) -> set[str]:
    return {name for name in record.names if not name.startswith("/steps/seconds/") and name != "/scene"}


def _order(name: str) -> tuple[int, str]:
    prefixes = ("/steps/time", "/steps/", "/contact/", f"{GRID}/PointData/", f"{GRID}/CellData/")
    return next((i for i, prefix in enumerate(prefixes) if name.startswith(prefix)), len(prefixes)), name


def _dataset(a: RecordReader, b: RecordReader, name: str, tolerance: float) -> Difference | None:
    for record in (a, b):
        if name not in record.file:
            return _unlike(name, f"not in {record.path}")
    if a.shape(name) != b.shape(name):
        return _unlike(name, f"shapes {a.shape(name)} and {b.shape(name)}")
    return _difference(name, zip(a.slabs(name), b.slabs(name), strict=True), tolerance)


def _checkpoint(a: RecordReader, b: RecordReader, tolerance: float) -> Difference | None:
    # Equal counts by now: /steps/time has the same shape in both.
    states = [record.checkpoint() if record.count else {} for record in (a, b)]
    for name in sorted(states[0].keys() | states[1].keys()):
        path = f"/checkpoint/{name}"
        for record, state in zip((a, b), states, strict=True):
            if name not in state:
                return _unlike(path, f"not in {record.path}")
        pair = states[0][name], states[1][name]
        if pair[0].shape != pair[1].shape:
            return _unlike(path, f"shapes {pair[0].shape} and {pair[1].shape}")
        difference = _difference(path, [pair], tolerance)
        if difference is not None:
            return difference
    return None


def _difference(name: str, pairs: Iterable[tuple[Array, Array]], tolerance: float) -> Difference | None:
    absolute = scale = 0.0
    for a, b in pairs:
        x, y = np.asarray(a, dtype=np.float64), np.asarray(b, dtype=np.float64)
        same = (x == y) | (np.isnan(x) & np.isnan(y))
        with np.errstate(invalid="ignore"):
            distance = np.where(same, 0.0, np.nan_to_num(np.abs(x - y), nan=np.inf))
        absolute = max(absolute, float(np.max(distance, initial=0.0)))
        scale = max(scale, float(np.nanmax(np.abs([x, y]), initial=0.0)))
    if absolute <= tolerance * scale:
        return None
    relative = absolute / scale if np.isfinite(absolute) else np.inf
    return Difference(name, absolute, relative, f"differs by {absolute:.3e}, relative {relative:.3e}")


def _unlike(name: str, reason: str) -> Difference:
    return Difference(name, np.inf, np.inf, reason)
