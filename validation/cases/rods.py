"""Beams against a flat floor: polynomials with a free boundary, in the range of small slopes.

Contact points are the nodes: between them no force acts, and elements are exact. The concentrated force where a beam
lifts off is shared by the nodes beside it; it is taken with its place s from the sum and first moment of all forces.
Errors are h² times a function of where s lies between two nodes: default levels have it at the same place. In point
contact no error is left but that of small slopes, of order d².
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from validation.case import Parameter, Quantity, Run, Solved, case
from validation.cases.beams import beam_of, planar, rod
from validation.exact.rods import BeamStop, CantileverFloor, HeavyBeam

Floats = NDArray[np.float64]
CLOSE = 1e-3
PLACE = 0.3  # between two nodes: here errors/h² depend least on it; they range from −2 to 1 times what they are here
STEPS = 5  # of the load: less than its whole leaves linearisations that hold


def aligned(s: float, L: float, first: int, levels: int = 4) -> tuple[float, ...]:
    """Levels from about `first` elements over L on, 1.8 times as many each, with s [m] at `PLACE` between two nodes."""
    sizes = []
    for k in range(levels):
        counts = np.arange(np.ceil(first * 1.8**k), first * 1.8 ** (k + 1))
        sizes.append(L / float(counts[np.argmin(np.abs(counts * s / L % 1 - PLACE))]))
    return tuple(sizes)


def _levels(
    exact: Callable[..., Any], first: int, count: int = 4
) -> Callable[[dict[str, Parameter]], tuple[float, ...]]:
    """The levels for line contact, and one for point contact, with a node in the middle."""

    def levels(parameters: dict[str, Parameter]) -> tuple[float, ...]:
        L, known = float(parameters["L"]), exact(**parameters)
        return aligned(known.s, L, first, count) if getattr(known, "regime", "line") == "line" else (L / 16,)

    return levels


def solve(run: Run, beam: dict[str, Any], floor: float, a: float) -> Solved:
    """A beam of radius a whose axis stays above y = `floor`, both in [m]."""
    plane = {"kind": "plane", "point": [0.0, floor - a, 0.0], "normal": [0.0, 1.0, 0.0]}
    contact = {"body": "beam", "samples": 1, "surface": plane}
    solver = {"surface_error": 1e-6, "penetration": 1e-6}
    return run.march(lambda *_: None, body=[beam], contact=[contact], solver=solver, time={"steps": STEPS})


def limit(run: Run, s: float) -> float:
    """1e-3 with thirty elements over s [m], looser with h² where there are fewer."""
    return CLOSE * max(1.0, 30 * run.h / s) ** 2


def _pressed(q: float) -> dict[str, Any]:
    """q downwards per length."""
    return {"kind": "line", "value": [0.0, f"{-q!r} * t", 0.0]}


def _lift_off(lam: Floats, x: Floats, q: float, L: float) -> tuple[float, float]:
    """s and R of the force R at s and q per length from there to L, from the sum and the first moment of forces."""
    N, T = lam.sum() - q * L, lam @ x - q * L**2 / 2
    s = (float(np.sqrt(max(float(N**2 + 2 * q * T), 0.0))) - float(N)) / q
    return s, float(N) + q * s


@case(
    "cantilever-floor",
    {"EI": 1.0, "L": 1.0, "q": 1.0, "d": 1e-3},
    levels=_levels(CantileverFloor, 16),
    study=_levels(CantileverFloor, 16, 7),
    variants=({}, {"q": 0.05}),
    orders=(1,),
    rates={"force": {1: (2.0, 0.3)}},
)
def cantilever_floor(run: Run) -> list[Quantity]:
    """A cantilever pressed by q onto a floor at the depth d: point contact of the tip, then line contact from s on."""
    exact = CantileverFloor(**run.values("EI", "L", "q", "d"))
    beam = rod(run, exact.d, supports=planar(run, {"at": "start"}), loads=[_pressed(exact.q)])
    solved = solve(run, beam, -exact.d, exact.d)
    body, lam = beam_of(solved.system), solved.forces()
    s, reaction = _lift_off(lam, body.start[:, 0], exact.q, exact.L)
    clamp = body.reactions()[0]
    w = float(np.abs(exact.deflection(body.start[:, 0]) + body.displacement[:, 1]).max())
    return [
        Quantity("force", lam.sum(), exact.force, limit(run, exact.s)),
        Quantity("reaction", reaction, exact.reaction, limit(run, exact.s)),
        Quantity("s", s, exact.s, limit(run, exact.s)),
        Quantity("clamp_force", clamp[1], exact.clamp_force, limit(run, exact.s)),
        Quantity("clamp_moment", clamp[5], exact.clamp_moment, limit(run, exact.s)),
        Quantity("deflection", w / exact.d, 0.0, limit(run, exact.s)),
    ]


@case(
    "heavy-beam",
    {"EI": 1.0, "L": 1.0, "q": 1.0, "H": 1e-3},
    levels=_levels(HeavyBeam, 16),
    study=_levels(HeavyBeam, 16, 7),
    orders=(1,),
    rates={"force": {1: (2.0, 0.3)}},
)
def heavy_beam(run: Run) -> list[Quantity]:
    """A heavy beam on a floor, its end lifted by H: it leaves the floor up to s; the far end is flat and held so."""
    exact = HeavyBeam(**run.values("EI", "L", "q", "H"))
    lift = {"at": "start", "hold": ["x", "y", "z"], "displacement": [0.0, f"{exact.H!r} * t", 0.0]}
    supports = planar(run, lift, {"at": "end", "hold": ["rz"]})
    weight = {"kind": "line", "value": [0.0, -exact.q, 0.0]}
    solved = solve(run, rod(run, exact.H, supports=supports, loads=[weight]), 0.0, exact.H)
    body, lam = beam_of(solved.system), solved.forces()
    s, reaction = _lift_off(lam, body.start[:, 0], exact.q, exact.L)
    w = float(np.abs(exact.height(body.start[:, 0]) - body.x[:, 1]).max())
    return [
        Quantity("force", lam.sum(), exact.force, limit(run, exact.s)),
        Quantity("reaction", reaction, exact.lift_force, limit(run, exact.s)),
        Quantity("s", s, exact.s, limit(run, exact.s)),
        Quantity("lift_force", body.reactions()[0, 1], exact.lift_force, limit(run, exact.s)),
        Quantity("height", w / exact.H, 0.0, limit(run, exact.s)),
    ]


@case(
    "beam-stop",
    {"EI": 1.0, "L": 1.0, "q": 1.0, "d": 1e-3},
    levels=_levels(BeamStop, 16),
    study=_levels(BeamStop, 16, 7),
    variants=({}, {"q": 0.2}),
    orders=(1,),
    rates={"force": {1: (2.0, 0.3)}},
)
def beam_stop(run: Run) -> list[Quantity]:
    """A simply supported beam pressed by q onto a flat stop: point contact in the middle, then line contact."""
    exact = BeamStop(**run.values("EI", "L", "q", "d"))
    supports = planar(run, {"at": "start", "hold": ["x", "y", "z"]}, {"at": "end", "hold": ["y", "z"]})
    beam = rod(run, exact.d, supports=supports, loads=[_pressed(exact.q)])
    solved = solve(run, beam, -exact.d, exact.d)
    body, lam = beam_of(solved.system), solved.forces()
    x = body.start[:, 0]
    folded = np.minimum(x, exact.L - x)
    s, reaction = _lift_off(lam / 2, folded, exact.q, exact.L / 2)
    w = float(np.abs(exact.deflection(x) + body.displacement[:, 1]).max())
    return [
        Quantity("force", lam.sum(), exact.force, limit(run, exact.s)),
        Quantity("reaction", reaction if exact.regime == "line" else lam.sum(), exact.reaction, limit(run, exact.s)),
        Quantity("s", s, exact.s, limit(run, exact.s)),
        Quantity("support_force", body.reactions()[[0, -1], 1].mean(), exact.support_force, limit(run, exact.s)),
        Quantity("deflection", w / exact.d, 0.0, limit(run, exact.s)),
    ]
