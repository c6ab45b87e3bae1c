"""A beam as a body in statics: closed forms, consistent loads, supports, and what is refused."""

from __future__ import annotations

import numpy as np
import pytest
from rod_examples import EA, EI, balance, beam

from fem.beams.beam import TURN
from fem.beams.beam_parts import BeamLoads, Drive
from fem.integrators import Static
from fem.rotations import exp
from meshes.centrelines import arc, straight


def test_cantilever():
    """PL³/3EI and PL²/2EI at the nodes, and the reaction and its moment at the clamp."""
    P = 1e-6
    loads = BeamLoads(points=[(8, lambda t: np.array([0.0, P * t, 0.0, 0.0, 0.0, 0.0]))])
    with beam(drives=[Drive(0)], loads=loads) as rod:
        balance(rod)
        assert rod.displacement[-1, 1] == pytest.approx(P / 3 / EI, rel=1e-9)
        assert rod.R[-1, 1, 0] == pytest.approx(P / 2 / EI, rel=1e-9)
        reactions = rod.reactions()
        np.testing.assert_allclose(reactions[0], [0, -P, 0, 0, 0, -P], atol=1e-16 * EA)
        assert not reactions[1:].any()


@pytest.mark.parametrize("elements", [1, 3])
def test_line_load_is_consistent(elements):
    """qL⁴/8EI and qL³/6EI at the end already with one element: moments of a line load count."""
    q = 1e-6
    loads = BeamLoads(line=lambda t: np.tile([0.0, 0.0, q * t], (elements, 1)))
    with beam(straight(1.0, elements), [Drive(0)], loads) as rod:
        balance(rod)
        assert rod.displacement[-1, 2] == pytest.approx(q / 8 / EI, rel=1e-9)
        assert rod.R[-1, 2, 0] == pytest.approx(q / 6 / EI, rel=1e-9)
        np.testing.assert_allclose(rod.reactions()[0], [0, 0, -q, 0, q / 2, 0], atol=1e-16 * EA)


def test_line_load_on_a_bent_beam():
    """Large deflection: half the load on the arm of a clamp is in balance with its reactions."""
    q = np.array([0.3, -1.0, 20.0])
    loads = BeamLoads(line=lambda t: np.tile(q, (8, 1)))
    with beam(arc(1.0, 8, 0.7), [Drive(0)], loads) as rod:
        balance(rod)
        np.testing.assert_allclose(rod.reactions()[0, :3], -q, atol=1e-8)
        assert np.linalg.norm(rod.displacement[-1]) > 0.3


def test_a_moment_rolls_a_beam_up():
    """EI φ/L at the end makes a circle, whatever the number of elements; the strain energy is EI φ²/2L."""
    loads = BeamLoads(points=[(8, lambda t: np.array([0.0, 0.0, 0.0, 0.0, 0.0, 2 * np.pi * EI * t]))])
    with beam(drives=[Drive(0)], loads=loads) as rod:
        for t in (0.25, 0.5, 0.75, 1.0):
            balance(rod, t)
        np.testing.assert_allclose(rod.x[-1], rod.x[0], atol=1e-9)
        assert rod.energy() == pytest.approx({"kinetic": 0.0, "strain": EI * 2 * np.pi**2}, rel=1e-9)


def test_drives():
    """An end pushed along and aside and turned through many times π; the clamped end resists nothing but strain."""
    turn, shift = np.array([3.0, -4.0, 2.0]), np.array([0.2, 0.1, -0.3])
    motion = Drive(0, motion=lambda t: np.concatenate([shift, turn]) * t)
    with beam(arc(1.0, 8, 0.5), [motion]) as rod:
        for t in np.linspace(0.1, 2.0, 20):
            balance(rod, t)
            Q = exp(turn * t)
            np.testing.assert_allclose(rod.R[0], Q @ rod.start_frames[0], atol=1e-12)
            np.testing.assert_allclose(rod.x, rod.start[0] + shift * t + (rod.start - rod.start[0]) @ Q.T, atol=1e-9)
        assert rod.energy()["strain"] < 1e-15 * EA


def test_some_components_driven():
    """A beam pinned at both ends of which one is pushed sideways keeps straight; one is free to turn."""
    held = [Drive(0, (0, 1, 2, 3)), Drive(8, (1, 2), lambda t: np.array([9.0, 0.1 * t, 0.0, 9.0, 9.0, 9.0]))]
    with beam(drives=held) as rod:
        balance(rod)
        direction = rod.x[-1] - rod.x[0]
        assert direction[1] == pytest.approx(0.1, rel=1e-14)
        assert np.linalg.norm(direction) == pytest.approx(1.0, rel=1e-12)
        np.testing.assert_allclose(rod.x - rod.x[0], np.outer(np.linspace(0, 1, 9), direction), atol=1e-10)


@pytest.mark.parametrize(
    ("drives", "left"),
    [
        ([], 6),
        ([Drive(0, (0, 1, 2))], 3),
        ([Drive(0, (0, 1, 2)), Drive(8, (0, 1, 2))], 1),
        ([Drive(0, (1, 2, 3)), Drive(8, (1, 2))], 1),
        ([Drive(0, (3, 4, 5))], 3),
    ],
    ids=["free", "one pin", "two pins turn about their line", "slides along", "turning is held, shifting not"],
)
def test_a_static_beam_that_can_move_is_refused(drives, left):
    """Named are the body and the number of its rigid motions."""
    with pytest.raises(ValueError, match=rf"'rod': {left} rigid motion"):
        beam(drives=drives)
    with beam(drives=drives, dynamic={}):
        pass


def test_three_pins_hold_a_curved_beam():
    """They do not lie on one line; on a straight beam they would."""
    pins = [Drive(node, (0, 1, 2)) for node in (0, 4, 8)]
    with beam(arc(1.0, 8, 0.5), pins):
        pass
    with pytest.raises(ValueError, match="1 rigid motion"):
        beam(drives=pins)


def test_loads_and_drives_must_be_finite():
    """A support or load that is not a number at some time is named, with the time."""
    bad = lambda t: np.full(6, np.nan)  # noqa: E731
    for options in ({"drives": [Drive(0, motion=bad)]}, {"drives": [Drive(0)], "loads": BeamLoads(points=[(3, bad)])}):
        with beam(**options) as rod, pytest.raises(ValueError, match=r"'rod': .* not finite at t = 2"):
            rod.begin(2.0, Static())


def test_imbalance():
    """Scale-free: far from 0 off equilibrium, and 0 where nothing acts, also after a rigid motion of a curved beam."""
    with beam(arc(1.0, 8, 0.5), [Drive(0)]) as rod:
        nothing = np.zeros(rod.space.size)
        Q, (x, R, edges, v, w) = exp(np.array([1.0, 2.0, -0.7])), rod.state()
        moved = x @ Q.T + 3.0
        assert rod.imbalance(nothing) <= 1e-8
        rod.restore((moved, Q @ R, edges @ Q.T, v, w))
        assert rod.imbalance(nothing) <= 1e-8
        bent = moved + 1e-3 * np.random.default_rng(0).normal(size=moved.shape)
        rod.restore((bent, Q @ R, np.diff(bent, axis=0), v, w))
        assert rod.imbalance(nothing) > 0.1
        balanced = -rod.residual()
        assert rod.imbalance(balanced) <= 1e-14


def test_an_increment_too_long_is_cut():
    """A hundred times the load that bends it to a circle turns no node further than its linearisation holds."""
    loads = BeamLoads(points=[(8, lambda t: np.array([0.0, 0.0, 0.0, 0.0, 0.0, 200 * np.pi * EI]))])
    with beam(drives=[Drive(0)], loads=loads) as rod:
        rod.begin(1.0, Static())
        rod.assemble()
        rod.factor()
        rod.free_motion()
        free = rod.u.reshape(-1, 6).copy()
        rod.correct(np.zeros(rod.space.size))
        turned = np.arctan2(rod.R[:, 1, 0], rod.R[:, 0, 0])
        assert 0 < np.abs(turned).max() <= TURN * (1 + 1e-12)
        np.testing.assert_allclose(turned / turned[-1], free[:, 5] / free[-1, 5], atol=1e-12)
