"""Columns beyond their Euler load: between walls, and along the bottom of a tube.

Static equilibria that are unstable without contact are reached by implicit Euler with steps so long that it damps all
motion, and a mass per length m with m/dt² = P²/2EI, twice what keeps A definite: the answer has no inertia left.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from validation.case import Parameter, Quantity, Run, case
from validation.cases.beams import beam_of, elements, planar, rod
from validation.cases.rods import midway
from validation.exact.elastica import ColumnElastica
from validation.exact.rods import ColumnWalls

Floats = NDArray[np.float64]
STEPS = 25


def _levels(parameters: dict[str, Parameter]) -> tuple[float, ...]:
    """The middle on a node in point contact, the ends s of line contact half way between two nodes."""
    exact = ColumnElastica(**parameters)  # type: ignore[arg-type]
    if exact.regime != "line":
        return elements(8, 16, 32, 64)(parameters)
    return midway(exact.s, exact.L, 48, 96)


@case(
    "column-walls",
    {"EI": 1.0, "L": 1.0, "P": 2 * np.pi**2, "d": 1e-3},
    levels=_levels,
    variants=({}, {"P": 6 * np.pi**2}, {"P": 25.0, "d": 0.05}, {"P": 45.0, "d": 0.05}),
    orders=(1,),
    rates={"force": {1: (4.0, 0.1)}},
)
def column_walls(run: Run) -> list[Quantity]:
    """A pinned column buckled by a dead load P between walls ±d, at any slope; the linear formula beside the elastica."""
    exact = ColumnElastica(**run.values("EI", "L", "P", "d"))
    EI, L, P, d = (run[k] for k in ("EI", "L", "P", "d"))
    inertia = P**2 / (2 * EI)
    push = {"kind": "line", "value": [0.0, f"{0.3 * d * inertia!r} * exp(-t)", 0.0]}
    load = {"kind": "point", "at": "end", "value": [-P, 0.0, 0.0]}
    supports = planar(run, {"at": "start", "hold": ["x", "y", "z"]}, {"at": "end", "hold": ["y", "z"]})
    beam = rod(run, d, section={"mass": inertia}, supports=supports, loads=[load, push])
    walls = [
        {"body": "beam", "samples": 1, "surface": {"kind": "plane", "point": [0.0, -2 * n * d, 0.0], "normal": [0.0, n, 0.0]}}
        for n in (-1.0, 1.0)
    ]
    time = {"end": float(STEPS), "steps": STEPS, "integrator": "implicit-euler"}
    solver = {"surface_error": 1e-6, "penetration": 1e-6}
    solved = run.march(lambda *_: None, body=[beam], contact=walls, solver=solver, time=time)
    body, lam = beam_of(solved.system), solved.forces(0)
    x = body.start[:, 0]
    s = float(lam @ np.minimum(x, L - x) / lam.sum())
    EA = body.data.axial[0, 0] * body.data.length[0]
    angle = np.arctan2(body.R[0, 1, 0], body.R[0, 0, 0])
    shortening = L - body.x[-1, 0] - P * L / EA
    limit = (1e-3 if d <= 1e-3 * L else 2e-3) * max(1.0, 32 * run.h / exact.s) ** 2
    linear = ColumnWalls(EI=EI, L=L, P=P, d=d)
    # Of the linear formula there is an error of the square of slopes, (πd/L)².
    apart = limit + 8 * (d / L) ** 2 * np.pi**2
    return [
        Quantity("force", lam.sum() + solved.forces(1).sum(), exact.force, limit),
        Quantity("reaction", lam.sum() / (2 if exact.regime == "line" else 1), exact.reaction, limit),
        Quantity("pin_force", abs(body.reactions()[0, 1]), exact.pin_force, limit),
        Quantity("s", s, exact.s, limit),
        Quantity("shortening", shortening, exact.shortening, limit),
        Quantity("end_angle", angle, exact.end_angle, limit),
        Quantity("linear_force", lam.sum(), linear.force, apart),
        Quantity("linear_shortening", shortening, linear.shortening, apart),
    ]
