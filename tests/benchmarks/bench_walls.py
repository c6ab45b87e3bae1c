"""Time the steps of a wire in a wall that gives way against those in the same wall held fixed, turn by turn.

    OMP_NUM_THREADS=1 python tests/benchmarks/bench_walls.py [SCENE] [--steps N]

Steps in which the wall is solved with, over facets that nothing has touched before, are listed apart. A wall 1e9 times
as stiff shows how far the forces are from those of the rigid one. Times are of the process's CPU, one thread.
"""

from __future__ import annotations

import argparse
import time
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from mpi4py import MPI
from numpy.typing import NDArray

from contact.loop import tolerances
from contact.scene.build import build
from contact.scene.schema import Scene, read_scene
from contact.step import StepResult, step
from contact.system import System
from fem.wall import Wall

Floats = NDArray[np.float64]
SCENE = Path(__file__).parents[2] / "runs" / "wire-in-wall.toml"


@dataclass
class Course:
    """A system on its way, with what its steps took [s] and gave."""

    name: str
    system: System
    scene: Scene
    lam: Floats | None = None
    seconds: list[float] = field(default_factory=list)
    known: list[bool] = field(default_factory=list)
    passes: list[int] = field(default_factory=list)
    results: list[StepResult] = field(default_factory=list)

    def advance(self, number: int) -> None:
        """One step of the scene."""
        size, solver, before = self.scene.time.end / self.scene.time.steps, self.scene.solver, self._columns()
        start = time.process_time()
        result = step(
            self.system, (number + 1) * size, size, solver.method, self.lam, tolerances(self.scene), solver.max_passes
        )
        self.seconds.append(time.process_time() - start)
        self.known.append(self._columns() == before)
        self.lam = result.lam
        self.passes.append(result.passes)
        self.results.append(result)

    def _columns(self) -> int:
        walls = [body for body in self.system.bodies if isinstance(body, Wall)]
        return sum(wall.columns_kept for wall in walls)


def course(path: Path, name: str, factor: float) -> Course:
    """The scene with walls `factor` times as stiff; infinitely so, rigid ones."""
    scene, _ = read_scene(path)
    tables: Any = scene.model_dump(by_alias=True, exclude_unset=True)
    walls = {contact["surface"]["body"] for contact in tables["contact"]}
    for body in tables["body"]:
        if body["name"] not in walls:
            continue
        if np.isinf(factor):
            del body["material"]
            held = [{"tag": support["tag"]} for support in body["supports"]]
            body |= {"kind": "rigid", "supports": held}
        else:
            for law in (body["material"], *body["material"].get("regions", {}).values()):
                if "E" in law:
                    law["E"] *= factor
            for support in body["supports"]:
                if "stiffness" in support:
                    support["stiffness"] *= factor
    scene = Scene.model_validate(tables)
    system = build(scene, MPI.COMM_SELF, path.parent)
    system.prepare()
    return Course(name, system, scene)


def main() -> None:
    """Run and print."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("scene", nargs="?", type=Path, default=SCENE)
    parser.add_argument("--steps", type=int, default=0, help="the first N only")
    options = parser.parse_args()
    soft, rigid, stiff = (
        course(options.scene, name, factor) for name, factor in (("soft", 1.0), ("rigid", np.inf), ("stiff", 1e9))
    )
    steps = options.steps or soft.scene.time.steps
    for number in range(steps):
        for one in (soft, rigid) if number >= 10 else (soft, rigid, stiff):
            one.advance(number)
    print("wall      steps   median    least  passes   met  force  [ms]  worst residuals")
    medians = {}
    for one in (soft, rigid):
        known = np.array(one.known)
        known[:2] = False  # compilation
        times, results = 1e3 * np.array(one.seconds), one.results
        medians[one.name] = float(np.median(times[known]))
        worst = [max(getattr(r.certificate, key) for r in results) for key in ("complementarity", "equilibrium")]
        met = min(int(r.linearisation.met.sum()) for r in results)
        active = min(int((r.lam > 0).sum()) for r in results)
        print(
            f"{one.name:8} {known.sum():6} {medians[one.name]:8.2f} {times[known].min():8.2f} "
            f"{np.array(one.passes)[known].mean():7.2f} {met:5} {active:6}        {worst[0]:.1e} {worst[1]:.1e}"
        )
    first = 1e3 * np.array(soft.seconds)[~np.array(soft.known)]
    wall = next(body for body in soft.system.bodies if isinstance(body, Wall))
    print(f"soft over rigid, medians: {medians['soft'] / medians['rigid']:.2f}")
    print(f"{len(first)} steps over new facets took {first.sum():.0f} ms; {wall.space.size} unknowns")
    off = max(
        float(np.abs(a.lam - b.lam).max() / b.lam.max()) for a, b in zip(stiff.results, rigid.results, strict=False)
    )
    print(f"forces of a wall 1e9 times as stiff, off those of the rigid one: {off:.1e} of the largest")


if __name__ == "__main__":
    main()
