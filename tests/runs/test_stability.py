"""The command `stability`: what it prints, writes and refuses."""

import json
import re
from pathlib import Path

import pytest

from runs.cli import main


def test_page_and_json(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["stability", "fan-2", "slit", "--trials", "5", "-o", str(tmp_path / "out")]) == 0
    printed = capsys.readouterr().out
    assert re.search(r"slit +15 points: 15 right", printed)
    assert "29 points: 29 right, 0 refused, 0 wrong; 0 of 22 feasible refused" in printed
    report = json.loads((tmp_path / "out/stability.json").read_text(encoding="utf8"))
    assert report["seed"] == 2007
    assert [sweep["name"] for sweep in report["sweeps"]] == ["fan-2", "slit"]
    assert len(report["trials"]) == 7  # five problems, a solid and a wire
    assert report["failures"] == []
    point = report["sweeps"][1]["points"][0]
    assert not point["feasible"]
    assert point["verdict"] == "right"
    assert "overlap" in point["reason"]
    page = (tmp_path / "out/stability.html").read_text(encoding="utf8")
    assert "http" not in re.sub(r'src="data:[^"]*"', "", page)
    assert page.count("<figure>") == 3
    assert (tmp_path / "out/stability.png").stat().st_size > 10_000


def test_json_on_standard_output(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["stability", "grazing", "--json"]) == 0
    report = json.loads(capsys.readouterr().out)
    assert report["summary"]["points"]["right"] == 15
    assert report["trials"] == []


def test_list(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["stability", "--list"]) == 0
    assert "v-groove: 18 points, half-opening β [rad]" in capsys.readouterr().out


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["nothing"], "sweep 'nothing': unknown, must be one of "),
        (["slit", "--trials", "-1"], "--trials -1: must be at least 0"),
        (["slit", "--jobs", "0"], "--jobs 0: must be at least 1"),
        (["slit", "--seed", "-3"], "--seed -3: must be at least 0"),
    ],
)
def test_bad_input(words: list[str], message: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["stability", *words, "-o", str(tmp_path / "out")]) == 2
    error = capsys.readouterr().err
    assert message in error
    assert error.count("\n") == 1
    assert not (tmp_path / "out").exists()
