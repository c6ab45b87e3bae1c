"""Wires: slender, in tubes that hardly let them in, pushed by up to a hundred diameters a step, packed into a dome."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from contact.devices.device_contact import DeviceContact
from contact.system import System
from validation.case import Quantity
from validation.cases.beams import beam_of
from validation.stability.point import Answer, bench, decades, of_run, sweep

Floats = NDArray[np.float64]

STRAIGHT = {"kind": "cylinder", "centre": [0.0] * 3, "axis": [1.0, 0.0, 0.0], "inside": True}


@sweep("slenderness", "length over radius L/r [-]", decades(2, 5, 4), row="slenderness")
def slenderness(ratio: float) -> Answer:
    """A cantilever's tip pressed onto a floor: R = F − 3EId/L³ to 1e-6, whatever EA L²/EI = 4(L/r)²."""
    L, EI, F = 1.0, 1.0, 1e-3
    r = L / ratio
    d = 1e-4 * L
    E = 4 * EI / (np.pi * r**4)
    section = {"length": L, "elements": 8, "radius": r, "E": E, "nu": 0.3}
    plane = {"kind": "plane", "point": [0.0, -d - r, 0.0], "normal": [0.0, 1.0, 0.0]}
    with bench() as run:
        solved = run.march(
            lambda *_: None,
            body=[
                {
                    "name": "beam",
                    "kind": "beam",
                    "sections": [section],
                    "supports": [{"at": "start"}],
                    "loads": [{"kind": "point", "at": "end", "value": [0.0, -F, 0.0]}],
                }
            ],
            contact=[{"body": "beam", "samples": 1, "surface": plane}],
            solver={"surface_error": 1e-8, "penetration": 1e-8},
        )
        return of_run(
            run,
            [
                Quantity("reaction", solved.forces().sum(), F - 3 * EI * d / L**3, 1e-6),
                Quantity("clamp_moment", -beam_of(solved.system).reactions()[0, 5], -3 * EI * d / L**2, 1e-6),
            ],
        )


FITS = (*(-v for v in decades(-6, -1)[::-1]), *decades(-6, -1, 2))


@sweep("wire-fit", "clearance over the wire's radius [-]", FITS, feasible=lambda c: c > 0, row="wire in a narrow tube")
def wire_fit(clearance: float) -> Answer:
    """A heavy wire in a straight tube: it sinks by the clearance, the tube carries its weight, or it does not fit."""
    a, L, q, mass = 1e-3, 0.1, 2.0, 1e-2
    section = {"length": L, "elements": 20, "radius": a, "EA": 1e3, "EI": 1e-4, "GJ": 1e-4, "mass": mass}
    tube = {**STRAIGHT, "radius": a * (1 + clearance)}
    with bench() as run:
        solved = run.march(
            lambda *_: None,
            body=[
                {
                    "name": "wire",
                    "kind": "beam",
                    "sections": [section],
                    "supports": [{"at": "start", "hold": ["x", "rx"]}],
                    "loads": [{"kind": "line", "value": [0.0, -q, 0.0]}],
                }
            ],
            contact=[{"body": "wire", "samples": 1, "surface": tube, "interference": max(0.0, -2 * a * clearance)}],
            solver={"surface_error": 1e-9, "penetration": 1e-9},
            time={"end": 10.0, "steps": 10, "integrator": "implicit-euler"},
        )
        sunk = beam_of(solved.system).displacement[:, 1]
        force = solved.resultant()
        return of_run(
            run,
            [
                Quantity("sunk_over_radius", float(np.abs(sunk / a + clearance).max()), 0.0, 1e-9),
                Quantity("weight", force[1], q * L, 1e-8),
            ],
        )


BENDS = [
    [-0.0400, 0.000, 0.000, 8.0e-4],
    [0.0000, 0.000, 0.000, 8.0e-4],
    [0.0100, 0.001, 0.001, 1.0e-3],
    [0.0180, 0.006, 0.003, 1.1e-3],
    [0.0230, 0.014, 0.004, 1.1e-3],
    [0.0300, 0.021, 0.003, 1.1e-3],
    [0.0400, 0.023, 0.001, 1.1e-3],
    [0.0600, 0.022, -0.001, 1.1e-3],
    [0.0800, 0.022, -0.001, 1.1e-3],
]
PUSHES = (0.1, 0.2, 0.5, 1.0, 2.0, 3.0, 5.0, 10.0, 20.0, 30.0, 50.0, 100.0)


@sweep("insertion", "push a step over the wire's diameter [-]", PUSHES)
def insertion(diameters: float) -> Answer:
    """A wire with a J tip pushed by a hundred diameters through two bends of a vessel: no point leaves it."""
    a, total = 1.8e-4, 100.0
    steps = round(total / diameters)
    straight = {"length": 0.030, "elements": 18, "radius": a, "E": 60e9, "nu": 0.33, "density": 6450.0}
    tip = {**straight, "length": 0.010, "elements": 10, "E": 10e9, "shape": {"kind": "arc", "radius": 6e-3}}
    wire = {
        "name": "wire",
        "kind": "beam",
        "rayleigh": [40.0, 2e-3],
        "sections": [straight, tip],
        "placement": {"start": [-0.039, 0.0, 0.0], "straight": True},
        "supports": [{"at": "start", "push": f"{2 * a * total!r} * t"}],
    }
    vessel = {"kind": "vessels", "spacing": 2e-3, "branches": [{"name": "vessel", "points": BENDS}]}
    return _inside([wire], [{"body": "wire", "samples": 2, "surface": vessel}], 1.0, steps)


DOMES = (0.6, 0.7, 0.8, 0.9, 1.0, 1.1, 1.25, 1.5, 1.75, 2.0)


@sweep("coil-packing", "radius of the dome over that of the coil's loops [-]", DOMES)
def coil_packing(ratio: float) -> Answer:
    """A coil pushed out of a microcatheter into a dome until all of it is in: every point stays inside.

    The end that is pushed stops a diameter beyond the microcatheter: further on it would leave a narrow dome itself.
    """
    loop, a, L = 2.0e-3, 1.25e-4, 0.030
    dome = ratio * loop
    section: dict[str, Any] = {
        "length": L,
        "elements": 60,
        "radius": a,
        "EA": 10.0,
        "EI": 3.0e-9,
        "GJ": 2.3e-9,
        "mass": 5.3e-4,
    }
    section |= {"inertia": 2e-9, "shape": {"kind": "helix", "radius": loop, "pitch": 3e-3}}
    mouth = -0.9 * dome
    coil = {
        "name": "coil",
        "kind": "beam",
        "rayleigh": [2000.0, 1e-2],
        "sections": [section],
        "placement": {"start": [mouth - L, 0.0, 0.4 * dome], "direction": [1.0, 0.0, 0.0], "straight": True},
        "supports": [{"at": "start", "push": f"{0.95 * L!r} * t"}],
    }
    catheter = [[mouth - 1.1 * L, 0.0, 0.4 * dome, 2.2e-4], [-0.75 * dome, 0.0, 0.4 * dome, 2.2e-4]]
    surface = {
        "kind": "vessels",
        "spacing": 5e-4,
        "branches": [{"name": "microcatheter", "points": catheter}],
        "aneurysms": [{"centre": [0.0, 0.0, 0.0], "radius": dome}],
    }
    end = (L + 0.15 * dome + 2 * a) / (0.95 * L)
    return _inside([coil], [{"body": "coil", "samples": 2, "surface": surface}], end, round(100 * end))


def _inside(body: list[dict[str, Any]], contact: list[dict[str, Any]], end: float, steps: int) -> Answer:
    """March a device in a vessel and look, after each step, whether its surface is inside at every contact point."""
    worst: dict[str, float] = dict.fromkeys(("complementarity", "equilibrium", "surface_error", "penetration"), 0.0)
    iterations = 0

    def observe(system: System, accepted: Any) -> float:
        nonlocal iterations
        iterations += accepted.result.iterations
        for name in worst:
            worst[name] = max(worst[name], getattr(accepted.result.certificate, name))
        return outside(system)

    with bench() as run:
        solved = run.march(
            observe,
            body=body,
            contact=contact,
            solver={"max_halvings": 12},
            time={"end": end, "steps": steps, "integrator": "implicit-euler"},
        )
        missing = steps - len(solved.observed)
        answer = of_run(
            run,
            [
                Quantity("points_outside", float(np.sum(solved.observed)), 0.0, 0.5),
                Quantity("steps_missing", float(missing), 0.0, 0.5),
            ],
        )
        return Answer(answer.quantities, worst, iterations, answer.contacts, answer.condition)


def outside(system: System) -> float:
    """How many contact points have a place of their ring, a thousandth inside the device, in the wall."""
    count = 0
    angle = np.linspace(0, 2 * np.pi, 16, endpoint=False)
    for pair in system.pairs:
        assert isinstance(pair, DeviceContact)
        x, frames = beam_of(system).x, beam_of(system).R
        # places between nodes on the chord, closer to the axis than the centreline by less than the margin allows
        at = pair.at
        across = frames[pair.elements][:, :, 1:] @ np.stack([np.cos(angle), np.sin(angle)])
        ring = at[:, None] + 0.999 * pair.radius[:, None, None] * np.swapaxes(across, 1, 2)
        potential = pair.surface.potential(np.concatenate([at[:, None], ring], axis=1).reshape(-1, 3))
        count += int((potential.reshape(len(at), -1) < 0).any(axis=1).sum())
        assert np.isfinite(x).all()
    return float(count)
