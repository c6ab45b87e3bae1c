"""Solid devices: tubes of catheters, balloons, blunt tips."""

from __future__ import annotations

import math

import numpy as np

from meshes.gmsh_model import Part, session, triangulate
from meshes.mesh import Mesh
from meshes.parameters import bad, choice, larger, positive
from meshes.planar import Side, draw
from meshes.refine import Refine
from meshes.shells import through
from meshes.solids import hemisphere
from meshes.walls import along, around, axis_of, swept


def catheter(
    radius: float,
    bore: float,
    length: float,
    h: float,
    bend: float | None = None,
    layers: int = 2,
    order: int = 2,
) -> Mesh:
    """A catheter's tube from the origin along z, straight or bent to a circle towards +x.

    Tags: ``lumen``, ``outer``, ``proximal`` (the end at the origin), ``distal``.

    Parameters
    ----------
    radius : outer radius [m]
    bore : radius of its lumen [m]
    length : of the axis [m]
    h : size of the cells along the axis and around the middle of the wall [m]
    bend : radius of the axis's circle [m], above the outer radius; straight where it is left out
    layers : of cells through the wall, at least 2
    order : 1 or 2
    """
    bore = positive("bore", bore)
    radius = larger("radius", radius, "bore", bore)
    length, h = positive("length", length), positive("h", h)
    choice("order", order, (1, 2))
    if bend is not None:
        bend = larger("bend", bend, "radius", radius)
        if length >= 2 * math.pi * bend:
            raise bad("length", length, f"below a whole turn of bend = {bend!r}")
    levels, _ = through(layers, None, order)
    centres, frames = axis_of(length, order * along(length, h) + 1, bend)
    inner, tags = np.full(len(centres), bore), ("lumen", "outer", "proximal", "distal")
    cells = around((bore + radius) / 2, h)
    return swept(centres, frames, inner, np.full(len(centres), radius), cells, order, levels, {}, tags)


def balloon(
    radius: float,
    neck: float,
    thickness: float,
    length: float,
    shoulder: float,
    h: float,
    layers: int = 2,
    order: int = 2,
) -> Mesh:
    """The membrane of a balloon about the z axis: a cylinder between two shoulders that end on the shaft.

    Over a shoulder the inner radius grows as sin² from the neck's to the balloon's; the middle is at the origin.
    Tags: ``inner``, ``outer``, ``proximal`` (the ring at the lower end), ``distal``.

    Parameters
    ----------
    radius, neck : inner radii of the cylinder and of the ends [m]
    thickness : across the axis [m]
    length : of the cylinder [m]
    shoulder : length of each shoulder along the axis [m]
    h : size of the cells along the profile and around the middle of the wall [m]
    layers : of cells through the membrane, at least 2
    order : 1 or 2
    """
    neck = positive("neck", neck)
    radius = larger("radius", radius, "neck", neck)
    t, length, shoulder, h = (
        positive(key, value)
        for key, value in (("thickness", thickness), ("length", length), ("shoulder", shoulder), ("h", h))
    )
    choice("order", order, (1, 2))
    levels, _ = through(layers, None, order)
    slope = np.linspace(0, shoulder, order * along(math.hypot(shoulder, radius - neck), h) + 1)
    rise = neck + (radius - neck) * np.sin(np.pi / 2 * slope / shoulder) ** 2
    flat = np.linspace(0, length, order * along(length, h) + 1)
    z = np.concatenate([slope - shoulder, flat[1:], length + slope[1:]]) - length / 2
    inner = np.concatenate([rise, np.full(len(flat) - 1, radius), rise[-2::-1]])
    centres, frames = axis_of(1.0, len(z), None)
    centres[:, 2] = z
    tags = ("inner", "outer", "proximal", "distal")
    return swept(centres, frames, inner, inner + t, around(radius + t / 2, h), order, levels, {}, tags)


def blunt_tip(radius: float, length: float, h: float, order: int = 1, refine: Refine | None = None) -> Mesh:
    """A solid rod about the z axis with a hemispherical end, whose pole is at the origin; 0 ≤ z ≤ length [m].

    Tags: ``tip`` (the hemisphere), ``side``, ``base`` (z = length).

    Parameters
    ----------
    radius : of the rod and of its tip [m]
    length : from the pole to the base, above the radius [m]
    h, order, refine : of the cells
    """
    R = positive("radius", radius)
    length = larger("length", length, "radius", R)
    with session() as gmsh:
        geo = gmsh.model.geo
        o = (0.0, 0.0)
        quarters = [Side("side", start, o) for start in [(R, 0.0), (0.0, R), (-R, 0.0), (0.0, -R)]]
        disc, arcs = draw(gmsh, quarters, R)
        (_, base), _, *walls = geo.extrude([(2, disc)], 0, 0, length - R)
        parts = [Part("base", base), *(Part("side", wall) for _, wall in walls)]
        parts += hemisphere(gmsh, disc, [arc.entity for arc in arcs], R, "tip")
        return triangulate(gmsh, 3, parts, h, order, refine)
