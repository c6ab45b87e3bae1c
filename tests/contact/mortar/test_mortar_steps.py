"""Steps of two bodies in mortar contact: finite sliding, motion in time, and what scenes may say of it."""

from typing import Any

import numpy as np
import pytest
from contact_examples import prepared
from mortar_examples import NU, E, P, blocks, moments
from numpy.typing import NDArray

from contact.delassus import CompliantDelassus
from contact.mortar.mortar_contact import MortarContact
from contact.scene.schema import Scene
from contact.step import step
from meshes.generators import generate
from meshes.mesh import Mesh

Floats = NDArray[np.float64]


@pytest.mark.parametrize("dim", [2, 3])
def test_patch_in_finite_sliding(dim: int) -> None:
    """The same where pairing, normals and areas are those of the deformed bodies."""
    scene, strain = blocks(dim, (2, 1), (2, 3), 0.4, sliding="finite")
    system = prepared(**scene)
    result = step(system, 1.0)
    found = result.linearisation.constraints[0]
    stretched = (1 + NU * P / E) ** 2 if dim == 3 else 1 + NU * (1 + NU) * P / E
    assert found.areas.sum() == pytest.approx(stretched, rel=1e-10)
    assert result.lam.sum() == pytest.approx(P, rel=1e-10)
    for body in system.bodies:
        np.testing.assert_allclose(body.displacement, body.points @ strain, atol=1e-12)
    assert np.abs(moments(system, finite=True)).max() < 1e-13
    system.close()


def test_sliding_far() -> None:
    """A block dragged along another by more than the size of its facets: force from its pressure, wherever it is."""
    scene, _ = blocks(2, (2, 2), (6, 3), sliding="finite", side="body")
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
        assert np.abs(moments(system, finite=True)).max() < 1e-13
    system.close()


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
        scene, _ = blocks(2, (2, 1), (4, 5), sliding="finite")
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


def test_the_multiplier_side() -> None:
    """The finer side, or the softer one of two alike, carries the multipliers unless the scene says otherwise."""
    layers = {"soft": {"E": E / 2, "nu": NU}, "hard": {"E": 100 * E, "nu": NU}}
    for n, material, side, expected in [
        ((2, 5), {"E": E, "nu": NU}, "auto", "upper"),
        ((5, 2), {"E": E, "nu": NU}, "auto", "lower"),
        ((4, 4), {"E": 100 * E, "nu": NU}, "auto", "lower"),
        ((4, 4), {"regions": layers}, "auto", "upper"),
        ((5, 2), {"E": E, "nu": NU}, "body", "upper"),
        ((2, 5), {"E": E, "nu": NU}, "other", "lower"),
    ]:
        scene, _ = blocks(2, (1, 1), n, side=side)
        upper = scene["body"][1]
        mesh, cells = upper["mesh"], len(upper["mesh"].cells)
        regions = {"soft": np.arange(cells // 2), "hard": np.arange(cells // 2, cells)}
        upper["mesh"] = Mesh(mesh.points, mesh.cells, mesh.facets, regions)
        upper["material"] = {"state": "plane-strain", **material}
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
    scene, _ = blocks(2, (1, 1), (2, 2), side="body")
    scene["contact"][0].update(changes)
    with pytest.raises(ValueError, match=message):
        prepared(**scene)


def test_bad_interference() -> None:
    """Bodies that start in each other unless the scene declares it; keys of two bodies on a rigid surface."""
    scene, _ = blocks(2, (1, 1), (2, 2), side="body")
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
