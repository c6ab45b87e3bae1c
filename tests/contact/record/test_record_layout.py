"""What is refused as a grid."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from record_example import CELLS, grid

from contact.record.layout import committed_rows


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"points": np.zeros((18, 2))}, "grid: points has shape (18, 2), allowed is (n, 3)"),
        ({"body": np.zeros(3, int)}, "grid: types (8,) and body (3,) must have one entry per cell, (8,)"),
        ({"offsets": np.arange(9)}, "grid: offsets must run from 0 to"),
        ({"types": np.full(8, 5, np.uint8)}, "grid: cell 0 of VTK type 5 has 1 points, allowed are"),
        ({"types": np.full(8, 12, np.uint8)}, "grid: cell 0 of VTK type 12 has 1 points, allowed are"),
        ({"points": np.zeros((17, 3))}, "grid: connectivity must lie in 0 to 16"),
    ],
)
def test_what_is_no_grid_is_refused(change: dict[str, Any], message: str) -> None:
    with pytest.raises(ValueError) as error:
        replace(grid(), **change)
    assert str(error.value).startswith(message)


def test_a_polyline_has_at_least_two_points() -> None:
    types = list(CELLS)
    short = replace(grid(), offsets=np.array([0, 1, 2, 7, 10, 14, 17, 23, 33]), types=np.array([1, 1, 4, *types[3:]]))
    assert short.types[2] == 4
    with pytest.raises(ValueError, match="cell 1 of VTK type 4 has 1 points"):
        replace(short, types=np.array([1, 4, 4, *types[3:]]))


@pytest.mark.parametrize(
    ("name", "rows"),
    [
        ("/steps/seconds/total", 3),
        ("/VTKHDF/Steps/Values", 3),
        ("/contact/offsets", 4),
        ("/contact/lambda", 7),
        ("/VTKHDF/PointData/displacement", 30),
        ("/VTKHDF/CellData/stress", 60),
        ("/VTKHDF/CellData/body", None),
        ("/VTKHDF/Points", None),
        ("/scene", None),
    ],
)
def test_rows_of_three_steps(name: str, rows: int | None) -> None:
    assert committed_rows(name, count=3, points=10, cells=20, contacts=7) == rows
