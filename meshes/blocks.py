"""Boxes and layers, structured or refined."""

from __future__ import annotations

from collections.abc import Sequence

from meshes.mesh import Mesh
from meshes.parameters import bad, positive, vector
from meshes.planar import plane, rectangle
from meshes.refine import Refine
from meshes.solids import prism
from meshes.structured import Grading, PerAxis, axes_of, check_style, grid


def box(
    size: Sequence[float],
    h: float | None = None,
    n: PerAxis[int] | None = None,
    order: int = 1,
    origin: Sequence[float] | None = None,
    refine: Refine | None = None,
    structured: bool = False,
    grading: PerAxis[Grading] | None = None,
) -> Mesh:
    """A rectangle or cuboid of simplices.

    Tags ``left``, ``right`` (least and largest x), ``bottom``, ``top`` (last coordinate) and in 3D ``front``, ``back``
    (y).

    Parameters
    ----------
    size : (2) or (3) [m]
    h : float [m]
        Size of the cells; of a structured box the mean size along each axis.
    n : int or one per axis
        Cells along each axis of a structured box, in place of `h`. Each is cut into 2 triangles or 6 tetrahedra.
    order : 1 or 2
    origin : (2) or (3) [m]
        The corner with the least coordinates, 0 unless given.
    refine : Refine
        Smaller cells somewhere, in a box that is not structured.
    structured : bool
        Cells on a grid, in plain numpy; otherwise Delaunay cells by gmsh.
    grading : number or callable, or one per axis
        For a structured box: size of the last cell over that of the first (above 1 concentrates cells at the origin),
        or an increasing map of [0, 1] onto itself.
    """
    size = tuple(positive(f"size[{i}]", x) for i, x in enumerate(vector("size", size, (2, 3))))
    corner = vector("origin", (0.0,) * len(size) if origin is None else origin, [len(size)])
    check_style(h, n, refine, structured, grading)
    if structured:
        sides = [("left", "right"), *([("front", "back")] if len(size) == 3 else []), ("bottom", "top")]
        axes = axes_of(size, h, n, grading)
        return grid([x + axis for x, axis in zip(corner, axes, strict=True)], sides, order)
    h = positive("h", h)
    if len(size) == 2:
        return plane(rectangle(corner, size, ("left", "right", "bottom", "top")), h, order, refine)
    base = rectangle(corner[:2], size[:2], ("left", "right", "front", "back"))
    return prism(base, corner[2], size[2], h, order, refine)


def layer(
    width: float,
    thickness: float,
    h: float | None = None,
    n: PerAxis[int] | None = None,
    order: int = 1,
    refine: Refine | None = None,
    structured: bool = False,
    grading: PerAxis[Grading] | None = None,
) -> Mesh:
    """The half model 0 ≤ x ≤ width, −thickness ≤ y ≤ 0 [m] of a plane layer that is pressed at the origin from above.

    Tags ``axis`` (x = 0), ``far`` (x = width), ``bottom`` (y = −thickness), ``top`` (y = 0). The other parameters are
    those of `box`; `grading` above 1 concentrates cells at the origin.
    """
    size = positive("width", width), positive("thickness", thickness)
    check_style(h, n, refine, structured, grading)
    if structured:
        x, depth = axes_of(size, h, n, grading)
        return grid([x, -depth], [("axis", "far"), ("top", "bottom")], order)
    outline = rectangle((0.0, -size[1]), size, ("axis", "far", "bottom", "top"))
    return plane(outline, positive("h", h), order, refine)


def domed_block(
    size: Sequence[float],
    radius: float,
    h: float | None = None,
    n: PerAxis[int] | None = None,
    order: int = 1,
    refine: Refine | None = None,
    structured: bool = False,
    grading: PerAxis[Grading] | None = None,
) -> Mesh:
    """A rectangle or cuboid from the origin; its top is a paraboloid of radius of curvature `radius` [m] at its pole.

    Its last coordinate is that of a box times 1 − r²/(2 radius·height), r from the axis. Tags and the other parameters
    are those of `box`.
    """
    radius = positive("radius", radius)
    flat = box(size, h, n, order, None, refine, structured, grading)
    height = float(size[-1])
    if sum(x**2 for x in size[:-1]) >= 2 * radius * height:
        raise bad("radius", radius, "so large that the top stays above the base")
    points = flat.points.copy()
    points[:, -1] *= 1 - (points[:, :-1] ** 2).sum(axis=1) / (2 * radius * height)
    return Mesh(points, flat.cells, flat.facets, flat.regions)
