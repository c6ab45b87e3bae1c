"""Wires on bodies that give way, for tests and benchmarks."""

from __future__ import annotations

from typing import Any

import numpy as np
from device_examples import run

RADIUS = 5e-4


def pressed(E: float, steps: int = 3, push: float = 0.03, load: float = 0.1, **changes: Any) -> dict[str, Any]:
    """A wire that its weight presses on a block and that is pushed along; E = 0 for a rigid block."""
    wire = {
        "name": "wire",
        "kind": "beam",
        "sections": [{"length": 0.02, "elements": 20, "radius": RADIUS, "E": 2e9, "nu": 0.3, "density": 8000.0}],
        "placement": {"start": [-0.01, 0.0002, 6e-4], "direction": [1.0, 0.0, 0.0]},
        "supports": [{"at": "start", "hold": ["x", "y", "rx", "rz"], "push": f"{push!r} * t"}],
        "loads": [{"kind": "line", "value": [0.0, 0.0, -load / 0.02]}],
        "rayleigh": [20.0, 1e-3],
    }
    mesh = {"shape": "box", "size": [0.04, 0.012, 0.004], "origin": [-0.02, -0.006, -0.004], "n": [10, 4, 2]}
    block = {"name": "block", "mesh": mesh | {"order": 2, "structured": True}, "supports": [{"tag": "bottom"}]}
    block |= {"material": {"E": E, "nu": 0.3, "state": "3d"}} if E else {"kind": "rigid"}
    surface = {"kind": "body", "body": "block", "tag": "top"}
    return {
        "body": [wire, block | changes],
        "contact": [{"name": "wall", "body": "wire", "samples": 2, "surface": surface}],
        "time": {"end": 0.01 * steps, "steps": steps, "integrator": "implicit-euler"},
    }


def quantities(comm: Any) -> dict[str, float]:
    """Forces, passes and places of a wire pushed along a block, with and without mass, by name. Collective."""
    result = {}
    for density in (0.0, 1000.0):
        system, steps = run(pressed(2e5, steps=3, density=density), comm)
        wire, block = system.bodies
        last = steps[-1].result
        moved = float(np.linalg.norm(block.coordinates()) ** 2)
        result |= {
            f"{density:g}: force": float(last.lam.sum()),
            f"{density:g}: norm": float(np.linalg.norm(last.lam)),
            f"{density:g}: passes": float(sum(step.result.passes for step in steps)),
            f"{density:g}: block": float(block.comm.allreduce(moved)),
            f"{density:g}: imbalance": float(last.certificate.equilibrium < 1e-8),
            **{f"{density:g}: tip {axis}": float(x) for axis, x in zip("xyz", wire.x[-1], strict=True)},
        }
        system.close()
    return result
