"""Elastic layers in plane strain: pressed by a parabola on a rigid base, and lifting off the base they lie on."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from validation.case import Quantity, Run, case
from validation.exact.layer import Layer
from validation.exact.receding import Receding
from validation.measure import contact_width, pressure_at_pole

Floats = NDArray[np.float64]


@case(
    "layer",
    {"E": 0.0, "nu": 0.3, "R": 1.0, "H": 1.0, "a": 0.5, "delta": 0.0, "base": "frictionless", "constraint": "nodal"},
    levels=(1 / 40,),
    variants=({}, {"base": "bonded"}),
)
def layer(run: Run) -> list[Quantity]:
    """A layer pressed by a parabola to half-width `a` or, where given, by approach `delta`; E = 0 is 1 − ν²."""
    E = run["E"] or 1 - run["nu"] ** 2
    known = {"E": E, **run.values("nu", "R", "H", "base")}
    exact = Layer.from_delta(**known, delta=run["delta"]) if run["delta"] else Layer(**known, a=run["a"])
    H, a = run["H"], exact.a
    # The layer's stresses die out over a few thicknesses; ten leave less than the discretisation error.
    width = a + 10 * H
    h = run.h * min(1.0, 2 * a / H)  # a narrow contact wants as many cells as a wide one
    cells = [max(8, round((a + 3 * H) / h)), max(4, round(H / h))]

    supports = [{"tag": "axis", "component": "x"}, {"tag": "bottom", "component": "y"}]
    if run["base"] == "bonded":
        supports = [{"tag": "axis", "component": "x"}, {"tag": "bottom"}]
    solved = run.solve(
        body=[
            {
                "name": "layer",
                "mesh": {
                    "shape": "layer",
                    "width": width,
                    "thickness": H,
                    "n": cells,
                    "order": run.order,
                    "structured": True,
                    "grading": [_fine_at_pole, 1.0],
                },
                "material": {"E": E, "nu": run["nu"], "state": "plane-strain"},
                "supports": supports,
            }
        ],
        contact=[
            {
                "body": "layer",
                "tag": "top",
                "surface": {"kind": "paraboloid", "origin": [0.0, -exact.delta], "radius": run["R"], "downward": True},
                "direction": [0.0, -1.0],
                "constraint": run["constraint"],
                "interference": exact.delta,
            }
        ],
    )
    lam, x, areas = solved.forces(), solved.places()[:, 0], solved.result.linearisation.constraints[0].areas
    p0 = lam[np.argmin(x)] / areas[np.argmin(x)]
    if run["constraint"] == "nodal":
        p0 = pressure_at_pole(solved.system.bodies[0], "top", solved.places(), lam, 0.5 * a)
    return [
        Quantity("force", 2 * lam.sum(), exact.P, 1e-3),
        Quantity("p0", p0, exact.p0, 1e-3),
        Quantity("half_width", contact_width(solved.points(), lam, 4), a, 1e-3),
    ]


@case(
    "receding",
    {"E": 1.0, "nu": 0.3, "H": 1.0, "P": 1.0, "b": 0.0, "constraint": "nodal"},
    levels=(1 / 40,),
)
def receding(run: Run) -> list[Quantity]:
    """A layer that lies on a plane and is pressed by a strip load of half-width bH: it lifts off beyond a, whatever P.

    Nothing but contact holds it vertically.
    """
    exact = Receding(**run.values("b", "H", "P"))
    H, P, b = run["H"], run["P"], run["b"] * run["H"]
    width = exact.a + 3 * H
    cells = [max(8, round(width / run.h)), max(4, round(H / run.h))]
    grading: object = [_fine_at_pole, 1.0]
    strip = width * float(_fine_at_pole(np.array(1 / cells[0])))  # a line load acts on the first cell
    if b > 0:
        # A node stands at the end of the strip.
        inside = max(1, round(b / run.h))
        width, grading, strip = cells[0] * b / inside, None, b
    solved = run.solve(
        body=[
            {
                "name": "layer",
                "mesh": {
                    "shape": "layer",
                    "width": width,
                    "thickness": H,
                    "n": cells,
                    "order": run.order,
                    "structured": True,
                    "grading": grading,
                },
                "material": {**run.values("E", "nu"), "state": "plane-strain"},
                "supports": [{"tag": "axis", "component": "x"}],
                "loads": [{"kind": "traction", "tag": "top", "value": lambda x, t: _strip(x, strip, P)}],
            }
        ],
        contact=[
            {
                "body": "layer",
                "tag": "bottom",
                "surface": {"kind": "plane", "point": [0.0, -H], "normal": [0.0, 1.0]},
                "constraint": run["constraint"],
            }
        ],
    )
    lam, x, areas = solved.forces(), solved.places()[:, 0], solved.result.linearisation.constraints[0].areas
    pole = np.argmin(x)
    return [
        Quantity("a_over_H", contact_width(solved.points(), lam, 5) / H, exact.a / H, 1e-3),
        Quantity("p0_H_over_P", lam[pole] / areas[pole] * H / P, exact.p0 * H / P, 1e-3),
        Quantity("force", 2 * lam.sum(), P, 1e-10),
    ]


def _fine_at_pole(s: Floats) -> Floats:
    """A map of [0, 1] onto itself with cells a quarter as long at 0 as on average."""
    s = np.asarray(s)
    return (s + 3 * s**4) / 4


def _strip(x: Floats, b: float, P: float) -> Floats:
    """The traction of a strip load of half-width b and force P."""
    return np.stack([np.zeros(len(x)), np.where(x[:, 0] < b, -P / (2 * b), 0.0)], axis=1)
