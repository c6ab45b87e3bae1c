"""Wires and coils that press on the inside of tubes, and a spring on a convolution surface.

The shapes are reached by implicit Euler with steps so long that it damps all motion and a mass that keeps A definite;
the answer has no inertia left. Contact points are the nodes.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from contact.system import System
from validation.case import Parameter, Quantity, Rates, Run, Solved, case
from validation.cases.beams import beam_of, count, elements, planar, rod, slopes
from validation.cases.rods import aligned
from validation.exact.helices import CoilTube, Helix, HelixTube
from validation.exact.rods import WireTube
from validation.exact.surfaces import SpringSurface
from validation.exact.tube_elastica import WireTubeElastica

Floats = NDArray[np.float64]
STEPS = 20
SOLVER = {"surface_error": 1e-6, "penetration": 1e-6}
TIME = {"end": float(STEPS), "steps": STEPS, "integrator": "implicit-euler"}


def _levels(parameters: dict[str, Parameter]) -> tuple[float, ...]:
    """The middle on a node in point contact; in line contact its ends at the same place between two."""
    exact = WireTubeElastica(**parameters)  # type: ignore[arg-type]
    if exact.regime != "line":
        return elements(8, 16)(parameters)
    return aligned(exact.s, exact.L, 20)


def _rates(parameters: dict[str, Parameter]) -> Rates:
    """None in point contact, where elements of any length are nearly exact."""
    line = WireTubeElastica(**parameters).regime == "line"  # type: ignore[arg-type]
    return {"force": {1: (2.0, 0.3)}} if line else {}


@case(
    "wire-tube",
    {"EI": 1.0, "L": 0.3, "R": 1.0, "c": 1e-3},
    levels=_levels,
    variants=({}, {"L": 0.2}, {"L": 0.5, "c": 0.01}, {"L": 0.1, "c": 1e-4}),
    orders=(1,),
    rates=_rates,
)
def wire_tube(run: Run) -> list[Quantity]:
    """A straight wire in a circular tube: the elastica's forces, and the linear formula beside them."""
    exact = WireTubeElastica(**run.values("EI", "L", "R", "c"))
    EI, L, R, c = (run[k] for k in ("EI", "L", "R", "c"))
    angle = np.linspace(-0.5, 0.6, 401) * L / R
    placement = {"path": (R * np.stack([np.sin(angle), -np.cos(angle), 0 * angle], axis=1)).tolist()}
    # Nothing else keeps the wire from sliding round the tube; by symmetry it takes no force.
    supports = planar(run, {"at": L / 2, "hold": ["x"]})
    section = {"EA": 1e6 * EI / L**2, "mass": 24 * EI / L**4}
    tube = {"kind": "torus", "centre": [0.0] * 3, "axis": [0.0, 0.0, 1.0], "bend": R, "radius": 2 * c, "inside": True}
    solved = run.march(
        lambda *_: None,
        body=[rod(run, c, section=section, placement=placement, supports=supports)],
        contact=[{"body": "beam", "samples": 1, "surface": tube}],
        solver=SOLVER,
        time=TIME,
    )
    body, lam = beam_of(solved.system), solved.forces()
    arc = np.linspace(0.0, L, len(lam))
    inner = lam.copy()
    inner[[0, -1]] = 0.0
    bend = (np.diff(slopes(body)) / body.data.length)[count(run) // 2 :]
    tip = (lam[0] + lam[-1]) / 2
    limit = 2e-3 * max(1.0, 30 * run.h / exact.s if exact.regime == "line" else 4 * run.h / exact.s) ** 2
    linear = WireTube(EI=EI, L=L, R=R, c=c)
    return [
        Quantity("tip_force", tip, exact.tip_force, limit),
        Quantity("inner_force", inner.sum(), exact.force - 2 * exact.tip_force, limit),
        Quantity("force", lam.sum(), exact.force, limit),
        Quantity("s", inner @ np.minimum(arc, L - arc) / inner.sum(), exact.s, 2 * limit),
        # In point contact the curvature has a kink in the middle.
        Quantity("middle_curvature", 1.5 * bend[0] - 0.5 * bend[1], exact.middle_curvature, limit),
        # The curved tube adds about 3c/R to the linear force.
        Quantity("linear_tip_force", tip, linear.tip_force, limit + 4 * c / R),
    ]


def _in_tube(run: Run, exact: Helix, L: float, section: dict[str, Any], begin: Any = None, **end: Any) -> Solved:
    """A rod on the infinite solution inside its tube; both ends are held there, but that the far one slides axially."""
    EI, r = run["EI"], run["r"]
    a = 0.1 * r
    path = exact.position(np.linspace(0.0, 1.01 * L, 1 + round(200 * run["n"])))
    loads = end.pop("loads", [])
    section |= {"length": L, "elements": _count(run, L), "radius": a, "EA": 1e5 * EI / r**2, "EI": EI}
    beam = {
        "name": "beam",
        "kind": "beam",
        "sections": [section],
        "placement": {"path": path.tolist(), "roll": np.pi},
        "supports": [{"at": "start"}, {"at": "end", "hold": ["x", "y", "rx", "ry", "rz"], **end}],
        "loads": loads,
    }
    tube = {"kind": "cylinder", "centre": [0.0] * 3, "axis": [0.0, 0.0, 1.0], "radius": r + a, "inside": True}
    contact = {"body": "beam", "samples": 1, "surface": tube, "interference": 1e-3 * r}
    begin = begin or (lambda system: None)
    return run.march(lambda *_: None, begin, body=[beam], contact=[contact], solver=SOLVER, time=TIME)


def _count(run: Run, L: float) -> int:
    """An even number of elements, so that a node is in the middle."""
    return 2 * max(1, round(L / run.h / 2))


def _middle(solved: Solved, L: float) -> tuple[float, float]:
    """Force per length over the middle third, and the angle between tangent and axis in the middle."""
    lam, R = solved.forces(), beam_of(solved.system).R
    third = np.abs(np.linspace(-0.5, 0.5, len(lam))) <= 1 / 6
    return float(lam[third].mean() * (len(lam) - 1) / L), float(np.arccos(R[len(R) // 2, 2, 0]))


@case(
    "helix-tube",
    {"EI": 1.0, "r": 1.0, "beta": np.pi / 9, "n": 2.0},
    levels=lambda p: tuple(float(p["r"]) * h for h in (1.6, 1.2, 0.9, 0.7)),
    orders=(1,),
    rates={"f": {1: (4.0, 0.5)}},
)
def helix_tube(run: Run) -> list[Quantity]:
    """A compressed rod, n turns of a helix at the angle β [rad] in a tube, under the force that least energy selects.

    The ends have the position and the frame of the infinite solution; the far one slides axially under its F.
    """
    exact = HelixTube(**run.values("EI", "r", "beta"))
    F, L = exact.compression, run["n"] * exact.pitch / np.cos(exact.angle)
    push = {"kind": "point", "at": "end", "value": [0.0, 0.0, -F]}
    section = {"GJ": exact.EI, "mass": F**2 / (4 * exact.EI)}
    solved = _in_tube(run, exact, L, section, loads=[push])
    f, beta = _middle(solved, L)
    limit = 5e-3 * max(1.0, run.h / run["r"]) ** 4
    return [
        Quantity("f", f, exact.f, limit),
        Quantity("F", beam_of(solved.system).reactions()[0, 2], F, limit),
        Quantity("beta", beta, exact.angle, limit),
    ]


BETA = np.radians(80.0)


@case(
    "coil-tube",
    {
        "EI": 1.0,
        "GJ": 1 / 1.3,
        "r": 1.0,
        "kappa0": np.sin(BETA) ** 2 / 1.5,
        "tau0": np.sin(BETA) * np.cos(BETA) / 1.5,
        "n": 4.0,
    },
    levels=lambda p: tuple(float(p["r"]) * h for h in (0.4, 0.28, 0.2, 0.14)),
    orders=(1,),
    rates={"f": {1: (2.0, 0.3)}},
)
def coil_tube(run: Run) -> list[Quantity]:
    """A coil of natural curvature κ₀ and torsion τ₀, n turns in a tube that is too narrow for it.

    The ends have the position and the frame of the infinite solution; the far one slides axially without force. Where
    torsion and bending mix, GJ ≠ EI leaves the elements an error of h².
    """
    exact = CoilTube(**run.values("EI", "GJ", "r", "kappa0", "tau0"))
    EI, r, square = run["EI"], run["r"], exact.kappa0**2 + exact.tau0**2
    L = run["n"] * exact.pitch / np.cos(exact.angle)
    rest = {"kind": "helix", "radius": exact.kappa0 / square, "pitch": 2 * np.pi * exact.tau0 / square}

    def begin(system: System) -> None:
        """Frenet's frames; those of a path do not turn about it."""
        beam = beam_of(system)
        beam.resume({**beam.checkpoint(), "R": exact.frame(np.linspace(0.0, L, len(beam.x)))})

    section = {"GJ": exact.GJ, "mass": EI / r**4, "shape": rest}
    solved = _in_tube(run, exact, L, section, begin, twist=exact.tau * L)
    f, beta = _middle(solved, L)
    limit = 5e-3 * max(1.0, 3 * run.h / r) ** 2
    return [Quantity("f", f, exact.f, limit), Quantity("beta", beta, exact.angle, limit)]


@case("spring-surface", {"k": 1.0, "d": 0.1, "s": 2.0, "T": 0.5}, orders=(1,))
def spring_surface(run: Run) -> list[Quantity]:
    """A point on a spring k anchored at the depth d outside the tube of an endless line: λ = kd where it is closest."""
    exact = SpringSurface(**run.values("k", "d", "s", "T"))
    k, d, radius = run["k"], run["d"], exact.radius
    a, L = 1.1 * d, 0.6 * radius  # a device's axis starts within the wall's
    # No direction is one of coordinates; the line passes through the origin.
    line, out = np.array([2.0, 3.0, 6.0]) / 7, np.array([6.0, 2.0, -3.0]) / 7
    far = 1e4 / run["s"] * line
    spring = {
        "name": "spring",
        "kind": "beam",
        "sections": [{"length": L, "elements": 1, "radius": a, "EA": k * L, "GJ": k * L**3, "EI": k * L**3}],
        "placement": {"start": ((radius - a + d - L) * out).tolist(), "direction": out.tolist()},
        "supports": [{"at": "start"}],
    }
    tube = {"kind": "cauchy", "segments": [[(-far).tolist(), far.tolist()]], "width": run["s"], "level": run["T"]}
    contact = {"body": "spring", "samples": 1, "surface": {**tube, "inside": True}, "interference": 1.001 * d}
    solver = {"complementarity": 1e-11, "equilibrium": 1e-11, "surface_error": 1e-8}
    solved = run.march(lambda *_: None, body=[spring], contact=[contact], solver=solver)
    tip = beam_of(solved.system).x[-1]
    distance = float(np.linalg.norm(tip - (tip @ line) * line)) + a
    return [
        Quantity("reaction", solved.forces().sum(), exact.reaction, 1e-10),
        Quantity("radius", distance, radius, 1e-10),
    ]
