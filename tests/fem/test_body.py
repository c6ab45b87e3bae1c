"""Bodies: loads and supports, the factorised matrix, floating bodies, and solvers chosen by options."""

from collections.abc import Iterator

import numpy as np
import pytest
import scipy.sparse as sp
from fem_examples import SIDES, Floats, block, solid, solved
from mpi4py import MPI
from petsc4py import PETSc

from fem.body import Body
from fem.elasticity import State
from fem.integrators import Static
from fem.loads import Load, Support
from fem.scalar import Laplacian
from fem.space import Space
from meshes.generators import generate
from meshes.mesh import Mesh


def _resultant(body: Body) -> Floats:
    body.begin(0.0, Static())
    c = body.space.components
    return body.load[: c * body.space.piece.owned].reshape(-1, c).sum(axis=0)


# --- loads ------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(("dim", "order"), [(2, 1), (2, 2), (3, 1), (3, 2)])
def test_resultants(dim: int, order: int) -> None:
    """Tractions, pressures and body forces sum to their integrals over the unit box."""
    g = np.arange(1.0, dim + 1)
    state: State = "3d" if dim == 3 else "plane-strain"
    mesh = block(dim, order)
    np.testing.assert_allclose(_resultant(solid(mesh, state, loads=[Load("traction", g, "top")])), g)
    np.testing.assert_allclose(_resultant(solid(mesh, state, loads=[Load("body", g)])), g)
    for side, axis, sign in [("right", 0, -1), ("left", 0, 1), ("top", -1, -1)]:
        force = np.zeros(dim)
        force[axis] = 3.0 * sign
        np.testing.assert_allclose(
            _resultant(solid(mesh, state, loads=[Load("pressure", 3.0, side)])), force, atol=1e-14
        )
    # ∫ x² over the top: its traction is a function of place and time
    load = Load("traction", lambda x, t: (x[:, :1] ** 2 + t) * g, "top")
    body = solid(mesh, state, loads=[load])
    body.begin(2.0, Static())
    assert body.load.sum() == pytest.approx((1 / 3 + 2) * g.sum(), rel=1e-12)


def test_resultants_of_revolution() -> None:
    """In axisymmetry forces are those of the whole ring: 1 < r < 2, 0 < z < 1."""
    mesh = block(2, 2, origin=1.0)
    resultant = lambda load: _resultant(solid(mesh, "axisymmetric", loads=[load]))  # noqa: E731
    np.testing.assert_allclose(resultant(Load("traction", [0.0, 2.0], "top")), [0, 2 * 3 * np.pi], atol=1e-13)
    np.testing.assert_allclose(resultant(Load("body", [0.0, -4.0])), [0, -4 * 3 * np.pi], atol=1e-13)
    np.testing.assert_allclose(resultant(Load("pressure", 5.0, "right")), [-5 * 4 * np.pi, 0], atol=1e-13)
    np.testing.assert_allclose(resultant(Load("body", lambda x, t: x)), [2 * np.pi * 7 / 3, 2 * np.pi * 1.5 / 2])


@pytest.mark.parametrize("order", [1, 2])
def test_pressure_on_a_curved_side(order: int) -> None:
    """−p ∫ n ds over a quarter of a circle from (0, 0) to (R, R) is p (−R, R), whatever its facets."""
    mesh = generate("half-disc", radius=2.0, h=0.7, order=order)
    force = _resultant(solid(mesh, "plane-strain", loads=[Load("pressure", 3.0, "arc")]))
    np.testing.assert_allclose(force, [-6.0, 6.0], atol=1e-13)


def test_moment_of_a_traction() -> None:
    """A traction (0, x) on the top has the moment ∫ x² dx = 1/3 about the corner."""
    body = solid(
        block(2, 2), "plane-strain", loads=[Load("traction", lambda x, t: np.stack([0 * x[:, 0], x[:, 0]], 1), "top")]
    )
    body.begin(0.0, Static())
    x = body.space.piece.points[: body.space.piece.owned]
    f = body.load.reshape(-1, 2)
    assert (x[:, 0] * f[:, 1] - x[:, 1] * f[:, 0]).sum() == pytest.approx(1 / 3, rel=1e-12)


def test_force_on_points() -> None:
    """A force acts on each node of its tag."""
    body = solid(block(2, 1, n=4), "plane-strain", loads=[Load("force", [1.0, -2.0], "top")])
    np.testing.assert_allclose(_resultant(body), [5.0, -10.0])


def test_functions_of_one_number() -> None:
    """One number per point stands for every component, on however many points; another width is refused."""
    for n in (1, 3):  # with n = 1 the side has as many nodes as the plane has directions
        mesh = block(2, 1, n=n)
        supports = [Support("left", value=lambda x, t: x[:, 1])]
        body = solid(mesh, "plane-strain", supports, [Load("traction", lambda x, t: x[:, 0], "top")])
        np.testing.assert_allclose(_resultant(body), [0.5, 0.5])
        left = body.space.piece.points[:, 0] == 0
        np.testing.assert_array_equal(body.displacement[left], body.space.piece.points[left][:, [1, 1]])
    wrong = solid(mesh, "plane-strain", loads=[Load("body", [1.0, 2.0, 3.0])])
    with pytest.raises(ValueError, match="must give one number or 2"):
        wrong.begin(0.0, Static())


def test_pressure_needs_sides() -> None:
    """Bars and membranes have no sides that a pressure could press."""
    for dim in (1, 2):
        mesh = generate("interval", length=1.0, n=2) if dim == 1 else block(2, 1)
        load = Load("pressure", 1.0, next(iter(mesh.facets)))
        with pytest.raises(ValueError, match="only a solid has a pressure on its sides"):
            Body("flat", Space(MPI.COMM_SELF, mesh, 1), Laplacian(1.0), loads=[load], frame=np.eye(dim + 1)[-1:])


def test_radii_are_not_negative() -> None:
    """An axisymmetric body lies on one side of its axis, on which it may have a side."""
    with pytest.raises(ValueError, match=r"its mesh reaches r = -0\.5: must be r >= 0"):
        solid(block(2, 1, origin=-0.5), "axisymmetric")
    solid(block(2, 1), "axisymmetric")


# --- supports ---------------------------------------------------------------------------------------------------------


def test_prescribed_functions() -> None:
    """Supports follow functions of place and time, by component or all at once; the last one named wins at a corner."""
    supports = [
        Support("bottom", value=lambda x, t: t * x),
        Support("top", 1, lambda x, t: 3 * x[:, 0]),
        Support("right", 0, 7.0),
    ]
    with solved(solid(block(2, 2), "plane-strain", supports), t=2.0) as body:
        x, u = body.space.piece.points, body.displacement
        right, top, bottom = x[:, 0] == 1, x[:, 1] == 1, x[:, 1] == 0
        np.testing.assert_allclose(u[top, 1], 3 * x[top, 0], atol=1e-14)
        np.testing.assert_allclose(u[right, 0], 7.0)
        np.testing.assert_allclose(u[bottom & ~right], 2 * x[bottom & ~right], atol=1e-14)
        assert body.fixed.sum() == len(np.flatnonzero(bottom)) * 2 + top.sum() + right.sum() - 1
        assert np.abs(body.residual()).max() < 1e-12


@pytest.mark.parametrize(
    ("support", "message"),
    [
        (Support("lid"), "body 'body': its mesh has no tag 'lid' .it has: bottom, left, right, top"),
        (Support("top", 2), "body 'body': support on 'top' has no component 2"),
    ],
)
def test_wrong_supports(support: Support, message: str) -> None:
    """A support that the mesh or the body does not have is named."""
    with pytest.raises(ValueError, match=message):
        solid(block(2, 1), "plane-strain", [support])


def test_size() -> None:
    """The largest extent."""
    mesh = generate("box", size=[1.0, 4.0], origin=[9.0, -2.0], n=2, structured=True)
    assert solid(mesh, "plane-strain").size == 4.0


# --- solves -----------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(("order", "mixed"), [(1, False), (2, False), (2, True)])
def test_solve_inverts_the_internal_forces(order: int, mixed: bool) -> None:
    """f_int(A⁻¹ b) = b for a block of right-hand sides at once, and A⁻¹ is symmetric."""
    body = solid(block(2, order), "plane-strain", [Support("bottom")], mixed=mixed)
    body.assemble()
    body.factor()
    with body:
        count = 2 * body.space.piece.owned
        B = np.random.default_rng(0).normal(size=(body.space.owned, 5))
        B[count:] = 0
        B[body.fixed] = 0
        X = body.solve(B)
        for b, x in zip(B.T, X.T, strict=True):
            body.u = body.space.local(x)
            np.testing.assert_allclose(np.where(body.fixed, 0, body.internal_forces()), b, atol=1e-11)
        np.testing.assert_allclose(B.T @ X, (B.T @ X).T, atol=1e-11)


@pytest.mark.parametrize(("order", "mixed"), [(1, False), (2, True)])
def test_sparse_right_hand_sides(order: int, mixed: bool) -> None:
    """A⁻¹ Hᵀ of sparse rows is that of the same rows as dense columns."""
    with solved(solid(block(2, order), "plane-strain", [Support("bottom")], mixed=mixed)) as body:
        free = np.flatnonzero(~body.held & (np.arange(body.space.owned) < 2 * body.space.piece.owned))
        rows = np.repeat(np.arange(4), 3)
        columns = np.random.default_rng(0).choice(free, 12, replace=False)
        H = sp.csr_array((np.arange(1.0, 13.0), (rows, columns)), shape=(4, body.space.owned))
        np.testing.assert_allclose(body.solve_rows(H), body.solve(H.toarray().T), atol=1e-11)


def test_factor_is_not_stale() -> None:
    """Loads and supports that change with time give what a new body gives at that time, with one factorisation."""

    def fresh() -> Body:
        supports = [Support("bottom", value=lambda x, t: 0.1 * t * x), Support("left", 0)]
        load = Load("traction", lambda x, t: np.full((len(x), 2), [t, -(t**2)]), "top")
        return solid(block(2, 2), "plane-strain", supports, [load])

    with solved(fresh(), 1.0) as body:
        ksp = body._ksp
        for t in (2.0, -1.0, 2.0):
            body.begin(t, Static())
            body.free_motion()
            with solved(fresh(), t) as new:
                np.testing.assert_allclose(body.u, new.u, atol=1e-12)
        assert body._ksp is ksp


def test_a_second_assembly_replaces_the_factor() -> None:
    """After another material is assembled and factorised the old factor is not used."""
    with solved(solid(block(2, 1), "plane-strain", [Support("bottom")], [Load("body", [1.0, 0.0])], E=2.0)) as body:
        soft = body.u.copy()
        body.close()
        body.model = solid(block(2, 1), "plane-strain", E=20.0).model
        body.u[:] = 0
        solved(body)
        np.testing.assert_allclose(10 * body.u, soft, atol=1e-13)


@pytest.mark.parametrize("mixed", [False, True])
def test_floating_body_under_balanced_loads(mixed: bool) -> None:
    """Tension p on two opposite sides of a body without supports: ε_xx = p(1−ν²)/E, and its pins carry nothing."""
    loads = [Load("pressure", -1.0, "left"), Load("pressure", -1.0, "right")]
    with solved(solid(block(2, 2), "plane-strain", loads=loads, mixed=mixed)) as body:
        assert body.modes.shape[1] == 3
        assert body.imbalance(np.zeros(body.space.owned)) < 1e-13
        x, u = body.space.piece.points, body.displacement
        slopes = np.linalg.lstsq(np.column_stack([x, np.ones(len(x))]), u, rcond=None)[0]
        assert slopes[0, 0] == pytest.approx((1 - 0.3**2) / 2.0, rel=1e-12)
        assert slopes[1, 1] == pytest.approx(-0.3 * 1.3 / 2.0, rel=1e-12)


@pytest.mark.parametrize("mixed", [False, True])
@pytest.mark.parametrize(
    ("modulus", "length"), [(1e-9, 1.0), (1e9, 1.0), (1.0, 1e-9), (1.0, 1e9), (1e9, 1e-9), (1e-9, 1e9)]
)
def test_units(mixed: bool, modulus: float, length: float) -> None:
    """The same body in other units has the same strains, and its forces are in balance as well."""
    strains, nu = [], 0.4999 if mixed else 0.3
    for E, L in [(1.0, 1.0), (modulus, length)]:
        mesh = block(2, 2)
        scaled = Mesh(L * mesh.points, mesh.cells, mesh.facets)
        load = Load("traction", [0.1 * E, -0.3 * E], "top")
        with solved(solid(scaled, "plane-strain", [Support("bottom")], [load], mixed, E, nu)) as body:
            assert body.imbalance(np.zeros(body.space.owned)) < 1e-12
            strains.append(body.displacement / L)
    np.testing.assert_allclose(strains[1], strains[0], atol=1e-11)


def test_imbalance() -> None:
    """‖f_int − f_ext − f_c‖ / (‖f_int‖ + ‖f_ext‖ + ‖f_c‖): 0 in equilibrium and without forces, 1 for one alone."""
    body = solved(solid(block(2, 1), "plane-strain", [Support("bottom")], [Load("traction", [1.0, 1.0], "top")]))
    with body:
        none = np.zeros(body.space.owned)
        assert body.imbalance(none) < 1e-14
        assert body.imbalance(0.1 * body.load) == pytest.approx(
            0.1 * np.linalg.norm(body.load) / (np.linalg.norm(body.internal_forces()) + 1.1 * np.linalg.norm(body.load))
        )
        body.u[:] = 0
        assert body.imbalance(none) == 1.0
        body.load[:] = 0
        assert body.imbalance(none) == 0.0


def test_near_null_space_is_the_rigid_motions() -> None:
    """Orthonormal vectors that span the rigid motions of the body, supports or not."""
    with solved(solid(block(3, 1), "3d", [Support("bottom")])) as body:
        vectors = np.stack([v.getArray(readonly=True) for v in body.A.getNearNullSpace().getVecs()], axis=1)
        np.testing.assert_allclose(vectors.T @ vectors, np.eye(6), atol=1e-13)
        R = body.rigid_modes()
        np.testing.assert_allclose(vectors @ (vectors.T @ R), R, atol=1e-12)


@pytest.fixture
def multigrid() -> Iterator[None]:
    """CG with algebraic multigrid for the free motion, by PETSc's options."""
    options = PETSc.Options("free_")
    chosen = {"ksp_type": "cg", "pc_type": "gamg"}
    for key, value in chosen.items():
        options.setValue(key, value)
    yield
    for key in chosen:
        options.delValue(key)


def test_multigrid_by_options(multigrid: None) -> None:
    """-free_ksp_type cg -free_pc_type gamg gives H A⁻¹ Hᵀ of the direct factorisation to 1e-9, in a few iterations."""
    B = None
    results = []
    for direct in (False, True):
        if direct:
            for key in ("ksp_type", "pc_type"):
                PETSc.Options("free_").delValue(key)
        with solved(solid(block(3, 1, n=6), "3d", [Support("bottom")])) as body:
            assert body._ksp.getType() == ("preonly" if direct else "cg")
            assert body._ksp.getPC().getType() == ("cholesky" if direct else "gamg")
            top = 3 * np.unique(body.facets("top")) + 2
            B = np.zeros((body.space.owned, len(top)))
            B[top, np.arange(len(top))] = 1
            results.append(B.T @ body.solve(B))
            assert direct or body._ksp.getIterationNumber() < 40
    np.testing.assert_allclose(results[0], results[1], atol=1e-9 * np.abs(results[1]).max())


# PETSc leaves the column that it was solving for checked out of its dense matrix.
@pytest.mark.filterwarnings("ignore::pytest.PytestUnraisableExceptionWarning")
def test_a_solver_that_stops_early_raises() -> None:
    """One iteration of CG is not enough, and PETSc says so."""
    options = PETSc.Options("free_")
    options.setValue("ksp_type", "cg")
    options.setValue("pc_type", "jacobi")
    options.setValue("ksp_max_it", 1)
    try:
        body = solid(block(2, 1), "plane-strain", [Support("bottom")], [Load("body", [1.0, 0.0])])
        with body, pytest.raises(PETSc.Error):
            solved(body)
    finally:
        for key in ("ksp_type", "pc_type", "ksp_max_it"):
            options.delValue(key)


def test_frame_of_the_wrong_width() -> None:
    """One direction in space per component."""
    mesh = block(2, 1)
    body = solid(mesh, "plane-strain")
    with pytest.raises(ValueError, match="frame has 1 directions for 2 components"):
        Body("plate", Space(body.space.comm, mesh, 2), body.model, frame=np.ones((1, 2)))
    assert set(SIDES[2]) == set(mesh.facets)
