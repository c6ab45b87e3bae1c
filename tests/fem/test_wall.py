"""A body whose compliance at points of its surface is kept, against the same body that solves."""

from __future__ import annotations

import numpy as np
import pytest
import scipy.sparse as sp
from mpi4py import MPI
from numpy.typing import NDArray

from fem import wall_kernels as kernels
from fem.body import Body
from fem.elasticity import Elasticity
from fem.integrators import ImplicitEuler, Static
from fem.loads import Load, Support
from fem.space import Space
from fem.wall import Wall
from meshes.generators import generate

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]


def block(kind: type[Body], **named: object) -> Body:
    mesh = generate("box", size=[3.0, 2.0, 1.0], n=[3, 2, 1], order=2, structured=True)
    named = {"supports": [Support("bottom")], "loads": [Load("pressure", 0.5, "right")]} | named
    return kind("block", Space(MPI.COMM_SELF, mesh, 3), Elasticity(10.0, 0.3, "3d"), **named)  # type: ignore[arg-type]


def wall(**named: object) -> tuple[Wall, Ints, sp.csr_array]:
    """A wall with nine points, each the mean of some nodes of its top with weights of either sign."""
    body = block(Wall, **named)
    assert isinstance(body, Wall)
    numbers = np.unique(body.facets("top"))
    Q = sp.csr_array(np.random.default_rng(0).normal(size=(9, len(numbers))))
    body.touch(numbers, Q)
    return body, numbers, Q


def start(body: Body, dt: float | None = None) -> None:
    body.begin(dt or 1.0, Static() if dt is None else ImplicitEuler(dt))
    body.assemble()
    body.factor()
    body.free_motion()


def given(count: int) -> tuple[Ints, Floats, Floats, Floats]:
    """Points, shares, normals and forces of rows."""
    rng = np.random.default_rng(1)
    n = rng.normal(size=(count, 3))
    points = np.array([rng.permutation(9)[:4] for _ in range(count)])
    return points, rng.random((count, 4)), n / np.linalg.norm(n, axis=1)[:, None], rng.random(count)


@pytest.mark.parametrize("dt", [None, 0.1])
def test_kept_columns_move_the_wall_as_solves_do(dt: float | None) -> None:
    density = {} if dt is None else {"density": 2.0}
    (mine, _, _), plain = wall(**density), block(Body, **density)
    rows = given(5)
    for _ in range(2):
        for body in (mine, plain):
            start(body, dt)
        H = mine.rows_of(*rows[:3])
        f = H.T @ rows[3]
        np.testing.assert_allclose(mine.u, plain.u, atol=1e-14)
        mine.push(*rows)
        plain.correct(plain.solve(f[:, None])[:, 0])
        gaps = kernels.along(*rows[:3], mine.displacement_of_points())
        size = np.abs(plain.u).max()
        np.testing.assert_allclose(gaps, H @ plain.coordinates(), atol=1e-12 * size)
        np.testing.assert_allclose(mine.u, plain.u, atol=1e-12 * size)
        fresh = plain.imbalance(f)
        assert 0.3 * fresh < mine.imbalance(f) < 1e-12  # a bound, from the columns' own residuals
        off = 1.001 * f
        assert plain.imbalance(off) <= mine.imbalance(off) < 1.5 * plain.imbalance(off)
        np.testing.assert_allclose(kernels.along(*rows[:3], mine.displacement_of_points()), gaps, atol=1e-12 * size)
        for body in (mine, plain):
            body.accept()
    if dt is not None:
        assert mine.v is not None
        np.testing.assert_allclose(mine.v, plain.v, atol=1e-10 * np.abs(mine.v).max())


def test_the_delassus_operator_of_kept_columns() -> None:
    body, _, _ = wall()
    start(body)
    rows = given(7)[:3]
    H = body.rows_of(*rows)
    W = H @ body.solve(H.toarray().T)
    np.testing.assert_allclose(body.point_delassus(*rows), W, atol=1e-12 * np.abs(W).max())


def test_what_is_kept_costs_no_solve(monkeypatch: pytest.MonkeyPatch) -> None:
    body, _, _ = wall()
    start(body)
    rows = given(5)
    body.push(*rows)
    u, W = body.u, body.point_delassus(*rows[:3])
    for name in ("solve", "solve_rows"):
        monkeypatch.setattr(body, name, None)
    start(body)
    assert np.array_equal(body.point_delassus(*rows[:3]), W)
    body.push(*rows)
    assert np.array_equal(body.u, u)


def test_kernels_are_their_formulas() -> None:
    rng = np.random.default_rng(0)
    X, rows, factors = rng.normal(size=(9, 2500)), np.array([4, 0, 7]), rng.normal(size=3)
    np.testing.assert_allclose(kernels.combine(X, rows, factors, 2300), factors @ X[rows, :2300], atol=1e-13)
    C = rng.normal(size=(3, 5, 3, 3))
    slots, forces = np.array([2, 0]), rng.normal(size=(2, 3))
    exact = np.einsum("slia,sa->li", C[slots], forces)
    np.testing.assert_allclose(kernels.displace(C, slots, forces), exact, atol=1e-13)
    points, G = np.array([4, 1]), np.empty((6, 6))
    kernels.gather(C, slots, points, 0, G)
    np.testing.assert_array_equal(G.reshape(2, 3, 2, 3), C[slots][:, points].transpose(0, 3, 1, 2))
    forces[0] = 0.0
    assert kernels.nonzero(forces).tolist() == [1]


def test_more_columns_than_memory_are_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    body, _, _ = wall()
    start(body)
    monkeypatch.setattr("os.sysconf", lambda name: 100)
    with pytest.raises(ValueError, match=r"body 'block': its compliance at 9 points takes .* GB, more than half"):
        body.point_delassus(*given(7)[:3])


def test_a_wall_that_nothing_holds_is_refused() -> None:
    with pytest.raises(ValueError, match="6 rigid motion"):
        wall(supports=[])
