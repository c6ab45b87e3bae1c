"""What may touch what: contact points against a rigid surface, or one body's point against another's.

A pair turns the bodies' present state into linear constraints δ(u) = H u + offset, and measures true gaps independently
of them for the certificate. Where displacements are small against the curvature of the surface (`SmallSliding`) the
constraints are formed once; otherwise (`FiniteSliding`) detection along the motion gives tangent planes anew in each
pass.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from contact.coupling import Coupling
from contact.points import ContactPoints
from contact.rows import Rows, SparseRows
from contact.surfaces.detection import closest_points, first_root, root_along
from contact.surfaces.implicit import Surface

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]
Bools = NDArray[np.bool_]


@dataclass(frozen=True)
class Constraints:
    """Linear constraints δ = Σ_b H_b u_b + offset ≥ 0.

    H : for each body, the columns of its owned unknowns (c, owned)
    offset : replicated, (c) [m]
    normals, places : unit normals and undeformed positions, replicated, (c, D)
    areas : replicated, (c)
    length : what gaps are measured against: the body's size, a device's radius [m]
    close : which of the constraints that were met the contact problem should hold already, (c); None for all
    """

    H: dict[Any, Rows]
    offset: Floats
    normals: Floats
    places: Floats
    areas: Floats
    length: float
    close: Bools | None = None

    @property
    def count(self) -> int:
        """The number c of constraints."""
        return len(self.offset)


class Stiffness(NamedTuple):
    """What the curvature of a pair's gaps leaves to others when it enters A.

    brace : the stiffness β across each contact that A has besides it, (c) [N/m]; None for none
    coupling : curvature that A leaves out, because two bodies share it
    """

    brace: Floats | None = None
    coupling: Coupling | None = None


# Body, rows among the pair's constraints (k), their nodes (k) and areas (k), and where they touch, (k, 3) [m] or None
# for the deformed places of the nodes.
Recorded = tuple[Any, Ints, Ints, Floats, Floats | None]


class Pair(Protocol):
    """A pair of things that may touch. Its methods are collective."""

    name: str

    def start(self) -> None:
        """Check the initial state; ValueError for an interference that nobody declared."""

    def begin(self) -> None:
        """A step begins."""

    def moved(self) -> None:
        """The bodies have moved within the step."""

    def detect(self) -> Constraints | None:
        """Linear constraints about the present state; None where they are those of the last call."""

    def gaps(self) -> Floats:
        """True gaps of the present state, in the order of the last constraints, (c) [m]."""

    def stiffen(self, lam: Floats, bulging: bool = False) -> Stiffness:
        """Tell the bodies the curvature of the surface under forces λ (c), for their next A; what else there is to it.

        Curvature that may make A indefinite is left out unless `bulging`.
        """

    def crossed(self) -> bool:
        """Whether a point went through the surface on its way from the last accepted state."""

    def recorded(self) -> Recorded:
        """The constraints that a record keeps."""

    def accept(self) -> None:
        """Take the present state as the start of the next step's motion."""


class _Unbent:
    """Of a pair whose bodies deform little: curvature stays out of A, and the certificate's gaps say all."""

    points: ContactPoints

    def recorded(self) -> Recorded:
        """All of them, at their nodes."""
        p = self.points
        return p.body, np.arange(p.count), p.numbers, p.areas, None

    def begin(self) -> None:
        """Nothing."""

    def moved(self) -> None:
        """Nothing."""

    def stiffen(self, lam: Floats, bulging: bool = False) -> Stiffness:
        """Nothing."""
        return Stiffness()

    def crossed(self) -> bool:
        """Never, where the gaps are not negative."""
        return False


class SmallSliding(_Unbent):
    """Points whose gap is measured along fixed normals from their undeformed positions.

    The normal of a point is `direction` where given (the gap is then the distance to the surface along it: the linear
    theory of contact, Kikuchi and Oden 1988), else that of the surface's closest point.

    Parameters
    ----------
    interference : how deep [m] a point may start inside the surface
    """

    def __init__(
        self,
        name: str,
        points: ContactPoints,
        surface: Surface,
        direction: Floats | None = None,
        interference: float = 0.0,
    ) -> None:
        self.name, self.points, self.surface, self.interference = name, points, surface, interference
        x = points.positions()
        if direction is None:
            n = surface.gradient(closest_points(surface, x))
            self.normals = n / np.linalg.norm(n, axis=1)[:, None]
        else:
            d = np.asarray(direction, dtype=float)
            self.normals = np.broadcast_to(d / np.linalg.norm(d), x.shape)
        self._constraints: Constraints | None = None

    def _distances(self) -> Floats:
        """Distances of the undeformed points to the surface along their normals, (q)."""
        x, reach = self.points.positions(), 10 * self.points.body.size
        return _distance_along(self.surface, x, self.normals, reach)

    def start(self) -> None:
        """Refuse an interference deeper than declared."""
        check_interference(self.name, self.points.mean(self._distances()), self.interference, self.points.body.size)

    def detect(self) -> Constraints | None:
        """The constraints, which never change."""
        if self._constraints is not None:
            return None
        p = self.points
        normals = p.mean(self.normals)
        self._constraints = Constraints(
            {p.body: SparseRows(p.matrix(self.normals))},
            p.mean(self._distances()),
            normals,
            p.places,
            p.areas,
            p.body.size,
        )
        return self._constraints

    def gaps(self) -> Floats:
        """Distances plus displacements along the normals, averaged as the constraints are."""
        along = np.einsum("qd,qd->q", self.points.displacements(), self.normals)
        return self.points.mean(self._distances() + along)

    def accept(self) -> None:
        """Nothing: the constraints do not depend on the motion."""


class FiniteSliding(_Unbent):
    """Points that meet the surface somewhere along their motion; tangent planes follow the deformed positions.

    The first pass of a step takes, for each point, the plane where its motion from the last accepted state first meets
    the surface; later passes take the plane at the closest point of its present position (the method's secant update).
    A constraint that no point has met yet is kept off by an infinite offset, at no cost.
    """

    def __init__(self, name: str, points: ContactPoints, surface: Surface, interference: float = 0.0) -> None:
        self.name, self.points, self.surface, self.interference = name, points, surface, interference
        self.tolerance = 1e-3 * points.body.size
        self.accepted = points.displacements()
        self.met = np.zeros(points.count, dtype=bool)

    def start(self) -> None:
        """Refuse an interference deeper than declared; points on the surface or inside it are in contact at once."""
        gaps = self.gaps()
        check_interference(self.name, gaps, self.interference, self.points.body.size)
        # A floating body has no motion along which to meet anything: whatever could hold it is in contact's reach.
        floating = self.points.body.modes.shape[1] > 0
        self.met = (gaps <= 1e-9 * self.points.body.size) | floating

    def accept(self) -> None:
        """Take the present state as the start of the next step's motion."""
        self.accepted = self.points.displacements()

    def detect(self) -> Constraints:
        """Tangent planes about the present state."""
        p = self.points
        X, u = p.positions(), p.displacements()
        root = first_root(self.surface, X + self.accepted, X + u, self.tolerance)
        crossed = np.isfinite(root)
        hit = np.zeros(p.count)
        for r in range(p.rows.shape[1]):
            np.maximum.at(hit, p.rows[:, r], crossed.astype(float))
        new = (p.body.space.comm.allreduce(hit, op=np.maximum) > 0) & ~self.met
        fresh = np.any(new[p.rows], axis=1) & crossed & (root > 0)
        self.met = self.met | new
        foot = closest_points(self.surface, X + u)
        s = root[fresh, None]
        foot[fresh] = X[fresh] + (1 - s) * self.accepted[fresh] + s * u[fresh]
        normals = self.surface.gradient(foot)
        normals /= np.linalg.norm(normals, axis=1)[:, None]
        offset = p.mean(np.einsum("qd,qd->q", X - foot, normals))
        return Constraints(
            {p.body: SparseRows(p.matrix(normals))},
            np.where(self.met, offset, np.inf),
            p.mean(normals),
            p.places,
            p.areas,
            p.body.size,
        )

    def gaps(self) -> Floats:
        """Distances of the deformed points to the surface, averaged as the constraints are."""
        x = self.points.positions() + self.points.displacements()
        return self.points.mean(signed_distance(self.surface, x))


class PointToPoint(_Unbent):
    """One tagged point of a body ahead of one of another body: δ = n·(x₁ − x₂)."""

    def __init__(
        self, name: str, points: ContactPoints, others: ContactPoints, normal: Floats, interference: float = 0.0
    ) -> None:
        self.name, self.points, self.others, self.interference = name, points, others, interference
        n = np.asarray(normal, dtype=float)
        self.normal = n / np.linalg.norm(n)
        self._constraints: Constraints | None = None
        if points.count != 1 or others.count != 1:
            raise ValueError(f"contact {name!r}: a contact between two bodies takes one point of each")

    def _positions(self) -> Floats:
        apart: Floats = (self.points.places - self.others.places) @ self.normal
        return apart

    def start(self) -> None:
        """Refuse an interference deeper than declared."""
        size = max(self.points.body.size, self.others.body.size)
        check_interference(self.name, self._positions(), self.interference, size)

    def detect(self) -> Constraints | None:
        """The constraint, which never changes."""
        if self._constraints is not None:
            return None
        p, o = self.points, self.others
        H: dict[Any, Rows] = {
            p.body: SparseRows(p.matrix(np.broadcast_to(self.normal, (len(p.nodes), len(self.normal))))),
            o.body: SparseRows(o.matrix(np.broadcast_to(-self.normal, (len(o.nodes), len(self.normal))))),
        }
        size = max(p.body.size, o.body.size)
        self._constraints = Constraints(H, self._positions(), self.normal[None], p.places, p.areas, size)
        return self._constraints

    def gaps(self) -> Floats:
        """The distance of the two points along the normal."""
        moved = self.points.mean(self.points.displacements()) - self.others.mean(self.others.displacements())
        apart: Floats = self._positions() + moved @ self.normal
        return apart

    def accept(self) -> None:
        """Nothing: the constraints do not depend on the motion."""


def signed_distance(surface: Surface, x: Floats) -> Floats:
    """Distances to the closest points, negative inside the obstacle, (points) [m]."""
    foot = closest_points(surface, x)
    normals = surface.gradient(foot)
    d: Floats = np.einsum("qd,qd->q", x - foot, normals) / np.linalg.norm(normals, axis=1)
    return d


def check_interference(name: str, gaps: Floats, allowed: float, size: float) -> None:
    """ValueError where a gap starts below −`allowed` by more than round-off of the body's size."""
    depth = float(-gaps.min(initial=0.0))
    if depth > allowed + 1e-9 * size:
        raise ValueError(
            f"contact {name!r}: a point starts {depth:.6g} m inside the surface, more than its "
            f"interference = {allowed:.6g} allows; declare it if it is meant"
        )


def _distance_along(surface: Surface, x: Floats, normals: Floats, reach: float) -> Floats:
    if len(x) and np.all(normals == normals[0]):
        return root_along(surface, x, normals[0], reach)
    return signed_distance(surface, x)
