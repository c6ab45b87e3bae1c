"""Rest shapes of devices: nodes with frames along a centreline, in sections that join smoothly."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import tau
from os import PathLike
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.interpolate import CubicSpline
from scipy.spatial.transform import Rotation

from meshes.files import raw_mesh
from meshes.parameters import bad, count, number, positive, vector

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

X, W = np.polynomial.legendre.leggauss(8)


@dataclass(frozen=True, eq=False)
class Centreline:
    """Nodes along a curve; elements lie between successive nodes.

    Parameters
    ----------
    points : (N, 3) [m]
    frames : (N, 3, 3), columns t (the tangent), d₂, d₃
    arc : (N) arc length from the start [m], increasing
    section : (N − 1) the section of each element, 0, 1, … in order

    Raises
    ------
    ValueError
        Wrong shapes, values that are not finite, an arc that does not increase, sections out of order, frames that
        are no rotations.
    """

    points: Floats
    frames: Floats
    arc: Floats
    section: Ints

    def __post_init__(self) -> None:
        n = len(self.points)
        shapes = (self.points.shape, self.frames.shape, self.arc.shape, self.section.shape)
        if n < 2 or shapes != ((n, 3), (n, 3, 3), (n,), (n - 1,)):
            raise ValueError(f"centreline: shapes {shapes}: must be (N, 3), (N, 3, 3), (N,), (N - 1,) with N ≥ 2")
        if not all(np.isfinite(a).all() for a in (self.points, self.frames, self.arc)):
            raise ValueError("centreline: points, frames and arc must be finite numbers")
        if (low := np.flatnonzero(np.diff(self.arc) <= 0)).size:
            raise ValueError(f"centreline: the arc length does not increase at node {low[0] + 1}")
        if self.section[0] != 0 or not np.isin(np.diff(self.section), (0, 1)).all():
            raise ValueError("centreline: sections must be 0, 1, … in order")
        gram = np.swapaxes(self.frames, 1, 2) @ self.frames
        if np.abs(gram - np.eye(3)).max() > 1e-9 or (np.linalg.det(self.frames) < 0).any():
            raise ValueError("centreline: frames must be rotations")

    @property
    def length(self) -> float:
        """Arc length from end to end [m]."""
        return float(self.arc[-1] - self.arc[0])

    def relative(self) -> Floats:
        """The middle of each element (N − 1) on its own section, from 0 at its start to 1 at its end."""
        middle = (self.arc[:-1] + self.arc[1:]) / 2
        ends = np.flatnonzero(np.diff(self.section, append=self.section[-1] + 1)) + 1
        starts = np.append(0, ends[:-1])
        run = np.searchsorted(ends, np.arange(len(middle)), side="right")
        return np.asarray((middle - self.arc[starts[run]]) / (self.arc[ends[run]] - self.arc[starts[run]]))

    def moved(self, to: ArrayLike, frame: Floats) -> Centreline:
        """The same shape with its first node at `to` (3) [m] and its first frame equal to `frame` (3, 3)."""
        turn = frame @ self.frames[0].T
        points = np.asarray(to, dtype=float) + (self.points - self.points[0]) @ turn.T
        return Centreline(points, turn @ self.frames, self.arc, self.section)

    def placed(self, start: Sequence[float], direction: Sequence[float], roll: float = 0.0) -> Centreline:
        """The same shape from `start` (3) [m] in the `direction` (3), rolled about it by `roll` [rad].

        Without roll, d₂ is in the plane of the direction and the axis of coordinates farthest from it.
        """
        origin, toward = vector("start", start, (3,)), np.array(vector("direction", direction, (3,)))
        if not np.linalg.norm(toward) > 0:
            raise bad("direction", list(direction), "longer than 0")
        return self.moved(origin, _first_frame(toward / np.linalg.norm(toward), number("roll", roll)))


def straight(length: float, elements: int) -> Centreline:
    """A straight section along x, `length` [m]."""
    return _uniform(length, elements, np.zeros(3))


def arc(length: float, elements: int, radius: float, angle: float = 0.0) -> Centreline:
    """A section of a circle of `radius` [m] that leaves the x axis towards d₂, turned by `angle` [rad] about x."""
    return helix(length, elements, radius, 0.0, angle)


def helix(length: float, elements: int, radius: float, pitch: float, angle: float = 0.0) -> Centreline:
    """A section of a helix on a cylinder of `radius` [m], by `pitch` [m] a turn, left-handed where it is negative.

    The frames are Frenet's, turned by −`angle` [rad] about t: κ = a/(a² + b²) and τ = b/(a² + b²) with the radius a and
    b = pitch/2π. It starts at the origin along x and bends towards d₂ cos(angle) + d₃ sin(angle).
    """
    a, b, phi = positive("radius", radius), number("pitch", pitch) / tau, number("angle", angle)
    return _uniform(length, elements, np.array([b, -a * np.sin(phi), a * np.cos(phi)]) / (a**2 + b**2))


def polyline(points: ArrayLike, elements: int | None = None) -> Centreline:
    """A section through given points, on a cubic spline through them, with rotation-minimising frames.

    Parameters
    ----------
    points : (n, 3) [m], n ≥ 2
    elements : how many of equal length; the points are the nodes if it is not given
    """
    path = _Path(points)
    if elements is None:
        return path.nodes(path.knots, path.arc)
    arc = np.linspace(0, path.arc[-1], count("elements", elements) + 1)
    return path.nodes(path.parameters(arc), arc)


def along(points: ArrayLike, arc: int | Floats, roll: float = 0.0) -> Centreline:
    """A device laid on the cubic spline through given points, with rotation-minimising frames.

    Parameters
    ----------
    points : (n, 3) [m], n ≥ 2
    arc : number of elements from end to end of the path, or the nodes' arc lengths from its start (N) [m]
    roll : of all frames about their tangents [rad]

    Raises
    ------
    ValueError
        An arc length beyond the path or that does not increase, equal successive points, values that are not finite.
    """
    path, phi = _Path(points), number("roll", roll)
    s = np.linspace(0, path.arc[-1], count("arc", arc) + 1) if np.ndim(arc) == 0 else np.asarray(arc, dtype=float)
    end = float(path.arc[-1])
    if not (np.isfinite(s).all() and s.min() >= 0 and s.max() <= end * (1 + 1e-12)):
        raise ValueError(f"arc = {s.min():.6g} .. {s.max():.6g}: must be from 0 to the path's length {end:.6g}")
    if s.ndim != 1 or len(s) < 2 or (np.diff(s) <= 0).any():
        raise ValueError(f"arc: shape {s.shape}: must be at least 2 increasing numbers")
    return path.nodes(path.parameters(s), s, phi)


def join(pieces: Sequence[Centreline]) -> Centreline:
    """Sections in a row: each starts where the one before ends, with its frame, so that the tangent is continuous.

    A piece of several sections keeps them; ValueError where there is no piece.
    """
    if not pieces:
        raise ValueError("sections: none: must be at least one")
    parts = [pieces[0]]
    for piece in pieces[1:]:
        parts.append(piece.moved(parts[-1].points[-1], parts[-1].frames[-1]))
    arcs, sections, s, k = [np.zeros(1)], [], 0.0, 0
    for part in parts:
        arcs.append(s + part.arc[1:] - part.arc[0])
        sections.append(k + part.section)
        s, k = float(arcs[-1][-1]), int(sections[-1][-1]) + 1
    return Centreline(
        np.concatenate([parts[0].points[:1], *(part.points[1:] for part in parts)]),
        np.concatenate([parts[0].frames[:1], *(part.frames[1:] for part in parts)]),
        np.concatenate(arcs),
        np.concatenate(sections),
    )


def from_lines(points: ArrayLike, cells: ArrayLike) -> Centreline:
    """The centreline of a line mesh: its nodes in order, from the end with the lower number.

    Parameters
    ----------
    points : (n, d) [m], d ≤ 3; missing coordinates are zero
    cells : (m, 2) or, second-order with the middle node last, (m, 3)

    Raises
    ------
    ValueError
        The lines branch, close, or are not connected.
    """
    nodes, lines = np.asarray(points, dtype=float), np.asarray(cells, dtype=np.int64)
    if lines.ndim != 2 or lines.shape[1] not in (2, 3) or len(lines) == 0:
        raise ValueError(f"lines: shape {lines.shape}: must be (m, 2) or (m, 3)")
    if lines.shape[1] == 3:
        lines = np.concatenate([lines[:, [0, 2]], lines[:, [2, 1]]])
    degree = np.bincount(lines.ravel(), minlength=len(nodes))
    ends = np.flatnonzero(degree == 1)
    if (fork := np.flatnonzero(degree > 2)).size:
        raise ValueError(f"lines: node {fork[0]} joins {degree[fork[0]]} lines: must be at most 2")
    if len(ends) != 2:
        raise ValueError(f"lines: {len(ends)} ends: must be one open line with 2")
    neighbours: dict[int, list[int]] = {}
    for i, j in lines.tolist():
        neighbours.setdefault(i, []).append(j)
        neighbours.setdefault(j, []).append(i)
    order = [int(ends[0])]
    before = -1
    while (after := [j for j in neighbours[order[-1]] if j != before]) and len(order) <= len(lines):
        before = order[-1]
        order.append(after[0])
    if len(order) != len(lines) + 1:
        raise ValueError(f"lines: {len(lines) + 1 - len(order)} are not connected with the others: must be one line")
    chain = nodes[order]
    return polyline(np.pad(chain, ((0, 0), (0, 3 - chain.shape[1]))))


def read_lines(path: str | PathLike[str]) -> Centreline:
    """The centreline of the line cells of any file that meshio reads; ValueError names the file."""
    raw = raw_mesh(Path(path))
    kinds = {block.type for block in raw.cells if block.dim == 1}
    if len(kinds) != 1 or not kinds <= {"line", "line3"}:
        raise ValueError(f"{path}: {', '.join(sorted(kinds)) or 'no'} lines: must be line or line3 cells, of one type")
    try:
        return from_lines(raw.points, np.concatenate([block.data for block in raw.cells if block.dim == 1]))
    except ValueError as error:
        raise ValueError(f"{path}: {error}") from None


def _uniform(length: float, elements: int, k: Floats) -> Centreline:
    """From the origin along x with the constant Darboux vector k [1/m] in the frame: R′ = R k^, x′ = R e₁.

    R = exp(s k^) and x = ∫ R e₁ = s [n n₁ + sinc θ (e₁ − n n₁) + (1 − cos θ)/θ n × e₁] with θ = s|k|, k = |k| n: exact.
    """
    s = np.linspace(0, positive("length", length), count("elements", elements) + 1)
    rate = float(np.linalg.norm(k))
    if (turn := rate * s[1]) > np.pi:
        raise bad("elements", elements, f"more: each turns by {turn:.3g} rad, more than half a turn")
    n = k / rate if rate > 0 else np.zeros(3)
    theta, e1 = (s * rate)[:, None], np.array([1.0, 0.0, 0.0])
    along_axis, across = n * n[0], e1 - n * n[0]
    lift = theta / 2 * np.sinc(theta / tau) ** 2
    points = s[:, None] * (along_axis + np.sinc(theta / np.pi) * across + lift * np.cross(n, e1))
    frames = Rotation.from_rotvec(s[:, None] * k).as_matrix()
    return Centreline(points, frames, s, np.zeros(len(s) - 1, dtype=np.int64))


class _Path:
    """The cubic spline through points (n, 3), its parameter the length of the polygon, with its arc length at them."""

    def __init__(self, points: ArrayLike) -> None:
        x = np.asarray(points, dtype=float)
        if x.ndim != 2 or x.shape[1] != 3 or len(x) < 2:
            raise ValueError(f"points: shape {x.shape}: must be (n, 3) with n ≥ 2")
        if not np.isfinite(x).all():
            raise ValueError("points: must be finite numbers")
        steps = np.linalg.norm(np.diff(x, axis=0), axis=1)
        if (same := np.flatnonzero(steps <= 1e-12 * steps.sum())).size:
            raise ValueError(f"points: {same[0]} and {same[0] + 1} are equal: must differ")
        self.knots = np.append(0.0, np.cumsum(steps))
        self._curve = CubicSpline(self.knots, x)
        self._rate = self._curve.derivative()
        self.arc = np.append(0.0, np.cumsum(self._arcs(self.knots[:-1], self.knots[1:])))

    def _speed(self, u: Floats) -> Floats:
        return np.asarray(np.linalg.norm(self._rate(u), axis=-1))

    def _arcs(self, start: Floats, end: Floats) -> Floats:
        half = (end - start) / 2
        u = (start + end)[:, None] / 2 + half[:, None] * X
        return np.asarray(half * (self._speed(u) @ W))

    def parameters(self, arc: Floats) -> Floats:
        """The parameters (N) at arc lengths (N), by Newton's method on the Gauss quadrature of each interval."""
        i = np.clip(np.searchsorted(self.arc, arc, side="right") - 1, 0, len(self.knots) - 2)
        part = (arc - self.arc[i]) / (self.arc[i + 1] - self.arc[i])
        u = self.knots[i] + part * (self.knots[i + 1] - self.knots[i])
        for _ in range(6):
            u = u - (self._arcs(self.knots[i], u) - (arc - self.arc[i])) / self._speed(u)
            u = np.clip(u, self.knots[i], self.knots[i + 1])
        return np.asarray(u)

    def nodes(self, u: Floats, arc: Floats, roll: float = 0.0) -> Centreline:
        """Nodes at parameters u (N) with rotation-minimising frames.

        Each frame is the one before, reflected in the bisecting planes of the edge and of the tangents: fourth order.

        Source: Wang, Jüttler, Zheng & Liu, ACM Trans. Graphics 27 (2008).
        """
        x, t = self._curve(u), self._rate(u)
        t /= np.linalg.norm(t, axis=1)[:, None]
        frames = np.empty((len(u), 3, 3))
        frames[0] = _first_frame(t[0], roll)
        for i in range(len(u) - 1):
            edge = x[i + 1] - x[i]
            mirrored = frames[i] - np.outer(edge, edge @ frames[i]) * (2 / (edge @ edge))
            kink = t[i + 1] - mirrored[:, 0]
            scale = kink @ kink
            d2 = mirrored[:, 1] - kink * (2 * (kink @ mirrored[:, 1]) / scale) if scale > 0 else mirrored[:, 1]
            d2 = d2 - t[i + 1] * (d2 @ t[i + 1])
            d2 /= np.linalg.norm(d2)
            frames[i + 1] = np.stack([t[i + 1], d2, np.cross(t[i + 1], d2)], axis=1)
        return Centreline(x, frames, arc, np.zeros(len(u) - 1, dtype=np.int64))


def _first_frame(t: Floats, roll: float) -> Floats:
    """Columns t, d₂, d₃ for a unit tangent (3); d₂ in the plane of t and the axis of coordinates farthest from it."""
    e = np.eye(3)[np.argmin(np.abs(t))]
    d2 = e - t * (t @ e)
    d2 /= np.linalg.norm(d2)
    d3 = np.cross(t, d2)
    return np.stack([t, np.cos(roll) * d2 + np.sin(roll) * d3, np.cos(roll) * d3 - np.sin(roll) * d2], axis=1)
