"""Rigid motions: how many, their energy, which of them supports hold, and pins."""

import numpy as np
import pytest
from fem_examples import DIMENSION, block, solid

from fem.elasticity import State
from fem.loads import Support
from fem.rigid import floating_modes, pin, rigid_modes

COUNT: dict[State, int] = {"plane-strain": 3, "plane-stress": 3, "axisymmetric": 1, "3d": 6}


@pytest.mark.parametrize("state", COUNT)
@pytest.mark.parametrize("order", [1, 2])
def test_rigid_motions_have_no_energy(state: State, order: int) -> None:
    """They are 3 in the plane, 6 in space, 1 in axisymmetry, independent, and without internal forces."""
    body = solid(block(DIMENSION[state], order, origin=5.0), state)
    R = rigid_modes(body.space, state == "axisymmetric")
    assert R.shape == (body.space.owned, COUNT[state])
    assert np.linalg.cond(R) < 10
    for mode in R.T:
        body.u = body.space.local(mode)
        np.testing.assert_allclose(body.internal_forces(), 0, atol=1e-12)


def test_mixed_rigid_motions_have_no_pressure() -> None:
    """In the mixed form the pressures of a rigid motion are zero."""
    body = solid(block(2, 2), "plane-strain", mixed=True)
    for mode in body.rigid_modes().T:
        body.u = body.space.local(mode)
        np.testing.assert_allclose(body.internal_forces(), 0, atol=1e-13)


@pytest.mark.parametrize(
    ("state", "supports", "left"),
    [
        ("plane-strain", [], 3),
        ("plane-strain", [("left", None)], 0),
        ("plane-strain", [("left", 0)], 1),
        ("plane-strain", [("left", 0), ("bottom", 1)], 0),
        ("plane-strain", [("left", 0), ("right", 0)], 1),
        ("axisymmetric", [("left", 0)], 1),
        ("axisymmetric", [("bottom", 1)], 0),
        ("3d", [("left", 0), ("front", 1)], 1),
        ("3d", [("left", 0)], 3),
        ("3d", [("left", 0), ("front", 1), ("bottom", 2)], 0),
    ],
)
def test_floating_modes(state: State, supports: list[tuple[str, int | None]], left: int) -> None:
    """Those that no support holds: they vanish at the supports and are rigid; pins on as many unknowns hold them."""
    body = solid(block(DIMENSION[state], 1, origin=1.0), state, [Support(tag, i) for tag, i in supports])
    modes = floating_modes(body.space.comm, body.rigid_modes(), body.fixed)
    assert modes.shape[1] == body.modes.shape[1] == left
    np.testing.assert_allclose(modes[body.fixed], 0, atol=1e-14)
    for mode in modes.T:
        body.u = body.space.local(mode)
        np.testing.assert_allclose(body.internal_forces(), 0, atol=1e-12)
    pins = pin(body.space.comm, modes)
    assert len(pins) == left
    assert not left or np.linalg.cond(modes[pins]) < 10


def test_one_support_in_many_nodes_is_seen() -> None:
    """One fixed node among thousands holds the translations; the rotation about it is left."""
    body = solid(block(2, 1, n=60), "plane-strain")
    body.fixed[:2] = True
    modes = floating_modes(body.space.comm, body.rigid_modes(), body.fixed)
    assert modes.shape[1] == 1
    np.testing.assert_allclose(modes[:2], 0, atol=1e-12)
