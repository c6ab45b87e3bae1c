"""Solid devices: exact measures and rates, nodes on the geometry, tags, bad parameters."""

from __future__ import annotations

from math import pi
from typing import Any

import numpy as np
import pytest
from integrals import closed, surface, volume

from meshes.generators import generate

BALLOON = {"radius": 1.0, "neck": 0.4, "thickness": 0.05, "length": 2.0, "shoulder": 1.0}


@pytest.mark.parametrize("order", [1, 2])
def test_balloon(order: int) -> None:
    """π ∫ (r + t)² − r² = π t ∫ 2r + t, with the shoulders' mean radius in the middle between neck and balloon."""
    exact = pi * 0.05 * (2 * (2 * 1.0 + 2 * 0.7) + 4 * 0.05)
    errors = []
    for h in (0.4, 0.2):
        mesh = generate("balloon", **BALLOON, h=h, order=order)
        closed(mesh)
        errors.append(abs(volume(mesh.points, mesh.cells) / exact - 1))
    assert errors[1] < (1e-2, 3e-5)[order - 1]
    assert np.log2(errors[0] / errors[1]) == pytest.approx(2 * order, abs=0.4)
    x = mesh.points[np.unique(mesh.facet("inner"))]
    part = np.clip(np.abs(x[:, 2]) - 1, 0, 1)
    np.testing.assert_allclose(np.hypot(x[:, 0], x[:, 1]), 1 - 0.6 * np.sin(pi / 2 * part) ** 2, atol=1e-13)
    assert set(mesh.facets) == {"inner", "outer", "proximal", "distal"}


@pytest.mark.parametrize("bend", [None, 2.0])
def test_catheter(bend: float | None) -> None:
    """A tube by its outer radius and bore, straight or bent: π (R² − b²) L."""
    mesh = generate("catheter", radius=1.0, bore=0.7, length=3.0, h=0.3, bend=bend)
    closed(mesh)
    assert volume(mesh.points, mesh.cells) == pytest.approx(pi * 0.51 * 3, rel=1e-4)
    assert surface(mesh.points, mesh.facet("outer"))[0] == pytest.approx(2 * pi * 3, rel=1e-4)
    assert set(mesh.facets) == {"lumen", "outer", "proximal", "distal"}


@pytest.mark.parametrize("order", [1, 2])
def test_blunt_tip(order: int) -> None:
    """A hemisphere and a cylinder: volume ⅔πR³ + πR²(L − R); the tip's nodes are on the sphere."""
    errors = []
    for h in (0.4, 0.2):
        mesh = generate("blunt-tip", radius=1.0, length=2.5, h=h, order=order)
        closed(mesh)
        areas = [surface(mesh.points, mesh.facet(tag))[0] for tag in ("tip", "side", "base")]
        found = np.array([volume(mesh.points, mesh.cells), *areas])
        errors.append(np.abs(found / (pi * np.array([2 / 3 + 1.5, 2, 3, 1])) - 1).max())
    assert errors[1] < (2e-2, 5e-5)[order - 1]
    assert np.log2(errors[0] / errors[1]) == pytest.approx(2 * order, abs=0.6)
    tip = mesh.points[np.unique(mesh.facet("tip"))]
    np.testing.assert_allclose(np.linalg.norm(tip - [0, 0, 1], axis=1), 1, atol=1e-12)
    assert tip[:, 2].max() == pytest.approx(1, abs=1e-12)
    assert np.abs(tip).min(axis=0)[2] < 1e-12
    again = generate("blunt-tip", radius=1.0, length=2.5, h=0.2, order=order)
    np.testing.assert_array_equal(mesh.points, again.points)
    np.testing.assert_array_equal(mesh.cells, again.cells)


@pytest.mark.parametrize(
    ("shape", "change", "message"),
    [
        ("balloon", {**BALLOON, "neck": 1.0}, r"radius = 1\.0: must be greater than neck = 1\.0"),
        ("balloon", {**BALLOON, "shoulder": 0.0}, r"shoulder = 0\.0: must be a positive number"),
        ("balloon", {**BALLOON, "layers": 1}, "layers = 1"),
        ("catheter", {"radius": 1.0, "bore": 1.5, "length": 1.0}, r"radius = 1\.0: must be greater than bore = 1\.5"),
        ("catheter", {"radius": 1.0, "bore": 0.5, "length": 9.0, "bend": 1.1}, r"length = 9\.0: must be below a whole"),
        ("catheter", {"radius": 1.0, "bore": 0.5, "length": 1.0, "bend": 0.9}, r"bend = 0\.9: must be greater than"),
        ("blunt-tip", {"radius": 1.0, "length": 1.0}, r"length = 1\.0: must be greater than radius = 1\.0"),
        ("blunt-tip", {"radius": 1.0}, "length: missing"),
    ],
)
def test_bad_parameters(shape: str, change: dict[str, Any], message: str) -> None:
    with pytest.raises(ValueError, match=message) as error:
        generate(shape, **{"h": 0.4, **change})
    assert "\n" not in str(error.value)
