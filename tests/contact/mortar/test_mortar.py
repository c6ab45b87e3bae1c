"""Mortar contact between two bodies: the patch test, action and reaction, and the constraints' integrals."""

from typing import Any

import numpy as np
import pytest
from contact_examples import box, prepared, solid
from mortar_examples import NU, E, P, blocks, moments, rings, stack
from numpy.typing import NDArray

from contact.mortar.facets import Facets
from contact.mortar.mortar_contact import MortarContact, _nearest
from contact.step import step
from meshes.generators import generate
from meshes.mesh import Mesh

Floats = NDArray[np.float64]


@pytest.mark.parametrize("multiplier", ["vertex", "dual"])
@pytest.mark.parametrize("side", ["body", "other"])
@pytest.mark.parametrize(
    ("dim", "orders", "n", "angle"),
    [
        (2, (1, 1), (3, 3), 0.0),
        (2, (1, 1), (2, 20), 0.4),
        (2, (2, 2), (20, 2), 0.0),
        (2, (1, 2), (3, 5), 1.1),
        (2, (2, 1), (5, 3), -0.7),
        (3, (1, 1), (3, 2), 0.0),
        (3, (2, 2), (2, 3), 0.4),
        (3, (1, 2), (10, 1), 0.4),
        (3, (2, 1), (1, 10), 0.0),
    ],
)
def test_patch(dim: int, orders: Any, n: Any, angle: float, side: str, multiplier: str) -> None:
    """A uniform pressure passes a non-matching interface to round-off: λ = p a, u the uniform strain."""
    scene, strain = blocks(dim, orders, n, angle, side=side, multiplier=multiplier)
    system = prepared(**scene)
    result = step(system, 1.0)
    areas = result.linearisation.constraints[0].areas
    assert areas.sum() == pytest.approx(1.0, rel=1e-12)
    np.testing.assert_allclose(result.lam, P * areas, atol=1e-11 * P * areas.max())
    for body in system.bodies:
        np.testing.assert_allclose(body.displacement, body.points @ strain, atol=1e-12)
    assert result.certificate.complementarity < 1e-10
    assert np.abs(moments(system)).max() < 1e-13
    system.close()


@pytest.mark.parametrize("side", ["body", "other"])
def test_gap_between_curved_surfaces(side: str) -> None:
    """Concentric tubes: the gap is the clearance up to the error of curved edges, far below a chord's sagitta."""
    system = rings(2, side)
    found = system.detect().constraints[0]
    np.testing.assert_allclose(found.offset, 0.05, atol=2e-5)
    # At an end the flat pieces of a convex side look past that of the other by the gap times half a piece's angle.
    assert found.areas.sum() == pytest.approx(np.pi / 2 * (1.95 if side == "body" else 2.0), rel=1e-3)
    assert np.abs(moments(system)).max() < 1e-13
    system.close()


def test_a_search_is_complete_whatever_the_sizes() -> None:
    """Faces of ratio 1 : 100 either way: all of the surface is seen, and the pairs are those of all pairs tried."""
    for n in ((1, 100), (100, 1)):
        for angle in (0.0, 0.6):
            scene, _ = blocks(2, (1, 1), n, angle, side="body")
            system = prepared(**scene)
            (pair,) = system.pairs
            assert isinstance(pair, MortarContact)
            assert system.detect().constraints[0].areas.sum() == pytest.approx(1.0, rel=1e-12)
            _, corners = pair.facets.pieces(pair.facets.X)
            pairs = pair._candidates(pair.facets.X, pair.others.X, corners, pair.depth)
            assert len(pairs) >= 100
            system.close()


def test_partly_covered_facets() -> None:
    """A block that reaches over its support's edge: areas are those of the overlap, and so are both bases' moments."""
    base = generate("box", size=[1.0, 1.0], n=3, structured=True)
    for multiplier in ("vertex", "dual"):
        top = generate("box", size=[1.0, 1.0], n=4, structured=True, origin=[0.37, 1.1])
        bodies = [
            {
                "name": name,
                "mesh": mesh,
                "material": {"E": E, "nu": NU, "state": "plane-strain"},
                "supports": [{"tag": far}],
            }
            for name, mesh, far in (("lower", base, "bottom"), ("upper", top, "top"))
        ]
        surface = {"kind": "body", "body": "lower", "tag": "top"}
        contact = {"body": "upper", "tag": "bottom", "surface": surface, "side": "body", "multiplier": multiplier}
        system = prepared(body=bodies, contact=[contact])
        lin = system.detect()
        found = lin.constraints[0]
        x, seen = found.places[:, 0], np.isfinite(found.offset)
        assert found.areas.sum() == pytest.approx(0.63, rel=1e-12)
        np.testing.assert_array_equal(seen, x < 1.2)
        np.testing.assert_allclose(found.offset[seen], 0.1, atol=1e-14)
        assert not np.isin(np.flatnonzero(~seen), lin.rows).any()
        # ∫ x ds over .37 < x < 1 from the rows: a rotation of the upper body about the origin has the gap's rate x
        upper = next(b for b in system.bodies if b.name == "upper")
        X = upper.points
        lifted = upper.owned(np.stack([0 * X[:, 0], X[:, 0]], axis=1).ravel())
        rates = found.H[upper].apply(lifted)
        assert found.areas @ rates == pytest.approx((1 - 0.37**2) / 2, rel=1e-12)
        if multiplier == "dual":  # δ_i is the vertex's own gap where gaps are linear
            np.testing.assert_allclose(rates[seen], x[seen], rtol=1e-12)
        system.close()


def test_held_by_contact_alone() -> None:
    """A block on another, free but for its sides, under a pressure: the balance of forces, and p a at every vertex."""
    scene, _ = blocks(2, (2, 2), (3, 4))
    lower, upper = scene["body"]
    lower["supports"] = [{"tag": "bottom", "component": "y"}, {"tag": "left", "component": "x"}]
    upper["supports"] = [{"tag": "left", "component": "x"}]
    upper["loads"] = [{"kind": "pressure", "tag": "top", "value": P}]
    for sliding in ("small", "finite"):
        scene["contact"][0]["sliding"] = sliding
        system = prepared(**scene)
        result = step(system, 1.0)
        assert result.lam.sum() == pytest.approx(P, rel=1e-10)
        system.close()


def test_normals() -> None:
    """One normal at each node of a smooth surface, from all of its facets; at sharp edges those of each side."""
    ring = rings(1)
    facets = Facets(ring.bodies[0], "outer")
    at_nodes: dict[tuple[float, ...], Floats] = {}
    for place, n in zip(facets.X.reshape(-1, 2), facets.normals(facets.X).reshape(-1, 2), strict=True):
        np.testing.assert_allclose(n, at_nodes.setdefault(tuple(place), n), atol=1e-14)
        assert n @ place / np.linalg.norm(place) > 0.98
    ring.close()
    for dim, state in ((2, "plane-strain"), (3, "3d")):
        mesh = box(dim, 2)
        body = solid(Mesh(mesh.points, mesh.cells, {"all": mesh.boundary()}), state)
        facets = Facets(body, "all")
        normals = facets.normals(facets.X)
        own = normals.mean(axis=1, keepdims=True)
        np.testing.assert_allclose(normals, np.broadcast_to(own, normals.shape), atol=1e-14)
        assert np.abs(own).max(axis=2) == pytest.approx(1.0)
        body.close()


@pytest.mark.parametrize("side", ["body", "other"])
def test_clearance(side: str) -> None:
    """A gap besides that of the meshes: linear and quadratic profiles exactly, in means with the hats; interference."""
    scene, _ = blocks(2, (2, 2), (2, 3), side=side)
    scene["contact"][0].update(clearance="0.01*x**2")
    system = prepared(**scene)
    found = system.detect().constraints[0]
    # ∫ x² ds and ∫ x³ ds of the unit interface: hats sum to 1 and, weighted with their vertices, to x
    assert found.areas @ found.offset == pytest.approx(0.01 / 3, rel=1e-12)
    assert (found.areas * found.places[:, 0]) @ found.offset == pytest.approx(0.01 / 4, rel=1e-12)
    system.close()
    scene["contact"][0].update(clearance=-0.02)
    with pytest.raises(ValueError, match=r"a point starts 0\.02 m inside"):
        prepared(**scene)
    scene["contact"][0].update(interference=0.02)
    system = prepared(**scene)
    np.testing.assert_allclose(system.detect().constraints[0].offset, -0.02, rtol=1e-12)
    system.close()
    scene["contact"][0].update(clearance="0.01*w")
    with pytest.raises(ValueError, match="w"):
        prepared(**scene)


def test_an_open_bent_gap_is_no_interference() -> None:
    """A roll that touches a block in a line: its gap's mean with a dual function is negative, and that is accepted."""
    material = {"E": E, "nu": NU, "state": "plane-strain"}
    roll = {"name": "roll", "mesh": {"shape": "half-disc", "radius": 1.0, "h": 0.2, "order": 2}, "material": material}
    box = {"shape": "box", "size": [1.0, 1.0], "n": 12, "structured": True, "origin": [0.0, -1.0]}
    block = {"name": "block", "mesh": box, "material": material, "supports": [{"tag": "bottom"}]}
    roll["supports"] = [{"tag": "top"}]
    surface = {"kind": "body", "body": "block", "tag": "top"}
    contact = {"body": "roll", "tag": "arc", "surface": surface, "side": "other", "multiplier": "dual"}
    system = prepared(body=[roll, block], contact=[contact])
    assert system.pairs[0].gaps().min() < -1e-5
    system.close()


@pytest.mark.parametrize("multiplier", ["vertex", "dual"])
def test_patch_of_revolution(multiplier: str) -> None:
    """Discs one on the other: weights 2πr, λ = p a, and the uniform strain."""
    system = stack("axisymmetric", {"n": 3, "order": 2}, {"n": 5, "order": 1}, multiplier=multiplier)
    result = step(system, 1.0)
    areas = result.linearisation.constraints[0].areas
    assert areas.sum() == pytest.approx(np.pi, rel=1e-12)
    np.testing.assert_allclose(result.lam, P * areas, atol=1e-11 * P * areas.max())
    for body in system.bodies:
        np.testing.assert_allclose(body.displacement, body.points * P / E * np.array([NU, -1.0]), atol=1e-12)
    system.close()


@pytest.mark.parametrize("state", ["plane-strain", "3d"])
def test_several_pairs(state: str) -> None:
    """Three blocks, the middle one of mixed elements: both interfaces pass the same uniform pressure."""
    mixed = {"n": 3, "order": 2, "material": {"formulation": "mixed"}}
    system = stack(state, {"n": 2, "order": 2}, mixed, {"n": 2, "order": 1})
    result = step(system, 1.0)
    for number, part in enumerate(result.linearisation.constraints):
        start = number * result.linearisation.constraints[0].count
        lam = result.lam[start : start + part.count]
        np.testing.assert_allclose(lam, P * part.areas, atol=1e-9 * P * part.areas.max())
    system.close()


def test_a_rigid_body_on_a_soft_one() -> None:
    """The soft side carries the multipliers, whatever the facets' sizes, and the rigid body's load arrives."""
    system = stack("plane-strain", {"n": 4, "order": 2}, {"n": 9, "kind": "rigid", "guided": True})
    result = step(system, 1.0)
    (pair,) = system.pairs
    assert isinstance(pair, MortarContact)
    assert pair.facets.body.name == "body 0"
    assert result.lam.sum() == pytest.approx(P, rel=1e-10)
    down = system.bodies[1].displacement[:, 1]
    np.testing.assert_allclose(down, down[0], rtol=1e-12)
    np.testing.assert_allclose(down, -P * (1 - NU**2) / E, rtol=1e-9)
    system.close()


def test_the_nearest_of_several_layers() -> None:
    """Of layers one behind the other a facet touches those that cover it first; parts side by side all count."""
    facet = np.array([0, 0, 0, 1, 1])
    covered, area = np.array([0.6, 1.0, 0.4, 0.3, 0.0]), np.ones((5, 2))
    gap = np.array([0.1, 0.5, -0.2, 0.9, 0.0])[:, None] * area / 2
    np.testing.assert_array_equal(_nearest(facet, covered, gap, area, 1.0), [True, False, True, True, False])
