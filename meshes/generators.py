"""The shapes that a scene can name."""

from __future__ import annotations

import inspect
from collections.abc import Callable, Mapping, Sequence
from functools import partial
from typing import Any

import numpy as np

from meshes.aneurysm import aneurysm_wall
from meshes.bifurcation import bifurcation_wall
from meshes.blocks import box, domed_block, layer
from meshes.devices import balloon, blunt_tip, catheter
from meshes.mesh import Mesh
from meshes.parameters import bad, vector
from meshes.planar import disc, half_disc, ring, shell_section, sphere_section
from meshes.refine import Refine
from meshes.solids import half_ellipsoid, hollow_cylinder, shell_octant, sphere_octant
from meshes.structured import interval
from meshes.walls import tube_wall, vessel_wall

__all__ = [
    "GENERATORS",
    "Refine",
    "aneurysm_wall",
    "balloon",
    "bifurcation_wall",
    "blunt_tip",
    "box",
    "catheter",
    "disc",
    "domed_block",
    "generate",
    "half_disc",
    "half_ellipsoid",
    "hollow_cylinder",
    "interval",
    "layer",
    "ring",
    "shell_octant",
    "shell_section",
    "sphere_octant",
    "sphere_section",
    "tube_wall",
    "vessel_wall",
]

GENERATORS: dict[str, Callable[..., Mesh]] = {
    function.__name__.replace("_", "-"): function
    for function in (
        interval,
        box,
        domed_block,
        layer,
        half_disc,
        disc,
        ring,
        hollow_cylinder,
        half_ellipsoid,
        sphere_octant,
        sphere_section,
        shell_section,
        shell_octant,
        tube_wall,
        vessel_wall,
        bifurcation_wall,
        aneurysm_wall,
        catheter,
        balloon,
        blunt_tip,
    )
}


def placed(mesh: Mesh, origin: Sequence[float], axis: Sequence[float] | None = None) -> Mesh:
    """The mesh moved so that its origin is at `origin` [m], in space turned by the shortest way from z to `axis`."""
    shift, turn = np.array(vector("origin", origin, (mesh.dim,))), np.eye(mesh.dim)
    if axis is not None:
        if mesh.dim != 3:
            raise bad("axis", axis, f"left out of a mesh of dimension {mesh.dim}")
        to = np.array(vector("axis", axis, (3,)))
        if not to.any():
            raise bad("axis", axis, "longer than 0")
        x, y, z = to / np.linalg.norm(to)
        v = np.array([[0.0, 0.0, x], [0.0, 0.0, y], [-x, -y, 0.0]])  # of the cross product with z × axis (Rodrigues)
        turn = np.diag([1.0, -1.0, -1.0]) if z <= -1 + 1e-15 else np.eye(3) + v + v @ v / (1 + z)
    return Mesh(shift + mesh.points @ turn.T, mesh.cells, mesh.facets, mesh.regions)


def generate(shape: str, placement: Mapping[str, Any] | None = None, **parameters: Any) -> Mesh:
    """The mesh of a shape in `GENERATORS` with its function's parameters; `refine` may be a table of those of `Refine`.

    `placement` holds what `placed` takes: where the mesh goes, and in space where its z axis points.

    Raises
    ------
    ValueError
        An unknown shape, an unknown or missing parameter, or a value that is not allowed; one line names it.
    """
    if shape not in GENERATORS:
        raise ValueError(f"shape = {shape!r}: must be one of {', '.join(GENERATORS)}")
    try:
        if isinstance(table := parameters.get("refine"), Mapping):
            parameters["refine"] = _call(Refine, "refine.", table)
        mesh = _call(GENERATORS[shape], "", parameters)
        if placement is None:
            return mesh
        if not isinstance(placement, Mapping):
            raise bad("placement", placement, "a table with origin and axis")
        return _call(partial(placed, mesh), "placement.", placement)
    except ValueError as error:
        raise ValueError(f"shape {shape!r}: {error}") from None


def _call[T](function: Callable[..., T], prefix: str, parameters: Mapping[str, Any]) -> T:
    """Call with keyword arguments; ValueError where they do not fit the signature."""
    known = inspect.signature(function).parameters
    for key, value in parameters.items():
        if key not in known:
            raise ValueError(f"{prefix}{key} = {value!r}: unknown, must be one of {', '.join(known)}")
    for key, parameter in known.items():
        if parameter.default is parameter.empty and key not in parameters:
            raise ValueError(f"{prefix}{key}: missing, must be given")
    return function(**parameters)
