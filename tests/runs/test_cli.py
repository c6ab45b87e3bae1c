"""The command line: what it prints, loads, writes and answers, on one rank and on two."""

from __future__ import annotations

import json
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from contact_examples import SCENE
from mpi4py import MPI
from program import PROGRAM, program
from ranks import on_two_ranks

import validation.cases  # noqa: F401  enters the cases into the catalogue
from contact.certificate import Tolerances
from contact.clock import PHASES
from contact.record import RecordReader
from contact.scene.schema import SolverTable
from fem.factor import Factor
from fem.iteration_matrix import IterationMatrices
from fem.rigid_body import RigidBody
from runs.cli import BAD_INPUT, DONE, NOT_CONVERGED, OUTSIDE, UNHEARD, main
from validation.case import CASES, Run

SCENES = Path(__file__).parents[2] / "runs"
ISSUE_2 = {
    "transition", "hertz-line", "hertz-point", "punch-cone", "punch-wedge", "punch-flat", "bar-stop", "two-bars",
    "membrane-ball", "membrane-disc", "string", "layer", "receding", "plug", "ball-shell", "v-groove", "duplicated",
    "opposed",
}  # fmt: skip


def loaded(code: str, cwd: Path) -> set[str]:
    """The top-level modules that a process has loaded after `code`."""
    code += "\nimport sys; print('\\n' + ' '.join(sorted({name.split('.')[0] for name in sys.modules})))"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=60, cwd=cwd, check=True)
    return set(done.stdout.splitlines()[-1].split())


@pytest.fixture
def reports(capsys: pytest.CaptureFixture[str]) -> Callable[..., list[dict[str, Any]]]:
    """What ``validate --json`` prints."""

    def call(*arguments: str) -> list[dict[str, Any]]:
        capsys.readouterr()
        assert main(["validate", *arguments, "--json"]) in (DONE, OUTSIDE)
        return [json.loads(line) for line in capsys.readouterr().out.splitlines()]

    return call


@pytest.fixture(scope="module")
def record(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The record of six steps on a mesh file."""
    path = tmp_path_factory.mktemp("record") / "tube.vtkhdf"
    assert main(["run", str(SCENES / "squeezed-tube.toml"), "-o", str(path)]) == DONE
    return path


def test_version(tmp_path: Path) -> None:
    """It answers at once, and loads nothing heavy."""
    heavy = {"numpy", "scipy", "mpi4py", "petsc4py", "gmsh", "meshio", "h5py", "matplotlib", "pyvista", "numba"}
    code = "from runs.cli import main\ntry: main(['--version'])\nexcept SystemExit: pass"
    assert not heavy & loaded(code, tmp_path)
    seconds = []
    for _ in range(3):
        start = time.perf_counter()
        done = program("--version")
        seconds.append(time.perf_counter() - start)
    assert done.stdout == "signorini 0.1.0\n"
    # .3 s on a machine at rest; the tests may share theirs
    assert min(seconds) < 1.0


@pytest.mark.parametrize("arguments", [["validate", "bar-stop"], ["show", "--steps"]])
def test_reader_that_goes(arguments: list[str], record: Path) -> None:
    """Where nobody reads what is printed the program ends without a word, with PETSc and without."""
    words = [*arguments, record] if arguments[0] == "show" else arguments
    with subprocess.Popen([PROGRAM, *words], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as process:
        assert process.stdout is not None
        assert process.stderr is not None
        process.stdout.close()
        assert process.stderr.read() == ""
    assert process.returncode == UNHEARD


def test_list(capsys: pytest.CaptureFixture[str]) -> None:
    """All cases with their parameters."""
    assert main(["validate", "--list"]) == DONE
    lines = capsys.readouterr().out.splitlines()
    assert {line.split(":")[0] for line in lines if not line.startswith(" ")} >= ISSUE_2
    assert "    k1=1 k2=1 F=2 g=1" in lines


def test_json(reports: Callable[..., list[dict[str, Any]]]) -> None:
    """JSON Lines with the keys of the contract."""
    (report,) = reports("bar-stop", "--set", "g=0.2")
    assert list(report) == [
        "case", "parameters", "method", "order", "h", "dofs", "contacts", "quantities", "certificate", "iterations",
        "time", "passed",
    ]  # fmt: skip
    assert set(report["quantities"]["reaction"]) == {"computed", "exact", "error", "tolerance", "passed"}
    assert set(report["certificate"]) == {"complementarity", "equilibrium", "surface_error", "penetration"}
    assert set(report["time"]) == {"assemble", "factor", "detect", "delassus", "solve", "total"}
    assert report["parameters"] == {"E": 1, "A": 1, "L": 1, "F": 1, "q": 0, "g": 0.2}
    assert report["quantities"]["reaction"]["computed"] == pytest.approx(0.8, rel=1e-12)
    assert (report["case"], report["method"], report["dofs"], report["passed"]) == ("bar-stop", "status", 9, True)


def test_levels(reports: Callable[..., list[dict[str, Any]]]) -> None:
    """One object per level; --order, --h, --n and --method are taken."""
    found = reports("string", "opposed", "--h", "0.05", "--method", "lemke")
    assert [(r["case"], r["h"], r["method"]) for r in found] == [
        ("string", 0.05, "lemke"), ("opposed", 0.05, "lemke"),
    ]  # fmt: skip
    (report,) = reports("hertz-line", "--h", "0.1", "--order", "1", "--set", "a=0.3")
    assert (report["order"], report["dofs"]) == (1, 242)
    (report,) = reports("membrane-ball", "--n", "17")
    assert (report["h"], report["dofs"]) == (0.25, 289)


def test_rates(reports: Callable[..., list[dict[str, Any]]]) -> None:
    """A default run ends each variant with the rates that are claimed for it: a wire's in line contact, 2."""
    found = reports("wire-tube")
    rates = {}
    for report in found:
        key = report["parameters"]["L"], report["parameters"]["c"]
        rates[key] = [q["computed"] for name, q in report["quantities"].items() if name == "rate of force"]
    assert {key: len(claimed) for key, claimed in rates.items()} == {
        (0.3, 1e-3): 1, (0.2, 1e-3): 0, (0.5, 0.01): 0, (0.1, 1e-4): 1,
    }  # fmt: skip
    assert [*rates[0.3, 1e-3], *rates[0.1, 1e-4]] == pytest.approx([2.0, 2.0], abs=0.3)


def test_kept(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """-o keeps the lines that --json prints."""
    assert main(["validate", "bar-stop", "two-bars", "--json", "-o", str(tmp_path / "new")]) == DONE
    assert (tmp_path / "new" / "validate.jsonl").read_text(encoding="utf8") == capsys.readouterr().out


def test_exit_codes(capsys: pytest.CaptureFixture[str]) -> None:
    """0 done, 1 outside a tolerance, 2 bad input, 3 infeasible."""
    assert main(["validate", "bar-stop"]) == DONE
    assert "1 of 1 passed" in capsys.readouterr().out
    assert main(["validate", "hertz-line", "--set", "a=0.3", "--h", "0.1"]) == OUTSIDE
    out = capsys.readouterr().out
    assert "OUTSIDE" in out
    assert "0 of 1 passed; not: hertz-line" in out
    assert main(["validate", "bar-stop", "--set", "E=0"]) == BAD_INPUT
    assert main(["validate", "v-groove", "--set", "F=-1"]) == NOT_CONVERGED
    assert "InfeasibleError" in capsys.readouterr().out


def test_negative_slit(capsys: pytest.CaptureFixture[str]) -> None:
    """Walls that overlap are infeasible, never passed."""
    assert main(["validate", "opposed", "--set", "w=-0.1"]) == NOT_CONVERGED
    captured = capsys.readouterr()
    assert "infeasible" in (captured.out + captured.err).lower()
    assert "1 of 1 passed" not in captured.out


def test_petsc_options(reports: Callable[..., list[dict[str, Any]]]) -> None:
    """What follows -- reaches PETSc: another solver gives the same answer, one that does not exist fails."""
    case = ["hertz-line", "--h", "0.2", "--set", "a=0.5"]
    (direct,) = reports(*case)
    iterative = json.loads(
        program("validate", *case, "--json", "--", "-free_ksp_type", "cg", "-free_pc_type", "jacobi").stdout
    )
    force = [report["quantities"]["force"]["computed"] for report in (direct, iterative)]
    assert force[0] != force[1]
    assert force[1] == pytest.approx(force[0], rel=1e-9)
    done = program("validate", "bar-stop", "--", "-free_ksp_type", "nonsense")
    assert done.returncode == BAD_INPUT
    assert done.stdout == ""
    assert done.stderr.count("\n") == 1
    assert "KSP type nonsense" in done.stderr


def test_explain(capsys: pytest.CaptureFixture[str]) -> None:
    """A static scene without friction: what is not built, and that the matrix is factorised once."""
    assert main(["explain", str(SCENES / "layer.toml")]) == DONE
    lines = capsys.readouterr().out.splitlines()
    assert "built: body 'layer': one stiffness matrix (displacement), factorised once" in lines
    for part in ("mass and damping matrices", "tangential rows", "gmsh", "plotting libraries"):
        assert any(line.startswith(f"left out: {part}") for line in lines)
    assert main(["explain", str(SCENES / "hertz-line.toml")]) == DONE
    assert "left out: gmsh" not in capsys.readouterr().out


def test_what_explain_says(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    """One assembly and one factorisation in six steps of one body; none for a rigid one; one row per candidate."""
    calls: list[str] = []

    assemble, factor = IterationMatrices._new, Factor.setup

    def assembled(self: IterationMatrices, *arguments: Any) -> Factor:
        calls.append("assemble")
        return assemble(self, *arguments)

    def factored(self: Factor) -> None:
        if self.ksp is None:
            calls.append("factor")
        factor(self)

    monkeypatch.setattr(IterationMatrices, "_new", assembled)
    monkeypatch.setattr(Factor, "setup", factored)
    scene = str(SCENES / "squeezed-tube.toml")
    assert main(["run", scene, "-o", str(tmp_path / "tube.vtkhdf")]) == DONE
    assert calls == ["assemble", "factor"]
    calls.clear()
    case = CASES["v-groove"]
    with Run(case, MPI.COMM_SELF, case.configure({"beta": 0.8}), 1.0, 1, "status") as run:
        case.solve(run)
        assert run.solved is not None
        (block,) = run.solved.system.bodies
        assert calls == []
        assert isinstance(block, RigidBody)
        assert block.A is None
        assert block._ksp is None
        assert len(run.solved.result.lam) == 4


def test_phases(reports: Callable[..., list[dict[str, Any]]]) -> None:
    """A scene of one linear body costs no more than 2 % over the sum of its phases (and 5 ms)."""
    (report,) = reports("hertz-line", "--set", "a=0.3")
    total = report["time"].pop("total")
    assert set(report["time"]) == set(PHASES) - {"output"}
    assert 0.98 * total - 0.005 <= sum(report["time"].values()) <= total
    assert report["time"]["factor"] > 0


def test_default_tolerances() -> None:
    """The contract's, of the step and of the scene alike."""
    assert Tolerances() == Tolerances(1e-8, 1e-8, 1e-3, 1e-3)
    table = SolverTable()
    assert Tolerances(table.complementarity, table.equilibrium, table.surface_error, table.penetration) == Tolerances()
    assert table.method == "status"


def test_libraries_that_stay_away(tmp_path: Path) -> None:
    """A scene on a structured mesh runs without gmsh, and without --plot nothing that plots is loaded."""
    (tmp_path / "small.toml").write_text(SCENE, encoding="utf8")
    modules = loaded("from runs.cli import main\nassert main(['run', 'small.toml']) == 0", tmp_path)
    assert (tmp_path / "small.vtkhdf").exists()
    assert "petsc4py" in modules
    assert not {"gmsh", "meshio", "matplotlib", "pyvista", "vtkmodules"} & modules


def test_plug(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """A shipped scene after --set, with its picture: the pressure of the closed form times each vertex's area."""
    path, picture = tmp_path / "plug.vtkhdf", tmp_path / "plug.png"
    scene = str(SCENES / "plug.toml")
    assert main(["run", scene, "-o", str(path), "--set", "body.0.mesh.h=0.25", "--plot", str(picture)]) == DONE
    assert capsys.readouterr().out.splitlines()[0] == str(path)
    assert picture.read_bytes().startswith(b"\x89PNG")
    with RecordReader(path) as reader:
        contact = reader.contact(0)
        assert reader.scene.endswith("# --set body.0.mesh.h=0.25")
        assert reader.run["ranks"] == 1
        assert reader.run["folder"] == str(SCENES.resolve())
    # over a quarter of the inner circle ∫ p dA = p b π/2; curved facets miss the arc by less than 1e-4
    assert contact["lambda"].sum() == pytest.approx(0.0185181 * np.pi, rel=1e-4)
    assert np.linalg.norm(contact["point"], axis=1) == pytest.approx(2.1, rel=1e-3)


def test_show(record: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Summary, steps and contacts, as text and as JSON."""
    assert main(["show", str(record)]) == DONE
    assert "steps: 6" in capsys.readouterr().out
    assert main(["show", str(record), "--steps", "--json"]) == DONE
    steps = json.loads(capsys.readouterr().out)
    assert steps["time"] == pytest.approx(np.arange(1, 7) / 6, rel=1e-14)
    assert {"dt", "substeps", "passes", "contacts", "active", "iterations", "seconds/total"} <= set(steps)
    assert steps["converged"] == [True] * 6
    assert max(steps["complementarity"] + steps["equilibrium"]) <= 1e-8
    assert main(["show", str(record), "--contact", "5", "--json"]) == DONE
    contact = json.loads(capsys.readouterr().out)
    assert set(contact) == {"lambda", "gap", "point", "normal", "body", "status"}
    closed = np.array(contact["lambda"]) > 0
    assert closed.sum() == steps["active"][5]
    assert np.array(contact["point"])[closed, 1] == pytest.approx(1.31, rel=1e-8)
    assert main(["show", str(record), "--contact", "6"]) == BAD_INPUT


def test_compare(record: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Two runs of one scene are equal to the last bit; of another, the first difference is named."""
    scene = str(SCENES / "squeezed-tube.toml")
    again, other = (str(tmp_path / name) for name in ("again.vtkhdf", "other.vtkhdf"))
    assert main(["run", scene, "-o", again]) == DONE
    assert main(["run", scene, "-o", other, "--set", "time.steps=3"]) == DONE
    capsys.readouterr()
    assert main(["compare", str(record), again]) == DONE
    assert capsys.readouterr().out == "equal\n"
    assert main(["compare", str(record), other]) == OUTSIDE
    assert capsys.readouterr().out == "/steps/time: shapes (6,) and (3,)\n"


def test_plot(record: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """A picture of a record."""
    assert main(["plot", str(record), "-o", str(tmp_path / "tube.png")]) == DONE
    assert capsys.readouterr().out == f"{tmp_path / 'tube.png'}\n"
    assert (tmp_path / "tube.png").read_bytes().startswith(b"\x89PNG")


def test_vtk_reads_it(record: Path) -> None:
    """VTK's own reader opens every step, and finds the prescribed motion."""
    from vtkmodules.util.numpy_support import vtk_to_numpy
    from vtkmodules.vtkIOHDF import vtkHDFReader

    reader = vtkHDFReader()
    reader.SetFileName(str(record))
    reader.UpdateInformation()
    assert reader.GetNumberOfSteps() == 6
    for step in range(6):
        reader.SetStep(step)
        reader.Update()
        grid = reader.GetOutputDataObject(0)
        u = vtk_to_numpy(grid.GetPointData().GetArray("displacement"))
        points = vtk_to_numpy(grid.GetPoints().GetData())
        # the cut at y = 0 is pushed up by .12 t
        assert u[np.abs(points[:, 1]) < 1e-9, 1] == pytest.approx(0.12 * (step + 1) / 6, rel=1e-12)


def test_two_ranks_validate(reports: Callable[..., list[dict[str, Any]]]) -> None:
    """Every quantity on two ranks is that on one to 1e-9, in the plane, in space and on bars."""
    arguments = ["string", "hertz-line", "layer", "plug", "hertz-point", "--h", "0.125"]
    done = on_two_ranks(PROGRAM, "validate", *arguments, "--json")
    two = [json.loads(line) for line in done.stdout.splitlines()]
    one = reports(*arguments)
    assert len(one) == len(two) >= 5, done.stderr
    for here, there in zip(one, two, strict=True):
        assert (here["case"], here["parameters"], here["dofs"]) == (there["case"], there["parameters"], there["dofs"])
        assert there["certificate"]["complementarity"] <= 1e-8
        for name, quantity in here["quantities"].items():
            value, expected = there["quantities"][name]["computed"], quantity["computed"]
            if expected is None:  # a half-width on so coarse a mesh
                assert value is None, (here["case"], name)
            else:
                assert value == pytest.approx(expected, rel=1e-9, abs=1e-12), (here["case"], name)


def test_two_ranks_run(record: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """A record from two ranks shows, plots and equals that from one; its nodes stand in the mesh's order."""
    done = on_two_ranks(PROGRAM, "run", SCENES / "squeezed-tube.toml", "-o", "tube.vtkhdf", cwd=tmp_path)
    assert done.returncode == DONE, done.stderr
    assert done.stdout == "tube.vtkhdf\n"
    two = tmp_path / "tube.vtkhdf"
    assert main(["show", str(two), "--steps", "--json"]) == DONE
    assert json.loads(capsys.readouterr().out)["converged"] == [True] * 6
    assert main(["plot", str(two)]) == DONE
    assert two.with_suffix(".png").read_bytes().startswith(b"\x89PNG")
    with RecordReader(record) as a, RecordReader(two) as b:
        assert b.run["ranks"] == 2
        assert np.array_equal(a.grid().points, b.grid().points)
        u, v = (reader.fields(5)[0]["displacement"] for reader in (a, b))
        assert v == pytest.approx(u, abs=1e-9 * np.abs(u).max())
        assert b.contact(5)["lambda"].sum() == pytest.approx(a.contact(5)["lambda"].sum(), rel=1e-9)
