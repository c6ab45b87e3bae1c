"""The cases of beams at coarse levels: errors, rates, printed numbers, and other parameters than the catalogue's."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from test_cases import solve, within

from validation.case import CASES, fitted_rate
from validation.cases.beams import beam_of
from validation.exact.elastica import ColumnElastica

# (case, elements over L or h, parameters, bounds). Line contact errs by up to 2 (h/s)², point contact by (h/s)⁴/100.
LEVELS: list[tuple[str, float, dict[str, Any], dict[str, float]]] = [
    ("circle", 1 / 20, {}, {"gap": 1e-9, "diameter": 2e-5, "tip_angle": 1e-9}),
    ("circle", 0.1, {"EI": 3.0, "L": 2.0}, {"gap": 1e-9, "diameter": 2e-5, "clamp_moment": 1e-9}),
    ("bend-45", np.pi * 25 / 32, {"P": 600.0}, {"tip_x": 1e-4, "tip_y": 1e-4, "tip_z": 1e-4}),
    ("elastica-tip", 0.1, {}, {"tip_x": 5e-5, "tip_y": 5e-5, "tip_angle": 5e-5, "clamp_moment": 5e-5}),
    ("elastica-tip", 0.1, {"omega": 2.5, "EI": 2.0}, {"tip_deviation": 1e-4, "tip_angle": 1e-4}),
    ("elastica-tip", 0.2, {"L": 2.0, "P": 2.5}, {"tip_deviation": 5e-5}),
    ("euler-load", 1 / 8, {}, {"P": 3e-4}),
    ("euler-load", 1 / 16, {"ends": "clamped", "EI": 5.0}, {"P": 3e-4}),
    ("cantilever-floor", 1 / 28, {}, {"force": 1e-3, "reaction": 1e-3, "s": 1e-3, "clamp_moment": 1e-3}),
    ("cantilever-floor", 1 / 28, {"EI": 7.0, "q": 7.0}, {"force": 1e-3, "reaction": 1e-3, "deflection": 1e-3}),
    ("cantilever-floor", 1 / 8, {"q": 0.05}, {"force": 2e-6, "clamp_force": 2e-6, "deflection": 2e-6, "s": 1e-12}),
    ("heavy-beam", 1 / 49, {}, {"force": 1e-3, "lift_force": 1e-3, "s": 1e-3, "height": 1e-3}),
    ("beam-stop", 1 / 49, {}, {"force": 1e-3, "support_force": 1e-3, "s": 1e-3, "deflection": 1e-3}),
    ("beam-stop", 1 / 8, {"q": 0.2}, {"force": 1e-5, "support_force": 1e-5, "deflection": 1e-5}),
    ("column-walls", 1 / 16, {}, {"force": 1e-4, "pin_force": 1e-4, "shortening": 1e-4, "linear_force": 1e-4}),
    ("column-walls", 1 / 16, {"P": 25.0, "d": 0.05}, {"force": 1e-4, "shortening": 1e-4, "end_angle": 1e-5}),
    ("column-walls", 1 / 60, {"P": 6 * np.pi**2}, {"reaction": 1e-3, "shortening": 1e-3, "linear_shortening": 1e-3}),
    ("dawson-paslay", 5.299942 / 24, {}, {"P": 1e-3, "n": 0.0}),
    ("dawson-paslay", 4.0 / 24, {"L": 4.0, "r": 0.2, "w": 2.0}, {"P": 2e-3, "n": 0.0}),
    ("wire-tube", 0.3 / 61, {}, {"tip_force": 1e-3, "inner_force": 1e-3, "s": 1e-3, "middle_curvature": 1e-3}),
    ("wire-tube", 0.2 / 8, {"L": 0.2}, {"tip_force": 1e-5, "force": 1e-5, "middle_curvature": 2e-3}),
    ("wire-tube", 0.5 / 16, {"L": 0.5, "c": 0.01}, {"tip_force": 1e-5, "middle_curvature": 1e-3}),
    ("wire-tube", 0.1 / 47, {"L": 0.1, "c": 1e-4}, {"linear_tip_force": 2e-3}),
    ("helix-tube", 0.8, {}, {"f": 1e-3, "F": 1e-5, "beta": 1e-3}),
    ("helix-tube", 0.8, {"beta": 0.5, "EI": 3.0}, {"f": 5e-3, "F": 1e-4}),
    ("coil-tube", 0.2, {}, {"f": 5e-3, "beta": 1e-3}),
    ("spring-surface", 1.0, {}, {"reaction": 1e-10, "radius": 1e-10}),
    ("spring-surface", 1.0, {"k": 20.0, "d": 0.05}, {"reaction": 1e-10, "radius": 1e-10}),
]


@pytest.mark.parametrize(
    ("name", "h", "changes", "bounds"),
    LEVELS,
    ids=[" ".join([n, *(f"{k}={v:.4g}" if k != "ends" else v for k, v in c.items())]) for n, _, c, _ in LEVELS],
)
def test_coarse(name: str, h: float, changes: dict[str, Any], bounds: dict[str, float]) -> None:
    """Errors at a coarse level."""
    within(solve(name, h, **changes)[1], bounds)


@pytest.mark.parametrize(
    ("name", "changes", "quantity", "rate"),
    [
        ("circle", {}, "diameter", 4),
        ("elastica-tip", {}, "tip_deviation", 4),
        ("cantilever-floor", {}, "force", 2),
        ("heavy-beam", {}, "force", 2),
        ("beam-stop", {}, "force", 2),
        ("column-walls", {}, "force", 4),
        ("column-walls", {"P": 6 * np.pi**2}, "end_angle", 2),
        ("helix-tube", {}, "f", 4),
        ("coil-tube", {}, "f", 2),
    ],
)
def test_rates(name: str, changes: dict[str, Any], quantity: str, rate: float) -> None:
    """Fitted over the default levels."""
    case = CASES[name]
    sizes = case.sizes(case.configure(changes))
    errors = [solve(name, h, **changes)[1][quantity].error for h in sizes]
    assert fitted_rate(list(sizes), errors) == pytest.approx(rate, abs=0.3)


@pytest.mark.parametrize(
    ("name", "h", "changes", "printed"),
    [
        ("cantilever-floor", 1 / 28, {}, {"s": 0.5180040, "reaction": 0.1726680, "force": 0.6546640}),
        ("column-walls", 1 / 8, {}, {"linear_force": 0.0496159, "linear_shortening": 2.566635e-6}),
        ("column-walls", 1 / 40, {"P": 6 * np.pi**2}, {"s": 0.408248, "linear_force": 2 * 0.145053}),
        ("column-walls", 1 / 8, {"P": 25.0, "d": 0.05}, {"reaction": 3.874906, "shortening": 0.006633738}),
        ("wire-tube", 0.2 / 8, {"L": 0.2}, {"tip_force": 9.027276}),
        ("wire-tube", 0.3 / 40, {}, {"linear_tip_force": 9.128709}),
        ("wire-tube", 0.5 / 8, {"L": 0.5, "c": 0.01}, {"tip_force": 2.222957}),
        ("helix-tube", 1.2, {}, {"F": 0.2198463, "f": 0.0136838}),
        ("coil-tube", 0.4, {}, {"f": 0.2217587, "beta": np.radians(64.8563)}),
        ("dawson-paslay", 5.299942 / 12, {}, {"P": 6.324555}),
        ("spring-surface", 1.0, {}, {"radius": 0.2963460, "reaction": 0.1}),
    ],
)
def test_printed_numbers(name: str, h: float, changes: dict[str, Any], printed: dict[str, float]) -> None:
    """The exact values are those that the catalogue prints, to the digits that it prints."""
    _, found = solve(name, h, **changes)
    for quantity, value in printed.items():
        assert found[quantity].exact == pytest.approx(value, rel=5e-6)


@pytest.mark.parametrize(("d", "printed"), [(0.05, 39.32908), (0.1, 38.86474)])
def test_line_contact_of_a_column_begins(d: float, printed: float) -> None:
    """The moment in the middle, P d − V x, carried on from two loads in point contact, vanishes at the elastica's load.

    V is the mean of both pins': the antisymmetric mode is soft there and has not come to rest.
    """
    loads, moments = np.array([0.98, 0.99]) * printed, []
    for P in loads:
        run, found = solve("column-walls", 1 / 24, P=float(P), d=d)
        assert run.solved is not None
        x, y, _ = beam_of(run.solved.system).x[12]
        moments.append(P * y - found["force"].computed / 2 * x)
    slope = (moments[1] - moments[0]) / (loads[1] - loads[0])
    assert loads[1] - moments[1] / slope == pytest.approx(printed, rel=1e-3)
    assert ColumnElastica(EI=1.0, L=1.0, P=30.0, d=d).line_contact_load == pytest.approx(printed, rel=2e-7)


def test_reactions() -> None:
    """The clamp of a straight cantilever carries the tip force and its moment."""
    run, _ = solve("elastica-tip", 1 / 4, P=1e-4)
    assert run.solved is not None
    reactions = beam_of(run.solved.system).reactions()
    assert reactions[0, [1, 5]] == pytest.approx([-1e-4, -1e-4], rel=1e-7)
    assert not reactions[1:, [0, 1, 5]].any()
