"""A wire on a body that gives way: forces, the coupled problem, the rigid limit."""

from __future__ import annotations

import copy
from typing import Any

import numpy as np
import pytest
import wall_examples
from device_examples import run
from mpi4py import MPI
from numpy.typing import NDArray
from ranks import same_on_two_ranks
from scipy.linalg import block_diag
from scipy.optimize import lsq_linear
from wall_examples import RADIUS, pressed

from contact.certificate import certify
from contact.coupling import coupled
from contact.devices.wall_contact import WallContact
from contact.devices.wall_rows import WallRows
from contact.scene.build import build
from contact.scene.explain import explain
from contact.scene.schema import Scene
from contact.solvers.problem import ContactNotConvergedError
from contact.step import step
from fem.wall import Wall

Floats = NDArray[np.float64]


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


def test_the_coupled_operator_against_dense_matrices() -> None:
    """W = H (A + ZᵀM Z)⁻¹ Hᵀ of wire and block together, inverted densely; free and corrective motions likewise."""
    system, steps = run(pressed(2e5, steps=1))
    lin, lam, (wire, block), (pair,) = steps[-1].result.linearisation, steps[-1].result.lam, system.bodies, system.pairs
    coupling = pair.stiffen(lam).coupling
    assert coupling is not None
    H = {body: rows.take(lin.rows) for body, rows in lin.free.items()}
    operator = coupled(H, coupling, lin.rows)
    assert operator is not None
    inverses = [
        np.linalg.inv(body.A.convert("dense").getDenseArray()) * np.outer(~body.held, ~body.held)
        for body in (wire, block)
    ]
    C = block_diag(*inverses)
    h, Z = (np.hstack([rows[body].sparse().toarray() for body in (wire, block)]) for rows in (H, coupling.Z))
    M = block_diag(*coupling.M)
    joint = C - C @ Z.T @ np.linalg.solve(np.linalg.inv(M) + Z @ C @ Z.T, Z @ C)
    W = h @ joint @ h.T
    np.testing.assert_allclose(operator.W, W, atol=1e-8 * np.abs(W).max())
    force = np.random.default_rng(0).random(len(lin.rows))
    wire.u, start = np.zeros_like(wire.u), block.coordinates()
    operator.correct(force)
    for body, rows in H.items():
        rows.add(body, force)
    moved = joint @ (h.T @ force)
    size = np.abs(moved).max()
    np.testing.assert_allclose(np.append(wire.u, block.coordinates() - start), moved, atol=1e-8 * size)


def test_passes_contract_quadratically(monkeypatch: pytest.MonkeyPatch) -> None:
    """On a block so soft that it is dented by a third of the wire's radius."""
    residuals = []

    def watched(*given: Any, **named: Any) -> Any:
        certificate = certify(*given, **named)
        residuals.append(certificate.residual)
        return certificate

    monkeypatch.setattr("contact.step.certify", watched)
    _, steps = run(pressed(1e5, steps=3))
    assert [step.substeps for step in steps] == [1, 1, 1]
    last = residuals[-steps[-1].result.passes :]
    assert len(last) <= 4
    assert last[-1] < 10 * last[-2] ** 1.5


def test_a_rejected_step_leaves_no_curvature(monkeypatch: pytest.MonkeyPatch) -> None:
    """At half its length it takes the passes of a system that has not tried the whole."""
    residuals: list[list[float]] = []

    def watched(*given: Any, **named: Any) -> Any:
        certificate = certify(*given, **named)
        residuals[-1].append(certificate.residual)
        return certificate

    monkeypatch.setattr("contact.step.certify", watched)
    tables = pressed(1e5, steps=1)
    tables["body"][0]["placement"]["start"][2] = RADIUS
    for rejected in (False, True):
        system = build(Scene.model_validate(tables), MPI.COMM_SELF)
        residuals.append([])
        if rejected:
            before = system.state()
            with pytest.raises(ContactNotConvergedError):
                step(system, 0.01, 0.01, max_passes=2)
            system.restore(before)
            residuals[-1].clear()
        step(system, 0.005, 0.005)
        system.close()
    (expected, found) = residuals
    assert len(expected) >= 3
    np.testing.assert_allclose(found, expected, rtol=1e-4, atol=1e-10)


def test_the_dent_of_a_discrete_problem_solved_by_itself() -> None:
    """At rest the wire and the block balance: gaps and forces of the state against an independent dense program.

    It minimises the energy of beam increments and block displacements about that state, with the true gaps linearised.
    """
    system, steps = run(pressed(5e5, steps=40, push=0.0))
    lam, lin, (wire, block), (pair,) = steps[-1].result.lam, steps[-1].result.linearisation, system.bodies, system.pairs
    f = block.load - block.internal_forces()
    reaction = np.where(block.fixed, 0.0, f + lin.H[block].apply_transpose(lam))
    np.testing.assert_allclose(reaction, 0.0, atol=1e-8 * np.abs(f).max())
    W = np.zeros((len(lin.rows), len(lin.rows)))
    for body in (wire, block):
        h = lin.free[body].take(lin.rows).sparse().toarray()
        W += h @ np.linalg.solve(body.A.convert("dense").getDenseArray(), h.T)
    q = pair.gaps()[lin.rows] - W @ lam[lin.rows]
    L = np.linalg.cholesky(W + 1e-13 * np.trace(W) * np.eye(len(W)))
    found = lsq_linear(L.T, -np.linalg.solve(L, q), (0.0, np.inf), tol=1e-14, method="bvls").x
    np.testing.assert_allclose(found.sum(), lam.sum(), rtol=1e-5)
    np.testing.assert_allclose(W @ found + q, pair.gaps()[lin.rows], atol=1e-5 * RADIUS)


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


def test_two_wires_share_a_block() -> None:
    """Each is carried, and they dent the block together."""
    tables = pressed(2e5)
    other = copy.deepcopy(tables["body"][0]) | {"name": "other"}
    other["placement"]["start"] = [-0.012, 0.0017, 6e-4]
    tables["body"].append(other)
    tables["contact"].append(copy.deepcopy(tables["contact"][0]) | {"name": "other", "body": "other"})
    system, steps = run(tables)
    lam = steps[-1].result.lam
    np.testing.assert_allclose([lam[:41].sum(), lam[41:].sum()], 0.1, rtol=2e-3)
    assert all(step.substeps == 1 and step.result.passes <= 6 for step in steps)
    system.close()


def test_a_wall_that_touches_something_else() -> None:
    """The block bulges against a stop beside it: its rows are one matrix then, and its columns are solved for."""
    tables = pressed(2e5, steps=2)
    stop = {"kind": "plane", "point": [0.02, 0.0, 0.0], "normal": [-1.0, 0.0, 0.0]}
    beside = {"name": "stop", "body": "block", "tag": "right", "constraint": "mortar", "surface": stop}
    tables["contact"].append(beside)
    system, steps = run(tables)
    lam = steps[-1].result.lam
    np.testing.assert_allclose(lam[:41].sum(), 0.1, rtol=2e-3)
    assert lam[41:].sum() > 1e-5
    system.close()


def test_explain_says_what_a_wall_costs() -> None:
    """Columns of a wall that gives way; none of a rigid one; no mass matrix without a density."""
    told = explain(Scene.model_validate(pressed(2e5)))
    assert "a subdivision surface over the facets block/top" in told
    assert "body 'block': columns of its inverse for points where it has been touched, kept" in told
    assert "body 'block': one stiffness matrix" in told
    assert "columns of its inverse" not in explain(Scene.model_validate(pressed(0.0)))


def test_two_ranks() -> None:
    """The wire on both ranks, the block shared out: what one rank gives, with the block's inertia and without."""
    assert same_on_two_ranks(wall_examples, rel=1e-8)["0: force"] > 0
