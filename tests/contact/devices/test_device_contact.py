"""Points along a beam against surfaces: gaps, rows, first walls, and what may be left out."""

from __future__ import annotations

import numpy as np
import pytest
from device_examples import TUBE

from contact.devices.device_contact import MARGIN, DeviceContact
from contact.surfaces.convolution import ConvolutionSurface
from contact.surfaces.detection import nearest
from contact.surfaces.implicit import Cylinder, Plane, Potential, Sphere, Torus
from fem.beams import frame_kernels
from fem.beams.beam import Beam
from fem.beams.beam_element import beam_data
from fem.beams.beam_parts import Drive
from fem.beams.beam_sections import Section
from fem.integrators import Static
from fem.rotations import exp
from meshes.centrelines import arc, helix, join, straight
from meshes.vessels import tree_of

R = 2.5e-4
Z = np.array([0.0, 0.0, 1.0])


def device(line, surface, samples=2, interference=0.0, sections=None):
    """A clamped wire and its points of contact."""
    profiles = sections or [Section(20e9, R, nu=0.3)]
    data = beam_data(line, profiles)
    radius = np.array([p.outer_radius for p in profiles])[line.section]
    body = Beam("wire", line.points, line.frames, data, radius, [Drive(0)])
    places = np.linspace(0.0, data.length.sum(), samples * len(data.length) + 1)
    return body, DeviceContact("wall", body, surface, places, interference)


def vessel(spacing=2e-3):
    """The inside of a tube with a bend."""
    segments, chains = tree_of([("tube", np.array(TUBE))], spacing).segments()
    return ConvolutionSurface(segments, chains)


def put(body, shift=(0.0, 0.0, 0.0), turn=(0.0, 0.0, 0.0)):
    """Move a beam rigidly from its start."""
    Q = exp(np.asarray(turn, dtype=float))
    x, edges = body.start @ Q.T + shift, np.diff(body.start, axis=0) @ Q.T
    body.restore((x, Q @ body.start_frames, edges, body.v, body.w))


def looked(pair):
    """What a step's first pass detects."""
    pair.begin()
    pair.moved()
    return pair.detect()


def torus_distance(x, bend, radius):
    """Inside a torus about z: a − |(ρ − b, z)|."""
    return radius - np.hypot(np.hypot(x[:, 0], x[:, 1]) - bend, x[:, 2])


SURFACES = {
    "plane": (Plane(np.array([0.0, 0.0, -6e-4]), Z), lambda x: x[:, 2] + 6e-4),
    "cylinder": (
        Cylinder(np.zeros(3), np.array([1.0, 0.0, 0.0]), 1e-3, True),
        lambda x: 1e-3 - np.hypot(x[:, 1], x[:, 2]),
    ),
    "sphere": (
        Sphere(np.array([0.02, 0.0, -3e-3]), 2e-3),
        lambda x: np.linalg.norm(x - [0.02, 0, -3e-3], axis=1) - 2e-3,
    ),
    "torus": (Torus(np.zeros(3), Z, 0.02, 1e-3, True), lambda x: torus_distance(x, 0.02, 1e-3)),
}


def example(name):
    """A surface, its distance, and a wire that comes near it."""
    surface, distance = SURFACES[name]
    if name == "torus":
        line = arc(0.05, 20, 0.02).placed([0.0, -0.02, 2e-4], [1.0, 0.02, 0.01])
    elif name == "cylinder":
        line = helix(0.05, 20, 5e-4, 0.02).placed([0.0, -5e-4, 0.0], [1.0, 0.0, 0.15])
    else:
        line = arc(0.05, 20, 0.2).placed([0.0, 0.0, 0.0], [1.0, 0.0, 0.02])
    body, pair = device(line, surface)
    return body, pair, distance


@pytest.mark.parametrize("name", SURFACES)
def test_gaps(name):
    """Every point nearer than half a radius is a candidate with its true gap; the others' is not below what is said."""
    body, pair, distance = example(name)
    rng = np.random.default_rng(0)
    for _ in range(30):
        put(body, 1e-3 * rng.normal(size=3), 0.02 * rng.normal(size=3))
        found = looked(pair)
        p = pair._points(body.x, body.R)
        true = distance(p) - R
        near = true <= MARGIN * R
        assert pair.candidates[near].all()
        np.testing.assert_allclose(pair.gaps()[pair.candidates], true[pair.candidates], atol=1e-15)
        assert (pair.gaps() <= true + 1e-15).all()
        np.testing.assert_allclose(found.offset[pair.candidates], true[pair.candidates], atol=1e-15)
        assert np.isinf(found.offset[~pair.candidates]).all()
    assert found.count == 41
    assert found.length == R


def test_points_lie_on_the_centreline():
    """At the places asked for, ends and joints included, on an arc to fourth order; each has its section's radius."""
    line = join([straight(0.01, 4), arc(0.02, 10, 0.01)])
    sections = [Section(20e9, R, nu=0.3), Section(20e9, 2 * R, nu=0.3)]
    body, pair = device(line, SURFACES["plane"][0], 3, 1.0, sections)
    exact = join([straight(0.01, 14), arc(0.02, 28, 0.01)])
    s = exact.arc
    assert np.linalg.norm(pair.places - exact.points, axis=1).max() < 1.05 * 0.002**4 / 0.01**3 / 384
    np.testing.assert_array_equal(pair.places[[0, -1]], body.x[[0, -1]])
    np.testing.assert_array_equal(pair.radius, np.where(s < 0.01 - 1e-12, R, 2 * R))


@pytest.mark.parametrize("name", SURFACES)
def test_rows_are_the_derivative_of_gaps(name):
    """H d = dδ for increments d of nodes and frames, on a deformed wire; and δ from its own planes fits the surface."""
    body, pair, distance = example(name)
    rng = np.random.default_rng(1)
    d = rng.normal(size=(21, 6)) * [[1e-4] * 3 + [0.02] * 3]
    found = None
    for lift in np.linspace(0.0, 2e-3, 9):
        put(body, [0.0, 0.0, -lift])
        found = looked(pair)
        if pair.candidates.sum() > 2:
            break
    assert pair.candidates.sum() > 2
    base = body.x, body.R, body.edges

    def gaps(h):
        x, frames, _ = frame_kernels.update(*base, h * d)
        return distance(pair._points(x, frames)) - R

    h = 1e-3
    coarse, fine = ((gaps(s) - gaps(-s)) / (2 * s) for s in (h, h / 2))
    rate = (4 * fine - coarse) / 3
    (H,) = found.H.values()
    on = pair.candidates
    np.testing.assert_allclose(H.apply(d.ravel())[on], rate[on], atol=1e-8 * np.abs(rate).max())
    assert not H.apply(d.ravel())[~on].any()
    np.testing.assert_allclose(np.linalg.norm(found.normals, axis=1), 1.0, rtol=1e-14)


def test_curvature():
    """What forces λ add to A is −Σ λ ∇²δ: the symmetric part of the derivative of −Hᵀλ."""
    body, pair, _ = example("torus")
    looked(pair)
    rng = np.random.default_rng(2)
    lam = np.where(pair.candidates, rng.uniform(0.5, 1.0, pair.count), 0.0)
    assert (lam > 0).sum() > 3
    base = body.state()

    def pull(d):
        x, frames, edges = frame_kernels.update(*base[:3], d.reshape(-1, 6))
        body.restore((x, frames, edges, *base[3:]))
        kept = pair.candidates.copy()
        found = looked(pair)
        assert (pair.candidates >= kept).all()
        (H,) = found.H.values()
        return H.apply_transpose(lam)

    n = body.space.size
    scale = np.tile([1e-6] * 3 + [1e-3] * 3, n // 6)
    exact = np.zeros((n, n))
    for i in range(n):
        d = np.zeros(n)
        d[i] = scale[i]
        exact[:, i] = (pull(d) - pull(-d)) / (2 * scale[i])
    exact = -(exact + exact.T) / 2
    body.restore(base)
    every = np.arange(n, dtype=np.int32)
    plain = assembled(body, every)
    looked(pair)
    pair.stiffen(lam)
    added = assembled(body, every) - plain
    free = ~body.fixed
    unit = np.tile([1.0] * 3 + [1e3] * 3, n // 6)[free]
    added, exact = (unit[:, None] * M[np.ix_(free, free)] * unit for M in (added, exact))
    np.testing.assert_allclose(added, exact, atol=1e-5 * np.abs(exact).max())


def assembled(body, every):
    """A of a beam, formed anew."""
    body.begin(0.0, Static())
    body.renew()
    body.assemble()
    return body.A.getValues(every, every)


@pytest.mark.parametrize("name", ["cylinder", "torus", "vessel"])
def test_what_is_skipped_cannot_touch(name, monkeypatch):
    """Along a random walk every point that truly is within half a radius has its gap; not all were looked at."""
    if name == "vessel":
        surface, line = vessel(), straight(0.04, 20).placed([-0.05, 0.0, 0.0], [1.0, 0.0, 0.0])
        distance = lambda x: nearest(surface, x).distance  # noqa: E731
    else:
        surface, distance = SURFACES[name]
        line = straight(0.05, 20) if name == "cylinder" else arc(0.05, 20, 0.02).placed([0, -0.02, 0], [1.0, 0.0, 0.0])
    body, pair = device(line, surface)
    asked = 0
    find = DeviceContact._find

    def counted(self, rows, *others):
        nonlocal asked
        asked += len(rows)
        return find(self, rows, *others)

    monkeypatch.setattr(DeviceContact, "_find", counted)
    rng, total, close = np.random.default_rng(3), 0, 0
    shift, turn = np.zeros(3), np.zeros(3)
    for step in range(120):
        jump = 20.0 if step % 30 == 29 else 1.0  # now and then many diameters at once
        shift = 0.8 * shift + jump * 4e-5 * rng.normal(size=3) * [5.0, 1.0, 1.0]
        turn = 0.8 * turn + jump * 1e-3 * rng.normal(size=3) * [2.0, 0.5, 0.5]
        put(body, shift, turn)
        looked(pair)
        true = distance(pair._points(body.x, body.R)) - R
        near = true <= MARGIN * R
        assert pair.candidates[near].all(), step
        np.testing.assert_allclose(pair.gaps()[near], true[near], atol=1e-9 * R, rtol=1e-7)
        assert (pair.gaps() <= true + 1e-9 * R + 1e-7 * np.abs(true)).all(), step
        total, close = total + len(true), close + near.sum()
        pair.accept()
    assert 0.02 * total < close < 0.5 * total
    assert asked < 0.9 * total


# --- motion -----------------------------------------------------------------------------------------------------------


def free(body, increment):
    """Give the beam a free motion that shifts all nodes alike."""
    body.u = np.tile(np.append(increment, np.zeros(3)), len(body.x))


def test_the_free_motion_makes_candidates():
    """A point that the motion carries through a ball takes the plane where it enters, not that of the far side."""
    ball = Sphere(np.array([0.01, 0.0, 0.0]), 2e-3)
    body, pair = device(straight(0.02, 10).placed([0.0, 0.0, 0.01], [1.0, 0.0, 0.0]), ball, 1)
    assert looked(pair) is not None
    assert not pair.candidates.any()
    free(body, [0.0, 0.0, -0.0125])  # past the centre
    found = pair.detect()
    assert found is not None
    middle = 5
    assert pair.candidates[middle]
    np.testing.assert_allclose(found.normals[middle], Z, atol=1e-6)
    assert found.offset[middle] == pytest.approx(0.01 - 2e-3 - R, rel=1e-6)
    (H,) = found.H.values()
    delta = H.apply(body.u) + found.offset
    assert delta[middle] == pytest.approx(-0.0045 - R, rel=1e-6)
    assert pair.detect() is None  # nothing new


def test_a_motion_that_meets_nothing_costs_nothing():
    """Points that stay further off than their motion are not looked at."""
    body, pair = device(straight(0.02, 10), Plane(np.array([0.0, 0.0, -5e-3]), Z))
    looked(pair)
    assert not pair.candidates.any()
    free(body, [0.0, 0.0, -4e-3])
    assert pair.detect() is None
    free(body, [0.0, 0.0, -5e-3])
    assert pair.detect() is not None
    assert pair.candidates.all()


def test_far_outside_the_first_wall_counts():
    """Moved nearly through a ball, a point is brought back to the side that its way met first."""
    ball = Sphere(np.array([0.01, 0.0, 0.0]), 2e-3)
    body, pair = device(straight(0.02, 10).placed([0.0, 0.0, 3e-3], [1.0, 0.0, 0.0]), ball, 1)
    looked(pair)
    pair.accept()
    put(body, [0.0, 0.0, -4e-3])  # 1 mm below the centre: the closest wall is the far one
    pair.moved()
    found = pair.detect()
    assert pair.candidates[5]
    np.testing.assert_allclose(found.normals[5], Z, atol=1e-6)
    assert found.offset[5] == pytest.approx(-3e-3 - R, rel=1e-6)
    put(body, [0.0, 0.0, -1.2e-3])  # 0.2 mm inside: the closest point is good enough
    pair.moved()
    found = pair.detect()
    np.testing.assert_allclose(found.normals[5], Z, atol=1e-6)
    assert found.offset[5] == pytest.approx(-2e-4 - R, rel=1e-9)


def test_crossed_against_brute_force():
    """Whether the straight ways of the points go through the wall: random jumps about a post, compared with samples."""
    post = Cylinder(np.array([0.01, 0.0, 0.0]), np.array([0.0, 1.0, 0.0]), 1e-3)
    body, pair = device(straight(0.02, 10).placed([0.0, 0.0, 4e-3], [1.0, 0.0, 0.0]), post)
    rng, verdicts = np.random.default_rng(4), []
    s = np.linspace(0.0, 1.0, 501)[:, None, None]
    for _ in range(200):
        ends = []
        for _ in range(2):
            ends.append(
                ([*(6e-3 * rng.uniform(-1, 1, 2)), rng.uniform(-10e-3, 2e-3)], [0.0, rng.uniform(-0.3, 0.3), 0.0])
            )
        put(body, *ends[0])
        looked(pair)
        pair.accept()
        put(body, *ends[1])
        looked(pair)
        way = pair.accepted + s * (pair._points(body.x, body.R) - pair.accepted)
        deepest = post.potential(way.reshape(-1, 3)).min()
        if abs(deepest) < 1e-5 or post.potential(pair.accepted).min() <= 0:
            continue  # too near to grazing for the samples, or in the post from the start
        verdicts.append((pair.crossed(), bool(deepest < 0)))
    found, exact = np.array(verdicts).T
    np.testing.assert_array_equal(found, exact)
    assert 30 < exact.sum() < len(exact) - 30


def test_no_way_at_all_crosses_nothing():
    _, pair = device(straight(0.02, 10), Plane(np.array([0.0, 0.0, -5e-3]), Z))
    looked(pair)
    assert not pair.crossed()


# --- interference -----------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("depth", [0.0, 1e-5])
def test_interference(depth):
    """A wire that starts deeper than declared is refused; touching, or declared, it is a candidate at once."""
    floor = Plane(np.array([0.0, 0.0, -R + depth]), Z)
    line = straight(0.02, 10)
    _, pair = device(line, floor, interference=depth)
    pair.start()
    looked(pair)
    assert pair.candidates.all()
    np.testing.assert_allclose(pair.gaps(), -depth, atol=1e-18)
    if depth:
        _, pair = device(line, floor, interference=0.5 * depth)
        with pytest.raises(ValueError, match=r"'wall': a point starts 1e-05 m inside .* interference = 5e-06"):
            pair.start()


def test_a_surface_without_a_distance():
    """A potential that is not a distance: gaps are those of its closest points, and its bound only keeps points out."""
    bowl = Potential(lambda x: 4 * (x[:, 2] + 1e-3), lambda x: np.tile([0.0, 0.0, 4.0], (len(x), 1)), 5.0)
    body, pair = device(straight(0.02, 10), bowl)
    looked(pair)
    assert not pair.candidates.any()
    assert (pair.gaps() <= 1e-3 - R).all()
    put(body, [0.0, 0.0, -7e-4])
    looked(pair)
    assert pair.candidates.all()
    np.testing.assert_allclose(pair.gaps(), 3e-4 - R, rtol=1e-9)
