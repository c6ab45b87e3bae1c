"""Which difference is found first, and how large it is."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from record_example import RUN, SCENE, grid, step, write

from contact.record import Grid, Record, StepData, compare


def record(
    path: Path,
    change: Callable[[StepData], StepData] = lambda given: given,
    geometry: Grid | None = None,
    scene: str = SCENE,
    run: Mapping[str, Any] = RUN,
) -> None:
    with Record.create(path, geometry or grid(), scene, run) as writer:
        for k in range(6):
            writer.append(change(step(k)) if k == 4 else step(k))


def moved(values: Any, by: float) -> np.ndarray:
    values = np.array(values, dtype=float)
    values.flat[-1] += by
    return values


@pytest.fixture
def original(tmp_path: Path) -> Path:
    path = tmp_path / "original.vtkhdf"
    write(path, 6)
    return path


def test_seconds_and_run_do_not_count(tmp_path: Path, original: Path) -> None:
    record(tmp_path / "other", lambda given: replace(given, seconds={"total": 9.0}), run={"version": "9"})
    assert compare(original, tmp_path / "other") is None


@pytest.mark.parametrize(
    ("change", "name", "absolute"),
    [
        (lambda given: replace(given, time=given.time + 1e-3), "/steps/time", 1e-3),
        (lambda given: replace(given, iterations=7), "/steps/iterations", 3),
        (lambda given: replace(given, converged=False), "/steps/converged", 1),
        (lambda given: replace(given, lam=moved(given.lam, 1e-9)), "/contact/lambda", 1e-9),
        (
            lambda given: replace(
                given, point_data={**given.point_data, "force": moved(given.point_data["force"], 2.0)}
            ),
            "/VTKHDF/PointData/force",
            2,
        ),
        (lambda given: replace(given, gap=moved(given.gap, np.nan)), "/contact/gap", np.inf),
    ],
)
def test_the_first_difference_is_named(
    tmp_path: Path, original: Path, change: Callable[[StepData], StepData], name: str, absolute: float
) -> None:
    record(tmp_path / "other", change)
    for pair in ((original, tmp_path / "other"), (tmp_path / "other", original)):
        difference = compare(*pair)
        assert difference is not None
        assert difference.name == name
        assert difference.absolute == pytest.approx(absolute, rel=1e-6)
        assert str(difference).startswith(f"{name}: differs by ")


def test_steps_come_before_contacts_before_fields_before_geometry_before_the_scene(
    tmp_path: Path, original: Path
) -> None:
    def everything(given: StepData) -> StepData:
        return replace(
            given, dt=1.0, gap=moved(given.gap, 1.0), cell_data={**given.cell_data, "stress": np.ones((8, 6))}
        )

    other = tmp_path / "other"
    geometry = replace(grid(), points=moved(grid().points, 1.0))
    record(other, everything, geometry, "x")
    assert _name(original, other) == "/steps/dt"
    record(other, lambda given: replace(everything(given), dt=0.1), geometry, "x")
    assert _name(original, other) == "/contact/gap"
    record(other, lambda given: replace(everything(given), dt=0.1, gap=given.gap), geometry, "x")
    assert _name(original, other) == "/VTKHDF/CellData/stress"
    record(other, geometry=geometry, scene="x")
    assert _name(original, other) == "/VTKHDF/Points"
    record(other, scene="x")
    assert _name(original, other) == "/scene"


def test_checkpoints_are_compared_at_the_last_step(tmp_path: Path) -> None:
    paths = [tmp_path / "a", tmp_path / "b"]
    for path, dt in zip(paths, (0.1, 0.2), strict=True):
        with Record.create(path, grid(), SCENE, RUN) as writer:
            writer.append(step(0))
            writer.append(replace(step(1), checkpoint={**step(1).checkpoint, "dt": dt}))
    difference = compare(*paths)
    assert difference is not None
    assert (difference.name, difference.absolute, difference.relative) == ("/checkpoint/dt", 0.1, 0.5)


def test_the_tolerance_is_relative_to_the_largest_value(tmp_path: Path, original: Path) -> None:
    record(tmp_path / "other", lambda given: replace(given, lam=moved(given.lam, 1.5e-10)))  # the largest λ is 1.5
    difference = compare(original, tmp_path / "other")
    assert difference is not None
    assert difference.relative == pytest.approx(1e-10, rel=1e-5)
    assert compare(original, tmp_path / "other", 0.9e-10) == difference
    assert compare(original, tmp_path / "other", 1.1e-10) is None


def test_different_shapes_are_reported(tmp_path: Path, original: Path) -> None:
    write(tmp_path / "longer", 7)
    difference = compare(original, tmp_path / "longer", 1.0)
    assert str(difference) == "/steps/time: shapes (6,) and (7,)"
    fewer = dict.fromkeys(("lam", "gap", "body", "status"), np.zeros(0)) | dict.fromkeys(
        ("point", "normal"), np.zeros((0, 3))
    )
    record(tmp_path / "fewer", lambda given: replace(given, lam=np.array([0.0, 0.5, 1.0, 1.5])))
    assert compare(original, tmp_path / "fewer") is None
    record(tmp_path / "fewer", lambda given: replace(given, **fewer))
    assert _name(original, tmp_path / "fewer") == "/steps/active"


def test_a_data_set_that_one_record_lacks_is_reported(tmp_path: Path, original: Path) -> None:
    with Record.create(tmp_path / "bare", grid(), SCENE, RUN) as writer:
        for k in range(6):
            writer.append(replace(step(k), cell_data={}))
    difference = compare(original, tmp_path / "bare")
    assert str(difference) == f"/VTKHDF/CellData/status: not in {tmp_path / 'bare'}"


def _name(a: Path, b: Path) -> str | None:
    difference = compare(a, b)
    return None if difference is None else difference.name
