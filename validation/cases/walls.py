"""Vessel walls: layers of their own materials in an elastic surrounding."""

from __future__ import annotations

import numpy as np

from fem.geometry import map_facets
from validation.case import Quantity, Run, case
from validation.exact.layered_tube import LayeredTube


@case(
    "layered-tube",
    {
        "E1": 2.0,
        "nu1": 0.45,
        "E2": 1.0,
        "nu2": 0.3,
        "a": 1.0,
        "b": 1.12,
        "c": 1.2,
        "k": 0.5,
        "delta": 0.01,
        "formulation": "displacement",
    },
    levels=(0.24, 0.16, 0.12),
    variants=({}, {"nu1": 0.4999, "nu2": 0.499, "formulation": "mixed"}),
    rates={"pressure": {2: (4.0, 0.5)}},
)
def layered_tube(run: Run) -> list[Quantity]:
    """A rigid cylinder oversized by δ in a wall of two layers on springs k outside, in space: pressure, interface."""
    exact = LayeredTube(**run.values("E1", "nu1", "E2", "nu2", "a", "b", "c", "k"))
    a, b, c, delta = run["a"], run["b"], run["c"], run["delta"]
    mesh = {"shape": "tube-wall", "radius": a, "thickness": c - a, "media": (b - a) / (c - a), "length": 0.4 * a}
    media, adventitia = {"E": run["E1"], "nu": run["nu1"]}, {"E": run["E2"], "nu": run["nu2"]}
    material = {"state": "3d", "formulation": run["formulation"]}
    solved = run.solve(
        body=[
            {
                "name": "wall",
                "mesh": {**mesh, "h": run.h, "layers": max(2, round(0.48 * a / run.h)), "order": run.order},
                "material": {**material, "regions": {"media": media, "adventitia": adventitia}},
                "supports": [
                    {"tag": "inlet", "component": "z"},
                    {"tag": "outlet", "component": "z"},
                    {"tag": "outer", "stiffness": run["k"]},
                ],
            }
        ],
        contact=[
            {
                "body": "wall",
                "tag": "lumen",
                "surface": {"kind": "cylinder", "centre": [0.0] * 3, "axis": [0.0, 0.0, 1.0], "radius": a + delta},
                "interference": 1.1 * delta,
                "constraint": "mortar",
            }
        ],
    )
    p = exact.press_fit(delta)
    lam, areas = solved.forces(), solved.result.linearisation.constraints[0].areas
    body = solved.points().body
    # Nodes on a border are on several ranks, facets are not.
    outside = map_facets(body.points, body.facets("outer"), 4)
    u = np.einsum("qa,fad->fqd", outside.values, body.displacement[body.facets("outer")])
    moved = np.einsum("fq,fqd,fqd->", outside.weights, u, outside.normals)
    total, area = run.comm.allreduce(np.array([moved, outside.weights.sum()]))
    return [
        Quantity("pressure", lam.sum() / areas.sum(), p, 1e-3),
        Quantity("outer_displacement", total / area, float(exact.radial(c, p)), 1e-3),
    ]
