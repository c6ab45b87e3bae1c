"""The command `study`, in its short form."""

from __future__ import annotations

import json
import re
import tempfile
from collections import Counter
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from test_page import check

from runs.cli import BAD_INPUT, DONE, NOT_CONVERGED, OUTSIDE, main
from runs.study import verdict
from validation.study.plan import Chain
from validation.study.tables import read, tables

SHORT = ["membrane-disc", "--levels", "2", "--methods", "status,vi-primal", "--record", "0", "--repeat", "2"]


@pytest.fixture(scope="module", autouse=True)
def alone(tmp_path_factory: pytest.TempPathFactory) -> Iterator[None]:
    """A lock of the tests' own: they do not wait for studies that run beside them."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(tempfile, "tempdir", str(tmp_path_factory.mktemp("lock")))
        yield


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A short study by two processes at a time."""
    pytest.importorskip("matplotlib")
    folder = tmp_path_factory.mktemp("study") / "new"
    assert main(["study", *SHORT, "--jobs", "2", "-o", str(folder)]) == DONE
    return folder


def lines(folder: Path) -> list[dict[str, Any]]:
    """The journal without its head."""
    text = (folder / "runs.jsonl").read_text(encoding="utf8")
    return [json.loads(line) for line in text.splitlines()][1:]


def test_tables(folder: Path) -> None:
    """Every level × order × method has its error, times, memory and certificate; JSON and HDF5 hold the same."""
    content = json.loads((folder / "study.json").read_text(encoding="utf8"))
    runs = content["runs"]
    assert Counter((r["case"], r["order"], r["method"]) for r in runs) == {
        ("membrane-disc", 1, "status"): 2,
        ("membrane-disc", 1, "vi-primal"): 2,
    }
    for run in runs:
        assert run["outcome"] == "solved"
        assert 0 < run["least"] <= run["total"] <= run["most"]
        assert run["repeats"] == 2
        assert sum(run[p] for p in ("build", "assemble", "factor", "detect", "delassus", "solve")) <= 1.5 * run["total"]
        assert 50 < run["memory_before"] <= run["memory"] < 4000
        assert run["complementarity"] < 1e-8
        assert run["equilibrium"] < 1e-8
    # methods differ in time, not in what they find
    errors = {
        (runs[q["run"]]["level"], runs[q["run"]]["method"]): q["error"]
        for q in content["quantities"]
        if q["quantity"] == "max_error"
    }
    for level, error in ((0, 4.198e-3), (1, 1.609e-3)):
        assert errors[level, "status"] == pytest.approx(error, rel=1e-3)
        assert errors[level, "vi-primal"] == pytest.approx(errors[level, "status"], rel=1e-6)
    facts, found = read(folder / "study.h5")
    assert {**facts, **found} == content
    assert content["settings"]["seed"] == 0


def test_timed_alone(folder: Path) -> None:
    """With several processes answers come first, from runs that share the machine; times are of runs alone."""
    entries = lines(folder)
    assert [entry["alone"] for entry in entries] == [False] * 4 + [True] * 4
    assert all(len(entry["times"]) == (2 if entry["alone"] else 1) for entry in entries)


def test_page(folder: Path) -> None:
    """The page is whole in itself, and says what was run, where, and what came out."""
    text = (folder / "study.html").read_text(encoding="utf8")
    checker = check(text)
    words = " ".join(checker.text)
    assert sum(link.startswith("data:image/svg") for link in checker.links) == 1
    for expected in ("Summary", "processor", "petsc", "mumps", "commit", "vinewtonrsls", "alone on its machine"):
        assert expected in words
    assert str(folder.parent) not in text
    assert re.search(r"membrane-disc, order 1, \d+ unknowns, \d+ contacts: (status|vi-primal) with", words)
    assert {p.name for p in folder.glob("*.png")} == {"study-membrane-disc.png"}


def test_resume(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """What was lost, also of a torn line, is run again, and nothing else."""
    journal = folder / "runs.jsonl"
    before = journal.read_bytes().splitlines(keepends=True)
    lost = [line for line in before if b'"membrane-disc|1|status"' in line and b'"alone": true' in line]
    assert len(lost) == 2
    kept = [line for line in before if line not in lost]
    journal.write_bytes(b"".join(kept) + lost[1][:40])
    assert main(["study", *SHORT, "-o", str(folder)]) == DONE
    after = journal.read_bytes().splitlines(keepends=True)
    assert after[: len(kept)] == kept
    again = [json.loads(line) for line in after[len(kept) + 1 :]]
    assert [(line["chain"], line["level"], line["alone"]) for line in again] == [
        ("membrane-disc|1|status", 0, True), ("membrane-disc|1|status", 1, True),
    ]  # fmt: skip
    out = capsys.readouterr().out
    assert out.splitlines()[-1] == str(folder / "study.html")
    assert "membrane-disc" in out


def test_other_versions(folder: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    """A complete study can be looked at with a later version, which keeps under what it was made; none goes on so."""
    made = json.loads((folder / "study.json").read_text(encoding="utf8"))["versions"]
    monkeypatch.setattr("runs.study.versions", lambda: {**made, "petsc": "0.0"})
    assert main(["study", *SHORT, "-o", str(folder)]) == DONE
    assert json.loads((folder / "study.json").read_text(encoding="utf8"))["versions"] == made
    journal = folder / "runs.jsonl"
    whole = journal.read_bytes()
    journal.write_bytes(b"".join(whole.splitlines(keepends=True)[:-1]))
    capsys.readouterr()
    assert main(["study", *SHORT, "-o", str(folder)]) == BAD_INPUT
    assert f"begun with petsc = {made['petsc']}, not 0.0" in capsys.readouterr().err
    journal.write_bytes(whole)


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["hertz"], "case 'hertz': unknown"),
        (["string", "--methods", "status,newton"], "--methods 'newton': unknown"),
        (["string", "--levels", "0"], "--levels 0: must be at least 1"),
        (["string", "--jobs", "0"], "--jobs 0: must be at least 1"),
        (["string", "--repeat", "0"], "--repeat 0: must be at least 1"),
        (["string", "--limit", "0"], "--limit 0"),
        (["string", "--record", "-1"], "--record -1"),
        (["string", "--set", "E=1"], "string: E = 1.0: unknown"),
        (["string", "--set", "L"], "--set 'L': must be KEY=VALUE"),
    ],
)
def test_bad_input(arguments: list[str], said: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """One line, exit code 2, nothing written."""
    assert main(["study", *arguments, "-o", str(tmp_path / "new")]) == BAD_INPUT
    error = capsys.readouterr().err
    assert said in error
    assert error.count("\n") == 1
    assert not list(tmp_path.iterdir())


def test_bad_folder(folder: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """A file, a folder with other things in it and one of another study are left as they are."""
    file = tmp_path / "file"
    file.write_text("mine")
    for target, said in ((file, "is a file"), (tmp_path, "other files"), (folder, "levels = 2, not 3")):
        before = {p: p.read_bytes() for p in folder.iterdir()}
        assert main(["study", *SHORT[:2], "3", *SHORT[3:], "-o", str(target)]) == BAD_INPUT
        assert said in capsys.readouterr().err
        assert {p: p.read_bytes() for p in folder.iterdir()} == before
    assert [p.name for p in tmp_path.iterdir()] == ["file"]


def test_run_beyond_its_time(tmp_path: Path) -> None:
    """It is entered as such, finer meshes are not tried, and the study goes on."""
    folder = tmp_path / "new"
    short = ["string", "--levels", "3", "--methods", "status", "--record", "0", "--limit", "1e-9"]
    assert main(["study", *short, "-o", str(folder), "--", "-malloc_dump", "no"]) == DONE
    outcomes = [(e["level"], e["outcome"]) for e in lines(folder) if e["chain"] == "string|1|status"]
    assert outcomes == [(0, "time limit"), (1, "not tried"), (2, "not tried")]
    content = json.loads((folder / "study.json").read_text(encoding="utf8"))
    assert content["settings"]["options"] == ["-malloc_dump", "no"]


def solved(level: int, error: float) -> dict[str, Any]:
    """A line of the journal."""
    quantities = {"h1_error": {"computed": error, "exact": 0.0, "error": error, "tolerance": 1.0, "passed": True}}
    report = {"dofs": 100 * 4**level, "quantities": quantities, "iterations": 1}
    times = [{"total": 0.1 * 4**level, "wall": 1.0, "process": 1.0} | dict.fromkeys(PHASES, 0.0)]
    return {"chain": "transition|2|status", "level": level, "alone": True, "outcome": "solved", "report": report,
            "times": times}  # fmt: skip


PHASES = ("build", "assemble", "factor", "detect", "delassus", "solve")


def test_verdict() -> None:
    """0 where the claimed rate of 1.5 is met, 1 where it is missed, 3 where the case's own method stopped."""
    planned = [Chain("transition", (), 2, method, (1 / 8, 1 / 16, 1 / 32)) for method in ("status", "tao")]
    for rate, code in ((1.5, DONE), (1.0, OUTSIDE)):
        found = tables(planned, [solved(k, 0.1 * 2 ** (-rate * k)) for k in range(3)])
        (row,) = found["rates"]
        assert row["rate"] == pytest.approx(rate)
        assert row["error_over_seconds"] == pytest.approx(-rate / 2)
        assert verdict(planned, found) == code
    stopped = {"level": 0, "alone": True, "outcome": "not converged", "reason": "", "iterations": 1, "residual": 0.1}
    good = [solved(k, 0.1 * 2 ** (-1.5 * k)) for k in range(3)]
    assert verdict(planned, tables(planned, [*good, {"chain": "transition|2|tao", **stopped}])) == DONE
    assert verdict(planned, tables(planned, [{"chain": "transition|2|status", **stopped}])) == NOT_CONVERGED
