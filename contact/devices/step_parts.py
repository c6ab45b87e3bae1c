"""What a compiled step of a device consists of: its data as tuples, and its parts between the kernels of each.

Oracles are what the docstrings name.
"""

from __future__ import annotations

import time
from typing import Any, NamedTuple

import numpy as np
from numba import njit, types
from numpy.typing import NDArray

from contact.certificate import LOADED, ROUNDING
from contact.devices import device_kernels
from contact.devices.row_kernels import without
from contact.linearisation import REACH
from contact.solvers import kernels as active_sets
from contact.solvers.columns import EPSILON, PIVOT
from contact.solvers.problem import SOLVED
from contact.solvers.warm import BLOCKS
from contact.surfaces.convolution import FOLLOWED, SOUGHT
from contact.surfaces.implicit import Foot
from contact.surfaces.surface_kernels import Network, lower_bounds, potentials
from contact.surfaces.surface_newton import beside, closest, outward
from contact.surfaces.surface_roots import roots
from fem.beams import beam_kernels, frame_kernels, nodal_kernels
from fem.beams.beam_element import BeamData
from fem.beams.beam_parts import Motion

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]
Bools = NDArray[np.bool_]

_clock_gettime: Any = types.ExternalFunction("clock_gettime", types.int32(types.int32, types.intp))
_MONOTONIC = time.CLOCK_MONOTONIC


class Wall(NamedTuple):
    """A `ConvolutionSurface`: index, primitives, and the side that is allowed."""

    net: Network
    kind: Ints
    data: Floats
    sign: float


class Device(NamedTuple):
    """What does not change of a beam and its contact: as in `BeamData`, `BeamInertia`, `Beam` and `DeviceContact`."""

    rest: BeamData
    nodes: Floats
    links: Floats
    rotary: Floats
    fixed: Bools
    unit: Floats
    element: Ints
    first: Ints
    xi: Floats
    radius: Floats
    margin: Floats
    close: Floats
    reach: float
    size: float
    thick: float


class Drives(NamedTuple):
    """Nodes with a prescribed motion (k), which unknowns of them (k, 6), and where and how they stood at the start."""

    node: Ints
    held: Bools
    x: Floats
    R: Floats


class Sight(NamedTuple):
    """What a `DeviceContact` knows of its points."""

    known: Floats
    seen: Floats
    drift: Floats
    followed: Bools
    foot: Foot


class Planes(NamedTuple):
    """Tangent planes at the candidates: see `device_kernels.planes`; `rows` are zero at prescribed unknowns."""

    offset: Floats
    normals: Floats
    every: Floats
    rows: Floats


class Scheme(NamedTuple):
    """The factors of M and B in A, and of the rate of strain in the stress; damped stiffness; the least force [N]."""

    inertia: float
    damping: float
    rate: float
    axial: Floats
    bending: Floats
    least: float


@njit(cache=True)
def charge(seconds: Floats, stamp: Ints, phase: int) -> None:
    """Add the time since the last call to a phase."""
    before = stamp[0] + 1e-9 * stamp[1]
    _clock_gettime(_MONOTONIC, stamp.ctypes.data)
    seconds[phase] += stamp[0] + 1e-9 * stamp[1] - before


@njit(cache=True, error_model="numpy")
def predicted(device: Device, drives: Drives, start: Motion, motion: Floats, damping: float) -> Floats:
    """Increments (N, 6) to where velocities and the prescribed `motion` since the start (k, 6) lead."""
    d = np.empty((len(start.x), 6))
    for i in range(len(d)):
        for k in range(3):
            d[i, k] = 0.0 if device.fixed[6 * i + k] else start.v[i, k] / damping
            d[i, 3 + k] = 0.0 if device.fixed[6 * i + 3 + k] else start.w[i, k] / damping
    for j in range(len(motion)):
        i = drives.node[j]
        turn = frame_kernels.turn_to(start.R[i : i + 1], drives.R[j : j + 1], motion[j, 3:])
        for k in range(3):
            if drives.held[j, k]:
                d[i, k] = drives.x[j, k] + motion[j, k] - start.x[i, k]
            if drives.held[j, 3 + k]:
                d[i, 3 + k] = turn[k]
    return d


# --- detection --------------------------------------------------------------------------------------------------------


@njit(cache=True, error_model="numpy")
def _doubted(distance: Floats, bound: Floats) -> Ints:
    """Feet that are nearer than any can be or on the other side: see `ConvolutionSurface.nearest`."""
    doubted = np.empty(len(bound), dtype=np.bool_)
    for j in range(len(bound)):
        doubted[j] = not abs(distance[j]) >= abs(bound[j]) * (1 - 1e-6) or distance[j] * bound[j] < 0.0
    return np.flatnonzero(doubted)


@njit(cache=True, error_model="numpy")
def look(wall: Wall, device: Device, sight: Sight, at: Floats, chosen: Bools, reach: Floats) -> bool:
    """`DeviceContact._look`; False where no start leads to a foot."""
    rows, anew = device_kernels.split(chosen, sight.followed)
    slack, far = 1e-9 * device.thick, 4.0 * device.thick
    if len(rows):
        x, guess = device_kernels.moved_along(rows, at, sight.seen, sight.foot)
        found = closest(wall.net, x, guess, wall.sign, FOLLOWED)
        lost = rows[
            device_kernels.settle(
                rows, x, found, device.radius, sight.foot, sight.known, sight.seen, sight.followed, sight.drift,
                slack, far,
            )
        ]  # fmt: skip
        if len(lost):
            for i in lost:
                sight.followed[i] = False
            anew = np.concatenate((lost, anew))
    if not len(anew):
        return True
    x = at[anew]
    bound = wall.sign * lower_bounds(wall.net, x)
    near = np.empty(len(anew), dtype=np.bool_)
    for j in range(len(anew)):
        i = anew[j]
        sight.known[i], sight.drift[i] = bound[j] - device.radius[i], 0.0
        sight.seen[i] = at[i]
        near[j] = sight.known[i] <= reach[i]
    rows, x, bound = anew[near], x[near], bound[near]
    if not len(rows):
        return True
    found = closest(wall.net, x, outward(wall.net, x), wall.sign, SOUGHT)
    lost = _doubted(found[0], bound)
    if len(lost):
        other = closest(wall.net, x[lost], beside(wall.kind, wall.data, x[lost]), wall.sign, 200)
        if len(_doubted(other[0], bound[lost])):
            return False
        for j in range(len(lost)):
            i = lost[j]
            found[0][i], found[1][i], found[2][i], found[3][i] = other[0][j], other[1][j], other[2][j], other[3][j]
    device_kernels.settle(
        rows, x, found, device.radius, sight.foot, sight.known, sight.seen, sight.followed, sight.drift, slack, far
    )
    return True


@njit(cache=True, error_model="numpy")
def first_met(wall: Wall, device: Device, sight: Sight, accepted: Floats, end: Floats, rows: Ints) -> None:
    """`DeviceContact._first_met`."""
    s = roots(wall.net, accepted[rows], end[rows], wall.sign, 1e-3 * device.thick)
    point = np.empty((1, 3))
    for j in range(len(rows)):
        i = rows[j]
        if s[j] > 0.0:
            for k in range(3):
                point[0, k] = accepted[i, k] + s[j] * (end[i, k] - accepted[i, k])
            F = potentials(wall.net, point)[0]
            size = np.sqrt(F[1] ** 2 + F[2] ** 2 + F[3] ** 2)
            for k in range(3):
                sight.foot.point[i, k] = point[0, k]
                sight.foot.normal[i, k] = wall.sign * F[1 + k] / size


@njit(cache=True, error_model="numpy")
def bounds(sight: Sight, at: Floats) -> Floats:
    """What gaps are at least."""
    bounds: Floats = device_kernels.bounds(sight.known, at, sight.seen, sight.drift)
    return bounds


@njit(cache=True, error_model="numpy")
def planes_at(device: Device, sight: Sight, candidates: Bools, at: Floats, R: Floats) -> Planes:
    """The planes of `DeviceContact.detect` at places `at`, with rows for frames R."""
    offset, normals, every = device_kernels.planes(
        candidates, at, sight.foot, device.radius, R, device.element, device.xi, device.rest.length
    )
    return Planes(offset, normals, every, without(every, device.first, ~device.fixed))


@njit(cache=True, error_model="numpy")
def narrowed(chosen: Bools, lam: Floats, gaps: Floats) -> None:
    """`Linearisation.narrow`."""
    change = 0.0
    for i in range(len(gaps)):
        if chosen[i] and (lam[i] > 0.0 or gaps[i] < 0.0):
            change = max(change, abs(gaps[i]))
    for i in range(len(gaps)):
        chosen[i] = chosen[i] and (lam[i] > 0.0 or gaps[i] <= REACH * change)


@njit(cache=True, error_model="numpy")
def covered(planes: Planes, movable: Bools, rows: Ints) -> bool:
    """`Linearisation.covered` by a problem with these rows."""
    inside = np.zeros(len(movable), dtype=np.bool_)
    inside[rows] = True
    for i in range(len(movable)):
        met = movable[i] and np.isfinite(planes.offset[i])
        if (inside[i] and not met) or (met and planes.offset[i] < 0.0 and not inside[i]):
            return False
    return True


@njit(cache=True, error_model="numpy")
def driven_in(gap: Floats, movable: Bools, depth: float) -> bool:
    """Whether `System.driven_into` finds a point."""
    return bool((~movable & (gap < -depth)).any())


# --- forces -----------------------------------------------------------------------------------------------------------


@njit(cache=True, error_model="numpy")
def balance(
    device: Device, scheme: Scheme, data: BeamData, start: Motion, R: Floats, edges: Floats, moved: Floats,
    turned: Floats, J: Floats,
) -> Floats:  # fmt: skip
    """Internal and inertia forces (6 N) of nodes that have `moved` and `turned` since the start, (N, 3)."""
    f = beam_kernels.assemble_forces(edges, R, data)
    nodal_kernels.add_inertia_forces(
        f, moved, turned, start.v, start.w, device.nodes, device.links, J, scheme.inertia, scheme.damping
    )
    return f.reshape(-1)


@njit(cache=True, error_model="numpy")
def status(
    W: Floats, q: Floats, start: Floats, order: Ints, U: Floats, state: Ints, tolerance: float
) -> tuple[Floats, Floats, bool]:
    """λ and δ as `contact.solvers.warm.solve` finds them, and whether it does."""
    c = len(q)
    lam, delta = np.zeros(c), q.copy()
    state[1:] = -1, 0, 0
    if not c:
        return lam, delta, True
    verdict = active_sets.block_steps(W, q, start, lam, delta, order, U, state, tolerance, PIVOT, BLOCKS)
    if verdict == active_sets.GUESS:
        active, peak = np.zeros(c, dtype=np.int64), np.zeros(c)
        active[order[: state[0]]] = 1
        for i in range(c):
            peak[i] = np.abs(W[i]).max()
        verdict = active_sets.ratio_tested(
            W, np.arange(c), q, lam, delta, order, U, active, peak, state, tolerance, PIVOT, 4.0 * EPSILON, 100 + 20 * c
        )
        length, left = 0.0, 0.0
        for i in range(c):
            length = max(length, -q[i], abs(delta[i] - q[i]))
            left = max(left, abs(min(W[i, i] * lam[i], delta[i])))
        if not left <= SOLVED * length:
            return lam, delta, False
    return lam, delta, verdict == active_sets.DONE


@njit(cache=True, error_model="numpy")
def complementarity(
    device: Device, W: Floats, q: Floats, rows: Ints, lam: Floats, gap: Floats, movable: Bools
) -> tuple[float, float, float]:
    """Complementarity, surface error and penetration as `contact.certificate.certify` has them."""
    lowest = deepest = least = moved = most = surface = 0.0
    for i in range(len(gap)):
        deepest = min(deepest, gap[i])
        if movable[i]:
            lowest = min(lowest, gap[i])
    for j in range(len(rows)):
        i = rows[j]
        least = min(least, q[j])
        if lam[i] != 0.0:
            moved, most = max(moved, abs(gap[i] - q[j])), max(most, abs(lam[i]))
    length = max(-lowest, -least, moved, ROUNDING * device.size)
    error = -lowest
    for j in range(len(rows)):
        i = rows[j]
        if lam[i] != 0.0:
            pull = max(W[j, j], length / most) * lam[i]
            error = max(error, abs(min(pull, gap[i])))
            if abs(pull) > LOADED * length:
                surface = max(surface, abs(gap[i]) / device.thick)
    return error / length, surface, -deepest / device.thick
