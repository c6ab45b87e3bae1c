"""The wall of a bifurcation: three tubes of one radius that meet along ellipses, from where two of them taper."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from meshes.mesh import Mesh
from meshes.parameters import bad, choice, positive, vector
from meshes.shells import edges_of, thicken, through, triangles_of
from meshes.walls import along, around

Floats = NDArray[np.float64]


def bifurcation_wall(
    radius: float,
    thickness: float,
    length: float,
    h: float,
    angles: Sequence[float] = (35.0, 35.0),
    radii: Sequence[float] | None = None,
    lengths: Sequence[float] | None = None,
    layers: int = 2,
    media: float | None = None,
    order: int = 2,
) -> Mesh:
    """A parent vessel along z up to the origin, and two branches in the plane y = 0, the first one towards +x.

    Axes meet at the origin. Tubes of equal radii meet where the bisecting plane of their axes cuts them, on ellipses;
    beyond, each branch tapers to its own radius. Tags: ``lumen``, ``outer``, ``inlet`` (the parent's end),
    ``outlet-1``, ``outlet-2``; regions as of `tube_wall`.

    Parameters
    ----------
    radius : of the parent's lumen [m]
    thickness : of the wall [m]
    length : of the parent [m]
    h : size of the cells along the axes and around the middle of the parent's wall [m]
    angles : of the branches with the parent's axis [degrees], from 0, together above 0 and at most 180
    radii : of the branches' lumens at their ends [m]; both 2^(−1/3) of the parent's (Murray 1926) where left out
    lengths : of the branches [m], as the parent's where left out
    layers, media, order : see `tube_wall`
    """
    r, t, length, h = (
        positive(key, value)
        for key, value in (("radius", radius), ("thickness", thickness), ("length", length), ("h", h))
    )
    choice("order", order, (1, 2))
    first, second = vector("angles", angles, (2,))
    if min(first, second) < 0 or not 0 < first + second <= 180:
        raise bad("angles", list(angles), "two angles from 0 degrees, together above 0 and at most 180")
    ends = (2 ** (-1 / 3) * r,) * 2 if radii is None else vector("radii", radii, (2,))
    reach = (length, *((length,) * 2 if lengths is None else vector("lengths", lengths, (2,))))
    ends = (r, *(positive(f"radii[{i}]", value) for i, value in enumerate(ends)))
    levels, regions = through(layers, media, order)

    # Axes by their angle φ in the plane, from the parent's −z over +x; tangents of half the angles between neighbours.
    phi = np.deg2rad([0.0, 180.0 - first, 180.0 + second, 360.0])
    cot = 1 / np.tan(np.diff(phi) / 2)
    straight = (r + t) * np.maximum(cot, np.roll(cot, 1))  # how far each tube reaches into the junction
    for key, value, least in zip(("length", "lengths[0]", "lengths[1]"), reach, straight, strict=True):
        if positive(key, value) <= least:
            raise bad(key, value, f"above {least:.6g}, where its junction with the others ends")

    half = around(r + t / 2, h) // 2 * order  # node to node from the top y = +r to the bottom on either side
    psi = np.linspace(np.pi / 2, -np.pi / 2, half + 1)
    c, s = np.cos(psi), np.sin(psi)
    c[[0, -1]] = 0.0
    # Nodes: top and bottom, the inner nodes of the three seams, and then those of each tube beyond its first ring.
    seams = [np.concatenate([[0], 2 + k * (half - 1) + np.arange(half - 1), [1]]) for k in range(3)]
    count = 2 + 3 * (half - 1)
    triangles, rims, tubes = [], {}, []
    for k, tag in enumerate(("inlet", "outlet-1", "outlet-2")):
        stations = order * along(reach[k], h)
        ring = np.concatenate([seams[k], seams[k - 1][-2:0:-1]])
        rest = count + np.arange(stations * 2 * half).reshape(stations, 2 * half)
        index = np.concatenate([ring[None], rest]).T
        index = np.concatenate([index, index[:1]])
        triangles.append(triangles_of(index, order))
        rims[tag] = edges_of(index[:, -1], order)
        tubes.append(index[:-1])
        count += rest.size

    points = np.empty((len(levels), count, 3))
    rho = r + t * levels[:, None, None]
    for k, index in enumerate(tubes):
        axis, across = np.array([[np.sin(phi[k]), 0, -np.cos(phi[k])], [np.cos(phi[k]), 0, np.sin(phi[k])]])
        side = np.concatenate([c, -c[-2:0:-1]])
        up = np.concatenate([s, s[-2:0:-1]])
        cut = np.concatenate([c * cot[k], c[-2:0:-1] * cot[k - 1]])
        start = rho * cut[:, None]
        z = start + np.linspace(0, 1, index.shape[1]) * (reach[k] - start)  # along the axis, (levels, ring, stations)
        part = np.clip((z - straight[k]) / (reach[k] - straight[k]), 0, 1)
        wide = rho + (ends[k] - r) * np.sin(np.pi / 2 * part) ** 2
        radial = side[:, None, None] * across + up[:, None, None] * np.array([0.0, 1.0, 0.0])
        points[:, index] = z[..., None] * axis + wide[..., None] * radial
    return thicken(np.concatenate(triangles), rims, points, regions=regions)
