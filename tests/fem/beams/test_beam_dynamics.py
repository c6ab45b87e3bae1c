"""A beam as a body in motion: implicit Euler against closed forms, and the state it gives back."""

from __future__ import annotations

import numpy as np
import pytest
from rod_examples import EA, EI, MASS, G, balance, beam, dense, inertia_of
from scipy.linalg import eigh

from fem.beams.beam_parts import BeamLoads, Drive
from fem.integrators import ImplicitEuler, Static
from fem.rotations import exp
from meshes.centrelines import arc, straight


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


def test_where_a_long_step_begins():
    """Velocities lead a beam in flight however far it goes, but one that is held does not get there."""
    for drives, moved in (([], 1e3), ([Drive(0)], 0.0)):
        with beam(drives=drives, dynamic={"velocity": (0.0, 1.0, 0.0)}) as rod:
            rod.begin(1e3, ImplicitEuler(1e3))
            np.testing.assert_allclose(rod.displacement, np.tile([0.0, moved, 0.0], (9, 1)), atol=1e-9)


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


def test_a_step_leaves_states_as_they_were():
    """What moves a beam makes new arrays; a state and a checkpoint are those of the moment they were taken."""
    with thrown() as rod:
        kept, saved = rod.state(), rod.checkpoint()
        before = [part.copy() for part in kept]
        march(rod, 0, 2)
        assert np.abs(rod.x - before[0]).max() > 0
        for one, two, three in zip(kept, saved.values(), before, strict=True):
            np.testing.assert_array_equal(one, three)
            np.testing.assert_array_equal(two, three)
        rod.restore(kept)
        march(rod, 0, 2)
        np.testing.assert_array_equal(kept[0], before[0])


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
