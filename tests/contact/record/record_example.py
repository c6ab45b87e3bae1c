"""A record as example: cells of every type, steps that are functions of their number, a program that writes them.

``python record_example.py PATH COUNT`` continues PATH, or begins it, up to COUNT steps and prints the number of each
step once it is recorded.
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np

from contact.record import CERTIFICATE, PHASES, Grid, Record, StepData

CELLS = {1: [0], 3: [0, 1], 4: [0, 1, 2, 3], 5: [1, 2, 3], 10: [4, 5, 6, 7], 21: [0, 2, 1]}
CELLS |= {22: [0, 1, 2, 3, 4, 5], 24: list(range(8, 18))}
SCENE = 'name = "µ"\n'
RUN = {"version": "0.1.0", "ranks": 2, "ksp_rtol": 1e-10, "left out": "mass, damping"}


def grid() -> Grid:
    sizes = [len(cell) for cell in CELLS.values()]
    return Grid(
        points=np.random.default_rng(0).random((18, 3)),
        connectivity=np.concatenate(list(CELLS.values())),
        offsets=np.cumsum([0, *sizes]),
        types=np.array(list(CELLS), dtype=np.uint8),
        body=np.arange(len(CELLS)) // 2,
    )


def step(k: int) -> StepData:
    """Step k: k mod 5 contacts, so that some steps have none, and a checkpoint whose λ shrinks and grows."""
    random = np.random.default_rng(k)
    points, cells, contacts = 18, len(CELLS), k % 5
    return StepData(
        time=0.1 * (k + 1),
        dt=0.1,
        substeps=1 + k % 2,
        passes=k % 3,
        iterations=k,
        contacts=contacts,
        converged=k % 7 != 3,
        certificate=dict(zip(CERTIFICATE, random.random(4), strict=True)),
        seconds=dict(zip(PHASES, random.random(7), strict=True)),
        point_data={"displacement": random.random((points, 3)), "force": random.random((points, 3))},
        cell_data={"stress": random.random((cells, 6)), "status": random.integers(0, 2, cells)},
        lam=np.arange(contacts) * 0.5,
        gap=random.random(contacts),
        point=random.random((contacts, 3)),
        normal=random.random((contacts, 3)),
        body=np.arange(contacts),
        status=(np.arange(contacts) > 0).astype(np.int64),
        checkpoint={
            "wire/x": random.random((points, 6)),
            "lambda": random.random(contacts),
            "fixed": random.random(3) < 0.5,
            "dt": 0.1,
            "step": k,
        },
    )


def write(path: Path, count: int) -> None:
    """A record of the first `count` steps."""
    with Record.create(path, grid(), SCENE, RUN) as record:
        for k in range(count):
            record.append(step(k))


def main(path: Path, count: int) -> None:
    with Record.resume(path) if path.exists() else Record.create(path, grid(), SCENE, RUN) as record:
        for k in range(record.count, count):
            record.append(step(k))
            print(k, flush=True)


if __name__ == "__main__":
    main(Path(sys.argv[1]), int(sys.argv[2]))
