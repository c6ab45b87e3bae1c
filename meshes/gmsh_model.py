"""gmsh as a function: geometry in, `Mesh` out, no state left."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from types import ModuleType
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from meshes.mesh import Mesh
from meshes.parameters import bad, choice, positive
from meshes.refine import Refine
from meshes.simplices import nodes_per_simplex

HOW_TO_GET_GMSH = (
    "generating this mesh needs gmsh and its system libraries: pip install gmsh; "
    "on Debian and Ubuntu apt-get install libglu1-mesa libxcursor1 libxft2 libxinerama1"
)

OPTIONS = {
    "General.Terminal": 0,
    "General.NumThreads": 1,
    "Mesh.Algorithm": 6,  # frontal Delaunay
    "Mesh.Algorithm3D": 1,  # Delaunay
    "Mesh.RandomSeed": 1,
    "Mesh.RandomFactor": 1e-9,
    "Mesh.RandomFactor3D": 1e-12,
    "Mesh.MeshSizeFromPoints": 0,  # the size comes from the callback alone
    "Mesh.MeshSizeFromCurvature": 0,
    "Mesh.MeshSizeExtendFromBoundary": 0,
    "Mesh.ElementOrder": 1,
    "Mesh.SecondOrderLinear": 0,  # middle nodes on the geometry
}


class Part(NamedTuple):
    """An entity of the boundary in gmsh's model and the tag of its facets."""

    tag: str
    entity: int


@contextmanager
def session() -> Iterator[ModuleType]:
    """gmsh with an empty model, quiet and deterministic; what the caller had in gmsh before is there again after.

    Raises
    ------
    ImportError
        gmsh or one of its system libraries is missing; one line says how to get them.
    """
    try:
        import gmsh
    except (ImportError, OSError) as error:
        raise ImportError(f"{HOW_TO_GET_GMSH} ({error})") from None
    ours = not gmsh.isInitialized()
    if ours:
        gmsh.initialize(readConfigFiles=False, interruptible=False)
    before = {name: gmsh.option.getNumber(name) for name in OPTIONS}
    current = gmsh.model.getCurrent()
    try:
        for name, value in OPTIONS.items():
            gmsh.option.setNumber(name, value)
        gmsh.model.add("signorini")
        yield gmsh
    finally:
        if ours:
            gmsh.finalize()
        else:
            gmsh.model.remove()
            gmsh.model.setCurrent(current)
            for name, value in before.items():
                gmsh.option.setNumber(name, value)


def triangulate(
    gmsh: ModuleType, dim: int, boundary: Sequence[Part], h: float, order: int, refine: Refine | None
) -> Mesh:
    """Mesh the geometry in gmsh's current model.

    Middle nodes of quadratic cells lie on the exact boundary, to rounding with gmsh's built-in kernel; high-order
    optimisation untangles the cells behind it.

    Parameters
    ----------
    gmsh : the module, from `session`
    dim : 2 or 3
    boundary : sequence of Part
    h : float [m]
        Size of the cells.
    order : 1 or 2
    refine : Refine or None
        Where they are smaller.
    """
    h, order = positive("h", h), choice("order", order, (1, 2))
    if refine is not None and not isinstance(refine, Refine):
        raise bad("refine", refine, "a Refine, in a scene a table with at, radius, h and growth")
    mesh = gmsh.model.mesh
    gmsh.model.geo.synchronize()
    size = refine.size(h, dim) if refine else lambda x, y, z: h
    mesh.setSizeCallback(lambda _dim, _tag, x, y, z, _size: size(x, y, z))
    mesh.generate(dim)
    if order == 2:
        mesh.setOrder(2)
        mesh.optimize("HighOrder")
    tags, coordinates, _ = mesh.getNodes()
    number = np.zeros(int(tags.max()) + 1, dtype=np.int64)
    number[tags] = np.arange(len(tags))
    points = coordinates.reshape(-1, 3)[:, :dim]
    cells = _elements(mesh, number, dim, -1, order)
    if dim == 3 and order == 2:
        cells[:, 8:] = cells[:, :7:-1]  # gmsh has the last two edges the other way round
    facets = [_elements(mesh, number, dim - 1, part.entity, order) for part in boundary]
    named = {
        tag: np.concatenate([nodes for part, nodes in zip(boundary, facets, strict=True) if part.tag == tag])
        for tag in dict.fromkeys(part.tag for part in boundary)
    }
    return Mesh(points, cells, named)


def _elements(mesh: ModuleType, number: NDArray[np.int64], dim: int, entity: int, order: int) -> NDArray[np.int64]:
    _, _, nodes = mesh.getElements(dim, entity)
    return np.asarray(number[nodes[0]].reshape(-1, nodes_per_simplex(dim, order)))
