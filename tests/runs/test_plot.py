"""Pictures show what the record holds: places, pressures, forces, colours, residuals, rates."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from matplotlib.collections import LineCollection, PolyQuadMesh, TriMesh

from contact.record import CERTIFICATE, Grid, Record, StepData
from meshes.mesh import Mesh
from meshes.structured import grid as structured
from runs.pictures import (
    Bodies, Patches, edges, lattice, outer_faces, outline, subdivided, triangles,
)  # fmt: skip
from runs.plot import arc_length, plot_record, plot_study, record_figure, slope, study_figure, study_lines, von_mises

A, P0, DEPTH = 0.3, 0.16, 0.09
EXACT = f"{P0} * sqrt(where(x**2 + y**2 < {A}**2, 1 - (x**2 + y**2)/{A}**2, 0))"
RESIDUALS = dict(zip(CERTIFICATE, (1.2e-12, 3.4e-13, 5.6e-9, 0.0), strict=True))


def record(path: Path, meshes: list[Mesh], scene: str, converged: bool = True, **data: Any) -> Path:
    """A record with one step; `data` replaces the fields of a step that has no contact."""
    kinds = {(1, 2): 3, (1, 3): 21, (2, 3): 5, (2, 6): 22, (3, 4): 10, (3, 10): 24}
    first = np.cumsum([0, *[len(m.points) for m in meshes]])
    cells = [start + m.cells for start, m in zip(first, meshes, strict=False)]
    sizes = np.concatenate([np.full(len(c), c.shape[1]) for c in cells])
    grid = Grid(
        points=np.concatenate([np.pad(m.points, ((0, 0), (0, 3 - m.dim))) for m in meshes]),
        connectivity=np.concatenate([c.ravel() for c in cells]),
        offsets=np.append(0, np.cumsum(sizes)),
        types=np.concatenate([np.full(len(c), kinds[m.dim, c.shape[1]]) for m, c in zip(meshes, cells, strict=True)]),
        body=np.repeat(np.arange(len(meshes)), [len(c) for c in cells]),
    )
    count = len(data.get("lam", []))
    empty: dict[str, Any] = {
        "point_data": {"displacement": np.zeros(grid.points.shape)},
        "cell_data": {}, "lam": np.zeros(0), "point": np.zeros((0, 3)), "normal": np.zeros((0, 3)),
    }  # fmt: skip
    data = empty | data
    with Record.create(path, grid, scene, {"unknowns": 4321}) as file:
        file.append(
            StepData(
                time=1.0, dt=1.0, substeps=1, passes=2, iterations=3, contacts=count, converged=converged,
                certificate=RESIDUALS, seconds={}, gap=np.zeros(count), body=np.zeros(count, dtype=int),
                status=(np.asarray(data["lam"]) > 0).astype(int), checkpoint={}, **data,
            )  # fmt: skip
        )
    return path


def pressed(x: np.ndarray) -> np.ndarray:
    """A smooth motion (n, 3) that pushes the pole of the lower side into the body, which ends at height 1."""
    r2 = (x[:, :-1] ** 2).sum(axis=1)
    u = np.zeros((len(x), 3))
    decay = (1 - x[:, -1]) ** 2
    u[:, x.shape[1] - 1] = DEPTH * decay / (1 + r2 / A**2)
    u[:, 0] = -0.2 * DEPTH * decay * x[:, 0]
    return u


def stressed(centres: np.ndarray) -> np.ndarray:
    """A stress (m, 6) that fades with the distance from the pole."""
    s = np.zeros((len(centres), 6))
    s[:, centres.shape[1] - 1] = -P0 / (1 + (centres**2).sum(axis=1) / A**2)
    return s


def touching(mesh: Mesh, tag: str) -> dict[str, Any]:
    """Step data for elliptic pressures at the nodes of a facet on the plane below, and forces ∝ pressure."""
    nodes = np.unique(mesh.facet(tag))
    x = mesh.points[nodes]
    u = pressed(mesh.points)
    p = P0 * np.sqrt(np.clip(1 - (x**2).sum(axis=1) / A**2, 0, None))
    pressure = np.zeros(len(mesh.points))
    pressure[nodes] = p
    normal = np.tile(np.eye(3)[mesh.dim - 1], (len(nodes), 1))
    return {
        "point_data": {"displacement": u, "contact_pressure": pressure},
        "cell_data": {"stress": stressed(mesh.points[mesh.cells].mean(axis=1))},
        "lam": 0.01 * p, "normal": normal,
        "point": np.pad(x, ((0, 0), (0, 3 - mesh.dim))) + u[nodes],
    }  # fmt: skip


def block(n: int) -> Mesh:
    """Half a block: P2 triangles on the unit square."""
    return structured([np.linspace(0, 1, n + 1)] * 2, [("left", "right"), ("bottom", "top")], 2)


def cube(n: int) -> Mesh:
    """A quarter of a block: P2 tetrahedra on the unit cube."""
    sides = [("left", "right"), ("front", "back"), ("bottom", "top")]
    return structured([np.linspace(0, 1, n + 1) ** 1.5] * 3, sides, 2)


def scene(surface: str) -> str:
    return f"title = 'Line contact'\n[[contact]]\nsurface = {surface}\n[exact]\npressure = '{EXACT}'\n"


PARABOLA = f"{{kind = 'paraboloid', origin = [0.0, {DEPTH}], radius = 1.0}}"


@pytest.fixture(scope="module")
def plane(tmp_path_factory: pytest.TempPathFactory) -> tuple[Mesh, Path]:
    mesh = block(16)
    path = tmp_path_factory.mktemp("plot") / "plane.vtkhdf"
    return mesh, record(path, [mesh], scene(PARABOLA), **touching(mesh, "bottom"))


def bar() -> tuple[list[Mesh], str]:
    """A bar of length 1 whose end has moved by .2 onto a wall, as the arguments of `record` but for its path."""
    return [Mesh(np.linspace(0, 1, 11)[:, None], np.stack([np.arange(10), np.arange(1, 11)], axis=1))], (
        "title = 'Bar'\n[[contact]]\nsurface = {kind = 'plane', point = [1.2], normal = [-1.0]}\n"
    )


def stopped(mesh: Mesh) -> dict[str, Any]:
    u = np.pad(0.2 * mesh.points, ((0, 0), (0, 2)))
    return {
        "point_data": {"displacement": u, "contact_pressure": np.zeros(11)},
        "cell_data": {"stress": np.zeros((10, 6))},
        "lam": np.array([0.7]), "point": np.array([[1.2, 0, 0]]), "normal": np.array([[-1.0, 0, 0]]),
    }  # fmt: skip


def study() -> list[dict[str, Any]]:
    """Rows of two methods and two orders whose errors are h and h^1.5."""
    return [
        {
            "case": "transition", "method": method, "order": order, "h": h, "dofs": round(2 * (order / h) ** 2),
            "quantities": {"h1_error": {"error": (0.4, 0.3)[order - 1] * h ** (0.5 + order / 2)}, "exactly": {"error": 0.0}},
            "time": {"total": cost * (order / h) ** 2.2},
        }
        for method, cost in (("status", 1e-4), ("gauss-seidel", 6e-4))
        for order in (1, 2)
        for h in (1 / 8, 1 / 16, 1 / 32, 1 / 64)
    ]  # fmt: skip
