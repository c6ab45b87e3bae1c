"""gmsh's shapes: tags, exact measures and their rates, snapping, refinement, state, bad parameters."""

from __future__ import annotations

import signal
import sys
from math import pi

import numpy as np
import pytest
from integrals import surface, volume

from meshes.generators import GENERATORS, Refine, box, disc, generate, half_disc, hollow_cylinder, ring, sphere_octant
from meshes.simplices import jacobians

# shape: parameters, h, volume, and by tag (measure, how far nodes are from the exact surface)
LINE, SPHERE = (
    (lambda axis, value: lambda x: x[:, axis] - value),
    (lambda c, R: lambda x: np.hypot.reduce(x - c, 1) - R),
)
SHAPES = {
    "box": (
        {"size": (2, 1), "origin": (1, 1)},
        0.3,
        2.0,
        {"left": (1, LINE(0, 1)), "right": (1, LINE(0, 3)), "bottom": (2, LINE(1, 1)), "top": (2, LINE(1, 2))},
    ),
    "box 3D": (
        {"size": (1, 2, 3), "origin": (0, 0, -3)},
        0.7,
        6.0,
        {
            "left": (6, LINE(0, 0)),
            "right": (6, LINE(0, 1)),
            "front": (3, LINE(1, 0)),
            "back": (3, LINE(1, 2)),
            "bottom": (2, LINE(2, -3)),
            "top": (2, LINE(2, 0)),
        },
    ),
    "layer": (
        {"width": 3, "thickness": 1},
        0.3,
        3.0,
        {"axis": (1, LINE(0, 0)), "far": (1, LINE(0, 3)), "bottom": (3, LINE(1, -1)), "top": (3, LINE(1, 0))},
    ),
    "half-disc": (
        {"radius": 2},
        0.2,
        pi,
        {"axis": (2, LINE(0, 0)), "top": (2, LINE(1, 2)), "arc": (pi, SPHERE([0, 2], 2))},
    ),
    "sphere-section": (
        {"radius": 2},
        0.2,
        pi,
        {"axis": (2, LINE(0, 0)), "top": (2, LINE(1, 2)), "arc": (pi, SPHERE([0, 2], 2))},
    ),
    "disc": ({"radius": 0.5}, 0.1, pi / 4, {"rim": (pi, SPHERE([0, 0], 0.5))}),
    "ring": (
        {"inner": 1, "outer": 2},
        0.2,
        pi * 3 / 4,
        {
            "inner": (pi / 2, SPHERE([0, 0], 1)),
            "outer": (pi, SPHERE([0, 0], 2)),
            "start": (1, LINE(1, 0)),
            "end": (1, LINE(0, 0)),
        },
    ),
    "ring 240°": (
        {"inner": 1, "outer": 2, "angle": 240},
        0.2,
        pi * 2,
        {
            "inner": (pi * 4 / 3, SPHERE([0, 0], 1)),
            "outer": (pi * 8 / 3, SPHERE([0, 0], 2)),
            "start": (1, LINE(1, 0)),
            "end": (1, lambda x: x @ [-np.sqrt(3) / 2, 0.5]),
        },
    ),
    "ring structured": (
        {"inner": 1, "outer": 2, "angle": 180, "structured": True, "grading": [2.0, lambda t: t**2]},
        0.1,
        pi * 3 / 2,
        {
            "inner": (pi, SPHERE([0, 0], 1)),
            "outer": (2 * pi, SPHERE([0, 0], 2)),
            "start": (1, LINE(1, 0)),
            "end": (1, LINE(1, 0)),
        },
    ),
    "ring of a disc": (
        {"inner": 0, "outer": 2},
        0.2,
        pi,
        {"outer": (pi, SPHERE([0, 0], 2)), "start": (2, LINE(1, 0)), "end": (2, LINE(0, 0))},
    ),
    "shell-section of a ball": (
        {"inner": 0, "outer": 2},
        0.2,
        pi,
        {"outer": (pi, SPHERE([0, 0], 2)), "equator": (2, LINE(1, 0)), "axis": (2, LINE(0, 0))},
    ),
    "shell-section": (
        {"inner": 1, "outer": 2},
        0.2,
        pi * 3 / 4,
        {
            "inner": (pi / 2, SPHERE([0, 0], 1)),
            "outer": (pi, SPHERE([0, 0], 2)),
            "equator": (1, LINE(1, 0)),
            "axis": (1, LINE(0, 0)),
        },
    ),
    "hollow-cylinder": (
        {"inner": 1, "outer": 2, "length": 1.5},
        0.4,
        pi * 9 / 8,
        {
            "inner": (pi * 3 / 4, lambda x: np.hypot(x[:, 0], x[:, 1]) - 1),
            "outer": (pi * 3 / 2, lambda x: np.hypot(x[:, 0], x[:, 1]) - 2),
            "start": (1.5, LINE(1, 0)),
            "end": (1.5, LINE(0, 0)),
            "bottom": (pi * 3 / 4, LINE(2, 0)),
            "top": (pi * 3 / 4, LINE(2, 1.5)),
        },
    ),
    "sphere-octant": (
        {"radius": 2},
        0.5,
        pi * 4 / 3,
        {
            "x0": (pi, LINE(0, 0)),
            "y0": (pi, LINE(1, 0)),
            "top": (pi, LINE(2, 2)),
            "sphere": (2 * pi, SPHERE([0, 0, 2], 2)),
        },
    ),
    "half-ellipsoid": (
        {"radii": [2.0, 1.0, 0.5]},
        0.25,
        pi * 2 / 3,
        {
            "top": (2 * pi, LINE(2, 0.5)),
            "ellipsoid": (
                7.934581081557302,  # by quadrature
                lambda x: np.linalg.norm((x - [0, 0, 0.5]) / [2, 1, 0.5], axis=1) - 1,
            ),
        },
    ),
    "shell-octant": (
        {"inner": 1, "outer": 2},
        0.3,
        pi * 7 / 6,
        {
            "x0": (pi * 3 / 4, LINE(0, 0)),
            "y0": (pi * 3 / 4, LINE(1, 0)),
            "z0": (pi * 3 / 4, LINE(2, 0)),
            "inner": (pi / 2, SPHERE([0, 0, 0], 1)),
            "outer": (2 * pi, SPHERE([0, 0, 0], 2)),
        },
    ),
}


def make(name, **more):
    parameters, h, *_ = SHAPES[name]
    return generate(name.split()[0], **{"h": h, **parameters, **more})


@pytest.mark.parametrize("name", SHAPES)
def test_quadratic_shape(name):
    """Volume and areas to fourth order in h, tags that cover the boundary once and outward, nodes on the surface."""
    _, _, exact, tags = SHAPES[name]
    mesh = make(name, order=2)
    assert mesh.order == 2
    assert set(mesh.facets) == set(tags)
    assert volume(mesh.points, mesh.cells) == pytest.approx(exact, rel=1e-4)
    for tag, (area, distance) in tags.items():
        assert surface(mesh.points, mesh.facet(tag))[0] == pytest.approx(area, rel=1e-4)
        assert abs(distance(mesh.points[np.unique(mesh.facet(tag))])).max() < 1e-12
    rows = np.concatenate(list(mesh.facets.values()))
    np.testing.assert_array_equal(np.unique(rows, axis=0), np.unique(mesh.boundary(), axis=0))
    assert len(rows) == len(mesh.boundary())
    _, normal, flux = surface(mesh.points, rows)
    np.testing.assert_allclose(normal, 0, atol=1e-13)
    assert flux == pytest.approx(mesh.dim * volume(mesh.points, mesh.cells), rel=1e-13)


@pytest.mark.parametrize(("name", "h"), [("half-disc", 0.4), ("sphere-octant", 1.0)])
@pytest.mark.parametrize("order", [1, 2])
def test_rate_of_the_volume(name, h, order):
    """Curved boundaries: |V − V_h| falls as h² with straight cells and as h⁴ with quadratic ones."""
    _, _, exact, _ = SHAPES[name]
    meshes = [make(name, order=order, h=h / 2**k) for k in range(3)]
    error = [abs(volume(m.points, m.cells) / exact - 1) for m in meshes]
    size = [len(m.facet("arc" if name == "half-disc" else "sphere")) ** (-1 / (m.dim - 1)) for m in meshes]
    assert np.polyfit(np.log(size), np.log(error), 1)[0] == pytest.approx(2 * order, abs=0.25)


@pytest.mark.parametrize("shape", ["ring", "shell-section", "shell-octant"])
def test_cells_behind_a_strongly_curved_boundary_are_not_inverted(shape):
    """A shell of 1/20 of its radius with cells of 10 times its thickness: a straight inner edge would cut the arc."""
    mesh = generate(shape, inner=1, outer=1.05, h=0.5, order=2)
    assert jacobians(mesh.points, mesh.cells).min() > 0


def test_every_shape_is_covered():
    elsewhere = {"interval", "domed-block", "catheter", "balloon", "blunt-tip"}
    elsewhere |= {"tube-wall", "vessel-wall", "bifurcation-wall", "aneurysm-wall"}
    assert {name.split()[0] for name in SHAPES} | elsewhere == set(GENERATORS)


@pytest.mark.parametrize("axis", [[0, 0, 2], [0, 0, -1], [1, 0, 0], [1, 2, -2], [1e-9, 0, -1]])
def test_placement(axis):
    """The z axis points where it is told and the origin moves; volumes and tags stay."""
    where = {"origin": [1.0, 2.0, 3.0], "axis": axis}
    here = generate("half-ellipsoid", radii=[2.0, 1.0, 0.5], h=0.5)
    there = generate("half-ellipsoid", radii=[2.0, 1.0, 0.5], h=0.5, placement=where)
    assert volume(there.points, there.cells) == pytest.approx(volume(here.points, here.cells), rel=1e-12)
    unit = np.array(axis) / np.linalg.norm(axis)
    np.testing.assert_allclose((there.points - where["origin"]) @ unit, here.points[:, 2], atol=1e-12)
    np.testing.assert_array_equal(there.facets["top"], here.facets["top"])
    plane = generate("disc", radius=1.0, h=0.5, placement={"origin": [3.0, 0.0]})
    assert plane.points[:, 0].min() == pytest.approx(2.0)


def test_domed_block():
    """Its top is z = 1 − r²/16 at every node, its volume 1 − (1/3 + 1/3)/16, its other sides those of the cube."""
    block = generate("domed-block", size=[1.0, 1.0, 1.0], radius=8.0, n=4, order=2, structured=True)
    top = block.points[np.unique(block.facet("top"))]
    np.testing.assert_allclose(top[:, 2], 1 - (top[:, 0] ** 2 + top[:, 1] ** 2) / 16, atol=1e-14)
    assert volume(block.points, block.cells) == pytest.approx(1 - 2 / 3 / 16, abs=1e-12)
    assert np.all(block.points[np.unique(block.facet("bottom")), 2] == 0)
    with pytest.raises(ValueError, match=r"radius = 0\.5"):
        generate("domed-block", size=[1.0, 1.0], radius=0.5, n=2, structured=True)


def sizes(mesh):
    """Centroids and mean edges of the cells."""
    k = mesh.dim + 1
    x = mesh.points[mesh.cells[:, :k]]
    return x.mean(axis=1), np.linalg.norm(x[:, :, None] - x[:, None], axis=-1).sum(axis=(1, 2)) / (k * (k - 1))


@pytest.mark.parametrize(
    "mesh",
    [
        lambda refine: half_disc(1, h=0.2, refine=refine),
        lambda refine: sphere_octant(1, h=0.2, refine=refine, order=2),
        lambda refine: box((1, 1, 1), h=0.2, refine=refine),
    ],
)
def test_refinement_around_a_point(mesh):
    refine = Refine([0] * mesh(None).dim, radius=0.1, h=0.02)
    mesh = mesh(refine)
    centroid, size = sizes(mesh)
    distance = np.linalg.norm(centroid, axis=1)
    near = size[distance < refine.radius]
    assert len(near) > 20
    assert near.mean() == pytest.approx(refine.h, rel=0.3)
    allowed = np.minimum(0.2, refine.h + refine.growth * np.maximum(0, distance - refine.radius))
    assert (size / allowed).mean() == pytest.approx(1, abs=0.3)
    assert (size < 2 * allowed).all()
    assert size.max() > 7 * near.mean()


def test_refinement_along_a_line():
    mesh = box((1, 1, 1), h=0.25, refine=Refine([(0, 0, 0), (0, 1, 0)], radius=0.05, h=0.05, growth=0.5))
    centroid, size = sizes(mesh)
    near = np.hypot(centroid[:, 0], centroid[:, 2]) < 0.05
    ends = [size[near & (centroid[:, 1] < 0.5)].mean(), size[near & (centroid[:, 1] > 0.5)].mean()]
    np.testing.assert_allclose(ends, 0.05, rtol=0.3)
    assert size.max() > 0.25


def test_the_same_mesh_every_time():
    first, second = (sphere_octant(1, h=0.3, order=2, refine=Refine((0, 0, 0), 0.1, 0.1)) for _ in range(2))
    np.testing.assert_array_equal(first.points, second.points)
    np.testing.assert_array_equal(first.cells, second.cells)


def test_gmsh_is_quiet_and_leaves_nothing_behind(capfd):
    import gmsh

    handler = signal.getsignal(signal.SIGINT)
    disc(1, h=0.5, order=2)
    assert not gmsh.isInitialized()
    assert signal.getsignal(signal.SIGINT) is handler
    with pytest.raises(ValueError, match="order"):
        disc(1, h=0.5, order=3)
    assert not gmsh.isInitialized()
    assert capfd.readouterr() == ("", "")


def test_the_callers_gmsh_session_goes_on():
    import gmsh

    alone = disc(1, h=0.5)
    gmsh.initialize(interruptible=False)
    try:
        gmsh.option.setNumber("Mesh.Algorithm", 5)
        gmsh.option.setNumber("General.Terminal", 0)
        gmsh.model.add("mine")
        gmsh.model.geo.addPoint(1, 2, 3)
        gmsh.model.geo.synchronize()
        np.testing.assert_array_equal(disc(1, h=0.5).points, alone.points)
        assert gmsh.model.getCurrent() == "mine"
        assert gmsh.model.getEntities() == [(0, 1)]
        assert gmsh.option.getNumber("Mesh.Algorithm") == 5
        assert "signorini" not in gmsh.model.list()
    finally:
        gmsh.finalize()


@pytest.mark.parametrize("broken", ["raise OSError('libGLU.so.1: cannot open')", "raise ImportError('no gmsh')"])
def test_missing_gmsh_is_one_line_with_the_cure(broken, tmp_path, monkeypatch):
    (tmp_path / "gmsh.py").write_text(broken)
    monkeypatch.syspath_prepend(tmp_path)
    monkeypatch.delitem(sys.modules, "gmsh", raising=False)
    with pytest.raises(ImportError, match=r"pip install gmsh.*apt-get install libglu1-mesa") as error:
        disc(1, h=0.5)
    assert "\n" not in str(error.value)


def test_structured_meshes_do_without_gmsh(monkeypatch):
    monkeypatch.setitem(sys.modules, "gmsh", None)
    assert len(box((1, 1), n=2, structured=True).cells) == 8


@pytest.mark.parametrize(
    ("shape", "change", "message"),
    [
        ("cube", {}, r"shape = 'cube': must be one of interval, box, domed-block, layer, half-disc"),
        ("ring", {"radius": 1}, "radius = 1: unknown, must be one of inner, outer, h, angle, order"),
        ("ring", {"inner": None}, "'ring': inner: missing"),
        ("ring", {"inner": -1.0}, "inner = -1.0: must be zero or a positive number"),
        ("ring", {"inner": "1"}, "inner = '1': must be a finite number"),
        ("ring", {"inner": True}, "inner = True"),
        ("ring", {"inner": float("nan")}, "inner = nan"),
        ("ring", {"inner": 0.0, "h": None, "n": 4, "structured": True}, "inner = 0.0: must be positive in"),
        ("ring", {"n": 4}, r"h, n = \[0.5, 4\]: must be given one and not the other"),
        ("ring", {"outer": 1.0}, "outer = 1.0: must be greater than inner = 1.0"),
        ("ring", {"angle": 360.0}, "angle = 360.0: must be between 0 and 360"),
        ("ring", {"h": 0}, "h = 0: must be a positive number"),
        ("ring", {"order": 3}, "order = 3: must be 1 or 2"),
        ("ring", {"order": True}, "order = True"),
        ("ring", {"refine": 2}, "refine = 2: must be a Refine"),
        ("ring", {"refine": {"at": [1, 0], "radius": 0.1}}, r"refine\.h: missing"),
        ("ring", {"refine": {"at": [1, 0], "radius": 0.1, "h": 0.1, "to": 2}}, r"refine\.to = 2: unknown"),
        ("ring", {"refine": {"at": [1, 0], "radius": -0.1, "h": 0.1}}, r"refine\.radius = -0\.1"),
        ("ring", {"refine": {"at": [1, 0, 0], "radius": 0.1, "h": 0.1}}, r"refine\.at = .*list of 2 numbers"),
        ("ring", {"refine": {"at": 1, "radius": 0.1, "h": 0.1}}, r"refine\.at = 1"),
        ("ring", {"refine": {"at": [1, 0], "radius": 0.1, "h": 0.6}}, r"refine\.h = 0\.6: must be at most h = 0\.5"),
        ("ring", {"placement": 3}, "placement = 3: must be a table with origin and axis"),
        ("ring", {"placement": {"axis": [0, 1]}}, r"placement\.origin: missing"),
        ("ring", {"placement": {"origin": [0, 1, 2]}}, "origin = .*list of 2 numbers"),
        ("ring", {"placement": {"origin": [0, 1], "axis": [0, 0, 1]}}, "axis = .*left out of a mesh of dimension 2"),
        ("ring", {"placement": {"origin": [0, 1], "turn": 1}}, r"placement\.turn = 1: unknown, must be one of origin"),
        ("box", {"size": (1, 1, 1, 1)}, "size = .*list of 2 or 3"),
        ("box", {"size": (1, -1)}, r"size\[1\] = -1"),
        ("box", {"size": (1, 1), "origin": (0, 0, 0)}, "origin = .*list of 2"),
        ("box", {"size": (1, 1), "grading": 2}, "grading = 2: must be given with structured"),
        ("box", {"size": (1, 1), "structured": True, "refine": Refine((0, 0), 1, 0.1)}, "refine = .*left out"),
        ("interval", {"length": 1.0, "n": 0, "h": None}, "n = 0"),
    ],
)
def test_bad_parameters(shape, change, message):
    known = {"inner": 1.0, "outer": 2.0} if shape == "ring" else {}
    parameters = {key: value for key, value in {**known, "h": 0.5, **change}.items() if value is not None}
    with pytest.raises(ValueError, match=message) as error:
        generate(shape, **parameters)
    assert "\n" not in str(error.value)


def test_a_scenes_table_refines():
    by_table = generate("ring", inner=1, outer=2, h=0.5, refine={"at": [1, 0], "radius": 0.1, "h": 0.05})
    assert len(by_table.cells) == len(ring(1, 2, h=0.5, refine=Refine((1, 0), 0.1, 0.05)).cells) > 100


def test_python_callers_get_the_same_checks():
    with pytest.raises(ValueError, match="length = 0: must be a positive number"):
        hollow_cylinder(1, 2, 0, h=0.5)
