"""Whatever the moment of a kill, it falls between two system calls or cuts a write at a page: all these moments are tried."""

from __future__ import annotations

import os
import shutil
from collections.abc import Iterator
from pathlib import Path

import h5py
import numpy as np
import pytest

from contact.record import Record, RecordReader, storage, writer
from contact.record.storage import OrderedFile
from record_example import RUN, SCENE, grid, step

PAGE = 4096


class Calls(list[tuple[bytes, int]]):
    """System calls that changed a file: data and address, or no data and the new length."""

    def moments(self, before: Path) -> Iterator[None]:
        """Make the calls on the file `before`, stopping after each and at each page boundary inside one."""
        with open(before, "r+b", buffering=0) as file:
            for data, address in self:
                if not data:
                    file.truncate(address)
                cuts = range(PAGE - address % PAGE, len(data), PAGE)
                for start, end in zip([0, *cuts], [*cuts, len(data)], strict=True):
                    file.seek(address + start)
                    file.write(data[start:end])
                    yield


@pytest.fixture
def calls(monkeypatch: pytest.MonkeyPatch) -> Calls:
    made = Calls()
    pwrite, ftruncate = os.pwrite, os.ftruncate

    def traced_write(descriptor: int, data: bytes, address: int) -> int:
        made.append((bytes(data), address))
        return pwrite(descriptor, data, address)

    def traced_truncate(descriptor: int, length: int) -> None:
        made.append((b"", length))
        ftruncate(descriptor, length)

    monkeypatch.setattr(storage.os, "pwrite", traced_write)
    monkeypatch.setattr(storage.os, "ftruncate", traced_truncate)
    return made


def test_an_index_that_grows_to_three_levels_is_readable_at_every_moment(tmp_path: Path, calls: Calls) -> None:
    """A B-tree of HDF5's default format splits a node of more than 64 chunks; with one row per chunk that comes often."""
    path, copy = tmp_path / "file.h5", tmp_path / "copy.h5"
    levels, moments, split = set(), 0, False
    with OrderedFile(path).hdf5() as file:
        x = file.create_dataset("x", (0,), "i8", maxshape=(None,), chunks=(1,), fill_time="never")
        file.attrs["count"] = 0
        file.flush()
        shutil.copy(path, copy)
        for row in range(4200):
            calls.clear()
            x.resize((row + 1,))
            x[row] = row
            file.flush()
            file.attrs.modify("count", row + 1)
            file.flush()
            nodes = [data[5] for data, _ in calls if data.startswith(b"TREE")]
            levels.update(nodes)
            split = len(nodes) > 1
            for _ in calls.moments(copy):
                if split:
                    moments += 1
                    with h5py.File(copy, "r") as killed:
                        assert killed.attrs["count"] in (row, row + 1)
                        np.testing.assert_array_equal(killed["x"][:row], np.arange(row))
    assert levels == {0, 1, 2}
    assert moments > 100


def test_a_record_is_readable_at_every_moment_of_a_step(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, calls: Calls
) -> None:
    """Chunks of one step, so that in step 64 all data sets split their index, which is the worst that can happen."""
    monkeypatch.setattr(writer, "CHUNK_BYTES", 1)
    monkeypatch.setattr(writer, "CHUNK_ROWS", 1)
    path, copy = tmp_path / "run.vtkhdf", tmp_path / "copy.vtkhdf"
    with Record.create(path, grid(), SCENE, RUN) as record:
        for k in range(64):
            record.append(step(k))
        shutil.copy(path, copy)
        with RecordReader(path) as reader:
            expected = {name: np.concatenate([*reader.slabs(name), []]) for name in reader.names if name != "/scene"}
        calls.clear()
        record.append(step(64))
    counts = []
    for _ in calls.moments(copy):
        with RecordReader(copy) as killed:
            counts.append(killed.count)
            for name, values in expected.items():
                # All of it is read: what an unfinished step left behind must not keep anybody from reading.
                np.testing.assert_array_equal(killed.file[name][()][: len(values)], values)
            state = killed.checkpoint()
            for name, values in step(killed.count - 1).checkpoint.items():
                np.testing.assert_array_equal(state[name], values)
    assert sum(data.startswith(b"TREE") for data, _ in calls) > 100
    assert counts == sorted(counts)
    assert set(counts) == {64, 65}
