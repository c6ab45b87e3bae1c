"""Bodies that move by rigid motions alone."""

import numpy as np
import pytest
from fem_examples import block
from mpi4py import MPI

from fem.integrators import Static
from fem.loads import Load, Support
from fem.rigid_body import RigidBody
from fem.space import Space


def _block(*supports: Support, loads: tuple[Load, ...] = (), **options: bool) -> RigidBody:
    return RigidBody("block", Space(MPI.COMM_SELF, block(2, 1), 2), supports, loads, **options)


@pytest.mark.parametrize(("guided", "held", "modes"), [(False, [], 3), (True, [], 2), (True, [0], 1), (False, [0], 1)])
def test_modes(guided: bool, held: list[int], modes: int) -> None:
    """Three in the plane, two on guides; a guided side keeps the motion along it."""
    body = _block(*[Support("left", i) for i in held], guided=guided)
    assert body.modes.shape[1] == modes
    assert len(body.pins) == modes


def test_a_body_held_everywhere_is_in_balance() -> None:
    """No mode is left for a force to move."""
    body = _block(Support("left"), loads=(Load("body", [3.0, 4.0]),))
    body.begin(0.0, Static())
    assert body.modes.shape[1] == 0
    assert body.imbalance(np.zeros(body.space.owned)) == 0.0


def test_imbalance_is_that_of_the_resultants() -> None:
    """A weight is balanced by forces of the same resultant and moment, and by no others."""
    body = _block(loads=(Load("body", [0.0, -1.0]),))
    body.begin(0.0, Static())
    none = np.zeros(body.space.owned)
    corners = [np.flatnonzero((body.space.piece.points == corner).all(axis=1))[0] for corner in ([0, 0], [1, 0])]
    both, one = none.copy(), none.copy()
    both[[2 * k + 1 for k in corners]] = 0.5
    one[2 * corners[0] + 1] = 1.0
    assert body.imbalance(none) > 0.5
    assert body.imbalance(both) < 1e-14
    assert body.imbalance(one) > 0.1


def test_it_does_not_deform() -> None:
    """No force changes its shape: A⁻¹ is zero, and a free motion leaves it where it is."""
    body = _block(loads=(Load("body", [0.0, -1.0]),))
    body.assemble()
    body.factor()
    body.begin(0.0, Static())
    body.free_motion()
    np.testing.assert_array_equal(body.u, 0)
    np.testing.assert_array_equal(body.solve(np.ones((body.space.owned, 3))), 0)


def test_supports_prescribe_zero() -> None:
    """A rigid body does not follow a prescribed displacement."""
    for value in (0.1, lambda x, t: 0 * x):
        with pytest.raises(ValueError, match="body 'block': the supports of a rigid body prescribe zero"):
            _block(Support("left", value=value))
