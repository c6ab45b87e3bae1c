"""Oversized rigid cores in tubes and shells: interference that the scene declares, on curved second-order cells."""

from __future__ import annotations

import numpy as np

from validation.case import Quantity, Run, case
from validation.exact.cylinders import BallShell, Plug


@case(
    "plug",
    {"E": 1.0, "nu": 0.3, "b": 2.0, "c": 3.0, "delta": 0.1, "constraint": "mortar"},
    levels=(1 / 8,),
    variants=({}, {"nu": 0.49}, {"nu": 0.4999}),
)
def plug(run: Run) -> list[Quantity]:
    """A rigid cylinder oversized by δ in a tube b < r < c, plane strain: pressure, free of locking up to ν = .4999."""
    exact = Plug(**run.values("E", "nu", "b", "c", "delta"))
    b, delta = run["b"], run["delta"]
    solved = run.solve(
        body=[
            {
                "name": "tube",
                "mesh": {"shape": "ring", "inner": b, "outer": run["c"], "h": run.h, "order": run.order},
                "material": {**run.values("E", "nu"), "state": "plane-strain", "formulation": "mixed"},
                "supports": [{"tag": "start", "component": "y"}, {"tag": "end", "component": "x"}],
            }
        ],
        contact=[
            {
                "body": "tube",
                "tag": "inner",
                "surface": {"kind": "sphere", "centre": [0.0, 0.0], "radius": b + delta},
                "interference": 1.1 * delta,
                "constraint": run["constraint"],
            }
        ],
    )
    lam, areas = solved.forces(), solved.result.linearisation.constraints[0].areas
    p = lam / areas
    return [
        Quantity("pressure", lam.sum() / areas.sum(), exact.p, 1e-3),
        Quantity("pressure_spread", float(np.abs(p - exact.p).max()) / exact.p, 0.0, 1e-2),
    ]


@case("ball-shell", {"E": 1.0, "nu": 0.3, "b": 1.0, "c": 2.0, "delta": 0.01, "constraint": "mortar"}, levels=(1 / 16,))
def ball_shell(run: Run) -> list[Quantity]:
    """A rigid ball oversized by δ in a shell b < r < c, by its axisymmetric section: pressure."""
    exact = BallShell(**run.values("E", "nu", "b", "c", "delta"))
    b, delta = run["b"], run["delta"]
    solved = run.solve(
        body=[
            {
                "name": "shell",
                "mesh": {"shape": "shell-section", "inner": b, "outer": run["c"], "h": run.h, "order": run.order},
                "material": {**run.values("E", "nu"), "state": "axisymmetric"},
                "supports": [{"tag": "axis", "component": "r"}, {"tag": "equator", "component": "z"}],
            }
        ],
        contact=[
            {
                "body": "shell",
                "tag": "inner",
                "surface": {"kind": "sphere", "centre": [0.0, 0.0], "radius": b + delta},
                "interference": 1.1 * delta,
                "constraint": run["constraint"],
            }
        ],
    )
    lam, areas = solved.forces(), solved.result.linearisation.constraints[0].areas
    return [Quantity("pressure", lam.sum() / areas.sum(), exact.p, 1e-3)]
