"""Contact problems given by W: nearly dependent normals, condition, gaps of any size, and from one contact to 2,000."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from contact.solvers import Solution
from validation.case import Quantity
from validation.stability import generators
from validation.stability.judge import least_motion
from validation.stability.point import Answer, decades, of_problem, sweep

Floats = NDArray[np.float64]

EXACT = 1e-10
SIZES = (1.0, 2.0, 5.0, 10.0, 20.0, 50.0, 100.0, 200.0, 500.0, 1000.0, 2000.0)
SEED = 2007  # of these sweeps alone: their problems do not depend on the campaign's seed


def _fan(copies: int) -> Callable[[float], Answer]:
    def solve(angle: float) -> Answer:
        """A sprung point pulled into the apex of planes whose normals lie within an angle: u there, Σ λ n = F − ku.

        Gaps are decided to 1e-12 ℓ, the place along the planes to that over the angle: ℓ/g is 5.
        """
        k, F, g = 2.0, 1.0, 0.1
        along = max(EXACT, min(4 * angle, 1e-11 / angle))
        turn = angle * np.linspace(-0.5, 0.5, copies)
        n = np.stack([np.sin(turn), np.cos(turn)], axis=1)
        # in floating point all planes pass through the apex exactly when each gap is that of its own normal
        W, q = n @ n.T / k, n @ np.array([0.0, g - F / k])

        def compare(found: Solution) -> list[Quantity]:
            force = found.lam @ n
            u = (np.array([0.0, -F]) + force) / k
            return [
                Quantity("depth", float(u[1]), -g, EXACT),
                Quantity("along", float(u[0]) / g, 0.0, along),
                Quantity("force", float(force[1]), F - k * g, EXACT),
            ]

        return of_problem(W, q, compare)

    return solve


for _copies in (2, 10, 100):
    sweep(
        f"fan-{_copies}",
        "angle between the normals [rad]",
        (*decades(-12, -1), 1.0, 2.0),
        row="nearly dependent contacts",
    )(_fan(_copies))


def _projected(F: Floats, q: Floats, limit: float, method: str = "status") -> Answer:
    """The solution of W = FFᵀ beside the motion of least norm that satisfies all constraints."""
    x = least_motion(F, q)
    assert x is not None, "the reference finds no motion"
    size = float(np.linalg.norm(x)) or 1.0

    def compare(found: Solution) -> list[Quantity]:
        return [Quantity("motion", float(np.linalg.norm(F.T @ found.lam - x)) / size, 0.0, limit)]

    return of_problem(F @ F.T, q, compare, method)


def _sizes(family: str) -> Callable[[float], Answer]:
    def solve(c: float) -> Answer:
        F, q = generators.FAMILIES[family](np.random.default_rng([SEED, int(c)]), int(c))
        return _projected(F, q, 1e-9)

    solve.__doc__ = f"The family `{family}`: the motion beside that of a least-distance solver on the factor of W."
    return solve


for _family in generators.FAMILIES:
    sweep(f"contacts-{_family}", "contacts c [-]", SIZES)(_sizes(_family))


@sweep("condition", "condition of W [-]", decades(0, 14))
def conditioned(condition: float) -> Answer:
    """Thirty contacts whose W has its eigenvalues in geometric progression."""
    F, q = generators.conditioned(np.random.default_rng([SEED, 30]), 30, condition)
    return _projected(F, q, 1e-9)


@sweep("gap-scale", "size of the gaps [m]", decades(-9, 9))
def gap_scale(size: float) -> Answer:
    """Gaps of any size at a W of size one: nothing may be compared with a length of its own."""
    F, q = generators.dense(np.random.default_rng([SEED, 31]), 40)
    return _projected(F, size * q, EXACT)
