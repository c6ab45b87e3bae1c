"""The record as ParaView and h5py see it, and after kills."""

from __future__ import annotations

import os
import random
import subprocess
import sys
import time
from dataclasses import replace
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest
import record_example
from record_example import CELLS, RUN, SCENE, grid, step, write

from contact.record import CERTIFICATE, PHASES, Record, RecordReader, compare, writer

KILLS = int(os.environ.get("SIGNORINI_KILLS", "10"))


class Vtk:
    """VTK's own reader of the format, one step at a time."""

    def __init__(self, path: Path) -> None:
        module = pytest.importorskip("vtkmodules.vtkIOHDF")
        self._to_numpy = pytest.importorskip("vtkmodules.util.numpy_support").vtk_to_numpy
        self._reader = module.vtkHDFReader()
        self._reader.SetFileName(str(path))
        self._reader.UpdateInformation()
        key = pytest.importorskip("vtkmodules.vtkCommonExecutionModel").vtkStreamingDemandDrivenPipeline.TIME_STEPS()
        self.times = self._reader.GetOutputInformation(0).Get(key) or ()

    def output(self, index: int) -> Any:
        assert self._reader.UpdateTimeStep(self.times[index])
        return self._reader.GetOutputDataObject(0)

    def arrays(self, attributes: Any) -> dict[str, np.ndarray]:
        found = {}
        for i in range(attributes.GetNumberOfArrays()):
            array = attributes.GetArray(i)
            assert array.GetDataTypeAsString() in ("double", "long", "long long")
            found[array.GetName()] = self._to_numpy(array)
        return found

    def assert_step(self, index: int) -> None:
        """Step `index` is that of the example."""
        output = self.output(index)
        np.testing.assert_array_equal(self._to_numpy(output.GetPoints().GetData()), grid().points)
        types = [output.GetCellType(i) for i in range(output.GetNumberOfCells())]
        assert types == list(CELLS)
        for i, cell in enumerate(CELLS.values()):
            ids = output.GetCell(i).GetPointIds()
            assert [ids.GetId(j) for j in range(ids.GetNumberOfIds())] == cell
        given = step(index)
        for attributes, expected in (
            (output.GetPointData(), given.point_data),
            (output.GetCellData(), {**given.cell_data, "body": grid().body}),
        ):
            found = self.arrays(attributes)
            assert set(found) == set(expected)
            for name, values in expected.items():
                np.testing.assert_array_equal(found[name], values)


def test_vtk_reads_every_step(tmp_path: Path) -> None:
    path = tmp_path / "run.vtkhdf"
    write(path, 7)
    vtk = Vtk(path)
    np.testing.assert_array_equal(vtk.times, [step(k).time for k in range(7)])
    for k in (*range(7), 2):
        vtk.assert_step(k)


def test_h5py_finds_the_contract(tmp_path: Path) -> None:
    path = tmp_path / "run.vtkhdf"
    write(path, 7)
    steps = [step(k) for k in range(7)]
    with h5py.File(path, "r") as file:
        columns = {"time", "dt", "substeps", "passes", "contacts", "active", "iterations", *CERTIFICATE, "converged"}
        assert set(file["steps"]) == {*columns, "seconds"}
        assert set(file["steps/seconds"]) == set(PHASES)
        for name in columns - {"active", *CERTIFICATE}:
            np.testing.assert_array_equal(file["steps"][name][:], [getattr(s, name) for s in steps])
        np.testing.assert_array_equal(file["steps/active"][:], [max(k % 5 - 1, 0) for k in range(7)])
        for name in CERTIFICATE:
            np.testing.assert_array_equal(file["steps"][name][:], [s.certificate[name] for s in steps])
        for name in set(PHASES) - {"output"}:
            np.testing.assert_array_equal(file["steps/seconds"][name][:], [s.seconds[name] for s in steps])
        assert all(file["steps/seconds/output"][:] > [s.seconds["output"] for s in steps])

        assert set(file["contact"]) == {"offsets", "lambda", "gap", "point", "normal", "body", "status"}
        np.testing.assert_array_equal(file["contact/offsets"][:], [0, 0, 1, 3, 6, 10, 10, 11])
        np.testing.assert_array_equal(file["contact/lambda"][:], np.concatenate([s.lam for s in steps]))
        np.testing.assert_array_equal(file["contact/normal"][:], np.concatenate([s.normal for s in steps]))
        assert file["scene"].asstr()[()] == SCENE
        assert dict(file["run"].attrs) == RUN


def test_everything_is_float64_or_int64(tmp_path: Path) -> None:
    path = tmp_path / "run.vtkhdf"
    single = replace(step(1), point_data={"displacement": np.ones((18, 3), np.float32), "n": np.ones(18, np.int32)})
    with Record.create(path, grid(), SCENE, RUN) as record:
        record.append(single)
    with RecordReader(path) as reader:
        exceptions = {"/scene": "O", "/VTKHDF/Types": "u1", "/steps/converged": "?"}
        for name in reader.names:
            dtype = reader.file[name].dtype
            assert dtype == exceptions.get(name) if name in exceptions else dtype in (np.float64, np.int64), name
        assert reader.file["VTKHDF/PointData/displacement"].dtype == np.float64


def test_the_same_run_gives_the_same_bytes(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(writer, "perf_counter", lambda: 0.0)
    paths = [tmp_path / name for name in ("a.vtkhdf", "b.vtkhdf")]
    for path in paths:
        write(path, 40)
        time.sleep(1.1 if path is paths[0] else 0)  # any time stamp would differ
    assert paths[0].read_bytes() == paths[1].read_bytes()


def test_a_step_is_there_as_soon_as_append_returns(tmp_path: Path) -> None:
    path = tmp_path / "run.vtkhdf"
    with Record.create(path, grid(), SCENE, RUN) as record:
        for k in range(3):
            with RecordReader(path) as reader:
                assert reader.count == k
            record.append(step(k))
    assert list(tmp_path.iterdir()) == [path]


def test_resume_drops_an_unfinished_step_and_goes_on(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    whole, broken = tmp_path / "whole.vtkhdf", tmp_path / "broken.vtkhdf"
    write(whole, 9)
    record = Record.create(broken, grid(), SCENE, RUN)
    for k in range(6):
        record.append(step(k))
    with monkeypatch.context() as patch:
        patch.setattr(record._columns["/steps/seconds/output"], "write", _raise)
        with pytest.raises(KeyboardInterrupt):
            record.append(replace(step(6), dt=99.0))
    record.close()
    with h5py.File(broken, "r") as file:
        assert len(file["steps/dt"]) == 7
    with RecordReader(broken) as reader:
        assert reader.count == 6
    vtk = Vtk(broken)
    assert len(vtk.times) == 6
    vtk.assert_step(5)
    with Record.resume(broken) as record:
        assert record.count == 6
        with h5py.File(broken, "r") as file:
            assert len(file["steps/time"]) == 6
            assert len(file["contact/lambda"]) == 10
        for k in range(6, 9):
            record.append(step(k))
    assert compare(whole, broken) is None
    Vtk(broken).assert_step(8)


def test_resume_of_a_record_without_steps(tmp_path: Path) -> None:
    path, whole = tmp_path / "run.vtkhdf", tmp_path / "whole.vtkhdf"
    Record.create(path, grid(), SCENE, RUN).close()
    with Record.resume(path) as record:
        assert record.count == 0
        record.append(step(0))
    write(whole, 1)
    assert compare(path, whole) is None


def test_a_killed_run_keeps_every_finished_step(tmp_path: Path) -> None:
    """One record through all kills: each child resumes what the one before it left.

    The moments are random from the start of the child on (then they also hit its creation or resumption of the record)
    or from its first step on.
    """
    path, whole = tmp_path / "run.vtkhdf", tmp_path / "whole.vtkhdf"
    chance = random.Random(0)
    acknowledged, seen, kills_in_a_step = 0, 0, 0
    for kill in range(KILLS):
        command = [sys.executable, record_example.__file__, str(path), str(1_000_000)]
        with subprocess.Popen(command, stdout=subprocess.PIPE, text=True, env=_environment()) as child:
            assert child.stdout is not None
            if kill % 4:
                first = child.stdout.readline()
                assert int(first) == acknowledged
                time.sleep(chance.uniform(0.0, 0.05))
            else:
                first = ""
                time.sleep(chance.uniform(0.2, 1.0))
            child.kill()
            lines = (first + child.stdout.read()).split()
        acknowledged = int(lines[-1]) + 1 if lines else acknowledged
        if not path.exists():
            assert acknowledged == 0
            continue
        with RecordReader(path) as reader:
            # A kill between the commit and the acknowledgement leaves one step more.
            assert acknowledged <= reader.count <= acknowledged + 1
            acknowledged = reader.count
            kills_in_a_step += len(reader.file["steps/dt"]) > reader.count
            np.testing.assert_array_equal(reader.steps()["time"], [step(k).time for k in range(reader.count)])
            # The others have been seen; what became of them, the comparison at the end tells.
            for k in range(seen, reader.count):
                np.testing.assert_array_equal(reader.contact(k)["point"], step(k).point)
            seen = reader.count
            if reader.count:
                np.testing.assert_array_equal(
                    reader.checkpoint()["wire/x"], step(reader.count - 1).checkpoint["wire/x"]
                )
        if acknowledged:
            vtk = Vtk(path)
            assert len(vtk.times) == acknowledged
            vtk.assert_step(acknowledged - 1)
    record_example.main(path, acknowledged + 3)
    write(whole, acknowledged + 3)
    assert compare(path, whole) is None
    print(f"{KILLS} kills, {kills_in_a_step} inside a step's rows, {acknowledged} steps")


def _raise(*_: object) -> None:
    raise KeyboardInterrupt


def _environment() -> dict[str, str]:
    return {**os.environ, "PYTHONPATH": os.pathsep.join(p for p in sys.path if p), "OMP_NUM_THREADS": "1"}


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"certificate": {"complementarity": 0.0}}, "certificate: has the names ['complementarity'], allowed are"),
        ({"certificate": dict.fromkeys(CERTIFICATE, np.nan)}, "step 2: complementarity is nan"),
        ({"seconds": {"lunch": 1.0}}, "seconds: has the names ['lunch'], allowed are assemble"),
        ({"gap": np.zeros(7)}, "step 2: gap has shape (7,), expected (2,)"),
        (
            {"point_data": {"displacement": np.zeros((17, 3))}},
            "step 2: displacement has shape (17, 3), expected (18, ...)",
        ),
        ({"point_data": {"a/b": np.zeros(18)}}, "step 2: a point array cannot be named 'a/b'"),
        ({"cell_data": {"body": np.zeros(len(CELLS))}}, "step 2: a cell array cannot be named 'body'"),
        ({"cell_data": {"stress": np.zeros(len(CELLS), complex)}}, "stress: has type complex128, allowed are"),
        ({"cell_data": {}}, "fields: /VTKHDF/CellData/status is missing in this step"),
        ({"checkpoint": {"dt": 1.0}}, "checkpoint: fixed is missing in this step"),
    ],
)
def test_what_is_no_step_is_refused_and_nothing_written(tmp_path: Path, change: dict[str, Any], message: str) -> None:
    path = tmp_path / "run.vtkhdf"
    with Record.create(path, grid(), SCENE, RUN) as record:
        record.append(step(0))
        record.append(step(1))
        before = path.read_bytes()
        with pytest.raises(ValueError) as error:
            record.append(replace(step(2), **change))
        assert str(error.value).startswith(message)
        assert "\n" not in str(error.value)
        assert path.read_bytes() == before
        record.append(step(2))
        assert record.count == 3


def test_a_path_that_cannot_be_written_is_refused(tmp_path: Path) -> None:
    with pytest.raises(ValueError, match=r"run.vtkhdf.*cannot be written \(No such file or directory\)"):
        Record.create(tmp_path / "absent" / "run.vtkhdf", grid(), SCENE, RUN)
