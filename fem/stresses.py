"""Internal forces of a solid for many displacements at once, from its cells' stresses."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from fem.elasticity import Elasticity
from fem.elements import order_of, quadrature, shape_gradient
from fem.force_kernel import add_forces
from fem.foundation import OnFoundation
from fem.geometry import is_straight
from fem.model import Model
from fem.regions import Regions
from fem.space import Space

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]


class ForcesOfColumns:
    """f_int of columns X (k, owned), as `fem.body.Body.internal_forces` has it of one.

    Hooke's law on tetrahedra is compiled; what else there is (springs, pressures) goes column by column.
    """

    def __init__(self, model: Model, space: Space) -> None:
        self.model, self.space = model, space
        material = model.material if isinstance(model, OnFoundation) else model
        parts: list[tuple[Elasticity, Ints]] = []
        if isinstance(material, Regions):
            parts = material.parts
        elif isinstance(material, Elasticity) and material.state == "3d" and not material.mixed:
            parts = [(material, np.arange(len(space.piece.cells)))]
        points, cells = space.piece.points, space.piece.cells
        self._parts = []
        for law, rows in parts if points.shape[1] == 3 else []:
            order = order_of(3, cells.shape[1])
            # As `Elasticity` integrates, to the last bit of the rule.
            xi, w = quadrature(3, 1 if order == 1 else 2 if is_straight(points, cells[rows]) else 4)
            self._parts.append((np.ascontiguousarray(cells[rows]), shape_gradient(xi, order), w, law.Lame, law.G))

    def __call__(self, X: Floats) -> Floats:
        """f_int, (k, owned) [N]. Collective."""
        space, model = self.space, self.model
        local = np.stack([space.local(x) for x in X], axis=1)
        if not self._parts:
            of = [self._of_cells(model.forces(space.piece.points, space.piece.cells, u)) for u in self._cells(local)]
            return np.stack(of)
        U = local.reshape(-1, 3, len(X))
        F = np.zeros_like(U)
        for cells, slopes, weights, Lame, G in self._parts:
            add_forces(space.piece.points, cells, slopes, weights, Lame, G, U, F)
        forces = np.stack([space.sum(f) for f in F.reshape(len(local), -1).T])
        if isinstance(model, OnFoundation):
            for f, u in zip(forces, self._cells(local), strict=True):
                springs = np.zeros_like(u)
                model.add_springs(u, springs)
                f += self._of_cells(springs)
        return forces

    def _cells(self, local: Floats) -> list[Floats]:
        return [u[self.space.cell_dofs] for u in local.T]

    def _of_cells(self, f: Floats) -> Floats:
        return self.space.sum_cells(f)
