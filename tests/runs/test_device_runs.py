"""Runs of a device: the same record twice, resumed, failed, and the scene that is shipped."""

from __future__ import annotations

import json
from dataclasses import asdict
from pathlib import Path

import numpy as np
import pytest
from program import program
from test_resume import interrupted, same_steps

from contact.certificate import Tolerances
from contact.record import RecordReader, compare
from runs.cli import DONE, NOT_CONVERGED, main

SCENE = """
[[body]]
name = "wire"
kind = "beam"
rayleigh = [20.0, 1e-3]
sections = [{{ length = 0.05, elements = 20, radius = 2.5e-4, E = 20e9, nu = 0.3, density = 8000.0 }}]
placement = {{ start = [-0.05, 0.0, 0.0] }}
supports = [{{ at = "start", push = "1.0 * t" }}]

[[contact]]
name = "wall"
body = "wire"
{more}
[contact.surface]
kind = "vessels"
[[contact.surface.branches]]
name = "tube"
points = [
    [-0.06, 0.0, 0.0, {tube}], [-0.02, 0.0, 0.0, {tube}], [0.0, 0.0, 0.0, {tube}], [0.01, 0.002, 0.0, {tube}],
    [0.02, 0.01, 0.0, {tube}], [0.03, 0.03, 0.0, {tube}]
]

[time]
end = 16e-3
steps = 8
integrator = "implicit-euler"
"""


def written(folder: Path, tube: float = 1e-3, more: str = "") -> Path:
    """The scene's file."""
    scene = folder / "scene.toml"
    scene.write_text(SCENE.format(tube=tube, more=more), encoding="utf8")
    return scene


def test_the_same_twice(tmp_path: Path) -> None:
    """Two runs give the same record, bit for bit; there is contact in it."""
    scene, one, two = written(tmp_path), tmp_path / "one.vtkhdf", tmp_path / "two.vtkhdf"
    for record in (one, two):
        assert main(["run", str(scene), "-o", str(record)]) == DONE
    assert compare(one, two) is None
    with RecordReader(one) as reader:
        assert reader.count == 8
        assert reader.steps()["active"].max() > 0


@pytest.mark.parametrize("after", [1, 6])
def test_resume(after: int, tmp_path: Path) -> None:
    """A run that stops, in flight or in contact, goes on by the same passes to what it would have been."""
    scene, whole = written(tmp_path), tmp_path / "whole.vtkhdf"
    part = interrupted(scene, tmp_path / "part.vtkhdf", after)
    assert main(["run", str(scene), "-o", str(whole)]) == DONE
    assert main(["run", str(scene), "--resume", str(part)]) == DONE
    with RecordReader(whole) as a, RecordReader(part) as b:
        assert a.count == 8
        for key in ("time", "substeps", "passes", "contacts", "active"):
            np.testing.assert_array_equal(b.steps()[key], a.steps()[key], err_msg=key)
        # Closest points are sought from those of the step before, and agree to 1e-12 of the radius: in SI units that is
        # nothing but for normals and stresses, which turn by as much.
        same_steps(a, b, abs=1e-10)


def failed(scene: Path, record: Path, capfd: pytest.CaptureFixture[str]) -> dict[str, list[float]]:
    """Assert exit code 3 with one line, and a record whose last step alone is marked; its rows of steps."""
    capfd.readouterr()
    assert main(["run", str(scene), "-o", str(record)]) == NOT_CONVERGED
    out, err = capfd.readouterr()
    assert out == ""
    assert err.count("\n") == 1, err
    assert "Traceback" not in err
    assert main(["show", str(record), "--steps", "--json"]) == DONE
    assert json.loads(capfd.readouterr().out)
    with RecordReader(record) as reader:
        steps = reader.steps()
        assert not steps["converged"][-1]
        assert steps["converged"][:-1].all()
        assert all(np.isfinite(steps[key]).all() for key in ("complementarity", "equilibrium", "penetration"))
        reader.contact(reader.count - 1)
        reader.fields(reader.count - 1)
    return steps


def test_a_wire_wider_than_its_tube(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    """Exit code 3 and a readable record that says so; what does not converge cannot be resumed."""
    scene = written(tmp_path, tube=2e-4, more="interference = 1.0")
    steps = failed(scene, tmp_path / "r.vtkhdf", capfd)
    assert len(steps["time"]) == 1
    assert main(["run", str(scene), "--resume", str(tmp_path / "r.vtkhdf")]) == 2
    assert "did not converge" in capfd.readouterr().err


def test_a_wall_closes(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    """A clamped start driven through a plane: steps before it are kept, the one that cannot be is marked."""
    (tmp_path / "s.toml").write_text(
        """
        [[body]]
        name = "wire"
        kind = "beam"
        sections = [{ length = 0.02, elements = 8, radius = 2.5e-4, E = 20e9, nu = 0.3 }]
        supports = [{ at = "start", displacement = [0.0, 0.0, "-1e-3 * t"] }]
        [[contact]]
        body = "wire"
        surface = { kind = "plane", point = [0.0, 0.0, -1e-3], normal = [0.0, 0.0, 1.0] }
        [time]
        end = 1.0
        steps = 5
        """,
        encoding="utf8",
    )
    steps = failed(tmp_path / "s.toml", tmp_path / "r.vtkhdf", capfd)
    assert list(steps["converged"]) == [1, 1, 1, 0]


def test_a_solver_that_stops_early(tmp_path: Path) -> None:
    """Exit code 3 and one line that says so; in a process of its own, for PETSc's sake."""
    options = ["-free_ksp_type", "cg", "-free_pc_type", "none", "-free_ksp_max_it", "3"]
    done = program("run", written(tmp_path), "-o", tmp_path / "r.vtkhdf", "--", *options)
    assert done.returncode == NOT_CONVERGED
    assert done.stderr.count("\n") == 1, done.stderr
    assert "converge" in done.stderr


def test_the_shipped_tube(tmp_path: Path) -> None:
    """Every step of `runs/tube.toml` is certified, no point is ever outside, and the tip gets round both bends."""
    scene, record = Path(__file__).parents[2] / "runs" / "tube.toml", tmp_path / "tube.vtkhdf"
    assert main(["run", str(scene), "-o", str(record)]) == DONE
    with RecordReader(record) as reader:
        steps = reader.steps()
        assert steps["converged"].all()
        assert len(steps["time"]) == 100
        for key, limit in asdict(Tolerances()).items():
            assert (steps[key] <= limit).all(), key
        assert steps["active"].max() >= 4
        assert (steps["active"] > 0).all()
        assert min(reader.contact(step)["gap"].min(initial=0.0) for step in range(100)) >= -1e-3 * 1.8e-4
        tip = reader.grid().points[-1] + reader.fields(99)[0]["displacement"][-1]
    assert tip[0] > 0.035
    assert tip[1] == pytest.approx(0.022, abs=3e-3)
