"""What a study has finished, one JSON line each, on disk before the next begins."""

from __future__ import annotations

import fcntl
import json
import os
from pathlib import Path
from typing import Any


class Journal:
    """A file of JSON Lines that several processes append to; its first line says what study it belongs to.

    A line that was torn when a process was killed is passed over.
    """

    def __init__(self, path: Path) -> None:
        self.path = path

    def begin(self, head: dict[str, Any]) -> dict[str, Any]:
        """Write the first line where there is none, and return the one that is there.

        Raises
        ------
        ValueError
            where the file belongs to a study with other ``settings``; it names the first that differs.
        """
        if self.path.exists():
            lines = self.lines()
            if lines:
                other = difference(lines[0].get("settings", {}), head["settings"])
                if other:
                    raise ValueError(f"{self.path.parent}: holds a study with {other}; name another folder with -o")
                return lines[0]
            if self.path.stat().st_size and not self.path.read_bytes().startswith(b'{"'):
                raise ValueError(f"{self.path}: is not the journal of a study")
        part = self.path.with_name(self.path.name + ".part")
        part.write_text(json.dumps(head) + "\n", encoding="utf8")
        part.replace(self.path)
        return head

    def append(self, entry: dict[str, Any]) -> None:
        """Add a line; when this returns it survives a kill."""
        with self.path.open("ab") as file:
            fcntl.flock(file, fcntl.LOCK_EX)
            if not _ends_whole(self.path):
                file.write(b"\n")
            file.write(json.dumps(entry, allow_nan=False).encode("utf8") + b"\n")
            file.flush()
            os.fsync(file.fileno())

    def lines(self) -> list[dict[str, Any]]:
        """All whole lines."""
        found = []
        for line in self.path.read_bytes().split(b"\n"):
            try:
                found.append(json.loads(line))
            except ValueError:
                continue
        return [entry for entry in found if isinstance(entry, dict)]


def _ends_whole(path: Path) -> bool:
    with path.open("rb") as file:
        size = file.seek(0, os.SEEK_END)
        if not size:
            return True
        file.seek(size - 1)
        return file.read(1) == b"\n"


def difference(old: dict[str, Any], new: dict[str, Any]) -> str:
    """The first entry in which two dictionaries differ, in words; "" where they are equal."""
    for key in dict.fromkeys([*new, *old]):
        if old.get(key) != new.get(key):
            return f"{key} = {old.get(key)}, not {new.get(key)}"
    return ""
