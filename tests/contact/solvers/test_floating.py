"""Bodies that only contact holds."""

from __future__ import annotations

import numpy as np
import pytest
from lcp_problems import CountingDelassus, half_space, reaction_difference, v_groove

from contact.solvers import ContactProblem, DenseDelassus, InfeasibleError, residual, solve

ON_W = ["status", "gauss-seidel", "lemke", "vi-rsls", "vi-ssls", "tao"]
TABLE = np.c_[np.ones(4), [0, 1, 1, 0], [0, 0, 1, 1]]


def check(problem, solution, tolerance=1e-12):
    """Balance and complementarity."""
    forces = np.abs(problem.G).T @ solution.lam + np.abs(problem.r)
    assert np.abs(problem.G.T @ solution.lam + problem.r).max() <= tolerance * forces.max()
    assert residual(problem, solution) <= tolerance
    assert solution.lam.min() >= 0


@pytest.mark.parametrize("method", ON_W)
@pytest.mark.parametrize("compliance", [0.0, 1e-9, 1.0, 1e6])
def test_v_groove(method, compliance):
    for beta in (0.1, 0.8, 1.5):
        solution = solve(v_groove(beta, compliance, 3.7), method)
        assert np.allclose(solution.lam, 3.7 / (2 * np.sin(beta)), rtol=1e-12, atol=0)


@pytest.mark.parametrize("method", ON_W)
@pytest.mark.parametrize("q", [np.zeros(4), np.full(4, 0.1), np.array([0, 0, 0, 1e-3]), np.array([0, 0, 0, -1e-3])])
def test_rigid_table_on_four_legs(method, q):
    problem = ContactProblem(DenseDelassus(np.zeros((4, 4))), q, G=TABLE, r=-np.array([2.0, 0.9, 1.1]))
    solution = solve(problem, method)
    check(problem, solution)
    carrying = np.flatnonzero(solution.lam > 1e-12)
    assert np.abs(solution.gap[carrying]).max() < 1e-13 and solution.gap.min() > -1e-13


def test_elastic_legs_share_the_load():
    # four springs under a square plate: λ = linear in position, closed form
    problem = ContactProblem(DenseDelassus(2.0 * np.eye(4)), np.full(4, 0.3), G=TABLE, r=-np.array([2.0, 0.9, 1.1]))
    solution = solve(problem)
    x, y = TABLE[:, 1] - 0.5, TABLE[:, 2] - 0.5
    assert np.allclose(solution.lam, 0.5 - 0.1 * x + 0.1 * y, rtol=1e-13)
    assert np.allclose(solution.alpha, [-1.3, 0.2, -0.2], rtol=1e-12)
    check(problem, solution)


@pytest.mark.parametrize("load", [[2.0, 0.9, 1.1], [-1.0, -2.0, -0.5]], ids=["lifted", "tilted"])
@pytest.mark.parametrize("compliance", [0.0, 1.0])
def test_load_that_no_contact_balances_is_infeasible(load, compliance):
    problem = ContactProblem(DenseDelassus(compliance * np.eye(4)), np.full(4, 0.1), G=TABLE, r=np.array(load))
    with pytest.raises(InfeasibleError, match="balance"):
        solve(problem)


def test_load_along_a_mode_that_no_contact_sees_is_infeasible():
    G = np.c_[TABLE, np.zeros(4)]
    problem = ContactProblem(DenseDelassus(np.eye(4)), np.ones(4), G=G, r=np.array([-2.0, -0.9, -1.1, 0.1]))
    with pytest.raises(InfeasibleError, match="no contact resists"):
        solve(problem)
    with pytest.raises(InfeasibleError):
        solve(ContactProblem(DenseDelassus(np.empty((0, 0))), np.empty(0), G=np.empty((0, 1)), r=np.ones(1)))


def test_body_wider_than_its_slit_is_infeasible_if_rigid_and_squeezed_if_elastic():
    G, q, r = np.array([[1.0], [-1.0]]), np.array([-0.1, -0.3]), np.zeros(1)
    with pytest.raises(InfeasibleError, match="overlap"):
        solve(ContactProblem(DenseDelassus(np.zeros((2, 2))), q, G=G, r=r))
    solution = solve(ContactProblem(DenseDelassus(2.0 * np.eye(2)), q, G=G, r=r))
    assert np.allclose(solution.lam, 0.1, rtol=1e-13)
    assert np.allclose(solution.alpha, [-0.1], rtol=1e-12)


def test_body_that_nothing_loads_is_moved_out_of_the_obstacle():
    problem = ContactProblem(
        DenseDelassus(np.eye(2)), np.array([-0.2, 1.0]), G=np.array([[1.0], [-1.0]]), r=np.zeros(1)
    )
    solution = solve(problem)
    assert np.abs(solution.lam).max() < 1e-14 and solution.gap.min() > -1e-13


def test_pressing_with_a_force_is_pressing_by_its_approach():
    W, q = half_space(12)
    prescribed = solve(ContactProblem(DenseDelassus(W), q))
    lazy = CountingDelassus(W)
    problem = ContactProblem(lazy, q + 0.9, G=np.ones((len(q), 1)), r=np.array([-prescribed.lam.sum()]))
    solution = solve(problem)
    assert len(lazy.asked) == len(set(lazy.asked)) < 0.6 * len(q)
    assert solution.alpha == pytest.approx([-0.9], rel=1e-12)
    assert reaction_difference(W, prescribed.lam, solution.lam) < 1e-12


@pytest.mark.parametrize("length, force", [(1e-9, 1.0), (1e9, 1e-9), (1.0, 1e9)])
def test_units_do_not_matter(length, force):
    def posed(length, force):
        W, q = half_space(8)
        arms = np.linspace(-1, 1, len(q))
        G, r = np.c_[np.ones(len(q)), arms * length], -np.array([0.2 * force, 0.01 * force * length])
        return ContactProblem(DenseDelassus(W * length / force), (q + 0.3) * length, G=G, r=r)

    plain, scaled = solve(posed(1.0, 1.0)), solve(posed(length, force))
    check(posed(1.0, 1.0), plain)
    assert scaled.iterations == plain.iterations
    assert np.allclose(scaled.lam / force, plain.lam, rtol=0, atol=1e-10 * plain.lam.max())


@pytest.mark.parametrize("seed", range(25))
def test_random_floating_problems(seed):
    rng = np.random.default_rng(seed)
    c, rank, m = rng.integers(1, 14), rng.integers(0, 8), rng.integers(1, 7)
    F, G = rng.standard_normal((c, rank)), rng.integers(-1, 2, (c, m)).astype(float)
    r = -G.T @ np.maximum(rng.standard_normal(c), 0)
    q = F @ rng.standard_normal(rank) + G @ rng.standard_normal(m) + np.maximum(rng.standard_normal(c), 0)
    problem = ContactProblem(CountingDelassus(F @ F.T), q, G=G, r=r)
    solution = solve(problem)
    assert np.allclose(solution.gap, F @ (F.T @ solution.lam) + G @ solution.alpha + q, rtol=0, atol=1e-11)
    check(problem, solution, 1e-11)
    assert np.abs(solution.gap[solution.lam > 0]).max(initial=0.0) < 1e-10


@pytest.mark.parametrize("method", ON_W)
def test_rounding_of_the_load_is_no_motion(method):
    """A V-groove block at rest whose load has a component of 1e-17 across: the gaps' scale decides what counts."""
    c, s = np.cos(np.pi / 6), np.sin(np.pi / 6)
    G = np.array([[c, s], [c, s], [-c, s], [-c, s]])
    q = np.array([0.0, 0.5, 0.0, 0.5])
    solution = solve(ContactProblem(DenseDelassus(np.zeros((4, 4))), q, G=G, r=np.array([1e-17, -1.0])), method)
    np.testing.assert_allclose(solution.lam, [1, 0, 1, 0], atol=1e-12)
