"""Vessel walls: exact measures and their rates, nodes on the geometry, tags, layers, centrelines, bad parameters."""

from __future__ import annotations

from math import pi
from pathlib import Path

import numpy as np
import pytest
from integrals import closed, surface, volume

from meshes.generators import generate

AORTA = Path(__file__).parents[3] / "shared" / "data" / "aorta_neck.swc"
WALL = {"radius": 1.0, "thickness": 0.2, "length": 4.0}
# Their volumes and areas are those of the straight tube: what the bend adds outside it takes away inside (Pappus).
TUBES = pytest.mark.parametrize("bend", [None, 3.0])


@TUBES
@pytest.mark.parametrize("order", [1, 2])
def test_rates_of_tubes(bend: float | None, order: int) -> None:
    """Volume, lumen and outer area fall on their closed forms as h² with straight cells, as h⁴ with curved ones."""
    errors = []
    for h in (0.6, 0.3):
        mesh = generate("tube-wall", **WALL, h=h, bend=bend, order=order)
        areas = [surface(mesh.points, mesh.facet(tag))[0] for tag in ("lumen", "outer", "inlet", "outlet")]
        found = np.array([volume(mesh.points, mesh.cells), *areas])
        errors.append(np.abs(found / (pi * np.array([0.44 * 4, 2 * 4, 2.4 * 4, 0.44, 0.44])) - 1))
    assert errors[1].max() < (2e-2, 5e-5)[order - 1]
    np.testing.assert_allclose(np.log2(errors[0] / errors[1]), 2 * order, atol=0.35)


@TUBES
@pytest.mark.parametrize("order", [1, 2])
def test_nodes_of_tubes_are_on_the_geometry(bend: float | None, order: int) -> None:
    """Every node of the lumen and of the outer face, middle ones too, is at its radius from the axis."""
    mesh = generate("tube-wall", **WALL, h=0.5, bend=bend, order=order)
    assert mesh.order == order
    closed(mesh)
    assert set(mesh.facets) == {"lumen", "outer", "inlet", "outlet"}
    for tag, radius in (("lumen", 1.0), ("outer", 1.2)):
        x = mesh.points[np.unique(mesh.facet(tag))]
        side = x[:, 0] if bend is None else bend - np.hypot(x[:, 0] - bend, x[:, 2])
        np.testing.assert_allclose(np.hypot(side, x[:, 1]), radius, atol=1e-13)
    ends = mesh.points[np.unique(mesh.facet("outlet"))]
    turn = 0.0 if bend is None else 4 / bend
    shift = ends - np.array([0, 0, 4] if bend is None else [bend * (1 - np.cos(turn)), 0, bend * np.sin(turn)])
    np.testing.assert_allclose(shift @ [np.sin(turn), 0, np.cos(turn)], 0, atol=1e-13)


@pytest.mark.parametrize(("layers", "media", "inner"), [(2, 0.6, 1), (3, 0.6, 2), (5, 0.1, 1), (4, None, 0)])
def test_layers_and_regions(layers: int, media: float | None, inner: int) -> None:
    """Layers of nodes at equal steps in each region; the interface between media and adventitia is one of them."""
    mesh = generate("tube-wall", **WALL, h=0.7, layers=layers, media=media)
    vertices = np.unique(mesh.cells[:, :4])
    radii = np.unique(np.round(np.hypot(*mesh.points[vertices, :2].T), 12))
    split = 1 + 0.2 * (media or 0.0)
    steps = np.linspace(split, 1.2, layers - inner + 1)
    expected = np.union1d(np.linspace(1, split, inner + 1), steps) if inner else steps
    np.testing.assert_allclose(radii, expected, atol=1e-12)
    if media is None:
        assert mesh.regions == {}
        return
    assert sorted(np.concatenate(list(mesh.regions.values()))) == list(range(len(mesh.cells)))
    parts = [volume(mesh.points, mesh.cells[mesh.regions[name]]) for name in ("media", "adventitia")]
    exact = np.array([split**2 - 1, 1.44 - split**2]) * 4 * pi
    np.testing.assert_allclose(parts, exact, rtol=3e-3)
    assert len(mesh.regions["media"]) == len(mesh.cells) * inner // layers


def test_cells_are_no_larger_than_asked() -> None:
    """Edges along the tube and around the middle of the wall are at most h, and not below half of it."""
    mesh = generate("tube-wall", **WALL, h=0.3, order=1)
    x = mesh.points
    step = np.diff(np.unique(np.round(x[:, 2], 12)))
    assert step.min() > 0.15
    assert step.max() <= 0.3 + 1e-12
    around = len(np.unique(np.round(np.arctan2(x[:, 1], x[:, 0]), 9)))
    assert 0.15 < 2 * pi * 1.1 / around <= 0.3


def test_the_same_wall_every_time() -> None:
    first, second = (generate("tube-wall", **WALL, h=0.5, bend=3.0, media=0.5) for _ in range(2))
    np.testing.assert_array_equal(first.points, second.points)
    np.testing.assert_array_equal(first.cells, second.cells)
    for tag in first.facets:
        np.testing.assert_array_equal(first.facets[tag], second.facets[tag])


def test_a_tapered_wall_along_points() -> None:
    """Straight with radii that fall linearly and a wall in proportion: π (1.2² − 1) ∫ r² ds, whatever the direction."""
    s = np.linspace(0, 3, 4)
    rows = np.column_stack([s / 3, 2 * s / 3, 2 * s / 3, 1 - s / 6])
    errors = []
    for h in (0.6, 0.3):
        mesh = generate("vessel-wall", centreline=rows.tolist(), ratio=0.2, h=h)
        closed(mesh)
        errors.append(volume(mesh.points, mesh.cells) / (0.44 * pi * 6 * (1 - 0.5**3) / 3) - 1)
    assert abs(errors[1]) < 1e-4
    assert np.log2(errors[0] / errors[1]) == pytest.approx(4, abs=0.3)
    axis = np.array([1, 2, 2]) / 3
    x = mesh.points[np.unique(mesh.facet("lumen"))]
    away = np.linalg.norm(x - np.outer(x @ axis, axis), axis=1)
    np.testing.assert_allclose(away, 1 - x @ axis / 6, atol=1e-12)


def test_a_wall_along_a_spatial_curve() -> None:
    """A helix through points: volume and areas are those of its length (Pappus), with the spline's own length."""
    t = np.linspace(0, 2 * pi, 33)
    rows = np.column_stack([2 * np.cos(t), 2 * np.sin(t), t / 2, np.full(33, 0.3)])
    mesh = generate("vessel-wall", centreline=rows.tolist(), thickness=0.1, h=0.2, media=0.5)
    closed(mesh)
    length = 2 * pi * np.sqrt(4 + 0.25)
    assert volume(mesh.points, mesh.cells) == pytest.approx(pi * 0.07 * length, rel=2e-4)
    assert surface(mesh.points, mesh.facet("lumen"))[0] == pytest.approx(pi * 0.6 * length, rel=2e-4)
    assert sorted(mesh.regions) == ["adventitia", "media"]


@pytest.mark.skipif(not AORTA.exists(), reason="no shared data")
def test_the_aortas_wall() -> None:
    """The measured aorta, 0.2 m of it: closed, and its wall's volume is π (1.15² − 1) ∫ r² ds of its own centreline."""
    part = {"centreline": str(AORTA), "scale": 1e-3, "ratio": 0.15, "part": [0.2, 0.4], "media": 0.6}
    mesh = generate("vessel-wall", **part, h=7e-3)
    closed(mesh)
    areas = [surface(mesh.points, mesh.facet(tag))[0] for tag in ("lumen", "inlet", "outlet")]
    fine = generate("vessel-wall", **part, h=5e-3)
    assert volume(mesh.points, mesh.cells) == pytest.approx(volume(fine.points, fine.cells), rel=1e-3)
    assert areas[0] == pytest.approx(surface(fine.points, fine.facet("lumen"))[0], rel=1e-3)
    radii = [np.sqrt(area / (pi * (1.15**2 - 1))) for area in areas[1:]]
    assert 5e-3 < min(radii) <= max(radii) < 20e-3
    whole = generate("vessel-wall", centreline=str(AORTA), scale=1e-3, ratio=0.15, h=12e-3, order=1)
    closed(whole)


@pytest.mark.parametrize(
    ("shape", "change", "message"),
    [
        ("tube-wall", {"radius": -1.0}, r"radius = -1\.0: must be a positive number"),
        ("tube-wall", {"thickness": 0.0}, r"thickness = 0\.0: must be a positive number"),
        ("tube-wall", {"layers": 1}, "layers = 1: must be a whole number of at least 2"),
        ("tube-wall", {"layers": 2.5}, r"layers = 2\.5"),
        ("tube-wall", {"media": 1.0}, r"media = 1\.0: must be between 0 and 1"),
        ("tube-wall", {"bend": 1.1}, r"bend = 1\.1: must be greater than radius \+ thickness = 1\.2"),
        ("tube-wall", {"bend": 1.3, "length": 9.0}, r"length = 9\.0: must be below a whole turn of bend = 1\.3"),
        ("tube-wall", {"order": 3}, "order = 3: must be 1 or 2"),
        ("tube-wall", {"colour": 3}, "colour = 3: unknown, must be one of radius, thickness, length, h, bend"),
        ("vessel-wall", {"thickness": None}, "thickness, ratio = .*given one and not the other"),
        ("vessel-wall", {"ratio": 0.1}, "thickness, ratio = .*given one and not the other"),
        ("vessel-wall", {"centreline": [[0, 0, 0, 1]]}, "centreline = .*at least two rows"),
        ("vessel-wall", {"centreline": [[0, 0, 0, 1], [0, 0, 1]]}, r"centreline\[1\] = .*list of 4 numbers"),
        ("vessel-wall", {"centreline": [[0, 0, 0, 1], [0, 0, 1, 0]]}, r"centreline\[1\]\[3\] = 0\.0: must be a posit"),
        ("vessel-wall", {"centreline": [[0, 0, 0, 1], [0, 0, 0, 1]]}, "centreline: .*are equal: must differ"),
        ("vessel-wall", {"centreline": "nowhere.swc", "scale": 1e-3}, "nowhere.swc: no such file"),
        ("vessel-wall", {"centreline": "nowhere.swc"}, "scale: missing"),
        ("vessel-wall", {"scale": 1e-3}, r"scale = 0\.001: must be left out unless centreline is a file"),
        ("vessel-wall", {"centreline": [[0, 0, 0, 1], [1, 0, 0, 1], [1, 1, 0, 1]]}, "radius of curvature .* above"),
    ],
)
def test_bad_parameters(shape: str, change: dict[str, object], message: str) -> None:
    """One line that names the key, its value and what is allowed."""
    rows = {"centreline": [[0.0, 0.0, 0.0, 1.0], [0.0, 0.0, 4.0, 1.0]], "thickness": 0.2}
    known: dict[str, object] = {**(WALL if shape == "tube-wall" else rows), "h": 0.5, **change}
    with pytest.raises(ValueError, match=message) as error:
        generate(shape, **{key: value for key, value in known.items() if value is not None})
    assert "\n" not in str(error.value)


@pytest.mark.skipif(not AORTA.exists(), reason="no shared data")
@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"vessel": 15}, "vessel = 15: must be from 0 to 14"),
        ({"vessel": -1}, "vessel = "),
        ({"part": [0.2, 0.1]}, r"part = \[0\.2, 0\.1\]: must be two increasing lengths from 0 to 0\.5"),
        ({"vessel": 8, "ratio": 0.15}, "its radius of curvature is .* must be above the outer radius"),
        ({"spacing": 0.0}, r"spacing = 0\.0: must be a positive number"),
    ],
)
def test_bad_parts_of_a_file(change: dict[str, object], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        generate("vessel-wall", **{"centreline": str(AORTA), "scale": 1e-3, "ratio": 0.1, "h": 5e-3, **change})
