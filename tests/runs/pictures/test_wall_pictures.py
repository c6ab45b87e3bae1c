"""The lining of a deformed wall: what looks at a device and at the eye."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np

from contact.record import Grid
from meshes.generators import generate
from runs.pictures.plane import Bodies, normals
from runs.pictures.walls import largest_motion, lining_of


def test_only_what_faces_the_device_and_the_eye_is_drawn() -> None:
    mesh = generate("tube-wall", radius=1.0, thickness=0.3, length=4.0, h=1.0)
    m, k = mesh.cells.shape
    u = 0.01 * mesh.points[:, [2, 0, 1]]
    grid = Grid(mesh.points, mesh.cells.ravel(), k * np.arange(m + 1), np.full(m, 24), np.zeros(m, dtype=int))
    frame = SimpleNamespace(bodies=Bodies(grid, u, np.zeros(len(u)), False, ""))
    axis, eye = np.column_stack([np.zeros((9, 2)), np.linspace(0, 4, 9)]), np.array([0.0, -1.0, 0.0])
    lining = lining_of(frame, axis, eye)  # type: ignore[arg-type]
    assert lining is not None
    x = lining.points - 0.0
    r = np.hypot(x[:, 0], x[:, 1])
    assert r.max() < 1.15  # of the lumen, deformed, not of the outer face
    corners = x[lining.triangles]
    assert np.all(normals(corners) @ eye > -0.1)
    area = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1).sum() / 2
    assert abs(area - np.pi * 4) < 0.12 * np.pi * 4  # half of the lumen
    assert abs(largest_motion(frame) - np.linalg.norm(u, axis=1).max()) < 1e-15  # type: ignore[arg-type]
