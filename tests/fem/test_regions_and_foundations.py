"""Materials by region and elastic surroundings, against a tube of two layers, a plate on springs and rigid motions."""

from collections.abc import Sequence

import numpy as np
import pytest
from fem_examples import SIDES, block, hooke, solved
from mpi4py import MPI

from fem.body import Body
from fem.elasticity import Elasticity
from fem.foundation import Foundation
from fem.loads import Load, Support
from fem.regions import Regions
from fem.space import Space
from meshes.generators import generate
from meshes.mesh import Mesh
from validation.exact.layered_tube import LayeredTube

WALL = LayeredTube(E1=4.0, nu1=0.3, E2=1.5, nu2=0.45, a=1.0, b=1.2, c=1.5, k=0.8)


def layered(mesh: Mesh, supports: Sequence[Support | Foundation], loads: Sequence[Load], mixed: bool = False) -> Body:
    """The two-layer tube's materials on the regions `media` and `adventitia`."""
    space = Space(MPI.COMM_SELF, mesh, mesh.dim, mixed, ("media", "adventitia"))
    state = "3d" if mesh.dim == 3 else "plane-strain"
    laws = {
        "media": Elasticity(WALL.E1, WALL.nu1, state, mixed),
        "adventitia": Elasticity(WALL.E2, WALL.nu2, state, mixed),
    }
    parts = Regions([(law, space.piece.regions[name]) for name, law in laws.items()])
    return Body("wall", space, parts, supports, loads)


def quarter(n: int, order: int) -> Mesh:
    """A quarter of the tube's section on a mapped grid, with an interface at r = b."""
    grid = generate("box", size=[1.0, 1.0], n=[2 * n, 4 * n], order=order, structured=True)
    rho = np.interp(grid.points[:, 0], [0, 0.5, 1], [WALL.a, WALL.b, WALL.c])
    theta = np.pi / 2 * grid.points[:, 1]
    points = np.stack([rho * np.cos(theta), rho * np.sin(theta)], axis=1)
    inside = grid.points[grid.cells[:, :3]].mean(axis=1)[:, 0] < 0.5
    regions = {"media": np.flatnonzero(inside), "adventitia": np.flatnonzero(~inside)}
    return Mesh(points, grid.cells, grid.facets, regions)


@pytest.mark.parametrize(("order", "mixed"), [(1, False), (2, False), (2, True)])
def test_a_tube_of_two_layers_in_its_surrounding(order: int, mixed: bool) -> None:
    """Pressure inside, springs along the normal outside: the largest error at a node falls as h², h³ with order 2.

    One pressure for both layers would lose two orders of the mixed form.
    """
    errors = []
    for n in (4, 8):
        supports = [Support("bottom", 1), Support("top", 0), Foundation("right", WALL.k, "normal")]
        with solved(layered(quarter(n, order), supports, [Load("pressure", 0.3, "left")], mixed)) as body:
            exact = WALL.displacement(body.space.piece.points, 0.3)
            errors.append(np.abs(body.displacement - exact).max() / np.abs(exact).max())
            assert body.imbalance(np.zeros(body.space.owned)) < 1e-12
    assert np.log2(errors[0] / errors[1]) == pytest.approx(order + 1, abs=0.25)
    assert errors[1] < (5e-3, 5e-6)[order - 1]


def test_a_vessel_wall_in_three_dimensions() -> None:
    """The same in space, on a wall's own regions and tags; it is held by its surrounding and its ends' planes only."""
    mesh = generate("tube-wall", radius=WALL.a, thickness=0.5, length=0.5, h=0.4, media=0.4, layers=4)
    supports = [Support("inlet", 2), Support("outlet", 2), Foundation("outer", WALL.k)]
    with solved(layered(mesh, supports, [Load("pressure", 0.3, "lumen")])) as body:
        assert body.modes.shape[1] == 0
        X = body.space.piece.points
        exact = np.column_stack([WALL.displacement(X[:, :2], 0.3), np.zeros(len(X))])
        assert np.abs(body.displacement - exact).max() < 1e-3 * np.abs(exact).max()
        _, volume = body.model.stress(X, body.space.piece.cells, body.u[body.space.cell_dofs])  # type: ignore[attr-defined]
        # ∫ ½ σ:ε = ½ ∫ p u ds + ½ ∫ (−k u) u ds: the springs' energy is in the body's.
        work = 0.3 * WALL.radial(WALL.a, 0.3) * 2 * np.pi * WALL.a * 0.5 / 2
        assert body.energy()["strain"] == pytest.approx(float(work), rel=1e-3)
        assert volume.sum() == pytest.approx(np.pi * 1.25 * 0.5, rel=1e-3)


def test_regions_of_one_material_are_that_material() -> None:
    """The same element matrices, forces and stresses as those of the homogeneous body."""
    mesh = block(2, 2, bend=0.05)
    law = Elasticity(2.0, 0.3, "plane-strain")
    rows = np.random.default_rng(5).permutation(len(mesh.cells))
    split = Regions([(law, np.sort(rows[:5])), (law, np.sort(rows[5:]))])
    space = Space(MPI.COMM_SELF, mesh, 2)
    X, cells = space.piece.points, space.piece.cells
    u = np.random.default_rng(1).uniform(-1, 1, (len(cells), space.cell_dofs.shape[1]))
    np.testing.assert_array_equal(split.stiffness(X, cells), law.stiffness(X, cells))
    np.testing.assert_allclose(split.forces(X, cells, u), law.forces(X, cells, u), rtol=1e-13, atol=1e-13)
    for found, expected in zip(split.stress(X, cells, u), law.stress(X, cells, u), strict=True):
        np.testing.assert_allclose(found, expected, rtol=1e-13, atol=1e-13)


@pytest.mark.parametrize(("dim", "order"), [(2, 1), (2, 2), (3, 1), (3, 2)])
@pytest.mark.parametrize("component", [None, "normal", 0])
def test_a_block_pressed_on_springs(dim: int, order: int, component: int | str | None) -> None:
    """Pulled along x by p on its right, with springs on its left: u = p/k + p x/E in plane stress, exactly."""
    E, k, p = 2.0, 5.0, 0.1
    nu = 0.0 if dim == 3 else 0.3
    space = Space(MPI.COMM_SELF, block(dim, order, bend=0.05), dim)
    law = Elasticity(E, nu, "3d" if dim == 3 else "plane-stress")
    # Along the whole left side u_y = 0 would hold the contraction: only the corner is held by hand where k does not.
    held = [
        Support(tag, axis)
        for axis, tag in enumerate(("left", "bottom") if dim == 2 else ("left", "front", "bottom"))
        if axis
    ]
    springs = Foundation("left", k, component)  # type: ignore[arg-type]
    with solved(Body("block", space, law, [*held, springs], [Load("pressure", -p, "right")])) as body:
        X = space.piece.points
        if component is None and nu:
            # Springs along the side resist its contraction; the mean displacement still balances the pull.
            reaction = body.internal_forces()
            np.testing.assert_allclose(reaction.reshape(-1, dim)[:, 0].sum(), p, rtol=1e-12)
            return
        np.testing.assert_allclose(body.displacement[:, 0], p / k + p * X[:, 0] / E, atol=1e-13)
        if not nu:
            np.testing.assert_allclose(body.displacement[:, 1:], 0, atol=1e-13)
        sigma, _ = body.model.stress(X, space.piece.cells, body.u[space.cell_dofs])  # type: ignore[attr-defined]
        expected = np.diag([p / E, -nu * p / E, -nu * p / E])
        np.testing.assert_allclose(sigma, np.broadcast_to(hooke(E, nu, law.state, expected), sigma.shape), atol=1e-12)


@pytest.mark.parametrize(("order", "dim"), [(1, 2), (2, 2), (2, 3)])
def test_forces_of_springs_are_stiffness_times_displacement(order: int, dim: int) -> None:
    """Forces by the tractions of the springs are K u, on curved facets and for cells with two of them."""
    mesh = block(dim, order, bend=0.05)
    space = Space(MPI.COMM_SELF, mesh, dim)
    law = Elasticity(1e-3, 0.3, "3d" if dim == 3 else "plane-strain")
    springs = [Foundation(tag, 3.0, kind) for tag, kind in zip(SIDES[dim], ("normal", None, 1, 0), strict=False)]  # type: ignore[arg-type]
    body = Body("block", space, law, springs)
    X, cells = space.piece.points, space.piece.cells
    u = np.random.default_rng(1).uniform(-1, 1, (len(cells), space.cell_dofs.shape[1]))
    K = body.model.stiffness(X, cells)
    expected = np.einsum("mij,mj->mi", K, u)
    np.testing.assert_allclose(body.model.forces(X, cells, u), expected, atol=1e-13 * np.abs(expected).max())
    np.testing.assert_allclose(K, K.swapaxes(1, 2), atol=1e-14)
    assert np.abs(K - law.stiffness(X, cells)).max() > 1e-2


@pytest.mark.parametrize(
    ("springs", "left"),
    [
        ([], 3),
        ([Foundation("bottom", 1e-6)], 0),
        ([Foundation("bottom", 1e9, "normal")], 1),
        ([Foundation("bottom", 1.0, 0)], 2),
        ([Foundation("bottom", 1.0, "normal"), Foundation("left", 1e-9, "normal")], 0),
    ],
)
def test_springs_hold_a_body(springs: list[Foundation], left: int) -> None:
    """Motions that springs resist do not float, however soft they are; those along a smooth side do."""
    body = Body("block", Space(MPI.COMM_SELF, block(2, 1), 2), Elasticity(1.0, 0.3, "plane-strain"), springs)
    assert body.modes.shape[1] == left
    if left:
        along = body.internal_forces(body.space.local(body.modes[:, 0]))
        np.testing.assert_allclose(along, 0, atol=1e-14 * max([1.0, *(s.stiffness for s in springs)]))


@pytest.mark.parametrize("stiffness", [0.0, -1.0, np.inf, np.nan])
def test_bad_springs(stiffness: float) -> None:
    with pytest.raises(ValueError, match=r"stiffness = .*must be finite and > 0"):
        Foundation("bottom", stiffness)
