"""Reading and writing: round trips, gmsh's own files, what is refused."""

from __future__ import annotations

import meshio
import numpy as np
import pytest
from integrals import surface, volume

from meshes.blocks import box
from meshes.files import read, write
from meshes.generators import ring, sphere_octant
from meshes.mesh import Mesh
from meshes.structured import interval


def assert_equal(a, b):
    np.testing.assert_array_equal(a.points, b.points)
    np.testing.assert_array_equal(a.cells, b.cells)
    assert list(a.facets) == list(b.facets)
    assert list(a.regions) == list(b.regions)
    for tag in a.facets:
        np.testing.assert_array_equal(a.facets[tag], b.facets[tag])
    for tag in a.regions:
        np.testing.assert_array_equal(a.regions[tag], b.regions[tag])


@pytest.mark.parametrize(
    "make",
    [
        lambda: interval(1.0, 3, order=2, origin=1 / 3),
        lambda: box((1, 1), n=3, structured=True),
        lambda: ring(1, 2, h=0.5, order=2),
        lambda: box((1, 1, 1), n=2, structured=True, order=2, origin=(0.1, 0.2, 0.3)),
        lambda: sphere_octant(1 / 3, h=0.2, order=2),
    ],
    ids=["interval", "square", "ring", "cube", "sphere"],
)
def test_round_trip_is_identical(make, tmp_path):
    mesh = make()
    write(tmp_path / "a.msh", mesh)
    assert_equal(read(tmp_path / "a.msh"), mesh)


@pytest.fixture
def tagged():
    """Overlapping facets and regions, an empty tag, a facet inside, names with spaces."""
    plain = box((1, 1, 1), n=2, structured=True, order=2)
    every = np.concatenate(list(plain.facets.values()))
    inside = plain.cells[:5, [0, 1, 3]]  # on diagonal planes of the grid
    facets = {**plain.facets, "all of it": every, "none": every[:0], "Rand µ": every[3:9], "cut": inside}
    return Mesh(plain.points, plain.cells, facets, {"odd": np.arange(1, 48, 2), "low": np.arange(20), "no": [5, 30]})


def test_round_trip_of_overlapping_tags(tagged, tmp_path):
    write(tmp_path / "a.msh", tagged)
    assert_equal(read(tmp_path / "a.msh"), tagged)


def test_gmsh_reads_what_is_written(tagged, tmp_path):
    import gmsh

    write(tmp_path / "a.msh", tagged)
    gmsh.initialize(readConfigFiles=False, interruptible=False)
    try:
        gmsh.option.setNumber("General.Terminal", 0)
        gmsh.open(str(tmp_path / "a.msh"))
        assert len(gmsh.model.mesh.getElementsByType(11)[0]) == len(tagged.cells)
        groups = {gmsh.model.getPhysicalName(d, t): (d, t) for d, t in gmsh.model.getPhysicalGroups()}
        for tag, facets in tagged.facets.items():
            if len(facets):
                nodes, _ = gmsh.model.mesh.getNodesForPhysicalGroup(*groups[tag])
                assert len(nodes) == len(np.unique(facets))
        quality = gmsh.model.mesh.getElementQualities(gmsh.model.mesh.getElementsByType(11)[0], "minDetJac")
        assert quality.min() > 0
    finally:
        gmsh.finalize()


def gmsh_file(path, version=4.1, order=2, binary=0, save_all=0, dim=3):
    """A unit box by gmsh itself: two regions in 3D, the groups base, walls (several surfaces) and 7, unnamed."""
    import gmsh

    gmsh.initialize(readConfigFiles=False, interruptible=False)
    try:
        for name, value in {
            "General.Terminal": 0,
            "Mesh.MshFileVersion": version,
            "Mesh.Binary": binary,
            "Mesh.SaveAll": save_all,
            "Mesh.ElementOrder": order,
            "Mesh.MeshSizeMax": 0.5,
        }.items():
            gmsh.option.setNumber(name, value)
        geo = gmsh.model.occ
        if dim == 3:
            halves = [(3, geo.addBox(0, 0, z, 1, 1, 0.5)) for z in (0, 0.5)]
            geo.fragment(halves[:1], halves[1:])
        else:
            geo.addRectangle(0, 0, 5, 1, 1)
        geo.synchronize()
        at = {tag: gmsh.model.occ.getCenterOfMass(dim - 1, tag) for _, tag in gmsh.model.getEntities(dim - 1)}
        last = dim - 1
        base = [tag for tag, c in at.items() if abs(c[1 if dim == 2 else 2]) < 1e-9]
        walls = [tag for tag, c in at.items() if min(c[0], 1 - c[0]) < 1e-9]
        top = [tag for tag, c in at.items() if abs(c[1 if dim == 2 else 2] - 1) < 1e-9]
        gmsh.model.addPhysicalGroup(last, base, name="base")
        gmsh.model.addPhysicalGroup(last, walls, name="walls")
        gmsh.model.addPhysicalGroup(last, top, tag=7)
        for i, (_, tag) in enumerate(gmsh.model.getEntities(dim)):
            gmsh.model.addPhysicalGroup(dim, [tag], tag=20 + i, name=["lower", "upper"][i])
        gmsh.model.mesh.generate(dim)
        gmsh.write(str(path))
    finally:
        gmsh.finalize()
    return path


@pytest.mark.parametrize("binary", [0, 1])
@pytest.mark.parametrize("version", [2.2, 4.1])
def test_gmshs_own_file(version, binary, tmp_path):
    mesh = read(gmsh_file(tmp_path / "a.msh", version, binary=binary))
    assert (mesh.dim, mesh.order) == (3, 2)
    assert set(mesh.facets) == {"base", "walls", "7"}
    for tag, area in [("base", 1), ("walls", 2), ("7", 1)]:
        assert surface(mesh.points, mesh.facet(tag))[0] == pytest.approx(area, rel=1e-12)
    np.testing.assert_allclose(surface(mesh.points, mesh.facet("base"))[1], [0, 0, -1], atol=1e-12)
    for tag in ("lower", "upper"):
        assert volume(mesh.points, mesh.cells[mesh.regions[tag]]) == pytest.approx(0.5, rel=1e-12)


def test_a_mesh_in_a_plane_is_two_dimensional(tmp_path):
    mesh = read(gmsh_file(tmp_path / "a.msh", dim=2))
    assert mesh.points.shape[1] == 2
    assert volume(mesh.points, mesh.cells) == pytest.approx(1, rel=1e-12)
    assert surface(mesh.points, mesh.facet("walls"))[0] == pytest.approx(2, rel=1e-12)


def test_another_format(tmp_path):
    mesh = box((1, 1), n=2, structured=True)
    points = np.pad(mesh.points, ((0, 0), (0, 1)))
    meshio.write(tmp_path / "a.vtu", meshio.Mesh(points, [("triangle", mesh.cells)]))
    np.testing.assert_array_equal(read(tmp_path / "a.vtu").cells, mesh.cells)


CUBE = np.array([[x, y, z] for z in (0.0, 1.0) for x, y in ((0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0))])


@pytest.mark.parametrize(
    ("points", "cells", "message"),
    [
        (CUBE, [("hexahedron", [[0, 1, 2, 3, 4, 5, 6, 7]])], "hexahedron cells are unsupported: must be one of vertex"),
        (CUBE, [("wedge", [[0, 1, 2, 4, 5, 6]])], "wedge cells are unsupported"),
        (CUBE[:4], [("quad", [[0, 1, 2, 3]])], "quad cells are unsupported"),
        (CUBE, [("tetra", [[0, 1, 2, 5]]), ("hexahedron", [[0, 1, 2, 3, 4, 5, 6, 7]])], "hexahedron cells are uns"),
        (CUBE, [("tetra", [[0, 1, 2, 5]]), ("quad", [[0, 1, 2, 3]])], "quad cells are unsupported"),
        (CUBE[:4], [("triangle", [[0, 2, 1]])], "1 of 1 are inverted .*first is cell 0"),
        (CUBE, [("triangle", [[0, 1, 2], [1, 2, 6]])], "cells of dimension 2 with 3 coordinates"),
        (CUBE, [("vertex", [[0]])], "no cells"),
    ],
)
def test_refused(points, cells, message, tmp_path):
    meshio.write(tmp_path / "bad.vtu", meshio.Mesh(points, cells))
    with pytest.raises(ValueError, match=r"bad\.vtu: .*" + message) as error:
        read(tmp_path / "bad.vtu")
    assert "\n" not in str(error.value)


def test_mixed_orders_are_refused(tmp_path):
    points = np.concatenate([CUBE[:4], [[0.5, 0, 0], [1, 0.5, 0], [0.5, 0.5, 0]]])
    cells = [("triangle6", [[0, 1, 2, 4, 5, 6]]), ("triangle", [[0, 2, 3]])]
    meshio.write(tmp_path / "bad.vtu", meshio.Mesh(points, cells))
    with pytest.raises(ValueError, match=r"bad\.vtu: triangle and triangle6 cells are mixed"):
        read(tmp_path / "bad.vtu")


@pytest.mark.parametrize(
    ("name", "text", "message"),
    [
        ("none.msh", None, "no such file"),
        ("a.msh", "not a mesh", "cannot be read"),
        ("a.msh", "$MeshFormat\n4.1 0 8\n$EndMeshFormat\n", "cannot be read"),
        ("a.xyz", "", "cannot be read: Could not deduce file format"),
    ],
)
def test_unreadable(name, text, message, tmp_path, capfd):
    if text is not None:
        (tmp_path / name).write_text(text)
    with pytest.raises(ValueError, match=rf"{name}: {message}") as error:
        read(tmp_path / name)
    assert "\n" not in str(error.value)
    assert capfd.readouterr() == ("", "")


def test_a_file_with_cells_outside_all_groups_says_what_to_do(tmp_path):
    with pytest.raises(ValueError, match=r"a\.msh: .*Mesh\.SaveAll"):
        read(gmsh_file(tmp_path / "a.msh", save_all=1))


@pytest.mark.parametrize(
    ("name", "facets", "regions", "message"),
    [
        ("a.vtk", {}, {}, "must end in .msh"),
        ("a.msh", {'a"b': [[0, 1]]}, {}, "must be non-empty"),
        ("a.msh", {"a": [[0, 1]]}, {"a": [0]}, "not of both"),
    ],
)
def test_what_cannot_be_written(name, facets, regions, message, tmp_path):
    mesh = Mesh([[0.0, 0], [1, 0], [0, 1]], np.array([[0, 1, 2]]), facets, regions)
    with pytest.raises(ValueError, match=message):
        write(tmp_path / name, mesh)
    assert not list(tmp_path.iterdir())
