"""A kill falls between two system calls or cuts a write where a page ends: all these moments are tried."""

from __future__ import annotations

import os
import shutil
from collections.abc import Iterator
from pathlib import Path

import h5py
import numpy as np
import pytest
from h5py import h5d, h5s
from record_example import RUN, SCENE, grid, step

from contact.record import Record, RecordReader, storage, writer
from contact.record.storage import PAGE, OrderedFile


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
    """A B-tree of HDF5's default format splits a node of more than 64 chunks: often, with one row per chunk."""
    path, copy = tmp_path / "file.h5", tmp_path / "copy.h5"
    nodes: dict[int, int] = {}
    moments = 0
    with OrderedFile(path).hdf5() as file:
        x = file.create_dataset("x", (0,), "i8", maxshape=(None,), chunks=(1,), fill_time="never")
        file.attrs["count"] = 0
        file.flush()
        for row in range(3720):
            inspected = row < 130 or row > 3650
            if inspected:
                shutil.copy(path, copy)
            calls.clear()
            x.resize((row + 1,))
            x[row] = row
            file.flush()
            file.attrs.modify("count", row + 1)
            file.flush()
            known = len(nodes)
            nodes |= {address: data[5] for data, address in calls if data.startswith(b"TREE")}
            if inspected and len(nodes) > known:
                for _ in calls.moments(copy):
                    moments += 1
                    with h5py.File(copy, "r") as killed:
                        assert killed.attrs["count"] in (row, row + 1)
                        np.testing.assert_array_equal(killed["x"][:row], np.arange(row))
    assert set(nodes.values()) == {0, 1, 2}
    assert moments > 4 * 8


def test_a_record_is_readable_at_every_moment_of_a_step(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, calls: Calls
) -> None:
    """Fields in chunks of one step, so that step 64 splits their indices, which is the worst that can happen."""
    monkeypatch.setattr(writer, "CHUNK_BYTES", 1)
    path, copy = tmp_path / "run.vtkhdf", tmp_path / "copy.vtkhdf"
    with Record.create(path, grid(), SCENE, RUN) as record:
        for k in range(64):
            record.append(step(k))
        shutil.copy(path, copy)
        with RecordReader(path) as reader:
            expected = {name: reader.file[name][()] for name in reader.names if name != "/scene"}
        calls.clear()
        record.append(step(64))
    counts = []
    for _ in calls.moments(copy):
        with RecordReader(copy) as killed:
            counts.append(killed.count)
            assert len(killed.file["VTKHDF/Steps/Values"]) == killed.count
            for name, values in expected.items():
                # All of it is read: what an unfinished step left behind must not keep anybody from reading.
                dataset = h5d.open(killed.file.id, name.encode())
                found = np.empty(dataset.shape, dtype=values.dtype)
                dataset.read(h5s.ALL, h5s.ALL, found)
                assert np.array_equal(found[: len(values)], values), name
            state = killed.checkpoint()
            for name, values in step(killed.count - 1).checkpoint.items():
                np.testing.assert_array_equal(state[name], values)
    assert sum(data.startswith(b"TREE") and data[5] == 1 for data, _ in calls) >= 4
    assert counts == sorted(counts)
    assert set(counts) == {64, 65}
