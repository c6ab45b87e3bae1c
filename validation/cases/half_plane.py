"""Plane strain in a finite box with the exact field on its sides: no error but that of the discretisation."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from validation.case import Quantity, Run, case
from validation.cases.interfaces import PAIR, fine_above, fine_below, half_box, inside_the_box, interface, two_bodies
from validation.exact.half_plane import HalfPlane
from validation.exact.hertz_line import HertzLine
from validation.exact.punches import Wedge
from validation.exact.transition import Transition
from validation.exact.two_bodies import TwoBodies, below
from validation.exact.wavy import Wavy
from validation.measure import (
    contact_width,
    displacement_at,
    h1_error,
    l2_error,
    multiplier_at_pole,
    pressure_at_pole,
    pressure_error,
    pressure_width,
    unbalanced,
)

Floats = NDArray[np.float64]


def _elastic(run: Run) -> dict[str, object]:
    return {**run.values("E", "nu"), "state": "plane-strain"}


def _half_model(run: Run, exact: HalfPlane, surface: dict[str, object]) -> dict[str, object]:
    """The unit box, symmetric about x = 0, pressed on the obstacle below by the exact motion of its sides."""

    def field(x: Floats, t: float) -> Floats:
        return exact.displacement(x)

    body = {
        "name": "body",
        "mesh": {"shape": "box", "size": [1.0, 1.0], "h": run.h, "order": run.order, "structured": True},
        "material": _elastic(run),
        "supports": [
            {"tag": "left", "component": "x"},
            {"tag": "right", "value": field},
            {"tag": "top", "value": field},
        ],
    }
    contact = {
        "body": "body",
        "tag": "bottom",
        "surface": surface,
        "constraint": run["constraint"],
        "direction": [0.0, 1.0],
    }
    return {"body": [body], "contact": [contact]}


@case(
    "transition",
    {"E": 1.0, "nu": 0.3, "C": 1.0, "x0": np.pi / 30, "constraint": "nodal"},
    levels=(1 / 8, 1 / 16, 1 / 32, 1 / 64, 1 / 128),
    orders=(1, 2),
    rates={"h1_error": {1: (1.0, 0.05), 2: (1.5, 0.15)}},
)
def transition(run: Run) -> list[Quantity]:
    """Contact that begins at x₀ inside the box: the r^{3/2} singularity of every frictionless contact's edge."""
    exact = Transition(**run.values("E", "nu", "C", "x0"))

    def field(x: Floats, t: float) -> Floats:
        return exact.displacement(x)

    def traction(x: Floats, t: float) -> Floats:
        xx, _, xy = exact.stress(x).T
        return np.stack([xx, xy], axis=1)

    solved = run.solve(
        body=[
            {
                "name": "body",
                "mesh": {
                    "shape": "box",
                    "size": [2.0, 1.0],
                    "origin": [-1.0, 0.0],
                    "h": run.h,
                    "order": run.order,
                    "structured": True,
                },
                "material": _elastic(run),
                "supports": [{"tag": "left", "value": field}, {"tag": "top", "value": field}],
                # Contact runs into this side: with its traction given, the corner's contact force stays a multiplier.
                "loads": [{"kind": "traction", "tag": "right", "value": traction}],
            }
        ],
        contact=[
            {
                "body": "body",
                "tag": "bottom",
                "surface": {"kind": "plane", "point": [0.0, 0.0], "normal": [0.0, 1.0]},
                "constraint": run["constraint"],
            }
        ],
    )
    norm = exact.h1_seminorm(-1.0, 1.0, 1.0)
    error, computed_norm = h1_error(solved.system.bodies[0], exact.displacement_gradient)
    at_64 = {(1, "nodal"): 5.9e-3, (1, "mortar"): 8e-3, (2, "nodal"): 1.6e-4, (2, "mortar"): 2.5e-4}
    limit = at_64[run.order, run["constraint"]] * (64 * run.h) ** (1.0 if run.order == 1 else 1.5)
    return [
        Quantity("h1_error", error / norm, 0.0, limit),
        Quantity("h1_seminorm", computed_norm, norm, limit),
        Quantity("force", solved.forces().sum(), exact.force(1.0), limit),
    ]


@case(
    "hertz-line",
    {"E": 1.0, "nu": 0.3, "R": 1.0, "a": 0.3, "constraint": "nodal", **PAIR},
    levels=(1 / 80,),
    orders=(1, 2),
    variants=({}, {"a": 0.2953}, {"a": 0.3047}, *({"E1": ratio, "E2": 1.0} for ratio in (1.0, 10.0, 1e3, 1e6))),
    rates=lambda p: {} if p["E1"] else {"h1_error": {1: (1.0, 0.1), 2: (1.5, 0.15)}},
)
def hertz_line(run: Run) -> list[Quantity]:
    """Hertz's line contact: a body (E, nu) on a rigid parabola, or where E1 and E2 are given two elastic bodies."""
    inside_the_box(run)
    if two_bodies(run):
        return _hertz_line_pair(run)
    exact = HertzLine(**run.values("E", "nu", "R", "a"))
    solved = run.solve(**_half_model(run, exact, {"kind": "paraboloid", "origin": [0.0, 0.0], "radius": run["R"]}))
    body, lam = solved.system.bodies[0], solved.forces()
    x, areas = solved.places(), solved.result.linearisation.constraints[0].areas
    if run["constraint"] == "mortar":
        p0 = float(lam[np.argmin(x[:, 0])] / areas[np.argmin(x[:, 0])])
    else:
        p0 = pressure_at_pole(body, "bottom", x, lam, 0.5 * run["a"])
    error, _ = h1_error(body, exact.displacement_gradient)
    coarse = 1.0 if run.order == 2 else 5.0
    return [
        Quantity("force", 2 * lam.sum(), exact.P, coarse * 2e-4),
        Quantity("p0", p0, exact.p0, coarse * 5e-4),
        Quantity("half_width", contact_width(solved.points(), lam), run["a"], 5e-3),
        Quantity("h1_error", error / exact.h1_seminorm(0.0, 1.0, 1.0), 0.0, 2e-3 if run.order == 2 else 3e-2),
    ]


def _hertz_line_pair(run: Run) -> list[Quantity]:
    """Half of two unit boxes with cells of size h and 4h/5, each moved on its far sides as its half-plane moves.

    The parabola is the initial clearance of two plane faces; each body's field has its share of it.
    """
    pair = TwoBodies(**run.values("E1", "nu1", "E2", "nu2"))
    halves = [
        HertzLine(E=run[f"E{i}"], nu=run[f"nu{i}"], a=run["a"], R=run["R"] / share)
        for i, share in enumerate(pair.shares, 1)
    ]
    R = run["R"]
    solved = run.solve(
        body=[
            half_box(run, "upper", run.h, halves[0].displacement, "plane-strain", "x"),
            half_box(run, "lower", run.h / 1.25, below(halves[1].displacement), "plane-strain", "x"),
        ],
        contact=[interface(run, lambda x, t: x[:, 0] ** 2 / (2 * R), 1 / R)],
    )
    constraints, lam = solved.result.linearisation.constraints[0], solved.forces()
    coarse = 1.0 if run.order == 2 else 5.0
    x, p = constraints.places[:, 0], lam / constraints.areas
    return [
        Quantity("force", 2 * lam.sum(), halves[0].P, coarse * 2e-4),
        Quantity("p0", multiplier_at_pole(x, p, 0.5 * run["a"]), halves[0].p0, coarse * 5e-4),
        Quantity("half_width", pressure_width(x, p), run["a"], 5e-3),
        Quantity("pressure_error", pressure_error(x, p, halves[0].pressure, run["a"]), 0.0, 2e-2),
        Quantity("unbalanced", unbalanced(constraints.H, lam), 0.0, 1e-12),
    ]


@case(
    "wavy",
    {
        "E1": 2.0, "nu1": 0.3, "E2": 2.0, "nu2": 0.3, "wavelength": 1.0, "amplitude": 0.01, "a": 0.3, "H": 2.0,
        "multiplier": "vertex", "side": "auto",
    },
    levels=(1 / 20, 1 / 40, 1 / 80),
    studied=({"H": 3.0},),
    study=(1 / 20, 1 / 40, 1 / 80, 1 / 160),
    rates={"pressure_error": {2: (1.0, 0.1)}, "displacement_error": {2: (2.0, 0.1)}},
)  # fmt: skip
def wavy(run: Run) -> list[Quantity]:
    """Westergaard's waves: two free bodies pressed together, half a period of them, H high.

    The waves Δ(1 − cos 2πx/λ) are the initial clearance of two plane faces; h and H are given for λ = 1. The lower
    body's cells are 2h/3 long and carry the multipliers. At H = 2 the exact stress on the far sides is uniform to 6e-5.
    """
    pair = TwoBodies(**run.values("E1", "nu1", "E2", "nu2"))
    period, amplitude = run["wavelength"], run["amplitude"]
    halves = [
        Wavy(E=run[f"E{i}"], nu=run[f"nu{i}"], wavelength=period, amplitude=amplitude * share, a=run["a"])
        for i, share in enumerate(pair.shares, 1)
    ]

    def waves(x: Floats, t: float) -> Floats:
        gap: Floats = amplitude * (1 - np.cos(2 * np.pi * x[:, 0] / period))
        return gap

    solved = run.solve(
        body=[_tower(run, "upper", 1, run.h, halves[0].p_mean), _tower(run, "lower", 2, run.h / 1.5, halves[0].p_mean)],
        contact=[interface(run, waves, amplitude * (2 * np.pi / period) ** 2)],
    )
    constraints, lam = solved.result.linearisation.constraints[0], solved.forces()
    x, p = constraints.places[:, 0], lam / constraints.areas
    fields = halves[0].displacement, below(halves[1].displacement)
    edge = [period / 2, 0.0]
    apart = [displacement_at(body, edge)[1] for body in solved.system.bodies]
    coarse = 80 * run.h
    return [
        Quantity("mean_pressure", lam.sum() / constraints.areas.sum(), halves[0].p_mean, 1e-10),
        Quantity("p0", multiplier_at_pole(x, p, 0.5 * run["a"]), halves[0].p0, 1e-4 * coarse),
        Quantity("half_width", pressure_width(x, p, terms=4), run["a"], 5e-3 * coarse),
        Quantity("valley", 2 * amplitude + apart[0] - apart[1], sum(half.valley for half in halves), 5e-4 * coarse**2),
        Quantity("pressure_error", pressure_error(x, p, halves[0].pressure, run["a"]), 0.0, 5e-3 * coarse),
        Quantity("displacement_error", l2_error(solved.system.bodies, fields, free=1), 0.0, 3e-5 * coarse**2),
        Quantity("unbalanced", unbalanced(constraints.H, lam), 0.0, 1e-12),
    ]


def _tower(run: Run, name: str, number: int, h: float, pressure: float) -> dict[str, object]:
    """Half a period of a body, above or below y = 0, between rollers under a pressure on its far side."""
    upper, period = number == 1, run["wavelength"]
    height = run["H"] * period
    cells = [max(2, round(0.5 / h)), max(4, round(0.375 * run["H"] / h))]
    return {
        "name": name,
        "mesh": {
            "shape": "box", "size": [0.5 * period, height], "origin": [0.0, 0.0 if upper else -height], "n": cells,
            "order": run.order, "structured": True, "grading": [1.0, fine_below if upper else fine_above],
        },
        "material": {"E": run[f"E{number}"], "nu": run[f"nu{number}"], "state": "plane-strain"},
        "supports": [{"tag": tag, "component": "x"} for tag in ("left", "right")],
        "loads": [{"kind": "pressure", "tag": "top" if upper else "bottom", "value": pressure}],
    }  # fmt: skip


@case(
    "punch-wedge",
    {"E": 1.0, "nu": 0.3, "alpha": 0.1, "a": 0.3, "constraint": "nodal"},
    levels=(1 / 80,),
)
def punch_wedge(run: Run) -> list[Quantity]:
    """A wedge with faces inclined by α [rad]: force against half-width; the pressure is singular at its edge."""
    exact = Wedge(**run.values("E", "nu", "alpha", "a"))
    solved = run.solve(
        **_half_model(run, exact, {"kind": "cone", "origin": [0.0, 0.0], "slope": float(np.tan(run["alpha"]))})
    )
    return [Quantity("force", 2 * solved.forces().sum(), exact.P, 1e-3)]
