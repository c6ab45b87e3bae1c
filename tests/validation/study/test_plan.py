"""What a study runs."""

from __future__ import annotations

import pytest

import validation.cases  # noqa: F401  enters the cases into the catalogue
from validation.case import CASES
from validation.study.plan import Settings, chains, sizes


def levels(name: str, count: int, **changes: str) -> list[float]:
    """1/h of the levels."""
    case = CASES[name]
    return [1 / h for h in sizes(case, case.configure({**changes}), count)]


def test_sizes() -> None:
    """A single level is made coarser and halved, several are gone through, no level stays none."""
    assert levels("hertz-line", 5) == pytest.approx([10, 20, 40, 80, 160])
    assert levels("transition", 2) == [8, 16]
    assert levels("transition", 6) == [8, 16, 32, 64, 128, 256]
    assert levels("hertz-point", 5, model="3d") == pytest.approx([8, 11, 16, 22, 32])
    assert levels("wavy", 6) == [20, 40, 80, 160]
    assert levels("two-bars", 5) == [1]


def test_every_case_takes_part() -> None:
    """Each case has a chain for each method and order that it allows, of at least four meshes if it has meshes."""
    planned = chains(Settings(tuple(CASES)))
    assert {c.case for c in planned} == set(CASES)
    assert len({c.key for c in planned}) == len(planned)
    for chain in planned:
        assert all(a > b for a, b in zip(chain.sizes, chain.sizes[1:], strict=False))
        assert len(chain.sizes) >= (4 if CASES[chain.case].levels else 1)
    assert {c.label for c in planned if c.case == "hertz-point"} == {"hertz-point", "hertz-point model=3d"}
