"""Mortar contact between two bodies: the patch test, action and reaction, and the constraints' integrals."""

from typing import Any

import numpy as np
import pytest
from contact_examples import prepared
from numpy.typing import NDArray

from contact.delassus import CompliantDelassus
from contact.facets import Facets
from contact.mortar import MortarContact
from contact.scene import Scene
from contact.step import step
from contact.system import System
from meshes.generators import generate
from meshes.mesh import Mesh

Floats = NDArray[np.float64]
E, NU, P = 2.0, 0.3, 0.05


def _rotation(dim: int, angle: float) -> Floats:
    c, s = np.cos(angle), np.sin(angle)
    if dim == 2:
        return np.array([[c, -s], [s, c]])
    return np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]]) @ np.array([[1, 0, 0], [0, c, -s], [0, s, c]])


def _blocks(
    dim: int, orders: tuple[int, int], n: tuple[int, int], angle: float = 0.0, **contact: Any
) -> tuple[dict[str, Any], Floats]:
    """Two unit blocks one on the other, turned by an angle, whose far sides follow a uniform strain; that strain."""
    down, aside = (-(1 - NU**2), NU * (1 + NU)) if dim == 2 else (-1.0, NU)
    R = _rotation(dim, angle)
    strain = P / E * R @ np.diag([*[aside] * (dim - 1), down]) @ R.T
    bodies = []
    for name, order, cells, floor, far in zip(
        ("lower", "upper"), orders, n, (0.0, 1.0), ("bottom", "top"), strict=True
    ):
        origin = [0.0] * (dim - 1) + [floor]
        graded = {"grading": 2.0} if name == "lower" else {}
        box = generate("box", size=[1.0] * dim, n=cells, order=order, structured=True, origin=origin, **graded)
        bodies.append(
            {
                "name": name,
                "mesh": Mesh(box.points @ R.T, box.cells, box.facets),
                "material": {"E": E, "nu": NU, "state": "plane-strain" if dim == 2 else "3d"},
                "supports": [{"tag": far, "value": lambda x, t: x @ strain}],
            }
        )
    pair = {"body": "upper", "tag": "bottom", "surface": {"kind": "body", "body": "lower", "tag": "top"}, **contact}
    return {"body": bodies, "contact": [pair]}, strain


def _moments(system: System, finite: bool = False) -> Floats:
    """Σ over both bodies of H times the translations and rotations about the origin, (c, m): zero."""
    result = 0.0
    found = system.detect().constraints[0]
    for body, rows in found.H.items():
        x = body.points[: body.space.piece.owned]
        x = x + body.displacement[: len(x)] if finite else x
        dim = x.shape[1]
        modes = [np.eye(dim)[i] + np.zeros_like(x) for i in range(dim)]
        modes += [np.cross(np.eye(3)[i], x) for i in range(3)] if dim == 3 else [np.stack([-x[:, 1], x[:, 0]], axis=1)]
        result = result + rows.sparse() @ np.stack([m.ravel() for m in modes], axis=1)
    return np.asarray(result)


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
    scene, strain = _blocks(dim, orders, n, angle, side=side, multiplier=multiplier)
    system = prepared(**scene)
    result = step(system, 1.0)
    areas = result.linearisation.constraints[0].areas
    assert areas.sum() == pytest.approx(1.0, rel=1e-12)
    np.testing.assert_allclose(result.lam, P * areas, atol=1e-11 * P * areas.max())
    for body in system.bodies:
        np.testing.assert_allclose(body.displacement, body.points @ strain, atol=1e-12)
    assert result.certificate.complementarity < 1e-10
    assert np.abs(_moments(system)).max() < 1e-13
    system.close()


@pytest.mark.parametrize("dim", [2, 3])
def test_patch_in_finite_sliding(dim: int) -> None:
    """The same where pairing, normals and areas are those of the deformed bodies."""
    scene, strain = _blocks(dim, (2, 1), (2, 3), 0.4, sliding="finite")
    system = prepared(**scene)
    result = step(system, 1.0)
    found = result.linearisation.constraints[0]
    stretched = (1 + NU * P / E) ** 2 if dim == 3 else 1 + NU * (1 + NU) * P / E
    assert found.areas.sum() == pytest.approx(stretched, rel=1e-10)
    assert result.lam.sum() == pytest.approx(P, rel=1e-10)
    for body in system.bodies:
        np.testing.assert_allclose(body.displacement, body.points @ strain, atol=1e-12)
    assert np.abs(_moments(system, finite=True)).max() < 1e-13
    system.close()


def _rings(order: int, side: str = "body", **contact: Any) -> System:
    """Two concentric tubes of different meshes with a clearance of .05."""
    bodies = [
        {
            "name": name,
            "mesh": {"shape": "ring", "inner": inner, "outer": outer, "h": h, "order": order},
            "material": {"E": E, "nu": NU, "state": "plane-strain"},
            "supports": [{"tag": "start", "component": "y"}, {"tag": "end", "component": "x"}],
        }
        for name, inner, outer, h in (("inner", 1.0, 1.95, 0.4), ("outer", 2.0, 3.0, 0.3))
    ]
    pair = {"body": "inner", "tag": "outer", "surface": {"kind": "body", "body": "outer", "tag": "inner"}}
    return prepared(body=bodies, contact=[{**pair, "side": side, **contact}])


@pytest.mark.parametrize("side", ["body", "other"])
def test_gap_between_curved_surfaces(side: str) -> None:
    """Concentric tubes: the gap is the clearance up to the error of curved edges, far below a chord's sagitta."""
    system = _rings(2, side)
    found = system.detect().constraints[0]
    np.testing.assert_allclose(found.offset, 0.05, atol=2e-5)
    # At an end the flat pieces of a convex side look past that of the other by the gap times half a piece's angle.
    assert found.areas.sum() == pytest.approx(np.pi / 2 * (1.95 if side == "body" else 2.0), rel=1e-3)
    assert np.abs(_moments(system)).max() < 1e-13
    system.close()


def test_a_search_is_complete_whatever_the_sizes() -> None:
    """Faces of ratio 1 : 100 either way: all of the surface is seen, and the pairs are those of all pairs tried."""
    for n in ((1, 100), (100, 1)):
        for angle in (0.0, 0.6):
            scene, _ = _blocks(2, (1, 1), n, angle, side="body")
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
    scene, _ = _blocks(2, (2, 2), (3, 4))
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


def test_sliding_far() -> None:
    """A block dragged along another by more than the size of its facets: force from its pressure, wherever it is."""
    scene, _ = _blocks(2, (2, 2), (6, 3), sliding="finite", side="body")
    lower, upper = scene["body"]
    lower["supports"] = [{"tag": "bottom"}]
    lower["mesh"] = generate("box", size=[2.0, 1.0], n=[8, 4], order=2, structured=True)
    upper["supports"] = [{"tag": "left", "component": "x", "value": "0.5*t"}]
    upper["loads"] = [{"kind": "pressure", "tag": "top", "value": 0.02 * P}]
    system = prepared(**scene)
    lam = None
    for k in range(1, 5):
        result = step(system, k / 4, 0.25, start=lam)
        lam = result.lam
        assert lam.sum() == pytest.approx(0.02 * P, rel=1e-6)
        assert result.certificate.equilibrium < 1e-8
        assert np.abs(_moments(system, finite=True)).max() < 1e-13
    system.close()


def test_the_multiplier_side() -> None:
    """The finer side, or the softer one of two alike, carries the multipliers unless the scene says otherwise."""
    for n, stiff, side, expected in [
        ((2, 5), 1.0, "auto", "upper"),
        ((5, 2), 1.0, "auto", "lower"),
        ((4, 4), 100.0, "auto", "lower"),
        ((5, 2), 1.0, "body", "upper"),
        ((2, 5), 1.0, "other", "lower"),
    ]:
        scene, _ = _blocks(2, (1, 1), n, side=side)
        scene["body"][0].pop("grading", None)
        scene["body"][1]["material"] = {"E": E * stiff, "nu": NU, "state": "plane-strain"}
        system = prepared(**scene)
        (pair,) = system.pairs
        assert isinstance(pair, MortarContact)
        assert pair.facets.body.name == expected
        system.close()


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"constraint": "nodal"}, "constraint = 'nodal': the surface of a body takes 'mortar'"),
        ({"direction": [0.0, 1.0]}, "direction"),
        ({"side": "left"}, "side"),
        ({"multiplier": "hat"}, "multiplier"),
        ({"surface": {"kind": "body", "body": "nobody", "tag": "top"}}, r"contact.surface.body = 'nobody'"),
        ({"surface": {"kind": "body", "body": "lower", "tag": "lid"}}, "no tag 'lid'"),
        (
            {"surface": {"kind": "body", "body": "lower", "tag": "bottom"}},
            "no part of upper/bottom looks at lower/bottom",
        ),
    ],
)
def test_bad_contacts(changes: dict[str, Any], message: str) -> None:
    """Each refusal is one line that names the key."""
    scene, _ = _blocks(2, (1, 1), (2, 2), side="body")
    scene["contact"][0].update(changes)
    with pytest.raises(ValueError, match=message):
        prepared(**scene)


def test_bad_interference() -> None:
    """Bodies that start in each other unless the scene declares it; keys of two bodies on a rigid surface."""
    scene, _ = _blocks(2, (1, 1), (2, 2), side="body")
    mesh = generate("box", size=[1.0, 1.0], n=2, structured=True, origin=[0.0, 0.98])
    scene["body"][1]["mesh"] = mesh
    with pytest.raises(ValueError, match=r"a point starts 0\.02 m inside"):
        prepared(**scene)
    scene["contact"][0]["interference"] = 0.02
    prepared(**scene).close()
    with pytest.raises(ValueError, match="side: only of a contact with"):
        Scene.model_validate(
            {
                **scene,
                "contact": [
                    {
                        "body": "upper",
                        "tag": "top",
                        "side": "body",
                        "surface": {"kind": "plane", "point": [0.0, 0.0], "normal": [0.0, 1.0]},
                    }
                ],
            }
        )


def test_normals_at_edges() -> None:
    """Normals are continuous on a smooth surface and the facets' own at a sharp edge."""
    scene, _ = _blocks(2, (1, 1), (2, 2))
    system = prepared(**scene)
    ring = _rings(1)
    x = Facets(ring.bodies[0], "outer")
    normals = x.normals(x.X)
    inside = np.linalg.norm(x.X[..., 0] * x.X[..., 1]) > 0
    assert inside
    by_node: dict[tuple[float, float], Floats] = {}
    for place, n in zip(x.X.reshape(-1, 2).tolist(), normals.reshape(-1, 2), strict=True):
        np.testing.assert_allclose(n, by_node.setdefault((place[0], place[1]), n), atol=1e-14)
    system.close()
    ring.close()


@pytest.mark.parametrize("side", ["body", "other"])
def test_clearance(side: str) -> None:
    """A gap besides that of the meshes: linear and quadratic profiles exactly, in means with the hats; interference."""
    scene, _ = _blocks(2, (2, 2), (2, 3), side=side)
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


def test_columns_are_kept_while_passes_settle(monkeypatch: pytest.MonkeyPatch) -> None:
    """A step of finite sliding solves for its columns once or twice, not in every pass, and finds the same forces."""
    found = []
    for steady in (0.0, 0.5):
        monkeypatch.setattr("contact.system.STEADY", steady)
        solves: list[int] = []
        solve = CompliantDelassus._solve

        def counted(self: Any, rows: Any, solves: Any = solves, solve: Any = solve) -> Any:
            solves.append(id(self))
            return solve(self, rows)

        monkeypatch.setattr(CompliantDelassus, "_solve", counted)
        scene, _ = _blocks(2, (2, 1), (4, 5), sliding="finite")
        lower, upper = scene["body"]
        lower["supports"] = [{"tag": "bottom"}]
        upper["supports"] = [{"tag": "top", "component": "x", "value": 0.1}]
        upper["loads"] = [{"kind": "pressure", "tag": "top", "value": "0.03 + 0.01*x"}]
        system = prepared(**scene)
        result = step(system, 1.0)
        monkeypatch.undo()
        assert result.passes > 4
        found.append((len(set(solves)), result.lam))
        system.close()
    assert found[1][0] <= 3 < found[0][0]
    np.testing.assert_allclose(found[0][1], found[1][1], atol=1e-6 * found[0][1].max())


@pytest.mark.parametrize("sliding", ["small", "finite"])
def test_momentum_of_bodies_that_collide(sliding: str) -> None:
    """Two free blocks in time: what one loses in momentum the other gains."""
    bodies = []
    for name, n, order, origin, velocity in (
        ("lower", 3, 2, [0.0, -1.0], 0.0),
        ("upper", 4, 1, [0.2, 0.02], ["0.1*y", "-0.3 - 0.1*x"]),
    ):
        mesh = {"shape": "box", "size": [1.0, 1.0], "n": n, "order": order, "structured": True, "origin": origin}
        material = {"E": E, "nu": NU, "state": "plane-strain"}
        bodies.append({"name": name, "mesh": mesh, "material": material, "density": 1.0, "velocity": velocity})
    surface = {"kind": "body", "body": "lower", "tag": "top"}
    contact = {"body": "upper", "tag": "bottom", "surface": surface, "sliding": sliding}
    times = {"end": 0.4, "steps": 8, "integrator": "implicit-euler"}
    system = prepared(body=bodies, contact=[contact], time=times)
    momenta, forces = [], []
    for k in range(8):
        result = step(system, 0.05 * (k + 1), 0.05)
        forces.append(result.lam.sum())
        rates = [(body, body.checkpoint()["v"]) for body in system.bodies]
        momenta.append([body.inertia.forces(v).reshape(-1, 2).sum(axis=0) for body, v in rates])
    lower, upper = np.swapaxes(momenta, 0, 1)
    assert forces[0] == 0
    assert forces[-1] > 0
    assert lower[-1][1] < -0.05
    np.testing.assert_allclose(lower + upper, np.tile((lower + upper)[0], (8, 1)), atol=1e-12)
    system.close()


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


def _stack(state: str, *layers: dict[str, Any], pressure: float = P, **contact: Any) -> System:
    """Unit blocks one on the other, each with its keys of a mesh, under a pressure; sides free, held at x = 0."""
    dim = 3 if state == "3d" else 2
    sides = [{"tag": "left", "component": "r" if state == "axisymmetric" else "x"}]
    sides += [{"tag": "front", "component": "y"}] if dim == 3 else []
    bodies, contacts = [], []
    for number, layer in enumerate(layers):
        origin = [0.0] * (dim - 1) + [float(number)]
        shape = {key: value for key, value in layer.items() if key in ("n", "order")}
        body = {
            "name": f"body {number}",
            "mesh": {"shape": "box", "size": [1.0] * dim, "structured": True, "origin": origin, **shape},
            "supports": [*sides],
            **{key: value for key, value in layer.items() if key not in shape},
        }
        if body.get("kind") != "rigid":
            body["material"] = {"E": E, "nu": NU, "state": state, **body.get("material", {})}
        bodies.append(body)
        if number:
            surface = {"kind": "body", "body": f"body {number - 1}", "tag": "top"}
            contacts.append(
                {"name": str(number), "body": f"body {number}", "tag": "bottom", "surface": surface, **contact}
            )
    bodies[0]["supports"].append({"tag": "bottom", "component": "z" if state in ("axisymmetric", "3d") else "y"})
    bodies[-1]["loads"] = [{"kind": "pressure", "tag": "top", "value": pressure}]
    return prepared(body=bodies, contact=contacts)


@pytest.mark.parametrize("multiplier", ["vertex", "dual"])
def test_patch_of_revolution(multiplier: str) -> None:
    """Discs one on the other: weights 2πr, λ = p a, and the uniform strain."""
    system = _stack("axisymmetric", {"n": 3, "order": 2}, {"n": 5, "order": 1}, multiplier=multiplier)
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
    system = _stack(state, {"n": 2, "order": 2}, mixed, {"n": 2, "order": 1})
    result = step(system, 1.0)
    for number, part in enumerate(result.linearisation.constraints):
        start = number * result.linearisation.constraints[0].count
        lam = result.lam[start : start + part.count]
        np.testing.assert_allclose(lam, P * part.areas, atol=1e-9 * P * part.areas.max())
    system.close()


def test_a_rigid_body_on_a_soft_one() -> None:
    """The soft side carries the multipliers, whatever the facets' sizes, and the rigid body's load arrives."""
    system = _stack("plane-strain", {"n": 4, "order": 2}, {"n": 9, "kind": "rigid", "guided": True})
    result = step(system, 1.0)
    (pair,) = system.pairs
    assert isinstance(pair, MortarContact)
    assert pair.facets.body.name == "body 0"
    assert result.lam.sum() == pytest.approx(P, rel=1e-10)
    down = system.bodies[1].displacement[:, 1]
    np.testing.assert_allclose(down, down[0], rtol=1e-12)
    np.testing.assert_allclose(down, -P * (1 - NU**2) / E, rtol=1e-9)
    system.close()
