"""A wire on a body that gives way: forces, the coupled problem, the rigid limit."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.optimize import lsq_linear

from contact.wall_contact import WallContact
from contact.wall_rows import WallRows
from fem.wall import Wall
from tests.contact.device_examples import run

Floats = NDArray[np.float64]

RADIUS = 5e-4


def pressed(E: float, steps: int = 3, push: float = 0.03, load: float = 0.1, **changes: Any) -> dict[str, Any]:
    """A wire that its weight presses on a block and that is pushed along; E = 0 for a rigid block."""
    wire = {
        "name": "wire",
        "kind": "beam",
        "sections": [{"length": 0.02, "elements": 20, "radius": RADIUS, "E": 2e9, "nu": 0.3, "density": 8000.0}],
        "placement": {"start": [-0.01, 0.0002, 6e-4], "direction": [1.0, 0.0, 0.0]},
        "supports": [{"at": "start", "hold": ["x", "y", "rx", "rz"], "push": f"{push!r} * t"}],
        "loads": [{"kind": "line", "value": [0.0, 0.0, -load / 0.02]}],
        "rayleigh": [20.0, 1e-3],
    }
    mesh = {"shape": "box", "size": [0.04, 0.012, 0.004], "origin": [-0.02, -0.006, -0.004], "n": [10, 4, 2]}
    block = {"name": "block", "mesh": mesh | {"order": 2, "structured": True}, "supports": [{"tag": "bottom"}]}
    block |= {"material": {"E": E, "nu": 0.3, "state": "3d"}} if E else {"kind": "rigid"}
    surface = {"kind": "body", "body": "block", "tag": "top"}
    return {
        "body": [wire, block | changes],
        "contact": [{"name": "wall", "body": "wire", "samples": 2, "surface": surface}],
        "time": {"end": 0.01 * steps, "steps": steps, "integrator": "implicit-euler"},
    }


def test_action_is_reaction() -> None:
    """Forces and moments on wire and block cancel, of every contact."""
    system, steps = run(pressed(2e5))
    result, (wire, block) = steps[-1].result, system.bodies
    rows = result.linearisation.H
    assert isinstance(block, Wall)
    lam = result.lam
    assert np.count_nonzero(lam) >= 10
    on_wire, on_block = rows[wire].apply_transpose(lam).reshape(-1, 6), rows[block].apply_transpose(lam)
    x = block.owned(block.points.ravel()) + block.coordinates()
    force, at = on_block.reshape(-1, 3), x.reshape(-1, 3)
    size = np.abs(lam).sum()
    np.testing.assert_allclose(on_wire[:, :3].sum(axis=0) + force.sum(axis=0), 0.0, atol=1e-12 * size)
    moment = on_wire[:, 3:].sum(axis=0) + np.cross(wire.x, on_wire[:, :3]).sum(axis=0)
    np.testing.assert_allclose(moment + np.cross(at, force).sum(axis=0), 0.0, atol=1e-12 * size * system.size)
    assert abs(lam.sum() - 0.1) < 1e-3 * 0.1  # it carries the load


def test_the_coupled_problem_solved_densely() -> None:
    """The last pass's forces minimise ½λᵀWλ + λᵀδ_f over λ ≥ 0, with W from dense inverses of both matrices."""
    system, steps = run(pressed(2e5, steps=1))
    problem = steps[-1].result.problem
    W = problem.W.columns(np.arange(len(problem.q)))
    exact = np.zeros_like(W)
    for body, rows in problem.W.H.items():
        H = rows.sparse().toarray()
        A = body.A.convert("dense").getDenseArray()
        exact += H @ np.linalg.solve(A, np.where(body.held[:, None], 0.0, H.T))
    np.testing.assert_allclose(W, exact, atol=1e-9 * np.abs(W).max())
    L = np.linalg.cholesky(exact + 1e-14 * np.trace(exact) * np.eye(len(exact)))
    found = lsq_linear(L.T, -np.linalg.solve(L, problem.q), (0.0, np.inf), tol=1e-14, method="bvls").x
    mine = steps[-1].result.lam[steps[-1].result.lam > 0]
    np.testing.assert_allclose(found.sum(), mine.sum(), rtol=1e-6)
    system.close()


def test_a_stiff_wall_s_forces_are_those_of_a_rigid_one() -> None:
    """The block 1e9 times as stiff as a soft one, and the same smooth surface held fixed."""
    (_, stiff), (_, rigid) = run(pressed(1e5 * 1e9)), run(pressed(0.0))
    for mine, other in zip(stiff, rigid, strict=True):
        np.testing.assert_allclose(mine.result.lam, other.result.lam, atol=1e-4 * other.result.lam.max())


def test_steps_over_known_facets_need_no_solve(monkeypatch: pytest.MonkeyPatch) -> None:
    solves = []

    def watch(system: Any, step: Any) -> None:
        if step.number == 0:
            for name in ("solve", "solve_rows"):
                own = getattr(Wall, name)
                monkeypatch.setattr(Wall, name, lambda *given, own=own: (solves.append(1), own(*given))[1])

    _, steps = run(pressed(2e5, steps=3, push=0.0), watch=watch)
    assert not solves
    assert np.count_nonzero(steps[-1].result.lam) >= 10


def test_the_block_gives_way_by_its_compliance() -> None:
    """The indentation of the block is twice as deep where it is half as stiff, and the wire lies on it."""
    depths = []
    for E in (4e6, 2e6):
        system, _ = run(pressed(E, steps=1, push=0.0))
        (pair,) = system.pairs
        assert isinstance(pair, WallContact)
        touching = pair.gaps() < 1e-9
        depths.append(-pair.foot.point[touching, 2].mean())
        np.testing.assert_allclose(pair.gaps()[touching], 0.0, atol=1e-3 * RADIUS)
    assert 1.9 < depths[1] / depths[0] < 2.1


def test_bad_walls() -> None:
    tables = pressed(2e5)
    tables["body"][1]["mesh"]["order"] = 1
    with pytest.raises(ValueError, match=r"body 'block': tag 'top': a smooth surface needs second-order facets"):
        run(tables)
    tables = pressed(2e5)
    tables["contact"][0]["surface"]["tag"] = "lid"
    with pytest.raises(ValueError, match=r"body 'block': its mesh has no tag 'lid'"):
        run(tables)
    tables = pressed(0.0, supports=[])
    with pytest.raises(ValueError, match="supports"):
        run(tables)


def test_rows_of_a_wall_are_their_matrix() -> None:
    system, steps = run(pressed(2e5, steps=1))
    _, block = system.bodies
    rows = steps[0].result.linearisation.H[block]
    assert isinstance(rows, WallRows)
    H = rows.sparse()
    lam, u = np.random.default_rng(0).normal(size=(2, max(H.shape)))
    np.testing.assert_allclose(rows.apply_transpose(lam[: H.shape[0]]), H.T @ lam[: H.shape[0]], atol=1e-12)
    np.testing.assert_allclose(rows.apply(u[: H.shape[1]]), H @ u[: H.shape[1]], atol=1e-12)
    np.testing.assert_allclose(rows.at(block), H @ block.coordinates(), atol=1e-12 * np.abs(block.u).max())
    part = rows.take(np.arange(5)).join([rows.blank(2)])
    assert part.sparse().shape == (7, H.shape[1])
    assert np.array_equal(part.touching(), np.append(rows.touching()[:5], [False, False]))
