"""From a scene to its bodies and pairs, and the account of what was built and what was left out."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from contact.clock import Clock
from contact.pairs import FiniteSliding, Pair, PointToPoint, SmallSliding
from contact.points import ContactPoints, mortar, nodal
from contact.ranks import on_root
from contact.scene.devices import BeamTable
from contact.scene.expression import Expression
from contact.scene.schema import (
    BodyTable,
    ContactTable,
    Elastic,
    LoadTable,
    MeshFile,
    MeshShape,
    RegionTable,
    Scene,
    SupportTable,
    Tension,
)
from contact.scene.surfaces import BodyPointTable, BodySurfaceTable, surface_of
from contact.system import System
from fem.body import Body
from fem.elasticity import Elasticity
from fem.foundation import Foundation
from fem.integrators import ImplicitEuler, Integrator, Midpoint, Static
from fem.loads import Load, Support
from fem.regions import Regions
from fem.rigid_body import RigidBody
from fem.scalar import Laplacian
from fem.space import Space
from meshes.mesh import Mesh

Floats = NDArray[np.float64]

INTEGRATORS: dict[str, Callable[[float], Integrator]] = {
    "static": lambda dt: Static(),
    "implicit-euler": ImplicitEuler,
    "midpoint": Midpoint,
}


def build(scene: Scene, comm: Any, folder: Path = Path(), clock: Clock | None = None) -> System:
    """The bodies and pairs that a scene names; nothing else exists. Collective on `comm`.

    Raises
    ------
    ValueError
        One line that names what in the scene cannot be built and what is allowed.
    """
    scheme = scene.time.integrator
    dynamic = scheme != "static"
    bodies: dict[str, Any] = {}
    walls = _walls(scene)
    for table in scene.bodies:
        if isinstance(table, BeamTable):
            from contact.scene.build_devices import beam_of  # compiled kernels: only where a beam is named

            bodies[table.name] = beam_of(table, dynamic, folder)
        else:
            bodies[table.name] = _body(table, comm, folder, dynamic, table.name in walls)
    if scheme == "midpoint" and any(isinstance(table, BeamTable) for table in scene.bodies):
        raise ValueError("time.integrator = 'midpoint': a beam moves by 'implicit-euler'")
    touched = {c.body for c in scene.contacts} | {c.other for c in scene.contacts}
    for name, body in bodies.items():
        if body.modes.shape[1] and name not in touched and not dynamic:
            raise ValueError(
                f"body {name!r}: {body.modes.shape[1]} rigid motion(s) that no support and no contact can hold; "
                "add supports or a contact"
            )
    if walls:
        from contact.surfaces.body_surface import surfaces_of

        for name, tags in walls.items():
            walls[name] = dict(zip(tags, surfaces_of(bodies[name], list(tags)), strict=True))
    pairs = [pair for table in scene.contacts for pair in _pairs(table, bodies, walls, folder)]
    if scheme == "midpoint":
        for contact in scene.contacts:
            body = bodies[contact.body]
            body.redistribute(np.unique(body.facets(contact.tag)))
    system = System(comm, list(bodies.values()), pairs, clock, INTEGRATORS[scheme])
    if scene.solver.compiled:
        if scene.solver.method != "status" or scene.solver.minimum_norm:
            raise ValueError(
                "solver.compiled = true: is for method = 'status' without minimum_norm; compiled = false takes any"
            )
        from contact.devices.compiled_step import CompiledStep  # forty seconds of compilation

        system.advance = CompiledStep(system)
    return system


def _walls(scene: Scene) -> dict[str, dict[str, Any]]:
    """The bodies, and their tags, that beams touch."""
    walls: dict[str, dict[str, Any]] = {}
    for contact in scene.contacts:
        if contact.tag is None and isinstance(contact.surface, BodySurfaceTable):
            walls.setdefault(contact.surface.body, {})[contact.surface.tag] = None
    return walls


def _body(table: BodyTable, comm: Any, folder: Path, dynamic: bool, wall: bool = False) -> Body:
    mesh = on_root(comm, lambda: _mesh(table, folder))
    dim = comm.bcast(None if mesh is None else mesh.dim)
    material = table.material
    if isinstance(material, Elastic) and dim != (3 if material.state == "3d" else 2):
        raise ValueError(f"body {table.name!r}: state = {material.state!r} does not fit a mesh of dimension {dim}")
    components = dim if table.kind in ("solid", "rigid") else 1
    supports = [_support(table, s, components) for s in table.supports]
    loads = [Load(load.kind, field(_load_value(table, load, components)), load.tag) for load in table.loads]
    motion: dict[str, Any] = {}
    if dynamic:
        motion = {"density": table.density, "mass": table.mass, "rayleigh": table.rayleigh}
        motion |= {"velocity": field(table.velocity), "displacement": field(table.displacement)}
    elif table.density or any(table.rayleigh) or table.velocity != 0.0 or table.displacement != 0.0:
        raise ValueError(
            f"body {table.name!r}: density, rayleigh, velocity, displacement: a scene in statics has none; "
            "set time.integrator, or leave them out"
        )
    if table.kind == "rigid":
        rigid = [s for s in supports if isinstance(s, Support)]
        return RigidBody(table.name, Space(comm, mesh, components), rigid, loads, table.guided, **motion)
    if isinstance(material, Elastic):
        mixed = material.formulation == "mixed"
        order = comm.bcast(None if mesh is None else mesh.order)
        if mixed and (order == 1 or material.state == "plane-stress"):
            raise ValueError(
                f"body {table.name!r}: formulation = 'mixed' needs a second-order mesh, and not plane stress"
            )
        try:
            space = Space(comm, mesh, components, mixed, tuple(material.regions))
        except ValueError as error:
            raise ValueError(f"body {table.name!r}: material.regions: {error}") from None
        kind = _wall_class() if wall else Body
        return kind(table.name, space, _elasticity(table, material, space), supports, loads, **motion)
    assert isinstance(material, Tension)
    if dim != (2 if table.kind == "membrane" else 1):
        raise ValueError(f"body {table.name!r}: a {table.kind} does not have a mesh of dimension {dim}")
    axial = table.kind in ("bar", "spring")
    frame = np.eye(1) if axial else np.eye(dim + 1)[-1:]
    coefficient = material.EA or material.T or 0.0
    if material.k is not None:
        # A spring is a bar with EA = k L.
        coefficient = material.k * comm.bcast(None if mesh is None else float(np.ptp(mesh.points)))
    return Body(table.name, Space(comm, mesh, 1), Laplacian(coefficient), supports, loads, frame, **motion)


def _elasticity(table: BodyTable, material: Elastic, space: Space) -> Elasticity | Regions:
    """Hooke's law of the whole body, or of each region; ValueError where cells have no law or two. Collective."""

    def law(moduli: Elastic | RegionTable) -> Elasticity:
        assert moduli.E is not None
        assert moduli.nu is not None
        return Elasticity(moduli.E, moduli.nu, material.state, material.formulation == "mixed")

    if not material.regions:
        return law(material)
    known, laws = space.piece.regions, np.zeros(len(space.piece.cells), dtype=np.int64)
    for name in material.regions:
        laws[known[name]] += 1
    none, two = space.comm.allreduce(np.array([np.sum(laws == 0), np.sum(laws > 1)]))
    if two:
        raise ValueError(f"body {table.name!r}: material.regions: {two} cells are in two of them")
    if none and material.E is None:
        raise ValueError(
            f"body {table.name!r}: material.regions: {none} cells are in none of {', '.join(material.regions)}: "
            "E and nu must be given for them"
        )
    parts = [(law(moduli), known[name]) for name, moduli in material.regions.items()]
    return Regions([*parts, (law(material), np.flatnonzero(laws == 0))] if none else parts)


def _wall_class() -> type[Body]:
    from fem.wall import Wall  # compiled kernels: only where a beam touches a solid

    return Wall


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

        parameters = dict(source.model_extra or {})
        if isinstance(parameters.get("centreline"), str):
            parameters["centreline"] = str(folder / parameters["centreline"])
        return generate(source.shape, **parameters)
    except ValueError as error:
        raise ValueError(f"body {table.name!r}: mesh: {error}") from None


def _load_value(table: BodyTable, load: LoadTable, components: int) -> Any:
    """A load's value, where it has as many entries as it acts in directions."""
    wanted = 1 if load.kind == "pressure" else components
    given = len(load.value) if isinstance(load.value, list) else 1
    if not callable(load.value) and given != wanted:
        raise ValueError(f"body {table.name!r}: {load.kind} load: value = {load.value!r}: must have {wanted} entries")
    return load.value


def _support(table: BodyTable, support: SupportTable, components: int) -> Support | Foundation:
    if support.stiffness is None:
        return Support(support.tag, _component(table, support.component, components), field(support.value))
    if support.component == "normal":
        return Foundation(support.tag, support.stiffness, "normal")
    return Foundation(support.tag, support.stiffness, _component(table, support.component, components))


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


def _pairs(table: ContactTable, bodies: dict[str, Any], walls: dict[str, dict[str, Any]], folder: Path) -> list[Pair]:
    body = bodies[table.body]
    if table.tag is None:  # a beam's
        from contact.scene.build_devices import device_contact

        _check_dimensions(table, 3)
        if isinstance(table.surface, BodySurfaceTable):
            surface = walls[table.surface.body][table.surface.tag]
        else:
            surface = surface_of(table.surface, folder)
        return [device_contact(table, body, surface) for _ in range(table.copies)]
    if isinstance(table.surface, BodySurfaceTable):
        return [_between(table, table.tag, table.surface, bodies) for _ in range(table.copies)]
    points = {"nodal": nodal, "mortar": mortar}[table.constraint](body, table.tag)
    _check_dimensions(table, body.frame.shape[1])
    return [_pair(table, points, bodies, folder) for _ in range(table.copies)]


def _pair(table: ContactTable, points: ContactPoints, bodies: dict[str, Body], folder: Path) -> Pair:
    if isinstance(table.surface, BodyPointTable):
        others = nodal(bodies[table.surface.body], table.surface.tag)
        return PointToPoint(table.name, points, others, np.array(table.surface.normal), table.interference)
    obstacle = surface_of(table.surface, folder)
    if table.sliding == "finite":
        return FiniteSliding(table.name, points, obstacle, table.interference)
    direction = None if table.direction is None else np.array(table.direction)
    return SmallSliding(table.name, points, obstacle, direction, table.interference)


def _between(table: ContactTable, tag: str, surface: BodySurfaceTable, bodies: dict[str, Body]) -> Pair:
    """The contact of two bodies' facets."""
    from contact.mortar.facets import Facets
    from contact.mortar.mortar_contact import (  # compiled kernels: only where bodies touch each other
        MortarContact,
        sides,
    )

    both = sides(Facets(bodies[table.body], tag), Facets(bodies[surface.body], surface.tag), table.side)
    finite = table.sliding == "finite"
    return MortarContact(table.name, *both, table.multiplier, finite, table.interference, field(table.clearance))


def _check_dimensions(table: ContactTable, D: int) -> None:
    vectors = {"direction": table.direction}
    for key in ("point", "normal", "centre", "origin", "axis"):
        vectors[f"surface.{key}"] = getattr(table.surface, key, None)
    for key, vector in vectors.items():
        if isinstance(vector, list) and len(vector) != D:
            raise ValueError(f"contact {table.name!r}: {key} = {vector}: must have {D} coordinates")
        if isinstance(vector, list) and key in ("direction", "surface.normal", "surface.axis") and not np.any(vector):
            raise ValueError(f"contact {table.name!r}: {key} = {vector}: must not be zero")
