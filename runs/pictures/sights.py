"""What pictures of devices look at: the walls, as they are seen by the contacts, the devices' shapes and the views.

Every obstacle is drawn as the zero level of its potential.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from scipy.interpolate import CubicSpline
from scipy.spatial import cKDTree

from contact.surfaces.implicit import Surface
from runs.pictures.frame import Frame
from runs.pictures.plane import Floats, Ints
from runs.pictures.walls import largest_motion

FINE, COARSE = 900, 280
"""The wall's grid resolves the smallest vessel in sight by four cells a radius, between these parts of the diagonal."""

CORNERS = np.array([[i, j, k] for k in (0, 1) for j in (0, 1) for i in (0, 1)])
"""Corners of a cell in the order of VTK's voxel."""


class Wall(NamedTuple):
    """Triangles (m, 3) of the zero level of a potential: points and unit normals to the allowed side, (n, 3)."""

    points: Floats
    normals: Floats
    triangles: Ints


class View(NamedTuple):
    """A parallel projection: unit vectors to the right, upwards and to the eye, and what it shows [m]."""

    right: Floats
    up: Floats
    eye: Floats
    centre: Floats
    width: float
    height: float


@dataclass(frozen=True, eq=False)
class Sight:
    """What all pictures of a record have in common.

    Attributes
    ----------
    walls : list of Wall
    views : the front and the side
    size : diagonal of what is looked at [m]
    top : contact force at the end of the colours [N]
    moved : displacement of solids at the end of theirs [m]; 0 where there are none
    """

    walls: list[Wall]
    views: tuple[View, View]
    size: float
    top: float
    moved: float = 0.0


def wall_of(surface: Surface, low: Floats, high: Floats, spacing: float) -> Wall:
    """The zero level of a surface's potential in the box from `low` to `high` by marching cubes of side `spacing` [m].

    Cells four times as large are divided twice, after those are left out that the surface's bound of the distance
    excludes: time and memory grow with the area of the wall. Three Newton steps along ∇g bring the points onto it.
    """
    import pyvista

    count = np.maximum(np.ceil((high - low) / (4 * spacing)).astype(np.int64), 1)
    cells = np.stack(np.meshgrid(*(np.arange(n) for n in count), indexing="ij"), axis=-1).reshape(-1, 3)
    for parts in (4, 2, 1):
        side = parts * spacing
        near = np.abs(surface.lower_bound(low + (cells + 0.5) * side)) <= np.sqrt(0.75) * side
        cells = cells[near]
        if parts > 1:
            cells = (2 * cells[:, None] + CORNERS).reshape(-1, 3)
    strides = np.cumprod([1, *(4 * count[:2] + 1)])
    keys, corner = np.unique((cells[:, None] + CORNERS) @ strides, return_inverse=True)
    corner = corner.reshape(-1, 8)
    index = np.stack(np.unravel_index(keys, 4 * count + 1, order="F"), axis=1)
    points = low + index * spacing
    g = surface.potential(points)
    crossed = (g[corner] > 0).any(axis=1) & (g[corner] <= 0).any(axis=1)
    if not crossed.any():
        return Wall(np.zeros((0, 3)), np.zeros((0, 3)), np.zeros((0, 3), dtype=np.int64))
    grid = pyvista.UnstructuredGrid({pyvista.CellType.VOXEL: corner[crossed]}, points)
    level = grid.contour([0.0], scalars=g)
    x = np.asarray(level.points, dtype=float)
    for _ in range(3):
        g, n = surface.potential(x), surface.gradient(x)
        step = -(g / np.maximum((n**2).sum(axis=1), 1e-300))[:, None] * n
        x += step * np.minimum(1.0, 0.5 * spacing / np.maximum(np.linalg.norm(step, axis=1), 1e-300))[:, None]
    n = surface.gradient(x)
    return Wall(x, n / np.maximum(np.linalg.norm(n, axis=1), 1e-300)[:, None], level.regular_faces)


def beams_of(frame: Frame) -> list[Ints]:
    """The nodes of each beam, from end to end."""
    grid, radius = frame.bodies.grid, frame.point_data["radius"]
    lines = np.flatnonzero(grid.types == 3)
    pairs = grid.connectivity[grid.offsets[lines][:, None] + [0, 1]]
    pairs, body = pairs[radius[pairs[:, 0]] > 0], grid.body[lines][radius[pairs[:, 0]] > 0]
    return [np.append(pairs[body == b, 0], pairs[body == b, 1][-1]) for b in np.unique(body)]


def smooth(x: Floats, r: Floats, parts: int = 6) -> tuple[Floats, Floats]:
    """A cubic spline through the nodes x (n, 3) of a beam, `parts` pieces an element, and the radius along it."""
    s = np.append(0.0, np.cumsum(np.linalg.norm(np.diff(x, axis=0), axis=1)))
    at = np.interp(np.arange(parts * (len(x) - 1) + 1) / parts, np.arange(len(x)), s)
    return np.asarray(CubicSpline(s, x)(at)), np.interp(at, s, r)


def focus(x: Floats, r: Floats) -> Floats:
    """The nodes of a beam to look at: all, or where that is less than half of its extent, those in front.

    A stretch behind them that is straight but for play is shown over a third of the size of what is in front of it.
    """
    chord = np.linalg.norm(x - x[0], axis=1)
    straight = [k for k in range(2, len(x)) if _off_chord(x[: k + 1]) < min(2 * r[0], 0.01 * chord[k])]
    first = max(straight, default=0)
    size = np.linalg.norm(np.ptp(x[first:], axis=0))
    shown = (np.linalg.norm(x - x[first], axis=1) < size / 3) | (np.arange(len(x)) >= first)
    extents = [np.linalg.norm(np.ptp(part, axis=0)) for part in (x[shown], x)]
    if first == len(x) - 1 or extents[0] > extents[1] / 2:
        return x
    seen: Floats = x[shown]
    return seen


def _off_chord(x: Floats) -> float:
    """The largest distance of points from the line through the first and the last [m]."""
    t = (x[-1] - x[0]) / np.linalg.norm(x[-1] - x[0])
    away = x - x[0]
    return float(np.linalg.norm(away - (away @ t)[:, None] * t, axis=1).max())


def sight_of(frame: Frame, surfaces: Sequence[Surface], top: float) -> Sight:
    """What pictures of a record show when they are to show this step."""
    x, r = frame.bodies.positions, frame.point_data["radius"]
    seen = np.concatenate([focus(x[beam], r[beam]) for beam in beams_of(frame)])
    extent = float(np.linalg.norm(np.ptp(seen, axis=0)))
    low, high = seen.min(axis=0) - 0.45 * extent, seen.max(axis=0) + 0.45 * extent
    size = float(np.linalg.norm(high - low))
    walls = [wall_of(surface, low, high, _spacing(surface, low, high, size)) for surface in surfaces]
    shown = [seen - 2 * r.max(), seen + 2 * r.max()]
    tree = cKDTree(seen)
    for wall in walls:
        if len(wall.points):
            # The wall about the device is in the picture, and as much again of what comes behind it.
            gap = cKDTree(wall.points).query(seen)[0].max()
            shown.append(wall.points[tree.query(wall.points)[0] < 1.5 * gap])
    for faces in frame.bodies.faces:
        nodes = np.unique(faces.nodes)
        shown.append(x[nodes[tree.query(x[nodes])[0] < 8 * r.max()]])
    return Sight(walls, views_of(np.concatenate(shown)), extent, top, largest_motion(frame))


def _spacing(surface: Surface, low: Floats, high: Floats, size: float) -> float:
    """A quarter of the radius of the thinnest segment in the box, between the bounds of the resolution [m]."""
    segments = getattr(surface, "segments", np.zeros((0, 8)))
    inside = ((segments[:, :3] > low) & (segments[:, :3] < high)).all(axis=1)
    thinnest = float(segments[inside, 6:8].min(initial=np.inf)) if segments.shape[1] == 8 else np.inf
    return float(np.clip(thinnest / 4, size / FINE, size / COARSE))


def views_of(x: Floats) -> tuple[View, View]:
    """The front, where points x (n, 3) are flattest, and the side, at one scale; both are seen a little from above."""
    extent = np.ptp(x, axis=0)
    across = int(np.argmin(extent))
    up, towards = np.eye(3)[2 if across < 2 else 1], np.eye(3)[across]
    # Right, up and towards the eye are a right-handed system, with positive coordinates to the right in front.
    front = np.array([0, -1, 0]) if across == 1 else towards
    side = np.cross(up, front)
    frames = []
    for eye in (front + 0.35 * side, side - 0.35 * front):
        eye = eye / np.linalg.norm(eye) + 0.36 * up
        eye /= np.linalg.norm(eye)
        right = np.cross(up, eye) / np.linalg.norm(np.cross(up, eye))
        frames.append(np.stack([right, np.cross(eye, right), eye]))
    low, high = (np.stack([f(x @ axes.T, axis=0) for axes in frames]) for f in (np.min, np.max))
    width, height = 1.06 * (high - low)[:, 0], 1.06 * float((high - low)[:, 1].max())
    # Neither a strip nor a tower.
    height = max(height, float(width.sum()) / 3.2)
    width *= max(1.0, 1.5 * height / float(width.sum()))
    centres = [(a + b) / 2 @ axes for a, b, axes in zip(low, high, frames, strict=True)]
    one, two = (
        View(axes[0], axes[1], axes[2], c, float(w), height) for axes, c, w in zip(frames, centres, width, strict=True)
    )
    return one, two
