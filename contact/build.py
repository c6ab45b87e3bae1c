"""From a scene to its bodies and pairs, and the account of what was built and what was left out."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from contact import surfaces
from contact.clock import Clock
from contact.expression import Expression
from contact.pairs import FiniteSliding, Pair, PointToPoint, SmallSliding
from contact.points import ContactPoints, mortar, nodal
from contact.ranks import on_root
from contact.scene import (
    BodyPointTable,
    BodyTable,
    ConeTable,
    ContactTable,
    DomeTable,
    Elastic,
    LoadTable,
    MeshFile,
    MeshShape,
    ParaboloidTable,
    PlaneTable,
    RoundTable,
    Scene,
    SinusoidTable,
    Tension,
)
from contact.surfaces import Surface
from contact.system import System
from fem.body import Body
from fem.elasticity import Elasticity
from fem.loads import Load, Support
from fem.rigid_body import RigidBody
from fem.scalar import Laplacian
from fem.space import Space
from meshes.mesh import Mesh

Floats = NDArray[np.float64]


def build(scene: Scene, comm: Any, folder: Path = Path(), clock: Clock | None = None) -> System:
    """The bodies and pairs that a scene names; nothing else exists. Collective on `comm`.

    Raises
    ------
    ValueError
        One line that names what in the scene cannot be built and what is allowed.
    """
    bodies = {table.name: _body(table, comm, folder) for table in scene.bodies}
    touched = {c.body for c in scene.contacts} | {
        c.surface.body for c in scene.contacts if isinstance(c.surface, BodyPointTable)
    }
    for name, body in bodies.items():
        if body.modes.shape[1] and name not in touched:
            raise ValueError(
                f"body {name!r}: {body.modes.shape[1]} rigid motion(s) that no support and no contact can hold; "
                "add supports or a contact"
            )
    pairs = [pair for table in scene.contacts for pair in _pairs(table, bodies)]
    return System(comm, list(bodies.values()), pairs, clock)


def _body(table: BodyTable, comm: Any, folder: Path) -> Body:
    mesh = on_root(comm, lambda: _mesh(table, folder))
    dim = comm.bcast(None if mesh is None else mesh.dim)
    material = table.material
    if isinstance(material, Elastic) and dim != (3 if material.state == "3d" else 2):
        raise ValueError(f"body {table.name!r}: state = {material.state!r} does not fit a mesh of dimension {dim}")
    components = dim if table.kind in ("solid", "rigid") else 1
    supports = [Support(s.tag, _component(table, s.component, components), field(s.value)) for s in table.supports]
    loads = [Load(load.kind, field(_load_value(table, load, components)), load.tag) for load in table.loads]
    if table.kind == "rigid":
        return RigidBody(table.name, Space(comm, mesh, components), supports, loads, table.guided)
    if isinstance(material, Elastic):
        mixed = material.formulation == "mixed"
        order = comm.bcast(None if mesh is None else mesh.order)
        if mixed and (order == 1 or material.state == "plane-stress"):
            raise ValueError(
                f"body {table.name!r}: formulation = 'mixed' needs a second-order mesh, and not plane stress"
            )
        model = Elasticity(material.E, material.nu, material.state, mixed)
        return Body(table.name, Space(comm, mesh, components, mixed), model, supports, loads)
    assert isinstance(material, Tension)
    if dim != (2 if table.kind == "membrane" else 1):
        raise ValueError(f"body {table.name!r}: a {table.kind} does not have a mesh of dimension {dim}")
    axial = table.kind in ("bar", "spring")
    frame = np.eye(1) if axial else np.eye(dim + 1)[-1:]
    coefficient = material.EA or material.T or 0.0
    if material.k is not None:
        # A spring is a bar with EA = k L.
        coefficient = material.k * comm.bcast(None if mesh is None else float(np.ptp(mesh.points)))
    return Body(table.name, Space(comm, mesh, 1), Laplacian(coefficient), supports, loads, frame)


def _mesh(table: BodyTable, folder: Path) -> Mesh:
    source = table.mesh
    try:
        if isinstance(source, Mesh):
            return source
        if isinstance(source, MeshFile):
            from meshes.files import read

            return read(folder / source.file)
        assert isinstance(source, MeshShape)
        from meshes.generators import generate

        return generate(source.shape, **(source.model_extra or {}))
    except ValueError as error:
        raise ValueError(f"body {table.name!r}: mesh: {error}") from None


def _load_value(table: BodyTable, load: LoadTable, components: int) -> Any:
    """A load's value, where it has as many entries as it acts in directions."""
    wanted = 1 if load.kind == "pressure" else components
    given = len(load.value) if isinstance(load.value, list) else 1
    if not callable(load.value) and given != wanted:
        raise ValueError(f"body {table.name!r}: {load.kind} load: value = {load.value!r}: must have {wanted} entries")
    return load.value


def _component(table: BodyTable, name: str | None, components: int) -> int | None:
    if name is None:
        return None
    axisymmetric = isinstance(table.material, Elastic) and table.material.state == "axisymmetric"
    names = ("u",) if components == 1 else ("r", "z") if axisymmetric else ("x", "y", "z")[:components]
    if name not in names:
        raise ValueError(f"body {table.name!r}: component = {name!r}: must be one of {', '.join(names)}")
    return names.index(name)


def field(value: Any) -> Any:
    """A number as it is, text as an `Expression`, a list with text in it as a function with one column per entry."""
    if isinstance(value, str):
        return Expression(value)
    if isinstance(value, list) and any(isinstance(part, str) for part in value):
        parts = [field(part) for part in value]
        return lambda x, t: np.stack([p(x, t) if callable(p) else np.full(len(x), float(p)) for p in parts], axis=1)
    return value


def surface(table: Any) -> Surface:
    """The surface of a scene's table; any object with the methods of `Surface` is taken as it is."""
    if isinstance(table, PlaneTable):
        return surfaces.Plane(np.array(table.point), np.array(table.normal))
    if isinstance(table, RoundTable):
        if table.kind == "sphere":
            return surfaces.Sphere(np.array(table.centre), table.radius, table.inside)
        return surfaces.Cylinder(np.array(table.centre), np.array(table.axis), table.radius, table.inside)
    if isinstance(table, ParaboloidTable):
        return surfaces.paraboloid(np.array(table.origin), table.radius, table.downward)
    if isinstance(table, ConeTable):
        return surfaces.cone(np.array(table.origin), table.slope, table.downward)
    if isinstance(table, SinusoidTable):
        return surfaces.sinusoid(np.array(table.origin), table.amplitude, table.wavelength, table.downward)
    if isinstance(table, DomeTable):
        return surfaces.dome(np.array(table.origin), table.radius, table.rim, table.downward)
    result: Surface = table
    return result


def _pairs(table: ContactTable, bodies: dict[str, Body]) -> list[Pair]:
    body = bodies[table.body]
    points = {"nodal": nodal, "mortar": mortar}[table.constraint](body, table.tag)
    _check_dimensions(table, body)
    return [_pair(table, points, bodies) for _ in range(table.copies)]


def _pair(table: ContactTable, points: ContactPoints, bodies: dict[str, Body]) -> Pair:
    if isinstance(table.surface, BodyPointTable):
        others = nodal(bodies[table.surface.body], table.surface.tag)
        return PointToPoint(table.name, points, others, np.array(table.surface.normal), table.interference)
    obstacle = surface(table.surface)
    if table.sliding == "finite":
        return FiniteSliding(table.name, points, obstacle, table.interference)
    direction = None if table.direction is None else np.array(table.direction)
    return SmallSliding(table.name, points, obstacle, direction, table.interference)


def _check_dimensions(table: ContactTable, body: Body) -> None:
    D = body.frame.shape[1]
    vectors = {"direction": table.direction}
    for key in ("point", "normal", "centre", "origin", "axis"):
        vectors[f"surface.{key}"] = getattr(table.surface, key, None)
    for key, vector in vectors.items():
        if isinstance(vector, list) and len(vector) != D:
            raise ValueError(f"contact {table.name!r}: {key} = {vector}: must have {D} coordinates")
        if isinstance(vector, list) and key in ("direction", "surface.normal", "surface.axis") and not np.any(vector):
            raise ValueError(f"contact {table.name!r}: {key} = {vector}: must not be zero")
