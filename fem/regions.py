"""Bodies of several materials: each region of the mesh has its own Hooke's law."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import NDArray

from fem.elasticity import Elasticity

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]


class Regions:
    """Materials of one state and formulation, each on its own cells.

    Of the mixed formulation the space must keep their pressures apart, see `fem.space.Space`.

    Parameters
    ----------
    parts : materials and the local cells of each on this rank; every cell is in one of them
    """

    def __init__(self, parts: Sequence[tuple[Elasticity, Ints]]) -> None:
        self.parts = list(parts)
        self.axisymmetric, self.mixed = parts[0][0].axisymmetric, parts[0][0].mixed

    def _gather(self, cells: Ints, of: Callable[[Elasticity, Ints], Floats]) -> Floats:
        values = [(rows, of(material, rows)) for material, rows in self.parts]
        result = np.empty((len(cells), *values[0][1].shape[1:]))
        for rows, value in values:
            result[rows] = value
        return result

    def stiffness(self, points: Floats, cells: Ints) -> Floats:
        """Element matrices (m, n, n)."""
        return self._gather(cells, lambda material, rows: material.stiffness(points, cells[rows]))

    def forces(self, points: Floats, cells: Ints, u: Floats) -> Floats:
        """Internal forces of each cell, (m, n), for its unknowns `u` (m, n)."""
        return self._gather(cells, lambda material, rows: material.forces(points, cells[rows], u[rows]))

    def stress(self, points: Floats, cells: Ints, u: Floats) -> tuple[Floats, Floats]:
        """Cell averages of σ, (m, 3, 3) [Pa], and the cells' volumes (m)."""
        parts = [(rows, material.stress(points, cells[rows], u[rows])) for material, rows in self.parts]
        sigma, volume = np.empty((len(cells), 3, 3)), np.empty(len(cells))
        for rows, values in parts:
            sigma[rows], volume[rows] = values
        return sigma, volume
