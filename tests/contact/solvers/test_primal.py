"""`kkt` and `vi-primal`, which start from the matrices behind W."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
import pytest
import scipy.sparse as sp
import scipy.sparse.linalg as spl
from lcp_problems import reaction_difference

from contact.solvers import ContactProblem, DenseDelassus, InfeasibleError, solve
from fem import petsc  # noqa: F401

from petsc4py import PETSc  # isort: skip


class Matrices(NamedTuple):
    """The primal side of a problem."""

    A: list[Any]
    H: list[Any]


def aij(A):
    A = sp.csr_matrix(A, dtype=float)
    A.sort_indices()
    return PETSc.Mat().createAIJ(
        A.shape, csr=(A.indptr.astype(PETSc.IntType), A.indices.astype(PETSc.IntType), A.data), comm=PETSc.COMM_SELF
    )


def posed(bodies, q, **modes):
    """The problem of bodies given by (A, H)."""
    W = sum(H @ spl.spsolve(sp.csc_matrix(A), H.T.toarray()).reshape(-1, H.shape[0]) for A, H in bodies)
    primal = Matrices([aij(A) for A, _ in bodies], [aij(H) for _, H in bodies])
    return ContactProblem(DenseDelassus(W), q, primal=primal, **modes)


def membrane(n=20, stiffness=1.0):
    """−Δ on n × n interior points of a square, an obstacle below every third one."""
    T = sp.diags_array([-1.0, 2, -1], offsets=[-1, 0, 1], shape=(n, n))
    A = stiffness * (sp.kron(T, sp.eye_array(n)) + sp.kron(sp.eye_array(n), T))
    x = np.linspace(-1, 1, n + 2)[1:-1]
    obstacle = 0.3 - (x[:, None] ** 2 + x**2).ravel()
    rows = np.arange(0, n * n, 3)
    H = sp.csr_array((np.ones(len(rows)), (np.arange(len(rows)), rows)), shape=(len(rows), n * n))
    return A, H, -obstacle[rows]


@pytest.mark.parametrize("method", ["kkt", "vi-primal"])
@pytest.mark.parametrize("stiffness", [1e-9, 1.0, 1e9])
def test_membrane_on_an_obstacle(method, stiffness):
    A, H, q = membrane(stiffness=stiffness)
    problem = posed([(A, H)], 1e-3 * q)
    status, other = solve(problem), solve(problem, method)
    assert np.count_nonzero(status.lam) > 10
    assert np.allclose(other.lam, status.lam, rtol=0, atol=1e-10 * status.lam.max())
    assert np.allclose(other.gap, status.gap, rtol=0, atol=1e-13)


@pytest.mark.parametrize("method", ["kkt", "vi-primal"])
def test_two_bodies_that_do_not_touch_each_other(method):
    A, H, q = membrane(8)
    none = sp.csr_array(H.shape)
    # the second one hangs under its obstacle: h < 0
    problem = posed([(A, sp.vstack([H, none])), (3 * A, sp.vstack([none, -2 * H]))], np.r_[q, 2 * q])
    c, single = len(q), solve(posed([(A, H)], q)).lam
    both = solve(problem, method)
    assert np.allclose(both.lam[:c], single, rtol=0, atol=1e-11 * single.max())
    assert np.allclose(both.lam[c:], 3 * single / 2, rtol=0, atol=1e-11 * single.max())


def test_kkt_of_two_bodies_in_contact_is_two_bars():
    # u₁ pushed over u₂: δ = g − u₁ + u₂ with k₁ u₁ = F − λ, k₂ u₂ = λ; λ = k₂ (F − k₁ g)/(k₁ + k₂)
    k1, k2, F, g = 1.0, 1e12, 2.0, 1.0
    bodies = [(sp.csr_array([[k1]]), sp.csr_array([[-1.0]])), (sp.csr_array([[k2]]), sp.csr_array([[1.0]]))]
    solution = solve(posed(bodies, np.array([g - F / k1])), "kkt")
    assert solution.lam == pytest.approx([k2 * (F - k1 * g) / (k1 + k2)], rel=1e-15)


def test_kkt_keeps_a_maximal_independent_subset_of_duplicated_rows():
    A, H, q = membrane(10)
    problem = posed([(A, sp.vstack([H, H, H]))], np.tile(q, 3))
    status, kkt = solve(problem), solve(problem, "kkt")
    assert reaction_difference(problem.W.W, status.lam, kkt.lam) < 1e-12
    assert kkt.details["rows"] == np.count_nonzero(solve(posed([(A, H)], q)).lam)


@pytest.mark.parametrize("beta", [0.1, 0.8, 1.5])
def test_kkt_with_rigid_modes_in_a_v_groove(beta):
    normals = np.array([[np.cos(beta), np.sin(beta)], [-np.cos(beta), np.sin(beta)]])
    # a body of four unknowns: its two modes, and two springs that the contacts also move
    body = (2.5 * sp.eye_array(2), sp.csr_array(normals))
    problem = posed([body], np.array([0.01, 0.02]), G=normals, r=np.array([0.0, -3.7]))
    solution = solve(problem, "kkt")
    assert np.allclose(solution.lam, 3.7 / (2 * np.sin(beta)), rtol=1e-12)
    assert np.allclose(solution.alpha, solve(problem).alpha, rtol=0, atol=1e-12 * np.abs(solution.alpha).max())
    assert np.abs(solution.gap).max() < 1e-13 * np.abs(solution.alpha).max()


def test_of_several_bounds_on_one_unknown_the_tightest_carries():
    H = sp.csr_array([[1.0], [2.0], [-1.0]])
    problem = posed([(sp.csr_array([[4.0]]), H)], np.array([-0.5, -1.5, 2.0]))
    solution = solve(problem, "vi-primal")
    assert np.allclose(solution.lam, [0, 4 * 0.75 / 2, 0], rtol=1e-14)
    assert np.allclose(solution.gap, [0.25, 0, 1.25], rtol=0, atol=1e-15)


def test_bounds_that_leave_no_value_are_infeasible():
    H = sp.csr_array([[1.0], [-1.0]])
    with pytest.raises(InfeasibleError):
        solve(posed([(sp.csr_array([[4.0]]), H)], np.array([-0.5, 0.4])), "vi-primal")


def test_refusals_name_what_is_allowed():
    A, H = sp.eye_array(2), sp.csr_array([[1.0, 0.0], [1.0, -1.0]])
    q = np.array([-1.0, -1.0])
    with pytest.raises(ValueError, match=r"row 1 of H has several entries; allowed is exactly one"):
        solve(posed([(A, H)], q), "vi-primal")
    with pytest.raises(ValueError, match=r"row 1 of H has no entry"):
        solve(posed([(A, sp.csr_array([[1.0, 0.0], [0.0, 0.0]]))], q), "vi-primal")
    for method in ("kkt", "vi-primal"):
        with pytest.raises(ValueError, match=f"method = '{method}'.*problem.primal"):
            solve(ContactProblem(DenseDelassus(np.eye(2)), q), method)
    with pytest.raises(ValueError, match="supported bodies"):
        solve(posed([(A, H)], q, G=np.ones((2, 1)), r=-np.ones(1)), "vi-primal")
