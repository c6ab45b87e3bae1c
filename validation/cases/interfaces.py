"""What cases of two bodies have in common: their parameters, and the contact of an upper with a lower one."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from validation.case import Parameter, Run

Floats = NDArray[np.float64]

# Of a case that is also one of a single body; E1 = E2 = 0 stands for that.
PAIR: dict[str, Parameter] = {"E1": 0.0, "nu1": 0.3, "E2": 0.0, "nu2": 0.3, "multiplier": "vertex", "side": "auto"}


def two_bodies(run: Run) -> bool:
    """Whether such a case is asked for with the two bodies E1, nu1, E2, nu2."""
    given = run["E1"] != 0, run["E2"] != 0
    if any(given) and not all(given):
        raise ValueError(f"{run.case.name}: E1 = {run['E1']}, E2 = {run['E2']}: must be given together")
    return all(given)


def inside_the_box(run: Run) -> None:
    """ValueError where contact reaches the far side of a box of width 1."""
    if run["a"] >= 1:
        raise ValueError(f"{run.case.name}: a = {run['a']}: must be < 1, the width of the box")


def interface(
    run: Run, clearance: Callable[[Floats, float], Floats], curvature: float, approach: float = 0.0
) -> dict[str, object]:
    """The contact of the upper body's lower face with the lower body's upper face.

    `clearance` [m] is at least −`approach`; `curvature` is its second derivative [1/m]. Its mean with
    the dual basis, which is negative in part, is less by up to curvature × h²/12.
    """
    dual = curvature * (1.25 * run.h) ** 2 / 10 if run["multiplier"] == "dual" else 0.0
    return {
        "body": "upper",
        "tag": "bottom",
        "surface": {"kind": "body", "body": "lower", "tag": "top"},
        "clearance": clearance,
        "interference": approach + dual,
        **run.values("multiplier", "side"),
    }


def half_box(
    run: Run, name: str, h: float, field: Callable[[Floats], Floats], state: str, along: str
) -> dict[str, object]:
    """The unit box x > 0 above or below y = 0, symmetric about x = 0, with a given motion of its far sides.

    `along` is the component that vanishes on x = 0, and E1, nu1 the upper body's. Cells are of size h [m] along the
    interface, and three quarters as high there.
    """
    upper = name == "upper"
    number = "1" if upper else "2"
    return {
        "name": name,
        "mesh": {
            "shape": "box",
            "size": [1.0, 1.0],
            "origin": [0.0, 0.0 if upper else -1.0],
            "n": [max(2, round(1 / h)), max(2, round(0.5 / h))],
            "order": run.order,
            "structured": True,
            "grading": [1.0, fine_below if upper else fine_above],
        },
        "material": {"E": run[f"E{number}"], "nu": run[f"nu{number}"], "state": state},
        "supports": [
            {"tag": "left", "component": along},
            *({"tag": tag, "value": lambda x, t: field(x)} for tag in ("right", "top" if upper else "bottom")),
        ],
    }


def fine_below(s: Floats) -> Floats:
    """A map of [0, 1] onto itself with cells three eighths as long at 0 as on average."""
    s = np.asarray(s)
    return (3 * s + 5 * s**3) / 8


def fine_above(s: Floats) -> Floats:
    """The same towards 1."""
    return 1 - fine_below(1 - np.asarray(s))
