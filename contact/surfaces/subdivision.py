"""Loop's subdivision surface of second-order triangles: its control points, and each patch as quartic polynomials.

Every facet of six nodes is four control triangles. Their limit surface is a linear, local and convex combination of the
control points, has a continuous normal everywhere, and continuous curvature but at vertices of the mesh that do not
have six neighbours, where it is bounded or nearly so. A middle of an edge always has six, so that a control triangle
has at most one corner that does not; there the surface is a sequence of quartic patches that shrink to the corner by
halves (Stam 1998).

The limit of the nodes themselves lies off them by h²/8 of the mean curvature's vector. Control points 2x − Mx, with Mx
the limit of the nodes x, bring that down to O(h⁴) where the mesh is regular: what is left there is M(2 − M) − 1 =
−(M − 1)².
Across its rim the surface is continued by mirrored control points a + b − c of the triangle (a, b, c) behind the edge
(a, b), so that it ends on a cubic spline of the rim's nodes.

Source: C. Loop, Smooth subdivision surfaces based on triangles, 1987; J. Stam, Evaluation of Loop subdivision surfaces,
SIGGRAPH course notes, 1998.
"""

from __future__ import annotations

from functools import cache
from typing import NamedTuple

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

LEVELS = 24  # halvings towards a corner; what is nearer to it is taken for the last of them
QUARTIC = [(4 - j - k, j, k) for j in range(5) for k in range(5 - j)]
"""Exponents of 1 − v − w, v and w of the Bernstein polynomials."""


class Patches(NamedTuple):
    """The control triangles of a surface, for compiled kernels.

    net : control points of each patch, its corners first, padded with the first of them, (p, K)
    valence : position of its first corner's number of neighbours among those of `tables`, (p)
    across : the patch over each edge (0, 1), (1, 2), (2, 0), −1 at the rim, (p, 3)
    turn : which corner of that patch the edge's second corner is, (p, 3)
    tables : coefficients of quartic Bernstein polynomials from control points: by valence, halvings and quarter
        (the corner's own is left out), (valences, LEVELS, 3, 15, K); of the regular one the first matrix is all
    regular : the position of valence 6
    """

    net: Ints
    valence: Ints
    across: Ints
    turn: Ints
    tables: Floats
    regular: int


def smooth(facets: Ints, nodes: int) -> tuple[Patches, sp.csr_array]:
    """The patches of facets (f, 6) with numbers below `nodes`, and the matrix from nodes to control points.

    Raises
    ------
    ValueError
        where they have not six nodes, or are no surface whose facets meet in pairs, alike oriented.
    """
    if facets.shape[1] != 6:
        raise ValueError("a smooth surface needs second-order facets, of six nodes; set order = 2")
    # The vertex of the mesh comes first: it alone may have other than six neighbours.
    triangles = facets[:, [[0, 3, 5], [1, 4, 3], [2, 5, 4], [3, 4, 5]]].reshape(-1, 3)
    real = len(triangles)
    triangles, ghosts = _mirrored(triangles, nodes)
    twin = _twins(triangles)
    corners = np.arange(3 * real).reshape(real, 3)
    rings = _rings(triangles, twin, corners[:, 0])
    count = (rings >= 0).sum(axis=1)
    if np.any(_rings(triangles, twin, corners[:, 1:].ravel())[:, 6:] >= 0):
        raise ValueError("a facet's middle has other than six neighbours: two facets share no whole edge")
    found = np.unique(count)
    width = max(int(found.max()), 6) + 6
    net = np.repeat(triangles[:real, :1], width, axis=1)
    second = _rings(triangles, twin, corners[:, 1])
    third = _rings(triangles, twin, corners[:, 2])
    for n in found:
        rows = np.flatnonzero(count == n)
        # Rings begin with the corner after next: [v1 v2 …], [v2 v0 r p1 p2 t], [v0 v1 t q1 q2 r3].
        net[rows, 1 : n + 1] = rings[rows, :n]
        net[rows, n + 1 : n + 6] = np.column_stack([second[rows, 3:6], third[rows, 3:5]])
    across, turn = _neighbours(twin, real)
    valences = np.union1d(found, [6])
    tables = np.zeros((len(valences), LEVELS, 3, len(QUARTIC), width))
    for i, n in enumerate(valences):
        own = quartics(int(n))
        tables[i, : len(own), :, :, : n + 6] = own
    patches = Patches(net, np.searchsorted(valences, count), across, turn, tables, int(np.searchsorted(valences, 6)))
    return patches, _control_points(triangles, twin, real, ghosts, nodes)


# --- the mesh of control triangles --------------------------------------------------------------------------------

# Half-edge 3 t + j of triangle t leads from its corner j to corner j + 1.


def _next(half: Ints) -> Ints:
    following: Ints = half - half % 3 + (half + 1) % 3
    return following


def _twins(triangles: Ints) -> Ints:
    """The half-edge that runs the other way, −1 where there is none; ValueError where two run the same way."""
    a, b = triangles.ravel(), np.roll(triangles, -1, axis=1).ravel()
    size = int(triangles.max(initial=0)) + 1
    keys, order = np.unique(a * size + b, return_index=True)
    if len(keys) < len(a):
        raise ValueError("its facets are no surface: an edge has more than two of them, or they are not alike oriented")
    at = np.minimum(np.searchsorted(keys, b * size + a), len(keys) - 1)
    twin: Ints = np.where(keys[at] == b * size + a, order[at], -1)
    return twin


def _mirrored(triangles: Ints, nodes: int) -> tuple[Ints, Ints]:
    """Triangles with those beyond the rim, whose far corners are numbered from `nodes`, and (a, b, c) of these."""
    twin = _twins(triangles)
    flat = triangles.ravel()
    rim = np.flatnonzero(twin < 0)
    a, b, c = flat[rim], flat[_next(rim)], flat[_next(_next(rim))]
    ghost = nodes + np.arange(len(rim))
    leaving = np.full(nodes, -1)
    leaving[a] = np.arange(len(rim))
    if len(np.unique(a)) < len(a):
        raise ValueError("its facets are no surface: two of them share a corner on the rim, and no edge")
    after = leaving[b]
    beyond = [np.column_stack([b, a, ghost]), np.column_stack([b, ghost, ghost[after]])]
    return np.concatenate([triangles, *beyond]), np.column_stack([a, b, c])


def _rings(triangles: Ints, twin: Ints, half: Ints) -> Ints:
    """The neighbours of the half-edges' first corners, counter-clockwise from their second ones, padded with −1."""
    flat = triangles.ravel()
    rings, at, going = [flat[_next(half)]], half, np.ones(len(half), dtype=bool)
    while going.any():
        at = np.where(going, twin[_next(_next(at))], half)
        if np.any(at < 0):
            raise ValueError("its facets are no surface: those about a node do not close")
        going &= at != half
        if going.any():
            rings.append(np.where(going, flat[_next(at)], -1))
        if len(rings) > 64:
            raise ValueError("its facets are no surface: a node has more than 64 neighbours")
    return np.column_stack(rings)


def _neighbours(twin: Ints, real: int) -> tuple[Ints, Ints]:
    """Patches over the edges, and which corner of theirs the second corner of the edge is."""
    over = twin[: 3 * real].reshape(real, 3)
    inside = (over >= 0) & (over < 3 * real)
    return np.where(inside, over // 3, -1), np.where(inside, over % 3, 0)


def _control_points(triangles: Ints, twin: Ints, real: int, ghosts: Ints, nodes: int) -> sp.csr_array:
    """The matrix from node positions to control points, those beyond the rim last, (nodes + ghosts, nodes)."""
    half = np.arange(3 * real)
    _, first = np.unique(triangles[:real].ravel(), return_index=True)
    rings = _rings(triangles, twin, half[first])
    own = triangles.ravel()[first]
    count = (rings >= 0).sum(axis=1)
    omega = _limit_weight(count)
    row, column = np.repeat(own, count), rings[rings >= 0]
    size = nodes + len(ghosts)
    M = sp.csr_array((np.repeat(omega, count), (row, column)), shape=(nodes, size))
    M = M + sp.csr_array((1 - count * omega, (own, own)), shape=(nodes, size))
    beyond = nodes + np.arange(len(ghosts))
    signs = np.repeat([[1.0, 1.0, -1.0]], len(ghosts), axis=0)
    mirror = sp.csr_array((signs.ravel(), (np.repeat(beyond, 3), ghosts.ravel())), shape=(size, nodes))
    extended = (sp.eye_array(size, nodes) + mirror).tocsr()
    result: sp.csr_array = (extended @ (2 * sp.eye_array(nodes) - M @ extended)).tocsr()
    result.eliminate_zeros()
    return result


# --- Loop's rules -------------------------------------------------------------------------------------------------


def _vertex_weight(n: Ints | int) -> Floats:
    """β of each neighbour in the new place of a vertex with n of them."""
    beta: Floats = (5 / 8 - (3 / 8 + np.cos(2 * np.pi / np.asarray(n)) / 4) ** 2) / np.asarray(n)
    return beta


def _limit_weight(n: Ints | int) -> Floats:
    """Weight of each neighbour in the limit of a vertex with n of them."""
    omega: Floats = 1 / (3 / (8 * _vertex_weight(n)) + np.asarray(n))
    return omega


def net_triangles(n: int) -> Ints:
    """The triangles among the control points of a patch whose first corner has n neighbours, (n + 9, 3)."""
    ring = [1, 2, *range(3, n + 1)]
    t, p1, p2, q1, q2 = n + 3, n + 1, n + 2, n + 4, n + 5
    first = [(0, ring[i], ring[(i + 1) % n]) for i in range(n)]
    second = [(1, ring[-1], p1), (1, p1, p2), (1, p2, t), (1, t, 2)]
    third = [(2, t, q1), (2, q1, q2), (2, q2, ring[2])]
    return np.array(first + second + third)


def _halved(n: int) -> tuple[Ints, Floats, dict[tuple[int, int], int]]:
    """The net halved once: triangles, the matrix to its points, and the point in the middle of an edge."""
    triangles = net_triangles(n)
    wing: dict[tuple[int, int], list[int]] = {}
    for a, b, c in triangles.tolist():
        for u, v, w in ((a, b, c), (b, c, a), (c, a, b)):
            wing.setdefault((min(u, v), max(u, v)), []).append(w)
    K = n + 6
    rows, place = [], {}
    for corner, count in ((0, n), (1, 6), (2, 6)):
        row = np.zeros(K)
        near = {int(v) for tri in triangles.tolist() if corner in tri for v in tri} - {corner}
        row[list(near)] = _vertex_weight(count)
        row[corner] = 1 - count * _vertex_weight(count)
        rows.append(row)
    for (a, b), opposite in wing.items():
        if len(opposite) == 2:
            row = np.zeros(K)
            row[[a, b]], row[opposite] = 3 / 8, 1 / 8
            place[a, b] = place[b, a] = len(rows)
            rows.append(row)
    finer = []
    for tri in triangles.tolist():
        a, b, c = tri
        middles = [place.get(edge, -1) for edge in ((a, b), (b, c), (c, a))]
        known = [v if v < 3 else -1 for v in tri]
        ab, bc, ca = middles
        children = ((known[0], ab, ca), (known[1], bc, ab), (known[2], ca, bc), (ab, bc, ca))
        finer += [child for child in children if min(child) >= 0]
    return np.array(finer), np.array(rows), place


def _net_of(triangles: Ints, corners: tuple[int, int, int]) -> Ints:
    """The control points of the patch on a triangle of a larger net, in the order of `Patches.net`."""
    twin = _twins(triangles)
    a = corners[0]
    (t,) = np.flatnonzero((np.sort(triangles, axis=1) == np.sort(corners)).all(axis=1))
    half = 3 * t + np.flatnonzero(triangles[t] == a)
    (first,), (second,), (third,) = (_rings(triangles, twin, h) for h in (half, _next(half), _next(_next(half))))
    return np.concatenate([[a], first, second[3:6], third[3:5]])


@cache
def _children(n: int) -> tuple[Floats, Floats, Floats, Floats]:
    """From control points of a patch to those of its quarters: at corners 0, 1 and 2, and in the middle."""
    triangles, S, place = _halved(n)
    m01, m12, m20 = place[0, 1], place[1, 2], place[2, 0]
    quarters = ((0, m01, m20), (m01, 1, m12), (m12, m20, m01), (m20, m12, 2))
    own, first, middle, second = (S[_net_of(triangles, quarter)] for quarter in quarters)
    return own, first, second, middle


@cache
def _regular() -> Floats:
    """Quartic Bernstein coefficients of a patch from its twelve control points, (15, 12)."""
    limit = np.zeros((3, 12))
    for corner in range(3):
        near = {int(v) for tri in net_triangles(6).tolist() if corner in tri for v in tri} - {corner}
        limit[corner, list(near)] = 1 / 12
        limit[corner, corner] = 1 / 2
    places = [np.array([[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]])]
    nets = [np.eye(12)]
    for _ in range(2):
        children = _children(6)
        nets = [child @ net for net in nets for child in children]
        places = [quarter for place in places for quarter in _quarters(place)]
    at = np.concatenate(places)
    coefficients: Floats = np.linalg.lstsq(bernstein(at), np.concatenate([limit @ net for net in nets]), rcond=None)[0]
    return coefficients


def _quarters(corners: Floats) -> list[Floats]:
    """The corners of the quarters of a triangle, in the order and orientation of `_children`."""
    a, b, c = corners
    ab, bc, ca = (a + b) / 2, (b + c) / 2, (c + a) / 2
    return [np.array(part) for part in ((a, ab, ca), (ab, b, bc), (ca, bc, c), (bc, ca, ab))]


def bernstein(at: Floats) -> Floats:
    """The quartic Bernstein polynomials at (v, w), (q, 15)."""
    v, w = at.T
    u = 1 - v - w
    choose = [24 // (_factorial(i) * _factorial(j) * _factorial(k)) for i, j, k in QUARTIC]
    return np.column_stack([c * u**i * v**j * w**k for c, (i, j, k) in zip(choose, QUARTIC, strict=True)])


def _factorial(n: int) -> int:
    return (1, 1, 2, 6, 24)[n]


@cache
def quartics(n: int) -> Floats:
    """Coefficients by halvings and quarter (at corner 1, at corner 2, in the middle), (levels, 3, 15, n + 6).

    The regular patch is one polynomial, given as the first of all.
    """
    if n == 6:
        return _regular()[None, None].repeat(3, axis=1)
    own, *others = _children(n)
    tables, deeper = [], np.eye(n + 6)
    for _ in range(LEVELS):
        tables.append([_regular() @ quarter @ deeper for quarter in others])
        deeper = own @ deeper
    return np.array(tables)
