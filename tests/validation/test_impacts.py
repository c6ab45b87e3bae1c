"""The cases of impacts at coarse resolutions."""

import numpy as np
import pytest
from mpi4py import MPI

import fem.petsc  # noqa: F401  (before petsc4py)
from validation.case import CASES, Parameter, Quantity, Run
from validation.cases.impacts import History


def _run(name: str, h: float = 1.0, **changes: Parameter) -> dict[str, Quantity]:
    case = CASES[name]
    run = Run(case, MPI.COMM_SELF, case.configure(changes), h, 1, "status")
    try:
        return {q.name: q for q in case.solve(run)}
    finally:
        run.close()


@pytest.mark.parametrize("g", [9.81, 10.0])
def test_ball_drop_to_round_off(g: float) -> None:
    """The whole sequence of implicit Euler, the grazing step of g = 10 included."""
    found = _run("ball-drop", g=g)
    assert all(q.tolerance == 1e-12 and q.passed for q in found.values())
    assert found["impulse"].computed == pytest.approx(0.0 if g == 10 else 4.715, abs=1e-12)


@pytest.mark.parametrize(("name", "h"), [("bar-impact", 0.2), ("hanging-bar", 0.02)])
def test_implicit_euler(name: str, h: float) -> None:
    """Loss of impulse within 10 % of its law, of order ½, extrapolated to 1e-3; no energy from nowhere."""
    found = _run(name, h, integrator="implicit-euler")
    assert set(found) == {"impulse_extrapolated", "impulse_loss", "order", "energy_growth"}
    assert all(q.passed for q in found.values())


def test_midpoint() -> None:
    """The default scheme of `bar-impact`: the impulse to 1e-3, the times to 2 dt."""
    found = _run("bar-impact", 0.05)
    assert all(q.passed for q in found.values())
    assert found["impulse"].tolerance == 1e-3
    assert found["contact_end"].tolerance * found["contact_end"].exact == pytest.approx(
        0.1 / 30 / np.sqrt(2), rel=1e-12
    )


def test_history() -> None:
    """Contact lasts from the beginning of the first to the end of the last step above half of the pressure."""
    history = History(np.array([0.5, 1.5, 2.5, 3.5]), np.array([0.4, 1.0, 0.9, 0.1]), np.zeros(4), 1.0)
    assert history.contact(1.0) == (1.0, 3.0)
    assert history.impulse == pytest.approx(2.4)
    assert history.between(1.0, 3.0).impulse == pytest.approx(1.9)
    assert np.isnan(history.between(3.0, 4.0).contact(1.0)).all()
