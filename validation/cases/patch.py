"""Uniform stress across the interface of two blocks whose meshes do not match."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from meshes.blocks import box
from meshes.mesh import Mesh
from validation.case import Quantity, Run, case
from validation.exact.patch import Patch
from validation.measure import nodal_error, unbalanced

Floats = NDArray[np.float64]
HEIGHT = 0.5  # of each block, on the unit square


@case(
    "patch",
    {
        "E1": 1.0, "nu1": 0.3, "E2": 2.0, "nu2": 0.2, "p": 0.01, "ratio": 2.5, "tilt": 0.0, "dim": "2d",
        "cells": "structured", "multiplier": "vertex", "side": "auto",
    },
    levels=lambda p: (1 / 10,) if p["dim"] == "3d" else (1 / 20,),
    orders=(1, 2),
    variants=(
        {}, {"ratio": 1.0}, {"ratio": 10.0}, {"ratio": 0.1}, {"ratio": 10.0, "side": "other"}, {"multiplier": "dual"},
        {"tilt": 20.0, "cells": "free"}, {"dim": "3d"}, {"dim": "3d", "ratio": 0.1}, {"dim": "3d", "ratio": 10.0},
        {"dim": "3d", "tilt": 20.0, "cells": "free"},
    ),
)  # fmt: skip
def patch(run: Run) -> list[Quantity]:
    """Two blocks pressed together by p: pressure and displacement to round-off, whatever the meshes.

    `h` is the size of the finer block's cells and `ratio` that of the lower block's over the upper's; `tilt` [degrees]
    inclines the interface, and p then acts on all sides (an inclined one without friction transmits nothing else).
    The lower block's `cells` are on a grid (structured) or not (free).
    """
    if run["cells"] not in ("structured", "free"):
        raise ValueError(f"patch: cells = {run['cells']}: must be structured or free")
    if run["ratio"] <= 0:
        raise ValueError(f"patch: ratio = {run['ratio']}: must be > 0")
    exact = Patch(**run.values("E1", "nu1", "E2", "nu2", "p", "tilt"), dim=_dim(run))
    upper, lower = run.h * max(1.0, 1 / run["ratio"]), run.h * max(1.0, run["ratio"])
    solved = run.solve(
        body=[
            _block(run, exact, "upper", 0.0, upper, exact.displacement_upper),
            _block(run, exact, "lower", -HEIGHT, lower, exact.displacement_lower),
        ],
        contact=[
            {
                "body": "upper",
                "tag": "bottom",
                "surface": {"kind": "body", "body": "lower", "tag": "top"},
                **run.values("multiplier", "side"),
            }
        ],
    )
    bodies, constraints, lam = solved.system.bodies, solved.result.linearisation.constraints[0], solved.forces()
    fields = exact.displacement_upper, exact.displacement_lower
    seen = constraints.areas > 0
    u = max(float(np.abs(body.displacement).max()) for body in bodies)
    off = max(nodal_error(body, field) for body, field in zip(bodies, fields, strict=True))
    return [
        Quantity("force", lam.sum(), exact.force, 1e-10),
        Quantity(
            "pressure_error", float(np.abs(lam[seen] / constraints.areas[seen] - exact.p).max()) / exact.p, 0, 1e-10
        ),
        Quantity("displacement_error", off / u, 0, 1e-10),
        Quantity("unbalanced", unbalanced(constraints.H, lam), 0, 1e-12),
    ]


def _dim(run: Run) -> int:
    if run["dim"] not in ("2d", "3d"):
        raise ValueError(f"patch: dim = {run['dim']}: must be 2d or 3d")
    return int(run["dim"][0])


def _block(
    run: Run, exact: Patch, name: str, bottom: float, h: float, field: Callable[[Floats], Floats]
) -> dict[str, Any]:
    """A block: the lower one is moved at its bottom; the upper one presses on it and is held along the interface."""
    number, d = ("1" if name == "upper" else "2"), exact.dim
    free = name == "lower" and run["cells"] == "free"
    grid: dict[str, Any] = {"h": h} if free else {"n": _cells(h, d), "structured": True}
    mesh = box([*[1.0] * (d - 1), HEIGHT], origin=[*[0.0] * (d - 1), bottom], order=run.order, **grid)
    sides = ["right", "back"][: d - 1]
    held = [{"tag": "bottom", "value": lambda x, t: field(x)}]
    pressed = ["left", "front"][: d - 1] + sides
    if name == "upper":
        held = [
            {"tag": tag, "component": "xy"[i], "value": lambda x, t, i=i: field(x)[:, i]}
            for i, tag in enumerate(["left", "front"][: d - 1])
        ]
        pressed = sides
    loads = [{"kind": "pressure", "tag": tag, "value": exact.side_pressure} for tag in pressed]
    return {
        "name": name,
        "mesh": _sheared(mesh, exact.slope),
        "material": {"E": run[f"E{number}"], "nu": run[f"nu{number}"], "state": "plane-strain" if d == 2 else "3d"},
        "supports": held,
        "loads": [*loads, {"kind": "pressure", "tag": "top", "value": exact.p}] if name == "upper" else loads,
    }


def _cells(h: float, dim: int) -> list[int]:
    """As many as give the size h on the interface, and at least two over the height."""
    return [max(1, round(1 / h))] * (dim - 1) + [max(2, round(HEIGHT / h) if dim == 2 else 2)]


def _sheared(mesh: Mesh, slope: float) -> Mesh:
    """The last coordinate + slope × x."""
    points = mesh.points.copy()
    points[:, -1] += slope * points[:, 0]
    return Mesh(points, mesh.cells, mesh.facets)
