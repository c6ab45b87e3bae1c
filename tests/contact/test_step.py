"""Steps: sliding on curved surfaces, both kinds of sliding on a plane, and bodies that contact must hold."""

from typing import Any

import numpy as np
import pytest
from contact_examples import FLOOR, box, on_floor, prepared

from contact.certificate import Tolerances
from contact.solvers.problem import ContactNotConvergedError, InfeasibleError
from contact.step import step

TIGHT = Tolerances(1e-8, 1e-8, 1e-9, 1e-9)


def _pressed(dim: int, sliding: str, surface: Any, t: Any = -0.05, **contact: Any) -> dict[str, Any]:
    body = {
        "name": "body",
        "mesh": box(dim, 1, n=6 if dim == 2 else 4),
        "material": {"E": 2.0, "nu": 0.3, "state": "plane-strain" if dim == 2 else "3d"},
        "supports": [{"tag": "top", "value": lambda x, s: np.broadcast_to([*[0.0] * (dim - 1), t], x.shape)}],
    }
    pair = {"body": "body", "tag": "bottom", "surface": surface, "sliding": sliding, **contact}
    return {"body": [body], "contact": [pair]}


@pytest.mark.parametrize("dim", [2, 3])
@pytest.mark.parametrize("constraint", ["nodal", "mortar"])
def test_plane_by_small_and_finite_sliding(dim: int, constraint: str) -> None:
    """On a plane tangent planes are the plane: both give the same motion and forces."""
    results = []
    for sliding in ("small", "finite"):
        system = prepared(**_pressed(dim, sliding, FLOOR[dim], constraint=constraint))
        result = step(system, 1.0, tolerances=TIGHT)
        results.append((system.bodies[0].u.copy(), result.lam))
        assert np.all(result.gap > -1e-10)
        system.close()
    np.testing.assert_allclose(results[0][0], results[1][0], atol=1e-11)
    np.testing.assert_allclose(results[0][1], results[1][1], atol=1e-11)
    assert results[0][1].min() > 0


@pytest.mark.parametrize("dim", [2, 3])
def test_block_pressed_on_a_ball(dim: int) -> None:
    """Tangent planes updated from pass to pass leave the loaded nodes on the true sphere and no node inside it."""
    centre, R = np.array([0.3, *[0.4] * (dim - 2), -0.7]), 0.7
    ball = {"kind": "sphere", "centre": centre.tolist(), "radius": R}
    system = prepared(**_pressed(dim, "finite", ball))
    result = step(system, 1.0, tolerances=TIGHT)
    body = system.bodies[0]
    nodes = np.unique(body.facets("bottom"))
    distance = np.linalg.norm((body.points + body.displacement)[nodes] - centre, axis=1) - R
    assert distance.min() > -1e-8
    places = result.linearisation.constraints[0].places
    order = np.lexsort(places.T), np.lexsort(body.points[nodes].T)
    np.testing.assert_allclose(result.gap[order[0]], distance[order[1]], atol=1e-12)
    loaded = result.lam > 0
    assert 2 <= loaded.sum() < len(loaded)
    np.testing.assert_allclose(result.gap[loaded], 0, atol=1e-8)
    assert result.passes > 1
    # the forces point away from the centre: their moment about it is zero
    lin = result.linearisation
    reaction = lin.H[body].apply_transpose(result.lam).reshape(-1, dim)
    arm = body.points + body.displacement - centre
    moments = [arm[:, i] * reaction[:, j] - arm[:, j] * reaction[:, i] for i in range(dim) for j in range(i)]
    np.testing.assert_allclose(np.sum(moments, axis=1), 0, atol=1e-8)
    system.close()


def test_steps_follow_each_other() -> None:
    """Steps down and back leave nothing behind; each is the single step to its time."""
    surface = {"kind": "sphere", "centre": [0.3, -0.7], "radius": 0.7}

    def scene() -> dict[str, Any]:
        tables = _pressed(2, "finite", surface)
        tables["body"][0]["supports"] = [
            {"tag": "top", "component": "x"},
            {"tag": "top", "component": "y", "value": "-0.05 * t"},
        ]
        return tables

    system = prepared(**scene())
    for t in (0.25, 0.5, 1.0, 0.5):
        result = step(system, t, tolerances=TIGHT)
        single = prepared(**scene())
        alone = step(single, t, tolerances=TIGHT)
        np.testing.assert_allclose(result.lam, alone.lam, atol=1e-8)
        np.testing.assert_allclose(system.bodies[0].u, single.bodies[0].u, atol=1e-8)
        single.close()
    result = step(system, 0.0, tolerances=TIGHT)
    np.testing.assert_allclose(system.bodies[0].u, 0, atol=1e-12)
    np.testing.assert_allclose(result.lam, 0, atol=1e-12)
    system.close()


def test_a_body_that_nothing_can_hold() -> None:
    """A floor opposes the sinking of a block, not its sliding along: refused with the number of motions left."""
    system = on_floor(box(2), "plane-strain", [], [])
    with pytest.raises(ValueError, match=r"body 'body': 3 rigid motion.* only 2 that its contacts can oppose"):
        step(system, 1.0)
    system.close()


def test_a_load_that_no_contact_balances() -> None:
    """A block pulled off the floor that alone would hold it."""
    load = {"kind": "traction", "tag": "top", "value": [0.0, 1.0]}
    system = on_floor(box(2), "plane-strain", [load], [{"tag": "left", "component": "x"}])
    with pytest.raises(InfeasibleError):
        step(system, 1.0)
    system.close()


def test_too_few_passes_are_not_converged() -> None:
    """One pass on a curved surface does not reach 1e-9, and says so."""
    system = prepared(**_pressed(2, "finite", {"kind": "sphere", "centre": [0.3, -0.7], "radius": 0.7}))
    with pytest.raises(ContactNotConvergedError):
        step(system, 1.0, tolerances=TIGHT, max_passes=1)
    system.close()


def test_a_linear_step_factorises_once_and_solves_few_columns() -> None:
    """Contacts that stay open cost no column, and a second step none at all."""
    surface = {"kind": "paraboloid", "origin": [0.0, 0.0], "radius": 5.0}
    system = prepared(**_pressed(2, "small", surface, t=-0.02))
    first = step(system, 1.0)
    W, ksp = first.linearisation.W, system.bodies[0]._ksp
    solved = W.solved
    assert (first.lam > 0).sum() <= solved < len(first.lam)
    second = step(system, 2.0)
    assert second.linearisation.W is W
    assert W.solved == solved
    assert system.bodies[0]._ksp is ksp
    np.testing.assert_allclose(second.lam, first.lam, atol=1e-13)
    system.close()


def test_a_long_step_of_a_body_that_nothing_holds() -> None:
    """A bar that the free motion would carry 6e5 of its lengths comes to rest on the floor, with all its momentum."""
    rho, L, v0, dt = 1.0, 10.0, 10.0, 6e5
    bar = {
        "name": "bar",
        "kind": "bar",
        "mesh": {"shape": "interval", "length": L, "n": 20, "origin": 0.5},
        "material": {"EA": 900.0},
        "density": rho,
        "velocity": -v0,
    }
    floor = {"body": "bar", "tag": "start", "surface": {"kind": "plane", "point": [0.0], "normal": [1.0]}}
    system = prepared(body=[bar], contact=[floor], time={"integrator": "implicit-euler"})
    result = step(system, dt, dt)
    # the floor takes what is left of the momentum after the fall over the gap
    assert result.lam.sum() * dt == pytest.approx(rho * L * (v0 - 0.5 / dt), rel=1e-6)
    assert abs(result.gap[0]) <= 1e-9
    system.close()


def test_a_plate_that_bends_by_far_more_than_it_is_pressed() -> None:
    """100 times as wide as thick and held by the floor alone: the pressure below is that above, to the same digits."""
    block = {
        "name": "body",
        "mesh": {"shape": "box", "size": [100.0, 1.0], "n": [8, 8], "order": 2, "structured": True},
        "material": {"E": 10.0, "nu": 0.3, "state": "plane-strain"},
        "supports": [{"tag": "left", "component": "x"}],
        "loads": [{"kind": "pressure", "tag": "top", "value": 1.0}],
    }
    floor = {"body": "body", "tag": "bottom", "surface": FLOOR[2], "constraint": "mortar"}
    system = prepared(body=[block], contact=[floor])
    result = step(system, 1.0, tolerances=TIGHT)
    areas = result.linearisation.constraints[0].areas
    np.testing.assert_allclose(result.lam / areas, 1.0, rtol=1e-6)
    system.close()


@pytest.mark.parametrize("n", range(4))
def test_a_block_that_fits_exactly(n: int) -> None:
    """A rigid block in a slit of its own width, whose walls round-off moves: it lies on its floor, λ = F in all."""
    size = np.random.default_rng(n).uniform(100.0, 200.0, 2)
    far = n * np.spacing(size[0])
    walls = [("left", [1.0, 0.0], [far, 0.0]), ("right", [-1.0, 0.0], [size[0] - far, 0.0])]
    contacts = [
        {"name": tag, "body": "block", "tag": tag, "surface": {"kind": "plane", "normal": normal, "point": point}}
        for tag, normal, point in [*walls, ("bottom", [0.0, 1.0], [0.0, 0.0])]
    ]
    mesh = {"shape": "box", "size": size.tolist(), "h": float(size.max()), "structured": True}
    block = {"name": "block", "kind": "rigid", "guided": True, "mesh": mesh}
    block["loads"] = [{"kind": "body", "value": [0.0, -1.0]}]
    system = prepared(body=[block], contact=contacts)
    result = step(system, 1.0, tolerances=TIGHT)
    counts = np.cumsum([part.count for part in result.linearisation.constraints])
    assert result.lam[counts[1] :].sum() == pytest.approx(size.prod(), rel=1e-12)
    system.close()


def test_a_support_that_leads_into_a_plane_is_infeasible() -> None:
    """The corners of a block's bottom are held a tenth below the floor."""
    scene = _pressed(2, "small", FLOOR[2])
    scene["body"][0]["supports"] += [{"tag": "left", "value": -0.1}]
    system = prepared(**scene)
    with pytest.raises(InfeasibleError, match="a support puts a point of 'contact' into the wall"):
        step(system, 1.0)
    system.close()
