"""The wall of an aneurysm: the lumen's volume against quadrature of its profile, nodes on its surfaces, thickness."""

from __future__ import annotations

from math import pi
from typing import Any

import numpy as np
import pytest
from integrals import closed, surface, volume

from meshes.generators import generate

R, A, NECK, FILLET, LENGTH, T = 1.0, 1.5, 0.6, 0.3, 6.0, 0.12
WALL = {"radius": R, "thickness": T, "length": LENGTH, "dome": A, "neck": NECK, "fillet": FILLET}
RIM = NECK + FILLET
BETA = np.arcsin(RIM / (A + FILLET))
CENTRE = R + FILLET + (A + FILLET) * np.cos(BETA)


def lumens_volume() -> float:
    """πR²L and what stands on the tube inside the rim: ∫ ½ σ² dx along fillet and sphere, less that along the tube."""
    u, w = np.polynomial.legendre.leggauss(40)
    u, w = (u + 1) / 2, w / 2
    total, angles = 0.0, 2 * pi * np.arange(200) / 200
    for phi in angles:
        sin2 = np.sin(phi) ** 2
        root = np.sqrt(R**2 - RIM**2 * sin2)
        handle = 4 / 3 * np.tan((pi - BETA) / 4) * FILLET
        foot = np.array([A * np.sin(BETA), CENTRE - A * np.cos(BETA)])
        p = [np.array([RIM, root]), np.array([RIM - handle, root + handle * RIM * sin2 / root])]
        p += [foot - handle * np.array([np.cos(BETA), np.sin(BETA)]), foot]
        a, b, c = p[1] - p[0], p[2] - p[1], p[3] - p[2]
        sigma = p[0] * (1 - u[:, None]) ** 3 + 3 * p[1] * (u * (1 - u) ** 2)[:, None]
        sigma = (sigma + 3 * p[2] * (u**2 * (1 - u))[:, None] + p[3] * (u**3)[:, None])[:, 0]
        rate = 3 * (a * (1 - u[:, None]) ** 2 + 2 * b * (u * (1 - u))[:, None] + c * (u**2)[:, None])[:, 1]
        total += (w * sigma**2 * rate).sum() / 2
        # Under the rim: ∫ ½ σ² dx along the tube, σ = RIM u and dx = −σ sin²φ/x dσ, from the axis out.
        s = RIM * u
        total -= RIM * (w * s**3 * sin2 / np.sqrt(R**2 - s**2 * sin2)).sum() / 2
    cap = pi * A**3 * (2 / 3 + np.cos(BETA) - np.cos(BETA) ** 3 / 3)  # of the sphere, above its ring
    return float(pi * R**2 * LENGTH + total * 2 * pi / len(angles) + cap)


@pytest.mark.parametrize("order", [1, 2])
def test_rate_of_the_lumens_volume(order: int) -> None:
    """h² with straight cells, h⁴ with curved ones."""
    exact, errors = lumens_volume(), []
    for h in (0.4, 0.2):
        mesh = generate("aneurysm-wall", **WALL, h=h, order=order)
        closed(mesh)
        _, _, flux = surface(mesh.points, mesh.facet("lumen"))  # normals point into the lumen
        inlet = surface(mesh.points, mesh.facet("inlet"))[0]
        disc = pi * R**2 * inlet / (pi * ((R + T) ** 2 - R**2))
        errors.append(abs((LENGTH * disc - flux) / 3 / exact - 1))
    assert errors[1] < (1e-2, 3e-5)[order - 1]
    assert np.log2(errors[0] / errors[1]) == pytest.approx(2 * order, abs=0.5)


@pytest.mark.parametrize("order", [1, 2])
def test_nodes_are_on_the_surfaces(order: int) -> None:
    """Tube and sphere to rounding, inside and outside; the wall is as thick along its normal everywhere."""
    mesh = generate("aneurysm-wall", **WALL, h=0.3, order=order, layers=3, media=0.6)
    # Nodes are numbered level by level.
    x = mesh.points.reshape(3 * order + 1, -1, 3)
    np.testing.assert_array_equal(np.unique(mesh.facet("lumen")), np.arange(x.shape[1]))
    tube = (x[0, :, 0] < R + 1e-9) & (np.hypot(x[0, :, 1], x[0, :, 2] - LENGTH / 2) > RIM - 1e-9)
    dome = x[0, :, 0] > CENTRE - A * np.cos(BETA) - 1e-9
    assert min(tube.sum(), dome.sum()) > 200
    for level, more in ((0, 0.0), (-1, T)):
        np.testing.assert_allclose(np.hypot(*x[level, tube, :2].T), R + more, atol=1e-12)
        away = np.linalg.norm(x[level, dome] - np.array([CENTRE, 0.0, LENGTH / 2]), axis=1)
        np.testing.assert_allclose(away, A + more, atol=1e-12)
    np.testing.assert_allclose(np.linalg.norm(x[-1] - x[0], axis=1), T, atol=1e-12)
    # No node outside is nearer to the lumen than along its own normal.
    nearest = [np.linalg.norm(x[0] - point, axis=1).min() for point in x[-1, ::7]]
    assert min(nearest) > T - 1e-12
    assert len(mesh.regions["media"]) == 2 * len(mesh.regions["adventitia"])


def test_the_volume_of_the_wall() -> None:
    """Parallel surfaces (Steiner), ∫K = 0 (Gauss–Bonnet, geodesic ends): V = t (A + A′)/2. The same mesh every time."""
    mesh, again = (generate("aneurysm-wall", **WALL, h=0.3) for _ in range(2))
    middle = (surface(mesh.points, mesh.facet("lumen"))[0] + surface(mesh.points, mesh.facet("outer"))[0]) / 2
    assert volume(mesh.points, mesh.cells) == pytest.approx(middle * T, rel=2e-5)
    np.testing.assert_array_equal(mesh.points, again.points)
    np.testing.assert_array_equal(mesh.cells, again.cells)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"dome": 0.5}, r"dome = 0\.5: must be greater than neck = 0\.6"),
        ({"neck": 0.9}, r"neck = 0\.9: must be below 0\.95 radius − fillet = 0\.65"),
        ({"neck": -0.9}, r"neck = -0\.9: must be a positive number"),
        ({"fillet": 0.1}, r"fillet = 0\.1: must be greater than thickness = 0\.12"),
        ({"length": 2.0}, r"length = 2\.0: must be above 2 \(neck \+ fillet \+ h\)"),
        ({"layers": 1}, "layers = 1"),
        ({"media": 0.0}, r"media = 0\.0"),
    ],
)
def test_bad_parameters(change: dict[str, Any], message: str) -> None:
    with pytest.raises(ValueError, match=message) as error:
        generate("aneurysm-wall", **{**WALL, "h": 0.4, **change})
    assert "\n" not in str(error.value)
