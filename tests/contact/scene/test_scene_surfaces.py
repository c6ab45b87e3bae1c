"""Tables of surfaces: what they stand for, and what they refuse in one line."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from pydantic import TypeAdapter, ValidationError

from contact.scene.surfaces import SurfaceTable, surface_of
from contact.surfaces.implicit import Surface

TABLES: TypeAdapter[Any] = TypeAdapter(SurfaceTable)
TORUS = {"kind": "torus", "centre": [0, 0, 0], "axis": [0, 0, 1], "bend": 2.0, "radius": 0.5, "inside": True}
BRANCH = {"name": "trunk", "points": [[0, 0, 0, 0.5], [4, 0, 0, 0.5]]}
VESSELS = {"kind": "vessels", "branches": [BRANCH]}
CONVOLUTION = {"kind": "convolution", "segments": [BRANCH["points"]]}
CAUCHY = {"kind": "cauchy", "segments": [[[-500, 0, 0], [500, 0, 0]]], "width": 2.0, "level": 0.5}


def _surface(table: dict[str, Any]) -> Surface:
    return surface_of(TABLES.validate_python(table), Path())


@pytest.mark.parametrize(
    ("table", "wall"),
    [
        (TORUS, [1.5, 0, 0]),
        (VESSELS, [2, 0.5, 0]),
        (CONVOLUTION, [2, 0, 0.5]),
        (CAUCHY, [0, np.sqrt((np.pi / 2) ** (2 / 3) - 1) / 2, 0]),
    ],
)
def test_a_table_has_its_wall(table: dict[str, Any], wall: list[float]) -> None:
    """The potential vanishes at a known point of each kind's wall."""
    assert _surface(table).potential(np.array([wall], dtype=float))[0] == pytest.approx(0, abs=1e-9)


def test_an_aneurysm_opens_the_wall() -> None:
    """A ball joined in makes room beside the vessel, and a stenosis takes it from within."""
    beside = np.array([[2.0, 0.9, 0]])
    assert _surface(VESSELS).potential(beside)[0] < 0
    assert _surface({**VESSELS, "aneurysms": [{"centre": [2, 0.8, 0], "radius": 0.5}]}).potential(beside)[0] > 0
    narrow = {**VESSELS, "stenoses": [{"centre": [2, 0, 0], "length": 2.0, "fraction": 0.5}]}
    assert _surface(narrow).potential(np.array([[2.0, 0.4, 0]]))[0] < 0


@pytest.mark.parametrize(
    ("table", "key", "message"),
    [
        (TORUS, {"axis": [0, 0, 0]}, "axis"),
        (TORUS, {"radius": -1.0}, "radius"),
        (VESSELS, {"file": "x.swc"}, "either a file or branches"),
        (VESSELS, {"scale": 1e-3}, "scale"),
        (VESSELS, {"sharpness": 1.0}, "sharpness"),
        (CONVOLUTION, {"segments": []}, "there must be some"),
        (CONVOLUTION, {"thickness": 0.1}, "thickness"),
        (CAUCHY, {"level": 0.0}, "level"),
    ],
)
def test_bad_tables(table: dict[str, Any], key: dict[str, Any], message: str) -> None:
    """Each refusal names its key."""
    with pytest.raises(ValidationError, match=message):
        TABLES.validate_python({**table, **key})


def test_a_level_above_the_axis_is_refused() -> None:
    """A Cauchy line whose level is nowhere reached."""
    with pytest.raises(ValueError, match="level = 5"):
        _surface({**CAUCHY, "level": 5.0})
