"""Columns beyond their Euler load: between walls, and along the bottom of a tube.

Static equilibria that are unstable without contact are reached by implicit Euler with steps so long that it damps all
motion, and a mass per length m with m/dt² = P²/2EI, twice what keeps A definite: the answer has no inertia left.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import null_space
from scipy.optimize import brentq

from contact.devices.device_contact import DeviceContact
from validation.case import Parameter, Quantity, Rates, Run, case
from validation.cases.beams import beam_of, elements, planar, rod, slopes, stiffness
from validation.cases.rods import aligned
from validation.exact.columns import ColumnWalls, DawsonPaslay
from validation.exact.elastica import ColumnElastica

Floats = NDArray[np.float64]
STEPS = 25
SOLVER = {"surface_error": 1e-6, "penetration": 1e-6}


def _levels(parameters: dict[str, Parameter]) -> tuple[float, ...]:
    """The middle on a node in point contact, the ends s of line contact at the same place between two nodes."""
    exact = ColumnElastica(**parameters)  # type: ignore[arg-type]
    if exact.regime != "line":
        return elements(8, 12, 16, 24)(parameters)
    return aligned(exact.s, exact.L, 30)


def _rates(parameters: dict[str, Parameter]) -> Rates:
    """In line contact the force, which hardly depends on where it ends, falls faster than the shape."""
    if ColumnElastica(**parameters).regime == "line":  # type: ignore[arg-type]
        return {"end_angle": {1: (2.0, 0.15)}}
    return {"force": {1: (4.0, 0.1)}}


@case(
    "column-walls",
    {"EI": 1.0, "L": 1.0, "P": 2 * np.pi**2, "d": 1e-3},
    levels=_levels,
    variants=({}, {"P": 6 * np.pi**2}, {"P": 25.0, "d": 0.05}, {"P": 45.0, "d": 0.05}),
    orders=(1,),
    rates=_rates,
)
def column_walls(run: Run) -> list[Quantity]:
    """A pinned column buckled by a dead load P between walls ±d: the elastica, and the linear formula beside it."""
    exact = ColumnElastica(**run.values("EI", "L", "P", "d"))
    EI, L, P, d = (run[k] for k in ("EI", "L", "P", "d"))
    inertia = P**2 / (2 * EI)
    push = {"kind": "line", "value": [0.0, f"{0.3 * d * inertia!r} * exp(-t)", 0.0]}
    load = {"kind": "point", "at": "end", "value": [-P, 0.0, 0.0]}
    supports = planar(run, {"at": "start", "hold": ["x", "y", "z"]}, {"at": "end", "hold": ["y", "z"]})
    beam = rod(run, d, section={"EA": 1e8 * EI / L**2, "mass": inertia}, supports=supports, loads=[load, push])
    planes = [{"kind": "plane", "point": [0.0, -2 * n * d, 0.0], "normal": [0.0, n, 0.0]} for n in (-1.0, 1.0)]
    walls = [{"body": "beam", "samples": 1, "surface": plane} for plane in planes]
    time = {"end": float(STEPS), "steps": STEPS, "integrator": "implicit-euler"}
    solved = run.march(lambda *_: None, body=[beam], contact=walls, solver=SOLVER, time=time)
    body, lam = beam_of(solved.system), solved.forces(0)
    x = body.start[:, 0]
    s = float(lam @ np.minimum(x, L - x) / lam.sum())
    EA = body.data.axial[0, 0] * body.data.length[0]
    shortening = L - body.x[-1, 0] - P * L / EA
    coarse = (30 * run.h / exact.s) ** 2 if exact.regime == "line" else (8 * run.h / exact.s) ** 4
    limit = (1e-3 if d <= 1e-3 * L else 2e-3) * max(1.0, coarse)
    linear = ColumnWalls(EI=EI, L=L, P=P, d=d)
    apart = limit + 5 * (d / L) ** 2  # slopes are of the order of d/L
    return [
        Quantity("force", lam.sum() + solved.forces(1).sum(), exact.force, limit),
        Quantity("reaction", lam.sum() / (2 if exact.regime == "line" else 1), exact.reaction, limit),
        Quantity("pin_force", abs(body.reactions()[0, 1]), exact.pin_force, limit),
        Quantity("s", s, exact.s, limit),
        Quantity("shortening", shortening, exact.shortening, limit),
        Quantity("end_angle", slopes(body)[0], exact.end_angle, limit),
        Quantity("linear_force", lam.sum(), linear.force, apart),
        Quantity("linear_shortening", shortening, linear.shortening, apart),
    ]


@case(
    "dawson-paslay",
    {"EI": 1.0, "w": 1.0, "r": 0.1, "L": 5.299942},
    levels=elements(12, 18, 24, 36),
    orders=(1,),
    rates={"P": {1: (3.0, 0.4)}},
)
def dawson_paslay(run: Run) -> list[Quantity]:
    """A rod of weight w along the bottom of a tube: the compression P at which it buckles sideways.

    There K with the curvature of contact becomes singular on the tangent space of the constraints that carry force.
    Next to the supports the nodes share the weight unevenly; where the mode is small that leaves an error of h³.
    """
    exact = DawsonPaslay(**run.values("EI", "w", "r", "L"))
    EI, w, r, L = (run[k] for k in ("EI", "w", "r", "L"))
    supports = [{"at": "start", "hold": ["x", "y", "z", "rx"]}, {"at": "end", "hold": ["y", "z"]}]
    weight = {"kind": "line", "value": [0.0, -w, 0.0]}
    tube = {"kind": "cylinder", "centre": [0.0] * 3, "axis": [1.0, 0.0, 0.0], "radius": 2 * r, "inside": True}
    mode = np.empty(0)

    def smallest(P: float) -> float:
        nonlocal mode
        run.close()
        push = {"kind": "point", "at": "end", "value": [-P, 0.0, 0.0]}
        section = {"EA": 1e7 * EI / L**2, "mass": P**2 / EI}
        placement = {"start": [0.0, -r, 0.0]}
        beam = rod(run, r, section=section, placement=placement, supports=supports, loads=[weight, push])
        contact = {"body": "beam", "samples": 1, "surface": tube}
        solved = run.march(
            lambda *_: None,
            body=[beam],
            contact=[contact],
            solver=SOLVER,
            time={"end": 5.0, "steps": 5, "integrator": "implicit-euler"},
        )
        body, lam = beam_of(solved.system), solved.forces()
        (pair,) = solved.system.pairs
        assert isinstance(pair, DeviceContact)
        rows, free = np.flatnonzero(lam > 0), ~body.fixed
        (H,) = solved.result.linearisation.H.values()
        tangent = null_space(H.take(rows).sparse().toarray()[:, free])
        values, vectors = np.linalg.eigh(tangent.T @ stiffness(body, pair, lam)[np.ix_(free, free)] @ tangent)
        full = np.zeros(len(free))
        full[free] = tangent @ vectors[:, 0]
        mode = full[2::6]
        return float(values[0])

    P = brentq(smallest, 0.5 * exact.P, 1.5 * exact.P, rtol=1e-10)
    sideways = mode[np.abs(mode) > 1e-6 * np.abs(mode).max()]
    waves = 1 + int(np.count_nonzero(np.diff(np.sign(sideways))))
    return [Quantity("P", P, exact.P, 1e-3 * max(1.0, 30 * run.h / L) ** 3), Quantity("n", waves, exact.n, 0.0)]
