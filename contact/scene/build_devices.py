"""From a scene's beam to the body: sections, rest shape, where it starts, supports, loads and mass."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from contact.devices.device_contact import DeviceContact
from contact.scene.devices import (
    FREEDOMS,
    ArcTable,
    BeamLoadTable,
    BeamSupportTable,
    BeamTable,
    HelixTable,
    LinesTable,
    PolylineTable,
    SectionTable,
)
from contact.scene.expression import Expression
from contact.scene.schema import ContactTable
from contact.scene.surfaces import BodySurfaceTable
from contact.solvers.problem import InfeasibleError
from fem.beams.beam import Beam
from fem.beams.beam_element import beam_data
from fem.beams.beam_parts import BeamInertia, BeamLoads, Drive
from fem.beams.beam_sections import Profile, Section, Stiffness
from fem.rotations import exp, log
from meshes import centrelines
from meshes.centrelines import Centreline

Floats = NDArray[np.float64]
Load = Callable[[float], Floats]
Numbers = Callable[[float], list[float]]


def beam_of(table: BeamTable, dynamic: bool, folder: Path) -> Beam:
    """The beam of a scene's table.

    Raises
    ------
    ValueError
        One line that names what cannot be built and what is allowed.
    """
    if not dynamic and (any(table.rayleigh) or any(table.velocity)):
        raise ValueError(
            f"body {table.name!r}: rayleigh, velocity: a scene in statics has none; "
            "set time.integrator, or leave them out"
        )
    try:
        rest = centrelines.join([_shape(section, folder) for section in table.sections])
        profiles = [_profile(section) for section in table.sections]
        start = _placed(table, rest)
        data = beam_data(rest, profiles)
    except ValueError as error:
        raise ValueError(f"body {table.name!r}: {error}") from None
    radius = _radii(table, rest)
    line, gravity, points = _loads(table, rest, profiles, dynamic)
    return Beam(
        table.name,
        start.points,
        start.frames,
        data,
        radius,
        [_drive(table, support, rest, start) for support in table.supports],
        BeamLoads(line, gravity, points),
        _inertia(table, rest, profiles) if dynamic else None,
    )


def _shape(section: SectionTable, folder: Path) -> Centreline:
    shape, length, elements = section.shape, section.length or 0.0, section.elements
    if isinstance(shape, LinesTable):
        return centrelines.polyline(centrelines.read_lines(folder / shape.file).points, elements)
    if isinstance(shape, ArcTable):
        return centrelines.arc(length, elements, shape.radius, shape.plane)
    if isinstance(shape, HelixTable):
        return centrelines.helix(length, elements, shape.radius, shape.pitch, shape.plane)
    if isinstance(shape, PolylineTable):
        return centrelines.polyline(np.array(shape.points), elements)
    return centrelines.straight(length, elements)


def _profile(section: SectionTable) -> Profile:
    if section.E is None:
        assert section.EA and section.GJ and section.EI
        return Stiffness(section.EA, section.GJ, section.EI, section.mass, section.inertia)
    return Section(
        section.E,
        section.radius,
        section.inner_radius,
        section.nu,
        section.G,
        section.density,
        section.end_radius,
        section.shear,
    )


def _placed(table: BeamTable, rest: Centreline) -> Centreline:
    place = table.placement
    if place.path is not None:
        return centrelines.along(np.array(place.path), rest.arc - rest.arc[0], place.roll)
    if place.straight:
        # Bent straight, but not twisted: its frames turn about the tangent as those of the rest shape do.
        turns = log(np.swapaxes(rest.frames[:-1], 1, 2) @ rest.frames[1:])[:, 0]
        roll = np.outer(np.append(0.0, np.cumsum(turns)), [1.0, 0.0, 0.0])
        line = np.outer(rest.arc - rest.arc[0], [1.0, 0.0, 0.0])
        return Centreline(line, exp(roll), rest.arc, rest.section).placed(place.start, place.direction, place.roll)
    return rest.placed(place.start, place.direction, place.roll)


def _radii(table: BeamTable, rest: Centreline) -> Floats:
    """Outer radius in the middle of each element [m]."""
    first = np.array([section.radius for section in table.sections])[rest.section]
    last = np.array([section.end_radius or section.radius for section in table.sections])[rest.section]
    radius: Floats = first + (last - first) * rest.relative()
    return radius


def _node(table: BeamTable, at: Any, rest: Centreline) -> int:
    arc = rest.arc - rest.arc[0]
    place = {"start": 0.0, "end": arc[-1]}.get(at, at)
    if place > arc[-1] * (1 + 1e-9):
        raise ValueError(f"body {table.name!r}: at = {at}: must be start, end or up to its length {arc[-1]:.6g}")
    return int(np.argmin(np.abs(arc - place)))


def _drive(table: BeamTable, support: BeamSupportTable, rest: Centreline, start: Centreline) -> Drive:
    node = _node(table, support.at, rest)
    tangent = start.frames[node][:, 0]
    parts: list[tuple[int, Numbers]] = []  # only what the support names is evaluated, in every step
    for first, along, vector in ((0, support.push, support.displacement), (3, support.twist, support.rotation)):
        if vector:
            parts.append((first, _numbers(vector)))
        if along:
            parts.append((first, _along(_numbers([along]), tangent.tolist())))

    def motion(t: float) -> Floats:
        """The sum of the parts; plain numbers, as a few of them cost more as arrays."""
        value = [0.0] * 6
        for first, numbers in parts:
            for k, number in enumerate(numbers(t), first):
                value[k] += number
        return np.array(value)

    components = tuple(sorted(FREEDOMS.index(freedom) for freedom in set(support.hold)))
    return Drive(node, components, motion if parts else None)


def _loads(
    table: BeamTable, rest: Centreline, profiles: list[Profile], dynamic: bool
) -> tuple[Load | None, Load | None, list[tuple[int, Load]]]:
    """Line loads, gravity where a mass matrix takes it, and point loads."""
    lines: list[Load] = []
    weights: list[Load] = []
    points = []
    relative = rest.relative()
    mass = np.array([profiles[s].at(relative[[i]]).mass[0] for i, s in enumerate(rest.section)])
    for load in table.loads:
        value = _function(load.value)
        if load.kind == "point":
            points.append((_node(table, load.at, rest), _point(load)))
        elif load.kind == "gravity":
            if not mass.any():
                raise ValueError(f"body {table.name!r}: gravity: needs a density or mass")
            if dynamic:
                weights.append(value)
            else:
                lines.append(lambda t, value=value: mass[:, None] * value(t))  # type: ignore[misc]
        else:
            lines.append(lambda t, value=value: np.tile(value(t), (len(mass), 1)))  # type: ignore[misc]
    return _sum(lines), _sum(weights), points


def _sum(loads: list[Load]) -> Load | None:
    if len(loads) < 2:
        return loads[0] if loads else None
    return lambda t: np.sum([load(t) for load in loads], axis=0)


def _point(load: BeamLoadTable) -> Callable[[float], Floats]:
    force, moment = _function(load.value), _function(load.moment or [0.0] * 3)
    return lambda t: np.concatenate([force(t), moment(t)])


def _inertia(table: BeamTable, rest: Centreline, profiles: list[Profile]) -> BeamInertia:
    """Half of each element's mass and rotary inertia at its ends, or its consistent mass."""
    relative, length = rest.relative(), np.diff(rest.arc)
    sections = [profiles[s].at(relative[[i]]) for i, s in enumerate(rest.section)]
    mass = length * np.array([section.mass[0] for section in sections])
    if not mass.all():
        raise ValueError(f"body {table.name!r}: an integrator in time needs a density or mass in every section")
    rotary = np.array([[s.polar[0], s.I2[0], s.I3[0]] for s in sections]) * length[:, None]
    # The rotation of an element's half about its node keeps A regular where a section has no rotary inertia of its own.
    rotary += np.outer(mass * length**2 / 105, [0.0, 1.0, 1.0])
    own, shared = (1 / 3, 1 / 6) if table.mass == "consistent" else (1 / 2, 0.0)
    nodes, turning = np.zeros(len(length) + 1), np.zeros((len(length) + 1, 3))
    for part in (slice(None, -1), slice(1, None)):
        nodes[part] += own * mass
        turning[part] += rotary / 2
    a, b = table.rayleigh
    x, y, z = table.velocity
    return BeamInertia(nodes, shared * mass, turning, (a, b), (x, y, z))


def _numbers(values: list[Any]) -> Numbers:
    """Numbers, expressions in t or functions of t as one function of t."""
    parts = [
        Expression(value).at if isinstance(value, str) else value if callable(value) else lambda t, value=value: value
        for value in values
    ]
    return lambda t: [float(part(t)) for part in parts]


def _along(numbers: Numbers, direction: list[float]) -> Numbers:
    """A number times a vector, as a function of t."""

    def function(t: float) -> list[float]:
        (number,) = numbers(t)
        return [number * component for component in direction]

    return function


def _function(values: list[Any]) -> Callable[[float], Floats]:
    """`_numbers` as an array."""
    if all(isinstance(value, int | float) for value in values):
        fixed = np.array(values, dtype=float)
        return lambda t: fixed
    numbers = _numbers(values)
    return lambda t: np.array(numbers(t))


def device_contact(table: ContactTable, body: Beam, surface: Any) -> DeviceContact:
    """The contact of a beam, sampled so often per element or at a spacing along its length.

    Raises
    ------
    InfeasibleError
        for a beam that is wider than what the surface leaves, where that is known.
    """
    arc, elements = np.append(0.0, np.cumsum(body.data.length)), len(body.data.length)
    if table.spacing is None:
        each = np.linspace(0.0, elements, (table.samples or 2) * elements + 1)
        places = np.interp(each, np.arange(elements + 1), arc)
    else:
        places = np.linspace(0.0, arc[-1], max(round(arc[-1] / table.spacing), 1) + 1)
    if isinstance(table.surface, BodySurfaceTable):
        from contact.devices.wall_contact import WallContact

        return WallContact(table.name, body, surface, places, table.interference)
    contact = DeviceContact(table.name, body, surface, places, table.interference)
    radius, room = float(contact.radius.max()), float(getattr(surface, "inradius", np.inf))
    if radius > room:
        raise InfeasibleError(f"contact {table.name!r}: a beam of radius {radius:.9g} m does not fit into {room:.9g} m")
    return contact
