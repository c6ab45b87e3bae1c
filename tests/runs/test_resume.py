"""A run that stops in the middle leaves its finished steps, and goes on to what it would have been."""

from __future__ import annotations

import os
import signal
import subprocess
import time
from pathlib import Path
from typing import Any

import pytest
from program import PROGRAM

from contact.record import Record, RecordReader, compare
from runs.cli import BAD_INPUT, DONE, main

SCENE = Path(__file__).parents[2] / "runs" / "squeezed-tube.toml"


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The record of the uninterrupted run, six steps with contact found along the motion."""
    record = tmp_path_factory.mktemp("whole") / "whole.vtkhdf"
    assert main(["run", str(SCENE), "-o", str(record)]) == DONE
    return record


def interrupted(scene: Path, record: Path, after: int) -> Path:
    """The record of a run that stopped while it recorded its next step after so many."""
    append = Record.append

    def stop(self: Record, step: Any) -> None:
        if self.count == after:
            raise KeyboardInterrupt
        append(self, step)

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(Record, "append", stop)
        with pytest.raises(KeyboardInterrupt):
            main(["run", str(scene), "-o", str(record)])
    with RecordReader(record) as reader:
        assert reader.count == after
    return record


def same_steps(one: RecordReader, other: RecordReader, abs: float) -> None:
    """Assert that contacts and fields of every step are the same but for round-off."""
    assert other.count == one.count
    for step in range(one.count):
        pairs = zip((one.contact(step), *one.fields(step)), (other.contact(step), *other.fields(step)), strict=True)
        for expected, found in pairs:
            for name, values in expected.items():
                assert found[name] == pytest.approx(values, rel=0, abs=abs), (step, name)


@pytest.fixture
def part(tmp_path: Path) -> Path:
    """A record of three steps of the six."""
    return interrupted(SCENE, tmp_path / "part.vtkhdf", 3)


def test_the_whole(whole: Path) -> None:
    """The reference has contact in every step, so that resuming has something to lose."""
    with RecordReader(whole) as reader:
        steps = reader.steps()
    assert steps["time"] == pytest.approx([1 / 6, 1 / 3, 1 / 2, 2 / 3, 5 / 6, 1], rel=1e-14)
    assert (steps["active"] > 0).all()
    assert (steps["active"][3:] > steps["active"][0]).all()


@pytest.mark.parametrize("after", [0, 1, 3])
def test_resumed(after: int, whole: Path, tmp_path: Path) -> None:
    """It goes on after the last finished step and reproduces every data set to 1e-12."""
    record = interrupted(SCENE, tmp_path / "part.vtkhdf", after)
    assert main(["run", str(SCENE), "--resume", str(record)]) == DONE
    assert compare(whole, record, 1e-12) is None


def test_resumed_at_its_end(whole: Path, tmp_path: Path) -> None:
    """A finished record stays what it was."""
    copy = tmp_path / "copy.vtkhdf"
    copy.write_bytes(whole.read_bytes())
    assert main(["run", str(SCENE), "--resume", str(copy)]) == DONE
    assert compare(whole, copy) is None


def steps_in(record: Path) -> int:
    """The finished steps of a record that may not exist yet."""
    if not record.exists():
        return 0
    with RecordReader(record) as reader:
        return reader.count


def test_killed(whole: Path, tmp_path: Path) -> None:
    """A process killed as soon as two steps are readable leaves whole steps, and its record goes on as well."""
    record = tmp_path / "killed.vtkhdf"
    process = subprocess.Popen([PROGRAM, "run", str(SCENE), "-o", str(record)], stderr=subprocess.DEVNULL)
    limit = time.monotonic() + 60
    while steps_in(record) < 2 and process.poll() is None and time.monotonic() < limit:
        time.sleep(0.001)
    os.kill(process.pid, signal.SIGKILL)
    process.wait(timeout=60)
    with RecordReader(record) as reader:
        assert 2 <= reader.count <= 6
        for step in range(reader.count):
            assert len(reader.contact(step)["lambda"]) > 0
    assert main(["run", str(SCENE), "--resume", str(record)]) == DONE
    # In another process, sums may round otherwise; residuals of the size of round-off are then others too.
    with RecordReader(whole) as a, RecordReader(record) as b:
        assert a.count == 6
        same_steps(a, b, abs=1e-12)
        assert (b.steps()["equilibrium"] <= 1e-8).all()


@pytest.mark.parametrize("change", ["--set time.end=2.0", '--set contact.0.name="other"', "--method lemke"])
def test_other_changes(change: str, part: Path, capfd: pytest.CaptureFixture[str]) -> None:
    """A record goes on with the scene and the changes that began it, or not at all."""
    before = part.read_bytes()
    assert main(["run", str(SCENE), "--resume", str(part), *change.split()]) == BAD_INPUT
    error = capfd.readouterr().err
    assert error.count("\n") == 1
    assert f"{part}: is the record of another scene" in error
    assert part.read_bytes() == before


def test_other_scene(part: Path, capfd: pytest.CaptureFixture[str]) -> None:
    """The record of another scene is refused and left alone."""
    before = part.read_bytes()
    assert main(["run", str(SCENE.with_name("plug.toml")), "--resume", str(part)]) == BAD_INPUT
    assert f"{part}: is the record of another scene" in capfd.readouterr().err
    assert part.read_bytes() == before
