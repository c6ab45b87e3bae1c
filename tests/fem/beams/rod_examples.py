"""A uniform rod and its steps, for tests of beams as bodies."""

from __future__ import annotations

import numpy as np

from fem.beams.beam import Beam
from fem.beams.beam_element import beam_data
from fem.beams.beam_parts import BeamInertia
from fem.beams.beam_sections import Stiffness
from fem.integrators import Static
from meshes.centrelines import straight

EA, GJ, EI, MASS = 3e3, 1.2, 2.0, 0.5  # MASS per length
G = np.array([0.0, -9.81, 0.0])


def inertia_of(length, consistent=False, rayleigh=(0.0, 0.0), velocity=(0.0, 0.0, 0.0)):
    """Mass and a small rotary inertia of a uniform beam with elements of the lengths given."""
    own, shared = (1 / 3, 1 / 6) if consistent else (1 / 2, 0.0)
    nodes, rotary = np.zeros(len(length) + 1), np.zeros((len(length) + 1, 3))
    for part in (slice(None, -1), slice(1, None)):
        nodes[part] += own * MASS * length
        rotary[part] += (MASS * length**3 / 210)[:, None]
    return BeamInertia(nodes, shared * MASS * length, rotary, rayleigh, velocity)


def beam(line=None, drives=(), loads=None, dynamic=None, radius=1e-2):
    """A beam in its rest shape; `dynamic` are the options of its inertia."""
    line = line or straight(1.0, 8)
    data = beam_data(line, [Stiffness(EA, GJ, EI, MASS)])
    inertia = None if dynamic is None else inertia_of(data.length, **dynamic)
    radii = np.full(len(data.length), radius)
    return Beam("rod", line.points, line.frames, data, radii, drives, loads, inertia)


def balance(body, t=1.0, integrator=None, passes=60):
    """One step to time t by Newton's method to the default tolerance, and two passes more to round-off."""
    nothing, left = np.zeros(body.space.size), 2
    body.begin(t, integrator or Static())
    for _ in range(passes):
        body.assemble()
        body.factor()
        body.free_motion()
        body.correct(nothing)
        body.renew()
        left -= body.imbalance(nothing) <= 1e-8
        if left < 0:
            body.accept()
            return
    raise AssertionError(f"no equilibrium: {body.imbalance(nothing)}")


def dense(matrix):
    """A PETSc matrix as an array."""
    every = np.arange(matrix.getSize()[0], dtype=np.int32)
    return matrix.getValues(every, every)
