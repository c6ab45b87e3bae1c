"""The status method: certificate or truthful refusal on everything that is known to break an active set."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from lcp_problems import (
    COUNTER_EXAMPLES,
    FCLIB,
    CountingDelassus,
    complementarity,
    dense,
    factored_difference,
    factored_family,
    family,
    fclib,
    half_space,
    reaction_difference,
    well_posed,
)
from scipy.optimize import linprog, nnls

from contact.solvers import ContactNotConvergedError, ContactProblem, InfeasibleError, residual, solve
from contact.solvers.columns import FormedColumns


@pytest.mark.parametrize("name", COUNTER_EXAMPLES)
def test_counter_examples_to_plain_rules_are_solved(name):
    W, q = (np.array(values, float) for values in COUNTER_EXAMPLES[name])
    assert complementarity(W, q, solve(dense(W, q)).lam) < 1e-12


def test_degenerate_example_has_its_known_solution():
    lam = solve(dense(*COUNTER_EXAMPLES["degenerate"])).lam
    assert np.allclose(lam, [0, 0, 0.5], rtol=0, atol=1e-15)


@pytest.mark.parametrize("c", [50, 200])
@pytest.mark.parametrize("name", ["rand", "beam", "beamdyn", "dup"])
def test_families_are_solved_whether_W_is_known_or_formed(name, c):
    W, q, F = factored_family(name, c)
    lazy = CountingDelassus(W)
    solution = solve(ContactProblem(lazy, q))
    assert complementarity(W, q, solution.lam) < 1e-11
    assert factored_difference(F, solve(dense(W, q)).lam, solution.lam) < 1e-10
    assert len(lazy.asked) == len(set(lazy.asked)) == solution.details["columns"]
    if name != "rand":
        assert len(lazy.asked) < 0.5 * c


@pytest.mark.parametrize("name", ["beam", "dup"])
def test_singular_families_are_solved(name):
    W, q = family(name, 1000)
    assert complementarity(W, q, solve(dense(W, q)).lam) < 1e-11


@pytest.mark.parametrize("name", FCLIB)
def test_fclib_files_are_solved(name):
    W, q = fclib(name)
    assert complementarity(W, q, solve(dense(W, q)).lam) < 1e-10


def test_work_on_many_independent_contacts_is_three_factorisations():
    W, q = family("rand", 1000)
    solution = solve(dense(W, q))
    assert solution.details["factorisations"] < 3
    assert complementarity(W, q, solution.lam) < 1e-12


def test_contact_zone_of_a_solid_grows_in_a_few_blocks_of_columns():
    W, q = half_space(20)
    lazy = CountingDelassus(W)
    solution = solve(ContactProblem(lazy, q))
    assert complementarity(W, q, solution.lam) < 1e-12
    active = np.count_nonzero(solution.lam)
    assert active > 90 and solution.iterations <= 8
    assert len(lazy.asked) < 1.3 * active < 0.75 * np.count_nonzero(q < 0)


def test_agrees_with_nonnegative_least_squares():
    rng = np.random.default_rng(3)
    F = rng.standard_normal((20, 12))
    q = F @ rng.standard_normal(12)
    # min ½|Fᵀλ + u|² with F u = q
    expected = F.T @ nnls(F.T, -np.linalg.lstsq(F, q)[0])[0]
    assert np.allclose(F.T @ solve(dense(F @ F.T, q)).lam, expected, rtol=0, atol=1e-12)


@pytest.mark.parametrize("length", [1e-9, 1.0, 1e9])
@pytest.mark.parametrize("compliance", [1e-9, 1.0, 1e9])
def test_units_change_neither_result_nor_iterations(length, compliance):
    for W, q in (family("beam", 100), well_posed(), [np.array(a, float) for a in COUNTER_EXAMPLES["degenerate"]]):
        plain = solve(dense(W, q))
        scaled = solve(dense(compliance * W, length * q))
        assert (scaled.iterations, scaled.details) == (plain.iterations, plain.details)
        assert np.allclose(scaled.lam * compliance / length, plain.lam, rtol=1e-10, atol=1e-10 * plain.lam.max())


def test_warm_start_from_the_solution_takes_one_iteration():
    W, q = family("beam", 200)
    cold = solve(dense(W, q))
    lazy = CountingDelassus(W)
    warm = solve(ContactProblem(lazy, q), start=cold.lam)
    assert warm.iterations <= 2 < cold.iterations
    assert set(lazy.asked) == set(np.flatnonzero(cold.lam))
    assert reaction_difference(W, cold.lam, warm.lam) < 1e-12


@pytest.mark.parametrize("scale", [1e-3, 1.0, 1e6])
def test_wrong_start_changes_nothing(scale):
    W, q, F = factored_family("dup", 100)
    start = scale * np.random.default_rng(0).standard_normal(len(q))
    assert factored_difference(F, solve(dense(W, q)).lam, solve(dense(W, q), start=start).lam) < 1e-11


def test_nothing_to_do_takes_no_iteration():
    W, _ = well_posed(5)
    for q in (np.zeros(5), np.ones(5), np.empty(0)):
        solution = solve(dense(W[: len(q), : len(q)], q))
        assert solution.iterations == 0 and not solution.lam.any()
        assert residual(dense(W[: len(q), : len(q)], q), solution) == 0


def test_everything_active():
    W, _ = well_posed()
    expected = np.linspace(1, 2, len(W))
    assert np.allclose(solve(dense(W, -W @ expected)).lam, expected, rtol=1e-12)


@pytest.mark.parametrize("copies", [2, 7])
@pytest.mark.parametrize("form", [dense, lambda W, q: ContactProblem(CountingDelassus(W), q)])
def test_duplicated_contacts_share_one_force(copies, form):
    W, q = well_posed(12)
    single = solve(dense(W, q)).lam
    lam = solve(form(np.tile(W, (copies, copies)), np.tile(q, copies))).lam
    assert np.allclose(lam.reshape(copies, -1).sum(axis=0), single, rtol=0, atol=1e-13 * single.max())


def test_of_duplicated_contacts_the_tighter_gap_carries():
    lam = solve(dense(np.ones((3, 3)), [-1.0, -1.5, -1.5 + 1e-9])).lam
    assert np.allclose(lam, [0, 1.5, 0], rtol=1e-12, atol=0)


def test_slit_of_zero_width_leaves_a_bounded_force():
    W = np.array([[1.0, -1], [-1, 1]])
    for q in ([-0.7, 0.7], [0.7, -0.7], [0.0, 0.0]):
        lam = solve(dense(W, q)).lam
        assert lam[0] - lam[1] == pytest.approx(-q[0], abs=1e-15) and lam.max() <= 0.7


@pytest.mark.parametrize("width", [-1.0, -1e-9])
def test_slit_of_negative_width_is_infeasible(width):
    with pytest.raises(InfeasibleError):
        solve(dense([[1.0, -1], [-1, 1]], [-0.7, 0.7 + width]))


def test_contact_that_nothing_can_move_is_infeasible():
    with pytest.raises(InfeasibleError):
        solve(dense([[1.0, 0], [0, 0]], [-1.0, -1.0]))


@pytest.mark.parametrize("tolerance", [1e-10, 1e-6])
def test_columns_of_a_loose_linear_solver_are_never_called_infeasible(tolerance):
    W, q = family("dup", 100)
    root = np.sqrt(np.diag(W))
    rough = W + tolerance * np.random.default_rng(1).uniform(-1, 1, W.shape) * np.outer(root, root)
    assert np.linalg.eigvalsh((rough + rough.T) / 2).min() < 0
    for problem in (ContactProblem(CountingDelassus(rough), q), dense(rough, q)):
        try:
            lam = solve(problem).lam
        except ContactNotConvergedError as error:
            # duplicated rows contradict one another by more than what counts as solved
            assert 1e-9 < error.residual < 1e2 * tolerance
            lam = error.lam
        assert complementarity(W, q, lam) < 1e2 * tolerance


def test_formed_entries_are_symmetric_and_asked_for_once():
    rng = np.random.default_rng(2)
    rough = np.eye(9) + 1e-3 * rng.uniform(-1, 1, (9, 9))
    lazy = CountingDelassus(rough)
    columns = FormedColumns(lazy)
    for rows in ([4], [1, 4, 7], [0, 1], [8]):
        columns.form(np.array(rows))
    rows = columns.rows
    assert list(lazy.asked) == list(rows) == [4, 1, 7, 0, 8]
    block = columns.block(rows, rows)
    assert np.array_equal(block, block.T)
    assert np.abs(block - rough[np.ix_(rows, rows)]).max() <= 2e-3
    root = np.sqrt(np.diag(rough))
    skew = np.abs(rough - rough.T) / np.outer(root, root)
    assert columns.noise == pytest.approx(skew[np.ix_(rows, rows)].max(), rel=0.1)


@settings(max_examples=150, deadline=None, derandomize=True)
@given(
    seed=st.integers(0, 2**32 - 1),
    c=st.integers(1, 14),
    rank=st.integers(1, 14),
    kind=st.sampled_from(["any", "integer", "feasible", "duplicated"]),
    lazy=st.booleans(),
)
def test_certificate_or_truthful_infeasibility(seed, c, rank, kind, lazy):
    rng = np.random.default_rng(seed)
    rank = min(rank, c)
    if kind == "integer":
        F, q = rng.integers(-2, 3, (c, rank)).astype(float), rng.integers(-2, 3, c).astype(float)
    else:
        F, q = rng.standard_normal((c, rank)), rng.standard_normal(c)
    if kind in ("feasible", "duplicated"):
        F = F[rng.integers(0, c, c)] if kind == "duplicated" else F
        q = F @ rng.standard_normal(rank) + np.maximum(q, 0.0)
    # some position x satisfies F x + q ≥ 0 exactly if the problem has a solution
    excess = linprog(
        np.r_[np.zeros(rank), 1], A_ub=np.c_[-F, -np.ones(c)], b_ub=q, bounds=[(None, None)] * rank + [(0, None)]
    ).x[-1]
    W = F @ F.T
    problem = ContactProblem(CountingDelassus(W), q) if lazy else dense(W, q)
    try:
        solution = solve(problem)
    except InfeasibleError:
        assert excess > 1e-9
    else:
        assert excess < 1e-7
        if solution.lam.any():
            assert complementarity(W, q, solution.lam) < 1e-10


@pytest.mark.parametrize("seed", range(5))
def test_slit_wider_than_its_body_by_a_millionth(seed):
    # a smooth line between walls on both sides that leave it 1e-6 of freedom: W's condition is beyond 1e16
    rng = np.random.default_rng(seed)
    x = np.sort(rng.random(150))
    j = np.arange(1, 40)
    F = np.c_[np.ones(150), np.cos(np.pi * np.outer(x, j)) / j**2] * rng.choice([-1.0, 1.0], 150)[:, None]
    q = F @ rng.standard_normal(40) + 1e-6
    assert complementarity(F @ F.T, q, solve(dense(F @ F.T, q)).lam) < 1e-9
