"""An elastic sphere that meets a plane: Hertz's impact, as far as the contact is small against the sphere."""

from __future__ import annotations

from typing import Any

import numpy as np

from validation.case import Quantity, Run, case, fitted_rate
from validation.cases.impacts import History
from validation.exact.impacts import HertzImpact

STEPS = 60  # in the time of contact
HALVINGS = 2  # of the contact's radius
CLOSE = 2e-3


@case(
    "hertz-impact",
    {"E": 1.0, "nu": 0.3, "rho": 1.0, "R": 1.0, "v0": 2.4e-4},
    levels=(4e-3,),
)
def hertz_impact(run: Run) -> list[Quantity]:
    """A half ball meets a plane slowly: approach, peak of the force and time, extrapolated to the half-space's a/R → 0.

    Hertz's law takes the ball for a half-space, wrong by O(a/R): impacts that halve the radius a of contact must halve
    the error. a ∝ v₀^{2/5}, so that each is 2^{5/2} times slower. Cells of size h where the first ball touches, and
    half of that in each later impact. The time is that between the passages of half of the peak, as a part of T.
    """
    sizes, ratios = [], []
    for halving in range(HALVINGS + 1):
        run.close()
        exact = HertzImpact(
            m=run["rho"] * 2 * np.pi / 3 * run["R"] ** 3,
            v0=run["v0"] / 2 ** (2.5 * halving),
            **run.values("E", "nu", "R"),
        )
        history, approach = _impact(run, exact, run.h / 2**halving)
        first, last = history.contact(exact.peak_force)
        begin, end = exact.passes(exact.peak_force / 2)
        sizes.append(np.sqrt(exact.delta / exact.R))
        ratios.append(
            [
                approach / exact.delta,
                history.force.max() / exact.peak_force,
                (last - first) / (end - begin),
            ]
        )
    # The error is proportional to a/R, which halves.
    found = 2 * np.array(ratios[-1]) - ratios[-2]
    known = (exact.delta, exact.peak_force, exact.duration)
    return [
        Quantity("impulse", history.impulse, exact.impulse, 1e-3),
        *[
            Quantity(name, ratio * value, value, CLOSE)
            for name, ratio, value in zip(("approach", "peak_force", "duration"), found, known, strict=True)
        ],
        Quantity("energy", history.energy[-1], history.energy[0], CLOSE),
        Quantity("order_of_approach", fitted_rate(sizes, [abs(1 - r[0]) for r in ratios]), 1.0, 0.1),
    ]


def _impact(run: Run, exact: HertzImpact, h: float) -> tuple[History, float]:
    """What each step of an impact found, and how far the centre of gravity went beyond the first touch [m]."""
    R, a, dt = exact.R, float(np.sqrt(exact.delta * exact.R)), exact.duration / STEPS
    steps = round(1.15 * STEPS)
    mesh = {
        "shape": "sphere-section",
        "radius": R,
        "h": 0.15 * R,
        "order": run.order,
        "refine": {"at": [0.0, 0.0], "radius": 1.4 * a, "h": h, "growth": 0.2},
    }
    ball = {
        "name": "ball",
        "mesh": mesh,
        "material": {"E": exact.E, "nu": exact.nu, "state": "axisymmetric"},
        "density": run["rho"],
        "velocity": [0.0, -exact.v0],
        "supports": [{"tag": "axis", "component": "r"}],
    }
    plane = {"kind": "plane", "point": [0.0, 0.0], "normal": [0.0, 1.0]}

    def observe(system: Any, accepted: Any) -> tuple[float, float, float, float]:
        body = system.bodies[0]
        axial = np.zeros(body.space.owned)
        axial[1 : body.space.components * body.space.piece.owned : body.space.components] = 1.0
        weight = body.inertia.forces(axial)
        moment, mass = body.comm.allreduce(np.array([weight @ body.coordinates(), weight @ axial]))
        return accepted.time - dt / 2, accepted.result.lam.sum(), sum(body.energy().values()), moment / mass

    solved = run.march(
        observe=observe,
        time={"end": steps * dt, "steps": steps, "integrator": "midpoint"},
        body=[ball],
        contact=[{"body": "ball", "tag": "arc", "surface": plane, "direction": [0.0, 1.0]}],
    )
    time, force, energy, centre = np.array(solved.observed).T
    return History(time, force, energy, dt), float(-centre.min())
