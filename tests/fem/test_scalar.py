"""The Laplacian of bars, strings and membranes."""

import numpy as np
import pytest
from fem_examples import block, solved
from mpi4py import MPI

from fem.body import Body
from fem.loads import Load, Support
from fem.scalar import Laplacian
from fem.space import Space
from meshes.generators import generate


@pytest.mark.parametrize("order", [1, 2])
def test_string_under_its_weight(order: int) -> None:
    """T u'' = f with u = 0 at the ends: u = −f x (L − x)/2T, exact at the nodes."""
    T, f, L = 3.0, 2.0, 2.0
    mesh = generate("interval", length=L, n=5, order=order)
    body = Body(
        "string",
        Space(MPI.COMM_SELF, mesh, 1),
        Laplacian(T),
        [Support("start"), Support("end")],
        [Load("body", -f)],
        frame=np.array([[0.0, 1.0]]),
    )
    with solved(body):
        x = body.space.piece.points[:, 0]
        np.testing.assert_allclose(body.displacement[:, 1], -f * x * (L - x) / (2 * T), atol=1e-14)
        np.testing.assert_array_equal(body.displacement[:, 0], 0)
        np.testing.assert_array_equal(body.points[:, 1], 0)


def test_bar_pulled_at_its_end() -> None:
    """u = F x/EA + q (L x − x²/2)/EA."""
    EA, F, q = 5.0, 2.0, 1.5
    mesh = generate("interval", length=1.0, n=4, order=2)
    loads = [Load("force", F, "end"), Load("body", q)]
    body = Body("bar", Space(MPI.COMM_SELF, mesh, 1), Laplacian(EA), [Support("start")], loads)
    with solved(body):
        x = body.space.piece.points[:, 0]
        np.testing.assert_allclose(body.displacement[:, 0], (F * x + q * (x - x**2 / 2)) / EA, atol=1e-14)


@pytest.mark.parametrize("dim", [2, 3])
@pytest.mark.parametrize("order", [1, 2])
def test_forces_are_stiffness_times_displacement(dim: int, order: int) -> None:
    """∫ c ∇u·∇N_a = Σ_b K_ab u_b on distorted cells, and a field of gradient g has the energy ½ c |g|²."""
    mesh = block(dim, order)
    model = Laplacian(2.5)
    K = model.stiffness(mesh.points, mesh.cells)
    u = np.random.default_rng(0).uniform(-1, 1, mesh.cells.shape)
    np.testing.assert_allclose(model.forces(mesh.points, mesh.cells, u), np.einsum("mij,mj->mi", K, u), atol=1e-12)
    g = np.arange(1.0, dim + 1)
    linear = (mesh.points @ g)[mesh.cells]
    assert 0.5 * np.einsum("mi,mij,mj->", linear, K, linear) == pytest.approx(0.5 * 2.5 * g @ g, rel=1e-12)
