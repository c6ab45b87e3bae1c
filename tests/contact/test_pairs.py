"""Pairs: initial interference, gaps by normals and by distances, and two bodies' points."""

import numpy as np
import pytest
from contact_examples import box, solid
from mpi4py import MPI

from contact.pairs import FiniteSliding, PointToPoint, SmallSliding, signed_distance
from contact.points import mortar, nodal
from contact.surfaces.implicit import Cylinder, Plane, Sphere, paraboloid
from fem.body import Body
from fem.loads import Support
from fem.scalar import Laplacian
from fem.space import Space
from meshes.generators import generate

UP = np.array([0.0, 1.0])


def test_distances_along_a_direction() -> None:
    """With a direction the gap is measured along it: y + x²/2R; without, to the closest point, which is nearer."""
    body = solid(box(2, n=5), "plane-strain")
    points = nodal(body, "bottom")
    below = paraboloid(np.array([0.0, -0.3]), 0.5)
    along, closest = SmallSliding("a", points, below, 5 * UP), SmallSliding("c", points, below)
    x = points.places[:, 0]
    np.testing.assert_allclose(along.gaps(), 0.3 + x**2, atol=1e-14)
    np.testing.assert_allclose(closest.gaps(), signed_distance(below, points.places), atol=1e-14)
    assert np.all(closest.gaps()[1:] < along.gaps()[1:] - 1e-3 * x[1:])


def test_undeclared_interference_is_refused() -> None:
    """A point that starts inside is named with its depth, unless that depth is declared."""
    body = solid(box(2), "plane-strain")
    points = nodal(body, "bottom")
    inside = Plane(0.25 * UP, UP)
    for make in (SmallSliding, FiniteSliding):
        with pytest.raises(
            ValueError, match=r"contact 'lid': a point starts 0\.25 m inside the surface, .* = 0 allows"
        ):
            make("lid", points, inside).start()
        with pytest.raises(ValueError, match=r"interference = 0\.24 allows"):
            make("lid", points, inside, interference=0.24).start()
        make("lid", points, inside, interference=0.25).start()
        make("lid", points, Plane(0 * UP, UP)).start()


def test_interference_of_a_mortar_mean() -> None:
    """A curved surface that touches in a line of zero width is no interference of the means."""
    points = mortar(solid(box(2, 2, n=4), "plane-strain"), "bottom")
    pair = SmallSliding("roll", points, paraboloid(np.zeros(2), 1.0), UP)
    pair.start()
    assert pair.gaps().min() > 0


def test_two_points() -> None:
    """δ = n·(x₁ − x₂): the gap between two bars' ends, and its derivatives +1 and −1."""
    bars = [
        Body(
            name,
            Space(MPI.COMM_SELF, generate("interval", length=1.0, n=2, origin=origin), 1),
            Laplacian(1.0),
            [Support(tag)],
        )
        for name, origin, tag in [("right", 1.5, "end"), ("left", 0.0, "start")]
    ]
    pair = PointToPoint("gap", nodal(bars[0], "start"), nodal(bars[1], "end"), np.array([2.0]))
    pair.start()
    found = pair.detect()
    assert found is not None
    assert found.offset == pytest.approx([0.5])
    assert [h.sparse().toarray().sum() for h in found.H.values()] == [1.0, -1.0]
    bars[0].u[:] = -0.2
    bars[1].u[:] = 0.1
    assert pair.gaps() == pytest.approx([0.2])
    assert pair.detect() is None
    with pytest.raises(ValueError, match=r"contact 'deep': a point starts 0\.5 m inside"):
        PointToPoint("deep", nodal(bars[0], "start"), nodal(bars[1], "end"), np.array([-1.0])).start()
    with pytest.raises(ValueError, match="takes one point of each"):
        PointToPoint("side", nodal(solid(box(2), "plane-strain"), "top"), nodal(bars[1], "end"), np.array([1.0]))


def test_finite_sliding_meets_only_what_moves_in() -> None:
    """Constraints that no motion has met have no offset; those met have their plane where the motion first meets it."""
    body = solid(box(2, n=4), "plane-strain")
    points = nodal(body, "bottom")
    ball = Sphere(np.array([0.0, -1.0]), 0.9)
    # A support, so that the body does not float: a floating one has all its contacts in reach.
    body.modes = body.modes[:, :0]
    pair = FiniteSliding("ball", points, ball)
    pair.start()
    assert np.all(np.isinf(pair.detect().offset))
    body.u = np.tile([0.0, -0.2], len(body.u) // 2)
    found = pair.detect()
    x = points.places[:, 0]
    met = np.hypot(x, 1 - 0.2) < 0.9
    assert 0 < met.sum() < len(x)
    np.testing.assert_array_equal(np.isfinite(found.offset), met)
    # the vertical motion of a point at x meets the circle at y = −1 + √(.81 − x²)
    foot = np.stack([x[met], -1 + np.sqrt(0.81 - x[met] ** 2)], axis=1)
    normals = (foot - [0, -1]) / 0.9
    np.testing.assert_allclose(found.normals[met], normals, atol=1e-12)
    np.testing.assert_allclose(found.offset[met], ((points.places[met] - foot) * normals).sum(axis=1), atol=1e-12)
    # once met, a constraint follows its closest point
    again = pair.detect()
    place = points.places - 0.2 * UP
    np.testing.assert_allclose(again.normals[met], ((place + UP) / np.hypot(*(place + UP).T)[:, None])[met], atol=1e-12)


def test_points_on_the_axis_of_a_tube() -> None:
    """A body whose points start on the axis of its tube has finite constraints there."""
    points = nodal(solid(box(3, n=2), "3d"), "bottom")
    tube = Cylinder(np.zeros(3), np.array([1.0, 0.0, 0.0]), 2.0, inside=True)
    pair = FiniteSliding("tube", points, tube)
    pair.start()
    on_axis = np.abs(points.places[:, 1]) < 1e-12
    assert on_axis.any()
    np.testing.assert_allclose(pair.gaps()[on_axis], 2.0)
    found = pair.detect()
    assert all(np.isfinite(h.sparse().data).all() for h in found.H.values())
