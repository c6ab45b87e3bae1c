"""The compiled kernels against plain numpy."""

from __future__ import annotations

import numpy as np
import pytest
from lcp_problems import complementarity, family, well_posed
from scipy.linalg import cholesky

from contact.solvers import kernels


def ratio_tested(W, q):
    """The active set of `kernels.ratio_tested` with a new solve at each step; W definite on the sets that it meets."""
    active, lam = [], np.zeros_like(q)
    while True:
        delta = W @ lam + q
        outside = np.setdiff1d(np.arange(len(q)), active)
        if not len(outside) or delta[outside].min() >= -1e-12 * np.abs(q).max():
            return lam, active
        active.append(int(outside[np.argmin(delta[outside])]))
        while True:
            target = np.linalg.solve(W[np.ix_(active, active)], -q[active])
            current = lam[active]
            falling = target < 0
            if not falling.any():
                lam[active] = target
                break
            ratio = np.full(len(active), np.inf)
            ratio[falling] = current[falling] / (current - target)[falling]
            k = int(np.argmin(ratio))
            lam[active] = current + ratio[k] * (target - current)
            lam[active.pop(k)] = 0.0


def run(W, q):
    c = len(q)
    lam, delta, order, U = np.zeros(c), q.copy(), np.empty(c + 1, np.int64), np.empty((c + 1, c + 1))
    state = np.array([0, -1, 0, 0])
    verdict = kernels.ratio_tested(
        W, np.arange(c), q, lam, delta, order, U, np.zeros(c, np.int64), np.zeros(c), state, 1e-12, 1e-13, 1e-15, 10**4
    )
    n = state[0]
    return verdict, lam, delta, list(order[:n]), np.triu(U[:n, :n]), state


@pytest.mark.parametrize("make, left", [(well_posed, 0), (lambda: family("beam", 50), 3)], ids=["rand", "beam"])
def test_ratio_tested_loop_visits_the_plain_version_s_sets(make, left):
    W, q = make()
    verdict, lam, delta, order, U, state = run(W, q)
    expected, active = ratio_tested(W, q)
    assert verdict == kernels.DONE and order == active and state[3] >= left
    assert np.allclose(lam, expected, rtol=1e-9, atol=1e-9 * expected.max())
    assert np.allclose(delta, W @ lam + q, rtol=0, atol=1e-12 * np.abs(q).max())
    assert np.allclose(U.T @ U, W[np.ix_(order, order)], rtol=1e-13)
    assert complementarity(W, q, lam) < 1e-12


def test_wanted_column_is_named_and_the_loop_goes_on_where_it_stopped():
    W, q = well_posed()
    c = len(q)
    lam, delta, order, U = np.zeros(c), q.copy(), np.empty(c + 1, np.int64), np.empty((c + 1, c + 1))
    slot, state, active, peak = np.full(c, -1), np.array([0, -1, 0, 0]), np.zeros(c, np.int64), np.zeros(c)
    asked = []
    while True:
        verdict = kernels.ratio_tested(
            W, slot, q, lam, delta, order, U, active, peak, state, 1e-12, 1e-13, 1e-15, 10**4
        )
        if verdict != kernels.WANTED:
            break
        asked.append(int(state[1]))
        slot[asked[-1]] = asked[-1]
    assert verdict == kernels.DONE and len(asked) == len(set(asked))
    assert set(np.flatnonzero(lam)) <= set(asked)
    assert np.allclose(lam, ratio_tested(W, q)[0], rtol=1e-12, atol=1e-12)


def test_unbounded_dual_is_named():
    verdict, *_, state = run(np.array([[1.0, -1], [-1, 1]]), np.array([-1.0, 0.5]))
    assert verdict == kernels.INFEASIBLE and state[1] == 1


def test_removal_of_a_row_leaves_the_factor_of_the_rest():
    W, _ = well_posed(12)
    for k in range(12):
        U = np.zeros((15, 15))
        U[:12, :12] = cholesky(W)
        kernels.remove(U, 12, k)
        rest = np.delete(np.arange(12), k)
        assert np.allclose(np.triu(U[:11, :11]), cholesky(W[np.ix_(rest, rest)]), rtol=0, atol=1e-14)


def test_triangular_solves():
    W, q = well_posed(12)
    U, b = cholesky(W), q.copy()
    kernels.solve_transposed(U, 12, b)
    kernels.solve_upper(U, 12, b)
    assert np.allclose(W @ b, q, rtol=0, atol=1e-13)


def test_gauss_seidel_sweeps_are_the_plain_version_s():
    W, q = well_posed()
    lam, plain = np.zeros_like(q), np.zeros_like(q)
    kernels.gauss_seidel(W, q, lam, 3)
    for _ in range(3):
        for i in range(len(q)):
            plain[i] = max(0.0, plain[i] - (q[i] + W[i] @ plain) / W[i, i])
    assert np.allclose(lam, plain, rtol=1e-13, atol=1e-15)


def block_steps(W, q, start, limit):
    """λ of `kernels.block_steps` with a new solve at each step, and whether it is the solution."""
    active = np.flatnonzero(start > 0)
    for _ in range(limit):
        lam = np.zeros_like(q)
        lam[active] = np.linalg.solve(W[np.ix_(active, active)], -q[active])
        delta = W @ lam + q
        violated = delta < -1e-12 * np.abs(delta).max()
        violated[active] = False
        if (lam[active] > 0).all():
            return lam, not violated.any()
        active = np.flatnonzero((lam > 0) | violated)
    return start, False


@pytest.mark.parametrize("make", [well_posed, lambda: family("beam", 50)], ids=["rand", "beam"])
@pytest.mark.parametrize("changes", [0, 1, 5, 20])
def test_block_steps_visit_the_plain_version_s_sets(make, changes):
    W, q = make()
    c, exact = len(q), ratio_tested(*make())[0]
    start, rng = exact.copy(), np.random.default_rng(changes)
    rows = rng.choice(c, changes, replace=False)
    start[rows] = np.where(start[rows] > 0, 0.0, exact.max())
    lam, delta, order, U, state = np.empty(c), np.empty(c), np.empty(c, np.int64), np.empty((c, c)), np.zeros(4, int)
    for _ in range(2):  # from nothing, and from the factor that it left
        verdict = kernels.block_steps(W, q, start, lam, delta, order, U, state, 1e-10, 1e-13, 3)
        expected, solved = block_steps(W, q, start, 3)
        assert verdict == (kernels.DONE if solved else kernels.GUESS)
        np.testing.assert_allclose(lam, expected, rtol=1e-8, atol=1e-9 * exact.max())
        np.testing.assert_allclose(delta, W @ lam + q, rtol=0, atol=1e-11 * np.abs(W @ lam).max())
        active = order[: state[0]]
        np.testing.assert_array_equal(np.sort(active), np.flatnonzero(lam))
        factor = np.triu(U[: len(active), : len(active)])
        np.testing.assert_allclose(factor.T @ factor, W[np.ix_(active, active)], rtol=1e-12)
    assert solved or changes > 0


def test_dependent_rows_are_named():
    W = np.ones((3, 3)) + np.diag([0.0, 0.0, 1.0])
    found = np.empty(3), np.empty(3), np.empty(3, np.int64), np.empty((3, 3)), np.zeros(4, int)
    q = -np.ones(3)
    assert kernels.block_steps(W, q, np.array([1.0, 1, 0]), *found, 1e-12, 1e-13, 3) == kernels.DEPENDENT
    assert kernels.block_steps(W, q, np.array([1.0, 0, 1]), *found, 1e-12, 1e-13, 3) != kernels.DEPENDENT
