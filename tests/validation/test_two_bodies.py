"""Cases of two deformable bodies: exact to round-off, or errors at coarse levels that follow from the rates."""

from __future__ import annotations

from typing import Any

import pytest
from test_cases import solve, within

from validation.case import CASES


@pytest.mark.parametrize("order", [1, 2])
@pytest.mark.parametrize("changes", CASES["patch"].variants, ids=str)
def test_patch(order: int, changes: dict[str, Any]) -> None:
    """Uniform stress to 1e-10 for face ratios from 1:1 to 1:10 either way, in the plane and in space, P1 and P2."""
    h = CASES["patch"].sizes(CASES["patch"].configure(changes))[0]
    _, found = solve("patch", h, order, **changes)
    within(found, {"force": 1e-10, "pressure_error": 1e-10, "displacement_error": 1e-10, "unbalanced": 1e-12})


@pytest.mark.parametrize("multiplier", ["vertex", "dual"])
@pytest.mark.parametrize("side", ["body", "other"])
@pytest.mark.parametrize("dim", ["2d", "3d"])
def test_patch_on_either_side(dim: str, side: str, multiplier: str) -> None:
    """Whichever body has the multipliers, and whichever basis."""
    _, found = solve("patch", 1 / 5, dim=dim, side=side, multiplier=multiplier, cells="free", tilt=10.0)
    within(found, {"force": 1e-10, "pressure_error": 1e-10, "displacement_error": 1e-10, "unbalanced": 1e-12})
