"""All contact methods find the forces of the status method on the contact problem of every case, or say why not."""

from __future__ import annotations

from dataclasses import asdict
from typing import Any

import numpy as np
import pytest
from mpi4py import MPI

import validation.cases  # noqa: F401  enters the cases into the catalogue
from contact.solvers import METHODS, ContactNotConvergedError
from validation.case import CASES, Run

# Coarse mesh sizes; None is the case's default.
COARSE: dict[str, float] = {
    "transition": 1 / 16, "hertz-line": 1 / 20, "hertz-point": 1 / 20, "punch-cone": 1 / 20, "punch-flat": 1 / 20,
    "punch-wedge": 1 / 20, "layer": 1 / 10, "receding": 1 / 10, "membrane-ball": 1 / 4, "membrane-disc": 1 / 6,
    "string": 1 / 20, "plug": 1 / 4, "ball-shell": 1 / 8, "bar-stop": 1 / 8, "duplicated": 1 / 8, "opposed": 1 / 8,
    "two-bars": 1.0, "v-groove": 1.0, "cantilever-floor": 1 / 16, "heavy-beam": 1 / 16, "beam-stop": 1 / 20,
    "column-walls": 1 / 8, "dawson-paslay": 0.45, "wire-tube": 0.3 / 20, "helix-tube": 1.6, "coil-tube": 0.4,
    "layered-tube": 0.6, "spring-surface": 1.0, "ball-drop": 1.0, "bouncing-bar": 1.0, "hanging-bar": 1 / 20,
    "patch": 1 / 10, "wavy": 1 / 20, "shrink-fit": 1 / 4, "pin-hole": 1 / 20,
}  # fmt: skip

# The same of two elastic bodies.
PAIRS: dict[str, dict[str, Any]] = {
    "hertz-line": {"E1": 10.0, "E2": 1.0},
    "hertz-point": {"E1": 10.0, "E2": 1.0},
    "plug": {"E1": 2.0},
    "ball-shell": {"E1": 2.0},
}

# Nothing touches in their last state.
APART = {"circle", "bend-45", "euler-load", "elastica-tip", "bar-impact", "two-bar-impact", "hertz-impact"}

# What a method cannot treat: rows of H with several entries, bodies that nothing holds, no matrices at all.
REFUSED = {
    **{(name, "vi-primal"): "several entries" for name in ("shrink-fit", "pin-hole")},
    **{(f"{name} pair", "vi-primal"): "several entries" for name in PAIRS},
    ("patch", "vi-primal"): "supported bodies",
    ("wavy", "vi-primal"): "supported bodies",
    ("two-bars", "vi-primal"): "several entries",
    ("plug", "vi-primal"): "several entries",
    ("ball-shell", "vi-primal"): "several entries",
    ("layered-tube", "vi-primal"): "several entries",
    ("receding", "vi-primal"): "supported bodies",
    ("v-groove", "vi-primal"): "supported bodies",
    ("v-groove", "kkt"): "matrices behind W",
    ("ball-drop", "vi-primal"): "their matrices",
    ("ball-drop", "kkt"): "matrices behind W",
    ("wire-tube", "vi-primal"): "several entries",
    ("helix-tube", "vi-primal"): "several entries",
    ("coil-tube", "vi-primal"): "several entries",
    ("spring-surface", "vi-primal"): "several entries",
}

# W of a beam that lies flat is close to singular: there a method may stop without a solution, if it says so.
MAY_STOP = {(name, "vi-rsls") for name in ("cantilever-floor", "heavy-beam", "beam-stop", "column-walls")}
MAY_STOP |= {("cantilever-floor", "vi-ssls")}


@pytest.fixture(scope="module", params=[*sorted(COARSE), *(f"{name} pair" for name in PAIRS)])
def solved(request: pytest.FixtureRequest) -> Any:
    """A name and a solved case."""
    name, _, pair = request.param.partition(" ")
    case = CASES[name]
    parameters = case.configure(PAIRS[name] if pair else {})
    with Run(case, MPI.COMM_SELF, parameters, COARSE[name], case.orders[-1], "status") as run:
        case.solve(run)
        yield request.param, run


def test_every_case_is_here() -> None:
    """A new case joins."""
    assert set(COARSE) | APART == set(CASES)


@pytest.mark.parametrize("method", [name for name in METHODS if name != "status"])
def test_agreement(solved: tuple[str, Run], method: str) -> None:
    """ΔλᵀWΔλ ≤ (1e-8)² λᵀWλ on the same W, and on bodies that nothing holds the same resultant Gᵀλ."""
    name, run = solved
    assert run.solved is not None
    problem = run.solved.result.problem
    if reason := REFUSED.get((name, method)):
        with pytest.raises(ValueError, match=reason):
            METHODS[method](problem)
        return
    reference = METHODS["status"](problem)
    try:
        found = METHODS[method](problem)
    except ContactNotConvergedError:
        assert (name, method) in MAY_STOP
        return
    W = problem.W.columns(np.arange(problem.W.size))
    difference = found.lam - reference.lam
    # Round-off makes a semidefinite form negative by a few units of its terms.
    assert difference @ W @ difference <= 1e-16 * (reference.lam @ W @ reference.lam)
    assert (found.lam >= 0).all()
    assert np.linalg.norm(reference.lam) > 0
    if problem.G is not None:
        assert problem.G.T @ difference == pytest.approx(0.0, abs=1e-8 * np.abs(problem.r).max())


def test_on_the_displacements() -> None:
    """Through the whole step, `status` and PETSc's solver on the displacements agree on a membrane to 1e-8."""
    case = CASES["membrane-ball"]
    shapes, forces = [], []
    for method in ("status", "vi-primal"):
        with Run(case, MPI.COMM_SELF, case.configure({}), 4 / 32, 1, method) as run:
            case.solve(run)
            assert run.solved is not None
            shapes.append(run.solved.system.bodies[0].u.copy())
            forces.append(run.solved.forces())
    assert np.abs(shapes[0]).max() > 0.5
    assert shapes[1] == pytest.approx(shapes[0], abs=1e-8)
    assert forces[1] == pytest.approx(forces[0], abs=1e-8 * forces[0].max())


@pytest.mark.parametrize("method", sorted(METHODS))
def test_every_method_meets_the_certificate(method: str) -> None:
    """hertz-line through the step: the same force, and all four residuals within 1e-8, whatever the method."""
    case = CASES["hertz-line"]
    with Run(case, MPI.COMM_WORLD, case.configure({}), 1 / 20, 2, method) as run:
        case.solve(run)
        assert run.solved is not None
        residuals = asdict(run.solved.result.certificate).values()
        assert max(residuals) <= 1e-8
        assert run.solved.forces().sum() == pytest.approx(0.07767674 / 2, rel=1e-3)
