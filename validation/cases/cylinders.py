"""Cores in tubes and shells, rigid or elastic, and a pin in a hole: on curved second-order cells."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from validation.case import Quantity, Run, Solved, case
from validation.cases.interfaces import fine_above, fine_below
from validation.exact.cylinders import BallShell, Plug, ShrinkFit
from validation.exact.pin_hole import PinHole
from validation.measure import l2_error, multiplier_at_pole, pressure_error, pressure_width, unbalanced

Floats = NDArray[np.float64]
QUARTER = [{"tag": "start", "component": "y"}, {"tag": "end", "component": "x"}]


@case(
    "plug",
    {"E": 1.0, "nu": 0.3, "b": 2.0, "c": 3.0, "delta": 0.1, "constraint": "mortar", "E1": 0.0, "nu1": 0.3},
    levels=(1 / 8,),
    variants=({}, {"nu": 0.49}, {"nu": 0.4999}, {"E1": 2.0}, {"E1": 2.0, "nu": 0.4999, "nu1": 0.4999}),
)
def plug(run: Run) -> list[Quantity]:
    """A cylinder oversized by δ in a tube b < r < c, plane strain: pressure, free of locking up to ν = .4999.

    It is rigid, or of E1 and nu1 where E1 is given.
    """
    b, c, delta = run["b"], run["c"], run["delta"]
    exact = Plug(**run.values("E", "nu", "b", "c", "delta"), **_core(run))
    tube = _part(run, "tube", {"shape": "ring", "inner": b, "outer": c}, run["E"], run["nu"], QUARTER)
    if run["E1"] == 0:
        return _pressures(run.solve(body=[tube], contact=[_on_rigid_core(run, "tube")]), exact.p)
    core = _part(run, "core", {"shape": "ring", "inner": 0.0, "outer": b}, run["E1"], run["nu1"], QUARTER)
    solved = run.solve(body=[tube, core], contact=[_press_fit("core", "tube", delta)])
    return _pressures(solved, exact.p, exact.displacement, exact.displacement_core)


@case(
    "ball-shell",
    {"E": 1.0, "nu": 0.3, "b": 1.0, "c": 2.0, "delta": 0.01, "constraint": "mortar", "E1": 0.0, "nu1": 0.3},
    levels=(1 / 16,),
    variants=({}, {"E1": 2.0}),
)
def ball_shell(run: Run) -> list[Quantity]:
    """A ball oversized by δ in a shell b < r < c, by its axisymmetric section: pressure.

    It is rigid, or of E1 and nu1 where E1 is given.
    """
    b, c, delta = run["b"], run["c"], run["delta"]
    exact = BallShell(**run.values("E", "nu", "b", "c", "delta"), **_core(run))
    held = [{"tag": "axis", "component": "r"}, {"tag": "equator", "component": "z"}]
    section = {"shape": "shell-section"}
    shell = _part(run, "shell", {**section, "inner": b, "outer": c}, run["E"], run["nu"], held, "axisymmetric")
    if run["E1"] == 0:
        return _pressures(run.solve(body=[shell], contact=[_on_rigid_core(run, "shell")]), exact.p)
    core = _part(run, "core", {**section, "inner": 0.0, "outer": b}, run["E1"], run["nu1"], held, "axisymmetric")
    solved = run.solve(body=[shell, core], contact=[_press_fit("core", "shell", delta)])
    return _pressures(solved, exact.p, exact.displacement, exact.displacement_core)


@case(
    "shrink-fit",
    {"E1": 1000.0, "nu1": 0.3, "E2": 1000.0, "nu2": 0.3, "a": 1.0, "b": 2.0, "c": 3.0, "delta": 0.002},
    levels=(1 / 4, 1 / 8, 1 / 16),
    variants=({}, {"E1": 1e6}),
    rates={"pressure": {2: (4.0, 0.3)}},
)
def shrink_fit(run: Run) -> list[Quantity]:
    """A tube a < r < b oversized by δ in a tube b < r < c, plane strain: pressure, displacements.

    The rate is that of circles by parabolas.
    """
    exact = ShrinkFit(**run.values("E1", "nu1", "E2", "nu2", "a", "b", "c", "delta"))
    a, b, c = run["a"], run["b"], run["c"]
    outer = _part(run, "outer", {"shape": "ring", "inner": b, "outer": c}, run["E2"], run["nu2"], QUARTER)
    inner = _part(run, "inner", {"shape": "ring", "inner": a, "outer": b}, run["E1"], run["nu1"], QUARTER)
    solved = run.solve(body=[outer, inner], contact=[_press_fit("inner", "outer", run["delta"])])
    return _pressures(solved, exact.p, exact.displacement_outer, exact.displacement_inner)


def _core(run: Run) -> dict[str, float]:
    """The elastic core's parameters, none of a rigid one."""
    return run.values("E1", "nu1") if run["E1"] != 0 else {}


def _part(
    run: Run, name: str, shape: dict[str, Any], E: float, nu: float, held: Any, state: str = "plane-strain"
) -> dict[str, Any]:
    """A body; in plane strain by the mixed formulation, which does not lock. Cells of inner bodies are 2/3 of h."""
    material = {"E": E, "nu": nu, "state": state, "formulation": "mixed" if state == "plane-strain" else "displacement"}
    return {
        "name": name,
        "mesh": {**shape, "h": run.h / 1.5 if name in ("core", "inner") else run.h, "order": run.order},
        "material": material,
        "supports": held,
    }


def _on_rigid_core(run: Run, body: str) -> dict[str, Any]:
    """The contact of a bore with an oversized rigid core."""
    surface = {"kind": "sphere", "centre": [0.0, 0.0], "radius": run["b"] + run["delta"]}
    interference = 1.1 * run["delta"]
    return {
        "body": body,
        "tag": "inner",
        "surface": surface,
        "interference": interference,
        "constraint": run["constraint"],
    }


def _press_fit(inner: str, outer: str, delta: float) -> dict[str, Any]:
    """The contact of two parts that are drawn at their common radius and overlap by δ."""
    surface = {"kind": "body", "body": outer, "tag": "inner"}
    return {"body": inner, "tag": "outer", "surface": surface, "clearance": -delta, "interference": 1.1 * delta}


def _pressures(solved: Solved, exact: float, *fields: Callable[[Floats], Floats]) -> list[Quantity]:
    """The mean pressure and how far it is from uniform; with two bodies' exact `fields` also those and the balance."""
    lam, constraints = solved.forces(), solved.result.linearisation.constraints[0]
    areas = constraints.areas
    seen = areas > 1e-3 * areas.max()  # a second-order node on the axis has next to none
    quantities = [
        Quantity("pressure", lam.sum() / areas.sum(), exact, 1e-3),
        Quantity("pressure_spread", float(np.abs(lam[seen] / areas[seen] - exact).max()) / exact, 0.0, 1e-2),
    ]
    if fields:
        quantities.append(Quantity("displacement_error", l2_error(solved.system.bodies, fields), 0.0, 1e-3))
        quantities.append(Quantity("unbalanced", unbalanced(constraints.H, lam), 0.0, 1e-12))
    return quantities


@case(
    "pin-hole",
    {"E": 1.0, "nu": 0.3, "R": 1.0, "delta": 0.01, "eps": 30.0, "multiplier": "vertex", "side": "auto"},
    levels=(1 / 80,),
    variants=({}, {"eps": 60.0}),
)
def pin_hole(run: Run) -> list[Quantity]:
    """Persson's pin in a hole larger by δ, plane stress: force for a contact angle `eps` [degrees], and that angle.

    Half of the plate R < r < 3R and of the pin R/2 < r < R, with the exact motion of their far sides; both are drawn at
    R, and δ(1 − cos θ) is their initial clearance. h is given for R = 1, at θ = 0; the pin's cells are 4/5 of that.
    """
    R, delta = run["R"], run["delta"]
    exact = PinHole(**run.values("E", "nu", "R", "delta", "eps"))

    def clearance(x: Floats, t: float) -> Floats:
        gap: Floats = delta * (1 - x[:, 0] / np.hypot(x[:, 0], x[:, 1]))
        return gap

    solved = run.solve(
        body=[
            _half_ring(run, "plate", (R, 3 * R), run.h, "outer", exact.displacement_plate, fine_below),
            _half_ring(run, "pin", (R / 2, R), run.h / 1.25, "inner", exact.displacement_pin, fine_above),
        ],
        contact=[
            {
                "body": "pin",
                "tag": "outer",
                "surface": {"kind": "body", "body": "plate", "tag": "inner"},
                "clearance": clearance,
                "interference": delta * run.h**2,
                **run.values("multiplier", "side"),
            }
        ],
    )
    constraints, lam = solved.result.linearisation.constraints[0], solved.forces()
    theta, p = np.arctan2(constraints.places[:, 1], constraints.places[:, 0]), lam / constraints.areas
    Q = 2 * abs(solved.resultant()[0])
    return [
        Quantity("E_delta_over_Q", run["E"] * delta / Q, exact.ratio, 1e-3),
        Quantity("eps", float(np.rad2deg(pressure_width(theta, p, terms=4))), run["eps"], 1e-2),
        Quantity("p0", multiplier_at_pole(theta, p, 0.5 * exact.angle), exact.p0, 1e-3),
        Quantity("pressure_error", pressure_error(theta, p, exact.pressure, exact.angle), 0.0, 2e-2),
        Quantity("unbalanced", unbalanced(constraints.H, lam), 0.0, 1e-12),
    ]


def _half_ring(
    run: Run,
    name: str,
    radii: tuple[float, float],
    h: float,
    far: str,
    field: Callable[[Floats], Floats],
    grading: Callable[[Floats], Floats],
) -> dict[str, Any]:
    """The half y > 0 of a ring whose side `far` moves as the exact field does; fine at θ = 0 and on its other side."""
    n = [max(2, round(0.25 * (radii[1] - radii[0]) / run["R"] / h)), max(4, round(3 / 8 * np.pi / h))]
    return {
        "name": name,
        "mesh": {
            "shape": "ring",
            "inner": radii[0],
            "outer": radii[1],
            "angle": 180.0,
            "n": n,
            "order": run.order,
            "structured": True,
            "grading": [grading, fine_below],
        },
        "material": {**run.values("E", "nu"), "state": "plane-stress"},
        "supports": [
            *({"tag": tag, "component": "y"} for tag in ("start", "end")),
            {"tag": far, "value": lambda x, t: field(x)},
        ],
    }
