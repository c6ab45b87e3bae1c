"""Methods that find the contact forces, all with one signature, by the names of the command line.

    solution = solve(ContactProblem(W, q), "status")

A method's file is imported when the method is first called: PETSc and numba cost nothing where no method needs them.
"""

from __future__ import annotations

from functools import cache
from importlib import import_module
from types import ModuleType

import numpy as np

from contact.solvers.certificate import residual
from contact.solvers.problem import (
    SOLVED,
    ContactNotConvergedError,
    ContactProblem,
    Delassus,
    DenseDelassus,
    Floats,
    InfeasibleError,
    Method,
    Primal,
    Solution,
)

__all__ = [
    "METHODS",
    "SOLVED",
    "ContactNotConvergedError",
    "ContactProblem",
    "Delassus",
    "DenseDelassus",
    "InfeasibleError",
    "Method",
    "Primal",
    "Solution",
    "residual",
    "solve",
]

# These treat the rigid modes G themselves; `floating` does it for the others.
_ALONE = {"kkt", "vi-primal"}


def _method(name: str) -> Method:
    def solve(problem: ContactProblem, start: Floats | None = None, tolerance: float = 1e-12) -> Solution:
        if problem.G is not None and name not in _ALONE:
            floating: Solution = import_module("contact.solvers.floating").solve(method, problem, start, tolerance)
            return floating
        return method(problem, start, tolerance)

    def method(problem: ContactProblem, start: Floats | None, tolerance: float) -> Solution:
        if not problem.W.size:
            return Solution(np.empty(0), np.empty(0), np.empty(0), 0)
        found: Solution = module().solve(problem, start, tolerance)
        return found

    @cache
    def module() -> ModuleType:
        return import_module(f"contact.solvers.{name.replace('-', '_')}")

    solve.__doc__ = f"Contact forces by the method `{name}`: see `contact.solvers.solve`."
    return solve


METHODS: dict[str, Method] = {
    name: _method(name) for name in ("status", "gauss-seidel", "lemke", "kkt", "vi-rsls", "vi-ssls", "tao", "vi-primal")
}


def solve(
    problem: ContactProblem, method: str | Method = "status", start: Floats | None = None, tolerance: float = 1e-12
) -> Solution:
    """Find λ and α with 0 ≤ δ = W λ + G α + q ⊥ λ ≥ 0 and Gᵀλ + r = 0.

    Collective on the bodies' communicator, through W's columns.

    Parameters
    ----------
    problem : W, q and, for bodies that no support holds, G and r
    method : one of `METHODS`, or a function with the same signature, such as `minimum_norm` makes
    start : (c) a guess of λ [N]
    tolerance : on the complementarity residual, relative to ℓ

    Raises
    ------
    ValueError
        The method is not one of `METHODS`, or cannot treat this problem.
    InfeasibleError
        No λ ≥ 0 balances the load, or no position satisfies the constraints.
    ContactNotConvergedError
        The method stopped with a residual above its limit.
    """
    if callable(method):
        return method(problem, start, tolerance)
    if method not in METHODS:
        raise ValueError(f"method = {method!r}: allowed are {', '.join(METHODS)}")
    return METHODS[method](problem, start, tolerance)
