"""The deformed walls about devices: the faces of solids that look at a device and at the eye, cut open towards it."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from runs.pictures.frame import Frame
from runs.pictures.plane import Floats, Ints, normals, subdivided, triangles

PARTS = 3  # of a face's edge


class Lining(NamedTuple):
    """Triangles (t, 3) of points (n, 3) [m], and how far these have moved, (n) [m]."""

    points: Floats
    triangles: Ints
    moved: Floats


def lining_of(frame: Frame, devices: Floats, eye: Floats) -> Lining | None:
    """What is seen of the solids behind `devices`, points (n, 3); None where there are none."""
    x, u = frame.bodies.positions, frame.bodies.displacement
    parts, at = [], 0
    tree = cKDTree(devices)
    for faces in frame.bodies.faces:
        corners = x[faces.nodes[:, :3]]
        n, middle = normals(corners), corners.mean(axis=1)
        away = devices[tree.query(middle)[1]] - middle
        seen = (np.einsum("fi,fi->f", n, away) > 0) & (n @ eye > 0)
        chosen = faces._replace(nodes=faces.nodes[seen], cell=faces.cell[seen])
        points = subdivided(chosen, x, PARTS)
        m, q, _ = points.shape
        shown = triangles(PARTS)[None] + q * np.arange(m)[:, None, None]
        moved = np.linalg.norm(subdivided(chosen, u, PARTS), axis=-1)
        parts.append((points.reshape(-1, 3), at + shown.reshape(-1, 3), moved.ravel()))
        at += m * q
    if not at:
        return None
    points, faces_, moved = (np.concatenate(part) for part in zip(*parts, strict=True))
    return Lining(points, faces_, moved)


def largest_motion(frame: Frame) -> float:
    """Of the solids' nodes [m]; 0 where there are none."""
    nodes = [np.unique(faces.nodes) for faces in frame.bodies.faces]
    moved: NDArray[np.float64] = np.linalg.norm(frame.bodies.displacement, axis=1)
    return max((float(moved[part].max(initial=0.0)) for part in nodes), default=0.0)
