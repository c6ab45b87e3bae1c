"""What the runs of a study say together: rates, the cheapest way to an error, and the error reached in a time.

A run here is a row of the table ``runs``; its errors are a dictionary beside it.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace

import numpy as np

# Errors below it are those of the certificate, not of the mesh.
FLOOR = 1e-8


@dataclass(frozen=True)
class Point:
    """One solved run as the analysis sees it: what it costs and what error one of its quantities has."""

    method: str
    order: int
    level: int
    h: float
    unknowns: int
    seconds: float
    error: float

    @property
    def chain(self) -> tuple[str, int]:
        """What it shares with the runs on its other levels."""
        return self.method, self.order


def slope(x: Sequence[float], y: Sequence[float]) -> float:
    """The slope of log y over log x by least squares; NaN with fewer than two different x, or values not above 0."""
    kept = [(a, b) for a, b in zip(x, y, strict=True) if a > 0 and b > 0 and math.isfinite(a * b)]
    if len({a for a, _ in kept}) < 2:
        return math.nan
    logs = np.log(np.array(kept))
    return float(np.polyfit(logs[:, 0], logs[:, 1], 1)[0])


def above_floor(points: Iterable[Point], floor: float = FLOOR) -> list[Point]:
    """The points of a chain from coarse to fine, until one has an error that is not above the floor."""
    kept: list[Point] = []
    for point in sorted(points, key=lambda p: p.level):
        if not point.error > floor:
            break
        kept.append(point)
    return kept


def settled(points: Sequence[Point]) -> list[Point]:
    """Each point with the largest error of its chain from its level on.

    An error that passes through zero on one mesh and is larger on the next was luck; it counts as the next one.
    """
    found = []
    for point in points:
        finer = [p.error for p in points if p.chain == point.chain and p.level >= point.level]
        found.append(replace(point, error=math.inf if any(map(math.isnan, finer)) else max(finer)))
    return found


def cheapest(points: Sequence[Point], target: float) -> Point | None:
    """The fastest run whose error, as `settled` counts it, is at most `target`; None if none is."""
    good = [point for point in settled(points) if point.error <= target and math.isfinite(point.seconds)]
    return min(good, key=lambda p: (p.seconds, p.unknowns), default=None)


def reached(points: Sequence[Point], seconds: float) -> Point | None:
    """The run with the least error, as `settled` counts it, among those that take at most `seconds`; None if none.

    Of runs whose errors are the same to a hundredth, as those of several methods on one mesh are, the fastest.
    """
    good = [point for point in settled(points) if point.seconds <= seconds and math.isfinite(point.error)]
    least = min((point.error for point in good), default=0.0)
    return min((point for point in good if point.error <= 1.01 * least), key=lambda p: p.seconds, default=None)
