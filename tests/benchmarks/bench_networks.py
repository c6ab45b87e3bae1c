"""Time the same device in networks of 10 to 10,000 vessel segments.

    OMP_NUM_THREADS=1 python tests/benchmarks/bench_networks.py [SCENE] [--steps N]

Around the scene's own vessels (without a scene, a wire in one vessel of 10 segments) stand others that it never
touches, as near to it as they can lie. Times are of the process's CPU, one thread.
"""

from __future__ import annotations

import argparse
import time
from pathlib import Path
from typing import Any

import numpy as np
from bench_devices import Floats, run

import contact.clock
from contact.loop import AcceptedStep
from contact.scene.schema import Scene, read_scene
from contact.system import System

SEGMENTS = (10, 100, 1_000, 10_000)


def wire_in_a_vessel() -> Scene:
    """A soft wire of 100 elements lies in a bent vessel of 10 segments and is pushed on, half its thickness a step."""
    bend, radius = np.linspace(0.0, 1.0, 8)[:, None], 0.05
    arc = [0.1, 0.0, 0.0] + radius * np.hstack([np.sin(bend), 0 * bend, 1 - np.cos(bend)])
    end = arc[-1] + [0.02 * np.cos(1.0), 0.0, 0.02 * np.sin(1.0)]
    axis = np.vstack([[-0.02, 0.0, 0.0], [0.04, 0.0, 0.0], arc, end])
    section = {"length": 0.1, "elements": 100, "radius": 4.45e-4, "E": 1e8, "nu": 0.33, "density": 6450.0}
    wire = {
        "name": "wire",
        "kind": "beam",
        "rayleigh": [40.0, 5e-3],
        "sections": [section],
        "placement": {"start": [-0.015, 0.0, 0.0], "direction": [1.0, 0.0, 0.0]},
        "supports": [{"at": "start", "push": "0.0445 * t"}],
        "loads": [{"kind": "gravity", "value": [0.0, 9.81, 0.0]}],
    }
    vessel = {"name": "vessel", "points": [[*point, 2e-3] for point in axis.tolist()]}
    lumen = {"kind": "vessels", "branches": [vessel], "spacing": 0.019}
    touch = {"name": "wall", "body": "wire", "samples": 2, "surface": lumen}
    time_table = {"end": 1.0, "steps": 100, "integrator": "implicit-euler"}
    return Scene.model_validate({"body": [wire], "contact": [touch], "time": time_table})


def surrounded(scene: Scene, folder: Path, segments: int) -> tuple[Scene, int]:
    """The scene with vessels of up to 10 segments added until there are `segments`, and how many there are then.

    They lie on a lattice around the box of the scene's own vessels, the nearest ones first, as wide as those are in the
    median and as far apart as their kernels reach.
    """
    from contact.scene.surfaces import BranchTable, tree_of_table

    pair: Any = scene.contacts[0]
    if not getattr(pair.surface, "branches", []):
        raise SystemExit("networks: the scene's first contact must be with vessels given by branches")
    own, _ = tree_of_table(pair.surface, folder).segments()
    missing = segments - len(own)
    if missing <= 0:
        return scene, len(own)
    radius, piece = float(np.median(own[:, 6:])), pair.surface.spacing or 4e-3
    gap = 2 * pair.surface.reach * max(radius, float(own[:, 6:].max()))
    ends = own[:, :6].reshape(-1, 3)
    low, high, size = ends.min(axis=0), ends.max(axis=0), np.array([10 * piece + gap, gap, gap])
    reach = int(np.ceil(np.cbrt(missing))) + 2
    extent = reach + np.ceil((high - low) / size / 2)
    lattice = np.stack(np.meshgrid(*[np.arange(-k, k + 1) for k in extent], indexing="ij"), axis=-1).reshape(-1, 3)
    corner = (low + high) / 2 + lattice * size
    away = np.maximum(low - corner - np.array([10 * piece, 0, 0]), corner - high).max(axis=1)
    order = np.argsort(away, kind="stable")
    order = order[away[order] >= gap][: -(-missing // 10)]
    branches = list(pair.surface.branches)
    for number, start in enumerate(corner[order]):
        count = min(10, missing - 10 * number)
        points = [[start[0] + piece * k, start[1], start[2], radius] for k in range(count + 1)]
        branches.append(BranchTable(name=f"other {number}", points=points))
    surface = pair.surface.model_copy(update={"branches": branches})
    result = scene.model_copy(update={"contacts": [pair.model_copy(update={"surface": surface})]})
    return result, len(tree_of_table(surface, folder).segments()[0])


def networks(scene: Scene, folder: Path, steps: int | None, rounds: int = 4) -> None:
    """Print the median step in each network and how it grows; a step's time is its least over a few equal rounds."""
    cases = {count: case for case, count in (surrounded(scene, folder, n) for n in SEGMENTS)}
    times: dict[int, list[list[tuple[float, float]]]] = {count: [] for count in cases}
    ends: dict[int, tuple[Floats, list[int]]] = {}
    for _ in range(rounds):
        for count, case in cases.items():
            rows: list[tuple[float, float]] = []
            active: list[int] = []

            def sink(system: System, accepted: AcceptedStep, rows: Any = rows, active: Any = active) -> None:
                rows.append((accepted.seconds["total"], accepted.seconds["detect"]))
                active.append(np.count_nonzero(accepted.result.lam > 0))

            system, _ = run(case, folder, steps, sink)
            times[count].append(rows)
            body: Any = system.bodies[0]
            ends[count] = body.x[-1] / body.size, active
            system.close()
    medians = {count: 1e3 * np.median(np.min(of, axis=0), axis=0) for count, of in times.items()}
    fewest = min(cases)
    for count, (step, detection) in medians.items():
        away = np.linalg.norm(ends[count][0] - ends[fewest][0])
        print(
            f"{count:6d} segments: step {step:.3f} ms, growth {step / medians[fewest][0] - 1:+.1%}; detection "
            f"{detection:.3f} ms; active in the median {np.median(ends[count][1]):g}, tip differs by {away:.0e} "
            "of the device's size"
        )


def main() -> None:
    """Run what the command line asks for."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("scene", nargs="?", type=Path)
    parser.add_argument("--steps", type=int)
    arguments = parser.parse_args()
    contact.clock.perf_counter = time.process_time  # type: ignore[attr-defined]
    scene = read_scene(arguments.scene)[0] if arguments.scene else wire_in_a_vessel()
    networks(scene, arguments.scene.parent if arguments.scene else Path(), arguments.steps)


if __name__ == "__main__":
    main()
