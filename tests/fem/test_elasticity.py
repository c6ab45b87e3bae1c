"""Element matrices and forces of elasticity: patch tests, two independent paths, energies, rates and locking."""

from itertools import product

import numpy as np
import pytest
from fem_examples import DIMENSION, SIDES, Floats, block, hooke, solid, solved

from fem.body import Body
from fem.elasticity import Elasticity, State
from fem.geometry import map_cells
from fem.loads import Load, Support
from meshes.generators import generate

STATES: list[State] = ["plane-strain", "plane-stress", "axisymmetric", "3d"]
KINDS = [
    (state, order, mixed)
    for state, order, mixed in product(STATES, (1, 2), (False, True))
    if not (mixed and (order == 1 or state == "plane-stress"))
]
kinds = pytest.mark.parametrize(("state", "order", "mixed"), KINDS)


def _linear(state: State) -> tuple[Floats, Floats]:
    """Gradient A of a linear field u = A x in equilibrium without body forces, and its strain (3, 3)."""
    dim = DIMENSION[state]
    gradient = np.random.default_rng(3).uniform(-1, 1, (dim, dim))
    strain = np.zeros((3, 3))
    if state == "axisymmetric":  # u_z(r) would need a body force, u_r(z) is a strain that changes with r
        gradient = np.diag(np.diag(gradient))
        strain[2, 2] = gradient[0, 0]
    strain[:dim, :dim] = (gradient + gradient.T) / 2
    return gradient, strain


@kinds
def test_patch(state: State, order: int, mixed: bool) -> None:
    """A linear field prescribed on the boundary is found inside, with Hooke's constant stress, on a distorted mesh."""
    gradient, strain = _linear(state)
    mesh = block(DIMENSION[state], order, origin=1.0, bend=0.05)
    supports = [Support(side, value=lambda x, t: x @ gradient.T) for side in SIDES[mesh.dim]]
    with solved(solid(mesh, state, supports, mixed=mixed)) as body:
        X = body.space.piece.points
        np.testing.assert_allclose(body.displacement, X @ gradient.T, atol=1e-12)
        sigma, volume = body.model.stress(X, body.space.piece.cells, body.u[body.space.cell_dofs])  # type: ignore[attr-defined]
        exact = hooke(2.0, 0.3, state, strain)
        np.testing.assert_allclose(sigma, np.broadcast_to(exact, sigma.shape), atol=1e-11)
        # ∫ 2πr over 1 < r < 2
        assert volume.sum() == pytest.approx(3 * np.pi if state == "axisymmetric" else 1.0, rel=1e-12)


@kinds
def test_forces_are_stiffness_times_displacement(state: State, order: int, mixed: bool) -> None:
    """Forces from the stresses of the cells are K u for any u, on curved cells too."""
    body = solid(block(DIMENSION[state], order, origin=0.0, bend=0.05), state, mixed=mixed)
    points, cells = body.space.piece.points, body.space.piece.cells
    u = np.random.default_rng(1).uniform(-1, 1, (len(cells), body.space.cell_dofs.shape[1]))
    K = body.model.stiffness(points, cells)
    forces = body.model.forces(points, cells, u)
    expected = np.einsum("mij,mj->mi", K, u)
    np.testing.assert_allclose(forces, expected, atol=1e-13 * np.abs(expected).max())
    np.testing.assert_allclose(K, K.swapaxes(1, 2), atol=1e-14 * np.abs(K).max())


@pytest.mark.parametrize("mixed", [False, True])
@pytest.mark.parametrize(
    ("state", "field", "divergence", "squared_divergence", "squared_strain"),
    [
        # ε_xx = 2x, ε_yy = x, ε_xy = 3y/2
        ("plane-strain", lambda x, y: (x**2 + y**2, x * y), lambda x, y: 3 * x, 3.0, 19 / 6),
        # ε_rr = 2r, ε_θθ = ε_zz = r, ε_rz = z/2, over 1 < r < 2
        ("axisymmetric", lambda r, z: (r**2, r * z), lambda r, z: 4 * r, 120 * np.pi, 45.5 * np.pi),
        # ε_xx = 2x, ε_yy = z, ε_zz = 2z, ε_yz = y/2
        ("3d", lambda x, y, z: (x**2, y * z, z**2), lambda x, y, z: 2 * x + 3 * z, 22 / 3, 19 / 6),
    ],
)
def test_energy_of_quadratic_fields(
    state: State,
    field: object,
    divergence: object,
    squared_divergence: float,
    squared_strain: float,
    mixed: bool,
) -> None:
    """½ uᵀf_int(u) = ½ ∫ Λ (div u)² + 2G ε:ε for quadratic fields on second-order cells."""
    mesh = block(DIMENSION[state], 2, origin=float(state == "axisymmetric"))
    body = solid(mesh, state, mixed=mixed)
    model, space = body.model, body.space
    assert isinstance(model, Elasticity)
    X = space.piece.points
    count = X.size
    body.u[:count] = np.stack(field(*X.T), axis=1).ravel()  # type: ignore[operator]
    if mixed:
        vertices = np.unique(space.piece.cells[:, : mesh.dim + 1])
        body.u[count:] = -model.Lame * divergence(*X[vertices].T)  # type: ignore[operator]
    energy = 0.5 * (model.Lame * squared_divergence + 2 * model.G * squared_strain)
    forces = space.local(body.internal_forces())
    assert 0.5 * body.u[:count] @ forces[:count] == pytest.approx(energy, rel=1e-12)
    np.testing.assert_allclose(forces[count:], 0, atol=1e-13)


def _errors(body: Body, field: object, gradient: object) -> tuple[float, float]:
    """‖u − u_h‖ in L² and in the H¹ seminorm."""
    piece = body.space.piece
    mapped = map_cells(piece.points, piece.cells, 8)
    u = body.displacement[piece.cells]
    x = mapped.points.reshape(-1, 2)
    values = np.einsum("qa,mai->mqi", mapped.values, u)
    slopes = np.einsum("mqaj,mai->mqij", mapped.gradients, u)
    exact, exact_slopes = field(x).reshape(values.shape), gradient(x).reshape(slopes.shape)  # type: ignore[operator]
    L2 = np.einsum("mq,mqi->", mapped.weights, (values - exact) ** 2)
    H1 = np.einsum("mq,mqij->", mapped.weights, (slopes - exact_slopes) ** 2)
    return float(np.sqrt(L2)), float(np.sqrt(H1))


@pytest.mark.parametrize(("order", "mixed", "rates"), [(1, False, (2, 1)), (2, False, (3, 2)), (2, True, (3, 2))])
def test_rates_for_a_manufactured_solution(order: int, mixed: bool, rates: tuple[int, int]) -> None:
    """u = (sin πx sin πy, 0), f_x = (Λ+3G) π² sin πx sin πy, f_y = −(Λ+G) π² cos πx cos πy on the unit square."""
    pi, model = np.pi, Elasticity(2.0, 0.3, "plane-strain")
    Lame, G = model.Lame, model.G

    def field(x: Floats) -> Floats:
        return np.stack([np.sin(pi * x[:, 0]) * np.sin(pi * x[:, 1]), 0 * x[:, 0]], axis=1)

    def gradient(x: Floats) -> Floats:
        result = np.zeros((len(x), 2, 2))
        result[:, 0, 0] = pi * np.cos(pi * x[:, 0]) * np.sin(pi * x[:, 1])
        result[:, 0, 1] = pi * np.sin(pi * x[:, 0]) * np.cos(pi * x[:, 1])
        return result

    def load(x: Floats, t: float) -> Floats:
        f_x = (Lame + 3 * G) * np.sin(pi * x[:, 0]) * np.sin(pi * x[:, 1])
        f_y = -(Lame + G) * np.cos(pi * x[:, 0]) * np.cos(pi * x[:, 1])
        return pi**2 * np.stack([f_x, f_y], axis=1)

    errors = []
    for n in (8, 16):
        mesh = generate("box", size=[1.0, 1.0], n=n, structured=True, order=order)
        supports = [Support(side) for side in SIDES[2]]
        with solved(solid(mesh, "plane-strain", supports, [Load("body", load)], mixed)) as body:
            errors.append(_errors(body, field, gradient))
    found = np.log2(np.array(errors[0]) / np.array(errors[1]))
    np.testing.assert_allclose(found, rates, atol=0.1)


def test_mixed_does_not_lock() -> None:
    """A field without divergence has the same error for every ν in the mixed form; first-order displacements lock."""
    pi = np.pi

    def field(x: Floats) -> Floats:  # the curl of ψ = sin²πx sin²πy
        s, c = np.sin(pi * x), np.cos(pi * x)
        return 2 * pi * np.stack([s[:, 0] ** 2 * s[:, 1] * c[:, 1], -(s[:, 1] ** 2) * s[:, 0] * c[:, 0]], axis=1)

    def minus_laplacian(x: Floats) -> Floats:
        s2, c2 = np.sin(2 * pi * x), np.cos(2 * pi * x)
        return 2 * pi**3 * np.stack([s2[:, 1] * (1 - 2 * c2[:, 0]), -s2[:, 0] * (1 - 2 * c2[:, 1])], axis=1)

    def error(nu: float, order: int, mixed: bool) -> float:
        G = Elasticity(1.0, nu, "plane-strain").G
        load = Load("body", lambda x, t: G * minus_laplacian(x))
        mesh = generate("box", size=[1.0, 1.0], n=8, structured=True, order=order)
        supports = [Support(side) for side in SIDES[2]]
        with solved(solid(mesh, "plane-strain", supports, [load], mixed, 1.0, nu)) as body:
            exact = field(body.space.piece.points)
            return float(np.abs(body.displacement - exact).max() / np.abs(exact).max())

    mixed = [error(nu, 2, True) for nu in (0.3, 0.49, 0.4999, 0.49999)]
    assert max(mixed) < 0.03
    assert max(mixed) / min(mixed) < 1.2
    assert error(0.3, 1, False) < 0.15
    assert error(0.49999, 1, False) > 0.9


@pytest.mark.parametrize(("state", "nu"), [("plane-stress", 0.3), ("plane-strain", 0.0), ("3d", -0.2)])
def test_mixed_refuses_what_it_cannot_do(state: State, nu: float) -> None:
    """The mixed form divides by Λ, and plane stress has no pressure of its own."""
    with pytest.raises(ValueError, match="needs 0 < nu < 1/2, not plane stress"):
        Elasticity(1.0, nu, state, mixed=True)
