"""Linear bodies in time: mass, damping, the two integrators, and impacts against a stop."""

import numpy as np
import pytest
import scipy.sparse as sp
from fem_examples import DIMENSION, Floats, block, solid
from mpi4py import MPI

from fem.body import Body
from fem.elasticity import State
from fem.inertia import MASSES, Dynamics, Inertia
from fem.integrators import ImplicitEuler, Integrator, Midpoint
from fem.iteration_matrix import FACTORS
from fem.loads import Load, Support, external_forces
from fem.rigid_body import RigidBody
from fem.scalar import Laplacian
from fem.space import Space
from meshes.generators import generate

STATES: tuple[State, ...] = ("plane-strain", "plane-stress", "axisymmetric", "3d")


def _bar(n: int = 10, L: float = 1.0, order: int = 1, origin: float = 0.0, **options: object) -> Body:
    mesh = generate("interval", length=L, n=n, order=order, origin=origin)
    return Body("bar", Space(MPI.COMM_SELF, mesh, 1), Laplacian(1.0), **{"density": 1.0, **options})


def _free_step(body: Body, t: float, integrator: Integrator) -> None:
    body.begin(t, integrator)
    body.assemble()
    body.factor()
    body.free_motion()


def _drop(body: Body, node: int, gap: float, integrator: Integrator, steps: int, dt: float) -> list[dict[str, float]]:
    """A body whose `node` may not sink below −gap: time of balance, force, energy and imbalance of each step."""
    history, H = [], sp.csr_array(([1.0], ([0], [node])), shape=(1, body.space.owned))
    for k in range(steps):
        _free_step(body, (k + 1) * dt, integrator)
        W = float((H @ body.solve_rows(H))[0, 0])
        lam = max(0.0, -(gap + float(body.coordinates()[node])) / W)
        body.free_motion(lam * H.toarray()[0])
        entry = {
            "time": integrator.load_time((k + 1) * dt),
            "lam": lam,
            "imbalance": body.imbalance(lam * H.toarray()[0]),
        }
        body.accept()
        history.append({**entry, "energy": sum(body.energy().values()), "x": gap + float(body.coordinates()[node])})
    return history


def _column(history: list[dict[str, float]], key: str) -> Floats:
    return np.array([entry[key] for entry in history])


# --- mass -------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("state", STATES)
@pytest.mark.parametrize("order", [1, 2])
@pytest.mark.parametrize("mass", MASSES)
def test_kinetic_energy_of_a_translation(state: State, order: int, mass: str) -> None:
    """½ m |v|², with m the density times the volume (of revolution), on distorted cells."""
    dim = DIMENSION[state]
    mesh = block(dim, order, bend=0.05 if order == 2 else 0.0, origin=1.0)
    body = solid(mesh, state)
    inertia = Inertia(body.space, state == "axisymmetric", Dynamics(density=3.0, mass=mass))
    v = np.zeros((body.space.piece.owned, dim))
    v[:, -1] = 2.0
    volume = np.pi * (2**2 - 1**2) if state == "axisymmetric" else 1.0
    # Of the bent cells in axisymmetry the integrand's degree is above that of the quadrature rules.
    assert v.ravel() @ inertia.forces(v.ravel()) == pytest.approx(3.0 * volume * 4.0, rel=1e-12)


def test_consistent_mass_is_exact_for_quadratic_velocities() -> None:
    """∫ρ v² dx of v = x² on [0, 2] is 2⁵/5 ρ with second-order cells; ρh/6 [2 1; 1 2] with one of first order."""
    bar = _bar(3, L=2.0, order=2)
    v = bar.space.piece.points[:, 0] ** 2
    owned = np.empty_like(v)
    owned[bar.space.local_dofs] = v
    inertia = Inertia(bar.space, False, Dynamics(density=0.5))
    assert owned @ inertia.forces(owned) == pytest.approx(0.5 * 2**5 / 5, rel=1e-13)
    linear = Inertia(_bar(1, L=2.0).space, False, Dynamics(density=3.0))
    np.testing.assert_allclose(linear.cells[0], [[2.0, 1.0], [1.0, 2.0]], rtol=1e-14)


@pytest.mark.parametrize("mass", MASSES)
@pytest.mark.parametrize(("dim", "order"), [(1, 1), (1, 2), (2, 1), (2, 2), (3, 1)])
def test_redistribution_keeps_mass_and_momentum(dim: int, order: int, mass: str) -> None:
    """Nodes of a side lose all their mass; that of the body, and M 1 · 1, stay; M stays semi-definite."""
    mesh = generate("interval", length=1.0, n=4, order=order) if dim == 1 else block(dim, order)
    space = Space(MPI.COMM_SELF, mesh, dim)
    side = np.unique(space.piece.facets["start" if dim == 1 else "left"])
    inertia = Inertia(space, False, Dynamics(density=2.0, mass=mass))
    inertia.redistribute(side)
    M = np.stack([inertia.forces(e) for e in np.eye(space.owned)])
    dofs = space.local_dofs[space.dofs_of(side[:, None])].ravel()
    np.testing.assert_array_equal(M[dofs], 0)
    np.testing.assert_array_equal(M[:, dofs], 0)
    np.testing.assert_allclose(M, M.T, atol=1e-15)
    assert np.linalg.eigvalsh(M).min() > -1e-15
    assert M[::dim, ::dim].sum() == pytest.approx(2.0, rel=1e-13)
    if mass == "lumped":
        np.testing.assert_array_equal(M, np.diag(np.diag(M)))


def test_a_cell_of_massless_nodes_leaves_its_mass_to_the_body() -> None:
    """A corner between two massless sides; and where no node remains, there is nowhere to go."""
    space = Space(MPI.COMM_SELF, generate("box", size=[1.0, 1.0], n=3, structured=True), 2)
    inertia = Inertia(space, False, Dynamics(density=2.0))
    sides = [np.unique(space.piece.facets[tag]) for tag in ("left", "right", "bottom", "top")]
    inertia.redistribute(np.concatenate(sides))
    assert (np.isin(space.piece.cells, np.concatenate(sides)).all(axis=1)).any()
    assert inertia.cells.sum() == pytest.approx(2.0, rel=1e-13)
    with pytest.raises(ValueError, match="none is left to carry the mass"):
        inertia.redistribute(np.arange(len(space.piece.points)))


# --- integrators ------------------------------------------------------------------------------------------------------


def _mode(bar: Body) -> tuple[Floats, float]:
    """The first mode of a bar clamped at both ends, and its discrete ω² with a consistent mass."""
    h = 1 / (len(bar.space.piece.points) - 1)
    return np.sin(np.pi * bar.space.piece.points[:, 0]), 6 * (1 - np.cos(np.pi * h)) / (h**2 * (2 + np.cos(np.pi * h)))


def test_one_point_mass_has_no_dispersion() -> None:
    """With dt = h/c a pulse of any shape that runs to and fro by the midpoint rule is back after 2L/c, to round-off."""
    n = 20
    start = np.random.default_rng(1).uniform(-1, 1, n + 1) * np.sin(np.pi * np.arange(n + 1) / n)
    body = _bar(
        n, supports=[Support("start"), Support("end")], displacement=lambda x, t: start[: len(x)], mass="one-point"
    )
    with body:
        first = body.displacement
        for k in range(2 * n):
            _free_step(body, (k + 1) / n, Midpoint(1 / n))
            body.accept()
            if k == n - 1:
                np.testing.assert_allclose(body.displacement, -first[::-1], atol=1e-12)
        np.testing.assert_allclose(body.displacement, first, atol=1e-12)


def test_a_constant_load_is_assembled_once(monkeypatch: pytest.MonkeyPatch) -> None:
    """One that depends on time is assembled in each step."""
    calls = []
    monkeypatch.setattr("fem.body.external_forces", lambda *given: calls.append(given) or external_forces(*given))
    for value, times in ((1.0, 1), (lambda x, t: t + 0 * x[:, 0], 3)):
        calls.clear()
        with _bar(2, loads=[Load("body", value)]) as body:
            for k in range(3):
                _free_step(body, 0.1 * (k + 1), ImplicitEuler(0.1))
                body.accept()
        assert len(calls) == times


@pytest.mark.parametrize("rayleigh", [(0.0, 0.0), (0.3, 0.02)])
def test_midpoint_turns_a_mode_as_its_amplification_matrix_does(rayleigh: tuple[float, float]) -> None:
    """u'' + (a + bω²) u' + ω²u = 0 by the midpoint rule: (I − dt/2 L)⁻¹(I + dt/2 L) applied n times."""
    a, b = rayleigh
    body = _bar(
        supports=[Support("start"), Support("end")],
        displacement=lambda x, t: np.sin(np.pi * x[:, 0]),
        rayleigh=rayleigh,
    )
    shape, square = _mode(body)
    dt, n = 0.05, 30
    with body:
        for k in range(n):
            _free_step(body, (k + 1) * dt, Midpoint(dt))
            assert body.imbalance(np.zeros(body.space.owned)) < 1e-12
            body.accept()
        L = np.array([[0, 1], [-square, -(a + b * square)]])
        turn = np.linalg.solve(np.eye(2) - dt / 2 * L, np.eye(2) + dt / 2 * L)
        q, p = np.linalg.matrix_power(turn, n) @ [1.0, 0.0]
        np.testing.assert_allclose(body.displacement[:, 0], q * shape, atol=1e-12)
        np.testing.assert_allclose(body.velocity[:, 0], p * shape, atol=1e-11)


def test_implicit_euler_turns_a_mode_as_its_amplification_matrix_does() -> None:
    """(I − dt L)⁻¹ applied n times."""
    body = _bar(
        supports=[Support("start"), Support("end")], velocity=lambda x, t: np.sin(np.pi * x[:, 0]), rayleigh=(0.3, 0.02)
    )
    shape, square = _mode(body)
    dt, n = 0.05, 30
    with body:
        for k in range(n):
            _free_step(body, (k + 1) * dt, ImplicitEuler(dt))
            body.accept()
        L = np.array([[0, 1], [-square, -(0.3 + 0.02 * square)]])
        q, p = np.linalg.matrix_power(np.linalg.inv(np.eye(2) - dt * L), n) @ [0.0, 1.0]
        np.testing.assert_allclose(body.displacement[:, 0], q * shape, atol=1e-12)
        np.testing.assert_allclose(body.velocity[:, 0], p * shape, atol=1e-11)


@pytest.mark.parametrize("mixed", [False, True])
def test_energy_of_a_solid(mixed: bool) -> None:
    """From random velocities: the midpoint rule keeps the energy, implicit Euler never lets it grow."""
    start = np.random.default_rng(3).uniform(-1, 1, (200, 2))
    for integrator in (Midpoint(0.03), ImplicitEuler(0.03)):
        body = solid(block(2, 2), "plane-strain", [Support("left")], mixed=mixed)
        body = Body(
            "body", body.space, body.model, [Support("left")], density=2.0, velocity=lambda x, t: start[: len(x)]
        )
        with body:
            energies = []
            for k in range(20):
                _free_step(body, (k + 1) * 0.03, integrator)
                body.accept()
                energies.append(sum(body.energy().values()))
            if isinstance(integrator, Midpoint):
                np.testing.assert_allclose(energies, energies[0], rtol=1e-9)
            else:
                assert np.all(np.diff(energies) <= 0)


def test_supports_and_loads_are_those_of_the_integrator() -> None:
    """A free mass under the force t has v = t²/2 by the midpoint rule; a bar pulled at V coasts with its support."""
    body = _bar(2, loads=[Load("body", lambda x, t: t + 0 * x[:, 0])], mass="lumped")
    pulled = _bar(2, supports=[Support("start", value=lambda x, t: 3 * t)], velocity=3.0)
    with body, pulled:
        for k in range(10):
            _free_step(pulled, (k + 1) * 0.1, Midpoint(0.1))
            pulled.accept()
        np.testing.assert_allclose(pulled.velocity, 3.0, rtol=1e-12)
        np.testing.assert_allclose(pulled.displacement, 3.0, rtol=1e-12)
        for k in range(10):
            _free_step(body, (k + 1) * 0.1, Midpoint(0.1))
            body.accept()
        np.testing.assert_allclose(body.velocity, 0.5, rtol=1e-12)
    body = _bar(2, loads=[Load("body", lambda x, t: t + 0 * x[:, 0])])
    with body:
        for k in range(10):
            _free_step(body, (k + 1) * 0.1, ImplicitEuler(0.1))
            body.accept()
        np.testing.assert_allclose(body.velocity, 0.1 * 0.1 * 55, rtol=1e-12)


def test_factors_of_recent_steps_are_kept() -> None:
    """Halving and doubling the step factorises each size once; the oldest of too many goes."""
    with _bar() as body:
        kept = []
        for k in (0, 1, 2, 1, 0):
            _free_step(body, 1.0, ImplicitEuler(0.1 / 2**k))
            kept.append(body.A)
        assert kept[0] is kept[4]
        assert kept[1] is kept[3]
        for k in range(3, 3 + FACTORS):
            _free_step(body, 1.0, ImplicitEuler(0.1 / 2**k))
        _free_step(body, 1.0, ImplicitEuler(0.1))
        assert body.A is not kept[0]
        kept = [body.A]
        _free_step(body, 1.0, ImplicitEuler(1.0 - 0.9))  # not 0.1 to the last digit
        assert body.A is kept[0]


def test_a_rejected_step_leaves_no_trace() -> None:
    """restore(state()) before a repeated step, and resume(checkpoint()) in another body, give the same bits."""

    def moving() -> Body:
        return _bar(supports=[Support("start")], velocity=1.0)

    with moving() as body, moving() as other:
        _free_step(body, 0.1, Midpoint(0.1))
        body.accept()
        before, saved = body.state(), body.checkpoint()
        assert set(saved) == {"x", "v"}
        _free_step(body, 0.15, Midpoint(0.05))
        body.restore(before)
        _free_step(body, 0.2, Midpoint(0.1))
        body.accept()
        other.resume(saved)
        _free_step(other, 0.2, Midpoint(0.1))
        other.accept()
        np.testing.assert_array_equal(body.u, other.u)
        np.testing.assert_array_equal(body.checkpoint()["v"], other.checkpoint()["v"])


def test_statics_has_no_mass() -> None:
    """Without an inertial step a density costs nothing: no M, no v, and a free body floats."""
    with _bar() as body:
        assert body.inertia is None
        assert set(body.checkpoint()) == {"x"}
        assert body.modes.shape[1] == 1
        _free_step(body, 0.1, ImplicitEuler(0.1))
        assert body.modes.shape[1] == 0
        assert not body.held.any()


# --- impacts ----------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(("g", "impulses"), [(9.81, {5: 4.715, 6: 1.171, 7: 0.981}), (10.0, {4: 0.0, 5: 5.0, 6: 1.0})])
def test_ball_drop(g: float, impulses: dict[int, float]) -> None:
    """m = 1 from x₀ = 1 with dt = 0.1 (validation.md, E): x_n = x₀ − g dt² n(n+1)/2 until the stop is violated."""
    mesh = generate("interval", length=0.5, n=1, origin=1.0)
    ball = RigidBody("ball", Space(MPI.COMM_SELF, mesh, 1), loads=[Load("body", -2 * g)], total_mass=1.0)
    node = int(ball.space.local_dofs[np.unique(ball.facets("start"))[0]])
    history = _drop(ball, node, 1.0, ImplicitEuler(0.1), 20, 0.1)
    n = np.arange(1, 5)
    np.testing.assert_allclose(_column(history, "x")[:4], 1 - g * 0.01 * n * (n + 1) / 2, atol=1e-14)
    for step, impulse in impulses.items():
        assert 0.1 * history[step - 1]["lam"] == pytest.approx(impulse, abs=1e-12 if g == 10 else 5e-4)
    np.testing.assert_allclose(0.1 * _column(history, "lam")[7:], 0.1 * g, rtol=1e-12)
    assert _column(history, "imbalance").max() < 1e-12


def test_rigid_body_turns() -> None:
    """A unit square of mass 3 under a couple τ has the angular acceleration 6τ/m; a corner yields as 1/m + r²/I."""
    space = Space(MPI.COMM_SELF, generate("box", size=[1.0, 1.0], n=2, structured=True), 2)
    couple = Load("body", lambda x, t: np.stack([-(x[:, 1] - 0.5), x[:, 0] - 0.5], axis=1))
    body = RigidBody("block", space, loads=[couple], total_mass=3.0)
    _free_step(body, 0.1, Midpoint(0.1))
    assert body.imbalance(np.zeros(space.owned)) < 1e-14
    body.accept()
    # The couple is ∫ r² dx = 1/6, and the moment of inertia m/6.
    x = body.points - 0.5
    np.testing.assert_allclose(body.velocity, 0.1 / 3 * np.stack([-x[:, 1], x[:, 0]], axis=1), atol=1e-15)
    corner = np.flatnonzero((body.points == 0).all(axis=1))[0]
    e = np.zeros((space.owned, 1))
    e[space.local_dofs[2 * corner]] = 1
    body.begin(0.2, Midpoint(0.1))
    assert float((e.T @ body.solve(e))[0, 0]) == pytest.approx((1 / 3 + 0.5**2 / 0.5) / 400, rel=1e-12)


def _impact(integrator: Integrator, n: int, dt: float) -> tuple[Floats, Floats, Floats]:
    """`bar-impact`: E = 900, ρ = 1, L = 10 from h₀ = 5 at v₀ = 10 onto a stop: times, forces and energies."""
    mesh = generate("interval", length=10.0, n=n, origin=5.0)
    with Body("bar", Space(MPI.COMM_SELF, mesh, 1), Laplacian(900.0), density=1.0, velocity=-10.0) as body:
        first = np.unique(body.facets("start"))
        if isinstance(integrator, Midpoint):
            body.redistribute(first)
        history = _drop(body, int(body.space.local_dofs[first[0]]), 5.0, integrator, round(1.3 / dt), dt)
        assert _column(history, "imbalance").max() < 1e-8
        return _column(history, "time"), _column(history, "lam"), _column(history, "energy")


def test_bar_impact_by_implicit_euler() -> None:
    """The impulse's relative error is √(c dt/πL), within a tenth, and of order ½; the energy never grows."""
    errors, steps = [], [1 / 150, 1 / 300, 1 / 600]
    for dt in steps:
        _, lam, energy = _impact(ImplicitEuler(dt), 80, dt)
        errors.append(1 - dt * lam.sum() / 200)
        assert np.diff(energy).max() <= 1e-12 * energy[0]
    np.testing.assert_allclose(errors, np.sqrt(30 * np.array(steps) / (10 * np.pi)), rtol=0.02)
    assert np.polyfit(np.log(steps), np.log(errors), 1)[0] == pytest.approx(0.5, abs=0.01)


def test_bar_impact_by_the_midpoint_rule() -> None:
    """The impulse within 1e-3, the times of contact within 2 dt, the energy within 1 %, and p = ρcv₀ between."""
    h = 10 / 200
    dt = h / 30 / np.sqrt(2)
    time, lam, energy = _impact(Midpoint(dt), 200, dt)
    assert dt * lam.sum() == pytest.approx(200, rel=1e-3)
    closed = time[lam > 3]
    assert closed[[0, -1]] == pytest.approx([0.5, 0.5 + 20 / 30], abs=2 * dt)
    np.testing.assert_allclose(lam[(time > 0.6) & (time < 1.0)], 300, rtol=1e-4)
    np.testing.assert_allclose(energy, 500, rtol=0.01)


# --- bad input --------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"density": -1.0}, "density = -1.0: must be finite and >= 0"),
        ({"density": np.nan}, "density = nan: must be"),
        ({"mass": "row-sum"}, "mass = 'row-sum': must be one of consistent, lumped, one-point"),
        ({"rayleigh": (0.1,)}, r"rayleigh = \[0.1\]: must be two numbers >= 0"),
        ({"rayleigh": (-0.1, 0.0)}, r"rayleigh = \[-0.1, 0.0\]: must be two"),
        ({"density": 0.0, "rayleigh": (0.1, 0.0)}, r"rayleigh = \[0.1, 0.0\]: needs a density > 0"),
        ({"displacement": [1.0, 2.0]}, r"displacement = \[1.0, 2.0\]: must give 1 components"),
        ({"displacement": np.inf}, "displacement = inf: must be finite"),
    ],
)
def test_bad_input(options: dict[str, object], message: str) -> None:
    """One line names the body, the key, the value and what is allowed."""
    with pytest.raises(ValueError, match="body 'bar': " + message):
        _bar(**options)


def test_a_rigid_body_takes_rigid_velocities_and_one_mass() -> None:
    """Guides let it only translate; mass and density exclude each other."""
    space = Space(MPI.COMM_SELF, block(2, 1), 2)
    body = RigidBody("block", space, guided=True, density=1.0, velocity=lambda x, t: x)
    with pytest.raises(ValueError, match=r"body 'block': velocity = .* not one of its rigid motions"):
        body.begin(0.1, ImplicitEuler(0.1))
    with pytest.raises(ValueError, match=r"body 'block': total_mass = 2.0: .* not both"):
        RigidBody("block", space, total_mass=2.0, density=1.0)
