"""Plane domains bounded by straight lines and circular arcs, and sections of bodies of revolution."""

from __future__ import annotations

import math
from collections.abc import Sequence
from types import ModuleType
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from meshes.gmsh_model import Part, session, triangulate
from meshes.mesh import Mesh
from meshes.parameters import bad, larger, number, positive
from meshes.refine import Refine
from meshes.structured import Grading, PerAxis, axes_of, check_style, grid


class Side(NamedTuple):
    """A side of an outline, up to the next side's start: straight, or an arc of less than 180° about `centre`."""

    tag: str
    start: tuple[float, float]
    centre: tuple[float, float] | None = None


def draw(gmsh: ModuleType, outline: Sequence[Side], z: float = 0.0) -> tuple[int, list[Part]]:
    """Add the domain within a counter-clockwise outline, at height `z` [m]; the surface and its sides."""
    geo = gmsh.model.geo
    corners = [geo.addPoint(*side.start, z) for side in outline]
    parts = []
    for i, (tag, _, centre) in enumerate(outline):
        j = (i + 1) % len(outline)
        if centre is None:
            parts.append(Part(tag, geo.addLine(corners[i], corners[j])))
        else:
            parts.append(Part(tag, geo.addCircleArc(corners[i], geo.addPoint(*centre, z), corners[j])))
    return geo.addPlaneSurface([geo.addCurveLoop([part.entity for part in parts])]), parts


def plane(outline: Sequence[Side], h: float, order: int, refine: Refine | None) -> Mesh:
    """Mesh the domain within a counter-clockwise outline, in cells of size `h` [m]."""
    with session() as gmsh:
        _, sides = draw(gmsh, outline)
        return triangulate(gmsh, 2, sides, h, order, refine)


def rectangle(corner: Sequence[float], size: Sequence[float], tags: Sequence[str]) -> list[Side]:
    """Outline of [x, x + width] × [y, y + height]; tags of its left, right, lower and upper side."""
    (x0, y0), (width, height) = corner, size
    x1, y1 = x0 + width, y0 + height
    left, right, lower, upper = tags
    return [Side(lower, (x0, y0)), Side(right, (x1, y0)), Side(upper, (x1, y1)), Side(left, (x0, y1))]


def sector(inner: float, outer: float, angle: float) -> list[Side]:
    """Outline of the sector inner ≤ r ≤ outer [m], 0 ≤ θ ≤ angle [degrees]; of a disc where `inner` is 0."""
    inner, outer, angle = _check_sector(inner, outer, angle)
    ray = _rays(np.linspace(0, angle, math.ceil(angle / 90) + 1)).tolist()
    o = (0.0, 0.0)
    return [
        Side("start", (inner, 0.0)),
        *(Side("outer", (outer * c, outer * s), o) for c, s in ray[:-1]),
        Side("end", (outer * ray[-1][0], outer * ray[-1][1])),
        *(Side("inner", (inner * c, inner * s), o) for c, s in ray[:0:-1] if inner),
    ]


def _check_sector(inner: float, outer: float, angle: float) -> tuple[float, float, float]:
    if number("inner", inner) < 0:
        raise bad("inner", inner, "zero or a positive number")
    if not 0 < number("angle", angle) < 360:
        raise bad("angle", angle, "between 0 and 360 degrees")
    return float(inner), larger("outer", outer, "inner", inner), float(angle)


def _rays(angles: NDArray[np.float64]) -> NDArray[np.float64]:
    """cos and sin of angles [degrees], (…, 2), written so that multiples of 90° give exact zeros."""
    turned = np.where(np.abs(180 - angles) < np.abs(angles), 180 - angles, angles)
    return np.stack([np.sin(np.deg2rad(90 - angles)), np.sin(np.deg2rad(turned))], axis=-1)


def disc(radius: float, h: float, order: int = 1, refine: Refine | None = None) -> Mesh:
    """The disc r ≤ radius [m] about the origin; tag ``rim``."""
    R, o = positive("radius", radius), (0.0, 0.0)
    quarters = [Side("rim", start, o) for start in [(R, 0.0), (0.0, R), (-R, 0.0), (0.0, -R)]]
    return plane(quarters, h, order, refine)


def half_disc(radius: float, h: float, order: int = 1, refine: Refine | None = None) -> Mesh:
    """The half model of a lower half disc that is pressed at its pole: x ≥ 0, x² + (y − R)² ≤ R², y ≤ R = radius [m].

    The pole is at the origin. Tags: ``axis`` (x = 0), ``arc``, ``top`` (y = R).
    """
    R = positive("radius", radius)
    outline = [Side("arc", (0.0, 0.0), (0.0, R)), Side("top", (R, R)), Side("axis", (0.0, R))]
    return plane(outline, h, order, refine)


def sphere_section(radius: float, h: float, order: int = 1, refine: Refine | None = None) -> Mesh:
    """The section (r, z) of a lower half ball with its pole at the origin: r² + (z − R)² ≤ R², z ≤ R = radius [m].

    Tags: ``axis`` (r = 0), ``arc``, ``top`` (z = R).
    """
    return half_disc(radius, h, order, refine)


def ring(
    inner: float,
    outer: float,
    h: float | None = None,
    angle: float = 90.0,
    order: int = 1,
    refine: Refine | None = None,
    n: PerAxis[int] | None = None,
    structured: bool = False,
    grading: PerAxis[Grading] | None = None,
) -> Mesh:
    """The sector inner ≤ r ≤ outer [m] of a ring about the origin, from the x axis to `angle` [degrees].

    Tags: ``inner`` (none where it is 0: a sector of a disc), ``outer``, ``start`` (θ = 0), ``end`` (θ = angle).
    Cells may lie on a polar grid, all of its nodes on circles: `structured`, `n` and `grading` are then those of `box`
    for r and θ, and `h` the mean size along r and along the outer arc.
    """
    check_style(h, n, refine, structured, grading)
    if not structured:
        return plane(sector(inner, outer, angle), positive("h", h), order, refine)
    a, b, angle = _check_sector(inner, outer, angle)
    if a == 0:
        raise bad("inner", inner, "positive in a structured ring")
    r, s = axes_of((b - a, b * np.deg2rad(angle)), h, n, grading)
    flat = grid([a + r, s / s[-1] * angle], [("inner", "outer"), ("start", "end")], order)
    return Mesh(flat.points[:, :1] * _rays(flat.points[:, 1]), flat.cells, flat.facets)


def shell_section(inner: float, outer: float, h: float, order: int = 1, refine: Refine | None = None) -> Mesh:
    """The quarter section (r, z), z ≥ 0, of a spherical shell about the origin, radii [m].

    Tags: ``inner`` (none where it is 0: a ball), ``outer``, ``axis`` (r = 0), ``equator`` (z = 0).
    """
    names = {"start": "equator", "end": "axis"}
    outline = [side._replace(tag=names.get(side.tag, side.tag)) for side in sector(inner, outer, 90.0)]
    return plane(outline, h, order, refine)
