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

from fem.vectors import (
    Matrix,
    Vector,
    add,
    at,
    column,
    dot,
    put,
    rows_cross,
    scaled,
    summed,
    symmetric,
    times,
    transposed,
)

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
def _put_both(blocks: Floats, i: int, j: int, k: int, A: Matrix) -> None:
    """Write A at (j, k) and Aᵀ at (k, j)."""
    put(blocks, i, j, k, A)
    put(blocks, i, k, j, transposed(A))


@njit(cache=True)
def _turned(t: Vector, n: Vector) -> Matrix:
    """n·∂²t = sym(t nᵀ) − (n·t) I."""
    along = dot(n, t)
    A = symmetric((times(0.5 * t[0], n), times(0.5 * t[1], n), times(0.5 * t[2], n)))
    return add(A[0], (-along, 0.0, 0.0)), add(A[1], (0.0, -along, 0.0)), add(A[2], (0.0, 0.0, -along))


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
    for i in range(len(xi)):
        e, f = element[i], -force[i]
        a, b, c, d = _weights(xi[i], length[e])
        t1, t2, n = column(R, e, 0), column(R, e + 1, 0), (normals[i, 0], normals[i, 1], normals[i, 2])
        # ∂p = [a I, −b t₁^, c I, −d t₂^]
        C = scaled(f, at(curvature, i, 0, 0))
        C1, C2 = rows_cross(C, t1), rows_cross(C, t2)
        S11, S22 = rows_cross(transposed(C1), t1), rows_cross(transposed(C2), t2)
        S12 = transposed(rows_cross(transposed(C2), t1))
        put(blocks, i, 0, 0, scaled(a * a, C))
        put(blocks, i, 6, 6, scaled(c * c, C))
        put(blocks, i, 0, 6, scaled(a * c, C))
        put(blocks, i, 6, 0, scaled(a * c, C))
        _put_both(blocks, i, 0, 3, scaled(-a * b, C1))
        _put_both(blocks, i, 0, 9, scaled(-a * d, C2))
        _put_both(blocks, i, 6, 3, scaled(-c * b, C1))
        _put_both(blocks, i, 6, 9, scaled(-c * d, C2))
        _put_both(blocks, i, 3, 9, scaled(b * d, S12))
        put(blocks, i, 3, 3, summed(b * b, S11, f * b, _turned(t1, n)))
        put(blocks, i, 9, 9, summed(d * d, S22, f * d, _turned(t2, n)))
    return blocks
