"""Integrals over simplices, linear or quadratic, written independently of the packages: collapsed Gauss rules."""

from __future__ import annotations

from itertools import product

import numpy as np
import pytest

EDGES = {0: [], 1: [(0, 1)], 2: [(0, 1), (1, 2), (2, 0)], 3: [(0, 1), (1, 2), (0, 2), (0, 3), (1, 3), (2, 3)]}


def rule(dim, n=5):
    """Points (q, dim) and weights of a rule on the unit simplex, exact to degree 2n - dim."""
    x, w = np.polynomial.legendre.leggauss(n)
    x, w = (x + 1) / 2, w / 2
    points, weights = [], []
    for index in product(range(n), repeat=dim):
        left, weight, point = 1.0, 1.0, []
        for i in index:
            point.append(left * x[i])
            weight *= w[i] * left
            left -= point[-1]
        points.append(point)
        weights.append(weight)
    return np.array(points).reshape(-1, dim), np.array(weights)


def shapes(dim, k, xi):
    """N (q, k) and ∂N/∂ξ (q, k, dim)."""
    L = np.column_stack([1 - xi.sum(axis=1), xi])
    g = np.vstack([-np.ones(dim), np.eye(dim)])
    if k == dim + 1:
        return L, np.broadcast_to(g, (len(xi), *g.shape))
    N = [L[:, i] * (2 * L[:, i] - 1) for i in range(dim + 1)] + [4 * L[:, i] * L[:, j] for i, j in EDGES[dim]]
    D = [(4 * L[:, i, None] - 1) * g[i] for i in range(dim + 1)]
    D += [4 * (L[:, i, None] * g[j] + L[:, j, None] * g[i]) for i, j in EDGES[dim]]
    return np.stack(N, axis=1), np.stack(D, axis=1)


def volume(points, cells, f=lambda x: 1.0):
    """∫ f dx over the cells; f takes (..., d)."""
    dim = points.shape[1]
    xi, w = rule(dim)
    N, D = shapes(dim, cells.shape[1], xi)
    X = points[cells]
    J = np.einsum("qka,mkd->mqad", D, X)
    return float((np.linalg.det(J) * f(np.einsum("qk,mkd->mqd", N, X)) * w).sum())


def surface(points, facets):
    """Area, ∮ n dS and ∮ x·n dS over facets, n by the right-hand rule (in 2D to the right of the direction)."""
    dim = points.shape[1]
    xi, w = rule(dim - 1)
    N, D = shapes(dim - 1, facets.shape[1], xi)
    X = points[facets]
    x = np.einsum("qk,fkd->fqd", N, X)
    t = np.einsum("qka,fkd->fqad", D, X)
    n = np.stack([t[..., 0, 1], -t[..., 0, 0]], axis=-1) if dim == 2 else np.cross(t[..., 0, :], t[..., 1, :])
    return (
        float((np.linalg.norm(n, axis=-1) * w).sum()),
        (n * w[:, None]).sum(axis=(0, 1)),
        float(((x * n).sum(axis=-1) * w).sum()),
    )


def closed(mesh):
    """The tags cover the boundary, each face once and outward."""
    rows = np.concatenate(list(mesh.facets.values()))
    named, outer = (f[np.lexsort(np.sort(f[:, : mesh.dim], axis=1).T)] for f in (rows, mesh.boundary()))
    np.testing.assert_array_equal(named, outer)
    assert len(rows) == len(mesh.boundary())
    _, normal, flux = surface(mesh.points, rows)
    np.testing.assert_allclose(normal, 0, atol=1e-12)
    assert flux == pytest.approx(mesh.dim * volume(mesh.points, mesh.cells), rel=1e-12)
