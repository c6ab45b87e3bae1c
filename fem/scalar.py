"""Bodies with one displacement: bars and springs (along their axis), strings and membranes (across their plane).

All of them minimise ∫ ½ c |∇u|² − f u, with c = EA for a bar [N] and the tension for a string [N] or membrane [N/m].
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from fem.geometry import MappedCells, map_cells

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]


@dataclass(eq=False)
class Laplacian:
    """The operator −div(c ∇u) on simplices; `coefficient` c is EA or a tension."""

    coefficient: float
    axisymmetric = False
    mixed = False
    _last: tuple[Floats, Ints, MappedCells] | None = field(default=None, init=False, repr=False)

    def _map(self, points: Floats, cells: Ints) -> MappedCells:
        # A step asks for the forces three times, always of the same cells.
        if self._last is None or self._last[0] is not points or self._last[1] is not cells:
            degree = 2 if cells.shape[1] > points.shape[1] + 1 else 1
            self._last = points, cells, map_cells(points, cells, degree)
        return self._last[2]

    def stiffness(self, points: Floats, cells: Ints) -> Floats:
        """∫ c ∇N_a·∇N_b dx, (m, k, k)."""
        mapped = self._map(points, cells)
        g = mapped.gradients
        K: Floats = self.coefficient * np.einsum("mq,mqai,mqbi->mab", mapped.weights, g, g, optimize=True)
        return K

    def forces(self, points: Floats, cells: Ints, u: Floats) -> Floats:
        """∫ c ∇u·∇N_a dx, (m, k)."""
        mapped = self._map(points, cells)
        flux = self.coefficient * mapped.weights[:, :, None, None] * np.matmul(u[:, None, None, :], mapped.gradients)
        f: Floats = np.matmul(mapped.gradients, flux.swapaxes(2, 3)).sum(axis=1)[..., 0]
        return f
