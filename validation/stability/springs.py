"""Springs, bars and rigid bodies, whose answer is one line, from one extreme to the other."""

from __future__ import annotations

from typing import Any

import numpy as np

from validation.case import Quantity
from validation.exact.bars import BarStop
from validation.stability.point import Answer, bench, decades, of_case, of_run, sweep
from validation.stability.slits import SLITS, plates

EXACT = 1e-10
COPIES = (1.0, 2.0, 3.0, 5.0, 10.0, 20.0, 50.0, 100.0, 200.0, 500.0)


@sweep("stiffness-ratio", "k₂/k₁ [-]", decades(-12, 12), row="stiffness ratio")
def stiffness_ratio(ratio: float) -> Answer:
    """Two springs in contact: λ = k₂(F − k₁g)/(k₁ + k₂), both displacements."""
    return of_case("two-bars", k2=ratio)


@sweep("mass-ratio", "m₂/m₁ [-]", decades(-6, 6), row="stacked masses")
def mass_ratio(ratio: float) -> Answer:
    """A mass on a mass on the floor, in statics, held by contact alone: (m₁ + m₂)g and m₂g."""
    return _stacked(ratio, {})


@sweep("mass-ratio-step", "m₂/m₁ [-]", decades(-6, 6), row="stacked masses")
def mass_ratio_step(ratio: float) -> Answer:
    """The same masses at rest over three steps of implicit Euler."""
    return _stacked(ratio, {"end": 3e-2, "steps": 3, "integrator": "implicit-euler"})


@sweep("mass-ratio-gauss-seidel", "m₂/m₁ [-]", decades(-6, 6), row="stacked masses")
def mass_ratio_gauss_seidel(ratio: float) -> Answer:
    """The same by Gauss–Seidel, whose error falls by m₂/(m₁ + m₂) a sweep: right, if slow.

    A sweep changes the error by a part m₁/(m₁ + m₂) of it, and sees no change below rounding.
    """
    limit = max(EXACT, 4 * float(np.finfo(float).eps) * ratio)
    return _stacked(ratio, {"end": 1e-2, "steps": 1, "integrator": "implicit-euler"}, "gauss-seidel", limit)


def _stacked(ratio: float, time: dict[str, Any], method: str = "status", limit: float = EXACT) -> Answer:
    """Rigid rods of masses 1 and `ratio`, one on the other, under g."""
    g, masses = 9.81, (1.0, ratio)
    bodies = [
        {
            "name": f"m{i + 1}",
            "kind": "rigid",
            "mesh": {"shape": "interval", "length": 1.0, "n": 1, "origin": float(i)},
            "loads": [{"kind": "body", "value": [-m * g]}],
            **({"density": m} if time else {}),
        }
        for i, m in enumerate(masses)
    ]
    floor = {"kind": "plane", "point": [0.0], "normal": [1.0]}
    lower = {"kind": "point", "body": "m1", "tag": "end", "normal": [1.0]}
    with bench(method) as run:
        solved = run.march(
            lambda *_: None,
            body=bodies,
            contact=[
                {"name": "floor", "body": "m1", "tag": "start", "surface": floor},
                {"name": "between", "body": "m2", "tag": "start", "surface": lower},
            ],
            time=time,
        )
        return of_run(
            run,
            [
                Quantity("floor", solved.forces(0).sum(), (1 + ratio) * g, limit),
                Quantity("between", solved.forces(1).sum(), ratio * g, limit),
            ],
        )


@sweep("duplicates", "copies of the stop [-]", COPIES, row="duplicated constraints")
def duplicates(copies: float) -> Answer:
    """A bar's stop stated N times: u and Σλ are those of one."""
    return of_case("duplicated", h=1 / 8, N=copies)


@sweep("duplicates-shared", "copies of the stop [-]", COPIES, row="duplicated constraints")
def duplicates_shared(copies: float) -> Answer:
    """The same with the forces of minimum norm: each copy carries one N-th."""
    return of_case("duplicated", h=1 / 8, N=copies, norm="minimum")


@sweep("duplicates-apart", "differences of the gaps / g [-]", decades(-12, 0), row="duplicated constraints")
def duplicates_apart(spread: float) -> Answer:
    """Ten stops whose gaps differ: the nearest alone carries where they are apart by more than rounding."""
    k, F, g = 3.0, 1.0, 0.1
    gaps = g * (1 + spread * np.linspace(0, 1, 10))
    with bench() as run:
        solved = run.solve(
            body=[
                {
                    "name": "bar",
                    "kind": "spring",
                    "mesh": {"shape": "interval", "length": 1.0, "n": 4},
                    "material": {"k": k},
                    "supports": [{"tag": "start"}],
                    "loads": [{"kind": "force", "tag": "end", "value": F}],
                }
            ],
            contact=[
                {
                    "name": f"stop {i}",
                    "body": "bar",
                    "tag": "end",
                    "surface": {"kind": "plane", "point": [1.0 + float(gap)], "normal": [-1.0]},
                }
                for i, gap in enumerate(gaps)
            ],
        )
        u = float(solved.system.bodies[0].u.max())
        return of_run(
            run,
            [
                Quantity("end_displacement", u, g, EXACT),
                Quantity("reaction", solved.result.lam.sum(), F - k * g, EXACT),
            ],
        )


@sweep("slit", "width w [m]", SLITS, feasible=lambda w: w >= 0, row="slit of zero and of negative width")
def slit(width: float) -> Answer:
    """Opposed stops: u and λ₁ − λ₂ exact at zero width, forces bounded, and negative width reported as infeasible."""
    return of_case("opposed", h=1 / 8, w=width)


@sweep("slit-rigid", "width w [m]", SLITS, feasible=lambda w: w >= 0, row="slit of zero and of negative width")
def slit_rigid(width: float) -> Answer:
    """A rigid block pulled down between two plates that alone hold it: its weight on the lower, or infeasible."""
    with bench() as run:
        solved = run.solve(
            body=[
                {
                    "name": "block",
                    "kind": "rigid",
                    "mesh": {"shape": "box", "size": [1.0, 1.0], "n": 1, "structured": True},
                    "loads": [{"kind": "body", "value": [0.0, -1.0]}],
                    "supports": [{"tag": "left", "component": "x"}],
                }
            ],
            contact=plates(width),
        )
        lower, upper = solved.forces(0).sum(), solved.forces(1).sum()
        u = float(np.abs(solved.system.bodies[0].u).max())
        return of_run(run, [Quantity("difference", lower - upper, 1.0, EXACT), Quantity("displacement", u, 0.0, EXACT)])


@sweep(
    "grazing",
    "F L/EAg − 1 [-]",
    (*(-v for v in decades(-16, -4)[::-2]), 0.0, *decades(-16, -4)[::2]),
    row="grazing",
)
def grazing(excess: float) -> Answer:
    """A bar pulled until it just touches its stop: u exact, λ within rounding of F − EAg/L, whatever the active set."""
    F, g = 0.1 * (1 + excess), 0.1
    exact = BarStop(E=1.0, A=1.0, L=1.0, F=F, g=g)
    with bench() as run:
        solved = run.solve(
            body=[
                {
                    "name": "bar",
                    "kind": "bar",
                    "mesh": {"shape": "interval", "length": 1.0, "n": 8},
                    "material": {"EA": 1.0},
                    "supports": [{"tag": "start"}],
                    "loads": [{"kind": "force", "tag": "end", "value": F}],
                }
            ],
            contact=[{"body": "bar", "tag": "end", "surface": {"kind": "plane", "point": [1.0 + g], "normal": [-1.0]}}],
        )
        u = float(solved.system.bodies[0].u.max())
        return of_run(
            run,
            [
                Quantity("end_displacement", u, exact.end_displacement, EXACT),
                Quantity("reaction_over_F", (solved.forces().sum() - exact.reaction) / F, 0.0, EXACT),
            ],
        )


OPENINGS = (*decades(-6, -1), 0.3, np.pi / 6, 0.8, 1.2, *(float(np.pi / 2 - 10.0**-k) for k in range(1, 9)))


@sweep("v-groove", "half-opening β [rad]", OPENINGS, row="V-groove")
def v_groove(beta: float) -> Answer:
    """A rigid block of weight F held by two walls alone: N = F/(2 sin β)."""
    return of_case("v-groove", beta=beta)
