"""Pictures show what the record holds: places, pressures, forces, colours, residuals, rates."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from matplotlib.collections import TriMesh

from contact.record import CERTIFICATE, Grid, Record, StepData
from meshes.mesh import Mesh
from meshes.structured import grid as structured
from runs.pictures.frame import arc_length, von_mises
from runs.pictures.plane import Patches, lattice, outer_faces, outline, subdivided, triangles
from runs.plot import plot_record, record_figure

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
                time=1.0,
                dt=1.0,
                substeps=1,
                passes=2,
                iterations=3,
                contacts=count,
                converged=converged,
                certificate=RESIDUALS,
                seconds={},
                gap=np.zeros(count),
                body=np.zeros(count, dtype=int),
                status=(np.asarray(data["lam"]) > 0).astype(int),
                checkpoint={},
                **data,
            )
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


@pytest.fixture(scope="module")
def plane(tmp_path_factory: pytest.TempPathFactory) -> tuple[Mesh, Path, Any]:
    mesh = block(16)
    path = tmp_path_factory.mktemp("plot") / "plane.vtkhdf"
    record(path, [mesh], scene(PARABOLA), **touching(mesh, "bottom"))
    return mesh, path, record_figure(path)


def lines(axes: Any) -> dict[str, np.ndarray]:
    """Drawn data (n, 2) by label."""
    return {line.get_label(): np.column_stack(line.get_data()) for line in axes.get_lines()}


def test_pressures_are_those_of_the_record_and_of_the_expression(plane: tuple[Mesh, Path, Any]) -> None:
    mesh, _, figure = plane
    drawn = lines(figure.axes[-1])
    x = np.sort(mesh.points[np.unique(mesh.facet("bottom")), 0])
    inside = x < A
    active = drawn[f"computed, active ({inside.sum()})"]
    idle = drawn[f"computed, not active ({(~inside).sum()})"]
    assert np.allclose(
        active, np.stack([x, P0 * np.sqrt(np.clip(1 - x**2 / A**2, 0, None))], axis=1)[inside], atol=1e-14
    )
    assert np.array_equal(idle, np.stack([x, 0 * x], axis=1)[~inside])
    s, p = drawn["exact"].T
    assert (s[0], s[-1]) == (0, 1)
    assert np.allclose(p, P0 * np.sqrt(np.clip(1 - s**2 / A**2, 0, None)), atol=1e-14)
    assert figure.axes[-1].get_ylabel() == "contact pressure p [Pa]"


def test_bodies_are_drawn_deformed_and_coloured_by_von_mises_stress(plane: tuple[Mesh, Path, Any]) -> None:
    mesh, _, figure = plane
    (cells,) = (c for c in figure.axes[0].collections if isinstance(c, TriMesh))
    x = mesh.points + pressed(mesh.points)[:, :2]
    corners = np.stack([cells._triangulation.x, cells._triangulation.y], axis=1)
    assert np.allclose(np.ptp(corners, axis=0), np.ptp(x, axis=0))
    # Stress is uniaxial: von Mises' is its size, in every one of the 15 points of a subdivided cell.
    expected = np.abs(stressed(mesh.points[mesh.cells].mean(axis=1))[:, 1])
    assert np.allclose(np.asarray(cells.get_array()).reshape(len(mesh.cells), 15), expected[:, None])


def test_arrows_end_at_active_points_and_are_scaled_by_lambda(plane: tuple[Mesh, Path, Any]) -> None:
    mesh, _, figure = plane
    data = touching(mesh, "bottom")
    active = data["lam"] > 0
    quiver = next(c for c in figure.axes[0].collections if hasattr(c, "U"))
    assert np.allclose(quiver.V / quiver.V.max(), data["lam"][active] / data["lam"].max())
    assert not quiver.U.any()
    assert np.allclose(quiver.XY + np.stack([quiver.U, quiver.V], axis=1), data["point"][active, :2])


def test_titles_and_footer_state_scale_certificate_and_sizes(plane: tuple[Mesh, Path, Any]) -> None:
    _, _, figure = plane
    assert figure._suptitle.get_text() == "Line contact,  t = 1 s"
    assert "true scale (×1), largest displacement 0.09 m" in figure.axes[0].get_title()
    footer = figure._supxlabel.get_text()
    for part in ("complementarity 1.2e-12", "surface error 5.6e-09", "unknowns 4321", "contacts 33", "active 10"):
        assert part in footer


def test_bar_is_drawn_with_its_force(tmp_path: Path) -> None:
    meshes, text = bar()
    path = record(tmp_path / "bar.vtkhdf", meshes, text, converged=False, **stopped(meshes[0]))
    figure = record_figure(path)
    assert lines(figure.axes[-1])["computed, active (1)"].tolist() == [[1.0, 0.7]]
    assert figure.axes[-1].get_ylabel() == "contact force λ [N]"
    coloured = next(c for c in figure.axes[0].collections if c.get_array() is not None)
    ends = np.concatenate(coloured.get_segments())
    assert np.allclose([ends[:, 0].min(), ends[:, 0].max()], [0, 1.2])
    # Colours show |u| = .2 X at the middles of the pieces.
    assert np.allclose(coloured.get_array(), 0.2 / 1.2 * np.mean(coloured.get_segments(), axis=1)[:, 0])
    assert figure._suptitle.get_text().endswith("NOT CONVERGED")


def test_solid_shows_pressure_over_the_radius_from_the_obstacles_pole(tmp_path: Path) -> None:
    mesh = cube(4)
    surface = f"{{kind = 'paraboloid', origin = [0.0, 0.0, {DEPTH}], radius = 1.0}}"
    path = record(tmp_path / "cube.vtkhdf", [mesh], scene(surface), **touching(mesh, "bottom"))
    figure = record_figure(path)
    drawn = lines(figure.axes[-1])
    r = np.sort(np.linalg.norm(mesh.points[np.unique(mesh.facet("bottom"))], axis=1))
    exact = P0 * np.sqrt(np.clip(1 - r**2 / A**2, 0, None))
    active = drawn[f"computed, active ({(r < A).sum()})"]
    assert np.allclose(active, np.stack([r, exact], axis=1)[r < A])
    assert np.allclose(np.interp(r, *drawn["exact"].T), exact, atol=0.02 * P0)
    plot_record(path, tmp_path / "cube.png")
    assert (tmp_path / "cube.png").read_bytes()[:4] == b"\x89PNG"


def test_step_without_contact_and_missing_steps(tmp_path: Path) -> None:
    path = record(tmp_path / "free.vtkhdf", [block(2)], "title = 'Free'")
    assert record_figure(path).axes[-1].texts[0].get_text() == "no contact in this step"
    with pytest.raises(ValueError, match="there is no step 3, allowed is 0 to 0"):
        record_figure(path, 3)


def test_missing_matplotlib_is_reported_in_one_line(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "matplotlib.figure", None)
    with pytest.raises(ImportError, match=r"^pictures need matplotlib: pip install 'signorini\[plot\]'$"):
        record_figure("nowhere.vtkhdf")


def test_curved_cells_are_subdivided_exactly() -> None:
    # A quadratic map is reproduced by six nodes: x = ξ + ξη, y = η − ξ².
    nodes = np.array([[0, 0], [1, 0], [0, 1], [0.5, 0], [0.5, 0.5], [0, 0.5]])
    xi = lattice(2, 3)

    def bend(p: np.ndarray) -> np.ndarray:
        return np.stack([p[:, 0] * (1 + p[:, 1]), p[:, 1] - p[:, 0] ** 2], axis=1)

    cell = Patches(2, np.arange(6)[None], np.zeros(1, dtype=int))
    assert np.allclose(subdivided(cell, bend(nodes), 3)[0], bend(xi))
    parts = xi[triangles(3)]
    areas = np.cross(
        np.pad(parts[:, 1] - parts[:, 0], ((0, 0), (0, 1))), np.pad(parts[:, 2] - parts[:, 0], ((0, 0), (0, 1)))
    )
    assert np.allclose(areas[:, 2], 1 / 9)
    assert len(areas) == 9


def test_outline_of_a_cube_is_its_edges() -> None:
    mesh = cube(3)
    faces = outer_faces(mesh.cells, np.arange(len(mesh.cells)))
    ends = mesh.points[outline(mesh.points, faces).nodes[:, :2]]
    assert np.isclose(np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1).sum(), 12)


def test_arc_length_of_three_quarters_of_a_circle_in_any_order() -> None:
    angle = np.linspace(0, 1.5 * np.pi, 200)
    x = 2 * np.stack([np.cos(angle), np.sin(angle), 0 * angle], axis=1)
    order = np.random.default_rng(0).permutation(200)
    assert np.allclose(arc_length(x[order]), 2 * angle[order], rtol=1e-4)


def test_von_mises_of_uniaxial_tension_shear_and_pressure() -> None:
    stress = np.array([[0, 0, 3.0, 0, 0, 0], [0, 0, 0, 2.0, 0, 0], [5.0, 5, 5, 0, 0, 0]])
    assert np.allclose(von_mises(stress), [3, 2 * np.sqrt(3), 0])
