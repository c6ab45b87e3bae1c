"""A wire among walls: each step balanced and certified, at any speed, the same on each run and any number of ranks."""

from __future__ import annotations

import json
import shutil
import subprocess
import sys
from dataclasses import asdict
from itertools import pairwise
from pathlib import Path

import device_examples
import numpy as np
import pytest
from device_examples import RADIUS, pushed, run, wire
from device_examples import contact as contact_table
from mpi4py import MPI

import contact.devices.device_contact
import contact.step
from contact.certificate import Tolerances
from contact.clock import Clock
from contact.linearisation import Linearisation
from contact.record import Record, RecordReader, compare
from contact.solvers.problem import ContactNotConvergedError
from contact.surfaces.detection import nearest
from runs.cli import DONE, NOT_CONVERGED, main

STEPS = """
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


def pressed(name, **changes):
    """A clamped wire whose other end is pushed down on something in its way, under a line load, in statics."""
    surface, way = OBSTACLES[name]
    loads = [{"kind": "line", "value": [0.3, -0.2, -0.4]}]
    supports = [{"at": "start"}, {"at": "end", "displacement": [0.0, 0.0, f"-{way} * t"], "hold": ["z", "y"]}]
    return {
        "body": [wire(supports=supports, loads=loads)],
        "contact": [contact_table(surface)],
        "time": {"steps": 4},
        **changes,
    }


OBSTACLES = {
    "plane": ({"kind": "plane", "point": [-0.025, 0.0, -RADIUS - 6e-4], "normal": [0.01, 0.0, 1.0]}, 1e-3),
    "post": (
        {"kind": "cylinder", "centre": [-0.02, 0.0, -RADIUS - 2e-3], "axis": [0.0, 1.0, 0.0], "radius": 1.9e-3},
        2e-3,
    ),
    "ball": ({"kind": "sphere", "centre": [-0.02, 3e-4, -RADIUS - 2e-3], "radius": 1.9e-3}, 2e-3),
    "tube": (
        {"kind": "cylinder", "centre": [0.0] * 3, "axis": [1.0, 0.0, -0.01], "radius": 8e-4, "inside": True},
        4e-4,
    ),
}


@pytest.mark.parametrize("name", OBSTACLES)
def test_pressed(name):
    """Certified; supports, contact forces along the normals and the load add up to nothing, and gaps are true."""
    system, steps = run(pressed(name))
    assert len(steps) == 4
    assert all(step.result.certificate.within(Tolerances()) for step in steps)
    (body,), (pair,) = system.bodies, system.pairs
    result = steps[-1].result
    lam = result.lam
    assert (lam >= 0).all()
    assert (lam > 0).any()
    n = result.linearisation.constraints[0].normals
    (H,) = result.linearisation.H.values()
    along = H.apply_transpose(lam).reshape(-1, 6)
    # Rows have the normals as their sums over the nodes' displacements.
    np.testing.assert_allclose(along[:, :3].sum(axis=0), lam @ n, atol=1e-12 * lam.sum())
    support = body.reactions() - np.where(body.fixed, along.ravel(), 0.0).reshape(-1, 6)
    load = np.array([0.3, -0.2, -0.4]) * 0.05
    total = support[:, :3].sum(axis=0) + lam @ n + load
    np.testing.assert_allclose(total, 0.0, atol=1e-7 * (np.abs(support[:, :3]).sum() + lam.sum()))
    p = pair.accepted
    moments = np.cross(p, lam[:, None] * n).sum(axis=0)
    moments += np.cross(body.x, support[:, :3]).sum(axis=0) + support[:, 3:].sum(axis=0)
    moments += _moment_of_the_load(body, np.array([0.3, -0.2, -0.4]))
    np.testing.assert_allclose(moments, 0.0, atol=1e-7 * 0.05 * (np.abs(support[:, :3]).sum() + lam.sum()))
    true = nearest(pair.surface, p).distance - RADIUS
    assert (np.abs(true[lam > 0]) <= 1e-6 * RADIUS).all()
    assert (true >= -1e-6 * RADIUS).all()
    np.testing.assert_allclose(result.gap[pair.candidates], true[pair.candidates], atol=1e-12)
    system.close()


def _moment_of_the_load(body, q):
    """About the origin, of a line load on the Hermite interpolation of the centreline."""
    middle = (body.x[:-1] + body.x[1:]) / 2
    t = body.R[:, :, 0]
    length = body.data.length[:, None]
    places = length * middle + length**2 / 12 * (t[:-1] - t[1:])
    return np.cross(places, q).sum(axis=0)


@pytest.mark.parametrize("name", ["post", "ball"])
def test_passes_converge_quadratically(name, monkeypatch):
    """On a wall that bulges towards the wire a pass about squares the residual, once the active set has settled."""
    passes, certify = [], contact.step.certify

    def watch(system, lin, lam, *rest):
        found = certify(system, lin, lam, *rest)
        passes.append((found.residual, np.flatnonzero(lam).tolist()))
        return found

    monkeypatch.setattr(contact.step, "certify", watch)
    run(pressed(name, time={"steps": 8}))[0].close()
    orders = [
        np.log(after) / np.log(before)
        for (before, one), (after, two) in pairwise(passes)
        if 1e-6 < before < 1e-2 and one == two
    ]
    assert len(orders) >= 4
    assert min(orders) > 1.4


@pytest.mark.parametrize("name", ["post", "ball"])
def test_forces_of_a_pass_do_not_depend_on_the_brace(name, monkeypatch):
    """A brace across a bulging wall holds what its contact holds anyway; its part of the force is not the contact's."""
    certify, passes = contact.step.certify, []
    monkeypatch.setattr(contact.step, "certify", lambda *given: passes[-1].append(given[2]) or certify(*given))
    for brace in (10.0, 100.0):
        monkeypatch.setattr(contact.devices.device_contact, "BRACE", brace)
        passes.append([])
        run(pressed(name, time={"steps": 1}))[0].close()
    assert len(passes[0]) == len(passes[1]) >= 4
    for one, other in zip(*passes, strict=True):
        np.testing.assert_allclose(other, one, rtol=1e-9)


def test_constraints_out_of_reach_stay_out_of_the_problem():
    """Those with force, violated ones, and those within four times the largest gap that these have to lose."""
    every = np.ones(6, dtype=bool)
    lin = Linearisation([], {}, {}, np.zeros(6), every, every, np.arange(6), None, Clock())
    gaps = np.array([0.01, -0.02, 0.0799, 0.0801, 0.5, -0.001])
    lin.narrow(gaps)
    np.testing.assert_array_equal(lin.rows, np.arange(6))
    lin.base = np.array([0.0, 0.0, 0.0, 0.0, 1e-3, 0.0])
    lin.narrow(np.minimum(gaps, 0.02))
    np.testing.assert_array_equal(lin.rows, np.arange(6))
    lin.base = np.array([1e-3, 0.0, 0.0, 0.0, 0.0, 0.0])
    lin.narrow(gaps)
    np.testing.assert_array_equal(lin.rows, [0, 1, 2, 5])


@pytest.mark.parametrize("method", ["gauss-seidel", "lemke", "kkt"])
def test_methods_agree(method):
    """The same forces by every contact method, to the tolerance of the step."""
    forces = []
    for name in ("status", method):
        system, steps = run(pressed("post", solver={"method": name}))
        n = steps[-1].result.linearisation.constraints[0].normals
        forces.append(steps[-1].result.lam @ n)
        system.close()
    np.testing.assert_allclose(forces[1], forces[0], atol=1e-6 * np.linalg.norm(forces[0]))


# --- speed ------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("diameters", [0.1, 1.0, 10.0, 100.0])
def test_inserted_at_any_speed(diameters):
    """A wire pushed by so many diameters a step stays in its vessel, certified, or the run says that it failed."""
    way = {0.1: 8e-3, 1.0: 20e-3, 10.0: 40e-3, 100.0: 50e-3}[diameters]
    count = round(way / (2 * RADIUS * diameters))
    tables = pushed(0.5, way / 0.5, count)
    first = -0.037 if diameters == 0.1 else -0.04  # where the wall is about to be met
    tables["body"][0]["placement"]["start"] = [first, 0.0, 0.0]
    seen = []

    def watch(system, step):
        (pair,) = system.pairs
        if step.converged:
            assert step.result.certificate.within(Tolerances())
            inside = nearest(pair.surface, pair.accepted).distance - RADIUS
            assert inside.min() >= -1e-3 * RADIUS
            seen.append((step.substeps, int((step.result.lam > 0).sum())))

    try:
        system, _ = run(tables, watch=watch)
        (body,) = system.bodies
        assert body.x[0, 0] == pytest.approx(first + way, rel=1e-9)
    except ContactNotConvergedError:
        assert diameters == 100.0
        return
    assert len(seen) == count
    assert max(active for _, active in seen) > 0


@pytest.mark.parametrize("diameters", [0.1, 1.0, 10.0, 100.0])
@pytest.mark.parametrize("kind", ["sphere", "cylinder"])
def test_thrown_at_an_obstacle_at_any_speed(kind, diameters):
    """A free wire that flies at something thinner than its way in one step never comes out behind it."""
    obstacle = {"kind": kind, "centre": [-0.025, 0.0, -2e-3], "radius": 1e-3}
    if kind == "cylinder":
        obstacle["axis"] = [0.0, 1.0, 0.0]
    speed, dt = 5.0, 2 * RADIUS * diameters / 5.0
    count = min(max(4, round(3e-3 / (speed * dt))), 60)
    tables = {
        "body": [wire(velocity=[0.0, 0.0, -speed], rayleigh=[0.0, 1e-4])],
        "contact": [contact_table(obstacle)],
        "time": {"end": count * dt, "steps": count, "integrator": "implicit-euler"},
    }
    above = []

    def watch(system, step):
        if not step.converged:
            return
        (pair,) = system.pairs
        over = np.argmin(np.abs(pair.places[:, 0] + 0.025))
        above.append(pair.accepted[over, 2])
        assert step.result.certificate.within(Tolerances())
        assert nearest(pair.surface, pair.accepted).distance.min() >= RADIUS * (1 - 1e-3)

    try:
        run(tables, watch=watch)
    except ContactNotConvergedError:
        assert diameters == 100.0
    else:
        assert above[-1] > -speed * count * dt + 1e-3  # it was stopped
    assert all(z > -2e-3 for z in above)


def test_a_step_far_too_large_is_divided():
    """One step of the scene over the whole bend: substeps, and the same place at the end as the scene asks for."""
    system, steps = run(pushed(0.05, 0.9, 1))
    assert len(steps) == 1
    assert steps[0].substeps > 1
    assert steps[0].result.certificate.within(Tolerances())
    (body,), (pair,) = system.bodies, system.pairs
    assert body.x[0, 0] == pytest.approx(-0.005, rel=1e-9)
    assert nearest(pair.surface, pair.accepted).distance.min() >= RADIUS * (1 - 1e-3)
    assert body.x[-1, 1] > 5e-3  # it followed the bend
    system.close()


# --- runs -------------------------------------------------------------------------------------------------------------


def written(folder: Path, tube=1e-3, more="", name="scene.toml") -> str:
    """The scene's file."""
    (folder / name).write_text(STEPS.format(tube=tube, more=more), encoding="utf8")
    return str(folder / name)


def test_the_same_twice(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Two runs give the same record, bit for bit; there is contact in it."""
    monkeypatch.chdir(tmp_path)
    scene = written(tmp_path)
    for name in ("one", "two"):
        assert main(["run", scene, "-o", f"{name}.vtkhdf"]) == DONE
    assert compare(tmp_path / "one.vtkhdf", tmp_path / "two.vtkhdf") is None
    with RecordReader(tmp_path / "one.vtkhdf") as reader:
        assert reader.count == 8
        assert reader.steps()["active"].max() > 0


@pytest.mark.parametrize("after", [1, 6])
def test_resume(after: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A run that stops, in flight or in contact, goes on by the same passes to what it would have been."""
    monkeypatch.chdir(tmp_path)
    scene, append = written(tmp_path), Record.append
    assert main(["run", scene, "-o", "whole.vtkhdf"]) == DONE

    def stop(self, step):
        if self.count == after:
            raise KeyboardInterrupt
        append(self, step)

    with monkeypatch.context() as patch:
        patch.setattr(Record, "append", stop)
        with pytest.raises(KeyboardInterrupt):
            main(["run", scene, "-o", "part.vtkhdf"])
    assert main(["run", scene, "--resume", "part.vtkhdf"]) == DONE
    with RecordReader(tmp_path / "whole.vtkhdf") as a, RecordReader(tmp_path / "part.vtkhdf") as b:
        for key in ("time", "substeps", "passes", "contacts", "active"):
            np.testing.assert_array_equal(b.steps()[key], a.steps()[key], err_msg=key)
        for step in range(8):
            for one, two in zip((a.contact(step), *a.fields(step)), (b.contact(step), *b.fields(step)), strict=True):
                for name, values in one.items():
                    # Closest points are sought from those of the step before, and agree to 1e-12 of the radius: in
                    # SI units that is nothing but for normals and stresses, which turn by as much.
                    np.testing.assert_allclose(two[name], values, rtol=0, atol=1e-10, err_msg=f"{step} {name}")


def failed(scene: str, record: Path, capfd: pytest.CaptureFixture[str]) -> dict[str, list[float]]:
    """Assert exit code 3 with one line, and a record whose last step alone is marked; its rows of steps."""
    capfd.readouterr()
    assert main(["run", scene, "-o", str(record)]) == NOT_CONVERGED
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
    assert main(["run", scene, "--resume", str(tmp_path / "r.vtkhdf")]) == 2
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
    steps = failed(str(tmp_path / "s.toml"), tmp_path / "r.vtkhdf", capfd)
    assert list(steps["converged"]) == [1, 1, 1, 0]


def test_two_ranks() -> None:
    """Forces, places and passes of a pushed wire are the same on one and on two ranks."""
    launcher = Path(sys.executable).parent / "mpiexec"
    mpiexec = str(launcher) if launcher.exists() else shutil.which("mpiexec")
    if mpiexec is None:
        pytest.skip("no mpiexec")
    done = subprocess.run(
        [mpiexec, "-n", "2", sys.executable, device_examples.__file__],
        capture_output=True,
        text=True,
        timeout=120,
        check=False,
        cwd=Path(__file__).parents[3],
    )
    assert done.returncode == 0, done.stderr[-2000:]
    two, one = json.loads(done.stdout), device_examples.quantities(MPI.COMM_SELF)
    assert one["force"] > 0
    assert two.keys() == one.keys()
    for name, value in one.items():
        assert two[name] == pytest.approx(value, rel=1e-9, abs=1e-12), name


def test_a_solver_that_stops_early(tmp_path: Path) -> None:
    """Exit code 3 and one line that says so; in a process of its own, for PETSc's sake."""
    program = Path(sys.executable).with_name("signorini")
    options = ["--", "-free_ksp_type", "cg", "-free_pc_type", "none", "-free_ksp_max_it", "3"]
    done = subprocess.run(
        [program, "run", written(tmp_path), "-o", tmp_path / "r.vtkhdf", *options],
        capture_output=True, text=True, timeout=60, check=False,
    )  # fmt: skip
    assert done.returncode == NOT_CONVERGED
    assert done.stderr.count("\n") == 1, done.stderr
    assert "converge" in done.stderr


def test_midpoint_is_refused():
    """A beam moves by implicit Euler."""
    tables = pushed(0.05, 0.1, 2)
    tables["time"]["integrator"] = "midpoint"
    with pytest.raises(ValueError, match=r"time\.integrator = 'midpoint': a beam moves by 'implicit-euler'"):
        run(tables)


def test_nothing_happens():
    """A wire at rest in a straight tube touches nothing: no force, certified, all residuals finite."""
    _, steps = run(pushed(0.0, 0.1, 2))
    assert [step.result.lam.sum() for step in steps] == [0.0, 0.0]
    assert all(step.result.certificate.within(Tolerances()) for step in steps)


def test_the_shipped_tube(tmp_path: Path) -> None:
    """Every step of `runs/tube.toml` is certified, no point is ever outside, and the tip gets round both bends."""
    scene, record = Path(__file__).parents[3] / "runs" / "tube.toml", tmp_path / "tube.vtkhdf"
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
