"""Rates, cheapest ways and errors reached, on runs whose answers are known."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from validation.study.rates import Point, above_floor, cheapest, reached, slope


def chain(errors: list[float], seconds: list[float], method: str = "status", order: int = 2) -> list[Point]:
    """Runs on h = 1, 1/2, 1/4, …"""
    return [Point(method, order, k, 0.5**k, 4**k, s, e) for k, (e, s) in enumerate(zip(errors, seconds, strict=True))]


@pytest.mark.parametrize("rate", [1.0, 1.5, 4.0])
def test_slope_of_a_power(rate: float) -> None:
    """C h^p has the slope p, whatever C; noise of ±1 % moves it by less than 0.02."""
    h = 0.5 ** np.arange(6)
    assert slope(list(h), list(7 * h**rate)) == pytest.approx(rate, abs=1e-12)
    noise = 1 + 0.01 * np.random.default_rng(0).uniform(-1, 1, 6)
    assert slope(list(h), list(7 * h**rate * noise)) == pytest.approx(rate, abs=0.02)


def test_no_slope_without_two_points() -> None:
    """One mesh, errors of zero and what is not a number give none."""
    assert math.isnan(slope([1.0], [1.0]))
    assert math.isnan(slope([1.0, 0.5], [1.0, 0.0]))
    assert math.isnan(slope([1.0, 0.5], [1.0, math.nan]))


def test_floor_ends_the_fit() -> None:
    """From the first error at the certificate's floor on, finer meshes say nothing about the rate."""
    points = chain([1e-4, 1e-6, 1e-9, 3e-8], [1.0, 2.0, 3.0, 4.0])
    assert [p.level for p in above_floor(reversed(points))] == [0, 1]


def test_cheapest_way() -> None:
    """The fastest of all methods and orders that keep the error on finer meshes; a lucky zero is none."""
    status = chain([1e-1, 1e-3, 1e-5], [0.1, 1.0, 10.0])
    lucky = chain([1e-1, 1e-6, 1e-2], [0.1, 0.2, 0.4], "lemke", 1)
    points = [*status, *lucky]
    assert cheapest(points, 1e-2) == replace(lucky[1], error=1e-2)  # 1e-6 there, 1e-2 on the next mesh
    assert cheapest(points, 1e-3) == status[1]
    assert cheapest(points, 1e-5) == status[2]
    assert cheapest(points, 1e-6) is None
    assert cheapest(chain([1e-3, math.nan], [1.0, 2.0]), 1e-2) is None


def test_reached_in_a_time() -> None:
    """The least kept error within a time; of equal errors the fastest; untimed runs do not count."""
    status = chain([1e-1, 1e-3, 1e-5], [0.1, 1.0, 10.0])
    slower = chain([1e-1, 0.999e-3, 1e-5], [0.2, 0.9999, 9.0], "tao")
    assert reached([*status, *slower], 1.0) == slower[1]
    assert reached([*status, *slower], 10.0) == slower[2]
    assert reached(chain([1e-6, 1e-2], [0.1, 1.0]), 1.0) == Point("status", 2, 0, 1.0, 1, 0.1, 1e-2)
    assert reached(status, 0.05) is None
    assert reached(chain([1e-3], [math.nan]), 1.0) is None
