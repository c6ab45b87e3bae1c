"""The journal of a study survives what stops a study."""

from __future__ import annotations

from pathlib import Path

import pytest

from validation.study.journal import Journal


def test_torn_line(tmp_path: Path) -> None:
    """A line cut short by a kill is passed over, and the next one is whole."""
    journal = Journal(tmp_path / "runs.jsonl")
    head = {"settings": {"levels": 4}}
    assert journal.begin(head) == head
    journal.append({"level": 0})
    whole = journal.path.read_bytes()
    journal.append({"level": 1, "text": "é"})
    torn = journal.path.read_bytes()
    for cut in range(len(whole), len(torn)):
        journal.path.write_bytes(torn[:cut])
        assert journal.begin(head) == head
        journal.append({"level": 2})
        assert journal.lines()[1:] in (
            [{"level": 0}, {"level": 2}],
            [{"level": 0}, {"level": 1, "text": "é"}, {"level": 2}],
        )


def test_other_study(tmp_path: Path) -> None:
    """The first setting that differs is named, and nothing is written."""
    journal = Journal(tmp_path / "runs.jsonl")
    journal.begin({"settings": {"levels": 4, "seed": 0}})
    before = journal.path.read_bytes()
    with pytest.raises(ValueError, match="seed = 0, not 1"):
        journal.begin({"settings": {"levels": 4, "seed": 1}})
    assert journal.path.read_bytes() == before
