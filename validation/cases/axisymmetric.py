"""Bodies of revolution pressed on a punch below, in a finite cylinder or box with the exact field on its sides."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from contact.surfaces.implicit import Graph
from validation.case import Quantity, Run, case
from validation.cases.interfaces import PAIR, half_box, inside_the_box, interface, two_bodies
from validation.exact.axisymmetric import AxisymmetricContact
from validation.exact.hertz_point import HertzPoint
from validation.exact.punches import Cone, FlatPunch
from validation.exact.two_bodies import TwoBodies, below
from validation.measure import contact_width, multiplier_at_pole, pressure_at_pole, pressure_width, unbalanced

Floats = NDArray[np.float64]


def _section(
    run: Run, exact: AxisymmetricContact, surface: object, depth: float, grading: object = None
) -> dict[str, object]:
    """The cylinder r, z ≤ 1 on its axis, moved on its far sides as the exact half-space moves."""

    def field(x: Floats, t: float) -> Floats:
        return exact.displacement(x)

    mesh = {"shape": "box", "size": [1.0, 1.0], "h": run.h, "order": run.order, "structured": True, "grading": grading}
    body = {
        "name": "body",
        "mesh": mesh,
        "material": {**run.values("E", "nu"), "state": "axisymmetric"},
        "supports": [
            {"tag": "left", "component": "r"},
            {"tag": "right", "value": field},
            {"tag": "top", "value": field},
        ],
    }
    contact = {
        "body": "body",
        "tag": "bottom",
        "surface": surface,
        "direction": [0.0, 1.0],
        "constraint": run["constraint"],
        "interference": depth,
    }
    return {"body": [body], "contact": [contact]}


@case(
    "hertz-point",
    {"E": 1.0, "nu": 0.3, "R": 1.0, "a": 0.3, "model": "axisymmetric", "constraint": "nodal", **PAIR},
    levels=lambda p: (1 / 80,) if p["model"] != "3d" else (1 / 32,) if p["E1"] else (1 / 40,),
    variants=(
        {},
        {"model": "3d"},
        *({"E1": ratio, "E2": 1.0} for ratio in (1.0, 1e3)),
        {"model": "3d", "E1": 10.0, "E2": 1.0},
    ),
    studied=({}, {"model": "3d"}),
    study=lambda p: (1 / 8, 1 / 11, 1 / 16, 1 / 22, 1 / 32) if p["model"] == "3d" else (),
)
def hertz_point(run: Run) -> list[Quantity]:
    """Hertz's point contact, axisymmetric or 3d: a body (E, nu) on a rigid paraboloid, or two (E1 and E2 given)."""
    if run["model"] not in ("axisymmetric", "3d"):
        raise ValueError(f"hertz-point: model = {run['model']}: must be axisymmetric or 3d")
    inside_the_box(run)
    if two_bodies(run):
        return _hertz_point_pair(run)
    exact = HertzPoint(**run.values("E", "nu", "R", "a"))
    if run["model"] == "3d":
        return _hertz_point_3d(run, exact)
    surface = {"kind": "paraboloid", "origin": [0.0, exact.delta], "radius": run["R"]}
    solved = run.solve(**_section(run, exact, surface, exact.delta))
    lam, r, areas = solved.forces(), solved.places()[:, 0], solved.result.linearisation.constraints[0].areas
    if run["constraint"] == "mortar":
        p0 = float(lam[np.argmin(r)] / areas[np.argmin(r)])
    else:
        p0 = pressure_at_pole(solved.system.bodies[0], "bottom", solved.places(), lam, 0.5 * run["a"])
    return [
        Quantity("force", lam.sum(), exact.P, 1e-4),
        Quantity("p0", p0, exact.p0, 1e-3),
        Quantity("radius", contact_width(solved.points(), lam), run["a"], 2e-3),
    ]


def _hertz_point_pair(run: Run) -> list[Quantity]:
    """Two cylinders with cells of size h and 4h/5, each moved on its far sides as its half-space moves.

    The paraboloid is the initial clearance of two plane faces, less the approach; each body's field has its share.
    """
    pair, R = TwoBodies(**run.values("E1", "nu1", "E2", "nu2")), run["R"]
    halves = [
        HertzPoint(E=run[f"E{i}"], nu=run[f"nu{i}"], a=run["a"], R=R / share) for i, share in enumerate(pair.shares, 1)
    ]
    approach = sum(half.delta for half in halves)

    def paraboloid(x: Floats, t: float) -> Floats:
        gap: Floats = (x[:, :-1] ** 2).sum(axis=1) / (2 * R) - approach
        return gap

    fields, solid = (halves[0].displacement, below(halves[1].displacement)), run["model"] == "3d"
    bodies = [
        _quarter(run, name, h, field, {"E": run[f"E{i}"], "nu": run[f"nu{i}"], "state": "3d"})
        if solid
        else half_box(run, name, h, field, "axisymmetric", "r")
        for i, name, h, field in zip((1, 2), ("upper", "lower"), (run.h, run.h / 1.25), fields, strict=True)
    ]
    solved = run.solve(body=bodies, contact=[interface(run, paraboloid, 1 / R, approach)])
    constraints, lam = solved.result.linearisation.constraints[0], solved.forces()
    r, p = np.linalg.norm(constraints.places, axis=1), lam / constraints.areas
    balance = Quantity("unbalanced", unbalanced(constraints.H, lam), 0.0, 1e-12)
    if solid:
        return [
            Quantity("force", 4 * lam.sum(), halves[0].P, 1e-3),
            Quantity("p0", float(p[np.argmin(r)]), halves[0].p0, 1e-2),
            balance,
        ]
    return [
        Quantity("force", lam.sum(), halves[0].P, 5e-4),
        Quantity("p0", multiplier_at_pole(r, p, 0.5 * run["a"], axisymmetric=True), halves[0].p0, 1e-3),
        Quantity("radius", pressure_width(r, p, axisymmetric=True), run["a"], 5e-3),
        balance,
    ]


def _quarter(
    run: Run, name: str, h: float, field: Callable[[Floats], Floats], material: dict[str, object]
) -> dict[str, object]:
    """A quarter of a box above z = 0, or below it, with the exact motion of its far sides; cells of h in contact."""
    far, origin = ("bottom", -1.0) if name == "lower" else ("top", 0.0)
    refine = {"at": [0.0, 0.0, 0.0], "radius": 1.1 * run["a"], "h": h, "growth": 0.4}
    return {
        "name": name,
        "mesh": {
            "shape": "box",
            "size": [1.0, 1.0, 1.0],
            "origin": [0.0, 0.0, origin],
            "h": max(0.14, h),
            "order": run.order,
            "refine": refine,
        },
        "material": material,
        "supports": [
            {"tag": "left", "component": "x"},
            {"tag": "front", "component": "y"},
            *({"tag": side, "value": lambda x, t: field(x)} for side in ("right", "back", far)),
        ],
    }


def _hertz_point_3d(run: Run, exact: HertzPoint) -> list[Quantity]:
    """A quarter of the box; second-order faces take mortar constraints only."""
    run.parameters = {**run.parameters, "constraint": "mortar"}
    body = _quarter(run, "body", run.h, exact.displacement, {**run.values("E", "nu"), "state": "3d"})
    contact = {
        "body": "body",
        "tag": "bottom",
        "surface": {"kind": "paraboloid", "origin": [0.0, 0.0, exact.delta], "radius": run["R"]},
        "direction": [0.0, 0.0, 1.0],
        "constraint": "mortar",
        "interference": exact.delta,
    }
    solved = run.solve(body=[body], contact=[contact])
    lam, x, areas = solved.forces(), solved.places(), solved.result.linearisation.constraints[0].areas
    pole = np.argmin(np.linalg.norm(x, axis=1))
    return [
        Quantity("force", 4 * lam.sum(), exact.P, 1e-3),
        Quantity("p0", float(lam[pole] / areas[pole]), exact.p0, 1e-2),
    ]


@case("punch-cone", {"E": 1.0, "nu": 0.3, "alpha": 0.1, "delta": 0.05, "constraint": "nodal"}, levels=(1 / 80,))
def punch_cone(run: Run) -> list[Quantity]:
    """A cone inclined by α [rad], pressed in by δ: force; the pressure is singular at the tip."""
    exact = Cone(**run.values("E", "nu", "alpha", "delta"))
    surface = {"kind": "cone", "origin": [0.0, exact.delta], "slope": float(np.tan(run["alpha"]))}
    solved = run.solve(**_section(run, exact, surface, exact.delta))
    return [Quantity("force", solved.forces().sum(), exact.P, 1e-3)]


@case("punch-flat", {"E": 1.0, "nu": 0.3, "a": 0.3, "delta": 0.05, "constraint": "nodal"}, levels=(1 / 80,))
def punch_flat(run: Run) -> list[Quantity]:
    """A flat-ended cylinder of radius a pressed in by δ: force; the mesh is graded to the singular rim."""
    a, delta = run["a"], run["delta"]
    exact = FlatPunch(**run.values("E", "nu", "a", "delta"))

    def height(r: Floats) -> Floats:
        return np.where(r[:, 0] <= a * (1 + 1e-12), 0.0, -1.0)

    punch = Graph(np.array([0.0, delta]), height, np.zeros_like, lambda x, y: np.full(len(x), np.inf))
    n = max(2, round(1 / run.h))
    inner = round(n / 2) / n

    def towards_rim(s: Floats) -> Floats:
        """A map of [0, 1] onto itself with a node at a and sizes that shrink quadratically towards it."""
        s = np.asarray(s)
        below = a * (1 - (1 - np.minimum(s / inner, 1)) ** 3)
        above = a + (1 - a) * (np.maximum(s - inner, 0) / (1 - inner)) ** 3
        mapped: Floats = np.where(s <= inner, below, above)
        return mapped

    solved = run.solve(**_section(run, exact, punch, delta, [towards_rim, lambda s: np.asarray(s) ** 3]))
    return [Quantity("force", solved.forces().sum(), exact.P, 1e-3)]
