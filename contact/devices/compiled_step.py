"""Steps of one device in one rigid vessel by one compiled call each: `step_kernel.advance`, for Python.

Compiling it takes forty seconds, once an installation; a step then takes two fifths of the time. Scenes ask for it by
`compiled = true` under `[solver]`.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from contact.certificate import Certificate, Tolerances
from contact.delassus import DirectDelassus
from contact.devices import step_kernel as kernel
from contact.devices import step_parts as parts
from contact.devices.device_contact import DeviceContact
from contact.devices.element_rows import ElementRows
from contact.linearisation import BodyMatrices, Linearisation
from contact.pairs import Constraints
from contact.rows import Rows
from contact.solvers import Method
from contact.solvers.problem import ContactProblem
from contact.step import StepResult, step
from contact.surfaces.convolution import ConvolutionSurface
from contact.system import System
from fem.beams.beam import Beam
from fem.beams.beam_element import BeamData, least_force
from fem.beams.beam_parts import BeamInertia, Motion
from fem.beams.chain import Chain
from fem.body import Body
from fem.integrators import Integrator

Floats = NDArray[np.float64]


def suits(system: System) -> bool:
    """Whether the system is one beam with inertia and no line load in one rigid convolution surface."""
    if not (len(system.bodies) == len(system.pairs) == 1):
        return False
    body: Any = system.bodies[0]
    pair: Any = system.pairs[0]
    return (
        type(body) is Beam
        and type(body.matrix) is Chain
        and body.inertia is not None
        and body.loads.line is None
        and type(pair) is DeviceContact
        and isinstance(pair.surface, ConvolutionSurface)
    )


def plain(value: Any) -> Any:
    """A tuple without its name, nor those of the tuples in it."""
    return tuple(map(plain, value)) if isinstance(value, tuple) else value


class CompiledStep:
    """`contact.step.step` for a system that it `suits` and the status method.

    A step that the compiled one gives up is taken by `step`, as is one without forces `start` to begin with: the first
    of a run. `given_up` counts those given up by the reasons of `step_kernel`.
    """

    def __init__(self, system: System) -> None:
        if not suits(system):
            raise ValueError(
                "solver.compiled = true: is for scenes of one beam with a density and no line load in one contact with "
                "vessels, without options -free_…; compiled = false takes any"
            )
        body: Any = system.bodies[0]
        pair: Any = system.pairs[0]
        self._body = body
        self._pair: DeviceContact = pair
        self._inertia: BeamInertia = body.inertia
        self.given_up: dict[int, int] = {}
        data, inertia, surface = body.data, body.inertia, pair.surface
        self._wall = plain(parts.Wall(surface.net, surface.kind, surface.data, surface.sign))
        device = parts.Device(
            data, inertia.nodes, inertia.links, inertia.rotary, body.fixed, body.unit,
            pair.elements, pair.first, pair.xi, pair.radius, pair.margin, pair.close_by,
            body.reach, system.size, pair.length,
        )  # fmt: skip
        self._device = plain(device)
        moving = [drive for drive in body.drives if drive.motion is not None]
        self._motions = [drive.motion for drive in moving]
        nodes = np.array([drive.node for drive in moving], dtype=np.int64)
        held = np.array([np.isin(np.arange(6), drive.components) for drive in moving], dtype=bool)
        self._drives = plain(parts.Drives(nodes, held.reshape(-1, 6), body.start[nodes], body.start_frames[nodes]))
        self._schemes: dict[float, tuple[Integrator, parts.Scheme]] = {}

    def __call__(
        self,
        system: System,
        t: float,
        dt: float,
        method: str | Method,
        start: Floats | None,
        tolerances: Tolerances,
        max_passes: int,
    ) -> StepResult:
        """Advance the system by dt to time t with contact; see `contact.step.step`."""
        found = None if start is None else self._advance(system, t, dt, start, tolerances, max_passes)
        return found or step(system, t, dt, method, start, tolerances, max_passes)

    def _advance(
        self, system: System, t: float, dt: float, start: Floats, limits: Tolerances, max_passes: int
    ) -> StepResult | None:
        body, pair = self._body, self._pair
        integrator, scheme = self._scheme(system, dt)
        load, _ = body.loads.at(t, body.data.length, self._inertia.weights)
        motion = np.array([follow(t) for follow in self._motions]).reshape(-1, 6)
        seconds = np.zeros(5)
        wanted = np.array([limits.complementarity, limits.equilibrium, limits.surface_error, limits.penetration])
        counts, residuals, state, inertial, sight, foot, looked, planes, forces, last, blocks, rest = kernel.advance(
            self._wall, self._device, self._drives, tuple(scheme), tuple(body.state()),
            (*pair.sight(), tuple(pair.foot)), pair.accepted, pair.clear, motion, load.ravel(), start, wanted,
            system.precision, max_passes, seconds,
        )  # fmt: skip
        verdict, passes, iterations, shown = counts
        system.clock.share(seconds.tolist())
        if verdict != kernel.SETTLED:
            self.given_up[verdict] = self.given_up.get(verdict, 0) + 1
            return None
        damped = BeamData(body.data.length, rest[0], rest[1], scheme.axial, scheme.bending)
        body.adopt(integrator, load.ravel(), Motion(*state), *inertial, damped, blocks, shown)
        pair.adopt(sight, foot, *looked)
        offset, normals, every, free, movable, met, near = planes
        H, free = ElementRows(every, pair.first, body.space.size), ElementRows(free, pair.first, body.space.size)
        part = Constraints({body: H}, offset, normals, pair.places, pair.areas, pair.length)
        lin = Linearisation([part], {body: H}, {body: free}, offset, movable, met, near, None, system.clock)
        system.adopt(lin)
        lam, gap = forces
        rows, own, W, q, departures = last
        columns: dict[Body, Rows] = {body: ElementRows(own, pair.first[rows], body.space.size)}
        problem = ContactProblem(DirectDelassus(columns, W), q, primal=BodyMatrices(columns))
        details = {"columns": float(len(rows)), "departures": float(departures)} if len(rows) else {}
        return StepResult(lam, gap, lin, problem, rows, Certificate(*residuals.tolist()), passes, iterations, details)

    def _scheme(self, system: System, dt: float) -> tuple[Integrator, parts.Scheme]:
        """The integrator for steps of length dt, and its factors."""
        if dt not in self._schemes:
            integrator = system.integrator(dt)
            a, b = self._inertia.rayleigh
            data, rate = self._body.data, b * integrator.damping
            factors = integrator.inertia + a * integrator.damping, integrator.damping, rate
            stiffness, least = ((1 + rate) * data.axial, (1 + rate) * data.bending), (1 + rate) * least_force(data)
            self._schemes = {dt: (integrator, parts.Scheme(*factors, *stiffness, least))}
        return self._schemes[dt]
