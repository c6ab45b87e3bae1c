"""Of all solutions of a contact problem the one of least norm: copies share alike, and others as an oracle has it."""

from __future__ import annotations

from itertools import product

import numpy as np
import pytest
from lcp_problems import CountingDelassus, dense, family, half_space
from scipy.linalg import null_space

from contact.solvers import (
    METHODS,
    ContactNotConvergedError,
    ContactProblem,
    DenseDelassus,
    InfeasibleError,
    Solution,
    residual,
    solve,
)
from contact.solvers.minimum_norm import least, minimum_norm

ON_W = ["status", "gauss-seidel", "lemke", "vi-ssls", "tao"]
TABLE = np.c_[np.ones(4), [0, 1, 1, 0], [0, 0, 1, 1]]


def oracle(B, right):
    """The least λ ≥ 0 with B λ = right, of all supports tried one by one."""
    best = np.full(B.shape[1], np.inf)
    for support in product([False, True], repeat=B.shape[1]):
        lam = np.zeros(B.shape[1])
        lam[list(support)] = np.linalg.pinv(B[:, support], rcond=1e-10) @ right
        solves = np.abs(B @ lam - right).max() <= 1e-9 * np.abs(right).max()
        if solves and lam.min() >= -1e-12 and np.linalg.norm(lam) < np.linalg.norm(best):
            best = lam
    return best


def degenerate(seed, m=0):
    """A problem with more closed rows than W and G have ranks, some of them open: W's factor, the problem and a λ."""
    rng = np.random.default_rng(seed)
    c, rank = 8, 3 - min(m, 2)
    F, G = rng.standard_normal((c, rank)), rng.standard_normal((c, m))
    lam = np.maximum(rng.standard_normal(c), 0.0) * 10.0 ** rng.uniform(-1, 1)
    lam[0] = 0.0
    gap = np.where(lam > 0, 0.0, rng.integers(0, 2, c) * rng.random(c))
    q = gap - F @ (F.T @ lam) - G @ rng.standard_normal(m)
    return F, gap, ContactProblem(CountingDelassus(F @ F.T), q, *((G, -G.T @ lam) if m else ())), lam


@pytest.mark.parametrize("method", ON_W)
@pytest.mark.parametrize("copies", [2, 10, 100])
def test_copies_share_alike(method, copies):
    W, q = np.full((copies, copies), 2.3), np.full(copies, -0.7)
    solution = solve(dense(W, q), minimum_norm(METHODS[method]))
    np.testing.assert_allclose(solution.lam, 0.7 / (2.3 * copies), rtol=1e-12)
    np.testing.assert_allclose(solution.gap, 0.0, atol=1e-12)


@pytest.mark.parametrize("name", ["beam", "dup", "beamdyn"])
def test_copies_of_a_whole_problem_share_its_forces(name):
    """Where W without its copies is regular; its condition of up to 1e10 costs that many of the last digits."""
    W, q = family(name, 50)
    copies, one = 4, solve(dense(W, q), minimum_norm(METHODS["status"]))
    problem = dense(np.tile(W, (copies, copies)), np.tile(q, copies))
    solution = solve(problem, minimum_norm(METHODS["status"]))
    shares = solution.lam.reshape(copies, -1)
    np.testing.assert_allclose(shares, np.tile(one.lam / copies, (copies, 1)), rtol=0, atol=1e-10 * one.lam.max())
    assert residual(problem, solution) < 1e-11


@pytest.mark.parametrize("m", [0, 1, 3])
def test_against_all_supports(m):
    """Held and floating bodies; the plain projection is negative in many."""
    negative = 0
    for seed in range(20):
        F, gap, problem, lam = degenerate(seed, m)
        solution = solve(problem, minimum_norm(METHODS["status"]))
        closed = gap == 0
        B = F.T if problem.G is None else np.vstack([F.T, problem.G.T])
        expected = np.zeros(len(lam))
        expected[closed] = oracle(B[:, closed], B @ lam)
        np.testing.assert_allclose(solution.lam, expected, rtol=0, atol=1e-10 * expected.max())
        if not m:
            np.testing.assert_allclose(solution.gap, gap, rtol=0, atol=1e-11)
        assert residual(problem, solution) < 1e-11
        plain = np.linalg.pinv(B[:, closed], rcond=1e-10) @ (B @ lam)
        negative += plain.min() < -1e-3
        assert not solution.lam[~closed].any()
    assert negative >= 5


def test_rows_that_nearly_depend_on_each_other():
    """Six random rows in five dimensions, all closed; and two alike among six of small integers."""
    for seed in range(200):
        rng = np.random.default_rng(seed)
        F, lam = rng.standard_normal((6, 5)), rng.random(6) + 1
        found = least(dense(F @ F.T, -F @ (F.T @ lam)), Solution(lam, np.empty(0), np.zeros(6), 0)).lam
        n = null_space(F.T, rcond=1e-12)[:, 0]
        ends = -lam[n != 0] / n[n != 0]
        z = np.clip(-n @ lam, ends[n[n != 0] > 0].max(initial=-np.inf), ends[n[n != 0] < 0].min(initial=np.inf))
        np.testing.assert_allclose(found, lam + z * n, rtol=0, atol=1e-8 * lam.max())
    for seed in range(1000, 1800):
        rng = np.random.default_rng(seed)
        F = rng.integers(-2, 3, (6, 4)) * rng.uniform(0.01, 1)
        lam = np.where(rng.random(6) < 0.4, 0, rng.random(6))
        F[4], lam[4] = F[1], 1.0
        found = least(dense(F @ F.T, -F @ (F.T @ lam)), Solution(lam, np.empty(0), np.zeros(6), 0)).lam
        np.testing.assert_allclose(found[1], found[4], rtol=0, atol=1e-8)


@pytest.mark.parametrize("method", ON_W)
def test_it_is_the_same_from_every_solution(method):
    """From those that the methods find, and the whole of a segment between them."""
    for seed in range(8):
        _, gap, problem, lam = degenerate(seed)
        one = solve(problem, minimum_norm(METHODS["status"])).lam
        other = solve(problem, minimum_norm(METHODS[method])).lam
        np.testing.assert_allclose(other, one, rtol=0, atol=1e-8 * one.max())
        given = least(problem, Solution(lam, np.empty(0), gap, 0)).lam
        np.testing.assert_allclose(given, one, rtol=0, atol=1e-11 * one.max())
        assert np.linalg.norm(one) <= (1 + 1e-12) * np.linalg.norm(lam)


@pytest.mark.parametrize("compliance", [0.0, 1e-9])
def test_rigid_table_on_four_legs(compliance):
    """Balance alone decides: λ is linear in position, as long as that pulls at no leg."""
    for load, expected in (
        ([2.0, 0.9, 1.1], [0.5, 0.4, 0.5, 0.6]),
        # a load near the corner (1, 1): the linear solution pulls at (0, 0) by 0.1
        ([2.0, 1.6, 1.6], [0.0, 0.4, 1.2, 0.4]),
    ):
        problem = ContactProblem(
            DenseDelassus(compliance * np.ones((4, 4))), np.full(4, 0.1), G=TABLE, r=-np.array(load)
        )
        solution = solve(problem, minimum_norm(METHODS["status"]))
        np.testing.assert_allclose(solution.lam, expected, rtol=0, atol=1e-13)
        np.testing.assert_allclose(TABLE.T @ solution.lam, load, rtol=1e-13)


def test_forces_that_move_nothing():
    """Without gaps and motions there is no length to measure by but the rounding of W λ."""
    F = np.array([[1.0, 1, -2, -1, -1]]).T
    G = np.array([[-1.0, 1, -1, 1, 0], [-1, 0, 1, 1, 1], [1, 1, -1, -1, -1]]).T
    lam = np.array([1.0, 3.0, 0.0, 2.0, 2.0])
    problem = ContactProblem(DenseDelassus(F @ F.T), np.zeros(5), G=G, r=-G.T @ lam)
    B = np.vstack([F.T, G.T])
    expected = oracle(B, B @ lam)
    np.testing.assert_allclose(solve(problem, minimum_norm(METHODS["status"])).lam, expected, rtol=0, atol=1e-12)


def test_copies_of_different_stiffness():
    """A stop of a soft body stated four times, and of one 1e12 times as stiff three times: both share alike."""
    W = np.zeros((7, 7))
    W[:4, :4], W[4:, 4:] = 1.0, 1e-12
    solution = solve(dense(W, np.repeat([-1.0, -2e-12], [4, 3])), minimum_norm(METHODS["status"]))
    np.testing.assert_allclose(solution.lam, np.repeat([1 / 4, 2 / 3], [4, 3]), rtol=1e-12)


@pytest.mark.parametrize("length, force", [(1e-9, 1.0), (1e9, 1e-9), (1.0, 1e9)])
@pytest.mark.parametrize("m", [0, 3])
def test_units_do_not_matter(length, force, m):
    """Metres and newtons may be any; amplitudes α are in metres too."""
    for seed in range(5):
        _, _, problem, _ = degenerate(seed, m)
        W = problem.W.W * length / force
        G, r = (None, None) if problem.G is None else (problem.G, problem.r * force)
        scaled = solve(ContactProblem(dense(W, 0).W, problem.q * length, G, r), minimum_norm(METHODS["status"])).lam
        plain = solve(problem, minimum_norm(METHODS["status"])).lam
        np.testing.assert_allclose(scaled / force, plain, rtol=0, atol=1e-10 * plain.max())


def test_a_unique_solution_stays_as_it_is():
    W, q = half_space(8)
    plain = solve(dense(W, q))
    np.testing.assert_array_equal(solve(dense(W, q), minimum_norm(METHODS["status"])).lam, plain.lam)
    idle = solve(dense(np.ones((3, 3)), np.zeros(3)), minimum_norm(METHODS["status"]))
    assert not idle.lam.any()
    assert solve(dense(np.empty((0, 0)), np.empty(0)), minimum_norm(METHODS["status"])).lam.shape == (0,)


def test_only_closed_rows_are_formed():
    """A stop stated twice, and two hundred that are far away."""
    W, q = np.ones((202, 202)), np.append([-1.0, -1.0], np.full(200, 9.0))
    lazy = CountingDelassus(W)
    solution = solve(ContactProblem(lazy, q), minimum_norm(METHODS["status"]))
    np.testing.assert_allclose(solution.lam[:2], 0.5, rtol=1e-14)
    assert set(lazy.asked) == {0, 1}


def test_what_is_not_solved_is_not_improved():
    with pytest.raises(InfeasibleError):
        solve(dense([[1.0, -1], [-1, 1]], [-0.7, 0.5]), minimum_norm(METHODS["status"]))


def test_an_operator_that_is_not_semidefinite_is_refused():
    """Two rows that are not quite copies, by more than rounding: to share a force would open and close gaps."""
    problem = dense([[1.0, 1 + 1e-6], [1 + 1e-6, 1.0]], [-1.0, -1 - 1e-6])
    with pytest.raises(ContactNotConvergedError, match="the least forces move a body"):
        least(problem, Solution(np.array([1.0, 0.0]), np.empty(0), np.zeros(2), 1))
