"""Plane strain in a finite box with the exact field on its sides: no error but that of the discretisation."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from validation.case import Quantity, Run, case
from validation.exact.half_plane import HalfPlane
from validation.exact.hertz_line import HertzLine
from validation.exact.punches import Wedge
from validation.exact.transition import Transition
from validation.measure import contact_width, h1_error, pressure_at_pole

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
    {"E": 1.0, "nu": 0.3, "R": 1.0, "a": 0.3, "constraint": "nodal"},
    levels=(1 / 80,),
    orders=(1, 2),
    variants=({}, {"a": 0.2953}, {"a": 0.3047}),
)
def hertz_line(run: Run) -> list[Quantity]:
    """Hertz's line contact with a parabola: force, pressure at the pole, half-width."""
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
