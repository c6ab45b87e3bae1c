"""Numbers taken from a solved system: norms of errors, pressures, and where contact ends."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import brentq
from scipy.special import beta

from contact.points import ContactPoints
from contact.rows import Rows
from fem.body import Body
from fem.geometry import map_cells, map_facets

Floats = NDArray[np.float64]

DEGREE = 8  # of the quadrature of errors, well above that of the elements


def h1_error(body: Body, gradient: Callable[[Floats], Floats]) -> tuple[float, float]:
    """|u − u_h| and |u_h| in the H¹ seminorm, for the exact ∂u_i/∂x_j (points, c, dim). Collective."""
    piece, c = body.space.piece, body.space.components
    error = norm = 0.0
    for start in range(0, len(piece.cells), 4096):
        cells = piece.cells[start : start + 4096]
        mapped = map_cells(piece.points, cells, DEGREE, body.model.axisymmetric)
        u = body.u[body.space.dofs_of(cells)].reshape(len(cells), cells.shape[1], c)
        computed = np.einsum("mqai,maj->mqji", mapped.gradients, u, optimize=True)
        exact = gradient(mapped.points.reshape(-1, body.space.dim)).reshape(computed.shape)
        error += float(np.einsum("mq,mqij->", mapped.weights, (computed - exact) ** 2))
        norm += float(np.einsum("mq,mqij->", mapped.weights, computed**2))
    total = body.space.comm.allreduce(np.array([error, norm]))
    return float(np.sqrt(total[0])), float(np.sqrt(total[1]))


def l2_error(bodies: Sequence[Body], fields: Sequence[Callable[[Floats], Floats]], free: int | None = None) -> float:
    """‖u − u_h‖/‖u‖ in L² over some bodies with their exact displacements (points, c). Collective.

    `free` is a direction in which they may move together: the mean of the error along it does not count.
    """
    squared = norm = volume = mean = 0.0
    shift = np.zeros(bodies[0].space.components)
    if free is not None:  # nearly the mean, so that little cancels below
        errors = [_nodal_errors(body, field)[:, free] for body, field in zip(bodies, fields, strict=True)]
        shift[free] = np.concatenate(errors).sum() / max(1, sum(len(e) for e in errors))
        shift = bodies[0].space.comm.bcast(shift)
    for body, field in zip(bodies, fields, strict=True):
        piece, c = body.space.piece, body.space.components
        sums = np.zeros(4)
        for start in range(0, len(piece.cells), 4096):
            cells = piece.cells[start : start + 4096]
            mapped = map_cells(piece.points, cells, DEGREE, body.model.axisymmetric)
            u = body.u[body.space.dofs_of(cells)].reshape(len(cells), cells.shape[1], c)
            exact = field(mapped.points.reshape(-1, body.space.dim)).reshape(*mapped.weights.shape, c)
            error = np.einsum("qa,mai->mqi", mapped.values, u) - exact - shift
            along = 0.0 if free is None else np.einsum("mq,mq->", mapped.weights, error[..., free])
            sums += [
                *(np.einsum("mq,mqi->", mapped.weights, e**2) for e in (error, exact)),
                mapped.weights.sum(),
                along,
            ]
        squared, norm, volume, mean = np.add((squared, norm, volume, mean), body.space.comm.allreduce(sums))
    return float(np.sqrt(max(squared - mean**2 / volume, 0.0) / norm))


def nodal_error(body: Body, exact: Callable[[Floats], Floats]) -> float:
    """The largest |u − u_h| at the nodes [m]. Collective."""
    worst = float(np.abs(_nodal_errors(body, exact)).max(initial=0.0))
    return float(body.space.comm.allreduce(worst, op=max))


def _nodal_errors(body: Body, exact: Callable[[Floats], Floats]) -> Floats:
    """u_h − u at this rank's nodes, (nodes, c)."""
    c = body.space.components
    errors: Floats = body.u[body.space.displacements].reshape(-1, c) - exact(body.space.piece.points).reshape(-1, c)
    return errors


def displacement_at(body: Body, place: Sequence[float]) -> Floats:
    """The displacement of the node nearest to a place, (D) [m]. Collective."""
    away = np.linalg.norm(body.points - place, axis=1)
    near = int(np.argmin(away)) if len(away) else 0
    found = body.space.comm.allgather((float(away[near]), body.displacement[near]) if len(away) else (np.inf, None))
    nearest: Floats = min(found, key=lambda entry: entry[0])[1]
    return nearest


def unbalanced(H: dict[Any, Rows], lam: Floats) -> float:
    """What is left of force and counterforce, and of their moments about the origin, of the bodies in a contact.

    H : rows of each body; relative to Σ λ and, for moments, to that times the largest body's size. Collective.
    """
    force, moment = np.zeros(3), np.zeros(3)
    for body, rows in H.items():
        x = np.zeros((len(body.space.piece.points), 3))
        x[:, : body.space.dim] = body.space.piece.points
        for axis, e in enumerate(np.eye(3)):
            for motion, sums in ((np.broadcast_to(e, x.shape), force), (np.cross(e, x), moment)):
                u = np.zeros(len(body.space.local_dofs))
                u[body.space.displacements] = motion[:, : body.space.components].ravel()
                sums[axis] += lam @ body.space.comm.allreduce(rows.apply(body.owned(u)))
    size = max(body.size for body in H)
    return float(max(np.abs(force).max(), np.abs(moment).max() / size) / lam.sum())


def trace_moments(body: Body, tag: str, places: Floats, powers: int) -> Floats:
    """∫ N_i x^{2m} ds of the nodes at `places` on the facets `tag`, m < powers, (c, powers). Collective."""
    piece, facets = body.space.piece, body.facets(tag)
    mapped = map_facets(piece.points, facets, DEGREE, body.model.axisymmetric)
    nodes = np.unique(facets)
    moments = np.zeros((len(places), powers))
    if len(nodes):
        row = np.zeros(len(piece.points), dtype=np.int64)
        row[nodes] = _nearest(places, piece.points[nodes])
        for m in range(powers):
            values = np.einsum("fq,qa,fq->fa", mapped.weights, mapped.values, mapped.points[..., 0] ** (2 * m))
            np.add.at(moments[:, m], row[facets], values)
    total: Floats = body.space.comm.allreduce(moments)
    return total


def pressure_at_pole(body: Body, tag: str, places: Floats, lam: Floats, window: float, powers: int = 3) -> float:
    """p(0) [Pa] of the even polynomial with ∫ N_i p ds = λ_i by least squares for the nodes |x| < `window` [m].

    The consistent way back from nodal forces to a pressure: forces of second-order elements alternate from node to
    node, the pressure behind them does not. Collective.
    """
    moments = trace_moments(body, tag, places, powers)
    inside = (np.abs(places[:, 0]) < window) & (moments[:, 0] > 1e-9 * moments[:, 0].max())
    return _even_polynomial(moments[inside], lam[inside], window)


def multiplier_at_pole(s: Floats, p: Floats, window: float, axisymmetric: bool = False, powers: int = 3) -> float:
    """p(0) [Pa] of the even polynomial with ∫ ψ_i p ds = ∫ ψ_i p_h ds by least squares for s < `window` [m].

    p_h is linear between its values p at the places s ≥ 0 (c), the hats ψ_i are those of these places. As a projection
    of the pressure p_h overshoots at a summit, by h²|p″|/12; its moments do not.
    """
    s, p = s[np.argsort(s)], p[np.argsort(s)]
    at, weights = _between(s)
    weights = weights * (2 * np.pi * at if axisymmetric else 1.0)
    hats = np.array([np.interp(at, s, e) for e in np.eye(len(s))[s < window]])
    moments = (hats * weights) @ at[:, None] ** (2 * np.arange(powers))
    return _even_polynomial(moments, (hats * weights) @ np.interp(at, s, p), window)


def _even_polynomial(moments: Floats, values: Floats, window: float) -> float:
    """The value at 0 of Σ c_m x^{2m} with Σ moments_im c_m = values_i in the weighted least-squares sense."""
    scale = window ** (2 * np.arange(moments.shape[1]))
    weight = 1 / np.sqrt(moments[:, 0])
    matrix = moments / scale * weight[:, None]
    return float(np.linalg.lstsq(matrix, values * weight, rcond=None)[0][0])


def contact_width(points: ContactPoints, lam: Floats, terms: int = 2) -> float:
    """Half-width (radius) a [m] of a contact about x = 0 whose pressure ends like √(a² − x²), by moments. Collective.

    With p = √(1−s²) Σ_j c_j s^{2j}, s = x/a, the moments ∫ p x^{2k} dx = a^{2k+1} Σ_j c_j B(j+k+½, 3/2) for k ≤ `terms`
    (in axisymmetry ∫ p r^{2k} 2πr dr with B(j+k+1, 3/2)) determine c and a. Moments are what the work of the contact
    forces gives accurately; single forces near the edge oscillate.
    """
    x = points.positions()[:, 0]
    if np.count_nonzero(lam) <= terms + 1:
        return float("nan")
    M = np.array([lam @ points.mean(x ** (2 * k)) for k in range(terms + 1)])
    # A method that stops inside λ > 0 leaves forces of round-off on open gaps.
    reach = float(np.abs(points.places[lam > 1e-8 * lam.max(), 0]).max())
    return _edge(M, reach, points.body.model.axisymmetric)


def pressure_width(s: Floats, p: Floats, axisymmetric: bool = False, terms: int = 2) -> float:
    """`contact_width` of a pressure that is linear between its values p [Pa] at the places s ≥ 0 [m], (c)."""
    s, p = s[np.argsort(s)], p[np.argsort(s)]
    if np.count_nonzero(p) <= terms + 1:
        return float("nan")
    at, weights = _between(s)
    weights = weights * (2 * np.pi * at if axisymmetric else 1.0) * np.interp(at, s, p)
    M = np.array([weights @ at ** (2 * k) for k in range(terms + 1)])
    return _edge(M, float(s[p > 1e-8 * p.max()].max()), axisymmetric)


def pressure_error(s: Floats, p: Floats, exact: Callable[[Floats], Floats], *breaks: float) -> float:
    """‖p − p_h‖/‖p‖ in L² along s, p_h linear between its values p at the places s (c); `breaks`: where p has kinks."""
    s, p = s[np.argsort(s)], p[np.argsort(s)]
    at, weights = _between(np.union1d(s, breaks))
    difference = np.interp(at, s, p) - exact(at)
    return float(np.sqrt(weights @ difference**2 / (weights @ exact(at) ** 2)))


def _between(s: Floats) -> tuple[Floats, Floats]:
    """Points and weights of Gauss's rule on the intervals between increasing s."""
    x, w = np.polynomial.legendre.leggauss(8)
    half = np.diff(s)[:, None] / 2
    return (s[:-1, None] + half * (1 + x)).ravel(), (half * w).ravel()


def _edge(M: Floats, reach: float, axisymmetric: bool) -> float:
    """a from the moments ∫ p x^{2k} dx, k = 0 … terms; `reach` is that of the loaded points."""
    terms = len(M) - 1
    M = M / M[0]
    first = 1.0 if axisymmetric else 0.5
    k, j = np.arange(terms + 1)[:, None], np.arange(terms)
    shapes = beta(j + k + first, 1.5)

    def last(a2: float) -> float:
        scaled = M / a2 ** np.arange(terms + 1)
        return float(shapes[-1] @ np.linalg.solve(shapes[:-1], scaled[:-1]) - scaled[-1])

    # Loaded points bracket the edge: the root nearest to the outermost of them.
    reach = reach**2
    grid = reach * np.linspace(0.7, 1.3, 241)
    values = np.array([last(a2) for a2 in grid])
    changes = np.flatnonzero(np.diff(np.sign(values)))
    if not changes.size:
        return float("nan")
    i = changes[np.argmin(np.abs(grid[changes] - reach))]
    return float(np.sqrt(brentq(last, grid[i], grid[i + 1], xtol=1e-15 * reach)))


def _nearest(places: Floats, points: Floats) -> NDArray[np.int64]:
    from scipy.spatial import cKDTree

    d = points.shape[1]
    index: NDArray[np.int64] = cKDTree(places[:, :d]).query(points)[1]
    return index
