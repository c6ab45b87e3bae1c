"""Chains of beam elements and a small Newton loop that the tests of beams share."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from fem.beams.beam_element import BeamData, forces, stiffness
from fem.rotations import composed, exp

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]


def random_chain(elements: int, angle: float, seed: int = 0) -> tuple[Floats, Floats, BeamData]:
    """Edges, frames and properties at random; successive frames differ by rotation vectors of the given size [rad]."""
    rng = np.random.default_rng(seed)
    turns = rng.normal(size=(elements, 3))
    turns *= angle / np.linalg.norm(turns, axis=1)[:, None]
    R = [exp(rng.normal(size=3))]
    for turn in exp(turns):
        R.append(R[-1] @ turn)
    data = BeamData(
        length=rng.uniform(0.5, 1.5, elements),
        chord=rng.normal(size=(elements, 3)),
        twist=0.3 * rng.normal(size=(elements, 3)),
        axial=rng.uniform(1, 5, (elements, 3)),
        bending=rng.uniform(1, 5, (elements, 3)),
    )
    return rng.normal(size=(elements, 3)), np.array(R), data


def moved(edges: Floats, R: Floats, d: Floats) -> tuple[Floats, Floats]:
    """Edges and frames after increments (N, 6)."""
    return edges + np.diff(d[:, :3], axis=0), composed(d[:, 3:], R)


def scatter(f: Floats, K: Floats) -> tuple[Floats, Floats]:
    """Element forces (m, 12) and matrices (m, 12, 12) summed at the nodes: (6 N) and (6 N, 6 N)."""
    m = len(f)
    total, matrix = np.zeros(6 * (m + 1)), np.zeros((6 * (m + 1), 6 * (m + 1)))
    for i in range(m):
        span = slice(6 * i, 6 * i + 12)
        total[span] += f[i]
        matrix[span, span] += K[i]
    return total, matrix


def solve(
    points: Floats, R: Floats, data: BeamData, load: Callable[[Floats, float], Floats], fixed: Ints, steps: int = 1
) -> tuple[Floats, Floats]:
    """Nodes and frames in equilibrium with `load(R, part)` (6 N), part from 1/steps to 1; `fixed` unknowns stay."""
    free = np.setdiff1d(np.arange(6 * len(R)), fixed)
    edges, x = np.diff(points, axis=0), points.copy()
    for part in np.arange(1, steps + 1) / steps:
        for _ in range(40):
            f, K = scatter(forces(edges, R, data), stiffness(edges, R, data))
            d = np.zeros((len(R), 6))
            d.reshape(-1)[free] = np.linalg.solve(K[np.ix_(free, free)], (load(R, part) - f)[free])
            edges, R = moved(edges, R, d)
            x = x + d[:, :3]
            if np.abs(d[:, 3:]).max() <= 1e-11:
                break
        else:
            raise RuntimeError(f"no equilibrium at {part} of the load")
    return x, R
