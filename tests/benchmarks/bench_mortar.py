"""Time two solids in contact on non-matching meshes, in space: seconds per phase, memory, and the forces.

    OMP_NUM_THREADS=1 python tests/benchmarks/bench_mortar.py [--scale S] [--sliding finite] [--keep FILE.npy]
    OMP_NUM_THREADS=1 mpiexec -n 2 python tests/benchmarks/bench_mortar.py …

A slab whose lower side bulges is pressed on a block until most of that side touches. With the default scale the bodies
have more than 300,000 unknowns and 2,000 contacts that carry force. Forces are kept by the places of their vertices, so
that runs on different numbers of ranks can be compared: `--against FILE.npy` does it.
"""

from __future__ import annotations

import argparse
import resource
import time
from typing import Any

import numpy as np
from mpi4py import MPI

from contact.certificate import Tolerances
from contact.clock import Clock
from contact.scene.build import build
from contact.scene.schema import Scene
from contact.step import step
from meshes.generators import generate
from meshes.mesh import Mesh

BULGE, PUSH = 0.012, 0.02


def pressed_slab(scale: float, order: int, sliding: str) -> Scene:
    """The scene; `scale` multiplies the numbers of cells along the sides."""
    fine, coarse = (max(1, round(n * scale)) for n in (52, 21))
    thin, thick = (max(1, round(n * scale)) for n in (4, 6))
    slab = generate("box", size=[2.0, 2.0, 0.4], n=[fine, fine, thin], order=order, structured=True, origin=[-1, -1, 0])
    x, y, z = slab.points.T
    # Straight cells: a mid node follows its edge's ends.
    lifted = slab.points + np.stack([0 * x, 0 * x, BULGE * (x**2 + y**2) * (1 - z / 0.4)], axis=1)
    if order == 2:
        for edge, middle in zip(((0, 1), (1, 2), (0, 2), (0, 3), (1, 3), (2, 3)), range(4, 10), strict=True):
            lifted[slab.cells[:, middle]] = lifted[slab.cells[:, list(edge)]].mean(axis=1)
    block = {
        "size": [2.4, 2.4, 1.2],
        "n": [coarse, coarse, thick],
        "origin": [-1.2, -1.2, -1.2],
        "grading": [1, 1, 0.4],
    }
    table = {
        "body": [
            {
                "name": "slab",
                "mesh": Mesh(lifted, slab.cells, slab.facets),
                "material": {"E": 1.0, "nu": 0.3, "state": "3d"},
                "supports": [
                    {"tag": "top", "component": c, "value": v} for c, v in (("x", 0.0), ("y", 0.0), ("z", -PUSH))
                ],
            },
            {
                "name": "block",
                "mesh": {"shape": "box", "structured": True, "order": order, **block},
                "material": {"E": 2.0, "nu": 0.3, "state": "3d"},
                "supports": [{"tag": "bottom"}],
            },
        ],
        "contact": [
            {
                "name": "sides",
                "body": "slab",
                "tag": "bottom",
                "surface": {"kind": "body", "body": "block", "tag": "top"},
                "sliding": sliding,
                "interference": 1e-6,
            }
        ],
    }
    return Scene.model_validate(table)


def main() -> None:
    """Run what the command line asks for."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--scale", type=float, default=1.0)
    parser.add_argument("--order", type=int, default=2)
    parser.add_argument("--sliding", choices=["small", "finite"], default="small")
    parser.add_argument("--keep", help="write places and forces")
    parser.add_argument("--against", help="compare the forces with those kept by another run")
    arguments = parser.parse_args()
    comm, clock, begin, cpu = MPI.COMM_WORLD, Clock(), time.perf_counter(), time.process_time()
    system = build(pressed_slab(arguments.scale, arguments.order, arguments.sliding), comm, clock=clock)
    clock.lap()
    built = time.perf_counter() - begin
    system.prepare()
    result = step(system, 1.0, tolerances=Tolerances(surface_error=1e-8, penetration=1e-8))
    seconds: dict[str, Any] = clock.lap()
    found = result.linearisation.constraints[0]
    order = np.lexsort(np.round(found.places, 9).T)
    forces = np.column_stack([found.places, result.lam])[order]
    memory = comm.allreduce(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 2**20)
    used = comm.allreduce(time.process_time() - cpu)
    unknowns = sum(body.space.size for body in system.bodies)
    system.close()
    if comm.rank:
        return
    print(f"{comm.size} rank(s): {unknowns} unknowns, {found.count} contacts, {(result.lam > 0).sum()} with force")
    print(
        f"force {result.lam.sum():.12g}, passes {result.passes}, iterations {result.iterations}, {result.certificate}"
    )
    phases = ", ".join(f"{name} {spent:.2f}" for name, spent in seconds.items())
    print(f"seconds: meshes and spaces {built:.2f}, {phases}; CPU {used:.1f}, memory {memory:.2f} GiB")
    if arguments.keep:
        np.save(arguments.keep, forces)
    if arguments.against:
        other = np.load(arguments.against)
        away = np.abs(other - forces).max(axis=0)
        relative = away[3] / forces[:, 3].max()
        print(f"forces differ by {relative:.2e} of the largest, their places by {away[:3].max():.1e} m")


if __name__ == "__main__":
    main()
