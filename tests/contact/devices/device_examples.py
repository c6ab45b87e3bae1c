"""Wires, surfaces and scenes that the tests of devices share."""

from __future__ import annotations

from typing import Any

import numpy as np
from mpi4py import MPI
from numpy.typing import NDArray

from contact.loop import AcceptedStep, march
from contact.scene.build import build
from contact.scene.schema import Scene
from contact.system import System

Floats = NDArray[np.float64]

RADIUS = 2.5e-4
TUBE = [
    [-0.06, 0.0, 0.0, 1e-3],
    [-0.03, 0.0, 0.0, 1e-3],
    [0.0, 0.0, 0.0, 1e-3],
    [0.02, 0.001, 0.0, 1e-3],
    [0.04, 0.01, 0.0, 1e-3],
    [0.05, 0.025, 0.0, 1e-3],
    [0.05, 0.05, 0.0, 1e-3],
]


def wire(**changes: Any) -> dict[str, Any]:
    """A beam's table: 50 mm of 0.5 mm wire along x that starts 50 mm before the origin."""
    section = {"length": 0.05, "elements": 20, "radius": RADIUS, "E": 20e9, "nu": 0.3, "density": 8000.0}
    section |= changes.pop("section", {})
    placement = {"start": [-0.05, 0.0, 0.0], "direction": [1.0, 0.0, 0.0]}
    return {"name": "wire", "kind": "beam", "sections": [section], "placement": placement, **changes}


def contact(surface: dict[str, Any], **changes: Any) -> dict[str, Any]:
    """The wire against a surface."""
    return {"name": "wall", "body": "wire", "samples": 2, "surface": surface, **changes}


def bent_tube() -> dict[str, Any]:
    """A vessel with a bend."""
    return {"kind": "vessels", "branches": [{"name": "tube", "points": TUBE}]}


def pushed(speed: float, end: float, steps: int, **changes: Any) -> dict[str, Any]:
    """A wire that is pushed into the bent vessel."""
    held = [{"at": "start", "push": f"{speed!r} * t"}]
    return {
        "body": [wire(supports=held, rayleigh=[20.0, 1e-3], **changes)],
        "contact": [contact(bent_tube())],
        "time": {"end": end, "steps": steps, "integrator": "implicit-euler"},
    }


def run(tables: dict[str, Any], comm: Any = MPI.COMM_SELF, watch: Any = None) -> tuple[System, list[AcceptedStep]]:
    """Run a scene to its end; `watch` is called with the system after every step of the scene."""
    scene, steps = Scene.model_validate(tables), []
    system = build(scene, comm)
    system.prepare()

    def sink(accepted: AcceptedStep) -> None:
        steps.append(accepted)
        if watch is not None:
            watch(system, accepted)

    march(system, scene, sink)
    return system, steps


def quantities(comm: Any) -> dict[str, float]:
    """What a wire pushed round a bend and a solid block in the same scene come to, by name. Collective."""
    block = {
        "name": "block",
        "mesh": {"shape": "box", "size": [1.0, 1.0, 1.0], "n": 2, "structured": True},
        "material": {"E": 2.0, "nu": 0.3, "state": "3d"},
        "supports": [{"tag": "left"}],
        "density": 1.0,
        "velocity": [0.0, 0.1, 0.0],
    }
    tables = pushed(0.5, 0.05, 10)
    tables["body"].append(block)
    system, steps = run(tables, comm)
    (beam, _) = system.bodies
    result = {
        "force": max(step.result.lam.sum() for step in steps),
        "norm": float(np.linalg.norm([np.linalg.norm(step.result.lam) for step in steps])),
        "passes": float(sum(step.result.passes for step in steps)),
        "substeps": float(sum(step.substeps for step in steps)),
        **{f"tip {axis}": float(value) for axis, value in zip("xyz", beam.x[-1], strict=True)},
    }
    system.close()
    return result
