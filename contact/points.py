"""Contact points of a body and the constraints that they form.

A contact point q moves with its body, x_q = X_q + Σ_k N_qk u_k; a constraint i is a weighted mean of gaps,
δ_i = Σ_q T_qi g_q. Nodal constraints take the gap at each node of a surface; mortar constraints the mean against the
hat function ψ_i of each vertex, δ_i = ∫ψ_i g ds / ∫ψ_i ds, whose multiplier is the vertex value of a pressure
p_h = Σ_i ψ_i λ_i / ∫ψ_i ds.
On second-order triangles nodal forces of a uniform pressure vanish at the vertices, so that λ ≥ 0 node by node is wrong
there: nodal constraints on such faces are refused.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from contact.rows import owned_rows
from fem.body import Body
from fem.elements import order_of, quadrature, shape
from fem.geometry import MappedCells, MappedFacets, map_cells, map_facets

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]


@dataclass(frozen=True)
class ContactPoints:
    """q points on this rank that form c constraints on all ranks.

    nodes, values : local nodes (q, k) and N_qk (q, k)
    rows, shares : the constraints that a point enters (q, r) and T_qi (q, r)
    places : a node's undeformed position for each constraint, replicated, (c, D) [m]
    areas : ∫ψ_i ds of each constraint (2πr in axisymmetry), replicated, (c) [m^(dim−1)]
    numbers : the global number of each constraint's node, replicated, (c)
    """

    body: Body
    nodes: Ints
    values: Floats
    rows: Ints
    shares: Floats
    places: Floats
    areas: Floats
    numbers: Ints

    @property
    def count(self) -> int:
        """The number c of constraints."""
        return len(self.places)

    def positions(self) -> Floats:
        """Undeformed positions of the points, (q, D) [m]."""
        x: Floats = np.einsum("qk,qkd->qd", self.values, self.body.points[self.nodes])
        return x

    def displacements(self) -> Floats:
        """Displacements of the points, (q, D) [m]."""
        u: Floats = np.einsum("qk,qkd->qd", self.values, self.body.displacement[self.nodes])
        return u

    def mean(self, g: Floats) -> Floats:
        """Σ_q T_qi g_q for values g at this rank's points, (c, …), summed over the ranks. Collective."""
        columns = g.reshape(len(g), int(np.prod(g.shape[1:])))
        result = np.zeros((self.count, columns.shape[1]))
        for r in range(self.rows.shape[1]):
            np.add.at(result, self.rows[:, r], self.shares[:, r, None] * columns)
        total: Floats = self.body.space.comm.allreduce(result)
        return total.reshape(self.count, *g.shape[1:])

    def matrix(self, normals: Floats) -> sp.csr_array:
        """H with δ = H u + const for unit normals at the points (q, D): the owned columns, (c, owned). Collective."""
        space = self.body.space
        c = space.components
        along = normals @ self.body.frame.T
        entries = np.einsum("qr,qk,qc->qrkc", self.shares, self.values, along)
        dofs = space.dofs_of(self.nodes[..., None]).reshape(len(self.nodes), 1, self.nodes.shape[1], c)
        unknowns = np.broadcast_to(space.local_dofs[dofs], entries.shape)
        rows = np.broadcast_to(self.rows[:, :, None, None], entries.shape)
        return owned_rows(space, self.count, rows.ravel(), unknowns.ravel(), entries.ravel())


def nodal(body: Body, tag: str) -> ContactPoints:
    """One constraint per node of the facets `tag`. Collective.

    Raises
    ------
    ValueError
        on second-order triangles, or where the mesh has no such tag.
    """
    space, facets = body.space, body.facets(tag)
    if facets.shape[1] == 6:
        raise ValueError(
            f"contact on {body.name!r}: nodal constraints need first-order triangles; use mortar, or order 1"
        )
    numbers, mine = _rows(body, facets)
    nodes = np.unique(facets)
    rows = np.searchsorted(numbers, space.piece.nodes[nodes])
    # A node on a border is on several ranks; the lowest of them has its point.
    holders = space.comm.allgather(rows)
    taken = np.isin(rows, np.concatenate([np.empty(0, dtype=np.int64), *holders[: space.comm.rank]]))
    nodes, rows = nodes[~taken], rows[~taken]
    ones = np.ones((len(nodes), 1))
    places = _spread(body, len(numbers), rows, body.points[nodes])
    areas = np.zeros(len(numbers))
    mapped = surface_map(body, facets)
    np.add.at(areas, mine, np.einsum("fq,qa->fa", mapped.weights, mapped.values))
    areas = space.comm.allreduce(areas)
    return ContactPoints(body, nodes[:, None], ones, rows[:, None], ones, places, areas, numbers)


def mortar(body: Body, tag: str, degree: int = 6) -> ContactPoints:
    """One constraint per vertex of the facets `tag`, gaps integrated by a rule of the given degree. Collective."""
    space, facets = body.space, body.facets(tag)
    dim = space.dim if _is_cells(body, facets) else space.dim - 1
    order = order_of(dim, facets.shape[1])
    vertices = facets[:, : dim + 1]
    numbers, mine = _rows(body, vertices)
    mapped = surface_map(body, facets, degree)
    xi, _ = quadrature(dim, degree)
    psi = shape(xi, 1)
    areas = np.zeros(len(numbers))
    np.add.at(areas, mine, np.einsum("fq,qa->fa", mapped.weights, psi))
    areas = space.comm.allreduce(areas)
    f, q = mapped.weights.shape
    shares = np.einsum("fq,qa->fqa", mapped.weights, psi) / areas[mine][:, None, :]

    def flat[T: np.generic](a: NDArray[T]) -> NDArray[T]:
        return np.broadcast_to(a, (f, q, a.shape[-1])).reshape(f * q, a.shape[-1])

    nodes, first = np.unique(vertices, return_index=True)
    places = _spread(body, len(numbers), mine.ravel()[first], body.points[nodes])
    return ContactPoints(
        body,
        flat(facets[:, None, :]),
        flat(shape(xi, order)[None]),
        flat(mine[:, None, :]),
        flat(shares),
        places,
        areas,
        numbers,
    )


def surface_map(body: Body, facets: Ints, degree: int = 4) -> MappedFacets | MappedCells:
    """A quadrature rule on facets of a body, or on its cells where it touches with those."""
    X, axisymmetric = body.space.piece.points, body.model.axisymmetric
    if _is_cells(body, facets):
        return map_cells(X, facets, degree, axisymmetric)
    return map_facets(X, facets, degree, axisymmetric)


def _is_cells(body: Body, facets: Ints) -> bool:
    """Whether `facets` are cells: of a body that touches with those."""
    return bool(facets.shape[1] == body.space.piece.cells.shape[1])


def _rows(body: Body, nodes: Ints) -> tuple[Ints, Ints]:
    """The global node numbers that carry constraints, in order, and the constraint of each entry of local `nodes`."""
    space = body.space
    numbers = np.unique(np.concatenate(space.comm.allgather(np.unique(space.piece.nodes[nodes]))))
    return numbers, np.searchsorted(numbers, space.piece.nodes[nodes])


def _spread(body: Body, count: int, rows: Ints, values: Floats) -> Floats:
    """Values of this rank's rows as a replicated array; a row given by several ranks has the same value on each."""
    result = np.full((count, values.shape[1]), -np.inf)
    result[rows] = values
    total: Floats = body.space.comm.allreduce(result, op=np.maximum)
    return total
