"""Anderson mixing of the passes of a step: where the next one takes its tangent planes."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from contact.ranks import total
from fem.body import Body

Floats = NDArray[np.float64]

DEPTH = 4
SLOW = 0.1  # a pass that leaves less than this part of the residual needs no help


class Mixing:
    """Passes as a fixed-point iteration y = F(x): planes about the bodies' state x give the corrected state y.

    Instead of x ← y, the next planes lie about the combination of the last few y whose residuals y − x combine to the
    least norm. Where loads near those at which the contact would give way make one motion slow to settle, as in a
    compressed block whose contact follows its tilt, the passes then need not crawl along it.

    Source: Anderson, J. ACM 12 (1965); Walker and Ni, SIAM J. Numer. Anal. 49 (2011).
    """

    def __init__(self, comm: Any, bodies: Sequence[Body]) -> None:
        self.comm, self.bodies = comm, bodies
        self._states: list[Floats] = []
        self._residuals: list[Floats] = []
        self._at: Floats | None = None

    def advance(self, progress: float) -> bool:
        """Move the bodies to where the next planes are to be taken; whether they moved. Collective.

        `progress` is the part of the residual that the last pass left.
        """
        y = np.concatenate([body.coordinates() for body in self.bodies])
        if self._at is None:
            self._at = y
            return False
        self._states = [*self._states[-DEPTH:], y]
        self._residuals = [*self._residuals[-DEPTH:], y - self._at]
        self._at = y
        if len(self._states) < 2 or progress < SLOW:
            return False
        R, S = (np.diff(np.stack(a, axis=1), axis=1) for a in (self._residuals, self._states))
        size = np.sqrt(np.maximum(total(self.comm, (R**2).sum(axis=0)), 1e-300))
        gram, load = total(self.comm, R.T @ R), total(self.comm, R.T @ self._residuals[-1])
        weights = np.linalg.lstsq(gram / np.outer(size, size), load / size, rcond=1e-10)[0] / size
        change = -S @ weights
        first = 0
        for body in self.bodies:
            owned = body.space.owned
            body.correct(change[first : first + owned])
            first += owned
        self._at = y + change
        return True
