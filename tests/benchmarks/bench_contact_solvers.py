"""Time the contact methods beside SciPy's nnls and daqp on Delassus problems of known difficulty.

    OMP_NUM_THREADS=1 python tests/benchmarks/bench_contact_solvers.py [FOLDER] [--family F,…] [--largest C] [--all]

FOLDER holds lcp_FAMILY_C.npz (W, q, Lf with W = Lf Lfᵀ), as ../shared/bench/contact_problems.py writes them; without it
they are generated. `status` has W in memory, `status, columns` asks for its columns one block at a time; the peers have
the factor Lf. `--all` times the other methods too, up to c = 200. Each cell: median milliseconds of CPU (one thread),
ratio to `status`, residual max|min(Wᵢᵢ λᵢ, δᵢ)|/max|q|. Set-up that depends on W alone is not timed.
"""

from __future__ import annotations

import argparse
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

import daqp
import numpy as np
from scipy.optimize import nnls

from contact.solvers import METHODS, ContactNotConvergedError, ContactProblem, DenseDelassus, InfeasibleError
from contact.solvers.problem import Floats, Ints

SCRIPT = Path(__file__).resolve().parents[3] / "shared" / "bench" / "contact_problems.py"
FAMILIES, SIZES = ("beam", "beamdyn", "dup", "rand"), (50, 100, 200, 500, 1000, 2000)
# Milliseconds for `beam` that no peer reaches, from solvers.md.
TARGETS = {100: 0.5, 200: 1.0, 500: 4.0, 1000: 9.0, 2000: 16.0}


class Columns:
    """W by its columns."""

    def __init__(self, W: Floats) -> None:
        self.W = W

    @property
    def size(self) -> int:
        return len(self.W)

    def columns(self, rows: Ints) -> Floats:
        return self.W[rows].T


def solvers(W: Floats, q: Floats, Lf: Floats, everything: bool) -> dict[str, Callable[[], Floats]]:
    """λ by each solver's name; set-up happens here."""
    known, formed = ContactProblem(DenseDelassus(W), q), ContactProblem(Columns(W), q)
    Lf = np.ascontiguousarray(Lf)
    n = Lf.shape[1]
    identity, zero, above = np.eye(n), np.zeros(n), np.full(len(q), 1e30)
    distance = np.vstack([Lf.T, -q])
    result: dict[str, Callable[[], Floats]] = {
        "status": lambda: METHODS["status"](known).lam,
        "status, columns": lambda: METHODS["status"](formed).lam,
        "nnls": lambda: least_distance(distance),
        # min ½|x|² with Lf x ≥ −q
        "daqp": lambda: -daqp.solve(identity, zero, Lf, above, -q, primal_tol=1e-11)[3]["lam"],
    }
    if everything and len(q) <= 200:
        for name in ("lemke", "gauss-seidel", "vi-rsls", "vi-ssls", "tao"):
            tolerance = 1e-10 if name == "gauss-seidel" else 1e-12
            result[name] = lambda name=name, tolerance=tolerance: METHODS[name](known, None, tolerance).lam
    return result


def least_distance(E: Floats) -> Floats:
    """λ of min ½|x|² with Lf x ≥ −q from nnls on E = [Lfᵀ; −qᵀ] (Lawson & Hanson 1974, ch. 23)."""
    target = np.zeros(len(E))
    target[-1] = 1.0
    u = nnls(E, target)[0]
    return np.asarray(u / (1.0 - E[-1] @ u))


def measured(solve: Callable[[], Floats], budget: float = 2.0) -> tuple[float, Floats | None]:
    """Median milliseconds of up to 15 runs after a first one, and λ."""
    times: list[float] = []
    try:
        begun = time.process_time()
        lam = solve()
        if time.process_time() - begun > 5 * budget:
            return 1e3 * (time.process_time() - begun), lam
        while len(times) < 15 and sum(times) < budget:
            begun = time.process_time()
            solve()
            times.append(time.process_time() - begun)
    except ContactNotConvergedError as error:
        return 1e3 * (time.process_time() - begun), error.lam
    except (InfeasibleError, RuntimeError):
        return np.nan, None
    return 1e3 * float(np.median(times)), lam


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", nargs="?", type=Path)
    parser.add_argument("--family", default=",".join(FAMILIES))
    parser.add_argument("--largest", type=int, default=SIZES[-1])
    parser.add_argument("--all", action="store_true")
    arguments = parser.parse_args()
    with tempfile.TemporaryDirectory() as temporary:
        folder = arguments.folder
        if folder is None:
            folder = Path(temporary)
            subprocess.run([sys.executable, str(SCRIPT), str(folder)], check=True)
        for family in arguments.family.split(","):
            for c in (size for size in SIZES if size <= arguments.largest):
                with np.load(folder / f"lcp_{family}_{c}.npz") as data:
                    W, q, Lf = data["W"], data["q"], data["Lf"]
                cells, reference = [f"{family:8}{c:5d}"], np.nan
                for name, solve in solvers(W, q, Lf, arguments.all).items():
                    milliseconds, lam = measured(solve)
                    if lam is None:
                        cells.append(f"{name} failed")
                        continue
                    residual = np.abs(np.minimum(W @ lam + q, np.diag(W) * lam)).max() / np.abs(q).max()
                    reference = milliseconds if name == "status" else reference
                    target = (
                        f", target {TARGETS[c]:g}" if name == "status" and family == "beam" and c in TARGETS else ""
                    )
                    cells.append(
                        f"{name} {milliseconds:.2f} ms (×{milliseconds / reference:.1f}, {residual:.0e}{target})"
                    )
                print(" | ".join(cells), flush=True)


if __name__ == "__main__":
    main()
