"""The wall of a bifurcation: exact measures of tubes that meet on ellipses, nodes on them, tapers, bad parameters."""

from __future__ import annotations

from math import pi
from typing import Any

import numpy as np
import pytest
from integrals import closed, surface, volume

from meshes.generators import generate

PARENT = {"radius": 1.0, "thickness": 0.2, "length": 3.0}


def cot(degrees: float) -> float:
    return float(1 / np.tan(np.deg2rad(degrees)))


@pytest.mark.parametrize(("order", "angles"), [(1, (0.0, 90.0)), (2, (30.0, 50.0))])
def test_rates_of_equal_tubes(order: int, angles: tuple[float, float]) -> None:
    """Each of three seams takes 4/3 (c³ − a³) cot α from the tubes' volume and 4 a² cot α from their lumen's area."""
    cots = cot((180 - angles[0]) / 2) + cot((180 - angles[1]) / 2) + cot(sum(angles) / 2)
    exact = np.array([0.44 * pi * 12 - 4 / 3 * (1.2**3 - 1) * cots, 2 * pi * 12 - 4 * cots, 0.44 * pi])
    errors = []
    for h in (0.7, 0.346):  # 10 and 20 cells around
        mesh = generate(
            "bifurcation-wall", **PARENT, h=h, angles=angles, radii=[1.0, 1.0], lengths=[4.0, 5.0], order=order
        )
        closed(mesh)
        areas = [surface(mesh.points, mesh.facet(tag))[0] for tag in ("lumen", "outlet-2")]
        errors.append(np.abs(np.array([volume(mesh.points, mesh.cells), *areas]) / exact - 1))
    assert errors[1].max() < (4e-2, 2e-4)[order - 1]
    np.testing.assert_allclose(np.log2(errors[0] / errors[1]), 2 * order, atol=0.3)


@pytest.mark.parametrize("order", [1, 2])
def test_nodes_are_on_the_tubes(order: int) -> None:
    """Every node of the lumen is on one of three cylinders and inside none of the others; so outside."""
    mesh = generate("bifurcation-wall", **PARENT, h=0.5, radii=[1.0, 1.0], angles=[40.0, 60.0], order=order)
    turns = np.deg2rad([180.0, 40.0, -60.0])
    axes = np.stack([np.sin(turns), 0 * turns, np.cos(turns)], axis=1)
    for tag, radius in (("lumen", 1.0), ("outer", 1.2)):
        x = mesh.points[np.unique(mesh.facet(tag))]
        along = x @ axes.T
        away = np.linalg.norm(x[:, None] - np.where(along > 0, along, 0.0)[..., None] * axes, axis=2)
        np.testing.assert_allclose(away.min(axis=1), radius, atol=1e-12)
    for tag, axis, length in zip(("inlet", "outlet-1", "outlet-2"), axes, (3, 3, 3), strict=True):
        np.testing.assert_allclose(mesh.points[np.unique(mesh.facet(tag))] @ axis, length, atol=1e-12)


def test_branches_taper_to_their_radii() -> None:
    """Murray's radii unless others are given; media and adventitia; the same mesh every time."""
    mesh = generate("bifurcation-wall", **PARENT, h=0.4, media=0.6, layers=3)
    closed(mesh)
    small = 2 ** (-1 / 3)
    for tag, radius in (("inlet", 1.0), ("outlet-1", small), ("outlet-2", small)):
        area = surface(mesh.points, mesh.facet(tag))[0]
        assert area == pytest.approx(pi * ((radius + 0.2) ** 2 - radius**2), rel=1e-3)
    assert len(mesh.regions["media"]) == 2 * len(mesh.regions["adventitia"])
    again = generate("bifurcation-wall", **PARENT, h=0.4, media=0.6, layers=3)
    np.testing.assert_array_equal(mesh.points, again.points)
    np.testing.assert_array_equal(mesh.cells, again.cells)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"angles": [-1.0, 30.0]}, r"angles = \[-1\.0, 30\.0\]: must be two angles from 0"),
        ({"angles": [0.0, 0.0]}, "angles = .*together above 0 and at most 180"),
        ({"angles": [100.0, 90.0]}, "angles = .*at most 180"),
        ({"angles": [30.0]}, "angles = .*list of 2 numbers"),
        ({"radii": [1.0, 0.0]}, r"radii\[1\] = 0\.0: must be a positive number"),
        ({"lengths": [1.0, 3.0]}, r"lengths\[0\] = 1\.0: must be above 1\.71"),
        ({"length": 0.1}, r"length = 0\.1: must be above 0\.37"),
        ({"layers": 1}, "layers = 1"),
        ({"h": -1.0}, r"h = -1\.0"),
    ],
)
def test_bad_parameters(change: dict[str, Any], message: str) -> None:
    with pytest.raises(ValueError, match=message) as error:
        generate("bifurcation-wall", **{**PARENT, "h": 0.5, **change})
    assert "\n" not in str(error.value)
