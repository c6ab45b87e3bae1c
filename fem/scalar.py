"""Bodies with one displacement: bars and springs (along their axis), strings and membranes (across their plane).

All of them minimise ∫ ½ c |∇u|² − f u, with c = EA for a bar [N] and the tension for a string [N] or membrane [N/m].
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fem.geometry import map_cells

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]


@dataclass(frozen=True)
class Laplacian:
    """The operator −div(c ∇u) on simplices; `coefficient` c is EA or a tension."""

    coefficient: float
    axisymmetric = False
    mixed = False

    def stiffness(self, points: Floats, cells: Ints) -> Floats:
        """∫ c ∇N_a·∇N_b dx, (m, k, k)."""
        mapped = map_cells(points, cells, 2 if cells.shape[1] > points.shape[1] + 1 else 1)
        g = mapped.gradients
        K: Floats = self.coefficient * np.einsum("mq,mqai,mqbi->mab", mapped.weights, g, g, optimize=True)
        return K

    def forces(self, points: Floats, cells: Ints, u: Floats) -> Floats:
        """∫ c ∇u·∇N_a dx, (m, k)."""
        mapped = map_cells(points, cells, 2 if cells.shape[1] > points.shape[1] + 1 else 1)
        flux = self.coefficient * np.einsum("mqai,ma->mqi", mapped.gradients, u)
        f: Floats = np.einsum("mq,mqai,mqi->ma", mapped.weights, mapped.gradients, flux, optimize=True)
        return f
