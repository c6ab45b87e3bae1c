"""Two ranks beside one; as a program, under mpiexec, it prints the `quantities` of a module on all ranks there are."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
from importlib import import_module
from pathlib import Path
from types import ModuleType

import pytest
from mpi4py import MPI


def on_two_ranks(*command: str | Path, cwd: Path | None = None) -> subprocess.CompletedProcess[str]:
    """A command under the environment's own mpiexec; modules that this process finds are found by it too."""
    launcher = Path(sys.executable).with_name("mpiexec")
    mpiexec = str(launcher) if launcher.exists() else shutil.which("mpiexec")
    if mpiexec is None:
        pytest.skip("no mpiexec")
    # A rank that raises leaves the other waiting, hence the time limit.
    return subprocess.run(
        [mpiexec, "-n", "2", *command],
        capture_output=True, text=True, timeout=120, cwd=cwd, check=False,
        env=os.environ | {"PYTHONPATH": os.pathsep.join(sys.path)},
    )  # fmt: skip


def same_on_two_ranks(examples: ModuleType, rel: float = 1e-9) -> dict[str, float]:
    """Assert that `examples.quantities(comm)` gives on two ranks what it gives on one, which is returned."""
    done = on_two_ranks(sys.executable, __file__, examples.__name__)
    assert done.returncode == 0, done.stderr[-2000:]
    two, one = json.loads(done.stdout), examples.quantities(MPI.COMM_SELF)
    assert two.keys() == one.keys()
    for name, value in one.items():
        assert two[name] == pytest.approx(value, rel=rel, abs=1e-12, nan_ok=True), f"{name}: {two[name]}, not {value}"
    return one


if __name__ == "__main__":
    values = import_module(sys.argv[1]).quantities(MPI.COMM_WORLD)
    if MPI.COMM_WORLD.rank == 0:
        json.dump(values, sys.stdout)
