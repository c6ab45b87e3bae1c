"""A beam as a body: statics, implicit Euler against closed forms, and the state it gives back."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.linalg import eigh

from fem.beams.beam import TURN, Beam
from fem.beams.beam_element import beam_data
from fem.beams.beam_parts import BeamInertia, BeamLoads, Drive
from fem.beams.beam_sections import Stiffness
from fem.integrators import ImplicitEuler, Static
from fem.rotations import exp
from meshes.centrelines import arc, straight

EA, GJ, EI, MASS = 3e3, 1.2, 2.0, 0.5  # MASS per length
G = np.array([0.0, -9.81, 0.0])


def inertia_of(length, consistent=False, rayleigh=(0.0, 0.0), velocity=(0.0, 0.0, 0.0)):
    """Mass and a small rotary inertia of a uniform beam with elements of the lengths given."""
    own, shared = (1 / 3, 1 / 6) if consistent else (1 / 2, 0.0)
    nodes, rotary = np.zeros(len(length) + 1), np.zeros((len(length) + 1, 3))
    for part in (slice(None, -1), slice(1, None)):
        nodes[part] += own * MASS * length
        rotary[part] += (MASS * length**3 / 210)[:, None]
    return BeamInertia(nodes, shared * MASS * length, rotary, rayleigh, velocity)


def beam(line=None, drives=(), loads=None, dynamic=None, radius=1e-2):
    """A beam in its rest shape; `dynamic` are the options of its inertia."""
    line = line or straight(1.0, 8)
    data = beam_data(line, [Stiffness(EA, GJ, EI, MASS)])
    inertia = None if dynamic is None else inertia_of(data.length, **dynamic)
    radii = np.full(len(data.length), radius)
    return Beam("rod", line.points, line.frames, data, radii, drives, loads, inertia)


def balance(body, t=1.0, integrator=None, passes=60):
    """One step to time t by Newton's method to the default tolerance, and two passes more to round-off."""
    nothing, left = np.zeros(body.space.size), 2
    body.begin(t, integrator or Static())
    for _ in range(passes):
        body.assemble()
        body.factor()
        body.free_motion()
        body.correct(nothing)
        body.renew()
        left -= body.imbalance(nothing) <= 1e-8
        if left < 0:
            body.accept()
            return
    raise AssertionError(f"no equilibrium: {body.imbalance(nothing)}")


def dense(matrix):
    every = np.arange(matrix.getSize()[0], dtype=np.int32)
    return matrix.getValues(every, every)


# --- statics ----------------------------------------------------------------------------------------------------------


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


# --- dynamics ---------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("consistent", [False, True])
@pytest.mark.parametrize("line", [straight(1.0, 5), arc(1.0, 6, 0.3)], ids=["straight", "bent"])
def test_free_fall(line, consistent):
    """x_n = n dt v₀ + n(n+1)/2 dt² g for every node, exactly, also with damping by strain rates; nothing strains."""
    dt, velocity = 0.01, np.array([1.0, 2.0, -3.0])
    own = inertia_of(np.diff(line.arc), consistent)
    weights = own.nodes + np.append(own.links, 0.0) + np.append(0.0, own.links)
    loads = BeamLoads(
        points=[(i, lambda t, w=w: np.append(w * G, np.zeros(3))) for i, w in enumerate(weights)]  # type: ignore[misc]
    )
    dynamic = {"consistent": consistent, "rayleigh": (0.0, 0.05), "velocity": tuple(velocity)}
    with beam(line, loads=loads, dynamic=dynamic) as rod:
        for n in range(1, 21):
            balance(rod, n * dt, ImplicitEuler(dt))
            exact = n * dt * velocity + n * (n + 1) / 2 * dt**2 * G
            np.testing.assert_allclose(rod.displacement, np.tile(exact, (len(rod.x), 1)), atol=1e-11)
            np.testing.assert_allclose(rod.v, np.tile(velocity + n * dt * G, (len(rod.x), 1)), atol=1e-9)
        assert rod.energy()["strain"] <= 1e-15 * EA


@pytest.mark.parametrize("dt", [1e-4, 1e-6, 1e-8])
def test_short_steps_keep_their_digits(dt):
    """Rates do not see the round-off of the nodes' places, 1e-16 m / dt: of a slow beam, clamped and in flight."""
    velocity = (0.0, 1e-3, 0.0)
    with beam(drives=[Drive(0)], dynamic={"velocity": velocity}) as rod:
        for n in range(1, 11):
            balance(rod, n * dt, ImplicitEuler(dt))
    with beam(dynamic={"velocity": velocity}) as rod:
        for n in range(1, 11):
            balance(rod, n * dt, ImplicitEuler(dt))
        np.testing.assert_allclose(rod.v, np.tile(velocity, (9, 1)), rtol=0, atol=1e-15)


def test_free_fall_under_a_line_load():
    """The centre of mass falls exactly; the load's moments at the free ends, qℓ²/12, bend the beam with ℓ²."""
    dt, deviation = 0.01, []
    for elements in (8, 16, 32):
        loads = BeamLoads(line=lambda t, m=elements: np.tile(MASS * G, (m, 1)))
        with beam(straight(1.0, elements), loads=loads, dynamic={}) as rod:
            for n in range(1, 11):
                balance(rod, n * dt, ImplicitEuler(dt))
                exact = n * (n + 1) / 2 * dt**2 * G
                np.testing.assert_allclose(rod.inertia.nodes @ rod.displacement / MASS, exact, atol=1e-11)
            deviation.append(np.abs(rod.displacement - exact).max())
    rates = np.log2(np.array(deviation[:-1]) / deviation[1:])
    assert rates == pytest.approx(2.0, abs=0.3)


@pytest.mark.parametrize("rayleigh", [(0.0, 0.0), (3.0, 0.0), (0.0, 2e-3)], ids=["undamped", "a", "b"])
def test_vibrating_cantilever(rayleigh):
    """In its first mode each step obeys (q₁ − 2q₀ + q₋₁)/dt² + (a + bω²)(q₁ − q₀)/dt + ω²q₁ = 0.

    ω of the discrete beam is within 1e-3 of 1.8751² √(EI/mL⁴).
    """
    dt, size = 5e-3, 1e-5
    line = straight(1.0, 16)
    with beam(line, [Drive(0)]) as still:
        still.begin(0.0, Static())
        still.assemble()
        K = dense(still.A)[6:, 6:]
    with beam(line, [Drive(0)], dynamic={"consistent": True}) as rod:
        rod.begin(0.0, ImplicitEuler(dt))
        rod.assemble()
        M = (dense(rod.A)[6:, 6:] - K) * dt**2
    values, modes = eigh(K, M)
    omega = np.sqrt(values[0])
    assert omega == pytest.approx(1.8751040687**2 * np.sqrt(EI / MASS), rel=1e-3)
    mode = np.append(np.zeros(6), modes[:, 0] / np.abs(modes[:, 0]).max()).reshape(-1, 6)

    with beam(line, [Drive(0)], dynamic={"consistent": True, "rayleigh": rayleigh}) as rod:
        x, R, _, v, w = rod.state()
        x, R = x + size * mode[:, :3], exp(size * mode[:, 3:]) @ R
        rod.restore((x, R, np.diff(x, axis=0), v, w))
        weight = M @ mode.ravel()[6:]
        a, b = rayleigh
        c = a + b * omega**2
        q = [1.0, 1.0]  # at rest before
        for n in range(1, 60):
            balance(rod, n * dt, ImplicitEuler(dt))
            q.append((2 * q[-1] - q[-2] + c * dt * q[-1]) / (1 + c * dt + (omega * dt) ** 2))
            turns = np.stack([np.zeros(len(rod.x)), -rod.R[:, 2, 0], rod.R[:, 1, 0]], axis=1)
            d = np.column_stack([rod.displacement, turns]).ravel()[6:]
            amplitude = weight @ d / (weight @ mode.ravel()[6:])
            assert amplitude / size == pytest.approx(q[-1], abs=1e-5)
        assert min(q) < -0.1


def test_damping_of_strain_rates_resists_no_rigid_motion():
    """Turned about at once by 1.2 rad, damped by b or not, it has the same forces; strained, it has not."""
    bodies = [beam(arc(1.0, 8, 0.5), dynamic={"rayleigh": (0.0, b)}) for b in (0.0, 10.0)]
    Q, twisted = exp(np.array([0.3, -1.0, 0.6])), []
    for strain in (0.0, 1e-3):
        residuals = []
        for body in bodies:
            x, R, _, v, w = first = body.state()
            body.begin(0.0, ImplicitEuler(0.01))
            moved = (1 + strain) * x @ Q.T
            body.restore((moved, Q @ R, np.diff(moved, axis=0), v, w))
            residuals.append(body.residual())
            body.restore(first)
        twisted.append(np.abs(residuals[1] - residuals[0]).max())
    assert twisted[0] <= 1e-9 * EA
    assert twisted[1] >= 0.5 * EA * 1e-3 * 10.0 / 0.01
    for body in bodies:
        body.close()


def test_rayleigh_a_resists_motion():
    """A free beam that is thrown slows down as v₀/(1 + a dt)ⁿ."""
    dt, a = 0.01, 4.0
    with beam(dynamic={"rayleigh": (a, 0.0), "velocity": (1.0, 0.0, 2.0)}) as rod:
        for n in range(1, 6):
            balance(rod, n * dt, ImplicitEuler(dt))
            np.testing.assert_allclose(
                rod.v, np.tile(np.array([1.0, 0.0, 2.0]) / (1 + a * dt) ** n, (9, 1)), atol=1e-11
            )


def test_energy():
    """½mv² in flight; half released from a large bend it falls from step to step and goes over into motion and back."""
    with beam(dynamic={"consistent": True, "velocity": (3.0, 0.0, 4.0)}) as rod:
        assert rod.energy() == pytest.approx({"kinetic": MASS * 25 / 2, "strain": 0.0}, rel=1e-14)
    pull = BeamLoads(points=[(8, lambda t: np.array([0.0, 10.0 if t <= 0 else 0.0, 0.0, 0.0, 0.0, 0.0]))])
    with beam(drives=[Drive(0)], loads=pull) as bent:
        balance(bent, 0.0)
        start = bent.state()
    with beam(drives=[Drive(0)], loads=pull, dynamic={}) as rod:
        rod.restore(start)
        total, kinetic = [sum(rod.energy().values())], []
        for n in range(1, 61):
            balance(rod, n * 0.01, ImplicitEuler(0.01))
            energy = rod.energy()
            total.append(energy["kinetic"] + energy["strain"])
            kinetic.append(energy["kinetic"])
        assert (np.diff(total) <= 1e-12 * total[0]).all()
        assert max(kinetic) > 0.3 * total[0]


def test_spinning_about_its_axis():
    """A free wire that spins about itself keeps its angular velocity: R follows w from step to step."""
    rate, dt = 5.0, 0.05
    with beam(dynamic={}) as rod:
        x, R, edges, v, w = rod.state()
        rod.restore((x, R, edges, v, w + np.array([rate, 0.0, 0.0])))
        for n in range(1, 41):
            balance(rod, n * dt, ImplicitEuler(dt))
        np.testing.assert_allclose(rod.R, np.tile(exp(np.array([rate * 2.0, 0.0, 0.0])), (9, 1, 1)), atol=1e-9)
        np.testing.assert_allclose(rod.w, np.tile([rate, 0.0, 0.0], (9, 1)), atol=1e-9)
        assert rod.energy()["kinetic"] == pytest.approx(rod.inertia.rotary[:, 0].sum() * rate**2 / 2, rel=1e-9)


# --- state ------------------------------------------------------------------------------------------------------------


def thrown():
    """A pushed, loaded, damped beam in motion."""
    loads = BeamLoads(line=lambda t: np.tile(MASS * G, (8, 1)))
    push = Drive(0, motion=lambda t: np.array([0.1 * t, 0.0, 0.0, t, 0.0, 0.0]))
    return beam(arc(1.0, 8, 0.6), [push], loads, {"rayleigh": (0.1, 1e-3)})


def march(body, first, last):
    for n in range(first, last):
        balance(body, (n + 1) * 0.02, ImplicitEuler(0.02))


def test_a_rejected_step_leaves_no_trace():
    """After `restore` the next step is bit for bit what it would have been."""
    with thrown() as straight_on, thrown() as back:
        march(straight_on, 0, 4)
        march(back, 0, 3)
        before = back.state()
        back.begin(0.5, ImplicitEuler(0.4))
        back.assemble()
        back.factor()
        back.free_motion()
        back.correct(np.ones(back.space.size))
        back.restore(before)
        for one, two in zip(back.state(), before, strict=True):
            np.testing.assert_array_equal(one, two)
        march(back, 3, 4)
        for one, two in zip(back.state(), straight_on.state(), strict=True):
            np.testing.assert_array_equal(one, two)


def test_a_state_is_a_copy():
    with thrown() as rod:
        kept = rod.state()
        saved = rod.checkpoint()
        march(rod, 0, 1)
        np.testing.assert_array_equal(kept[0], rod.start)
        np.testing.assert_array_equal(saved["x"], rod.start)
        rod.restore(kept)
        rod.x += 1.0
        np.testing.assert_array_equal(kept[0], rod.start)


def test_checkpoint_and_resume():
    """Another beam of the same scene goes on bit for bit; one of another number of nodes is refused."""
    with thrown() as whole, thrown() as other, beam(straight(1.0, 5), [Drive(0)]) as wrong:
        march(whole, 0, 2)
        saved = whole.checkpoint()
        march(whole, 2, 5)
        other.resume(saved)
        march(other, 2, 5)
        for one, two in zip(whole.state(), other.state(), strict=True):
            np.testing.assert_array_equal(one, two)
        for bad in (saved, {}):
            with pytest.raises(ValueError, match=r"resume: the record's body 'rod' has another number of nodes"):
                wrong.resume(bad)
