"""Points on the centreline of a beam between its nodes, compiled: places, rows of n·∂p, and its curvature.

On an element of rest length ℓ between nodes x₁, x₂ with tangents t₁, t₂ (the first columns of R₁, R₂), at ξ in [0, 1]:

    p = h₀₀ x₁ + h₁₀ ℓ t₁ + h₀₁ x₂ + h₁₁ ℓ t₂     (cubic Hermite: off a smooth rest shape by ℓ⁴/384 |x⁗|),
    dp = h₀₀ dx₁ + h₁₀ ℓ dθ₁ × t₁ + h₀₁ dx₂ + h₁₁ ℓ dθ₂ × t₂.

Everywhere x (N, 3) [m], R (N, 3, 3), element and xi (q), length (N − 1) [m]; the unknowns are those of `beam_element`.
"""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]


@njit(cache=True)
def _weights(xi: float, length: float) -> tuple[float, float, float, float]:
    """h₀₀, h₁₀ ℓ, h₀₁, h₁₁ ℓ."""
    h01 = xi * xi * (3.0 - 2.0 * xi)
    return 1.0 - h01, length * xi * (1.0 - xi) ** 2, h01, length * xi * xi * (xi - 1.0)


@njit(cache=True)
def centreline_points(x: Floats, R: Floats, element: Ints, xi: Floats, length: Floats) -> Floats:
    """p (q, 3) [m]."""
    p = np.empty((len(xi), 3))
    for i in range(len(xi)):
        e = element[i]
        a, b, c, d = _weights(xi[i], length[e])
        for k in range(3):
            p[i, k] = a * x[e, k] + b * R[e, k, 0] + c * x[e + 1, k] + d * R[e + 1, k, 0]
    return p


@njit(cache=True)
def write_point_row(row: Floats, normal: Floats, R: Floats, e: int, xi: float, length: float) -> None:
    """[h₀₀ n, h₁₀ ℓ t₁ × n, h₀₁ n, h₁₁ ℓ t₂ × n] into `row` (12), for the point ξ of element e."""
    weights = _weights(xi, length)
    for node in range(2):
        on_x, on_t, first = weights[2 * node], weights[2 * node + 1], 6 * node
        for k in range(3):
            k1, k2 = (k + 1) % 3, (k + 2) % 3
            t1, t2 = R[e + node, k1, 0], R[e + node, k2, 0]
            row[first + k] = on_x * normal[k]
            row[first + 3 + k] = on_t * (t1 * normal[k2] - t2 * normal[k1])


@njit(cache=True)
def point_rows(normals: Floats, R: Floats, element: Ints, xi: Floats, length: Floats) -> Floats:
    """∂(n·p)/∂(dx₁, dθ₁, dx₂, dθ₂), (q, 12), for normals (q, 3)."""
    rows = np.empty((len(xi), 12))
    for i in range(len(xi)):
        write_point_row(rows[i], normals[i], R, element[i], xi[i], length[element[i]])
    return rows


@njit(cache=True)
def point_blocks(
    force: Floats, normals: Floats, curvature: Floats, R: Floats, element: Ints, xi: Floats, length: Floats
) -> Floats:
    """−λ ∂²g/∂(dx₁, dθ₁, dx₂, dθ₂)², (q, 12, 12), symmetric part: what contact forces on curved surfaces add to K.

    For the distance g(p) to a surface ∂²g = (∂p)ᵀ ∇∇g ∂p + n·∂²p, where a turned tᵢ has n·∂²tᵢ = sym(tᵢnᵀ) − (n·tᵢ) I.

    Parameters
    ----------
    force : λ (q) [N]
    normals, curvature : n = ∇g (q, 3) and ∇∇g (q, 3, 3) [1/m] at p
    """
    blocks = np.empty((len(xi), 12, 12))
    J, CJ = np.zeros((3, 12)), np.empty((3, 12))
    for i in range(len(xi)):
        e = element[i]
        weights = _weights(xi[i], length[e])
        for node in range(2):
            on_x, on_t, first = weights[2 * node], weights[2 * node + 1], 6 * node
            for k in range(3):
                k1, k2 = (k + 1) % 3, (k + 2) % 3
                J[k, first + k] = on_x
                # −t^
                J[k1, first + 3 + k2] = on_t * R[e + node, k, 0]
                J[k2, first + 3 + k1] = -on_t * R[e + node, k, 0]
        for b in range(12):
            for a in range(3):
                product = 0.0
                for k in range(3):
                    product += curvature[i, a, k] * J[k, b]
                CJ[a, b] = -force[i] * product
        for a in range(12):
            for b in range(12):
                blocks[i, a, b] = J[0, a] * CJ[0, b] + J[1, a] * CJ[1, b] + J[2, a] * CJ[2, b]
        for node in range(2):
            f, first = -force[i] * weights[2 * node + 1], 6 * node + 3
            along = 0.0
            for k in range(3):
                along += normals[i, k] * R[e + node, k, 0]
            for a in range(3):
                for b in range(3):
                    ta, tb = R[e + node, a, 0], R[e + node, b, 0]
                    blocks[i, first + a, first + b] += 0.5 * f * (ta * normals[i, b] + tb * normals[i, a])
                blocks[i, first + a, first + a] -= f * along
    return blocks
