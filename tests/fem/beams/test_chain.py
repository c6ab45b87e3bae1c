"""The block-tridiagonal matrix of a beam: dense algebra and PETSc's SeqBAIJ LU give the same."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import pytest

from fem.beams import chain_kernels
from fem.beams.chain import Chain, KspChain, matrix_of

from petsc4py import PETSc  # isort: skip

NODES = 13
FIXED = np.isin(np.arange(6 * NODES), [0, 1, 2, 3, 4, 5, 40, 6 * NODES - 1])
RTOL = 1e-11


def blocks(nodes=NODES, seed=0):
    """Diagonal and upper blocks of a positive definite matrix, and that matrix."""
    rng = np.random.default_rng(seed)
    matrix = np.zeros((6 * nodes, 6 * nodes))
    for i in range(nodes - 1):
        G = rng.normal(size=(12, 12))
        matrix[6 * i : 6 * i + 12, 6 * i : 6 * i + 12] += G @ G.T
    matrix += 0.1 * np.eye(6 * nodes)
    parts = matrix.reshape(nodes, 6, nodes, 6).swapaxes(1, 2)
    n = np.arange(nodes)
    return parts[n, n].copy(), parts[n[:-1], n[1:]].copy(), matrix


def filled(kind=Chain, fixed=FIXED, seed=0):
    """A chain that holds the matrix, factorised, and what it holds, dense."""
    diagonal, upper, matrix = blocks(len(fixed) // 6, seed)
    scale = matrix.diagonal().max()
    chain = kind(fixed)
    chain.fill(diagonal, upper)
    chain.factor()
    matrix[fixed], matrix[:, fixed] = 0.0, 0.0
    matrix[fixed, fixed] = scale
    return chain, matrix


def rows(elements, fixed=FIXED, seed=1):
    """Entries (c, 12) at the elements' nodes, zero at fixed unknowns, and the same dense."""
    values = np.random.default_rng(seed).normal(size=(len(elements), 12))
    H = np.zeros((len(elements), len(fixed)))
    for i, e in enumerate(elements):
        values[i, fixed[6 * e : 6 * e + 12]] = 0.0
        H[i, 6 * e : 6 * e + 12] = values[i]
    return values, H


def held_by_petsc(chain):
    """The entries of the chain's PETSc matrix, dense."""
    every = np.arange(len(FIXED), dtype=PETSc.IntType)
    return chain.A.getValues(every, every)


def close(actual, exact):
    np.testing.assert_allclose(actual, exact, rtol=0, atol=RTOL * np.abs(exact).max(initial=1e-300))


@pytest.fixture
def options() -> Iterator[PETSc.Options]:
    """PETSc's options, those of the test taken away again."""
    given = PETSc.Options("free_")
    yield given
    for name in given.getAll():
        given.delValue(name)


def test_matrix_is_that_of_the_blocks():
    """PETSc's copy has unit rows on the scale of the matrix at prescribed unknowns, and follows each `fill`."""
    chain, matrix = filled()
    np.testing.assert_array_equal(held_by_petsc(chain), matrix)
    assert chain.A.getType() == "seqbaij"
    assert chain.A.getBlockSize() == 6
    diagonal, upper, other = blocks(seed=5)
    chain.fill(diagonal, upper)
    free = ~FIXED
    np.testing.assert_array_equal(held_by_petsc(chain)[np.ix_(free, free)], other[np.ix_(free, free)])
    chain.close()


@pytest.mark.parametrize("nodes", [2, 3, NODES, 171])
def test_solve(nodes):
    """Dense algebra and PETSc's LU of the same matrix; prescribed unknowns stay."""
    fixed = np.zeros(6 * nodes, dtype=bool)
    fixed[:3] = True
    chain, matrix = filled(fixed=fixed)
    assert chain.definite
    assert np.linalg.eigvalsh(matrix)[0] > 0
    B = np.random.default_rng(2).normal(size=(6 * nodes, 4))
    X = chain.solve(B)
    free = np.where(fixed[:, None], 0.0, B)
    close(X, np.linalg.solve(matrix, free))
    assert not X[fixed].any()
    assert chain.solve(B[:, :0]).shape == (6 * nodes, 0)
    ksp = PETSc.KSP().create(PETSc.COMM_SELF)
    ksp.setOperators(chain.A)
    ksp.setType("preonly")
    ksp.getPC().setType("lu")
    b, x = chain.A.createVecs()
    b.setArray(free[:, 0])
    ksp.solve(b, x)
    close(X[:, 0], x.getArray())
    ksp.destroy()
    chain.close()


def test_right_hand_sides_are_not_overwritten():
    chain, _ = filled()
    B = np.random.default_rng(3).normal(size=(2, 6 * NODES))
    before = B.copy()
    chain.solve(B.T)
    np.testing.assert_array_equal(B, before)


def test_an_indefinite_matrix():
    """Buckled beams have negative pivots; blocks that need row exchanges too."""
    diagonal, upper, matrix = blocks()
    shift = np.diag([0.0, 30.0, 0.0, 45.0, 0.0, 20.0])
    diagonal -= shift
    diagonal[0, 0, 0] = matrix[0, 0] = 0.0
    matrix -= np.kron(np.eye(NODES), shift)
    chain = Chain(np.zeros(6 * NODES, dtype=bool))
    chain.fill(diagonal, upper)
    chain.factor()
    B = np.random.default_rng(4).normal(size=(6 * NODES, 2))
    assert not chain.definite
    eigenvalues = np.linalg.eigvalsh(matrix)
    assert eigenvalues[0] < 0 < eigenvalues[-1]
    np.testing.assert_allclose(matrix @ chain.solve(B), B, atol=1e-10)


def test_rising():
    """Whether numbers are in order, equal ones included."""
    assert all(chain_kernels.rising(np.array(numbers, dtype=np.int64)) for numbers in ([], [3], [1, 1, 4]))
    assert not chain_kernels.rising(np.array([0, 2, 1]))


@pytest.mark.parametrize(
    "elements",
    [
        [],
        [0],
        [NODES - 2],
        [0, 0, 0],
        [0, 0, 3, 3, 3, 4, 9, NODES - 2, NODES - 2],
        [NODES - 2, 0, 5, 5, 1, 11, 0, 7],
    ],
    ids=str,
)
def test_delassus(elements):
    """H A⁻¹ Hᵀ of dense algebra: rows on the first and the last element, several on one, in any order, none."""
    chain, matrix = filled()
    values, H = rows(elements)
    W = chain.delassus(values, np.array(elements, dtype=np.int64))
    exact = H @ np.linalg.solve(matrix, H.T)
    assert W.shape == exact.shape
    close(W, exact)
    np.testing.assert_array_equal(W, W.T)


@pytest.mark.parametrize("seed", range(20))
def test_delassus_of_random_rows(seed):
    rng = np.random.default_rng(seed)
    elements = rng.integers(0, NODES - 1, rng.integers(1, 40))
    chain, matrix = filled(seed=seed)
    values, H = rows(elements, seed=seed)
    close(chain.delassus(values, elements), H @ np.linalg.solve(matrix, H.T))


def test_a_factor_is_that_of_the_last_fill():
    """The chord iteration solves with the old factor until `factor` is called again."""
    chain, matrix = filled()
    B = np.random.default_rng(6).normal(size=(6 * NODES, 1))
    diagonal, upper, _ = blocks(seed=8)
    chain.fill(diagonal, upper)
    close(chain.solve(B), np.linalg.solve(matrix, np.where(FIXED[:, None], 0.0, B)))
    chain.factor()
    _, new = filled(seed=8)
    close(chain.solve(B), np.linalg.solve(new, np.where(FIXED[:, None], 0.0, B)))


@pytest.mark.parametrize("node", [0, 4, NODES - 1])
def test_singular(node):
    """Named is the node whose pivot vanishes."""
    diagonal, upper, _ = blocks()
    upper[:] = 0.0
    diagonal[node, 2, :] = diagonal[node, :, 2] = 0.0
    chain = Chain(np.zeros(6 * NODES, dtype=bool))
    chain.fill(diagonal, upper)
    with pytest.raises(ArithmeticError, match=f"singular at node {node}"):
        chain.factor()


def test_not_finite():
    diagonal, upper, _ = blocks()
    diagonal[7, 3, 3] = np.nan
    chain = Chain(np.zeros(6 * NODES, dtype=bool))
    chain.fill(diagonal, upper)
    with pytest.raises(ArithmeticError, match="singular at node 7"):
        chain.factor()


# --- options path -----------------------------------------------------------------------------------------------------


def test_options_choose_the_solver(options):
    """Without ``-free_…`` a beam's own elimination, with one a KSP."""
    assert type(matrix_of(FIXED)) is Chain
    options["ksp_type"] = "cg"
    assert type(matrix_of(FIXED)) is KspChain


def test_ksp_by_default_is_lu():
    """Same answers as the elimination, over several right-hand sides and a second matrix."""
    chain, matrix = filled(KspChain)
    B = np.random.default_rng(9).normal(size=(6 * NODES, 3))
    free = np.where(FIXED[:, None], 0.0, B)
    close(chain.solve(B), np.linalg.solve(matrix, free))
    diagonal, upper, _ = blocks(seed=8)
    chain.fill(diagonal, upper)
    chain.factor()
    _, new = filled(seed=8)
    close(chain.solve(B), np.linalg.solve(new, free))
    values, _ = rows([3])
    assert chain.delassus(values, np.array([3])) is None
    chain.close()


def test_ksp_obeys_options(options):
    """Conjugate gradients to their tolerance."""
    options["ksp_type"] = "cg"
    options["pc_type"] = "pbjacobi"
    options["ksp_rtol"] = 1e-13
    chain, matrix = filled(KspChain)
    B = np.random.default_rng(10).normal(size=(6 * NODES, 2))
    X = chain.solve(B)
    exact = np.linalg.solve(matrix, np.where(FIXED[:, None], 0.0, B))
    np.testing.assert_allclose(X, exact, rtol=0, atol=1e-9 * np.abs(exact).max())
    chain.close()
