"""The cases of impacts at coarse resolutions."""

import numpy as np
import pytest
from mpi4py import MPI

import fem.petsc  # noqa: F401  (before petsc4py)
from contact.loop import AcceptedStep, march
from contact.scene.build import build
from contact.scene.schema import Scene
from validation.case import CASES, Parameter, Quantity, Run
from validation.cases.impacts import CLOSE, History


def _run(name: str, h: float = 1.0, order: int = 1, **changes: Parameter) -> dict[str, Quantity]:
    case = CASES[name]
    run = Run(case, MPI.COMM_SELF, case.configure(changes), h, order, "status")
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


@pytest.mark.parametrize(
    ("name", "h", "changes"),
    [
        ("bar-impact", 0.25, {}),
        ("hanging-bar", 0.025, {}),
        ("two-bar-impact", 0.025, {"L2": 1.0}),
    ],
)
def test_implicit_euler(name: str, h: float, changes: dict[str, Parameter]) -> None:
    """Loss of impulse within 10 % of its law, of order ½, extrapolated to 1e-3; no energy from nowhere."""
    found = _run(name, h, integrator="implicit-euler", **changes)
    assert set(found) == {"impulse_extrapolated", "impulse_loss", "order", "energy_growth"}
    assert found["order"].error < 0.02
    assert all(q.passed for q in found.values())


def test_implicit_euler_grazes() -> None:
    """Bars that stay together without force give back what the smeared front took: no loss, by any step."""
    found = _run("two-bar-impact", 0.025, integrator="implicit-euler")
    assert found["impulse_loss"].exact == 0
    assert abs(found["impulse_loss"].computed) < 1e-6
    assert all(q.passed for q in found.values())


@pytest.mark.parametrize(
    ("name", "L", "n"), [("bar-impact", 10.0, 60), ("hanging-bar", 1.0, 60), ("two-bar-impact", 1.0, 60)]
)
def test_midpoint(name: str, L: float, n: int) -> None:
    """Times within 2 dt at any resolution; impulses to first order, which reaches 1e-3 at the default one."""
    found = _run(name, L / n)
    default = CASES[name].sizes(CASES[name].configure({}))[0]
    assert found.pop("impulse").error < 0.75 * CLOSE * (L / n) / default
    assert {"contact_start", "contact_end"} <= set(found)
    assert all(q.passed for q in found.values())


def test_bouncing_bar() -> None:
    """Both bounces and the period at 40 % of the default resolution."""
    found = _run("bouncing-bar", 0.25)
    for impulse in ("impulse", "second_impulse"):
        assert found.pop(impulse).error < 0.75 * 2.5 * CLOSE
    assert len(found) == 5
    assert all(q.passed for q in found.values())


@pytest.mark.parametrize("changes", [{}, {"E": 200.0, "R": 0.5, "rho": 1e3, "v0": 1e-4}])
def test_hertz_impact(changes: dict[str, Parameter]) -> None:
    """Half of the default resolution, whose error of order two is at most four times as large; other units."""
    case = CASES["hertz-impact"]
    p = case.configure(changes)
    # a ∝ R (ρ v₀²/E)^{1/5}: cells as large against the contact as those of the default
    a = float(p["R"]) * (float(p["rho"]) * float(p["v0"]) ** 2 / float(p["E"]) / 2.4e-4**2) ** 0.2
    found = _run("hertz-impact", 8e-3 * a, 2, **changes)
    assert found.pop("order_of_approach").error < 0.2
    assert all(q.error <= 4 * q.tolerance for q in found.values()), found


def test_history() -> None:
    """Contact lasts from the rise above half of the first pressure to the fall below half of the last."""
    history = History(np.array([0.5, 1.5, 2.5, 3.5]), np.array([0.25, 1.0, 0.9, 0.1]), np.zeros(4), 1.0)
    assert history.contact(1.0) == pytest.approx((0.5 + 1 / 3, 3.0))
    assert history.contact(0.25, 0.6) == pytest.approx((0.0, 2.5 + 0.75))
    assert history.impulse == pytest.approx(2.25)
    assert history.between(1.0, 3.0).impulse == pytest.approx(1.9)
    assert np.isnan(history.between(3.0, 4.0).contact(1.0)).all()


@pytest.mark.parametrize("ratio", [1.0, 1e3, 1e6])
def test_stacked_masses(ratio: float) -> None:
    """A mass m₁ on the floor bears m₂ = `ratio` m₁: λ = (m₁+m₂) g and m₂ g, to what cond W ~ m₂/m₁ leaves."""
    g = 9.81

    def mass(name: str, x: float, m: float) -> dict[str, object]:
        return {
            "name": name,
            "kind": "rigid",
            "guided": True,
            "mesh": {"shape": "interval", "length": 1.0, "n": 1, "origin": x},
            "density": m,
            "loads": [{"kind": "body", "value": [-m * g]}],
        }

    floor = {"kind": "plane", "point": [0.0], "normal": [1.0]}
    head = {"kind": "point", "body": "lower", "tag": "end", "normal": [1.0]}
    scene = Scene.model_validate(
        {
            "time": {"end": 0.03, "steps": 3, "integrator": "implicit-euler"},
            "body": [mass("lower", 0.0, 1.0), mass("upper", 1.0, ratio)],
            "contact": [
                {"body": "lower", "tag": "start", "surface": floor},
                {"body": "upper", "tag": "start", "surface": head},
            ],
        }
    )
    steps: list[AcceptedStep] = []
    system = build(scene, MPI.COMM_SELF)
    try:
        system.prepare()
        march(system, scene, steps.append)
    finally:
        system.close()
    assert len(steps) == 3
    for accepted in steps:
        np.testing.assert_allclose(accepted.result.lam, [(1 + ratio) * g, ratio * g], rtol=1e-15 * (10 + 1e3 * ratio))
        assert accepted.result.iterations < 20
