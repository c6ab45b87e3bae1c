"""What all methods share: names, signature, agreement, honesty."""

from __future__ import annotations

import subprocess
import sys

import numpy as np
import pytest
from lcp_problems import COUNTER_EXAMPLES, complementarity, dense, family, half_space, reaction_difference, well_posed

from contact.solvers import (
    METHODS,
    ContactNotConvergedError,
    InfeasibleError,
    Solution,
    gauss_seidel,
    residual,
    solve,
)
from contact.solvers.certificate import accepted

ON_W = ["status", "gauss-seidel", "lemke", "vi-rsls", "vi-ssls", "tao"]


def test_names_are_those_of_the_contract():
    assert list(METHODS) == [*ON_W[:3], "kkt", *ON_W[3:], "vi-primal"]
    with pytest.raises(ValueError, match=r"method = 'newton': allowed are status, gauss-seidel, .*vi-primal"):
        solve(dense(*well_posed()), "newton")


def test_a_problem_that_needs_neither_numba_nor_petsc_starts_neither():
    code = (
        "import sys, numpy as np; from contact.solvers import *\n"
        "problem = ContactProblem(DenseDelassus(np.eye(3)), -np.ones(3))\n"
        "assert solve(problem).lam.tolist() == [1, 1, 1]\n"
        "assert not {'numba', 'petsc4py.PETSc'} & set(sys.modules)"
    )
    subprocess.run([sys.executable, "-c", code], check=True)


@pytest.mark.parametrize("method", ON_W)
def test_methods_agree_in_reaction_on_well_posed_problems(method):
    for W, q in (well_posed(), half_space(8)):
        lam = solve(dense(W, q), method).lam
        assert complementarity(W, q, lam) < 1e-9
        assert reaction_difference(W, solve(dense(W, q)).lam, lam) < 1e-8


@pytest.mark.parametrize("method", ["lemke", "vi-ssls", "tao"])
@pytest.mark.parametrize("name", ["beam", "dup"])
def test_methods_for_ill_conditioned_W_agree(method, name):
    W, q = family(name, 50)
    assert reaction_difference(W, solve(dense(W, q)).lam, solve(dense(W, q), method).lam) < 1e-8


@pytest.mark.parametrize("method", ON_W)
@pytest.mark.parametrize("length, compliance", [(1e-9, 1.0), (1e9, 1e-9), (1.0, 1e9)])
def test_units_do_not_matter(method, length, compliance):
    W, q = well_posed(12)
    plain, scaled = solve(dense(W, q), method), solve(dense(compliance * W, length * q), method)
    assert np.allclose(scaled.lam * compliance / length, plain.lam, rtol=0, atol=1e-10 * plain.lam.max())


@pytest.mark.parametrize("method", ON_W)
def test_no_contacts_and_no_load(method):
    assert solve(dense(np.empty((0, 0)), np.empty(0)), method).lam.shape == (0,)
    assert not solve(dense(np.eye(4), np.zeros(4)), method).lam.any()


@pytest.mark.parametrize("method", ON_W)
def test_start_from_the_solution_returns_it(method):
    W, q = well_posed()
    lam = solve(dense(W, q)).lam
    assert np.allclose(solve(dense(W, q), method, start=lam).lam, lam, rtol=0, atol=1e-11)


@pytest.mark.parametrize("method", ON_W)
def test_overlapping_walls_are_never_called_solved(method, monkeypatch):
    monkeypatch.setattr(gauss_seidel, "TIME_LIMIT", 0.05)
    with pytest.raises((InfeasibleError, ContactNotConvergedError)):
        solve(dense([[1.0, -1], [-1, 1]], [-0.7, 0.5]), method)


@pytest.mark.parametrize("name", COUNTER_EXAMPLES)
@pytest.mark.parametrize("method", ["lemke", "vi-ssls", "tao"])
def test_counter_examples(method, name):
    W, q = (np.array(values, float) for values in COUNTER_EXAMPLES[name])
    assert complementarity(W, q, solve(dense(W, q), method).lam) < 1e-9


def test_lemke_proves_infeasibility_with_its_ray():
    with pytest.raises(InfeasibleError):
        solve(dense([[1.0, -1], [-1, 1]], [-0.7, 0.5]), "lemke")


def test_gauss_seidel_hands_over_what_it_has_reached(monkeypatch):
    W, q = family("beam", 50)
    monkeypatch.setattr(gauss_seidel, "TIME_LIMIT", 0.1)
    with pytest.raises(ContactNotConvergedError) as caught:
        solve(dense(W, q), "gauss-seidel", tolerance=1e-10)
    assert caught.value.residual == pytest.approx(complementarity(W, q, caught.value.lam), rel=1e-6)
    assert caught.value.residual > 1e-10


def test_rsls_that_loses_its_way_says_so():
    W, q = family("beam", 50)
    with pytest.raises(ContactNotConvergedError, match="SNES reason"):
        solve(dense(W, q), "vi-rsls")


def test_residual_is_the_certificate_s():
    W, q = well_posed()
    problem, rng = dense(W, q), np.random.default_rng(5)
    lam = np.maximum(rng.standard_normal(len(q)), 0.0)
    assert residual(problem, Solution(lam, np.empty(0), q, 0)) == pytest.approx(complementarity(W, q, lam), rel=1e-12)
    assert residual(dense(0 * W, 0 * q), Solution(lam, np.empty(0), q, 0)) == 0
    assert residual(dense(W, np.abs(q)), Solution(0 * q, np.empty(0), q, 0)) == 0


def test_claims_are_kept_where_the_residual_refutes_them():
    """A claim of forces that leave a penetration is refuted; with a negative Wᵢᵢ the residual cannot refute one."""
    for W, q, lam, claimed in (
        (np.eye(2), np.array([-1.0, 0.0]), np.zeros(2), True),
        (np.array([[-2.0, 5.0], [5.0, -4.0]]), np.array([0.0, -1.0]), np.array([5.0, 2.0]) / 17, False),
    ):
        with pytest.raises(ContactNotConvergedError) as error:
            accepted(W, q, lam, 3, "SNES reason 2", claimed=True)
        assert error.value.claimed is claimed
        with pytest.raises(ContactNotConvergedError) as error:
            accepted(W, q, lam, 3, "SNES reason -6")
        assert not error.value.claimed


@pytest.mark.parametrize("ratio", [1e-6, 1.0, 1e6])
def test_gauss_seidel_on_stacked_masses(ratio):
    """It ends where rounding lets it change nothing more: λ right to ε times the masses' ratio."""
    W, q = 1e-4 * np.array([[1.0, -1.0], [-1.0, 1.0 + 1 / ratio]]), np.array([-9.81e-4, 0.0])
    lam = solve(dense(W, q), "gauss-seidel").lam
    np.testing.assert_allclose(lam, [9.81 * (1 + ratio), 9.81 * ratio], rtol=max(1e-11, 1e-15 * ratio))


def test_an_indefinite_operator_is_named():
    with pytest.raises(ContactNotConvergedError, match="A is not positive definite"):
        solve(dense([[-1.0, 0.0], [0.0, 1.0]], [-1.0, 1.0]), "status")
