"""Rest shapes of devices: closed forms, joints, frames, paths, line meshes and refusals."""

from __future__ import annotations

import gmsh
import meshio
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from meshes.centrelines import Centreline, along, arc, from_lines, helix, join, polyline, read_lines, straight

E1 = np.array([1.0, 0.0, 0.0])


def is_rotation(frames):
    np.testing.assert_allclose(np.swapaxes(frames, 1, 2) @ frames, np.tile(np.eye(3), (len(frames), 1, 1)), atol=1e-14)
    np.testing.assert_allclose(np.linalg.det(frames), 1, atol=1e-14)


def darboux(line):
    """log(R₁ᵀR₂)/ℓ of the elements."""
    turn = np.swapaxes(line.frames[:-1], 1, 2) @ line.frames[1:]
    return Rotation.from_matrix(turn).as_rotvec() / np.diff(line.arc)[:, None]


def test_straight():
    line = straight(2.0, 4)
    np.testing.assert_allclose(line.points, np.outer([0, 0.5, 1, 1.5, 2], E1), atol=1e-15)
    np.testing.assert_array_equal(line.frames, np.tile(np.eye(3), (5, 1, 1)))
    assert line.length == 2.0


@pytest.mark.parametrize("angle", [0.0, 0.7, -2.0])
def test_arc_is_a_circle_in_its_plane(angle):
    line = arc(1.5, 6, 0.5, angle)
    side = np.array([0, np.cos(angle), np.sin(angle)])
    np.testing.assert_allclose(np.linalg.norm(line.points - 0.5 * side, axis=1), 0.5, rtol=1e-14)
    np.testing.assert_allclose(line.points[-1], 0.5 * (np.sin(3) * E1 + (1 - np.cos(3)) * side), atol=1e-14)
    np.testing.assert_allclose(line.frames[-1, :, 0], np.cos(3) * E1 + np.sin(3) * side, atol=1e-14)
    is_rotation(line.frames)


@pytest.mark.parametrize("pitch", [0.8, -0.3])
def test_helix_lies_on_its_cylinder(pitch):
    """Radius a about the axis through a d₂, one pitch a turn along it, right-handed where the pitch is positive."""
    a, turns = 0.4, 2.25
    b = pitch / (2 * np.pi)
    turn = 2 * np.pi * np.hypot(a, b)
    line = helix(turns * turn, 90, a, pitch)
    axis = np.array([b, 0, a]) / np.hypot(a, b)
    radial = line.points - [0, a, 0]
    height = radial @ axis
    np.testing.assert_allclose(np.linalg.norm(radial - np.outer(height, axis), axis=1), a, rtol=1e-13)
    np.testing.assert_allclose(height, pitch * line.arc / turn, atol=1e-14)
    np.testing.assert_allclose(darboux(line), np.tile(np.array([b, 0, a]) / (a**2 + b**2), (90, 1)), atol=1e-11)
    is_rotation(line.frames)


def test_sections_join_smoothly():
    """The tangent is continuous, each section keeps its curvature, and arcs and sections count on."""
    parts = [straight(1.0, 3), arc(0.5, 4, 0.3), helix(1.0, 8, 0.2, 0.1, 0.4)]
    line = join(parts)
    assert (len(line.points), line.length) == (16, pytest.approx(2.5))
    np.testing.assert_array_equal(line.section, np.repeat([0, 1, 2], [3, 4, 8]))
    for i, part in enumerate(parts):
        np.testing.assert_allclose(darboux(line)[line.section == i], darboux(part), atol=1e-12)
        nodes = np.append(0, np.cumsum([3, 4, 8]))[i] + np.arange(len(part.points))
        seen = (line.points[nodes] - line.points[nodes[0]]) @ line.frames[nodes[0]]
        np.testing.assert_allclose(seen, part.points, atol=1e-14)
    np.testing.assert_allclose(line.relative()[[0, 2, 3, 6, 7]], [1 / 6, 5 / 6, 1 / 8, 7 / 8, 1 / 16], rtol=1e-13)
    again = join([join(parts[:2]), parts[2]])
    np.testing.assert_allclose(again.points, line.points, atol=1e-15)
    np.testing.assert_array_equal(again.section, line.section)


def test_placed():
    line = arc(1.0, 5, 1.0).placed((1, 2, 3), (0, 0, 2), roll=np.pi / 2)
    np.testing.assert_allclose(line.points[0], [1, 2, 3])
    np.testing.assert_allclose(line.frames[0, :, 0], [0, 0, 1], atol=1e-15)
    np.testing.assert_allclose(line.frames[0, :, 1], [0, 1, 0], atol=1e-15)
    np.testing.assert_allclose(line.points[-1], [1, 3 - np.cos(1), 3 + np.sin(1)], rtol=1e-14)
    np.testing.assert_allclose(straight(1.0, 2).placed((0, 0, 0), (3, 0, 0)).frames[0], np.eye(3))


def circle(n, turn=2.0):
    phi = np.linspace(0, turn, n)
    return np.stack([np.cos(phi), np.sin(phi), 0 * phi], axis=1)


def test_polyline_through_points_of_a_circle():
    """Its nodes are the points; their tangents converge to the circle's with the spline's order 3."""
    errors = []
    for n in (11, 21, 41):
        line, phi = polyline(circle(n)), np.linspace(0, 2, n)
        np.testing.assert_allclose(line.points, circle(n), atol=1e-15)
        is_rotation(line.frames)
        tangent = np.stack([-np.sin(phi), np.cos(phi), 0 * phi], axis=1)
        errors.append(np.abs(line.frames[:, :, 0] - tangent).max())
        assert abs(line.length - 2) < 0.1 * errors[-1]
    np.testing.assert_allclose(np.log2(np.divide(errors[:-1], errors[1:])), 3, atol=0.05)


def test_polyline_with_elements_of_equal_length():
    line = polyline([(0, 0, 0), (1, 0, 0), (3, 0, 0)], 6)
    np.testing.assert_allclose(line.points, np.outer(np.arange(7) / 2, E1), atol=1e-14)
    line = polyline(circle(200), 10)
    np.testing.assert_allclose(line.points, circle(11), atol=1e-7)


def test_frames_do_not_twist():
    """Rotation-minimising: against Frenet's frames of a helix they turn back by the torsion, to fourth order."""
    exact = helix(3.0, 2000, 0.4, 0.6)
    b = 0.6 / (2 * np.pi)
    back = Rotation.from_rotvec([-3.0 * b / (0.4**2 + b**2), 0, 0]).as_matrix()
    errors = []
    for n in (20, 40, 80):
        line = polyline(exact.points, n)
        first, last = (exact.frames[i].T @ line.frames[i] for i in (0, -1))
        errors.append(np.abs(last - back @ first).max())
    np.testing.assert_allclose(np.log2(np.divide(errors[:-1], errors[1:])), 4, atol=0.2)


def test_along_a_path():
    """At arc lengths asked for, to round-off on a line and to the spline's error on a circle."""
    device = straight(1.2, 12)
    laid = along(circle(300, 3.0), device.arc + 0.5, roll=0.3)
    np.testing.assert_allclose(
        laid.points, circle(13, 1.2) @ Rotation.from_rotvec([0, 0, 0.5]).as_matrix().T, atol=1e-8
    )
    np.testing.assert_array_equal(laid.arc, device.arc + 0.5)
    straight_path = along([(0, 0, 0), (0, 0, 1), (0, 0, 5)], 10)
    np.testing.assert_allclose(straight_path.points, np.outer(np.arange(11) / 2, [0, 0, 1]), atol=1e-14)
    rolled = along([(0, 0, 0), (0, 0, 5)], 2, roll=0.3).frames[0].T @ along([(0, 0, 0), (0, 0, 5)], 2).frames[0]
    np.testing.assert_allclose(Rotation.from_matrix(rolled).as_rotvec(), [-0.3, 0, 0], atol=1e-14)


def test_line_mesh_is_put_in_order():
    points = [(2, 0, 0), (0, 0, 0), (1, 0, 0), (3, 0, 0)]
    line = from_lines(points, [(2, 0), (1, 2), (3, 0)])
    np.testing.assert_allclose(line.points, np.outer([0, 1, 2, 3], E1))
    second = from_lines([(0, 0), (2, 0), (1, 0), (4, 0), (3, 0)], [(3, 1, 4), (0, 1, 2)])
    np.testing.assert_allclose(second.points, np.outer(np.arange(5), E1))


def test_gmsh_meshes_a_spline(tmp_path):
    """A spline in space meshed by gmsh comes back as its nodes in order."""
    gmsh.initialize()
    try:
        gmsh.option.setNumber("General.Terminal", 0)
        tags = [gmsh.model.occ.addPoint(*p) for p in [(0, 0, 0), (1, 0.5, 0), (2, 0, 1), (3, 0, 0)]]
        gmsh.model.occ.addSpline(tags)
        gmsh.model.occ.synchronize()
        gmsh.option.setNumber("Mesh.MeshSizeMax", 0.2)
        gmsh.model.mesh.generate(1)
        gmsh.write(str(tmp_path / "wire.msh"))
        length = gmsh.model.occ.getMass(1, 1)
    finally:
        gmsh.finalize()
    line = read_lines(tmp_path / "wire.msh")
    np.testing.assert_allclose(line.points[[0, -1]], [(0, 0, 0), (3, 0, 0)], atol=1e-12)
    assert line.length == pytest.approx(length, rel=1e-4)
    assert len(line.points) > 15


def test_files_without_one_line_are_refused(tmp_path):
    path = tmp_path / "bad.vtk"
    meshio.write(path, meshio.Mesh(np.eye(3), [("triangle", [[0, 1, 2]])]))
    with pytest.raises(ValueError, match=r"bad.vtk: no lines"):
        read_lines(path)
    meshio.write(path, meshio.Mesh(np.eye(3), [("line", [[0, 1], [1, 2], [2, 0]])]))
    with pytest.raises(ValueError, match=r"bad.vtk: lines: 0 ends"):
        read_lines(path)


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: straight(-1.0, 3), "length = -1.0: must be a positive number"),
        (lambda: straight(1.0, 0), "elements = 0: must be a positive whole number"),
        (lambda: arc(1.0, 3, 0.0), "radius = 0.0: must be a positive number"),
        (lambda: helix(1.0, 3, 1.0, float("inf")), "pitch = inf: must be a finite number"),
        (lambda: straight(1.0, 2).placed((0, 0, 0), (0, 0, 0)), r"direction = \[0, 0, 0\]: must be longer than 0"),
        (lambda: straight(1.0, 2).placed((0, 0), (0, 0, 1)), r"start = \(0, 0\): must be a list of 3 numbers"),
        (lambda: join([]), "sections: none"),
        (lambda: polyline([(0, 0, 0)]), r"points: shape \(1, 3\): must be \(n, 3\)"),
        (lambda: polyline([(0, 0, 0), (1, 0, 0), (1, 0, 0)]), "points: 1 and 2 are equal"),
        (lambda: polyline([(0, 0, 0), (float("nan"), 0, 0)]), "points: must be finite"),
        (lambda: along([(0, 0, 0), (1, 0, 0)], np.array([0.0, 1.1])), "arc = 0 .. 1.1: must be from 0 to .* 1"),
        (lambda: along([(0, 0, 0), (1, 0, 0)], np.array([0.5, 0.5])), "must be at least 2 increasing numbers"),
        (lambda: from_lines(np.eye(4)[:, :3], [(0, 1), (0, 2), (0, 3)]), "node 0 joins 3 lines"),
        (lambda: from_lines(np.eye(3), [(0, 1), (1, 2), (2, 0)]), "lines: 0 ends"),
        (lambda: from_lines(np.eye(4)[:, :3], [(0, 1), (2, 3)]), "lines: 4 ends"),
        (lambda: from_lines(np.zeros((5, 3)), [(0, 1), (2, 3), (3, 4), (4, 2)]), "3 are not connected"),
        (lambda: from_lines(np.eye(3), [(0, 1, 2, 2)]), r"lines: shape \(1, 4\)"),
        (lambda: Centreline(np.zeros((2, 3)), np.zeros((2, 3, 3)), np.arange(2.0), np.zeros(1, int)), "be rotations"),
    ],
)
def test_refused(call, message):
    with pytest.raises(ValueError, match=message):
        call()
