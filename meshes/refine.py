"""Refinement of a generated mesh around a point or a line."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from meshes.parameters import bad, number, positive, vector


@dataclass(frozen=True)
class Refine:
    """Cells of size `h` near a point or a segment, growing linearly with the distance.

    size(x) = min(h_far, h + growth · max(0, distance(x, at) − radius)); neighbouring cells then grow in the
    ratio 1 + growth, a geometric progression.

    Parameters
    ----------
    at : (d) or a pair of (d) [m]
        A point, or the ends of a segment.
    radius : float [m], ≥ 0
    h : float [m]
    growth : float, > 0

    Raises
    ------
    ValueError
        One of them is out of range.
    """

    at: Sequence[float] | Sequence[Sequence[float]]
    radius: float
    h: float
    growth: float = 0.3

    def __post_init__(self) -> None:
        positive("refine.h", self.h)
        positive("refine.growth", self.growth)
        if number("refine.radius", self.radius) < 0:
            raise bad("refine.radius", self.radius, "zero or a positive number")
        if not isinstance(self.at, Sequence | np.ndarray) or isinstance(self.at, str) or len(self.at) == 0:
            raise bad("refine.at", self.at, "a point or a pair of points")

    def ends(self, dim: int) -> tuple[tuple[float, ...], tuple[float, ...]]:
        """The ends of the segment in three coordinates, equal for a point; ValueError unless it has dimension `dim`."""
        pair = len(self.at) == 2 and all(isinstance(end, Sequence | np.ndarray) for end in self.at)
        first, last = (vector("refine.at", end, [dim]) for end in (self.at if pair else (self.at, self.at)))
        return first + (0.0,) * (3 - dim), last + (0.0,) * (3 - dim)

    def size(self, h_far: float, dim: int) -> Callable[[float, float, float], float]:
        """The size [m] of cells at (x, y, z) in a mesh of dimension `dim` with the size `h_far` far away."""
        if self.h > h_far:
            raise bad("refine.h", self.h, f"at most h = {h_far!r}")
        a, b = self.ends(dim)
        u = tuple(q - p for p, q in zip(a, b, strict=True))
        uu = sum(c * c for c in u)

        def size(x: float, y: float, z: float) -> float:
            along = (x - a[0]) * u[0] + (y - a[1]) * u[1] + (z - a[2]) * u[2]
            t = min(1.0, max(0.0, along / uu)) if uu else 0.0
            distance = math.dist((x, y, z), (a[0] + t * u[0], a[1] + t * u[1], a[2] + t * u[2]))
            return min(h_far, self.h + self.growth * max(0.0, distance - self.radius))

        return size
