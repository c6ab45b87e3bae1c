"""Reads a record: the finished steps and nothing else, also while a run is writing it or after one was killed."""

from __future__ import annotations

import os
from collections.abc import Iterator
from functools import cached_property
from pathlib import Path
from types import TracebackType
from typing import Any, Self

import h5py
import numpy as np

from contact.record.layout import CONTACT_COLUMNS, GRID, STEP_COLUMNS, Array, Grid, committed_rows, dataset_names

SLAB_BYTES = 1 << 26


class RecordReader:
    """A record open for reading; a context manager.

    Parameters
    ----------
    path : path-like

    Attributes
    ----------
    path : Path
    file : h5py.File
    count : int
        Finished steps.
    contacts : int
        Contacts of all finished steps together.

    Raises
    ------
    ValueError
        If `path` is missing, not HDF5, or not a record.
    """

    def __init__(self, path: str | os.PathLike[str]) -> None:
        self.path = Path(path)
        if not self.path.is_file():
            raise ValueError(f"{path}: no such file")
        try:
            self.file = h5py.File(self.path, "r")
        except OSError:
            raise ValueError(f"{path}: cannot be read as HDF5") from None
        if not all(name in self.file for name in (f"{GRID}/Steps", "steps", "contact", "checkpoint", "scene", "run")):
            self.file.close()
            raise ValueError(f"{path}: not a record of signorini run")
        self.count = int(self.file[f"{GRID}/Steps"].attrs["NSteps"])
        self._points, self._cells = (int(self.file[f"{GRID}/NumberOf{what}"][0]) for what in ("Points", "Cells"))
        self.contacts = self._contacts_after(self.count)

    def close(self) -> None:
        """Close the file."""
        self.file.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, value: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    @property
    def scene(self) -> str:
        """The scene's text."""
        return str(self.file["scene"].asstr()[()])

    @property
    def run(self) -> dict[str, str | int | float]:
        """Versions, git commit, PETSc options, ranks, what was built and what left out."""
        return {name: _plain(value) for name, value in self.file["run"].attrs.items()}

    def grid(self) -> Grid:
        """The undeformed bodies."""
        names = {
            "points": "Points",
            "connectivity": "Connectivity",
            "offsets": "Offsets",
            "types": "Types",
            "body": "CellData/body",
        }
        return Grid(**{name: self.file[f"{GRID}/{dataset}"][:] for name, dataset in names.items()})

    @cached_property
    def names(self) -> list[str]:
        """Full names of all data sets but the two places of the checkpoint, each once."""
        return [name for name in dataset_names(self.file) if not name.startswith("/checkpoint/")]

    def steps(self) -> dict[str, Array]:
        """One row per step, by the names below ``/steps``; phases are ``seconds/assemble`` and so on."""
        return {name: self.file[f"steps/{name}"][: self.count] for name in STEP_COLUMNS}

    def contact(self, step: int) -> dict[str, Array]:
        """``lambda`` [N], ``gap`` [m], ``point``, ``normal``, ``body``, ``status`` at `step`, counted from 0.

        Raises
        ------
        ValueError
            If there is no such step.
        """
        rows = self._rows_below("/contact/", step)
        return {name: rows[name] for name in CONTACT_COLUMNS}

    def fields(self, step: int) -> tuple[dict[str, Array], dict[str, Array]]:
        """Point arrays and cell arrays of `step`, counted from 0.

        Raises
        ------
        ValueError
            If there is no such step.
        """
        return self._rows_below(f"{GRID}/PointData/", step), self._rows_below(f"{GRID}/CellData/", step)

    def checkpoint(self) -> dict[str, Array]:
        """The state after the last finished step, by the names it was given.

        Raises
        ------
        ValueError
            If no step was finished.
        """
        if self.count == 0:
            raise ValueError(f"{self.path}: has no finished step")
        slot = self.file[f"checkpoint/{(self.count - 1) % 2}"]
        prefix = f"{slot.name}/"
        return {
            name.removeprefix(prefix): np.asarray(
                self.file[name][: self.file[name].attrs["rows"]] if self.file[name].ndim else self.file[name][()]
            )
            for name in dataset_names(slot)
        }

    def rows(self, step: int) -> dict[str, Array]:
        """All rows that `step` added, by full name.

        Raises
        ------
        ValueError
            If there is no such step.
        """
        return self._rows_below("", step)

    def slabs(self, name: str, start: int = 0) -> Iterator[Array]:
        """Data set `name` from row `start` to the last of the finished steps, in pieces that fit into memory."""
        dataset = self.file[name]
        end = self._committed(name, self.count, self.contacts)
        end = len(dataset) if end is None else end
        slab = max(1, SLAB_BYTES * max(len(dataset), 1) // max(dataset.nbytes, 1))
        for row in range(start, end, slab):
            yield dataset[row : min(row + slab, end)]

    def shape(self, name: str) -> tuple[int, ...]:
        """Shape of data set `name`, finished steps only."""
        dataset = self.file[name]
        rows = self._committed(name, self.count, self.contacts)
        return tuple(dataset.shape) if rows is None else (rows, *dataset.shape[1:])

    def _rows_below(self, prefix: str, step: int) -> dict[str, Array]:
        if not 0 <= step < self.count:
            allowed = f"0 to {self.count - 1}" if self.count else "none, it has no finished step"
            raise ValueError(f"{self.path}: there is no step {step}, allowed is {allowed}")
        contacts = self._contacts_after(step), self._contacts_after(step + 1)
        found = {}
        for name in self.names:
            start = self._committed(name, step, contacts[0])
            end = self._committed(name, step + 1, contacts[1])
            if name.startswith(prefix) and start is not None:
                found[name.removeprefix(prefix)] = self.file[name][start:end]
        return found

    def _committed(self, name: str, count: int, contacts: int) -> int | None:
        return committed_rows(name, count, self._points, self._cells, contacts)

    def _contacts_after(self, count: int) -> int:
        return int(self.file["contact/offsets"][count])


def _plain(value: Any) -> str | int | float:
    """An attribute as Python's own type."""
    return value.item() if isinstance(value, np.generic) else value  # type: ignore[no-any-return]
