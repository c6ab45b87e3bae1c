"""Time devices in vessels: a step against its floor, and the contact methods on its problems.

    OMP_NUM_THREADS=1 python tests/benchmarks/bench_devices.py floor SCENE [--steps N] [--set KEY=VALUE] [--wall]
    OMP_NUM_THREADS=1 python tests/benchmarks/bench_devices.py methods SCENE FOLDER [-o PICTURE] [--limit SECONDS]

Times are of the process's CPU, one thread, unless `--wall` asks for the clock on the wall.

floor : over the steps with at least 100 candidates, the median whole step beside its floor: one factor, one column per
    contact that carries force and one Cholesky of that size, times the substeps, on the step's own last matrices.
methods : every contact method on the problems of 20 steps, the first pass of each. They are recorded by a run of the
    scene and kept in FOLDER; where it has them already the scene is not run again.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Callable
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
from scipy.linalg import lapack

from fem import petsc

petsc.initialise()

from petsc4py import PETSc  # noqa: E402

import contact.clock  # noqa: E402
import contact.solvers.gauss_seidel  # noqa: E402
from contact.loop import AcceptedStep  # noqa: E402
from contact.scene.schema import Scene, read_scene  # noqa: E402
from contact.solvers import METHODS, ContactProblem, DenseDelassus  # noqa: E402
from contact.solvers.problem import Floats  # noqa: E402
from contact.system import System  # noqa: E402
from validation.recorded import Answer, answer, record, recorded, run  # noqa: E402

CANDIDATES = 100
EVERY = 10  # floors are timed of one step in so many: the caches are cold in the step after
PROBLEMS = 20
# Milliseconds of a whole step, and its ratio to the floor, that are wanted at most.
TARGET, RATIO = 4.0, 3.0
DIRECT = ("status", "status, warm", "lemke", "kkt")
ITERATIVE = ("gauss-seidel", "tao", "vi-rsls", "vi-ssls")


def seconds(work: Callable[[], Any], runs: int = 3) -> float:
    """The least time of a few runs, by the clock of the steps."""
    clock, times = contact.clock.perf_counter, []
    for _ in range(runs):
        begun = clock()
        work()
        times.append(clock() - begun)
    return min(times)


# --- floor ------------------------------------------------------------------------------------------------------------


class Floor:
    """One factor, columns and one Cholesky, timed on a beam's matrices: by PETSc's block LU, and by the beam's own."""

    def __init__(self) -> None:
        self._matrix: Any = None
        self._ksp = PETSc.KSP().create(PETSc.COMM_SELF)
        self._ksp.setType("preonly")
        self._ksp.getPC().setType("lu")
        self._ksp.getPC().setFactorOrdering("natural")
        self._ksp.setErrorIfNotConverged(True)

    def __call__(self, problem: ContactProblem, lam: Floats) -> Floats:
        """Seconds of factor, columns and Cholesky with PETSc's factor and with the beam's own, (2, 3)."""
        active = np.flatnonzero(lam > 0)
        ((body, H),) = problem.W.H.items()
        own = [seconds(body.matrix.factor), 0.0, 0.0]
        factor = self._factored(body.A)
        if not len(active):
            return np.array([[factor, 0.0, 0.0], own])
        B = np.asfortranarray(H.take(active).sparse().T.toarray())
        # A unit diagonal and a shift let the factorisation run to its end whatever the contacts' dependence.
        W = problem.W.columns(active)[active]
        S = 1 / np.sqrt(np.diag(W))
        W = np.asfortranarray(S[:, None] * W * S + 1e-8 * np.eye(len(S)))
        own[1:] = seconds(lambda: body.solve(B)), seconds(lambda: lapack.dpotrf(W, lower=1))
        rhs, X = (PETSc.Mat().createDense(b.shape, array=b, comm=PETSc.COMM_SELF) for b in (B, np.zeros_like(B)))
        columns = seconds(lambda: self._ksp.matSolve(rhs, X))
        rhs.destroy()
        X.destroy()
        return np.array([[factor, columns, own[2]], own])

    def _factored(self, A: Any) -> float:
        if self._matrix is None:
            self._matrix = A.duplicate(copy=True)
            self._factor()
        times = []
        for _ in range(3):
            A.copy(self._matrix, structure=PETSc.Mat.Structure.SAME_NONZERO_PATTERN)
            times.append(seconds(self._factor, 1))
        return min(times)

    def _factor(self) -> None:
        self._ksp.setOperators(self._matrix)
        self._ksp.setUp()


def floor(scene: Scene, folder: Path, steps: int | None) -> None:
    """Print the median step, its parts and its floor."""
    measure, rows, floors, phases, sets = Floor(), [], [], [], []

    def sink(system: System, accepted: AcceptedStep) -> None:
        result = accepted.result
        sets.append(np.flatnonzero(result.lam > 0))
        candidates = len(result.linearisation.rows)
        if accepted.number > 1 and accepted.converged and candidates >= CANDIDATES:  # the first ones compile kernels
            if len(rows) % EVERY == 0:
                floors.append(accepted.substeps * measure(result.problem, result.lam[result.rows]))
            phases.append(accepted.seconds)
            rows.append((result.passes, accepted.substeps, candidates, len(sets[-1])))

    ended = run(scene, folder, steps, sink)[1]
    if ended:
        print(f"the run ended early: {ended}")
    if not rows:
        raise SystemExit(f"no step has {CANDIDATES} candidates")
    passes, substeps, candidates, active = np.array(rows).T
    totals = np.array([phase["total"] for phase in phases])
    changes = np.mean([not np.array_equal(a, b) for a, b in pairwise(sets)])
    print(f"steps with >= {CANDIDATES} candidates: {len(rows)} of {len(sets)} (but the first two)")
    names = ("passes", "substeps", "candidates", "active")
    for name, values in zip(names, (passes, substeps, candidates, active), strict=True):
        middle, mean, most, last = np.median(values), values.mean(), values.max(), values[-1]
        print(f"{name:11} median {middle:g}, mean {mean:.2f}, most {most}, last {last}")
    print(f"the active set changes in {changes:.0%} of the steps")
    print(f"step        median {1e3 * np.median(totals):.2f} ms (target {TARGET:g}), mean {1e3 * totals.mean():.2f}")
    for phase in ("assemble", "factor", "detect", "delassus", "solve"):
        print(f"  {phase:9} median {1e3 * np.median([p[phase] for p in phases]):.2f} ms")
    for name, parts in zip(("PETSc's LU", "own factor"), np.moveaxis(np.array(floors), 1, 0), strict=True):
        values, (factor, columns, cholesky) = parts.sum(axis=1), 1e3 * np.median(parts, axis=0)
        ratio = totals[::EVERY] / values
        print(
            f"floor by {name}: median {1e3 * np.median(values):.3f} ms (factor {factor:.3f}, columns {columns:.3f}, "
            f"Cholesky {cholesky:.3f}); step/floor: ratio of medians {np.median(totals) / np.median(values):.1f} "
            f"(target {RATIO:g}), median ratio {np.median(ratio):.1f}, "
            f"a pass of accepted substeps {np.median(ratio * (substeps / passes)[::EVERY]):.1f}"
        )


# --- methods ----------------------------------------------------------------------------------------------------------


def methods(files: Path, picture: Path | None) -> None:
    """Print what each method makes of the recorded problems, and draw its error against its time."""
    names, now = (*DIRECT, *ITERATIVE), contact.clock.perf_counter
    table: dict[str, list[Answer]] = {name: [] for name in names}
    points: dict[str, list[Answer]] = {name: [] for name in names}
    steps, sizes, actives, conditions = [], [], [], []
    for name in ("status", "lemke", "gauss-seidel"):  # their kernels compile
        METHODS[name](ContactProblem(DenseDelassus(np.eye(2) + 1), -np.ones(2)), None, 1e-6)
    for file in sorted(files.glob("step_*.npz")):
        problem, start = recorded(file)
        W = problem.W.columns(np.arange(problem.W.size))
        answers = {name: [answer(problem, name, start, 1e-12, now=now)] for name in names}
        if picture is not None:
            for name in ITERATIVE:
                answers[name] += [answer(problem, name, start, t, 0.0, now) for t in (1e-3, 1e-6, 1e-9)]
        every = [one for several in answers.values() for one in several if one.lam is not None]
        best = min(every, key=lambda one: one.residual).lam
        assert best is not None
        norm = np.sqrt(best @ W @ best)
        for one in every:
            difference = one.lam - best
            one.error = float(np.sqrt(max(difference @ W @ difference, 0.0)) / norm) if norm else 0.0
        active = np.flatnonzero(best > 0)
        steps.append(int(file.stem[5:]))
        sizes.append(len(W))
        actives.append(len(active))
        S = 1 / np.sqrt(np.diag(W)[active])
        conditions.append(np.linalg.cond(S[:, None] * W[np.ix_(active, active)] * S) if len(active) else 1.0)
        for name in names:
            table[name].append(answers[name][0])
            points[name] += answers[name]
        problem.primal.destroy()
    print(
        f"{len(steps)} problems; candidates {min(sizes)} to {max(sizes)}, active {min(actives)} to {max(actives)}, "
        f"condition of the active block {min(conditions):.0e} to {max(conditions):.0e}"
    )
    print(f"{'method':14}{'solved':>8}{'ms':>10}{'slowest':>10}{'iterations':>12}{'residual':>10}{'error':>10}")
    for name, rows in table.items():
        good = [row for row in rows if not row.failure]
        line = f"{name:14}{len(good):5d}/{len(rows)}"
        if good:
            times = 1e3 * np.array([row.seconds for row in good])
            line += f"{np.median(times):10.3f}{times.max():10.2f}{np.median([row.iterations for row in good]):12g}"
            line += f"{max(row.residual for row in good):10.0e}{max(row.error for row in good):10.0e}"
        print(line)
    for name, rows in table.items():
        failed = [(step, row) for step, row in zip(steps, rows, strict=True) if row.failure]
        for failure in sorted({row.failure for _, row in failed}):
            those = [(step, row) for step, row in failed if row.failure == failure]
            took, left, off = np.array([(row.seconds, row.residual, row.error) for _, row in those]).T
            print(
                f"{name} fails ({failure}) at steps {', '.join(str(step) for step, _ in those)}: median "
                f"{1e3 * np.median(took):.0f} ms, residual {left.min():.0e} to {left.max():.0e}, "
                f"error {off.min():.0e} to {off.max():.0e}"
            )
    if picture is not None:
        draw(points, picture)


def draw(points: dict[str, list[Answer]], picture: Path) -> None:
    """Error in reaction against time, hollow where the method gave up."""
    import matplotlib

    matplotlib.use("Agg")
    import matplotlib.pyplot as plt

    figure, axes = plt.subplots(figsize=(8, 5.5), layout="constrained")
    colours = ("#000000", "#E69F00", "#56B4E9", "#009E73", "#F0E442", "#0072B2", "#D55E00", "#CC79A7")
    for (name, rows), colour, marker in zip(points.items(), colours, "osD^vP*X", strict=True):
        label: str | None = name
        for failed in (False, True):
            chosen = [
                (1e3 * r.seconds, max(r.error, 1e-16)) for r in rows if bool(r.failure) == failed and r.error >= 0
            ]
            if chosen:
                face = "none" if failed else colour
                axes.scatter(*np.array(chosen).T, s=28, marker=marker, edgecolors=colour, facecolors=face, label=label)
                label = None
    axes.set(xscale="log", yscale="log", xlabel="time [ms]", ylabel="error in reaction, of the most accurate answer")
    axes.legend(title="hollow: gave up", fontsize="small")
    axes.grid(alpha=0.3)
    figure.savefig(picture, dpi=150)
    plt.close(figure)


def main() -> None:
    """Run what the command line asks for."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("what", choices=("floor", "methods"))
    parser.add_argument("scene", type=Path)
    parser.add_argument("folder", nargs="?", type=Path)
    parser.add_argument("--set", action="append", default=[], metavar="KEY=VALUE")
    parser.add_argument("--steps", type=int)
    parser.add_argument("--limit", type=float, default=2.0, help="seconds that gauss-seidel may take")
    parser.add_argument("--wall", action="store_true")
    parser.add_argument("-o", dest="picture", type=Path)
    arguments = parser.parse_args()
    if not arguments.wall:
        contact.clock.perf_counter = time.process_time
    contact.solvers.gauss_seidel.TIME_LIMIT = arguments.limit
    scene, folder = read_scene(arguments.scene, arguments.set)[0], arguments.scene.parent
    if arguments.what == "floor":
        floor(scene, folder, arguments.steps)
    else:
        if arguments.folder is None:
            parser.error("methods needs a folder for its problems")
        arguments.folder.mkdir(parents=True, exist_ok=True)
        if not list(arguments.folder.glob("step_*.npz")):
            ended = record(scene, folder, arguments.folder, arguments.steps, PROBLEMS)
            if ended:
                print(f"the run ended early: {ended}")
        methods(arguments.folder, arguments.picture)


if __name__ == "__main__":
    main()
