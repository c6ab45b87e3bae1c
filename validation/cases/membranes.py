"""Pure variational inequalities: a membrane or string over an obstacle."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from validation.case import Quantity, Run, Solved, case
from validation.exact.membranes import MembraneBall, MembraneDisc, String
from validation.measure import nodal_error

Floats = NDArray[np.float64]


@case("membrane-ball", {"R": 2.0}, levels=(4 / 64,), orders=(1,), n_to_h=lambda n: 4 / (n - 1))
def membrane_ball(run: Run) -> list[Quantity]:
    """A membrane on [−2, 2]² over a ball, with the exact u on its boundary; `--n` points a side."""
    exact = MembraneBall(R=run["R"])
    sides = ("left", "right", "bottom", "top")
    solved = run.solve(
        body=[
            {
                "name": "membrane",
                "kind": "membrane",
                "mesh": {
                    "shape": "box",
                    "size": [4.0, 4.0],
                    "origin": [-2.0, -2.0],
                    "n": round(4 / run.h),
                    "structured": True,
                },
                "material": {"T": 1.0},
                "supports": [{"tag": side, "value": lambda x, t: exact.displacement(x)} for side in sides],
            }
        ],
        contact=[
            {
                "body": "membrane",
                "tag": "surface",
                "surface": {"kind": "dome", "origin": [0.0, 0.0, 0.0], "radius": 1.0, "rim": 0.9},
                "direction": [0.0, 0.0, 1.0],
                "interference": 1.0,
            }
        ],
    )
    fine = (run.h * 64) ** 2
    return [
        Quantity("max_error", nodal_error(solved.system.bodies[0], exact.displacement), 0.0, 1e-4 * fine),
        Quantity("force", solved.forces().sum(), exact.force, 2e-3),
    ]


def _max_error(solved: Solved, exact: MembraneDisc) -> float:
    """The largest error at the nodes; the exact solution counts downwards."""
    return nodal_error(solved.system.bodies[0], lambda x: -exact.displacement(x))


@case("membrane-disc", {"R": 1.0, "f": 1.0, "d": 0.1}, levels=(1 / 24,), orders=(1,))
def membrane_disc(run: Run) -> list[Quantity]:
    """A round membrane under a load f over a flat obstacle at depth d: radius and force of the contact."""
    exact = MembraneDisc(**run.values("R", "f", "d"))
    solved = run.solve(
        body=[
            {
                "name": "membrane",
                "kind": "membrane",
                "mesh": {"shape": "disc", "radius": run["R"], "h": run.h, "order": run.order},
                "material": {"T": 1.0},
                "supports": [{"tag": "rim"}],
                "loads": [{"kind": "body", "value": -run["f"]}],
            }
        ],
        contact=[
            {
                "body": "membrane",
                "tag": "surface",
                "surface": {"kind": "plane", "point": [0.0, 0.0, -run["d"]], "normal": [0.0, 0.0, 1.0]},
            }
        ],
    )
    force = solved.forces().sum()
    return [
        Quantity("force", force, exact.force, 5e-3),
        Quantity("radius", float(np.sqrt(force / (np.pi * run["f"]))), exact.a, 5e-3),
        Quantity(
            "max_error", nodal_error(solved.system.bodies[0], lambda x: -exact.displacement(x)), 0.0, 0.1 * run.h**2
        ),
    ]


@case("string", {"L": 1.0, "f": 1.0, "d": 0.02}, levels=(1 / 200,), orders=(1,))
def string(run: Run) -> list[Quantity]:
    """A string under a load f over a floor at depth d: it lies down at a = √(2d/f) from its ends."""
    exact = String(**run.values("L", "f", "d"))
    solved = run.solve(
        body=[
            {
                "name": "string",
                "kind": "string",
                "mesh": {
                    "shape": "interval",
                    "length": run["L"],
                    "n": max(2, round(run["L"] / run.h)),
                    "order": run.order,
                },
                "material": {"T": 1.0},
                "supports": [{"tag": "start"}, {"tag": "end"}],
                "loads": [{"kind": "body", "value": -run["f"]}],
            }
        ],
        contact=[
            {
                "body": "string",
                "tag": "surface",
                "surface": {"kind": "plane", "point": [0.0, -run["d"]], "normal": [0.0, 1.0]},
            }
        ],
    )
    force = solved.forces().sum()
    return [
        Quantity("force", force, exact.force, 1e-3),
        Quantity("a", 0.5 * (run["L"] - force / run["f"]), exact.a, 1e-3),
        Quantity("max_error", nodal_error(solved.system.bodies[0], lambda x: -exact.displacement(x[:, 0])), 0.0, 1e-5),
    ]
