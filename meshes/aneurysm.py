"""The wall of a straight vessel with a saccular aneurysm: a tube, a fillet and a sphere with one tangent plane.

The lumen's nodes lie on these three surfaces, and those further out on the surfaces parallel to them, x + t n(x). About
the dome's axis X the fillet is, at each angle φ, a cubic Bézier curve σ(u), x(u, φ) in a half-plane, from the tube to
the sphere, with the tangents of both.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from meshes.gmsh_model import session
from meshes.mesh import Mesh
from meshes.parameters import bad, choice, larger, positive
from meshes.shells import edges_of, thicken, through, triangles_of
from meshes.structured import quadratic
from meshes.walls import along, around

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

CAP = math.pi / 3
"""Angle between the dome's pole and its cap's rim: rings of 6, 12, 18 … cells are then as wide as the equator's."""


FILLET = 4
"""Cells along the fillet, which turns by less than half a turn."""


class Patch(NamedTuple):
    """A part of the lumen: triangles on its own nodes, the nodes (n, 3) [m] and the unit normals out of the lumen."""

    triangles: Ints
    points: Floats
    normals: Floats


class _Shape(NamedTuple):
    """Radii of the tube R, the sphere a, the neck n and the fillet f; the tube's length.

    At φ = 0 the fillet follows a circle that touches the tube at σ = n + f and the sphere from outside.
    """

    R: float
    a: float
    n: float
    f: float
    length: float

    @property
    def rim(self) -> float:
        """Distance of the fillet's rim on the tube from the dome's axis."""
        return self.n + self.f

    @property
    def beta(self) -> float:
        """Angle between the sphere's lowest point and the ring where it meets the fillet."""
        return math.asin(self.rim / (self.a + self.f))

    @property
    def centre(self) -> float:
        """Height of the sphere's centre over the tube's axis."""
        return self.R + self.f + (self.a + self.f) * math.cos(self.beta)

    def place(self, sigma: Floats, phi: Floats, x: Floats) -> Floats:
        """Points at distance σ from the dome's axis, the angle φ about it from the tube's axis z, and height x."""
        return np.stack([x, sigma * np.sin(phi), self.length / 2 + sigma * np.cos(phi)], axis=-1)

    def fillet(self, phi: Floats, u: Floats) -> tuple[Floats, Floats]:
        """Points and normals at angles φ and 0 ≤ u ≤ 1."""
        slope = math.cos(self.beta), math.sin(self.beta)
        handle = 4 / 3 * math.tan((math.pi - self.beta) / 4) * self.f  # of a circle's arc by a cubic Bézier curve
        root = np.sqrt(self.R**2 - (self.rim * np.sin(phi)) ** 2)
        lean = self.rim * np.sin(phi) ** 2 / root  # −dx/dσ of the tube along the half-plane
        root_phi = -(self.rim**2) * np.sin(phi) * np.cos(phi) / root
        lean_phi = (2 * np.sin(phi) * np.cos(phi) * self.rim - lean * root_phi) / root
        zero, width, top = np.zeros_like(phi), self.a * slope[1], self.centre - self.a * slope[0]
        sigma = [self.rim + zero, self.rim - handle + zero, width - handle * slope[0] + zero, width + zero]
        x = [root, root + handle * lean, top - handle * slope[1] + zero, top + zero]
        x_phi = [root_phi, root_phi + handle * lean_phi, zero, zero]
        B = [(1 - u) ** 3, 3 * u * (1 - u) ** 2, 3 * u**2 * (1 - u), u**3]
        D = [3 * (1 - u) ** 2, 6 * u * (1 - u), 3 * u**2]
        s, height, turn = (sum(b * value for b, value in zip(B, c, strict=True)) for c in (sigma, x, x_phi))
        s_u, x_u = (sum(d * (q - p) for d, p, q in zip(D, c[:-1], c[1:], strict=True)) for c in (sigma, x))
        outward, around_, up = s * x_u, turn * s_u, -s * s_u
        normals = np.stack(
            [
                up,
                outward * np.sin(phi) + around_ * np.cos(phi),
                outward * np.cos(phi) - around_ * np.sin(phi),
            ],
            axis=-1,
        )
        return self.place(s, phi, height), normals / np.linalg.norm(normals, axis=-1)[..., None]

    def sphere(self, phi: Floats, angle: Floats) -> tuple[Floats, Floats]:
        """Points and normals at angles φ about the dome's axis and `angle` from its pole."""
        normals = self.place(np.sin(angle), phi, np.cos(angle)) - np.array([0.0, 0.0, self.length / 2])
        return self.a * normals + np.array([self.centre, 0.0, self.length / 2]), normals


def aneurysm_wall(
    radius: float,
    thickness: float,
    length: float,
    dome: float,
    neck: float,
    h: float,
    fillet: float | None = None,
    layers: int = 2,
    media: float | None = None,
    order: int = 2,
) -> Mesh:
    """A tube from the origin along z with a spherical dome on its side towards +x, at half its length.

    The wall has the same thickness along its normal everywhere. Tags and regions are those of `tube_wall`.

    Parameters
    ----------
    radius : of the vessel's lumen [m]
    thickness : of the wall [m]
    length : of the vessel [m]
    dome : radius of the aneurysm's lumen [m]
    neck : radius of the lumen between vessel and dome, where it is narrowest [m], below the dome's
    h : size of the cells [m]; at the neck they are smaller
    fillet : radius of the rounding between vessel and dome [m], above the thickness, twice that where left out;
        neck + fillet is below 0.95 of the vessel's radius
    layers, media, order : see `tube_wall`
    """
    R, t, length, h = (
        positive(key, value)
        for key, value in (("radius", radius), ("thickness", thickness), ("length", length), ("h", h))
    )
    choice("order", order, (1, 2))
    neck = positive("neck", neck)
    shape = _Shape(R, larger("dome", dome, "neck", neck), neck, 2 * t if fillet is None else fillet, length)
    shape = shape._replace(f=larger("fillet", shape.f, "thickness", t))
    if shape.rim >= 0.95 * R:
        raise bad("neck", neck, f"below 0.95 radius − fillet = {0.95 * R - shape.f:.6g}")
    if length <= 2 * (shape.rim + h):
        raise bad("length", length, f"above 2 (neck + fillet + h) = {2 * (shape.rim + h):.6g}")
    levels, regions = through(layers, media, order)
    ring = 6 * math.ceil(2 * math.pi * max(shape.a, shape.rim) / (6 * h) - 1e-9)
    parts = [_sleeve(shape, ring, h, order), _dome(shape, ring, h, order)]
    triangles, points, normals = _joined(parts, order * ring)
    ends = {tag: edges_of(_circle(points, z, R), order) for tag, z in (("inlet", 0.0), ("outlet", length))}
    return thicken(triangles, ends, points + t * levels[:, None, None] * normals, regions=regions)


def _sleeve(shape: _Shape, ring: int, h: float, order: int) -> Patch:
    """The tube without what is inside the fillet's rim; its first nodes are those of the rim, in order of φ."""
    R, length = shape.R, shape.length
    phi = 2 * np.pi * np.arange(order * ring) / (order * ring)
    rim = np.stack([np.arcsin(shape.rim * np.sin(phi) / R) * R, length / 2 + shape.rim * np.cos(phi)], axis=1)
    with session() as gmsh:
        geo, width = gmsh.model.geo, np.pi * R
        corners = [geo.addPoint(y, z, 0) for y, z in [(-width, 0), (width, 0), (width, length), (-width, length)]]
        sides = [geo.addLine(p, q) for p, q in zip(corners, corners[1:] + corners[:1], strict=True)]
        holes = [geo.addPoint(y, z, 0) for y, z in rim[::order]]
        lines = [geo.addLine(p, q) for p, q in zip(holes, holes[1:] + holes[:1], strict=True)]
        geo.addPlaneSurface([geo.addCurveLoop(sides), geo.addCurveLoop(lines)])
        geo.synchronize()
        mesh, fine = gmsh.model.mesh, 2 * np.pi * shape.rim / ring
        for line, n in zip(sides, [around(R, h), along(length, h)] * 2, strict=True):
            mesh.setTransfiniteCurve(line, n + 1)
        for line in lines:
            mesh.setTransfiniteCurve(line, 2)
        # Cells grow from the rim, where they are as small as around the neck.
        mesh.setSizeCallback(
            lambda _dim, _tag, y, z, _x, _size: min(h, fine + 0.4 * max(0.0, math.hypot(y, z - length / 2) - shape.rim))
        )
        mesh.generate(2)
        tags, coordinates, _ = mesh.getNodes()
        _, _, nodes = mesh.getElements(2)
    number = np.zeros(int(tags.max()) + 1, dtype=np.int64)
    number[tags] = np.arange(len(tags))
    flat: Floats = coordinates.reshape(-1, 3)[:, :2]
    cells: Ints = number[nodes[0]].reshape(-1, 3)
    if order == 2:
        flat, cells = quadratic(flat, cells)
    # The rim's nodes first, with their middles on it, and one node for the two edges of the unrolled tube.
    chords = rim.copy()
    if order == 2:
        chords[1::2] = (rim[::2] + np.roll(rim[::2], -1, axis=0)) / 2
    at_rim = _nearest(flat, chords)
    same = np.arange(len(flat))
    right, left = (np.flatnonzero(np.abs(flat[:, 0] - y) < 1e-9 * R) for y in (np.pi * R, -np.pi * R))
    same[right] = left[_nearest(flat[left, 1:], flat[right, 1:])]
    kept: Ints = np.concatenate([at_rim, np.setdiff1d(np.unique(same), at_rim)])
    place = np.empty(len(flat), dtype=np.int64)
    place[kept] = np.arange(len(kept))
    flat = flat[kept]
    flat[: len(rim)] = rim
    theta = flat[:, 0] / R
    normals = np.stack([np.cos(theta), np.sin(theta), 0 * theta], axis=1)
    points = R * normals
    points[:, 2] = flat[:, 1]
    return Patch(place[same[cells]], points, normals)


def _dome(shape: _Shape, ring: int, h: float, order: int) -> Patch:
    """The fillet and the sphere; its first nodes are those of the rim, in order of φ."""
    n_fillet = max(FILLET, along(shape.f * (math.pi - shape.beta) + shape.R - math.sqrt(shape.R**2 - shape.rim**2), h))
    n_sphere = along(shape.a * (math.pi - shape.beta - CAP), h)
    u = np.linspace(0, 1, order * n_fillet + 1)
    angle = np.linspace(math.pi - shape.beta, CAP, order * n_sphere + 1)[1:]
    phi = 2 * np.pi * np.arange(order * ring) / (order * ring)
    parts = [shape.fillet(*np.meshgrid(phi, u)), shape.sphere(*np.meshgrid(phi, angle))]
    rows = sum(len(points) for points, _ in parts)
    index = np.arange(rows * len(phi)).reshape(rows, -1)
    lattice = np.concatenate([index, index[:, :1]], axis=1)
    triangles = triangles_of(lattice, order)
    disc, cells = _disc(ring // 6, order)
    cells = cells[:, [0, 2, 1] if order == 1 else [0, 2, 1, 5, 4, 3]]  # φ runs clockwise about the dome's axis
    polar = np.hypot(*disc.T)
    tip = shape.sphere(np.arctan2(disc[:, 1], disc[:, 0]), CAP * polar)
    # The disc's rim is the lattice's last row.
    edge = order * ring
    names = np.concatenate([index[-1], rows * len(phi) + np.arange(len(disc) - edge)])
    joined = [[part[k].reshape(-1, 3) for part in parts] + [tip[k][edge:]] for k in (0, 1)]
    points, normals = (np.concatenate(part) for part in joined)
    return Patch(np.concatenate([triangles, names[cells]]), points, normals)


def _disc(rings: int, order: int) -> tuple[Floats, Ints]:
    """The unit disc by rings of 6, 12, 18 … cells, counter-clockwise; nodes of its rim first, from angle 0."""
    radii = np.arange(rings, -1, -1)
    starts = np.append(0, np.cumsum(6 * radii[:-1]))
    points = [np.zeros((1, 2))]
    for k in radii[:-1][::-1]:
        turn = 2 * np.pi * np.arange(6 * k) / (6 * k)
        points.insert(0, k / rings * np.stack([np.cos(turn), np.sin(turn)], axis=1))
    cells = []
    for k, outer, inner in zip(radii[:-1], starts[:-1], starts[1:], strict=True):
        for sector in range(6):
            i = np.arange(k)
            out = outer + (sector * k + np.append(i, k)) % (6 * k)
            inn = inner + (sector * (k - 1) + np.arange(k)) % max(6 * (k - 1), 1)
            cells.append(np.stack([out[:-1], out[1:], inn], axis=1))
            cells.append(np.stack([out[1:-1], inn[1:], inn[:-1]], axis=1))
    vertices, triangles = np.concatenate(points), np.concatenate(cells)
    if order == 1:
        return vertices, triangles
    nodes, triangles = quadratic(vertices, triangles)
    rim = 6 * rings
    turn = 2 * np.pi * (np.arange(rim) + 0.5) / rim
    exact = np.stack([np.cos(turn), np.sin(turn)], axis=1)
    middles = _nearest(nodes, (vertices[:rim] + np.roll(vertices[:rim], -1, axis=0)) / 2)
    nodes[middles] = exact
    first = np.empty(2 * rim, dtype=np.int64)
    first[::2], first[1::2] = np.arange(rim), middles
    order_ = np.concatenate([first, np.setdiff1d(np.arange(len(nodes)), first)])
    place = np.empty(len(nodes), dtype=np.int64)
    place[order_] = np.arange(len(nodes))
    return nodes[order_], place[triangles]


def _joined(parts: list[Patch], shared: int) -> tuple[Ints, Floats, Floats]:
    """Two patches whose first `shared` nodes are the same."""
    one, two = parts
    n = len(one.points)
    number = np.append(np.arange(shared), n + np.arange(len(two.points) - shared))
    points = np.concatenate([one.points, two.points[shared:]])
    normals = np.concatenate([one.normals, two.normals[shared:]])
    return np.concatenate([one.triangles, number[two.triangles]]), points, normals


def _circle(points: Floats, z: float, R: float) -> Ints:
    """The nodes of the tube's end at z, closed, in order around it."""
    nodes = np.flatnonzero((np.abs(points[:, 2] - z) < 1e-9 * R) & (np.hypot(points[:, 0], points[:, 1]) < R * 1.001))
    nodes = nodes[np.argsort(np.arctan2(points[nodes, 1], points[nodes, 0]))]
    return np.append(nodes, nodes[0])


def _nearest(among: Floats, of: Floats) -> Ints:
    """For each point of `of` (k, d) the nearest of `among` (n, d)."""
    return np.array([int(np.argmin(((among - x) ** 2).sum(axis=1))) for x in of], dtype=np.int64)
