"""Reading back, and what is refused."""

from __future__ import annotations

from pathlib import Path

import h5py
import numpy as np
import pytest
from record_example import RUN, SCENE, grid, step, write

from contact.record import Record, RecordReader


def test_everything_comes_back(tmp_path: Path) -> None:
    path = tmp_path / "run.vtkhdf"
    write(path, 8)
    with RecordReader(path) as reader:
        assert reader.count == 8
        assert reader.scene == SCENE
        assert reader.run == RUN
        for name in ("points", "connectivity", "offsets", "types", "body"):
            np.testing.assert_array_equal(getattr(reader.grid(), name), getattr(grid(), name))
        np.testing.assert_array_equal(reader.steps()["iterations"], range(8))
        for k in range(8):
            contact = reader.contact(k)
            assert set(contact) == {"lambda", "gap", "point", "normal", "body", "status"}
            for name, values in contact.items():
                np.testing.assert_array_equal(values, getattr(step(k), "lam" if name == "lambda" else name))
            for found, given in zip(reader.fields(k), (step(k).point_data, step(k).cell_data), strict=True):
                assert set(found) == set(given)
                for name, values in found.items():
                    np.testing.assert_array_equal(values, given[name])


@pytest.mark.parametrize("count", [1, 2, 4, 5, 6])
def test_the_checkpoint_is_the_last_step_s(tmp_path: Path, count: int) -> None:
    """Its λ grows with k mod 5, then shrinks: both slots hold longer arrays of older steps by then."""
    path = tmp_path / "run.vtkhdf"
    write(path, count)
    given = step(count - 1).checkpoint
    with RecordReader(path) as reader:
        found = reader.checkpoint()
    assert set(found) == set(given)
    for name, values in given.items():
        np.testing.assert_array_equal(found[name], values)
        assert found[name].shape == np.shape(values)
        assert found[name].dtype == np.asarray(values).dtype


def test_what_is_no_record_is_refused(tmp_path: Path) -> None:
    absent, text, other = tmp_path / "absent", tmp_path / "text", tmp_path / "other.h5"
    text.write_text("steps")
    h5py.File(other, "w").close()
    for path, message in (
        (absent, "no such file"),
        (text, "cannot be read as HDF5"),
        (other, "not a record of signorini run"),
    ):
        with pytest.raises(ValueError) as error:
            RecordReader(path)
        assert str(error.value) == f"{path}: {message}"
        with pytest.raises(ValueError, match=message):
            Record.resume(path)


def test_a_step_out_of_range_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "run.vtkhdf"
    write(path, 2)
    with RecordReader(path) as reader:
        for read in (reader.contact, reader.fields, reader.rows):
            for k in (-1, 2):
                with pytest.raises(ValueError) as error:
                    read(k)
                assert str(error.value) == f"{path}: there is no step {k}, allowed is 0 to 1"


def test_a_record_without_steps(tmp_path: Path) -> None:
    path = tmp_path / "run.vtkhdf"
    write(path, 0)
    with RecordReader(path) as reader:
        assert reader.count == 0
        assert all(len(column) == 0 for column in reader.steps().values())
        with pytest.raises(ValueError, match="has no finished step"):
            reader.checkpoint()
        with pytest.raises(ValueError, match="allowed is none"):
            reader.contact(0)
