"""Writes a record, one step at a time, so that whatever kills the run every finished step stays readable."""

from __future__ import annotations

import math
import os
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from time import perf_counter
from types import TracebackType
from typing import Any, Self

import h5py
import numpy as np
from h5py import h5a, h5s, h5t

from contact.record.layout import CLOCK, EMPTY_STEP, GRID, LINKS, Array, Grid, StepData, as_stored, step_rows
from contact.record.reader import RecordReader
from contact.record.storage import OrderedFile

CHUNK_BYTES = 16384
CHUNK_ROWS = 256


class Record:
    """A record open for writing; a context manager.

    Make one with :meth:`create` or :meth:`resume`. A new file takes its place under `path` only when it is complete,
    so that every file that was ever found there is a whole record. Belongs to one process (rank 0).

    Attributes
    ----------
    path : Path
    count : int
        Steps recorded.
    """

    def __init__(self, path: str | os.PathLike[str], grid: Grid, scene: str, run: Mapping[str, str | float]) -> None:
        self.path = Path(path)
        self.count = 0
        self._grid, self._scene, self._run = grid, scene, dict(run)
        self._contacts = 0
        self._open: tuple[h5py.File, OrderedFile] | None = None

    @classmethod
    def create(cls, path: str | os.PathLike[str], grid: Grid, scene: str, run: Mapping[str, str | float]) -> Self:
        """Begin a record without steps, in place of whatever `path` held.

        Parameters
        ----------
        path : path-like
        grid : Grid
        scene : str
            The scene's text.
        run : mapping of str to str or number
            Versions, git commit, PETSc options, ranks, what was built and what left out.

        Raises
        ------
        ValueError
            If `path` cannot be written.
        """
        record = cls(path, grid, scene, run)
        with record._new_file(step_rows(EMPTY_STEP, 0, 0, 0, 0), {}):
            pass
        return record

    @classmethod
    def resume(cls, path: str | os.PathLike[str]) -> Self:
        """Go on with the record at `path` after its last finished step.

        The finished steps are copied to a new file, which then replaces the old one; the rest is dropped.

        Raises
        ------
        ValueError
            If `path` is no record or cannot be written.
        """
        with RecordReader(path) as old:
            record = cls(path, old.grid(), old.scene, old.run)
            rows = old.rows(old.count - 1) if old.count else step_rows(EMPTY_STEP, 0, 0, 0, 0)
            state = old.checkpoint() if old.count else {}
            with record._new_file(rows, state):
                for name, column in record._columns.items():
                    for values in old.slabs(name, column.rows):
                        column.append(values)
                record.count, record._contacts = old.count, old.contacts
                record._slots[(old.count - 1) % 2].write(state)
                record._commit()
        return record

    def append(self, step: StepData) -> None:
        """Record `step`. When this returns, the step survives a kill; until then, the record ends with the step before.

        Raises
        ------
        ValueError
            If `step` has other names, types or shapes than the first one, or values that are not allowed;
            nothing is written.
        """
        start = perf_counter()
        rows = step_rows(step, self.count, len(self._grid.points), len(self._grid.types), self._contacts)
        state = {name: as_stored(name, values) for name, values in step.checkpoint.items()}
        if self.count == 0:
            with self._new_file(rows, state):
                self._append(step, rows, state, start)
        else:
            _expect_same("fields", _signature(rows), {name: column.signature for name, column in self._columns.items()})
            _expect_same("checkpoint", _signature(state), self._slots[0].signature)
            self._append(step, rows, state, start)

    def close(self) -> None:
        """Close the file; the record is complete without this."""
        if self._open is not None:
            for file in self._open:
                file.close()
            self._open = None

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, value: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    def _append(self, step: StepData, rows: dict[str, Array], state: dict[str, Array], start: float) -> None:
        for name, values in rows.items():
            if name != CLOCK:
                self._columns[name].append(values)
        self._slots[self.count % 2].write(state)
        self._flush()
        output = self._columns["/steps/seconds/output"]
        output.write(rows["/steps/seconds/output"] + (perf_counter() - start), output.rows - 1)
        self.count += 1
        self._contacts += np.size(step.lam)
        self._columns[CLOCK].append(rows[CLOCK])
        self._commit()

    def _commit(self) -> None:
        """Write the number of steps last: with it the step is there for every reader."""
        self._nsteps.write(np.array(self.count, dtype=np.int64))
        self._flush()

    @contextmanager
    def _new_file(self, rows: dict[str, Array], state: dict[str, Array]) -> Iterator[None]:
        """Lay out a file for steps like these; after the block it replaces the one at `path`."""
        partial = self.path.with_name(f".{self.path.name}.partial")
        previous, storage = self._open, OrderedFile(partial)
        try:
            file = storage.hdf5()
            self._open = file, storage
            self._lay_out(file, rows, state)
            yield
            file.flush()
            os.replace(partial, self.path)
        except BaseException:
            partial.unlink(missing_ok=True)
            raise
        finally:
            for stale in previous or ():
                stale.close()

    def _lay_out(self, file: h5py.File, rows: dict[str, Array], state: dict[str, Array]) -> None:
        """Write all that does not grow, and empty data sets for all that does."""
        # NSteps and Values come first, in the file's first page, which is written as a whole: VTK needs them to agree.
        steps = file.create_group(f"{GRID}/Steps")
        steps.attrs["NSteps"] = np.int64(0)
        self._nsteps = h5a.open(steps.id, b"NSteps")
        clock = _Column(steps, "Values", rows[CLOCK])
        grid = self._grid
        file.create_dataset("scene", data=self._scene, dtype=h5py.string_dtype())
        file.create_group("run").attrs.update(self._run)
        for name, values in grid.datasets().items():
            file.create_dataset(name, data=values)
        file[GRID].attrs["Version"] = np.array([2, 2], dtype=np.int64)
        file[GRID].attrs["Type"] = np.bytes_("UnstructuredGrid")
        self._columns = {name: _Column(file, name, values) for name, values in rows.items() if name != CLOCK}
        self._columns[CLOCK] = clock
        self._columns["/contact/offsets"].append(np.zeros(1, dtype=np.int64))
        file[CLOCK] = steps["Values"]
        for name, target in LINKS.items():
            if name not in file:
                file[name] = file[target]
        self._slots = [_Slot(file.create_group(f"checkpoint/{slot}"), state) for slot in range(2)]
        self._flush = file.flush


class _Column:
    """A data set that grows along its first axis by rows `like` the given ones, with its handle kept open."""

    def __init__(self, parent: h5py.Group, name: str, like: Array) -> None:
        tail = like.shape[1:]
        # A chunk holds whole steps. What grows by one row is read in one piece: small chunks keep short records small.
        step = max(len(like), 1)
        step_bytes = step * like.dtype.itemsize * math.prod(tail)
        chunk = CHUNK_ROWS if len(like) == 1 else step * max(1, CHUNK_BYTES // max(step_bytes, 1))
        self._id = parent.create_dataset(
            name, (0, *tail), like.dtype, maxshape=(None, *tail), chunks=(chunk, *tail), fill_time="never"
        ).id
        # Kept, because making them takes as long as a small write.
        self._type, self._space, self._memory = h5t.py_create(like.dtype), self._id.get_space(), self._id.get_space()
        self._start = (0,) * len(tail)
        self.rows = 0
        self.signature = (like.dtype, tail)

    def append(self, values: Array) -> None:
        start = self.rows
        self.extend(start + len(values))
        self.write(values, start)

    def extend(self, rows: int) -> None:
        if rows > self.rows:
            shape = (rows, *self.signature[1])
            self._id.set_extent(shape)
            self._space.set_extent_simple(shape)
            self.rows = rows

    def write(self, values: Array, start: int) -> None:
        if values.size:
            self._space.select_hyperslab((start, *self._start), values.shape)
            self._memory.set_extent_simple(values.shape)
            self._id.write(self._memory, self._space, values, self._type)


class _Slot:
    """One of two places for the latest state: step k goes to slot k mod 2, so the last finished one is not overwritten.

    An array's first axis may change from step to step. The data set only grows; its attribute ``rows`` is the length.
    """

    def __init__(self, group: h5py.Group, state: dict[str, Array]) -> None:
        self._scalars: dict[str, h5py.h5d.DatasetID] = {}
        self._arrays: dict[str, tuple[_Column, h5a.AttrID]] = {}
        self.signature = _signature(state)
        for name, values in state.items():
            if values.ndim == 0:
                self._scalars[name] = group.create_dataset(name, (), values.dtype).id
            else:
                column = _Column(group, name, values)
                group[name].attrs["rows"] = np.int64(0)
                self._arrays[name] = column, h5a.open(group[name].id, b"rows")

    def write(self, state: dict[str, Array]) -> None:
        for name, dataset in self._scalars.items():
            dataset.write(h5s.ALL, h5s.ALL, state[name])
        for name, (column, rows) in self._arrays.items():
            column.extend(len(state[name]))
            column.write(state[name], 0)
            rows.write(np.array(len(state[name]), dtype=np.int64))


type _Signature = dict[str, tuple[np.dtype[Any], tuple[int, ...] | None]]


def _signature(arrays: Mapping[str, Array]) -> _Signature:
    """Type and shape, without the first axis (None: a scalar has none), of each array."""
    return {name: (array.dtype, array.shape[1:] if array.ndim else None) for name, array in arrays.items()}


def _expect_same(what: str, given: _Signature, expected: _Signature) -> None:
    for name in sorted(set(given) | set(expected)):
        if given.get(name) != expected.get(name):
            raise ValueError(
                f"{what}: {name} is {given.get(name, 'missing')} in this step, "
                f"{expected.get(name, 'missing')} in the first one"
            )
