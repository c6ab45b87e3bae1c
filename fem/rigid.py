"""Rigid motions of a body: their basis, those that no support holds, and the unknowns to pin so that A is regular."""

from __future__ import annotations

from typing import Any

import numpy as np
import scipy.linalg as sl
from numpy.typing import NDArray

from fem.space import Space

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]


def rigid_modes(space: Space, axisymmetric: bool) -> Floats:
    """The motions without strain at the owned unknowns, (owned, m): translations, then rotations about the centroid.

    A body with one displacement component (bar, string, membrane) has its translation only, an axisymmetric one that
    along z.
    """
    c, piece = space.components, space.piece
    x = piece.points[: piece.owned]
    total = space.comm.allreduce(x.sum(axis=0))
    x = x - total / piece.total
    scale = np.sqrt(space.comm.allreduce(float((x**2).sum())) / piece.total) or 1.0
    x = x / scale
    translations = [np.eye(c)[i] + np.zeros((len(x), c)) for i in range(c)]
    zero, modes = np.zeros(len(x)), translations
    if axisymmetric:
        modes = translations[1:]
    elif c == 2:
        modes = [*translations, np.stack([-x[:, 1], x[:, 0]], axis=1)]
    elif c == 3:
        a, b, d = x.T
        rotations = [np.stack(r, axis=1) for r in ([zero, -d, b], [d, zero, -a], [-b, a, zero])]
        modes = [*translations, *rotations]
    R = np.zeros((space.owned, len(modes)))
    R[: c * piece.owned] = np.stack([m.ravel() for m in modes], axis=1)
    return R


def floating_modes(comm: Any, R: Floats, fixed: NDArray[np.bool_], resisted: Floats | float = 0.0) -> Floats:
    """The combinations of R that vanish where displacements are prescribed, (owned, m).

    `resisted` (m, m) is their energy, in any unit, in springs that the body stands on.
    """
    gram = comm.allreduce(R.T @ R)
    held = comm.allreduce(R[fixed].T @ R[fixed]) + resisted
    # Both are small; a mode is held if it moves the supports by more than round-off of its own size.
    values, vectors = sl.eigh(held, gram)
    modes: Floats = R @ vectors[:, values < 1e-12 * max(values.max(initial=0.0), 1 / len(gram) * 1e-3)]
    return modes


def pin(comm: Any, modes: Floats) -> Ints:
    """As many owned unknowns as there are modes, on which the modes are independent: a statically determinate support.

    Chosen by Gaussian elimination with full pivoting over all ranks, so that every rank decides alike.
    """
    work, pins = modes.copy(), []
    for _ in range(modes.shape[1]):
        best = np.unravel_index(np.argmax(np.abs(work)), work.shape) if work.size else (0, 0)
        mine = float(abs(work[best])) if work.size else -1.0
        sizes = comm.allgather(mine)
        owner = int(np.argmax(sizes))
        row = comm.bcast((work[best[0]].copy(), best[1]) if comm.rank == owner else None, root=owner)
        if comm.rank == owner:
            pins.append(int(best[0]))
        values, column = row
        work -= np.outer(work[:, column], values / values[column])
    return np.array(sorted(pins), dtype=np.int64)
