"""A step of a beam with inertia in a rigid convolution surface, compiled whole.

`advance` is `contact.step.step` with all that it calls, for one body and one pair that the status method solves: they
are its oracle. It calls the same kernels, but without what Python needs between them, which is as much again. It does
what most steps need; any other is given up, and nothing that it was given is changed.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numba import njit
from numpy.typing import NDArray

from contact.devices import device_kernels
from contact.devices.device_contact import BRACE
from contact.devices.row_kernels import apply, apply_transpose, touching
from contact.devices.step_parts import (
    Device,
    Drives,
    Scheme,
    Sight,
    Wall,
    balance,
    bounds,
    charge,
    complementarity,
    covered,
    driven_in,
    first_met,
    look,
    narrowed,
    planes_at,
    predicted,
    status,
)
from contact.step import CALM, SURE
from contact.surfaces.implicit import Foot
from contact.surfaces.surface_kernels import Network
from contact.surfaces.surface_roots import roots
from fem.beams import beam_kernels, beam_points, chain_kernels, frame_kernels, nodal_kernels
from fem.beams.beam import SHIFT, TURN
from fem.beams.beam_element import BeamData
from fem.beams.beam_parts import Motion

Floats = NDArray[np.float64]

SETTLED = 0
# Why a step is given up: a long way to the prediction (or none), a singular A, a foot that needs a wider search, a
# contact problem for the other phases of the status method, a point held in the wall or behind it, too many passes.
FAR, SINGULAR, LOST, UNSOLVED, DRIVEN, CROSSED, PASSES = 1, 2, 3, 4, 5, 6, 7
MOST_TURN = 1.5  # components of a turn up to which it is its own logarithm [rad]
# Phases of `contact.clock`, in its order
ASSEMBLE, FACTOR, DETECT, DELASSUS, SOLVE = 0, 1, 2, 3, 4


@njit(cache=True, error_model="numpy")
def advance(
    wall: Any, device: Any, drives: Any, scheme: Any, start: Any, before: Any, accepted: Floats, clear: Floats,
    motion: Floats, load: Floats, force: Floats, tolerances: Floats, precision: float, max_passes: int, seconds: Floats,
) -> Any:  # fmt: skip
    """The step.

    Tuples come and go without their names, which halves what a call costs.

    Parameters
    ----------
    wall, device, drives, scheme : as the classes of `step_parts`
    start, before : the `Motion` that was reached, and `Sight` of the contact points there
    accepted, clear : where these were, (c, 3), and how far the wall is away at least, (c)
    motion : of the `drives`, since the start of the run, (k, 6)
    load : on the nodes, (6 N)
    force : λ at the start, (c)
    tolerances : of `contact.certificate.Tolerances`, (4)
    seconds : of each phase, added to

    Returns
    -------
    The verdict, passes, iterations and what the last factor has shown of A; the residuals. Where the verdict is
    SETTLED, too: the motion of the beam; increments of its positions, and J; what is known of the points, and
    their feet; candidates, places and bounds; planes, and which rows can move, are met, and are near; λ and gaps; rows,
    H, W, q and departures of the last problem; the last A with its factor; and the strains that the beam rests at.
    """
    stamp = np.zeros(2, dtype=np.int64)
    charge(np.empty(5), stamp, ASSEMBLE)
    wall = Wall(Network(*wall[0]), *wall[1:])
    device = Device(BeamData(*device[0]), *device[1:])
    drives, scheme, start = Drives(*drives), Scheme(*scheme), Motion(*start)
    known, seen, drift, followed, (distance, point, normal, curvature) = before
    foot = Foot(distance.copy(), point.copy(), normal.copy(), curvature.copy())
    sight = Sight(known.copy(), seen.copy(), drift.copy(), followed.copy(), foot)
    c, n, N = len(device.xi), len(device.fixed), len(start.x)
    lam, residual, passes, iterations, settling = force, 1.0, 0, 0, False
    residuals = np.full(4, np.inf)

    # The prediction
    d = predicted(device, drives, start, motion, scheme.damping)
    shift, turn = nodal_kernels.furthest(d)
    here = np.isfinite(d).all() and np.isfinite(load).all() and shift <= SHIFT * device.reach and turn <= MOST_TURN
    verdict = SETTLED if here else FAR
    J = nodal_kernels.spatial_inertia(start.R, device.rotary)
    stress, chord, twist = beam_kernels.rest_in_motion(start.edges, start.R, device.rest, scheme.rate)
    data = BeamData(device.rest.length, chord, twist, scheme.axial, scheme.bending)
    x, R, edges = frame_kernels.update(start.x, start.R, start.edges, d)
    moved, turned = d[:, :3].copy(), d[:, 3:].copy()
    last_edges, last_R, last_d = edges, R, d
    inner = balance(device, scheme, data, start, R, edges, moved, turned, J)
    charge(seconds, stamp, ASSEMBLE)
    at = beam_points.centreline_points(x, R, device.element, device.xi, device.rest.length)
    near = bounds(sight, at) <= device.margin
    if verdict == SETTLED and not look(wall, device, sight, at, near, device.margin):
        verdict = LOST
    candidates, meeting = sight.known <= device.margin, np.zeros(c, dtype=np.bool_)
    planes = planes_at(device, sight, candidates, at, R)
    movable = touching(planes.rows)
    contact = apply_transpose(planes.rows, device.first, lam, n)
    charge(seconds, stamp, DETECT)

    factor = chain_kernels.room(N)
    diagonal, upper, brace, gap, q = J, J, lam, lam, lam
    rows, order, state = np.empty(0, dtype=np.int64), np.empty(0, dtype=np.int64), np.zeros(4, dtype=np.int64)
    W, own, U = np.empty((0, 0)), np.empty((0, 12)), np.empty((0, 0))
    shown = chain_kernels.DEFINITE
    while verdict == SETTLED:
        # A about the present state and forces, or a cautious one where that is not definite; it is kept to settle
        if not settling:
            for cautious in range(2):
                if cautious:
                    stress, _, _ = beam_kernels.rest_in_motion(edges, R, data, 0.0)
                elif passes:
                    stress = beam_kernels.extrapolated_stress(last_edges, last_R, data, last_d)
                elements, blocks, brace = device_kernels.stiffness(
                    lam, sight.foot, BRACE if passes and not cautious else 0.0, R, device.element, device.xi,
                    device.rest.length,
                )  # fmt: skip
                diagonal, upper = beam_kernels.assemble_blocks(edges, R, data, stress)
                nodal_kernels.add_inertia(diagonal, upper, device.nodes, device.links, J, scheme.inertia)
                beam_kernels.add_element_blocks(diagonal, upper, elements, blocks)
                chain_kernels.hold(diagonal, upper, device.fixed)
                charge(seconds, stamp, ASSEMBLE)
                shown = chain_kernels.factor(diagonal, upper, factor)
                charge(seconds, stamp, FACTOR)
                if not passes or shown != chain_kernels.INDEFINITE:
                    break
        if shown >= 0:
            verdict = SINGULAR
            break

        # The free motion, with the contact forces of before, and what it could bring to the wall
        rest = (load - inner + contact).reshape(1, -1)
        u = chain_kernels.solve(factor, device.fixed, rest)[0]
        charge(seconds, stamp, FACTOR)
        if not passes:
            free_x, free_R, _ = frame_kernels.update(x, R, edges, u.reshape(-1, 6))
            free = beam_points.centreline_points(free_x, free_R, device.element, device.xi, device.rest.length)
            way = device_kernels.ways(at, free)
            new = ~candidates & (bounds(sight, at) <= way)
            if new.any():
                if not look(wall, device, sight, at, new, way):
                    verdict = LOST
                    break
                new &= sight.known <= way
                candidates |= new
                meeting |= new
                coming = np.flatnonzero(new & (sight.known > device.radius))
                if len(coming):
                    first_met(wall, device, sight, accepted, free, coming)
                planes = planes_at(device, sight, candidates, at, R)
                movable = touching(planes.rows)

        # The contact problem and its solution
        gaps = planes.offset + apply(planes.rows, device.first, u)
        if not settling:
            chosen = movable & np.isfinite(planes.offset)
            chosen &= meeting | (sight.known <= device.close) | (lam > 0.0)
            if residual <= CALM:
                narrowed(chosen, lam, gaps)
            rows = np.flatnonzero(chosen)
            own = planes.rows[rows]
            charge(seconds, stamp, DETECT)
            W = chain_kernels.delassus(own, device.element[rows], factor)
            order, U = np.empty(len(rows), dtype=np.int64), np.empty((len(rows), len(rows)))
            state[0] = 0
            charge(seconds, stamp, DELASSUS)
        guess, q = lam[rows], gaps[rows]
        for i in range(len(rows)):
            if guess[i] != 0.0:
                for j in range(len(rows)):
                    q[j] -= W[i, j] * guess[i]
        found, delta, solved = status(W, q, guess, order, U, state, precision)
        iterations += max(state[2], 1) if guess.any() else state[2]
        charge(seconds, stamp, SOLVE)
        if not solved:
            verdict = UNSOLVED
            break

        # The corrective motion, as far as its linearisation holds
        rest = apply_transpose(own, device.first[rows], found - guess, n).reshape(1, -1)
        d = (u + chain_kernels.solve(factor, device.fixed, rest)[0]).reshape(-1, 6)
        shift, turn = nodal_kernels.furthest(d)
        over = max(turn / TURN, shift / (SHIFT * device.reach))
        if over > 1.0:
            d = d / over
        last_edges, last_R, last_d = edges, R, d
        x, R, edges = frame_kernels.update(x, R, edges, d)
        moved = moved + d[:, :3]
        lam = np.zeros(c)
        for j in range(len(rows)):
            i = rows[j]
            if found[j] > 0.0:
                lam[i] = max(found[j] - brace[i] * (delta[j] - planes.offset[i]), 0.0)
        charge(seconds, stamp, FACTOR)

        # Detection about the new state
        at = beam_points.centreline_points(x, R, device.element, device.xi, device.rest.length)
        if not look(wall, device, sight, at, candidates | (bounds(sight, at) <= 0.0), np.zeros(c)):
            verdict = LOST
            break
        candidates = candidates & ~np.isnan(sight.foot.distance) | (sight.known <= 0.0)
        outside = np.flatnonzero(sight.known < -2.0 * device.radius)
        if len(outside):
            first_met(wall, device, sight, accepted, at, outside)
        planes = planes_at(device, sight, candidates, at, R)
        gap = device_kernels.gaps(candidates, sight.known, at, sight.seen, sight.drift)
        charge(seconds, stamp, DETECT)

        # The certificate
        passes += 1
        turned = frame_kernels.relative_rotations(start.R, R)
        inner = balance(device, scheme, data, start, R, edges, moved, turned, J)
        contact = apply_transpose(planes.rows, device.first, lam, n)
        norms = nodal_kernels.norms(inner, load, contact, device.fixed, device.unit)
        residuals[0], residuals[2], residuals[3] = complementarity(device, W, q, rows, lam, gap, movable)
        residuals[1] = norms[0] / max(norms[1] + norms[2] + norms[3], scheme.least)
        movable = touching(planes.rows)
        charge(seconds, stamp, ASSEMBLE)
        if (residuals <= tolerances).all():
            room = np.maximum(bounds(sight, at) + device.radius, 0.0) + np.maximum(clear + device.radius, 0.0)
            far = np.flatnonzero(device_kernels.ways(accepted, at) >= room)
            if len(far):
                s = roots(wall.net, accepted[far], at[far], wall.sign, 1e-3 * device.thick)
                if (s > 0.0).any():
                    verdict = CROSSED
            charge(seconds, stamp, DETECT)
            break
        worst = max(residuals[0], residuals[1])
        if passes == max_passes or not np.isfinite(worst):
            verdict = PASSES
        elif residuals[3] > tolerances[3] and driven_in(gap, movable, tolerances[3] * device.thick):
            verdict = DRIVEN
        settling = worst**2 <= SURE * min(tolerances[0], tolerances[1]) * residual and covered(planes, movable, rows)
        residual = worst

    met = movable & np.isfinite(planes.offset)
    shown_rows = np.flatnonzero(met & (meeting | (sight.known <= device.close)))
    charge(seconds, stamp, DETECT)
    return (
        (verdict, passes, iterations, shown),
        residuals,
        (x, R, edges, scheme.damping * moved, scheme.damping * turned),
        (moved, J),
        (sight.known, sight.seen, sight.drift, sight.followed),
        (sight.foot.distance, sight.foot.point, sight.foot.normal, sight.foot.curvature),
        (candidates, at, bounds(sight, at)),
        (planes.offset, planes.normals, planes.every, planes.rows, movable, met, shown_rows),
        (lam, gap),
        (rows, own, W, q, state[3]),
        (diagonal, upper, factor),
        (chord, twist),
    )
