"""Elastic (Winkler) surroundings of a solid: springs per area on tagged parts, t = −k u or t = −k (n·u) n.

They add ∫ k N_a N_b ds (n n or I) to K and ∫ k (n·u) n N_a ds to the internal forces, of the cells behind the facets.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from fem.geometry import MappedFacets, map_facets
from fem.model import Model, Stressed
from fem.space import Space
from meshes.mesh import face_keys, face_table, faces_of
from meshes.simplices import face_nodes

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

DEGREE = 4  # of N_a N_b on straight facets of order 2


@dataclass(frozen=True)
class Foundation:
    """Springs of `stiffness` [Pa/m] on the facets of `tag`: along one component, the normal, or (None) every direction.

    Raises
    ------
    ValueError
        for a stiffness that is not positive.
    """

    tag: str
    stiffness: float
    component: int | Literal["normal"] | None = None

    def __post_init__(self) -> None:
        if not (np.isfinite(self.stiffness) and self.stiffness > 0):
            raise ValueError(f"stiffness = {self.stiffness}: must be finite and > 0")


@dataclass(frozen=True)
class _Springs:
    """A foundation on this rank: facets (f, q points) with the cells behind them and these cells' unknowns (f, d)."""

    stiffness: float
    mapped: MappedFacets
    directions: Floats  # orthonormal, (f, q, r, components)
    cells: Ints
    dofs: Ints

    def values(self) -> Floats:
        """The rows (f, q, r, d) that give the displacements along the directions."""
        rows = np.einsum("qa,fqrc->fqrac", self.mapped.values, self.directions)
        return np.asarray(rows.reshape(*rows.shape[:3], -1))


class OnFoundation:
    """A material whose body stands on springs.

    Parameters
    ----------
    name : the body's, for messages
    material : without them
    space : the body's unknowns
    foundations : where the springs are
    facets : from a tag to local nodes (f, k)

    Raises
    ------
    ValueError
        for a component that the body does not have, and for a body that is no solid.
    """

    def __init__(
        self,
        name: str,
        material: Model,
        space: Space,
        foundations: Sequence[Foundation],
        facets: Callable[[str], Ints],
    ) -> None:
        if not isinstance(material, Stressed):
            raise ValueError(f"body {name!r}: only a solid stands on springs")
        self.material = material
        self.axisymmetric, self.mixed = material.axisymmetric, material.mixed
        for f in foundations:
            if isinstance(f.component, int) and not 0 <= f.component < space.components:
                raise ValueError(f"body {name!r}: support on {f.tag!r} has no component {f.component}")
        self._springs = [_springs(space, f, facets(f.tag), self.axisymmetric) for f in foundations]

    def stiffness(self, points: Floats, cells: Ints) -> Floats:
        """Element matrices (m, n, n) with those of the springs."""
        K = self.material.stiffness(points, cells)
        for s in self._springs:
            rows = s.values()
            k = s.stiffness * np.einsum("fq,fqri,fqrj->fij", s.mapped.weights, rows, rows, optimize=True)
            np.add.at(K, (s.cells[:, None, None], s.dofs[:, :, None], s.dofs[:, None, :]), k)
        return K

    def forces(self, points: Floats, cells: Ints, u: Floats) -> Floats:
        """Internal forces of each cell and its springs, (m, n), for its unknowns `u` (m, n)."""
        f = self.material.forces(points, cells, u)
        self.add_springs(u, f)
        return f

    def add_springs(self, u: Floats, f: Floats) -> None:
        """Add the springs' forces to those of each cell f (m, n), for its unknowns `u` (m, n)."""
        for s in self._springs:
            nodal = u[s.cells[:, None], s.dofs].reshape(len(s.cells), s.mapped.values.shape[1], -1)
            moved = np.einsum("qa,fac->fqc", s.mapped.values, nodal)
            along = np.einsum("fqc,fqrc->fqr", moved, s.directions)
            traction = s.stiffness * np.einsum("fqr,fqrc->fqc", along, s.directions)
            nodal = np.einsum("fq,fqc,qa->fac", s.mapped.weights, traction, s.mapped.values, optimize=True)
            np.add.at(f, (s.cells[:, None], s.dofs), nodal.reshape(len(s.cells), -1))

    def stress(self, points: Floats, cells: Ints, u: Floats) -> tuple[Floats, Floats]:
        """Cell averages of the material's σ, (m, 3, 3) [Pa], and the cells' volumes (m)."""
        return self.material.stress(points, cells, u)

    def gram(self, space: Space, R: Floats) -> Floats:
        """∫ (d·R)ᵀ (d·R) ds / ∫ ds along the springs for motions R (owned, m): what they resist, (m, m). Collective."""
        local = np.stack([space.local(column) for column in R.T], axis=1).reshape(-1, R.shape[1])
        total = np.zeros((R.shape[1], R.shape[1]))
        for s in self._springs:
            along = np.einsum("fqrd,fdm->fqrm", s.values(), local[space.cell_dofs[s.cells[:, None], s.dofs]])
            part = np.einsum("fq,fqrm,fqrn->mn", s.mapped.weights, along, along, optimize=True)
            area = space.comm.allreduce(float(s.mapped.weights.sum()))
            total += space.comm.allreduce(part) / area
        return total


def _springs(space: Space, foundation: Foundation, facets: Ints, axisymmetric: bool) -> _Springs:
    piece, dim, c = space.piece, space.dim, space.components
    which = np.empty(0, dtype=np.int64)
    if len(facets):
        table = face_table(piece.cells, dim)
        which = table.first[np.searchsorted(table.key, face_keys(facets[:, :dim], int(piece.cells.max()) + 1))]
        facets = faces_of(piece.cells, dim, which)
    cells, local = np.divmod(which, dim + 1)
    order = 1 if facets.shape[1] == dim else 2
    nodes = face_nodes(dim, order)[local]
    mapped = map_facets(piece.points, facets, DEGREE, axisymmetric)
    shape = (*mapped.weights.shape, 1, c)
    if foundation.component is None:
        directions = np.broadcast_to(np.eye(c), (*mapped.weights.shape, c, c))
    elif foundation.component == "normal":
        directions = mapped.normals.reshape(shape)
    else:
        directions = np.broadcast_to(np.eye(c)[[foundation.component]], shape)
    return _Springs(foundation.stiffness, mapped, directions, cells, space.dofs_of(nodes))
