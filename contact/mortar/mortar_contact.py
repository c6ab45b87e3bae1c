"""Contact between the surfaces of two deformable bodies by mortar constraints.

One side carries multipliers. With its outward normals n, the gap g(x) from its point x along n to the other side and
the hat function ψ_i of its vertex i, the constraint of i is the weighted mean

    δ_i = ∫ψ_i g ds / a_i ≥ 0,  a_i = ∫ψ_i ds,    H_i = ∫ψ_i n·(N′ − N) ds / a_i,

over the part of the side that looks at the other body; λ_i is a force and p_h = Σ_i ψ_i λ_i / a_i the pressure. A
vertex that looks at nothing has no row. The same points and one normal make both sides' entries, so that force and
counterforce, and their moments, cancel to round-off.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from contact.mortar.facet_tree import FacetTree
from contact.mortar.facets import Facets, bulge, normals_of
from contact.mortar.mortar_kernel import integrate
from contact.pairs import Constraints, Recorded, Stiffness, check_interference
from contact.rows import Rows, SparseRows, owned_rows
from fem.body import Body
from fem.elasticity import Elasticity
from fem.elements import quadrature
from fem.loads import evaluate
from fem.regions import Regions

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

DEGREE = {1: 7, 2: 4}  # ψ N r is of degree 4 on straight second-order facets in axisymmetry
LOOKING = 1e-12  # of ∫ψ_i over the whole support: less is round-off of coinciding edges
ALIKE = 1.05  # sizes of facets whose ratio is below this are the same
DEPENDENT = 1e-6


@dataclass(frozen=True)
class Assembled:
    """Rows of H on either body before the division by a_i, as lists of entries, and replicated sums (c, …).

    `openings` are ∫ψ_i g, what gaps are with vertex multipliers.
    """

    own: tuple[Ints, Ints, Floats]
    other: tuple[Ints, Ints, Floats]
    areas: Floats
    gaps: Floats
    openings: Floats
    normals: Floats


class MortarContact:
    """Facets of a body against facets of another.

    Parameters
    ----------
    facets, others : of the side that carries multipliers, and of the other one
    multiplier : ``vertex``: hat functions ψ_i, which are positive, so that p_h ≥ 0 everywhere; the choice by default.
        ``dual``: the dual basis φ_i in place of ψ_i, with ∫φ_i ψ_j = δ_ij ∫ψ_j on the part of each facet that looks at
        the other. On first-order facets a force then acts on one vertex of its side and W is closer to diagonal, which
        damps oscillations of the pressure; but φ_i is negative on a part of its support, so that p_h may be.
    finite : whether pairing and normals follow the motion. The first pass of a step takes them from the last accepted
        state, later ones from the present state.
    interference : how deep [m] the bodies may start in each other
    clearance : an initial gap besides that of the meshes [m], a number or a function (x, t) of the multiplier side's
        places: profiles of the linear theory, press fits of parts that are drawn at their common radius

    Parts look at each other over half the larger body's size, and through each other over a twentieth of the smaller
    one's, twice the interference, and what they have moved in the step: deeper in, one would see the other's far side.

    Source: Puso and Laursen, CMAME 193 (2004); Wohlmuth, SIAM J. Numer. Anal. 38 (2000) for dual bases; Popp, Seitz,
    Gee and Wall, CMAME 264 (2013) for those of partly covered facets.
    """

    def __init__(
        self,
        name: str,
        facets: Facets,
        others: Facets,
        multiplier: Literal["vertex", "dual"] = "vertex",
        finite: bool = False,
        interference: float = 0.0,
        clearance: Any = 0.0,
    ) -> None:
        self.name, self.facets, self.others = name, facets, others
        self.dual, self.finite, self.interference = multiplier == "dual", finite, interference
        if facets.X.shape[2] != others.X.shape[2] or _axisymmetric(facets.body) != _axisymmetric(others.body):
            raise ValueError(
                f"contact {name!r}: bodies {facets.body.name!r} and {others.body.name!r} do not live in the same space"
            )
        smaller, self.length = sorted((facets.body.size, others.body.size))
        self.reach, self.depth = self.length / 2, 2 * interference + smaller / 20
        self._supports = facets.supports()
        self._places = facets.places()
        X = facets.X.reshape(-1, facets.X.shape[2])
        self._clearance = np.ascontiguousarray(evaluate(clearance, X, 0.0, 1).reshape(facets.X.shape[:2]))
        self._states: list[tuple[Floats, Floats, Assembled]] = []
        self._accepted = facets.displacements, others.displacements
        self._stepping = False
        self._detected: Assembled | None = None

    @property
    def count(self) -> int:
        """The number c of vertices of the multiplier side."""
        return len(self.facets.vertices)

    # --- the pair -------------------------------------------------------------------------------------------------

    def start(self) -> None:
        """Refuse an interference deeper than declared, and surfaces that do not look at each other.

        Means with the hat functions decide: a dual function has negative values, and with it a bent gap that is open
        everywhere may have a mean below zero.
        """
        found = self._assemble(*self._accepted) if self.finite else self._undeformed()
        looking = self._looking(found)
        if not self.finite and not looking.any():
            raise ValueError(
                f"contact {self.name!r}: no part of {self.facets.body.name}/{self.facets.tag} looks at "
                f"{self.others.body.name}/{self.others.tag} from at most {self.reach:.6g} m away, or "
                f"{self.depth:.6g} m inside it; bodies that start deeper in each other must declare their interference"
            )
        depths = found.openings[looking] / found.areas[looking]
        check_interference(self.name, depths, self.interference, self.length)

    def begin(self) -> None:
        """Pairing and normals are those of the last accepted state until the bodies are corrected."""
        self._stepping = False

    def moved(self) -> None:
        """The bodies have moved within the step."""
        self._stepping = True

    def accept(self) -> None:
        """Take the present state as the start of the next step's motion."""
        self._accepted = self.facets.displacements, self.others.displacements

    def detect(self) -> Constraints | None:
        """The constraints about the present state, or about the undeformed one in small sliding."""
        if not self.finite and self._detected is not None:
            return None
        u = self._accepted if not self._stepping else (self.facets.displacements, self.others.displacements)
        found = self._assemble(*u) if self.finite else self._undeformed()
        if found is self._detected:
            return None
        self._detected = found
        looking = self._looking(found)
        a = np.where(looking, found.areas, 1.0)
        H: dict[Any, Rows] = {}
        for side, entries in ((self.facets, found.own), (self.others, found.other)):
            rows, unknowns, values = entries
            kept = looking[rows]
            rows = rows[kept]
            values = values[kept] / a[rows]
            matrix = owned_rows(side.body.space, self.count, rows, unknowns[kept], values)
            body = side.body
            H[body] = SparseRows(matrix + H[body].sparse() if body in H else matrix)
        offset = found.gaps / a
        if self.finite:
            offset = offset - self._product(found, *u) / a
        return Constraints(
            H,
            np.where(looking, offset, np.inf),
            -found.normals / a[:, None],
            self._places,
            np.where(looking, found.areas, 0.0),
            self.length,
        )

    def gaps(self) -> Floats:
        """Mean gaps of the present state; infinite where a vertex looks at nothing."""
        u = self.facets.displacements, self.others.displacements
        if self.finite:
            found = self._assemble(*u)
            gaps = found.gaps
        else:
            found = self._undeformed()
            gaps = found.gaps + self._product(found, *u)
        looking = self._looking(found)
        return np.where(looking, gaps / np.where(looking, found.areas, 1.0), np.inf)

    def stiffen(self, lam: Floats, bulging: bool = False) -> Stiffness:
        """Nothing: bodies are linear, and curvature stays out of A."""
        return Stiffness()

    def crossed(self) -> bool:
        """Never, where the gaps are not negative."""
        return False

    def recorded(self) -> Recorded:
        """The vertices that look at the other body, at their nodes."""
        found = self._detected or self._undeformed()
        rows = np.flatnonzero(self._looking(found))
        return self.facets.body, rows, self.facets.vertices[rows], found.areas[rows], None

    # --- integrals ------------------------------------------------------------------------------------------------

    def _looking(self, found: Assembled) -> NDArray[np.bool_]:
        looking: NDArray[np.bool_] = found.areas > LOOKING * self._supports
        return looking

    def _undeformed(self) -> Assembled:
        return self._assemble(np.zeros_like(self.facets.X), np.zeros_like(self.others.X))

    def _product(self, found: Assembled, u: Floats, v: Floats) -> Floats:
        """Σ entries × displacements of the facets' nodes, (c), summed over the ranks. Collective."""
        result = np.zeros(self.count)
        for side, (rows, unknowns, values), w in ((self.facets, found.own, u), (self.others, found.other, v)):
            first = side.first.ravel()
            D = w.shape[2]
            by_unknown = np.empty(int(first.max()) + D)
            for d in range(D):
                by_unknown[first + d] = w[:, :, d].ravel()
            result += np.bincount(rows, values * by_unknown[unknowns], minlength=self.count)
        total: Floats = self.facets.body.space.comm.allreduce(result)
        return total

    def _assemble(self, u: Floats, v: Floats) -> Assembled:
        """Integrals of the state with the nodal displacements u and v; those of the last two states are kept."""
        for kept_u, kept_v, kept in self._states:
            if np.array_equal(kept_u, u) and np.array_equal(kept_v, v):
                return kept
        found = self._integrate(u, v)
        self._states = [(u, v, found), *self._states[:1]]
        return found

    def _integrate(self, u: Floats, v: Floats) -> Assembled:
        side, other = self.facets, self.others
        x, y = side.X + u, other.X + v
        pieces, corners = side.pieces(x)
        pieces_m, corners_m = other.pieces(y)
        # Within a step the bodies may be as deep in each other as they have moved
        depth = self.depth + sum(_largest(now - then) for now, then in zip((u, v), self._accepted, strict=True))
        pairs = self._candidates(x, y, corners, depth)
        points, weights = quadrature(side.dim, DEGREE[side.dim])
        covered, area, gram, gap, mean, own, across = integrate(
            pairs,
            np.ascontiguousarray(x),
            side.normals(x),
            pieces,
            corners,
            np.ascontiguousarray(y),
            pieces_m,
            corners_m,
            points,
            weights,
            self._clearance,
            self.reach,
            depth,
            _axisymmetric(side.body),
        )
        kept = np.flatnonzero(_nearest(pairs[:, 0], covered, gap, area, weights.sum()))
        f, h = pairs[kept].T
        area, gram, gap, mean, own, across = (a[kept] for a in (area, gram, gap, mean, own, across))
        opening = gap
        if self.dual:
            basis = _dual(f, area, gram)
            gap, mean, own, across = (
                np.einsum("pij,pj...->pi...", basis, a, optimize=True) for a in (gap, mean, own, across)
            )
        rows = side.rows[f]
        sums = np.zeros((self.count, 3 + x.shape[2]))
        np.add.at(sums, rows, np.concatenate([np.stack([area, gap, opening], axis=2), mean], axis=2))
        sums = side.body.space.comm.allreduce(sums)
        return Assembled(
            _entries(rows, side.first[f], -own),
            _entries(rows, other.first[h], across),
            sums[:, 0],
            sums[:, 1],
            sums[:, 2],
            sums[:, 3:],
        )

    def _candidates(self, x: Floats, y: Floats, corners: Floats, depth: float) -> Ints:
        """Pairs of this rank's facets and the other side's that may look at each other, (p, 2), by facet."""
        mine = self.facets.mine
        x, corners = x[mine], corners[mine]
        swell, D = bulge(y, self.facets.dim), x.shape[2]
        tree = FacetTree(y.min(axis=1) - swell[:, None], y.max(axis=1) + swell[:, None])
        centres = x[:, :D].mean(axis=1)
        radii = np.linalg.norm(x - centres[:, None], axis=2).max(axis=1, initial=0.0) + bulge(x, self.facets.dim)
        edges = corners[:, :, 1:] - corners[:, :, :1]
        n, _ = normals_of(edges)
        axes = n.sum(axis=1)
        axes /= np.linalg.norm(axes, axis=1)[:, None]
        # A piece's own normal leaves the facet's axis by the sine of their angle
        widening = np.linalg.norm(n - axes[:, None], axis=2).max(axis=1, initial=0.0)
        pairs = tree.along(centres, radii, axes, widening, self.reach, depth)
        pairs[:, 0] += mine.start
        return pairs


def sides(first: Facets, second: Facets, choice: str) -> tuple[Facets, Facets]:
    """The multiplier side and the other.

    By ``auto`` the side with the finer facets carries the multipliers, as those of a coarse side would let the nodes of
    a fine one pass between them; where they are alike (within 5 %) the softer body, whose unknowns follow the other's
    shape; where these are alike too, the first. A rigid body carries none.
    """
    if choice != "auto":
        return (first, second) if choice == "body" else (second, first)
    E = [_modulus(side.body) for side in (first, second)]
    h = [float(side.areas().mean()) ** (1 / side.dim) for side in (first, second)]
    if np.isfinite(E).all() and max(h) > ALIKE * min(h):
        return (first, second) if h[0] < h[1] else (second, first)
    return (first, second) if E[0] <= E[1] else (second, first)


def _modulus(body: Body) -> float:
    """The least of the moduli of a body's materials; infinite of a rigid one."""
    model: Any = body.model
    laws = [law for law, _ in model.parts] if isinstance(model, Regions) else [model]
    return min(law.E if isinstance(law, Elasticity) else np.inf for law in laws)


def _largest(u: Floats) -> float:
    return float(np.sqrt((u**2).sum(axis=2).max(initial=0.0)))


def _axisymmetric(body: Body) -> bool:
    return bool(body.model.axisymmetric)


def _entries(rows: Ints, first: Ints, values: Floats) -> tuple[Ints, Ints, Floats]:
    """Entries (row, unknown, value) of blocks (p, d, k, D) at rows (p, d) and nodes whose first unknown is (p, k)."""
    D = values.shape[3]
    unknowns = first[:, None, :, None] + np.arange(D)
    return (
        np.broadcast_to(rows[:, :, None, None], values.shape).ravel(),
        np.broadcast_to(unknowns, values.shape).ravel(),
        values.ravel(),
    )


def _nearest(facet: Ints, covered: Floats, gap: Floats, area: Floats, whole: float) -> NDArray[np.bool_]:
    """The pairs to keep: those that see each other; of several layers that a facet sees the nearest that cover it."""
    seen = covered > 0
    crowded = np.bincount(facet, covered, minlength=1)[facet] > whole * (1 + 1e-6) if len(facet) else seen
    if not crowded.any():
        return seen
    distance = np.abs(gap.sum(axis=1)) / np.where(seen, area.sum(axis=1), 1.0)
    order = np.lexsort((distance, facet))
    sums = np.cumsum(covered[order])
    start = np.searchsorted(facet[order], facet[order])
    before = np.empty_like(sums)
    before[order] = sums - covered[order] - np.append(0.0, sums)[start]
    kept: NDArray[np.bool_] = seen & (~crowded | (before < whole * (1 - 1e-6)))
    return kept


def _dual(facet: Ints, area: Floats, gram: Floats) -> Floats:
    """φ_i = Σ_j basis_ij ψ_j for each pair, (p, d, d): dual to ψ on all that its facet looks at.

    Where ψ are dependent there to 1e-6, on a sliver, φ = ψ.
    """
    _, index = np.unique(facet, return_inverse=True)
    D, M = np.zeros((index.max(initial=-1) + 1, area.shape[1])), np.zeros((index.max(initial=-1) + 1, *gram.shape[1:]))
    np.add.at(D, index, area)
    np.add.at(M, index, gram)
    root = np.sqrt(np.einsum("fii->fi", M))
    scaled = M / root[:, :, None] / root[:, None, :]
    sliver = np.linalg.eigvalsh(scaled)[:, 0] < DEPENDENT
    identity = np.eye(area.shape[1])
    basis = D[:, :, None] * np.linalg.inv(np.where(sliver[:, None, None], identity, M))
    basis = np.where(sliver[:, None, None], identity, basis)
    result: Floats = basis[index]
    return result
