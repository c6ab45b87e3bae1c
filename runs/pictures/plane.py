"""Bodies as pictures: cells as filled patches and curves, outlines, shading and contact forces on matplotlib axes."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from contact.record import Grid
from contact.surfaces.implicit import Surface
from fem.elements import order_of, shape
from meshes.mesh import face_keys, face_table, faces_of
from meshes.simplices import face_nodes

if TYPE_CHECKING:
    from matplotlib.cm import ScalarMappable

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

# Okabe and Ito's palette, distinct for colour-blind readers (jfly.uni-koeln.de/color, 2008).
BLUE, VERMILLION, GREEN, ORANGE, SKY, PURPLE = "#0072B2", "#D55E00", "#009E73", "#E69F00", "#56B4E9", "#CC79A7"
GREY = "0.55"

MANY = 5000
"""From this many patches on, mesh lines are left out and patches are subdivided less."""

ARROW = 0.14
"""Length of the largest contact force over the diagonal of the bodies."""

CREASE = np.cos(np.deg2rad(30))
"""Faces that meet at a larger angle than this form an edge of the outline."""


class Patches(NamedTuple):
    """Lines or triangles of one order: nodes (m, k) in VTK's order, and the grid's cell (m,) that each one shows."""

    dim: int
    nodes: Ints
    cell: Ints


@dataclass(frozen=True, eq=False)
class Bodies:
    """What a picture of deformed bodies shows.

    Attributes
    ----------
    grid : Grid
    displacement : (n, 3) [m]
    values : (n,), or (cells,) where `in_cells`
    label : str
        Name and unit of `values`.
    """

    grid: Grid
    displacement: Floats
    values: Floats
    in_cells: bool
    label: str

    @property
    def positions(self) -> Floats:
        """Deformed positions (n, 3) [m]."""
        return np.asarray(self.grid.points + self.displacement)

    @cached_property
    def faces(self) -> list[Patches]:
        """The triangles of plane bodies and membranes, and the outer faces of solids."""
        plane = [Patches(2, *self._cells(kind)) for kind in (5, 22)]
        solid = [outer_faces(*self._cells(kind)) for kind in (10, 24) if (self.grid.types == kind).any()]
        return [patches for patches in plane + solid if len(patches.cell)]

    @cached_property
    def curves(self) -> list[Patches]:
        """The lines and polylines of one-dimensional bodies."""
        owner = np.repeat(np.arange(len(self.grid.types)), np.diff(self.grid.offsets))
        inside = (owner[:-1] == owner[1:]) & np.isin(self.grid.types[owner[:-1]], (3, 4))
        pairs = np.stack([self.grid.connectivity[:-1], self.grid.connectivity[1:]], axis=1)
        found = [Patches(1, pairs[inside], owner[:-1][inside]), Patches(1, *self._cells(21))]
        return [patches for patches in found if len(patches.cell)]

    @cached_property
    def in_space(self) -> bool:
        """Whether a picture needs three dimensions: there are solids, or surfaces that leave the plane z = 0."""
        return bool(np.isin(self.grid.types, (10, 24)).any() or (self.faces and self.positions[:, 2].any()))

    def shown(self, patches: Patches, parts: int) -> Floats:
        """`values` at the points of the subdivided patches, (m, q)."""
        if self.in_cells:
            return np.repeat(self.values[patches.cell][:, None], len(lattice(patches.dim, parts)), axis=1)
        return subdivided(patches, self.values, parts)

    def _cells(self, kind: int) -> tuple[Ints, Ints]:
        """Nodes and numbers of the cells of a VTK type."""
        cells = np.flatnonzero(self.grid.types == kind)
        size = int(np.diff(self.grid.offsets)[cells].max(initial=1))
        return np.asarray(self.grid.connectivity[self.grid.offsets[cells][:, None] + np.arange(size)]), cells


def outer_faces(nodes: Ints, cells: Ints) -> Patches:
    """The faces that one tetrahedron alone has, outward oriented."""
    outer = face_table(nodes[:, :4], 3).outer()
    return Patches(2, faces_of(nodes, 3, outer), cells[outer // 4])


def normals(corners: Floats) -> Floats:
    """Unit normals (t, 3) of triangles (t, 3, 3)."""
    n = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    return np.asarray(n / np.linalg.norm(n, axis=1, keepdims=True))


def edges(faces: Patches) -> Patches:
    """Every edge of the triangles, once."""
    first = face_table(faces.nodes[:, :3], 2).first
    return Patches(1, faces_of(faces.nodes, 2, first), faces.cell[first // 3])


def outline(points: Floats, faces: Patches) -> Patches:
    """The edges of one triangle alone, and those at which two triangles meet at more than 30°."""
    normal = normals(points[faces.nodes[:, :3]])
    key = face_keys(faces.nodes[:, face_nodes(2, 1)].reshape(-1, 2), len(points))
    order = np.argsort(key, kind="stable")
    same = key[order][1:] == key[order][:-1]
    first, second = order[:-1][same], order[1:][same]
    smooth = (normal[first // 3] * normal[second // 3]).sum(axis=1) > CREASE
    drawn = np.ones(len(key), dtype=bool)
    drawn[second] = False
    drawn[first[smooth]] = False
    found = np.flatnonzero(drawn)
    return Patches(1, faces_of(faces.nodes, 2, found), faces.cell[found // 3])


def lattice(dim: int, parts: int) -> Floats:
    """Equidistant points ξ of the unit line or triangle, `parts` to an edge, the first coordinate running fastest."""
    if dim == 1:
        return np.linspace(0, 1, parts + 1)[:, None]
    count = np.arange(parts + 1)
    j, i = np.nonzero(np.add.outer(count, count) <= parts)
    return np.stack([i, j], axis=1) / parts


def triangles(parts: int) -> Ints:
    """The parts² triangles (t, 3) between the points of `lattice` (2, parts)."""
    count = np.arange(parts)
    j, i = np.nonzero(np.add.outer(count, count) < parts)
    here = j * (parts + 1) - j * (j - 1) // 2 + i
    above = here + parts + 1 - j
    up = np.stack([here, here + 1, above], axis=1)
    down = np.stack([here + 1, above + 1, above], axis=1)[i + j < parts - 1]
    return np.concatenate([up, down])


def subdivided(patches: Patches, values: Floats, parts: int) -> Floats:
    """Nodal values (n, ...) interpolated to the points of the subdivided patches, (m, q, ...)."""
    N = shape(lattice(patches.dim, parts), order_of(patches.dim, patches.nodes.shape[1]))
    return np.asarray(np.einsum("qk,mk...->mq...", N, values[patches.nodes]))


def draw_plane(axes: Any, bodies: Bodies, style: dict[str, Any]) -> ScalarMappable:
    """Plane and one-dimensional bodies on ordinary axes; `style` holds ``cmap`` and ``norm``."""
    from matplotlib.cm import ScalarMappable
    from matplotlib.collections import LineCollection

    x = bodies.positions[:, :2]
    count = sum(len(faces.cell) for faces in bodies.faces)
    parts = 4 if count < MANY else 2
    for faces in bodies.faces:
        p = subdivided(faces, x, parts).reshape(-1, 2)
        value = bodies.shown(faces, parts)
        cells = (triangles(parts) + value.shape[1] * np.arange(len(value))[:, None, None]).reshape(-1, 3)
        axes.tripcolor(*p.T, cells, value.ravel(), shading="gouraud", rasterized=True, zorder=1, **style)
        if count < MANY:
            lines = subdivided(edges(faces), x, 2 * parts)
            axes.add_collection(LineCollection(list(lines), colors="black", linewidths=0.25, alpha=0.5, zorder=2))
        for points, colour, width in ((bodies.grid.points[:, :2], GREY, 1.0), (x, "black", 0.8)):
            lines = subdivided(outline(bodies.grid.points, faces), points, 2 * parts)
            axes.add_collection(
                LineCollection(list(lines), colors=colour, linewidths=width, zorder=3, capstyle="round", gid="outline")
            )
    for curves in bodies.curves:
        reference = subdivided(curves, bodies.grid.points[:, :2], 1)
        # A bar that moves along itself covers its reference: that is drawn wider.
        width = 1.0 if np.ptp(x[:, 1]) else 9.0
        axes.add_collection(LineCollection(list(reference), colors=GREY, linewidths=width, zorder=0.7))
        lines = subdivided(curves, x, 8)
        pieces = np.stack([lines[:, :-1], lines[:, 1:]], axis=2).reshape(-1, 2, 2)
        value = bodies.shown(curves, 8)
        piecewise = LineCollection(list(pieces), linewidths=3.5, zorder=2, capstyle="round", **style)
        piecewise.set_array((value[:, :-1] + value[:, 1:]).ravel() / 2)
        axes.add_collection(piecewise)
        if len(curves.cell) < 100:
            ends = x[np.unique(curves.nodes[:, :2])]
            axes.plot(*ends.T, "|", color="black", markersize=8, markeredgewidth=0.8, zorder=3)
    axes.autoscale_view()
    return ScalarMappable(**style)


def draw_space(axes: Any, bodies: Bodies, style: dict[str, Any], towards: Floats) -> ScalarMappable:
    """Outer surfaces, shaded, and one-dimensional bodies on 3D axes, seen from the side that `towards` points to."""
    from matplotlib.cm import ScalarMappable
    from mpl_toolkits.mplot3d.art3d import Line3DCollection, Poly3DCollection  # type: ignore[import-untyped]

    colours = ScalarMappable(**style)
    x = bodies.positions
    eye = towards / np.linalg.norm(towards)
    # The light stands to the side of the eye, so that faces of different directions differ.
    light = eye + 0.8 * np.array([-eye[1], eye[0], 0.3])
    light /= np.linalg.norm(light)
    count = sum(len(faces.cell) for faces in bodies.faces)
    # Solids hide their back faces; a membrane is seen from both sides.
    hidden = 0.0 if np.isin(bodies.grid.types, (10, 24)).any() else -np.inf
    for faces in bodies.faces:
        parts = 1 if faces.nodes.shape[1] == 3 or count >= 4 * MANY else 2
        corners = subdivided(faces, x, parts)[:, triangles(parts)].reshape(-1, 3, 3)
        value = bodies.shown(faces, parts)[:, triangles(parts)].mean(axis=2).ravel()
        normal = normals(corners)
        seen = normal @ eye > hidden
        colour = np.asarray(colours.to_rgba(value[seen]))
        colour[:, :3] *= 0.55 + 0.45 * np.abs(normal[seen] @ light)[:, None]
        axes.add_collection3d(
            Poly3DCollection(list(corners[seen]), facecolors=colour, edgecolors=colour, linewidths=0.3, zorder=1)
        )
        if count < MANY:
            front = faces.nodes[np.unique(np.flatnonzero(seen) // parts**2)]
            lines = subdivided(edges(Patches(2, front, front[:, 0])), x, 4)
            axes.add_collection3d(Line3DCollection(list(lines), colors="black", linewidths=0.25, alpha=0.3, zorder=2))
        for points, look in (
            (bodies.grid.points, {"color": GREY, "linewidth": 0.8}),
            (x, {"color": "black", "linewidth": 1}),
        ):
            front = faces.nodes[normals(points[faces.nodes[:, :3]]) @ eye > hidden]
            lines = subdivided(outline(points, Patches(2, front, front[:, 0])), points, 4)
            axes.add_collection3d(Line3DCollection(list(lines), zorder=3, **look))
    for curves in bodies.curves:
        axes.add_collection3d(Line3DCollection(list(subdivided(curves, x, 8)), colors="black", linewidths=2, zorder=2))
    axes.set_proj_type("ortho")
    axes.computed_zorder = False
    axes.locator_params(nbins=4)
    axes.tick_params(labelsize=8)
    axes.view_init(elev=np.rad2deg(np.arcsin(eye[2])), azim=np.rad2deg(np.arctan2(eye[1], eye[0])))
    return colours


def draw_obstacle(axes: Any, surface: Surface, dim: int) -> None:
    """Where g(x) < 0 in what plane axes show; `dim` is the number of coordinates that g takes."""
    (left, right), (low, high) = axes.get_xlim(), axes.get_ylim()
    x, y = np.meshgrid(np.linspace(left, right, 400), np.linspace(low, high, 400))
    g = surface.potential(np.stack([x.ravel(), y.ravel()], axis=1)[:, :dim]).reshape(x.shape)
    if (g < 0).any():
        axes.contourf(x, y, g, levels=[g.min(), 0.0], colors="0.88", zorder=0)
        axes.contour(x, y, g, levels=[0.0], colors="0.3", linewidths=1.0, zorder=0.5)


def draw_forces(axes: Any, points: Floats, forces: Floats, length: float, label: str, zorder: float) -> None:
    """Contact points (c, d) and their forces (c, d) as arrows that end at them, the largest `length` [m] long."""
    largest = np.linalg.norm(forces, axis=1).max()
    arrows = forces * (length / largest)
    tails = points - arrows
    size = 4 if len(points) < 40 else 2
    axes.plot(*points.T, ".", color=VERMILLION, markersize=size, zorder=zorder, label=label)
    if points.shape[1] == 3:
        axes.quiver(*tails.T, *arrows.T, color=VERMILLION, linewidth=0.6, arrow_length_ratio=0.12, zorder=zorder)
        return
    look = {
        "color": VERMILLION,
        "angles": "xy",
        "scale_units": "xy",
        "scale": 1,
        "width": 0.004 if size == 4 else 0.0015,
    }
    axes.quiver(*tails.T, *arrows.T, zorder=zorder, **look)
    axes.update_datalim(tails)
    axes.autoscale_view()
