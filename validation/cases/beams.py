"""Beams without contact: a circle, a bend in space, Euler's load and the tip of an elastica."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import cache
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import brentq

from contact.devices.device_contact import DeviceContact
from contact.system import System
from fem.beams import beam_element
from fem.beams.beam import Beam
from fem.beams.beam_points import point_blocks
from validation.case import Parameter, Quantity, Run, case
from validation.exact.columns import euler_load
from validation.exact.common import positive
from validation.exact.elastica import CantileverElastica, rolled_tip
from validation.exact.spatial_rod import ArcRod

Floats = NDArray[np.float64]
STIFF = 1e6  # EA L²/EI of beams in bending; those under axial loads take more, so that they do not stretch


def elements(*counts: int) -> Callable[[dict[str, Parameter]], tuple[float, ...]]:
    """Levels with so many elements over L."""
    return lambda parameters: tuple(float(parameters["L"]) / n for n in counts)


def count(run: Run) -> int:
    """The number of elements at a run's level."""
    return max(2, round(float(run["L"]) / run.h))


def rod(run: Run, radius: float, **table: Any) -> dict[str, Any]:
    """The table of a beam of length L [m] with EI [N m²] and a radius [m], hardly stretched; GJ = EI."""
    EI, L = run["EI"], run["L"]
    section = {
        "length": L,
        "elements": count(run),
        "radius": radius,
        "EA": STIFF * EI / L**2,
        "GJ": EI,
        "EI": EI,
    }
    section |= table.pop("section", {})
    return {"name": "beam", "kind": "beam", "sections": [section], **table}


def planar(run: Run, *supports: dict[str, Any]) -> list[dict[str, Any]]:
    """Supports of a beam that stays in the plane x, y: beside `supports`, all nodes held in z, rx and ry."""
    nodes = np.linspace(0.0, run["L"], count(run) + 1)
    return [*supports, *({"at": float(s), "hold": ["z", "rx", "ry"]} for s in nodes)]


def beam_of(system: System) -> Beam:
    """The one beam of a case's system."""
    (beam,) = system.bodies
    assert isinstance(beam, Beam)
    return beam


def slopes(beam: Beam) -> Floats:
    """Angle of the tangent at each node of a plane beam, without jumps, (N) [rad]."""
    t = beam.R[:, :, 0]
    angle: Floats = np.unwrap(np.arctan2(t[:, 1], t[:, 0]))
    return angle


def stiffness(beam: Beam, contact: DeviceContact | None = None, lam: Floats | None = None) -> Floats:
    """K of a beam's present state, with the curvature that any contact forces λ [N] add, (6 N, 6 N)."""
    m = len(beam.data.length)
    blocks, at = beam_element.stiffness(beam.edges, beam.R, beam.data), np.arange(m)
    if contact is not None and lam is not None:
        rows, foot = np.flatnonzero(lam > 0), contact.foot
        elements, xi = contact.elements[rows], contact.xi[rows]
        bent = point_blocks(lam[rows], foot.normal[rows], foot.curvature[rows], beam.R, elements, xi, beam.data.length)
        blocks, at = np.concatenate([blocks, bent]), np.concatenate([at, elements])
    dofs = 6 * at[:, None] + np.arange(12)
    K = np.zeros((6 * m + 6, 6 * m + 6))
    np.add.at(K, (dofs[:, :, None], dofs[:, None, :]), blocks)
    return K


def _nothing(system: System, accepted: Any) -> None:
    """A march that is not watched."""


@case(
    "circle",
    {"EI": 1.0, "L": 1.0},
    levels=elements(10, 20, 40, 80),
    orders=(1,),
    rates={"diameter": {1: (4.0, 0.1)}},
)
def circle(run: Run) -> list[Quantity]:
    """A cantilever rolled into a circle by the end moment 2πEI/L: equal elements close it, its diameter converges."""
    positive(**run.values("EI", "L"))
    M = 2 * np.pi * run["EI"] / run["L"]
    load = {"kind": "point", "at": "end", "moment": [0.0, 0.0, f"{M!r} * t"]}
    beam = rod(run, 0.0, supports=[{"at": "start"}], loads=[load])
    tip = beam_of(run.march(_nothing, body=[beam], time={"steps": 40}).system)
    x, y, turn = rolled_tip(EI=run["EI"], L=run["L"], M=M)
    gap = float(np.hypot(*(tip.x[-1, :2] - [x, y])) / run["L"])
    half = count(run) // 2
    width = float(np.linalg.norm(tip.x[half] - tip.x[0]))
    exact = run["L"] / np.pi * np.sin(np.pi * half / count(run))
    limit = 1e-3 * max(1.0, 20 * run.h / run["L"]) ** 4
    return [
        Quantity("gap", gap, 0.0, limit),
        Quantity("diameter", width, exact, limit),
        Quantity("tip_angle", slopes(tip)[-1], turn, 1e-8),
        Quantity("clamp_moment", -tip.reactions()[0, 5], M, 1e-8),
    ]


@cache
def _bend(P: float, E: float, R: float) -> ArcRod:
    """The boundary-value problem, once for all levels."""
    return replace(ArcRod.bathe_bolourchi(P=P, E=E, R=R), GA=np.inf)


@case(
    "bend-45",
    {"P": 600.0, "E": 1e7, "R": 100.0},
    levels=lambda p: tuple(float(p["R"]) * np.pi / 4 / n for n in (4, 8, 16, 32)),
    variants=({}, {"P": 300.0}),
    orders=(1,),
    rates={"tip_deviation": {1: (2.0, 0.3)}},
)
def bend_45(run: Run) -> list[Quantity]:
    """Bathe and Bolourchi's 45° bend, unit square section, a dead tip force P out of its plane; GA infinite here.

    Where torsion and bending mix, elements have an error of h².
    """
    exact = _bend(**run.values("P", "E", "R"))
    n = max(2, round(exact.L / run.h))
    section = {
        "length": exact.L,
        "elements": n,
        "shape": {"kind": "arc", "radius": exact.R},
        "radius": 0.0,
        "EA": exact.EA,
        "GJ": exact.GJ,
        "EI": exact.EI,
    }
    beam = {
        "name": "beam",
        "kind": "beam",
        "sections": [section],
        "placement": {"direction": [0.0, 1.0, 0.0]},
        "supports": [{"at": "start"}],
        "loads": [{"kind": "point", "at": "end", "value": [0.0, 0.0, f"{run['P']!r} * t"]}],
    }
    solved = beam_of(run.march(_nothing, body=[beam], time={"steps": 6}).system)
    tip, limit = solved.x[-1], 1e-3 * max(1.0, 16 * run.h / exact.L) ** 2
    return [
        *[Quantity(f"tip_{name}", tip[i], exact.tip[i], limit) for i, name in enumerate("xyz")],
        Quantity("tip_deviation", float(np.linalg.norm(tip - exact.tip) / exact.L), 0.0, limit),
    ]


HALF_WAVES = {"pinned": 1.0, "clamped": 2.0, "cantilever": 0.5}


def _levels(parameters: dict[str, Parameter]) -> tuple[float, ...]:
    """The same numbers of elements over a half wave, whatever the ends."""
    waves = HALF_WAVES.get(str(parameters["ends"]), 1.0)
    return elements(*(round(n * waves) for n in (4, 8, 16, 24)))(parameters)


@case(
    "euler-load",
    {"EI": 1.0, "L": 1.0, "ends": "pinned"},
    levels=_levels,
    variants=({}, {"ends": "cantilever"}, {"ends": "clamped"}),
    orders=(1,),
    rates={"P": {1: (4.0, 0.1)}},
)
def euler(run: Run) -> list[Quantity]:
    """The load P at which a column's tangent matrix becomes singular, ends pinned, clamped, or a cantilever."""
    exact = euler_load(**run.values("EI", "L", "ends"))
    pinned = {"at": "start", "hold": ["x", "y", "z", "rx"]}, {"at": "end", "hold": ["y", "z"]}
    clamped = {"at": "start"}, {"at": "end", "hold": ["y", "z", "rx", "ry", "rz"]}
    supports = {"pinned": pinned, "clamped": clamped, "cantilever": clamped[:1]}[run["ends"]]

    # The smallest eigenvalue has the round-off of the largest, that of EA.
    section = {"EA": 1e8 * run["EI"] / run["L"] ** 2}

    def smallest(P: float) -> float:
        run.close()
        load = {"kind": "point", "at": "end", "value": [-P, 0.0, 0.0]}
        beam = rod(run, 0.0, section=section, supports=list(supports), loads=[load])
        column = beam_of(run.solve(body=[beam]).system)
        free = ~column.fixed
        return float(np.linalg.eigvalsh(stiffness(column)[np.ix_(free, free)])[0])

    P = brentq(smallest, 0.5 * exact, 1.5 * exact, rtol=1e-10)
    return [Quantity("P", P, exact, 1e-3 * max(1.0, 8 * HALF_WAVES[run["ends"]] * run.h / run["L"]) ** 4)]


@case(
    "elastica-tip",
    {"EI": 1.0, "L": 1.0, "P": 10.0, "omega": np.pi / 2},
    levels=elements(4, 8, 16, 32),
    orders=(1,),
    rates={"tip_deviation": {1: (4.0, 0.2)}},
)
def elastica_tip(run: Run) -> list[Quantity]:
    """A cantilever under a dead tip force P at the angle ω [rad] to its axis."""
    exact = CantileverElastica(**run.values("EI", "L", "P", "omega"))
    force = run["P"] * np.array([np.cos(run["omega"]), np.sin(run["omega"])])
    load = {"kind": "point", "at": "end", "value": [f"{float(f)!r} * t" for f in force] + [0.0]}
    section = {"EA": 1e9 * run["EI"] / run["L"] ** 2}
    table = rod(run, 0.0, section=section, supports=planar(run, {"at": "start"}), loads=[load])
    beam = beam_of(run.march(_nothing, body=[table], time={"steps": 10}).system)
    limit = 1e-3 * max(1.0, 10 * run.h / run["L"]) ** 4
    return [
        Quantity("tip_x", beam.x[-1, 0], exact.tip[0], limit),
        Quantity("tip_y", beam.x[-1, 1], exact.tip[1], limit),
        Quantity("tip_deviation", float(np.hypot(*(beam.x[-1, :2] - exact.tip)) / run["L"]), 0.0, limit),
        Quantity("tip_angle", slopes(beam)[-1], exact.tip_angle, limit),
        Quantity("clamp_moment", -beam.reactions()[0, 5], exact.clamp_moment, limit),
    ]
