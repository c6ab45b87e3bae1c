"""Two ranks give what one gives."""

import json
import shutil
import subprocess
import sys
from pathlib import Path

import pytest
import ranks
from mpi4py import MPI


def test_two_ranks() -> None:
    """Quantities of nodal and mortar contact in 2 and 3 dimensions, of membranes, mixed and rigid bodies, in time."""
    launcher = Path(sys.executable).parent / "mpiexec"
    mpiexec = str(launcher) if launcher.exists() else shutil.which("mpiexec")
    if mpiexec is None:
        pytest.skip("no mpiexec")
    # A rank that raises leaves the other waiting, hence the time limit.
    done = subprocess.run(
        [mpiexec, "-n", "2", sys.executable, ranks.__file__],
        capture_output=True,
        text=True,
        timeout=120,
        check=False,
        cwd=Path(__file__).parents[2],
    )
    assert done.returncode == 0, done.stderr[-2000:]
    two = json.loads(done.stdout)
    one = ranks.quantities(MPI.COMM_SELF)
    assert two.keys() == one.keys()
    for name, value in one.items():
        assert two[name] == pytest.approx(value, rel=1e-9, abs=1e-12, nan_ok=True), name
