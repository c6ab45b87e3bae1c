"""The smooth surface of a body's facets, as they deform: what the contact points of devices are kept off.

Facets of second order become Loop's subdivision surface (`subdivision`), whose points y = Σ_k B_k c_k are
convex combinations of control points c. Its normal is continuous, so that the distance d(x) of a point has a continuous
gradient: with y the closest point, ∂d/∂x = n and ∂d/∂c_k = −n B_k *exactly*, y being stationary. Rows of H are the
gradient of the gap that the certificate measures. Approximate is only where the surface lies: between the nodes, as
`subdivision` says.

The surface ends at the rim of its facets; points beyond do not touch it.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from contact.surfaces import subdivision_index as index
from contact.surfaces import subdivision_kernel as kernel
from contact.surfaces.implicit import Foot
from contact.surfaces.subdivision import Patches, smooth
from fem.body import Body
from fem.rigid_body import RigidBody
from fem.wall import Wall

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]


class BodySurface:
    """One tag's surface of a body that deforms (`Wall`), or of a rigid one that supports hold.

    Parameters
    ----------
    patches : its control triangles; points are numbered from 0
    first : the number of point 0 among the wall's
    places : control points of the undeformed body, (n, 3) [m]
    wall : what moves them; None for a rigid body's

    Attributes
    ----------
    control : where they are (`follow`), (n, 3) [m]
    """

    def __init__(self, patches: Patches, first: int, places: Floats, wall: Wall | None) -> None:
        self.patches, self.first, self.wall = patches, first, wall
        self.places = self.control = np.ascontiguousarray(places)
        corners = places[patches.net[:, :3]]
        self.edge = float(np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2).mean())
        self._order, self._leaves = index.arrange(corners.mean(axis=1))
        self._boxes = np.empty((2 * len(self._leaves) - 3, 6))
        self._boxed = self._version = -1

    def follow(self, everywhere: bool = False) -> float:
        """Bring the surface to where the wall is; how far it has moved at most since the last time [m].

        Unless `everywhere`, it is where patches are wanted.
        """
        if self.wall is None:
            return 0.0
        if everywhere:
            self.wall.follow_all()
        if self._version == self.wall.version:
            return 0.0
        moved = self.wall.displacement_of_points()[self.first : self.first + len(self.places)]
        control = self.places + moved
        way = float(np.sqrt(((control - self.control) ** 2).sum(axis=1).max()))
        self.control, self._version = control, self.wall.version
        return way

    def want(self, patch: Ints) -> bool:
        """Let the wall follow these patches within the step; whether it did not before."""
        return self.wall is not None and self.wall.want(self.first + self.patches.net[patch])

    def closest(self, x: Floats, patch: Ints, at: Floats) -> tuple[Foot, Floats, NDArray[np.bool_]]:
        """Feet from those of before, which are brought along in place; shares of the control points, and the rim."""
        *foot, shares, rim = kernel.closest(self.patches, self.control, self.edge, x, patch, at)
        return Foot(*foot), shares, rim > 0

    def second_forms(self, patch: Ints, at: Floats, distance: Floats) -> tuple[Floats, Floats, Floats]:
        """See `subdivision_kernel.second_forms`."""
        forms: tuple[Floats, Floats, Floats] = kernel.second_forms(self.patches, self.control, patch, at, distance)
        return forms

    def search(self, x: Floats) -> tuple[Ints, Floats]:
        """Patches and places of the closest points of x (q, 3), looking at all patches near enough."""
        patch, at = index.search(self.patches, self.control, self.edge, *self._index(), np.ascontiguousarray(x))
        return patch, at

    def _index(self) -> tuple[Ints, Ints, Floats]:
        if self._boxed != self._version or self._boxed == -1:
            index.fit(self.patches, self.control, self._order, self._leaves, self._boxes)
            self._boxed = self._version if self.wall is not None else 0
        return self._order, self._leaves, self._boxes

    # --- as an implicit surface -----------------------------------------------------------------------------------

    def nearest(self, x: Floats, guess: Floats | None = None) -> Foot:
        """The foot of each x; beyond the rim the distance is that of the rim."""
        return self.closest(np.ascontiguousarray(x), *self.search(x))[0]

    def potential(self, x: Floats) -> Floats:
        """The signed distance, (q) [m]."""
        return self.nearest(x).distance

    def gradient(self, x: Floats) -> Floats:
        """The unit normal at the foot, (q, 3)."""
        return self.nearest(x).normal

    def hessian(self, x: Floats) -> Floats:
        """Of the distance, (q, 3, 3) [1/m]."""
        return self.nearest(x).curvature

    def lipschitz(self, a: Floats, b: Floats) -> Floats:
        """One."""
        return np.ones(len(a))

    def lower_bound(self, x: Floats) -> Floats:
        """A signed distance from the boxes about patches, nowhere larger in magnitude than the true one, (q) [m]."""
        bound: Floats = index.lower_bounds(self.patches, self.control, *self._index(), np.ascontiguousarray(x))
        return bound


def surfaces_of(body: Body, tags: Sequence[str]) -> list[BodySurface]:
    """The surfaces of a body that devices touch, which it learns of. Collective.

    Raises
    ------
    ValueError
        for facets that are no smooth surface, a body that is neither linear and held by supports nor rigid and held.
    """
    parts, first = [], 0
    matrices, numbers = [], []
    for tag in tags:
        own, facets = _facets(body, tag)
        try:
            patches, Q = smooth(facets, len(own))
        except ValueError as error:
            raise ValueError(f"body {body.name!r}: tag {tag!r}: {error}") from None
        parts.append((patches, first, Q))
        matrices.append(Q)
        numbers.append(own)
        first += Q.shape[0]
    every = np.unique(np.concatenate(numbers))
    wide = [
        sp.csr_array((Q.data, np.searchsorted(every, own)[Q.indices], Q.indptr), shape=(Q.shape[0], len(every)))
        for Q, own in zip(matrices, numbers, strict=True)
    ]
    if isinstance(body, Wall):
        body.touch(every, sp.csr_array(sp.vstack(wide)))
        places, wall = body.places, body
    else:
        if not isinstance(body, RigidBody) or body.modes.shape[1]:
            raise ValueError(f"body {body.name!r}: a beam touches a solid, or a rigid body that supports hold")
        places, wall = sp.vstack(wide) @ _positions(body, every), None
    return [BodySurface(patches, start, places[start : start + Q.shape[0]], wall) for patches, start, Q in parts]


def _facets(body: Body, tag: str) -> tuple[Ints, Ints]:
    """Global numbers of the nodes of a tag's facets, and the facets on these, of all ranks. Collective."""
    piece, comm = body.space.piece, body.space.comm
    mine = piece.nodes[body.facets(tag)]
    every = np.concatenate(comm.allgather(mine)) if comm.size > 1 else mine
    _, once = np.unique(np.sort(every[:, :3], axis=1), axis=0, return_index=True)
    numbers, facets = np.unique(every[np.sort(once)], return_inverse=True)
    return numbers, facets.reshape(-1, every.shape[1])


def _positions(body: Body, numbers: Ints) -> Floats:
    """Undeformed positions of nodes by their global numbers, replicated, (n, 3). Collective."""
    result = np.full((len(numbers), 3), -np.inf)
    local = np.flatnonzero(np.isin(body.space.piece.nodes, numbers))
    result[np.searchsorted(numbers, body.space.piece.nodes[local])] = body.points[local]
    if body.space.comm.size > 1:
        body.space.comm.Allreduce(result.copy(), result, op=_maximum())
    return result


def _maximum() -> Any:
    from mpi4py import MPI

    return MPI.MAX
