"""The facets of a body's surface, gathered on every rank: places, normals, flat pieces, and their neighbours."""

from __future__ import annotations

from typing import Any

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from fem.body import Body
from fem.elements import order_of, quadrature, shape, shape_gradient
from meshes.simplices import EDGES

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

SHARP = np.cos(np.radians(50))  # of the angle between facets beyond which their common edge is sharp
STRAIGHT = 1e-10


class Facets:
    """The f facets `tag` of a body with k nodes each, replicated; surfaces are small beside their volumes.

    Collective on the body's communicator.

    Attributes
    ----------
    mine : the facets that this rank has brought
    X : undeformed nodes, (f, k, D) [m]
    first : the global number of each node's first displacement, (f, k)
    vertices, rows : global numbers of the c vertices in order, and which of them each facet has, (f, D)
    """

    def __init__(self, body: Body, tag: str) -> None:
        self.body, self.tag = body, tag
        space, local = body.space, body.facets(tag)
        if space.components != space.dim or space.dim == 1:
            raise ValueError(f"body {body.name!r}: only a solid has a surface for contact with another body's")
        self._local = local
        count = space.comm.allgather(len(local))
        if not sum(count):
            raise ValueError(f"body {body.name!r}: no facet has the tag {tag!r}")
        start = sum(count[: space.comm.rank])
        self.mine = slice(start, start + len(local))
        self.X = self._gather(body.points[local])
        self.first = self._gather(space.node_dofs[local])
        nodes = self._gather(space.piece.nodes[local])
        self._meeting = _equal_pairs(nodes.ravel())
        self.vertices, rows = np.unique(nodes[:, : space.dim], return_inverse=True)
        self.rows: Ints = rows.reshape(-1, space.dim)
        self.dim, self.order = space.dim - 1, order_of(space.dim - 1, local.shape[1])

    def _gather(self, mine: Any) -> Any:
        comm = self.body.space.comm
        return mine if comm.size == 1 else np.concatenate(comm.allgather(mine))

    @property
    def displacements(self) -> Floats:
        """Present displacements of the nodes, (f, k, D) [m]. Collective."""
        u: Floats = self._gather(self.body.displacement[self._local])
        return u

    def places(self) -> Floats:
        """Undeformed vertices, (c, D) [m]."""
        x = np.empty((len(self.vertices), self.X.shape[2]))
        x[self.rows] = self.X[:, : self.dim + 1]
        return x

    def areas(self) -> Floats:
        """Undeformed area of each facet, (f) [m^(D−1)]."""
        xi, w = quadrature(self.dim, 4)
        _, size = normals_of(np.einsum("qad,fak->fqdk", shape_gradient(xi, self.order), self.X))
        areas: Floats = size @ w
        return areas

    def supports(self) -> Floats:
        """∫ψ_i over the whole undeformed side for the hat function of each vertex, (c)."""
        result = np.zeros(len(self.vertices))
        np.add.at(result, self.rows, (self.areas() / (self.dim + 1))[:, None])
        return result

    def normals(self, x: Floats) -> Floats:
        """Unit normals at the nodes of deformed facets x, (f, k, D), out of the body.

        A facet has at its node the mean of its own normal and those of its neighbours there, so that the field is
        continuous; neighbours behind a sharp edge do not count.
        """
        corners = np.vstack([np.zeros(self.dim), np.eye(self.dim)])
        nodes = corners
        if self.order == 2:
            nodes = np.vstack([corners, corners[np.array(EDGES[self.dim])].mean(axis=1)])
        n, _ = normals_of(np.einsum("qad,fak->fqdk", shape_gradient(nodes, self.order), x))
        own = n.reshape(-1, x.shape[2])
        i, j = self._meeting
        smooth = np.einsum("pd,pd->p", own[i], own[j]) > SHARP
        mean = sp.csr_array((smooth.astype(float), (i, j)), shape=(len(own), len(own))) @ own
        mean /= np.linalg.norm(mean, axis=1)[:, None]
        return np.ascontiguousarray(mean.reshape(n.shape))

    def pieces(self, x: Floats) -> tuple[Floats, Floats]:
        """Flat pieces of deformed facets x, one where all are straight: reference (s, D, D − 1), true (f, s, D, D)."""
        corners = np.vstack([np.zeros(self.dim), np.eye(self.dim)])
        if bulge(x, self.dim).max(initial=0.0) <= STRAIGHT * np.ptp(x.reshape(-1, x.shape[2]), axis=0).max():
            reference = corners[None]
        elif self.dim == 1:
            s = np.linspace(0, 1, 5)
            reference = np.stack([s[:-1], s[1:]], axis=1)[:, :, None]
        else:
            middle = (corners + np.roll(corners, -1, axis=0)) / 2
            tips = [np.stack([corners[i], middle[i], middle[i - 1]]) for i in range(3)]
            reference = np.stack([*tips, middle])
        values = shape(reference.reshape(-1, self.dim), self.order)
        true = np.einsum("qk,fkd->fqd", values, x).reshape(len(x), *reference.shape[:2], x.shape[2])
        return np.ascontiguousarray(reference), np.ascontiguousarray(true)


def bulge(x: Floats, dim: int) -> Floats:
    """How far the middle nodes of facets x lie from the middles of their edges, (f) [m]; 0 of first order."""
    edges = np.array(EDGES[dim])
    if x.shape[1] == dim + 1:
        return np.zeros(len(x))
    off = x[:, dim + 1 :] - (x[:, edges[:, 0]] + x[:, edges[:, 1]]) / 2
    size: Floats = np.linalg.norm(off, axis=2).max(axis=1)
    return size


def _equal_pairs(numbers: Ints) -> tuple[Ints, Ints]:
    """All pairs (i, j) with numbers[i] = numbers[j], i = j included."""
    order = np.argsort(numbers, kind="stable")
    _, start, count = np.unique(numbers[order], return_index=True, return_counts=True)
    first, many = np.repeat(start, count), np.repeat(count, count)
    place = np.arange(many.sum()) - np.repeat(np.cumsum(many) - many, many)
    return np.repeat(order, many), order[np.repeat(first, many) + place]


def normals_of(tangents: Floats) -> tuple[Floats, Floats]:
    """Unit normals from tangents (f, q, d, D), and area elements (f, q)."""
    if tangents.shape[3] == 2:
        n = np.stack([tangents[:, :, 0, 1], -tangents[:, :, 0, 0]], axis=-1)
    else:
        n = np.cross(tangents[:, :, 0], tangents[:, :, 1])
    size = np.linalg.norm(n, axis=-1)
    return n / size[..., None], size
