"""Small meshes and bodies that the tests of fem share."""

from collections.abc import Sequence
from typing import Any

import numpy as np
from mpi4py import MPI
from numpy.typing import NDArray

from fem.body import Body
from fem.elasticity import Elasticity, State
from fem.integrators import Static
from fem.loads import Load, Support
from fem.space import Space
from meshes.generators import generate
from meshes.mesh import Mesh
from meshes.structured import quadratic

Floats = NDArray[np.float64]

DIMENSION: dict[str, int] = {"plane-strain": 2, "plane-stress": 2, "axisymmetric": 2, "3d": 3}
SIDES = {2: ("left", "right", "bottom", "top"), 3: ("left", "right", "front", "back", "bottom", "top")}


def block(dim: int, order: int, n: int = 3, origin: float = 0.0, bend: float = 0.0) -> Mesh:
    """A unit box whose inner nodes are moved at random by up to a tenth of a cell; the corner is at x = `origin`.

    With `bend` the inner mid nodes of second-order cells leave the middles of their edges by that part of a cell.
    """
    rng = np.random.default_rng(7)
    mesh = generate("box", size=[1.0] * dim, origin=[origin, *[0.0] * (dim - 1)], n=n, structured=True)
    points, facets = mesh.points.copy(), dict(mesh.facets)
    moved = _inner(points, origin)
    points[moved] += rng.uniform(-0.1 / n, 0.1 / n, points.shape)[moved]
    cells = mesh.cells
    if order == 2:
        vertices = len(points)
        points, cells = quadratic(points, cells)
        moved = _inner(points, origin)
        moved[:vertices] = False
        points[moved] += rng.uniform(-bend / n, bend / n, points.shape)[moved]
    return Mesh(points, cells, facets)


def _inner(points: Floats, origin: float) -> NDArray[np.bool_]:
    unit = points - np.array([origin, *[0.0] * (points.shape[1] - 1)])
    return np.asarray(((unit > 1e-9) & (unit < 1 - 1e-9)).all(axis=1))


def solid(
    mesh: Mesh,
    state: State,
    supports: Sequence[Support] = (),
    loads: Sequence[Load] = (),
    mixed: bool = False,
    E: float = 2.0,
    nu: float = 0.3,
    comm: Any = MPI.COMM_SELF,
) -> Body:
    """An elastic body on one rank."""
    space = Space(comm, mesh, mesh.dim, mixed)
    return Body("body", space, Elasticity(E, nu, state, mixed), supports, loads)


def solved(body: Body, t: float = 0.0) -> Body:
    """The body after assembly, factorisation and its free motion."""
    body.assemble()
    body.factor()
    body.begin(t, Static())
    body.free_motion()
    return body


def hooke(E: float, nu: float, state: State, strain: Floats) -> Floats:
    """σ of a strain tensor (3, 3), from the compliance ε = ((1+ν) σ − ν tr σ I)/E solved for the six stresses."""
    if state == "plane-stress":
        strain = strain.copy()
        strain[2, 2] = -nu / (1 - nu) * (strain[0, 0] + strain[1, 1])
    compliance = np.array([[1, -nu, -nu], [-nu, 1, -nu], [-nu, -nu, 1]]) / E
    stress = strain * E / (1 + nu)
    np.fill_diagonal(stress, np.linalg.solve(compliance, np.diag(strain)))
    return stress
