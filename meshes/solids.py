"""Solids: prisms over plane domains, and octants of balls and spherical shells."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from types import ModuleType

import numpy as np

from meshes.gmsh_model import Part, session, triangulate
from meshes.mesh import Mesh
from meshes.parameters import larger, positive, vector
from meshes.planar import Side, draw, sector
from meshes.refine import Refine

type Point = tuple[float, float, float]


def prism(outline: Sequence[Side], bottom: float, length: float, h: float, order: int, refine: Refine | None) -> Mesh:
    """The solid over a counter-clockwise outline, bottom ≤ z ≤ bottom + length [m]; adds the tags of its ends."""
    with session() as gmsh:
        base, sides = draw(gmsh, outline, bottom)
        (_, top), _, *walls = gmsh.model.geo.extrude([(2, base)], 0, 0, length)
        faces = [side._replace(entity=wall) for side, (_, wall) in zip(sides, walls, strict=True)]
        ends = [Part("bottom", base), Part("top", top)]
        return triangulate(gmsh, 3, [*faces, *ends], h, order, refine)


def hollow_cylinder(
    inner: float,
    outer: float,
    length: float,
    h: float,
    angle: float = 90.0,
    order: int = 1,
    refine: Refine | None = None,
) -> Mesh:
    """The sector inner ≤ r ≤ outer [m], 0 ≤ θ ≤ angle [degrees], of a tube along z, 0 ≤ z ≤ length [m].

    Tags: ``inner``, ``outer``, ``start`` (θ = 0), ``end`` (θ = angle), ``bottom`` (z = 0), ``top`` (z = length).
    """
    return prism(sector(inner, outer, angle), 0.0, positive("length", length), h, order, refine)


def spherical(
    centre: Point,
    corners: Mapping[str, Point],
    faces: Mapping[str, str],
    h: float,
    order: int,
    refine: Refine | None,
) -> Mesh:
    """A solid of plane faces through a centre and of faces on spheres about it.

    Parameters
    ----------
    centre : (3) [m]
    corners : by a letter, (3) [m]
    faces : by tag, the letters of the corners in turn
        Corners at one distance from the centre are joined by arcs, others by straight lines; a face whose corners are
        all at one distance is on the sphere.
    """
    radius = {name: float(np.linalg.norm(np.subtract(x, centre))) for name, x in corners.items()}
    with session() as gmsh:
        geo = gmsh.model.geo
        middle = geo.addPoint(*centre)
        at = {name: middle if radius[name] == 0 else geo.addPoint(*x) for name, x in corners.items()}
        edges: dict[str, int] = {}

        def edge(a: str, b: str) -> int:
            if b + a in edges:
                return -edges[b + a]
            if a + b not in edges:
                arc = radius[a] == radius[b]
                edges[a + b] = geo.addCircleArc(at[a], middle, at[b]) if arc else geo.addLine(at[a], at[b])
            return edges[a + b]

        parts = []
        for tag, names in faces.items():
            loop = geo.addCurveLoop([edge(a, b) for a, b in zip(names, names[1:] + names[0], strict=True)])
            if len({radius[name] for name in names}) == 1:
                parts.append(Part(tag, geo.addSurfaceFilling([loop], sphereCenterTag=middle)))
            else:
                parts.append(Part(tag, geo.addPlaneSurface([loop])))
        geo.addVolume([geo.addSurfaceLoop([part.entity for part in parts])])
        return triangulate(gmsh, 3, parts, h, order, refine)


def hemisphere(gmsh: ModuleType, disc: int, arcs: Sequence[int], radius: float, tag: str) -> list[Part]:
    """The half ball with its pole at the origin under a disc at z = radius [m] within four arcs; its round side."""
    geo = gmsh.model.geo
    centre, pole = geo.addPoint(0, 0, radius), geo.addPoint(0, 0, 0)
    geo.synchronize()
    starts = [gmsh.model.getBoundary([(1, arc)], combined=False)[0][1] for arc in arcs]
    meridians = [geo.addCircleArc(start, centre, pole) for start in starts]
    parts = []
    for arc, here, there in zip(arcs, meridians, meridians[1:] + meridians[:1], strict=True):
        loop = geo.addCurveLoop([-here, arc, there])
        parts.append(Part(tag, geo.addSurfaceFilling([loop], sphereCenterTag=centre)))
    geo.addVolume([geo.addSurfaceLoop([disc, *(part.entity for part in parts)])])
    return parts


def half_ellipsoid(radii: Sequence[float], h: float, order: int = 1) -> Mesh:
    """The lower half (x/a)² + (y/b)² + (z/c − 1)² ≤ 1, z ≤ c, of an ellipsoid with its pole at the origin.

    Tags: ``ellipsoid``, ``top`` (z = c).

    Parameters
    ----------
    radii : a, b, c [m]
    h : size of the cells [m], the geometric mean over the three directions, along which they are stretched alike
    order : 1 or 2
    """
    a, b, c = (positive(f"radii[{i}]", value) for i, value in enumerate(vector("radii", radii, (3,))))
    R = (a * b * c) ** (1 / 3)
    with session() as gmsh:
        o = (0.0, 0.0)
        quarters = [Side("rim", start, o) for start in [(R, 0.0), (0.0, R), (-R, 0.0), (0.0, -R)]]
        disc, arcs = draw(gmsh, quarters, R)
        parts = [Part("top", disc), *hemisphere(gmsh, disc, [arc.entity for arc in arcs], R, "ellipsoid")]
        ball = triangulate(gmsh, 3, parts, h, order, None)
    return Mesh(ball.points * np.array([a, b, c]) / R, ball.cells, ball.facets)


def sphere_octant(radius: float, h: float, order: int = 1, refine: Refine | None = None) -> Mesh:
    """The quarter x, y ≥ 0 of a lower half ball with its pole at the origin: |(x, y, z − R)| ≤ R = radius [m], z ≤ R.

    Tags: ``x0`` and ``y0`` (symmetry planes x = 0 and y = 0), ``top`` (z = R), ``sphere``.
    """
    R = positive("radius", radius)
    centre = (0.0, 0.0, R)
    corners = {"C": centre, "P": (0.0, 0.0, 0.0), "X": (R, 0.0, R), "Y": (0.0, R, R)}
    # A patch with three corners is parametrised from its first: that is not the pole, where contact is.
    faces = {"x0": "CYP", "y0": "CPX", "top": "CXY", "sphere": "XYP"}
    return spherical(centre, corners, faces, h, order, refine)


def shell_octant(inner: float, outer: float, h: float, order: int = 1, refine: Refine | None = None) -> Mesh:
    """The octant x, y, z ≥ 0 of a spherical shell about the origin, radii [m].

    Tags: ``inner``, ``outer``, ``x0``, ``y0``, ``z0`` (symmetry planes x = 0, y = 0, z = 0).
    """
    a = positive("inner", inner)
    b = larger("outer", outer, "inner", a)
    corners = {
        name: point
        for r, (x, y, z) in ((a, "xyz"), (b, "XYZ"))
        for name, point in ((x, (r, 0.0, 0.0)), (y, (0.0, r, 0.0)), (z, (0.0, 0.0, r)))
    }
    faces = {"inner": "xyz", "outer": "XYZ", "x0": "yYZz", "y0": "zZXx", "z0": "xXYy"}
    return spherical((0.0, 0.0, 0.0), corners, faces, h, order, refine)
