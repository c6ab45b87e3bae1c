"""Contact problems that the tests of several methods share."""

from __future__ import annotations

import importlib.util
import sys
from pathlib import Path

import h5py
import numpy as np
import pytest
import scipy.sparse as sp
import scipy.sparse.linalg as spl

from contact.solvers.problem import ContactProblem, DenseDelassus, Floats, Ints
from validation.stability.generators import patches

SHARED = Path(__file__).resolve().parents[4] / "shared"

# From solvers.md: what cycles under the plain rules. W's lower rows, q.
COUNTER_EXAMPLES = {
    "primal-dual cycles": ([[4, 5, -5], [5, 9, -5], [-5, -5, 7]], [2, 1, -3]),
    "drop one, add all cycles": (
        [
            [4.181, -0.827, -2.595, 1.473],
            [-0.827, 1.807, 1.873, -1.306],
            [-2.595, 1.873, 2.752, -1.747],
            [1.473, -1.306, -1.747, 1.155],
        ],
        [0.534, 1.664, 1.281, -1.348],
    ),
    "single pivot cycles": (
        [
            [0.518, -0.77, 1.49, -0.013],
            [-0.77, 1.502, -2.715, 0.169],
            [1.49, -2.715, 5.007, -0.25],
            [-0.013, 0.169, -0.25, 0.067],
        ],
        [-1.249, 1.07, 0.178, -0.437],
    ),
    "degenerate": ([[1, -1, -2], [-1, 5, 3], [-2, 3, 6]], [1, -1, -3]),
}


class CountingDelassus:
    """W by columns; notes which were asked for."""

    def __init__(self, W: Floats) -> None:
        self.W, self.asked = np.asarray(W, float), np.empty(0, int)

    @property
    def size(self) -> int:
        return len(self.W)

    def columns(self, rows: Ints) -> Floats:
        self.asked = np.append(self.asked, rows)
        return self.W[:, rows]


def complementarity(W: Floats, q: Floats, lam: Floats) -> float:
    """max|min(Wᵢᵢ λᵢ, δᵢ)|/ℓ, λ ≥ 0, written independently of the package."""
    assert lam.min(initial=0.0) >= 0
    Wlam = W @ lam
    ell = max(-q.min(initial=0.0), np.abs(Wlam).max(initial=0.0))
    return float(np.abs(np.minimum(np.diag(W) * lam, Wlam + q)).max(initial=0.0) / ell)


def reaction_difference(W: Floats, lam: Floats, other: Floats) -> float:
    """(ΔλᵀWΔλ / λᵀWλ)^½; its round-off is of 1e-8 where Δλ is large in W's null space."""
    change = lam - other
    return float(np.sqrt(max(change @ W @ change, 0.0) / (lam @ W @ lam)))


def factored_difference(F: Floats, lam: Floats, other: Floats) -> float:
    """The same with W = F Fᵀ, ‖FᵀΔλ‖ / ‖Fᵀλ‖, to round-off for every Δλ."""
    return float(np.linalg.norm(F.T @ (lam - other)) / np.linalg.norm(F.T @ lam))


def family(name: str, c: int) -> tuple[Floats, Floats]:
    """W, q of one of the benchmark's families."""
    return factored_family(name, c)[:2]


def factored_family(name: str, c: int) -> tuple[Floats, Floats, Floats]:
    """W, q and F with W = F Fᵀ of one of the benchmark's families."""
    script = SHARED / "bench" / "contact_problems.py"
    if not script.exists():
        pytest.skip("needs ../shared/bench")
    spec = importlib.util.spec_from_file_location("contact_problems", script)
    assert spec is not None and spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    write, sys.dont_write_bytecode = sys.dont_write_bytecode, True
    try:
        spec.loader.exec_module(module)
    finally:
        sys.dont_write_bytecode = write
    problem = module.make(name, c)
    return (problem["W"] + problem["W"].T) / 2, problem["q"], problem["Lf"]


def well_posed(c: int = 30) -> tuple[Floats, Floats]:
    """A well-conditioned problem with about 60 % active."""
    rng = np.random.default_rng(7)
    F = rng.standard_normal((c, 2 * c)) / np.sqrt(2 * c)
    return F @ F.T, rng.standard_normal(c) - 0.3


def half_space(n: int) -> tuple[Floats, Floats]:
    """A paraboloid pressed on an elastic half-space of n × n square patches: W ~ 1/(πr), as of solids."""
    W, height = patches(n)
    return W, height - 0.3


FCLIB = (
    "Capsules-i125-1213",
    "LMGC_100_PR_PerioBox-i00361-60-03000",
    "Box_Stacks-i0122-82-5",
    "CubeH8",
    "LMGC_GlobalFrictionContactProblem00046",
)


def fclib(name: str) -> tuple[Floats, Floats]:
    """W, q of the normal part of an FCLIB file."""
    path = SHARED / "data" / "fclib" / f"{name}.hdf5"
    if not path.exists():
        pytest.skip("needs ../shared/data/fclib")
    with h5py.File(path) as file:
        if "fclib_local" in file:
            group = file["fclib_local"]
            W, q = _matrix(group["W"]).toarray(), group["vectors/q"][:]
        else:
            group = file["fclib_global"]
            M, H = _matrix(group["M"]), _matrix(group["H"])
            solve = spl.splu(sp.csc_matrix((M + M.T) / 2)).solve
            W = H.T @ solve(H.toarray())
            q = H.T @ solve(group["vectors/f"][:]) + group["vectors/w"][:]
    W = W[::3, ::3]
    return (W + W.T) / 2, q[::3]


def _matrix(group: h5py.Group) -> sp.csr_matrix:
    shape = (int(group["m"][0]), int(group["n"][0]))
    if group["nz"][0] == -2:
        return sp.csr_matrix((group["x"][:], group["i"][:], group["p"][:]), shape=shape)
    return sp.csr_matrix((group["x"][:], (group["i"][:], group["p"][:])), shape=shape)


def dense(W: Floats, q: Floats) -> ContactProblem:
    """The problem with all of W known."""
    return ContactProblem(DenseDelassus(np.asarray(W, float)), np.asarray(q, float))


def v_groove(beta: float, compliance: float, load: float) -> ContactProblem:
    """A body between two walls at ±β from the vertical, pulled down by `load`; W isotropic."""
    normals = np.array([[np.cos(beta), np.sin(beta)], [-np.cos(beta), np.sin(beta)]])
    W = compliance * normals @ normals.T
    return ContactProblem(DenseDelassus(W), np.array([0.01, 0.02]), G=normals, r=np.array([0.0, -load]))
