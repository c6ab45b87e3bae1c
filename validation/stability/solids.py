"""Solids: incompressible, on stretched meshes, pressed by any load, stated many times over, squeezed in a slit."""

from __future__ import annotations

from functools import cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from validation.case import CASES, Quantity
from validation.stability.point import Answer, bench, decades, of_case, of_run, sweep
from validation.stability.slits import SLITS, plates

Floats = NDArray[np.float64]

EXACT = 1e-8
SHARED = 1e-12
POISSON = (0.01, 0.1, 0.2, 0.3, 0.4, 0.45, 0.49, 0.499, 0.4999, 0.49999, 0.499999)


@sweep("incompressible", "Poisson's ratio ν [-]", POISSON, row="near-incompressible")
def incompressible(nu: float) -> Answer:
    """A rigid core pressed into a tube, on Taylor–Hood cells: its pressure, with one error for all ν."""
    return of_case("plug", h=1 / 4, nu=nu)


@sweep("aspect-ratio", "width over height of the cells [-]", decades(-3, 3, 2))
def aspect_ratio(ratio: float) -> Answer:
    """A block on a plane under uniform pressure: the same contact pressure, ε = −p(1 − ν²)/E, on cells of any shape."""
    n = [max(2, round(2 / ratio)), max(2, round(2 * ratio))]
    return _pressed([1.0, 1.0], {"n": n, "order": 2}, "mortar")


@sweep("block-shape", "width over height of the block [-]", decades(-3, 3, 2))
def block_shape(ratio: float) -> Answer:
    """Columns and plates that only contact holds vertically, in 8 × 8 cells of their shape: the same answer.

    From 316:1 on refused: a plate bends so easily that the round-off of its internal forces, ε|K||u|, alone moves it by
    3e-8 of its width there and 1e-6 at 1000:1, more than the surface error of 1e-8 that is asked for.
    """
    return _pressed([ratio, 1.0], {"n": [8, 8], "order": 2}, "mortar")


@sweep("block-shape-3d", "width over height and depth of the block [-]", decades(-3, 3, 2))
def block_shape_3d(ratio: float) -> Answer:
    """The same in space, on linear tetrahedra."""
    return _pressed([ratio, 1.0, 1.0], {"n": [3, 3, 3], "order": 1}, "nodal")


def _pressed(size: list[float], mesh: dict[str, Any], constraint: str, copies: int = 1, least: bool = False) -> Answer:
    """A block of `size` on rollers at two sides, pressed onto a plane by p = 1 at E = 10, ν = .3.

    Where the `least` norm is asked for, every copy of a node's contact is to carry the same.
    """
    E, nu, p, dim = 10.0, 0.3, 1.0, len(size)
    # one force moves its node by a cell's compliance, all of them the block by its own: digits are lost in proportion
    limit = max(EXACT, 1e-9 * max(*size, *mesh["n"]) / min(size))
    sides = [{"tag": "left", "component": "x"}, {"tag": "front", "component": "y"}][: dim - 1]
    with bench() as run:
        solved = run.solve(
            body=[
                {
                    "name": "block",
                    "mesh": {"shape": "box", "size": size, "structured": True, **mesh},
                    "material": {"E": E, "nu": nu, "state": "3d" if dim == 3 else "plane-strain"},
                    "supports": sides,
                    "loads": [{"kind": "pressure", "tag": "top", "value": p}],
                }
            ],
            contact=[
                {
                    "body": "block",
                    "tag": "bottom",
                    "surface": {"kind": "plane", "point": [0.0] * dim, "normal": [0.0] * (dim - 1) + [1.0]},
                    "constraint": constraint,
                    "copies": copies,
                }
            ],
            solver={"minimum_norm": least},
        )
        constraints = solved.result.linearisation.constraints
        lam, areas = solved.result.lam, np.concatenate([part.areas for part in constraints])
        shares = lam.reshape(copies, -1)
        density = shares.sum(axis=0) / areas.reshape(copies, -1)[0]
        body = solved.system.bodies[0]
        x, u = body.points, body.displacement
        strain = p / E * (1.0 if dim == 3 else 1 - nu**2)
        sunk = u[:, -1] + strain * x[:, -1]
        return of_run(
            run,
            [
                Quantity("pressure", float(lam.sum() / np.prod(size[:-1])), p, EXACT),
                Quantity("unevenness", float(np.abs(density / p - 1).max()), 0.0, limit),
                Quantity("displacement", float(np.abs(sunk).max()) / max(size), 0.0, EXACT),
                *([Quantity("spread", float(np.ptp(shares, axis=0).max() / shares.max()), 0.0, SHARED)] * least),
            ],
        )


COPIES = (1.0, 2.0, 3.0, 5.0, 7.0, 10.0, 20.0, 30.0, 50.0, 100.0)


@sweep("duplicates-block", "copies of the contact [-]", COPIES, row="duplicated constraints")
def duplicates_block(copies: float) -> Answer:
    """The block's contact stated N times over, up to 900 rows that depend on nine: pressure and u are those of one."""
    return _pressed([1.0, 1.0], {"n": [8, 8], "order": 1}, "nodal", int(copies))


@sweep("duplicates-block-shared", "copies of the contact [-]", COPIES, row="duplicated constraints")
def duplicates_block_shared(copies: float) -> Answer:
    """The same with the forces of minimum norm: each copy carries one N-th at every node."""
    return _pressed([1.0, 1.0], {"n": [8, 8], "order": 1}, "nodal", int(copies), least=True)


@sweep("squeezed", "width of the slit less that of the block [m]", SLITS)
def squeezed(width: float) -> Answer:
    """A heavy block between rigid plates and sides: −Mw − b/2 on the upper where it does not fit, that and b below.

    M = E(1 − ν)/(1 + ν)(1 − 2ν), b the weight of the unit block; what it shortens by itself, b/2M, presses on nothing.
    """
    E, nu, b = 10.0, 0.3, 1e-2
    M = E * (1 - nu) / ((1 + nu) * (1 - 2 * nu))
    with bench() as run:
        solved = run.solve(
            body=[
                {
                    "name": "block",
                    "mesh": {"shape": "box", "size": [1.0, 1.0], "n": 4, "order": 2, "structured": True},
                    "material": {"E": E, "nu": nu, "state": "plane-strain"},
                    "supports": [{"tag": "left", "component": "x"}, {"tag": "right", "component": "x"}],
                    "loads": [{"kind": "body", "value": [0.0, -b]}],
                }
            ],
            contact=plates(width),
        )
        lower, upper = solved.forces(0).sum(), solved.forces(1).sum()
        exact = max(0.0, -width * M - b / 2)
        return of_run(
            run,
            [
                Quantity("upper_over_weight", (upper - exact) / b, 0.0, EXACT),
                Quantity("lower_over_weight", (lower - exact) / b, 1.0, EXACT),
            ],
        )


@cache
def _receding(load: float) -> tuple[Answer, Floats]:
    """The answer of the receding layer, and λ/P."""
    case = CASES["receding"]
    with bench(parameters=case.configure({"P": load, "E": 1e6})) as run:
        run.h, run.order = 1 / 40, 2
        quantities = case.solve(run)
        assert run.solved is not None
        return of_run(run, quantities), run.solved.forces() / load


@sweep("load", "P [N]", decades(-9, 9), row="P×10⁶ keeps the active set of `receding`")
def load(P: float) -> Answer:
    """A layer that lifts off under a line load: width and pressure of the closed form, the active set that of P = 1.

    E = 1e6: where displacements pass 1e4 times the body's size its surface cannot be placed to 1e-8 of that size.
    """
    answer, lam = _receding(P)
    _, one = _receding(1.0)
    changed = int(np.count_nonzero((lam > 0) != (one > 0)))
    spread = float(np.abs(lam - one).max() / one.max())
    return Answer(
        [
            *answer.quantities,
            Quantity("rows_changed", changed, 0.0, 0.5),
            Quantity("forces_over_P", spread, 0.0, 1e-10),
        ],
        answer.certificate,
        answer.iterations,
        answer.contacts,
        answer.condition,
    )
