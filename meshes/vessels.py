"""Vessel trees: centreline points with radii, each joined to its parent."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline, PchipInterpolator

from meshes.parameters import positive

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]


@dataclass(frozen=True)
class VesselTree:
    """One tree or several.

    points : (n, 3) [m]
    radii : of the lumen, (n) [m]
    parents : the row each point is joined to, −1 for a root, (n)

    Raises
    ------
    ValueError
        One line, for radii that are not positive, parents that do not exist, or points that are their own ancestors.
    """

    points: Floats
    radii: Floats
    parents: Ints

    def __post_init__(self) -> None:
        n = len(self.points)
        if self.points.shape != (n, 3) or self.radii.shape != (n,) or self.parents.shape != (n,) or not n:
            raise ValueError(
                f"points, radii, parents: must have shapes (n, 3), (n), (n), not {self.points.shape}, "
                f"{self.radii.shape}, {self.parents.shape}"
            )
        finite = np.isfinite(self.points).all(axis=1)
        if not finite.all():
            raise ValueError(f"points[{np.argmin(finite)}]: must be finite")
        right = np.isfinite(self.radii) & (self.radii > 0)
        if not right.all():
            at = int(np.argmin(right))
            raise ValueError(f"radii[{at}] = {self.radii[at]:g}: must be above 0")
        known = (self.parents >= -1) & (self.parents < n)
        if not known.all():
            at = int(np.argmin(known))
            raise ValueError(f"parents[{at}] = {self.parents[at]}: must be a point's number, or -1")
        # After n doublings of the step upwards every point has arrived above its root, or goes round in a circle.
        up = np.append(self.parents, -1)
        for _ in range(n.bit_length()):
            up = up[up]
        if np.any(up >= 0):
            at = int(np.argmax(up >= 0))
            raise ValueError(f"parents[{at}] = {self.parents[at]}: point {at} must not be its own ancestor")

    def chains(self) -> list[Ints]:
        """Rows of points along each vessel: a parent continues into its largest child, other children begin chains.

        A side branch's chain starts with the point of its parent's axis that it leaves from.
        """
        n = len(self.points)
        child = np.full(n, -1)
        # The largest child is written last; of equals, the first.
        order = np.lexsort((-np.arange(n), self.radii))
        joined = order[self.parents[order] >= 0]
        child[self.parents[joined]] = joined
        starts = [i for i in range(n) if self.parents[i] < 0 or child[self.parents[i]] != i]
        chains = []
        for start in starts:
            rows = [] if self.parents[start] < 0 else [int(self.parents[start])]
            at = start
            while at >= 0:
                rows.append(at)
                at = int(child[at])
            chains.append(np.array(rows))
        return chains

    def resampled(self, spacing: float) -> VesselTree:
        """The tree with points about `spacing` [m] apart along each chain; ends and points of branching stay."""
        positive("spacing", spacing)
        keep = np.bincount(self.parents[self.parents >= 0], minlength=len(self.points)) != 1
        keep |= self.parents < 0
        points: list[Any] = []
        radii: list[float] = []
        parents: list[int] = []
        number = np.full(len(self.points), -1)
        for chain in self.chains():
            s = _arc(self.points[chain])
            kept = np.flatnonzero(keep[chain])
            for a, b in pairwise(kept):
                count = max(1, round((s[b] - s[a]) / spacing))
                where = np.linspace(s[a], s[b], count + 1)
                if number[chain[a]] < 0:
                    number[chain[a]] = len(points)
                    points.append(self.points[chain[a]])
                    radii.append(self.radii[chain[a]])
                    parents.append(-1)
                last = number[chain[a]]
                for at in where[1:]:
                    parents.append(last)
                    last = len(points)
                    points.append([np.interp(at, s, self.points[chain, i]) for i in range(3)])
                    radii.append(np.interp(at, s, self.radii[chain]))
                number[chain[b]] = last
        return VesselTree(np.array(points), np.array(radii, dtype=float), np.array(parents))

    def narrowed(self, centre: Floats, length: float, fraction: float) -> VesselTree:
        """A stenosis: radii times 1 − `fraction` cos²(π |x − c|/L) within half its length L [m] of the centre c (3)."""
        positive("length", length)
        if not 0 < fraction < 1:
            raise ValueError(f"fraction = {fraction:g}: must be between 0 and 1")
        away = np.linalg.norm(self.points - centre, axis=1)
        dip = np.where(away < length / 2, np.cos(np.pi * away / length) ** 2, 0.0)
        if not dip.any():
            raise ValueError(f"centre = {np.asarray(centre).tolist()}: must be within length/2 of a point of an axis")
        return VesselTree(self.points, self.radii * (1 - fraction * dip), self.parents)

    def segments(self) -> tuple[Floats, Ints]:
        """Ends and their radii a, b, r_a, r_b (segments, 8), and the number of each one's chain.

        A side branch has its own radius from its start on its parent's axis.
        """
        rows, numbers = [], []
        claimed = np.zeros(len(self.points), dtype=bool)
        for number, chain in enumerate(self.chains()):
            x, r = self.points[chain], self.radii[chain].copy()
            if claimed[chain[0]]:
                r[0] = r[1]
            claimed[chain] = True
            rows.append(np.column_stack([x[:-1], x[1:], r[:-1], r[1:]]))
            numbers.append(np.full(len(x) - 1, number))
        return np.concatenate(rows), np.concatenate(numbers)


def read_swc(path: Path, scale: float = 1.0) -> VesselTree:
    """The tree of an SWC file (id, type, x, y, z, radius, parent), lengths times `scale` to make them metres.

    Raises
    ------
    ValueError
        One line that names the file, the line and what is allowed.
    """
    positive("scale", scale)
    try:
        lines = path.read_text(encoding="utf8").splitlines()
    except FileNotFoundError:
        raise ValueError(f"{path}: no such file") from None
    except (OSError, UnicodeDecodeError) as error:
        raise ValueError(f"{path}: {error}") from None
    row: dict[int, int] = {}
    values, parents = [], []
    for number, line in enumerate(lines, 1):
        words = line.split("#")[0].split()
        if not words:
            continue
        try:
            name, _, x, y, z, r, parent = words
            point, up = int(name), int(parent)
            values.append([float(x), float(y), float(z), float(r)])
        except ValueError:
            raise ValueError(f"{path}: line {number}: must be id type x y z radius parent, not {line!r}") from None
        if point in row:
            raise ValueError(f"{path}: line {number}: id = {point}: must not appear twice")
        row[point] = len(row)
        parents.append(up)
    for child, up in zip(row, parents, strict=True):
        if up != -1 and up not in row:
            raise ValueError(f"{path}: parent = {up} of point {child}: must be a point's id, or -1")
    data = np.array(values).reshape(-1, 4)
    try:
        return VesselTree(data[:, :3] * scale, data[:, 3] * scale, np.array([row.get(up, -1) for up in parents]))
    except ValueError as error:
        raise ValueError(f"{path}: {error}") from None


def tree_of(branches: Sequence[tuple[str, Floats]], spacing: float | None = None) -> VesselTree:
    """A tree of named branches, each given by rows x, y, z, r [m] that splines join (cubic; radii monotone).

    A branch whose first point lies on another's axis, within half its radius there, is joined to it and starts at the
    nearest sample of that axis; others are free.

    Parameters
    ----------
    spacing : of the samples [m]; half the branch's mean radius by default
    """
    points, radii, parents = np.zeros((0, 3)), np.zeros(0), np.zeros(0, dtype=np.int64)
    for name, rows in branches:
        rows = np.asarray(rows, dtype=float)
        if rows.ndim != 2 or rows.shape[1] != 4 or len(rows) < 2:
            raise ValueError(f"branch {name!r}: points: must be two rows x, y, z, r or more")
        if not np.all(np.isfinite(rows)) or not np.all(rows[:, 3] > 0):
            raise ValueError(f"branch {name!r}: points: must be finite with radii above 0")
        s = _arc(rows[:, :3])
        if not np.all(np.diff(s) > 0):
            raise ValueError(f"branch {name!r}: points[{int(np.argmin(np.diff(s))) + 1}]: must not repeat the last one")
        count = max(2, round(s[-1] / (spacing or 0.5 * rows[:, 3].mean())))
        at = np.linspace(0, s[-1], count + 1)
        x = CubicSpline(s, rows[:, :3], bc_type="natural")(at)
        r = PchipInterpolator(s, rows[:, 3])(at)
        parent = -1
        if len(points):
            away = np.linalg.norm(points - x[0], axis=1)
            near = int(np.argmin(away))
            if away[near] < 0.5 * radii[near]:
                parent, x, r = near, x[1:], r[1:]
        first = len(points)
        links = np.arange(first - 1, first + len(x) - 1)
        links[0] = parent
        points, radii, parents = np.concatenate([points, x]), np.concatenate([radii, r]), np.append(parents, links)
    return VesselTree(points, radii, parents)


def _arc(x: Floats) -> Floats:
    """Length along a polygon up to each of its corners."""
    s: Floats = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(x, axis=0), axis=1))])
    return s
