"""A wire among walls: each step balanced and certified, at any speed, the same on any number of ranks."""

from __future__ import annotations

from itertools import pairwise

import device_examples
import numpy as np
import pytest
from device_examples import RADIUS, pushed, run, wire
from device_examples import contact as contact_table
from ranks import same_on_two_ranks

import contact.devices.device_contact
import contact.step
import contact.system
from contact.certificate import Tolerances
from contact.clock import Clock
from contact.devices.device_contact import DeviceContact
from contact.linearisation import Linearisation
from contact.solvers.problem import ContactNotConvergedError, InfeasibleError
from contact.surfaces.convolution import ConvolutionSurface
from contact.surfaces.detection import nearest
from contact.surfaces.implicit import Foot


def pressed(name, **changes):
    """A clamped wire whose other end is pushed down on something in its way, under a line load, in statics."""
    surface, way = OBSTACLES[name]
    loads = [{"kind": "line", "value": [0.3, -0.2, -0.4]}]
    supports = [{"at": "start"}, {"at": "end", "displacement": [0.0, 0.0, f"-{way} * t"], "hold": ["z", "y"]}]
    return {
        "body": [wire(supports=supports, loads=loads)],
        "contact": [contact_table(surface)],
        "time": {"steps": 4},
        **changes,
    }


OBSTACLES = {
    "plane": ({"kind": "plane", "point": [-0.025, 0.0, -RADIUS - 6e-4], "normal": [0.01, 0.0, 1.0]}, 1e-3),
    "post": (
        {"kind": "cylinder", "centre": [-0.02, 0.0, -RADIUS - 2e-3], "axis": [0.0, 1.0, 0.0], "radius": 1.9e-3},
        2e-3,
    ),
    "ball": ({"kind": "sphere", "centre": [-0.02, 3e-4, -RADIUS - 2e-3], "radius": 1.9e-3}, 2e-3),
    "tube": (
        {"kind": "cylinder", "centre": [0.0] * 3, "axis": [1.0, 0.0, -0.01], "radius": 8e-4, "inside": True},
        4e-4,
    ),
}


@pytest.mark.parametrize("name", OBSTACLES)
def test_pressed(name):
    """Certified; supports, contact forces along the normals and the load add up to nothing, and gaps are true."""
    system, steps = run(pressed(name))
    assert len(steps) == 4
    assert all(step.result.certificate.within(Tolerances()) for step in steps)
    (body,), (pair,) = system.bodies, system.pairs
    result = steps[-1].result
    lam = result.lam
    assert (lam >= 0).all()
    assert (lam > 0).any()
    n = result.linearisation.constraints[0].normals
    (H,) = result.linearisation.H.values()
    along = H.apply_transpose(lam).reshape(-1, 6)
    # Rows have the normals as their sums over the nodes' displacements.
    np.testing.assert_allclose(along[:, :3].sum(axis=0), lam @ n, atol=1e-12 * lam.sum())
    support = body.reactions() - np.where(body.fixed, along.ravel(), 0.0).reshape(-1, 6)
    load = np.array([0.3, -0.2, -0.4]) * 0.05
    total = support[:, :3].sum(axis=0) + lam @ n + load
    np.testing.assert_allclose(total, 0.0, atol=1e-7 * (np.abs(support[:, :3]).sum() + lam.sum()))
    p = pair.accepted
    moments = np.cross(p, lam[:, None] * n).sum(axis=0)
    moments += np.cross(body.x, support[:, :3]).sum(axis=0) + support[:, 3:].sum(axis=0)
    moments += _moment_of_the_load(body, np.array([0.3, -0.2, -0.4]))
    np.testing.assert_allclose(moments, 0.0, atol=1e-7 * 0.05 * (np.abs(support[:, :3]).sum() + lam.sum()))
    true = nearest(pair.surface, p).distance - RADIUS
    assert (np.abs(true[lam > 0]) <= 1e-6 * RADIUS).all()
    assert (true >= -1e-6 * RADIUS).all()
    np.testing.assert_allclose(result.gap[pair.candidates], true[pair.candidates], atol=1e-12)
    system.close()


def _moment_of_the_load(body, q):
    """About the origin, of a line load on the Hermite interpolation of the centreline."""
    middle = (body.x[:-1] + body.x[1:]) / 2
    t = body.R[:, :, 0]
    length = body.data.length[:, None]
    places = length * middle + length**2 / 12 * (t[:-1] - t[1:])
    return np.cross(places, q).sum(axis=0)


@pytest.mark.parametrize("name", ["post", "ball"])
def test_passes_converge_quadratically(name, monkeypatch):
    """On a wall that bulges towards the wire a pass about squares the residual, once the active set has settled."""
    passes, certify = [], contact.step.certify

    def watch(system, lin, lam, *rest):
        found = certify(system, lin, lam, *rest)
        passes.append((found.residual, np.flatnonzero(lam).tolist()))
        return found

    monkeypatch.setattr(contact.step, "certify", watch)
    run(pressed(name, time={"steps": 8}))[0].close()
    orders = [
        np.log(after) / np.log(before)
        for (before, one), (after, two) in pairwise(passes)
        if 1e-6 < before < 1e-2 and one == two
    ]
    assert len(orders) >= 4
    assert min(orders) > 1.4


@pytest.mark.parametrize("name", ["post", "ball"])
def test_forces_of_a_pass_do_not_depend_on_the_brace(name, monkeypatch):
    """A brace across a bulging wall holds what its contact holds anyway; its part of the force is not the contact's."""
    certify, passes = contact.step.certify, []
    monkeypatch.setattr(contact.step, "certify", lambda *given: passes[-1].append(given[2]) or certify(*given))
    for brace in (10.0, 100.0):
        monkeypatch.setattr(contact.devices.device_contact, "BRACE", brace)
        passes.append([])
        run(pressed(name, time={"steps": 1}))[0].close()
    assert len(passes[0]) == len(passes[1]) >= 4
    for one, other in zip(*passes, strict=True):
        np.testing.assert_allclose(other, one, rtol=1e-9)


def test_a_support_that_leads_into_a_wall_is_infeasible():
    """Nothing can keep a held end out: it is said at once, by name, and not taken for passes that do not settle."""
    surface, _ = OBSTACLES["plane"]
    supports = [{"at": "start"}, {"at": "end", "displacement": [0.0, 0.0, "-2e-3 * t"]}]
    scene = pressed("plane", body=[wire(supports=supports)], contact=[contact_table(surface)])
    with pytest.raises(InfeasibleError, match=r"a support puts a point of 'wall' into the wall at t = 0\.5") as told:
        run(scene)
    assert told.value.proven


def test_constraints_out_of_reach_stay_out_of_the_problem():
    """Those with force, violated ones, and those within four times the largest gap that these have to lose."""
    every = np.ones(6, dtype=bool)
    lin = Linearisation([], {}, {}, np.zeros(6), every, every, np.arange(6), None, Clock())
    gaps = np.array([0.01, -0.02, 0.0799, 0.0801, 0.5, -0.001])
    lin.narrow(gaps)
    np.testing.assert_array_equal(lin.rows, np.arange(6))
    lin.base = np.array([0.0, 0.0, 0.0, 0.0, 1e-3, 0.0])
    lin.narrow(np.minimum(gaps, 0.02))
    np.testing.assert_array_equal(lin.rows, np.arange(6))
    lin.base = np.array([1e-3, 0.0, 0.0, 0.0, 0.0, 0.0])
    lin.narrow(gaps)
    np.testing.assert_array_equal(lin.rows, [0, 1, 2, 5])


@pytest.mark.parametrize("method", ["gauss-seidel", "lemke", "kkt"])
def test_methods_agree(method):
    """The same forces by every contact method, to the tolerance of the step."""
    forces = []
    for name in ("status", method):
        system, steps = run(pressed("post", solver={"method": name}))
        n = steps[-1].result.linearisation.constraints[0].normals
        forces.append(steps[-1].result.lam @ n)
        system.close()
    np.testing.assert_allclose(forces[1], forces[0], atol=1e-6 * np.linalg.norm(forces[0]))


def test_two_ranks() -> None:
    """Forces, places and passes of a pushed wire are the same on one and on two ranks."""
    assert same_on_two_ranks(device_examples)["force"] > 0


def test_midpoint_is_refused():
    """A beam moves by implicit Euler."""
    tables = pushed(0.05, 0.1, 2)
    tables["time"]["integrator"] = "midpoint"
    with pytest.raises(ValueError, match=r"time\.integrator = 'midpoint': a beam moves by 'implicit-euler'"):
        run(tables)


def test_nothing_happens():
    """A wire at rest in a straight tube touches nothing: no force, certified, all residuals finite."""
    _, steps = run(pushed(0.0, 0.1, 2))
    assert [step.result.lam.sum() for step in steps] == [0.0, 0.0]
    assert all(step.result.certificate.within(Tolerances()) for step in steps)


def test_from_one_wall_to_the_opposite():
    """Carried across a straight vessel in a plane of its axis, where the wall left behind stays stationary."""
    R = 6e-4
    across = f"{R - RADIUS} * (1 - 2 * t)"
    ends = [
        {"at": "start", "displacement": [0, across, 0]},
        {"at": "end", "displacement": [0, across, 0], "hold": ["y"]},
    ]
    tube = {"kind": "vessels", "branches": [{"name": "tube", "points": [[x, 0.0, 0.0, R] for x in (-0.06, 0.0, 0.03)]}]}
    load = {"kind": "line", "value": [0.0, "1 - 2 * t", 0.0]}
    inside = []

    def watch(system, step):
        p = system.pairs[0].accepted
        inside.append((R - RADIUS - np.hypot(p[:, 1], p[:, 2]).max()) / RADIUS)

    system, _ = run(
        {"body": [wire(supports=ends, loads=[load])], "contact": [contact_table(tube)], "time": {"steps": 17}},
        watch=watch,
    )
    system.close()
    assert min(inside) >= -1e-3


def test_lost_feet_are_found_again(monkeypatch):
    """Forces do not depend on whether feet are followed, and every candidate has a foot."""
    forces = []
    for lost in (False, True):
        if lost:
            own = ConvolutionSurface.nearest
            none = (np.nan, np.nan, 0.0, 0.0)

            def lose(surface, x, guess=None, own=own, none=none):
                found = own(surface, x)
                return found if guess is None else Foot(*map(np.full_like, found, none))

            monkeypatch.setattr(ConvolutionSurface, "nearest", lose)
        detect = DeviceContact.detect

        def watch(pair, detect=detect):
            found = detect(pair)
            if found is not None:
                size = np.linalg.norm(found.normals[pair.candidates], axis=1)
                np.testing.assert_allclose(size, 1.0, rtol=1e-12)
            return found

        monkeypatch.setattr(DeviceContact, "detect", watch)
        system, steps = run(pushed(0.5, 0.06, 24))
        forces.append([step.result.lam for step in steps])
        system.close()
    assert np.max(forces) > 0
    np.testing.assert_allclose(forces[1], forces[0], rtol=0, atol=1e-9 * np.max(forces))


# --- speed ------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("diameters", [0.1, 1.0, 10.0, 100.0])
def test_inserted_at_any_speed(diameters):
    """A wire pushed by so many diameters a step stays in its vessel, certified, or the run says that it failed."""
    way = {0.1: 8e-3, 1.0: 20e-3, 10.0: 40e-3, 100.0: 50e-3}[diameters]
    count = round(way / (2 * RADIUS * diameters))
    tables = pushed(0.5, way / 0.5, count)
    first = -0.037 if diameters == 0.1 else -0.04  # where the wall is about to be met
    tables["body"][0]["placement"]["start"] = [first, 0.0, 0.0]
    seen = []

    def watch(system, step):
        (pair,) = system.pairs
        if step.converged:
            assert step.result.certificate.within(Tolerances())
            inside = nearest(pair.surface, pair.accepted).distance - RADIUS
            assert inside.min() >= -1e-3 * RADIUS
            seen.append((step.substeps, int((step.result.lam > 0).sum())))

    try:
        system, _ = run(tables, watch=watch)
        (body,) = system.bodies
        assert body.x[0, 0] == pytest.approx(first + way, rel=1e-9)
    except ContactNotConvergedError:
        assert diameters == 100.0
        return
    assert len(seen) == count
    assert max(active for _, active in seen) > 0


@pytest.mark.parametrize("diameters", [0.1, 1.0, 10.0, 100.0])
@pytest.mark.parametrize("kind", ["sphere", "cylinder"])
def test_thrown_at_an_obstacle_at_any_speed(kind, diameters):
    """A free wire that flies at something thinner than its way in one step never comes out behind it."""
    obstacle = {"kind": kind, "centre": [-0.025, 0.0, -2e-3], "radius": 1e-3}
    if kind == "cylinder":
        obstacle["axis"] = [0.0, 1.0, 0.0]
    speed, dt = 5.0, 2 * RADIUS * diameters / 5.0
    count = min(max(4, round(3e-3 / (speed * dt))), 60)
    tables = {
        "body": [wire(velocity=[0.0, 0.0, -speed], rayleigh=[0.0, 1e-4])],
        "contact": [contact_table(obstacle)],
        "time": {"end": count * dt, "steps": count, "integrator": "implicit-euler"},
    }
    above = []

    def watch(system, step):
        if not step.converged:
            return
        (pair,) = system.pairs
        over = np.argmin(np.abs(pair.places[:, 0] + 0.025))
        above.append(pair.accepted[over, 2])
        assert step.result.certificate.within(Tolerances())
        assert nearest(pair.surface, pair.accepted).distance.min() >= RADIUS * (1 - 1e-3)

    try:
        run(tables, watch=watch)
    except ContactNotConvergedError:
        assert diameters == 100.0
    else:
        assert above[-1] > -speed * count * dt + 1e-3  # it was stopped
    assert all(z > -2e-3 for z in above)


def test_a_step_far_too_large_is_divided():
    """One step of the scene over the whole bend: substeps, and the same place at the end as the scene asks for."""
    system, steps = run(pushed(0.05, 0.9, 1))
    assert len(steps) == 1
    assert steps[0].substeps > 1
    assert steps[0].result.certificate.within(Tolerances())
    (body,), (pair,) = system.bodies, system.pairs
    assert body.x[0, 0] == pytest.approx(-0.005, rel=1e-9)
    assert nearest(pair.surface, pair.accepted).distance.min() >= RADIUS * (1 - 1e-3)
    assert body.x[-1, 1] > 5e-3  # it followed the bend
    system.close()


def test_constraints_with_force_stay_in_the_problem(monkeypatch):
    """Whatever else the free motion meets: forces that it is with would be missing from the problem otherwise."""
    problem, missing, met_more = contact.system.System.problem, [], []

    def watched(system, lin, *given):
        if lin.base is not None:
            inside = np.isin(np.arange(len(lin.offset)), lin.rows)
            missing.append(int(((lin.base > 0) & lin.met & ~inside).sum()))
            met_more.append(bool(system.pairs[0]._meeting.any() and (lin.base > 0).any()))
        return problem(system, lin, *given)

    monkeypatch.setattr(contact.system.System, "problem", watched)
    monkeypatch.setattr(DeviceContact, "close", 0.0)  # what a prediction lifts off is not near
    run(pushed(0.5, 0.1, 25))[0].close()
    assert any(met_more)
    assert not any(missing)
