"""Vessel walls: tubes along an axis, straight, bent or free, swept from a ring; middle nodes on the geometry."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from meshes.mesh import Mesh
from meshes.parameters import bad, choice, count, larger, positive, vector
from meshes.shells import edges_of, thicken, through, triangles_of

Floats = NDArray[np.float64]

LEAST_AROUND = 8
"""Cells around a tube: a quadratic cell of 45° still follows its circle to 2e-3 of the radius."""


FINER = 4
"""Places between two stations of a centreline where its curvature is looked at."""


def around(radius: float, h: float) -> int:
    """An even number of cells of size `h` [m] around a circle, at least `LEAST_AROUND`."""
    return max(LEAST_AROUND, 2 * math.ceil(math.pi * radius / h - 1e-9))


def along(length: float, h: float) -> int:
    """The number of cells of size `h` [m] along a line."""
    return max(1, math.ceil(length / h - 1e-9))


def swept(
    centres: Floats,
    frames: Floats,
    inner: Floats,
    outer: Floats,
    cells: int,
    order: int,
    levels: Floats,
    regions: dict[str, NDArray[np.int64]],
    tags: tuple[str, str, str, str] = ("lumen", "outer", "inlet", "outlet"),
) -> Mesh:
    """The tube about an axis with circular sections across it.

    Parameters
    ----------
    centres, frames : of order·m + 1 stations, (s, 3) [m] and (s, 3, 3), columns t, d₂, d₃
    inner, outer : radii there, (s) [m]
    cells : around
    levels : from 0 at the inner to 1 at the outer radius
    regions : by name, layers of cells
    tags : of the inner and outer face and of the first and last section
    """
    ring, stations = cells * order, len(centres)
    theta = 2 * np.pi * np.arange(ring) / ring
    rho = inner + levels[:, None] * (outer - inner)  # (levels, s)
    spokes = np.cos(theta)[None, :, None] * frames[:, None, :, 1] + np.sin(theta)[None, :, None] * frames[:, None, :, 2]
    points = centres[None, :, None, :] + rho[:, :, None, None] * spokes  # (levels, s, ring, 3)
    index = np.arange(stations * ring).reshape(stations, ring).T
    index = np.concatenate([index, index[:1]])
    rims = {tags[2]: edges_of(index[:, 0], order), tags[3]: edges_of(index[:, -1], order)}
    return thicken(triangles_of(index, order), rims, points.reshape(len(levels), -1, 3), tags[:2], regions)


def axis_of(length: float, stations: int, bend: float | None) -> tuple[Floats, Floats]:
    """Points (s, 3) and frames (s, 3, 3) of an axis from the origin along z, straight or in a circle to +x.

    `length` and the circle's radius `bend` in [m].
    """
    s = np.linspace(0, length, stations)
    zero, one = np.zeros_like(s), np.ones_like(s)
    if bend is None:
        centres, c, sn = np.stack([zero, zero, s], axis=1), one, zero
    else:
        c, sn = np.cos(s / bend), np.sin(s / bend)
        centres = bend * np.stack([2 * np.sin(s / bend / 2) ** 2, zero, sn], axis=1)
    frames = np.stack([np.stack(d, axis=1) for d in ([sn, zero, c], [c, zero, -sn], [zero, one, zero])], axis=2)
    return centres, frames


def tube_wall(
    radius: float,
    thickness: float,
    length: float,
    h: float,
    bend: float | None = None,
    layers: int = 2,
    media: float | None = None,
    order: int = 2,
) -> Mesh:
    """A tube of constant radius from the origin along z, straight or bent to a circle towards +x.

    Tags: ``lumen``, ``outer``, ``inlet``, ``outlet``; regions ``media`` and ``adventitia`` where `media` is given.

    Parameters
    ----------
    radius : of the lumen [m]
    thickness : of the wall [m]
    length : of the axis [m]
    h : the size of the cells along the axis and around the middle of the wall is at most this [m]
    bend : radius of the axis's circle [m], above the outer radius; straight where it is left out
    layers : of cells through the wall, at least 2
    media : the inner layer's part of the thickness, between 0 and 1; the outer one is the adventitia
    order : 1 or 2
    """
    r, t, length, h = (
        positive(key, value)
        for key, value in (("radius", radius), ("thickness", thickness), ("length", length), ("h", h))
    )
    choice("order", order, (1, 2))
    if bend is not None:
        bend = larger("bend", bend, "radius + thickness", r + t)
        if length >= 2 * math.pi * bend:
            raise bad("length", length, f"below a whole turn of bend = {bend!r}")
    levels, regions = through(layers, media, order)
    centres, frames = axis_of(length, order * along(length, h) + 1, bend)
    inner = np.full(len(centres), r)
    return swept(centres, frames, inner, inner + t, around(r + t / 2, h), order, levels, regions)


def vessel_wall(
    centreline: Sequence[Sequence[float]] | str,
    h: float,
    thickness: float | None = None,
    ratio: float | None = None,
    scale: float | None = None,
    vessel: int | None = None,
    part: Sequence[float] | None = None,
    spacing: float | None = None,
    layers: int = 2,
    media: float | None = None,
    order: int = 2,
) -> Mesh:
    """A wall about a centreline: a cubic spline through its points, radii monotone between them.

    Tags and regions are those of `tube_wall`. Sections are across the axis and do not twist about it.

    Parameters
    ----------
    centreline : rows x, y, z, radius of the lumen [m], or the name of an SWC file
    h : size of the cells along the axis and around the widest place [m]
    thickness : of the wall [m], or
    ratio : thickness over the lumen's radius, at each place
    scale : the unit of the file [m], 1e-3 for mm
    vessel : which of the file's vessels, 0 (the default) the one that starts at the root; each runs on into its widest
        branch
    part : from where to where along the vessel, two lengths from its start [m]; all of it where it is left out
    spacing : of the points of the spline along a file's centreline [m], the vessel's mean diameter where it is left
        out; measured points lie closer than their errors allow a smooth curve
    layers, media, order : see `tube_wall`
    """
    from scipy.interpolate import PchipInterpolator  # splines: only where a wall follows a centreline

    from meshes.centrelines import along as laid
    from meshes.centrelines import polyline

    h, order = positive("h", h), choice("order", order, (1, 2))
    if (thickness is None) == (ratio is None):
        raise bad("thickness, ratio", [thickness, ratio], "given one and not the other")
    levels, regions = through(layers, media, order)
    rows = _rows(centreline, scale, vessel, part, spacing)
    try:
        knots = polyline(rows[:, :3]).arc
    except ValueError as error:
        raise ValueError(f"centreline: {error}") from None
    # Curvature is measured between the stations too.
    line = laid(rows[:, :3], FINER * order * along(float(knots[-1]), h))
    inner = np.asarray(PchipInterpolator(knots, rows[:, 3])(line.arc))
    outer = inner * (1 + positive("ratio", ratio)) if thickness is None else inner + positive("thickness", thickness)
    kappa = np.linalg.norm(np.diff(line.frames[:, :, 0], axis=0), axis=1) / np.diff(line.arc)
    tight = kappa * np.maximum(outer[1:], outer[:-1])
    if tight.max() >= 1:
        at = int(np.argmax(tight))
        raise ValueError(
            f"centreline: its radius of curvature is {1 / kappa[at]:.3g} at {line.arc[at]:.3g} from its start: must be "
            f"above the outer radius {outer[at]:.3g} there; a larger spacing smooths it"
        )
    points, frames, inner, outer = (each[::FINER] for each in (line.points, line.frames, inner, outer))
    cells = around(float((inner + outer).max()) / 2, h)
    return swept(points, frames, inner, outer, cells, order, levels, regions)


def _rows(
    centreline: Sequence[Sequence[float]] | str,
    scale: float | None,
    vessel: int | None,
    part: Sequence[float] | None,
    spacing: float | None,
) -> Floats:
    """Rows x, y, z, r of the centreline's points [m]."""
    if not isinstance(centreline, str | Path):
        for key, value in (("scale", scale), ("vessel", vessel), ("part", part), ("spacing", spacing)):
            if value is not None:
                raise bad(key, value, "left out unless centreline is a file")
        if not isinstance(centreline, Sequence | np.ndarray) or len(centreline) < 2:
            raise bad("centreline", centreline, "at least two rows x, y, z, r, or the name of an SWC file")
        rows = np.array([vector(f"centreline[{i}]", row, (4,)) for i, row in enumerate(centreline)])
        if (low := np.flatnonzero(rows[:, 3] <= 0)).size:
            raise bad(f"centreline[{low[0]}][3]", rows[low[0], 3], "a positive radius")
        return rows
    from meshes.vessels import read_swc

    if scale is None:
        raise ValueError("scale: missing, must be given with a file")
    tree = read_swc(Path(centreline), positive("scale", scale))
    chains = tree.chains()
    which = 0 if vessel is None else count("vessel", vessel + 1 if isinstance(vessel, int) else vessel) - 1
    if which >= len(chains):
        raise bad("vessel", vessel, f"from 0 to {len(chains) - 1}: the file has {len(chains)}")
    x, r = tree.points[chains[which]], tree.radii[chains[which]].copy()
    if tree.parents[chains[which][0]] >= 0 or which:
        r[0] = r[1]  # a side branch starts on its parent's axis with its own radius
    s = np.append(0.0, np.cumsum(np.linalg.norm(np.diff(x, axis=0), axis=1)))
    start, end = (0.0, float(s[-1])) if part is None else vector("part", part, (2,))
    if not 0 <= start < end <= s[-1] * (1 + 1e-9):
        raise bad("part", part, f"two increasing lengths from 0 to {s[-1]:.6g}")
    inside = (s >= start) & (s <= end)
    spacing = 2 * float(r[inside].mean() if inside.any() else r.mean()) if spacing is None else spacing
    at = np.linspace(start, end, along(end - start, positive("spacing", spacing)) + 1)
    return np.stack([np.interp(at, s, column) for column in (*x.T, r)], axis=1)
