"""The shapes that a scene can name."""

from __future__ import annotations

import inspect
from collections.abc import Callable, Mapping
from typing import Any

from meshes.aneurysm import aneurysm_wall
from meshes.bifurcation import bifurcation_wall
from meshes.blocks import box, domed_block, layer
from meshes.devices import balloon, blunt_tip, catheter
from meshes.mesh import Mesh
from meshes.planar import disc, half_disc, ring, shell_section, sphere_section
from meshes.refine import Refine
from meshes.solids import hollow_cylinder, shell_octant, sphere_octant
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


def generate(shape: str, **parameters: Any) -> Mesh:
    """The mesh of a shape in `GENERATORS` with its function's parameters; `refine` may be a table of those of `Refine`.

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
        return _call(GENERATORS[shape], "", parameters)
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
