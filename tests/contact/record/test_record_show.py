"""Text and JSON of a record."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from record_example import RUN, step, write

from contact.record import PHASES, show


@pytest.fixture
def path(tmp_path: Path) -> Path:
    write(tmp_path / "run.vtkhdf", 5)
    return tmp_path / "run.vtkhdf"


def test_summary(path: Path) -> None:
    content = json.loads(show(path, as_json=True))
    assert (content["points"], content["cells"], content["bodies"], content["steps"]) == (18, 8, 4, 5)
    assert content["not converged"] == [3]
    assert content["time"] == [step(0).time, step(4).time]
    assert content["certificate, worst"]["penetration"] == max(step(k).certificate["penetration"] for k in range(5))
    assert content["seconds"]["total"] == pytest.approx(sum(step(k).seconds["total"] for k in range(5)))
    assert content["run"] == RUN
    text = show(path)
    assert "not converged: 3\n" in text
    assert "\n  ranks: 2\n" in text


def test_summary_without_steps(tmp_path: Path) -> None:
    write(tmp_path / "run.vtkhdf", 0)
    assert "steps: 0\n" in show(tmp_path / "run.vtkhdf")


def test_steps(path: Path) -> None:
    columns = json.loads(show(path, steps=True, as_json=True))
    assert columns["time"] == [step(k).time for k in range(5)]
    assert columns["converged"] == [True, True, True, False, True]
    assert {f"seconds/{phase}" for phase in PHASES} < set(columns)
    lines = show(path, steps=True).splitlines()
    assert len(lines) == 6
    header = lines[0].split()
    assert lines[3].split()[header.index("iterations")] == "2"
    assert len({len(line) for line in lines}) == 1


def test_contact(path: Path) -> None:
    columns = json.loads(show(path, contact=4, as_json=True))
    assert columns["lambda"] == [0.0, 0.5, 1.0, 1.5]
    assert columns["normal"] == step(4).normal.tolist()
    lines = show(path, contact=4).splitlines()
    assert len(lines) == 5
    header = lines[0].split()
    assert float(lines[2].split()[header.index("point.z")]) == pytest.approx(step(4).point[1, 2], rel=1e-5)
    assert len(show(path, contact=0).splitlines()) == 1


def test_both(path: Path) -> None:
    assert set(json.loads(show(path, steps=True, contact=4, as_json=True))) == {"steps", "contact"}
    assert len(show(path, steps=True, contact=4).split("\n\n")) == 2


def test_no_such_step(path: Path) -> None:
    with pytest.raises(ValueError, match="there is no step 5, allowed is 0 to 4"):
        show(path, contact=5)
