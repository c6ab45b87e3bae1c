"""The compiled mortar integrals against convex hulls, a root finder and numpy."""

from itertools import product

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.optimize import fsolve, linprog
from scipy.spatial import ConvexHull, Delaunay, HalfspaceIntersection

from contact.mortar.facet_tree import FacetTree
from contact.mortar.mortar_kernel import integrate
from fem.elements import quadrature, shape, shape_gradient

Floats = NDArray[np.float64]
RULE = 15
CORNERS = {1: np.array([[0.0], [1.0]]), 2: np.array([[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]])}


def _facets(dim: int, order: int, rng: np.random.Generator) -> tuple[Floats, Floats, Floats]:
    """Two facets that look at each other, one above the other, bent where of second order; normals of the first."""
    middles = np.array([[0.5]]) if dim == 1 else np.array([[0.5, 0.0], [0.5, 0.5], [0.0, 0.5]])
    nodes = CORNERS[dim] if order == 1 else np.vstack([CORNERS[dim], middles])
    x = np.column_stack([nodes, np.zeros(len(nodes))])
    y = np.column_stack([nodes[:, ::-1] + rng.uniform(-0.4, 0.4, dim), np.full(len(nodes), 0.2)])
    # Normals out of the first are along +z, those of the second along −z: 2D facets run to the left of that.
    x, y = (x[[1, 0, *range(2, len(x))]], y) if dim == 1 else (x, y)
    x = x + 0.05 * rng.uniform(-1, 1, x.shape)
    y = y + 0.05 * rng.uniform(-1, 1, y.shape)
    n = np.column_stack([0.2 * rng.uniform(-1, 1, (len(x), dim)), np.ones(len(x))])
    return x, y, n / np.linalg.norm(n, axis=1)[:, None]


def _pieces(dim: int, order: int) -> Floats:
    corners = CORNERS[dim]
    if order == 1:
        return corners[None]
    if dim == 1:
        return np.stack([[[0.0], [0.5]], [[0.5], [1.0]]])
    a, b, c = (corners[0] + corners[1]) / 2, (corners[1] + corners[2]) / 2, (corners[2] + corners[0]) / 2
    return np.array([[corners[0], a, c], [corners[1], b, a], [corners[2], c, b], [a, b, c]])


def _polygon(q: Floats) -> Floats | None:
    """Corners of the part of the simplex q that lies in the unit simplex."""
    dim = q.shape[1]
    if dim == 1:
        low, high = max(0.0, q.min()), min(1.0, q.max())
        return np.array([[low], [high]]) if low < high else None
    unit = np.array([[-1.0, 0, 0], [0, -1, 0], [1, 1, -1]])
    planes = np.vstack([unit, ConvexHull(q).equations])
    size = np.linalg.norm(planes[:, :2], axis=1)
    best = linprog([0, 0, -1], np.column_stack([planes[:, :2], size]), -planes[:, 2], bounds=[(None, None)] * 3)
    if best.x[2] < 1e-9:
        return None
    return np.asarray(HalfspaceIntersection(planes, best.x[:2]).intersections)


def _oracle(x: Floats, y: Floats, n: Floats, clearance: Floats, dim: int, order: int) -> dict[str, Floats]:
    """Σ over pieces and polygons of the same integrals, point by point."""
    points, weights = quadrature(dim, RULE)
    pieces = _pieces(dim, order)
    result: dict[str, Floats] = {}
    for a, b in product(pieces, pieces):
        A, B = shape(a, order) @ x, shape(b, order) @ y
        edges = (A[1:] - A[0]).T
        normal = np.linalg.svd(edges)[0][:, -1]
        q = np.linalg.lstsq(edges, (B - A[0]).T, rcond=None)[0].T
        corners = _polygon(q)
        if corners is None:
            continue
        parts = [corners] if dim == 1 else corners[Delaunay(corners).simplices]
        for part in parts:
            for xi, w in zip(points, weights, strict=True):
                z = part[0] + xi @ (part[1:] - part[0])
                ref = a[0] + z @ (a[1:] - a[0])
                tangents = np.einsum("aj,ad->jd", shape_gradient(ref[None], order)[0], x)
                area = np.sqrt(np.linalg.det(tangents @ tangents.T))
                scale = abs(np.linalg.det(part[1:] - part[0])) * abs(np.linalg.det(a[1:] - a[0]))
                N = shape(ref[None], order)[0]
                psi = shape(ref[None], 1)[0]
                nu = N @ n / np.linalg.norm(N @ n)
                start = b[0] + np.linalg.lstsq((q[1:] - q[0]).T, z - q[0], rcond=None)[0] @ (b[1:] - b[0])

                def miss(s: Floats, at: Floats = N @ x, nu: Floats = nu) -> Floats:
                    return np.asarray(shape(s[None, :dim], order)[0] @ y - at - s[dim] * nu)

                foot = fsolve(miss, [*start, abs(normal @ (B[0] - A[0]))], xtol=1e-12)
                M, W = shape(foot[None, :dim], order)[0], w * area * scale
                terms = {
                    "covered": np.array(w * scale),
                    "area": W * psi,
                    "gram": W * np.outer(psi, psi),
                    "gap": W * psi * (foot[dim] + N @ clearance),
                    "mean": W * np.outer(psi, nu),
                    "own": W * np.einsum("i,k,d->ikd", psi, N, nu),
                    "other": W * np.einsum("i,k,d->ikd", psi, M, nu),
                }
                for key, value in terms.items():
                    result[key] = result.get(key, 0.0) + value
    return result


@pytest.mark.parametrize(("dim", "order"), [(1, 1), (1, 2), (2, 1), (2, 2)])
def test_integrals(dim: int, order: int) -> None:
    """Random pairs of facets, bent and with any normals."""
    rng = np.random.default_rng(dim + 10 * order)
    for _ in range(3 if dim == 1 else 1):
        x, y, n = _facets(dim, order, rng)
        clearance = rng.uniform(0, 0.1, len(x))
        expected = _oracle(x, y, n, clearance, dim, order)
        pieces = np.ascontiguousarray(_pieces(dim, order))
        corners, corners_m = (
            np.einsum("sqk,kd->sqd", [shape(p, order) for p in pieces], facet)[None] for facet in (x, y)
        )
        pairs = np.zeros((1, 2), dtype=np.int64)
        found = integrate(
            pairs,
            x[None],
            n[None],
            pieces,
            corners,
            y[None],
            pieces,
            corners_m,
            *quadrature(dim, RULE),
            clearance[None],
            1.0,
            1.0,
            False,
        )
        for key, value in zip(("covered", "area", "gram", "gap", "mean", "own", "other"), found, strict=True):
            np.testing.assert_allclose(value[0], expected[key], rtol=1e-7, atol=1e-10, err_msg=key)


def test_search_along_normals() -> None:
    """Every facet whose box a ball meets on its way is found, whatever the sizes, against all pairs tried."""
    rng = np.random.default_rng(0)
    centre = rng.uniform(-1, 1, (300, 3))
    half = np.abs(rng.normal(size=(300, 3))) * rng.choice([1e-3, 0.1, 1.0], (300, 1)) * 0.2
    tree = FacetTree(centre - half, centre + half)
    balls, radii = rng.uniform(-1, 1, (40, 3)), rng.choice([1e-3, 0.2], 40)
    axes = rng.normal(size=(40, 3))
    axes /= np.linalg.norm(axes, axis=1)[:, None]
    found = {tuple(pair) for pair in tree.along(balls, radii, axes, np.zeros(40), 0.5, 0.1).tolist()}
    # Points of the balls' ways, at their axes: every box that one of them is in must be found
    s = np.linspace(-0.1, 0.5, 200)
    way = balls[:, None] + s[:, None] * axes[:, None]
    inside = np.all(np.abs(way[:, None] - centre[:, None]) <= half[:, None], axis=-1).any(axis=-1)
    met = set(zip(*(i.tolist() for i in np.nonzero(inside)), strict=True))
    assert len(met) > 20
    assert met <= found
    assert len(found) < 40 * 300 / 4
