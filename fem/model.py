"""What a body is made of, as the body sees it."""

from __future__ import annotations

from typing import Protocol, runtime_checkable

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]


class Model(Protocol):
    """A material on simplices: element matrices and, independently of them, internal forces."""

    @property
    def axisymmetric(self) -> bool:
        """Whether x = (r, z)."""

    @property
    def mixed(self) -> bool:
        """Whether pressures stand beside the displacements."""

    def stiffness(self, points: Floats, cells: Ints) -> Floats:
        """Element matrices (m, n, n)."""

    def forces(self, points: Floats, cells: Ints, u: Floats) -> Floats:
        """Internal forces of cells (m, n) at their unknowns u (m, n)."""


@runtime_checkable
class Stressed(Model, Protocol):
    """A material with a stress tensor."""

    def stress(self, points: Floats, cells: Ints, u: Floats) -> tuple[Floats, Floats]:
        """Cell averages of σ as a full tensor, (m, 3, 3) [Pa], and the cells' volumes (m)."""
