"""Contact points: areas, means, rows of H, and the uniform pressure that they must transmit exactly."""

import numpy as np
import pytest
from contact_examples import box, on_floor, solid
from mpi4py import MPI

from contact.pairs import FiniteSliding, SmallSliding
from contact.points import mortar, nodal
from contact.step import step
from contact.surfaces.implicit import Plane, Sphere, paraboloid
from fem.body import Body
from fem.elasticity import State
from fem.integrators import Static
from fem.loads import Load
from fem.scalar import Laplacian
from fem.space import Space
from meshes.generators import generate

CHOICES = [
    ("plane-strain", 1, nodal),
    ("plane-strain", 2, nodal),
    ("plane-strain", 1, mortar),
    ("plane-strain", 2, mortar),
    ("axisymmetric", 1, nodal),
    ("axisymmetric", 2, nodal),
    ("axisymmetric", 1, mortar),
    ("axisymmetric", 2, mortar),
    ("3d", 1, nodal),
    ("3d", 1, mortar),
    ("3d", 2, mortar),
]
choices = pytest.mark.parametrize(("state", "order", "constraint"), CHOICES)


def _dim(state: State) -> int:
    return 3 if state == "3d" else 2


@choices
def test_areas_and_means(state: State, order: int, constraint: type) -> None:
    """Σ_i ∫ψ_i = area of the side (π for a disc), a mean of a constant is that constant, places are the nodes'."""
    body = solid(box(_dim(state), order), state)
    points = constraint(body, "bottom")
    assert points.areas.sum() == pytest.approx(np.pi if state == "axisymmetric" else 1.0, rel=1e-12)
    np.testing.assert_allclose(points.mean(np.full(len(points.nodes), 3.0)), 3.0, rtol=1e-13)
    np.testing.assert_allclose(points.positions()[:, -1], 0, atol=1e-15)
    nodes = np.unique(body.facets("bottom")[:, : None if constraint is nodal else _dim(state)])
    assert points.count == len(nodes)
    expected = body.points[nodes]
    np.testing.assert_allclose(points.places[np.lexsort(points.places.T)], expected[np.lexsort(expected.T)])


@pytest.mark.parametrize(("state", "order"), [("plane-strain", 2), ("axisymmetric", 1), ("3d", 2)])
def test_mortar_weights_are_a_partition_of_unity(state: State, order: int) -> None:
    """Σ_i a_i T_qi = w_q, so that Σ_i a_i δ_i = ∫ g ds for every gap: here g = x² over 0 < x < 1."""
    body = solid(box(_dim(state), order), state)
    points = mortar(body, "bottom")
    x = points.positions()[:, 0]
    # ∫ x² dx, or ∫ r² 2πr dr
    assert points.areas @ points.mean(x**2) == pytest.approx(np.pi / 2 if state == "axisymmetric" else 1 / 3, rel=1e-12)
    by_constraint = points.mean(x)
    # ψ_i is symmetric about an inner node of equal facets only; the means still lie within its support
    assert np.all((by_constraint > 0) & (by_constraint < 1))


@choices
def test_forces_of_a_uniform_pressure(state: State, order: int, constraint: type) -> None:
    """Hᵀλ with λ_i = p a_i are the consistent nodal forces of the pressure p."""
    body = solid(box(_dim(state), order), state, loads=(Load("pressure", 1.7, "bottom"),))
    points = constraint(body, "bottom")
    normals = np.tile(np.eye(_dim(state))[-1], (len(points.nodes), 1))
    body.begin(0.0, Static())
    np.testing.assert_allclose(points.matrix(normals).T @ (1.7 * points.areas), body.load, atol=1e-14)


@choices
def test_rows_are_the_derivatives_of_gaps(state: State, order: int, constraint: type) -> None:
    """On a plane δ(u) − δ(0) = H u; on curved surfaces H is the derivative of the true gaps."""
    D = _dim(state)
    body = solid(box(D, order), state)
    rng = np.random.default_rng(0)
    normal = rng.uniform(0.5, 1, D)
    below = -2.0 * normal
    u = rng.uniform(-1, 1, body.space.owned)

    points = constraint(body, "bottom")
    pair = SmallSliding("floor", points, Plane(below, normal))
    body.u = body.space.local(np.zeros_like(u))
    before = pair.gaps()
    constraints = pair.detect()
    np.testing.assert_allclose(constraints.offset, before, atol=1e-14)
    body.u = body.space.local(u)
    np.testing.assert_allclose(pair.gaps() - before, constraints.H[body].apply(u), atol=1e-13)
    assert pair.detect() is None

    for surface in (Sphere(below, 0.7), paraboloid(below, 1.5)):
        finite = FiniteSliding("obstacle", points, surface)
        body.u = body.space.local(0.1 * u)
        at = finite.detect()
        eps = 1e-6
        changes = []
        for sign in (1, -1):
            body.u = body.space.local((0.1 + sign * eps) * u)
            changes.append(finite.gaps())
        np.testing.assert_allclose((changes[0] - changes[1]) / (2 * eps), at.H[body].apply(u), atol=1e-7)


@choices
def test_uniform_pressure_is_transmitted(state: State, order: int, constraint: type) -> None:
    """A block on a frictionless floor, pressed by p, free sides: λ = p a and u = the uniform strain, to round-off."""
    D, p, E, nu = _dim(state), 0.05, 2.0, 0.3
    sides = [{"tag": "left", "component": "r" if state == "axisymmetric" else "x"}]
    sides += [{"tag": "front", "component": "y"}] if D == 3 else []
    system = on_floor(
        box(D, order),
        state,
        [{"kind": "pressure", "tag": "top", "value": p}],
        sides,
        constraint=constraint.__name__,
    )
    result = step(system, 1.0)
    areas = result.linearisation.constraints[0].areas
    np.testing.assert_allclose(result.lam, p * areas, atol=1e-10 * p * areas.max())
    body = system.bodies[0]
    down, aside = (-(1 - nu**2), nu * (1 + nu)) if state == "plane-strain" else (-1.0, nu)
    exact = p / E * body.points * np.array([*[aside] * (D - 1), down])
    np.testing.assert_allclose(body.displacement, exact, atol=1e-12)
    assert result.certificate.complementarity < 1e-10
    assert result.certificate.equilibrium < 1e-10
    system.close()


@pytest.mark.parametrize(("dim", "order"), [(1, 1), (1, 2), (2, 1), (2, 2)])
def test_bodies_that_touch_with_their_cells(dim: int, order: int) -> None:
    """Mortar constraints of strings and membranes: areas, means of x², and the forces of a uniform load."""
    mesh = generate("interval", length=1.0, n=4, order=order) if dim == 1 else box(2, order)
    frame = np.eye(dim + 1)[-1:]
    space = Space(MPI.COMM_SELF, mesh, 1)
    body = Body("flat", space, Laplacian(1.0), loads=[Load("body", 1.7)], frame=frame)
    points = mortar(body, "surface")
    assert points.count == len(np.unique(mesh.cells[:, : dim + 1]))
    assert points.areas.sum() == pytest.approx(1.0, rel=1e-12)
    assert points.areas @ points.mean(points.positions()[:, 0] ** 2) == pytest.approx(1 / 3, rel=1e-12)
    body.begin(0.0, Static())
    H = points.matrix(np.repeat(frame, len(points.nodes), axis=0))
    np.testing.assert_allclose(H.T @ (1.7 * points.areas), body.load, atol=1e-14)


def test_second_order_triangles_take_no_nodal_constraints() -> None:
    """Their corner nodes carry no force under a uniform pressure, and the message names what does."""
    with pytest.raises(ValueError, match="nodal constraints need first-order triangles; use mortar"):
        nodal(solid(box(3, 2, n=1), "3d"), "bottom")
