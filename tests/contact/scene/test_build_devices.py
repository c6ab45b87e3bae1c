"""From a scene's table to a beam: sections, places, supports, loads and mass are what the table says."""

from __future__ import annotations

from pathlib import Path

import meshio
import numpy as np
import pytest
from device_examples import contact, wire
from mpi4py import MPI

from contact.scene.build import build
from contact.scene.build_devices import beam_of
from contact.scene.devices import BeamTable
from contact.scene.schema import Scene
from contact.solvers import InfeasibleError
from fem.integrators import ImplicitEuler, Static
from fem.rotations import exp

STEEL = {"E": 2e11, "nu": 0.3, "density": 8000.0, "radius": 1e-3}


def table(*sections, **changes):
    """A beam's table, as a scene's file gives it."""
    return BeamTable.model_validate({"name": "wire", "kind": "beam", "sections": list(sections)} | changes)


def beam(*sections, dynamic=True, folder=Path(), **changes):
    return beam_of(table(*(sections or [{"length": 0.1, "elements": 4, **STEEL}]), **changes), dynamic, folder)


def test_sections_in_a_row():
    """Three sections of other lengths, elements, curvatures and materials: nodes, shape, stiffness, radii, mass."""
    body = beam(
        {"length": 0.1, "elements": 2, **STEEL},
        {"length": 0.02, "elements": 4, "E": 1e9, "G": 4e8, "density": 1000.0, "radius": 2e-3, "inner_radius": 1e-3,
         "shape": {"kind": "arc", "radius": 0.02}},
        {"length": 0.03, "elements": 3, "radius": 5e-4, "EA": 1.0, "GJ": 2.0, "EI": 3.0, "mass": 4.0, "inertia": 0.5},
    )  # fmt: skip
    np.testing.assert_allclose(body.data.length, [0.05] * 2 + [0.005] * 4 + [0.01] * 3, rtol=1e-12)
    np.testing.assert_array_equal(body.radius, [1e-3] * 2 + [2e-3] * 4 + [5e-4] * 3)
    # a quarter of it is straight on; the arc of one radian turns what follows
    np.testing.assert_allclose(body.x[2], [0.1, 0, 0], atol=1e-15)
    tip = [0.1 + 0.02 * np.sin(1) + 0.03 * np.cos(1), 0.02 * (1 - np.cos(1)) + 0.03 * np.sin(1)]
    assert np.hypot(*body.x[-1, 1:]) == pytest.approx(tip[1], rel=1e-12)
    assert body.x[-1, 0] == pytest.approx(tip[0], rel=1e-12)
    np.testing.assert_allclose(np.abs(body.data.twist[:, 1:]).max(axis=1), [0] * 2 + [0.25] * 4 + [0] * 3, atol=1e-12)
    steel, tube = np.pi * 1e-6, np.pi * 3e-6
    stretch = [2e11 * steel] * 2 + [1e9 * tube] * 4 + [1.0] * 3
    torsion = [2e11 / 1.3 / 2 * np.pi * 1e-12 / 2] * 2 + [4e8 * np.pi * 15e-12 / 2] * 4 + [2.0] * 3
    bend = [2e11 * np.pi * 1e-12 / 4] * 2 + [1e9 * np.pi * 15e-12 / 4] * 4 + [3.0] * 3
    np.testing.assert_allclose(body.data.axial[:, 0] * body.data.length, stretch, rtol=1e-12)
    np.testing.assert_allclose(body.data.bending[:, 0] * body.data.length, torsion, rtol=1e-12)
    np.testing.assert_allclose(body.data.bending[:, 1] * body.data.length, bend, rtol=1e-12)
    mass = 8000 * steel * 0.1 + 1000 * tube * 0.02 + 4.0 * 0.03
    assert body.inertia.nodes.sum() + 2 * body.inertia.links.sum() == pytest.approx(mass, rel=1e-12)
    body.close()


def test_taper():
    """Radius, stiffness and mass of the middle of each element, between the ends of the section."""
    body = beam({"length": 0.1, "elements": 4, **STEEL, "end_radius": 5e-4})
    r = 1e-3 - 5e-4 * np.array([1, 3, 5, 7]) / 8
    np.testing.assert_allclose(body.radius, r, rtol=1e-14)
    np.testing.assert_allclose(body.data.bending[:, 2] * 0.025, 2e11 * np.pi * r**4 / 4, rtol=1e-12)
    assert body.inertia.nodes.sum() == pytest.approx(8000 * np.pi * (r**2).sum() * 0.025, rel=1e-12)


@pytest.mark.parametrize("mass", ["lumped", "consistent"])
def test_mass(mass):
    """ρAL of a rigid translation, 2ρI L of a spin about the axis; links only where it is consistent."""
    inertia = beam(mass=mass).inertia
    total = 8000 * np.pi * 1e-6 * 0.1
    assert inertia.nodes.sum() + 2 * inertia.links.sum() == pytest.approx(total, rel=1e-12)
    assert inertia.rotary[:, 0].sum() == pytest.approx(8000 * np.pi * 1e-12 / 2 * 0.1, rel=1e-12)
    assert (inertia.links > 0).all() == (mass == "consistent")
    assert inertia.nodes[0] == pytest.approx(total / 4 / (3 if mass == "consistent" else 2), rel=1e-12)


@pytest.mark.parametrize("shape", [{"kind": "arc", "radius": 0.02}, {"kind": "helix", "radius": 0.01, "pitch": 0.02}])
def test_laid_out(shape):
    """Placed where asked: in its rest shape without strain; straight, strained in bending but not in torsion."""
    section = {"length": 0.05, "elements": 10, "shape": shape, **STEEL}
    where = {"start": [1.0, 2.0, 3.0], "direction": [0.0, 0.0, 2.0], "roll": 0.7}
    rest = beam(section, placement=where)
    laid = beam(section, placement=where | {"straight": True})
    for body in (rest, laid):
        np.testing.assert_allclose(body.x[0], [1, 2, 3], atol=1e-14)
        np.testing.assert_allclose(body.R[0, :, 0], [0, 0, 1], atol=1e-12)
    assert rest.energy()["strain"] < 1e-12 * laid.energy()["strain"]
    np.testing.assert_allclose(laid.x[:, 2], 3 + np.linspace(0, 0.05, 11), atol=1e-14)
    np.testing.assert_allclose(laid.x[:, :2], np.tile([1.0, 2.0], (11, 1)), atol=1e-14)
    EI = 2e11 * np.pi * 1e-12 / 4
    # for a helix κ = r/(r² + (p/2π)²)
    kappa = shape["radius"] / (shape["radius"] ** 2 + (shape.get("pitch", 0.0) / 2 / np.pi) ** 2)
    assert laid.energy()["strain"] == pytest.approx(EI * kappa**2 * 0.05 / 2, rel=2e-2)


def test_along_a_path():
    """Nodes at equal arc lengths of a smooth curve through the points."""
    path = [[0.0, 0.0, 0.0], [0.05, 0.02, 0.0], [0.1, 0.0, 0.0]]
    body = beam(placement={"path": path})
    np.testing.assert_allclose(body.x[0], path[0], atol=1e-14)
    assert body.x[2, 1] > 0.015
    assert body.energy()["strain"] > 0


def test_polyline():
    """The section's length is that of its points."""
    points = [[0.0, 0.0, 0.0], [0.06, 0.0, 0.0], [0.1, 0.03, 0.0]]
    body = beam({"elements": 6, "shape": {"kind": "polyline", "points": points}, **STEEL})
    assert np.linalg.norm(body.x[-1] - body.x[0]) == pytest.approx(np.hypot(0.1, 0.03), rel=1e-3)
    assert body.data.length.sum() < 0.13
    assert body.energy()["strain"] < 1e-12


def test_lines_of_a_mesh_file(tmp_path):
    """A rest shape along the line cells of a file, numbered in any order, and one that is not there."""
    angle = np.linspace(0, 1, 9)
    points = 0.1 * np.stack([np.sin(angle), 1 - np.cos(angle), 0 * angle], axis=1)
    order = np.array([3, 0, 7, 1, 5, 8, 2, 6, 4])
    cells = np.argsort(order)[np.stack([np.arange(8), np.arange(1, 9)], axis=1)]
    meshio.write_points_cells(tmp_path / "tip.vtu", points[order], [("line", cells)])
    body = beam({"elements": 5, "shape": {"kind": "lines", "file": "tip.vtu"}, **STEEL}, folder=tmp_path)
    assert body.data.length.sum() == pytest.approx(0.1, rel=1e-4)
    np.testing.assert_allclose(np.linalg.norm(body.data.twist, axis=1), 0.2, rtol=0.02)
    with pytest.raises(ValueError, match=r"body 'wire': .*none\.vtu"):
        beam({"elements": 5, "shape": {"kind": "lines", "file": "none.vtu"}, **STEEL}, folder=tmp_path)


def test_supports():
    """At the node nearest to a place: push and twist about the tangent at the start, displacement besides."""
    supports = [
        {"at": "start", "push": "0.01 * t", "twist": "2 * t"},
        {"at": "end", "hold": ["y", "rx"], "displacement": [0.0, "1e-3 * t", 0.0]},
        {"at": 0.051, "hold": ["z"]},
    ]
    body = beam(placement={"direction": [0.0, 1.0, 0.0]}, supports=supports)
    first, last, middle = body.drives
    assert (first.node, last.node, middle.node) == (0, 4, 2)
    assert (first.components, last.components, middle.components) == ((0, 1, 2, 3, 4, 5), (1, 3), (2,))
    np.testing.assert_allclose(first.motion(3.0), [0, 0.03, 0, 0, 6, 0], atol=1e-12)
    np.testing.assert_allclose(last.motion(2.0), [0, 2e-3, 0, 0, 0, 0], atol=1e-15)
    assert middle.motion is None
    assert body.fixed.sum() == 9
    body.begin(0.5, ImplicitEuler(0.5))
    np.testing.assert_allclose(body.x[0], [0, 0.005, 0], atol=1e-15)
    np.testing.assert_allclose(body.R[0], exp(np.array([0.0, 1.0, 0.0])) @ body.start_frames[0], atol=1e-12)


def test_loads():
    """Gravity weighs each section, a line load its length, a point load acts with its moment at the nearest node."""
    loads = [
        {"kind": "gravity", "value": [0.0, 0.0, "-9.81 * t"]},
        {"kind": "line", "value": [2.0, 0.0, 0.0]},
        {"kind": "point", "at": 0.07, "value": [0.0, 3.0, 0.0], "moment": [0.0, 0.0, "t"]},
        {"kind": "point", "at": "end", "value": [1.0, 0.0, 0.0]},
    ]
    sections = [{"length": 0.1, "elements": 4, **STEEL}, {"length": 0.1, "elements": 2, **STEEL, "density": 100.0}]
    body = beam(*sections, loads=loads, supports=[{"at": "start"}], dynamic=False)
    body.begin(2.0, Static())
    f = body.load.reshape(-1, 6)
    weight = np.pi * 1e-6 * 0.1 * 9.81 * 2
    np.testing.assert_allclose(f[:, :3].sum(axis=0), [2 * 0.2 + 1, 3, -8100 * weight], rtol=1e-12)
    np.testing.assert_allclose(f[5:, 2].sum(), -100 * weight * 0.75, rtol=1e-12)
    np.testing.assert_allclose(f[3], [2 * 0.025, 3, -8000 * weight / 4, 0, 0, 2], rtol=1e-12)
    np.testing.assert_allclose(f[:, 3:].sum(axis=0), [0, 0, 2], atol=1e-15)


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"supports": [{"at": 0.2}]}, r"'wire': at = 0.2: must be start, end or up to its length 0.1"),
        ({"loads": [{"kind": "point", "at": 0.11}]}, r"'wire': at = 0.11: must be start, end or up to its length 0.1"),
        ({"placement": {"direction": [0.0, 0.0, 0.0]}}, r"'wire': .*direction"),
        ({"placement": {"path": [[0.0, 0.0, 0.0], [0.01, 0.0, 0.0]]}}, r"'wire': .*(path|length|long|end)"),
    ],
)
def test_refused(changes, words):
    with pytest.raises(ValueError, match=words):
        beam(**changes)


def test_what_has_no_mass():
    """No weight without a density; no motion in time either."""
    massless = {"length": 0.1, "elements": 4, "radius": 1e-3, "E": 1e9, "nu": 0.3}
    with pytest.raises(ValueError, match=r"'wire': an integrator in time needs a density"):
        beam(massless)
    with pytest.raises(ValueError, match=r"'wire': gravity: needs a density or mass"):
        beam(massless, dynamic=False, supports=[{"at": "start"}], loads=[{"kind": "gravity", "value": [0.0, 0.0, 1.0]}])
    beam(massless, dynamic=False, supports=[{"at": "start"}])


@pytest.mark.parametrize(("keys", "count"), [({}, 41), ({"samples": 3}, 61), ({"spacing": 0.01}, 6)])
def test_points_of_contact(keys, count):
    """Evenly along the beam, both ends included: `samples` per element, or `spacing` apart."""
    pair = contact({"kind": "plane", "point": [0.0, 0.0, -1.0], "normal": [0.0, 0.0, 1.0]}) | keys
    if "spacing" in keys:
        del pair["samples"]
    scene = Scene.model_validate({"body": [wire(supports=[{"at": "start"}])], "contact": [pair]})
    system = build(scene, MPI.COMM_SELF)
    places = system.pairs[0].places
    np.testing.assert_allclose(places[:, 0], np.linspace(-0.05, 0, count), atol=1e-15)
    system.close()


def test_statics_pay_for_no_mass():
    """A static scene's beam has none, whatever its density."""
    assert beam(dynamic=False, supports=[{"at": "start"}]).inertia is None


@pytest.mark.parametrize("kind", ["cylinder", "torus"])
def test_a_wire_that_does_not_fit(kind):
    """Wider than its tube by a millionth of its radius it is infeasible, as wide it is not."""
    tube = {"kind": kind, "centre": [0.0] * 3, "axis": [1.0, 0.0, 0.0], "inside": True}
    tube |= {"bend": 1.0} if kind == "torus" else {}
    placed = {"placement": {"start": [0.0, 1.0, 0.0], "direction": [0.0, 0.0, 1.0]}} if kind == "torus" else {}
    section = {"length": 0.01, "elements": 4, **STEEL}
    body = {"name": "wire", "kind": "beam", "sections": [section], "supports": [{"at": "start"}], **placed}

    def built(radius):
        touching = {"body": "wire", "surface": {**tube, "radius": radius}, "interference": 1e-3}
        build(Scene.model_validate({"body": [body], "contact": [touching]}), MPI.COMM_SELF).close()

    built(1e-3)
    with pytest.raises(InfeasibleError, match=r"radius 0\.001 m does not fit into 0\.000999999 m"):
        built(1e-3 * (1 - 1e-6))
