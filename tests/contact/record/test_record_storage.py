"""Whatever the moment of a kill, it falls between two system calls or cuts a write at a page: all these moments are tried."""

from __future__ import annotations

import os
from collections.abc import Callable
from pathlib import Path

import h5py
import numpy as np
import pytest

from contact.record import Record, RecordReader, storage, writer
from contact.record.storage import OrderedFile
from record_example import RUN, SCENE, grid, step

PAGE = 4096


@pytest.fixture
def after_every_call(monkeypatch: pytest.MonkeyPatch) -> list[Callable[[], None]]:
    """Functions in this list are called whenever the file has changed."""
    inspections: list[Callable[[], None]] = []
    pwrite, ftruncate = os.pwrite, os.ftruncate

    def inspect() -> None:
        for inspection in list(inspections):
            inspection()

    def write(descriptor: int, data: bytes, address: int) -> int:
        if not inspections:
            return pwrite(descriptor, data, address)
        for start in range(0, len(data), PAGE):  # every page boundary lies in [start, start + PAGE)
            cut = min(start + PAGE - address % PAGE, len(data))
            pwrite(descriptor, data[:cut], address)
            inspect()
        pwrite(descriptor, data, address)
        inspect()
        return len(data)

    def truncate(descriptor: int, length: int) -> None:
        ftruncate(descriptor, length)
        inspect()

    monkeypatch.setattr(storage.os, "pwrite", write)
    monkeypatch.setattr(storage.os, "ftruncate", truncate)
    return inspections


def test_an_index_that_grows_to_three_levels_is_readable_at_every_moment(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, after_every_call: list[Callable[[], None]]
) -> None:
    """A B-tree of HDF5's default format splits a node of more than 64 chunks; with one row per chunk that comes often."""
    path = tmp_path / "file.h5"
    levels, checks, committed = set(), 0, 0
    held_writes = OrderedFile.flush

    def readable() -> None:
        nonlocal checks
        checks += 1
        with h5py.File(path, "r") as file:
            assert file.attrs["count"] in (committed, committed + 1)
            np.testing.assert_array_equal(file["x"][:committed], np.arange(committed))

    def flush(self: OrderedFile) -> None:
        nodes = [data[5] for data in self._held.values() if data.startswith(b"TREE")]
        levels.update(nodes)
        if len(nodes) > 1:  # a split; other flushes change one node at most
            after_every_call.append(readable)
        held_writes(self)
        after_every_call.clear()

    with h5py.File(OrderedFile(path), "w", libver="earliest", rdcc_nbytes=0) as file:
        x = file.create_dataset("x", (0,), "i8", maxshape=(None,), chunks=(1,), fill_time="never")
        file.attrs["count"] = 0
        file.flush()
        monkeypatch.setattr(OrderedFile, "flush", flush)
        for committed in range(4200):
            x.resize((committed + 1,))
            x[committed] = committed
            file.flush()
            file.attrs.modify("count", committed + 1)
            file.flush()
    assert levels == {0, 1, 2}
    assert checks > 100


def test_a_record_is_readable_at_every_moment_of_every_step(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, after_every_call: list[Callable[[], None]]
) -> None:
    """Chunks of one step, so that all data sets split their index at step 64; steps before and after are inspected too."""
    monkeypatch.setattr(writer, "CHUNK_BYTES", 1)
    monkeypatch.setattr(writer, "CHUNK_ROWS", 1)
    path = tmp_path / "run.vtkhdf"
    seen = []

    def readable() -> None:
        with RecordReader(path) as reader:
            assert reader.count in (k, k + 1)
            seen.append(reader.count)
            for name in reader.names():
                reader.file[name][()]  # what an unfinished step left behind must not keep anybody from reading
            for name, values in reader.steps().items():
                np.testing.assert_array_equal(values[:k], expected[name])
            last = step(reader.count - 1)
            for name, values in reader.contact(reader.count - 1).items():
                np.testing.assert_array_equal(values, getattr(last, "lam" if name == "lambda" else name))
            for given, found in zip((last.point_data, last.cell_data), reader.fields(reader.count - 1), strict=True):
                for name in given:
                    np.testing.assert_array_equal(found[name], given[name])
            state = reader.checkpoint()
            for name in last.checkpoint:
                np.testing.assert_array_equal(state[name], last.checkpoint[name])

    with Record.create(path, grid(), SCENE, RUN) as record:
        for k in range(67):
            if k in (1, 2, 64, 65, 66):
                with RecordReader(path) as reader:
                    expected = reader.steps()
                after_every_call.append(readable)
            record.append(step(k))
            after_every_call.clear()
    assert len(seen) > 500
    assert set(seen) == {1, 2, 3, 64, 65, 66, 67}
