"""Vectors and matrices of three dimensions as tuples, for compiled loops: they live in registers."""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Vector = tuple[float, float, float]
Matrix = tuple[Vector, Vector, Vector]


@njit(cache=True, error_model="numpy")
def dot(a: Vector, b: Vector) -> float:
    """a·b."""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


@njit(cache=True, error_model="numpy")
def cross(a: Vector, b: Vector) -> Vector:
    """a × b."""
    return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]


@njit(cache=True, error_model="numpy")
def add(a: Vector, b: Vector) -> Vector:
    """a + b."""
    return a[0] + b[0], a[1] + b[1], a[2] + b[2]


@njit(cache=True, error_model="numpy")
def times(f: float, a: Vector) -> Vector:
    """f a."""
    return f * a[0], f * a[1], f * a[2]


@njit(cache=True, error_model="numpy")
def combined(a: float, e1: Vector, b: float, e2: Vector, c: float, e3: Vector) -> Vector:
    """a e₁ + b e₂ + c e₃."""
    return (
        a * e1[0] + b * e2[0] + c * e3[0],
        a * e1[1] + b * e2[1] + c * e3[1],
        a * e1[2] + b * e2[2] + c * e3[2],
    )


@njit(cache=True, error_model="numpy")
def column(R: Floats, i: int, j: int) -> Vector:
    """Column j of the matrix R[i]."""
    return R[i, 0, j], R[i, 1, j], R[i, 2, j]


@njit(cache=True, error_model="numpy")
def transposed(A: Matrix) -> Matrix:
    """Aᵀ."""
    a, b, c = A
    return (a[0], b[0], c[0]), (a[1], b[1], c[1]), (a[2], b[2], c[2])


@njit(cache=True, error_model="numpy")
def spatial(d: Vector, e1: Vector, e2: Vector, e3: Vector) -> Matrix:
    """Rows of Σ dₖ eₖ eₖᵀ."""
    a, b, c = times(d[0], e1), times(d[1], e2), times(d[2], e3)
    return (
        combined(e1[0], a, e2[0], b, e3[0], c),
        combined(e1[1], a, e2[1], b, e3[1], c),
        combined(e1[2], a, e2[2], b, e3[2], c),
    )


@njit(cache=True, error_model="numpy")
def rows_cross(A: Matrix, a: Vector) -> Matrix:
    """Rows of A a^: each row of A crossed with a."""
    return cross(A[0], a), cross(A[1], a), cross(A[2], a)


@njit(cache=True, error_model="numpy")
def minus_spin(A: Matrix, a: Vector) -> Matrix:
    """Rows of A − a^."""
    x, y, z = a
    return (
        (A[0][0], A[0][1] + z, A[0][2] - y),
        (A[1][0] - z, A[1][1], A[1][2] + x),
        (A[2][0] + y, A[2][1] - x, A[2][2]),
    )


@njit(cache=True, error_model="numpy")
def scaled(f: float, A: Matrix) -> Matrix:
    """f A."""
    return times(f, A[0]), times(f, A[1]), times(f, A[2])


@njit(cache=True, error_model="numpy")
def summed(f: float, A: Matrix, g: float, B: Matrix) -> Matrix:
    """f A + g B."""
    return add(times(f, A[0]), times(g, B[0])), add(times(f, A[1]), times(g, B[1])), add(times(f, A[2]), times(g, B[2]))


@njit(cache=True, error_model="numpy")
def symmetric(A: Matrix) -> Matrix:
    """A + Aᵀ."""
    return summed(1.0, A, 1.0, transposed(A))


@njit(cache=True, error_model="numpy")
def put(blocks: Floats, i: int, j: int, k: int, A: Matrix) -> None:
    """Write A into the matrix blocks[i], its corner at (j, k)."""
    blocks[i, j, k], blocks[i, j, k + 1], blocks[i, j, k + 2] = A[0]
    blocks[i, j + 1, k], blocks[i, j + 1, k + 1], blocks[i, j + 1, k + 2] = A[1]
    blocks[i, j + 2, k], blocks[i, j + 2, k + 1], blocks[i, j + 2, k + 2] = A[2]


@njit(cache=True, error_model="numpy")
def at(blocks: Floats, i: int, j: int, k: int) -> Matrix:
    """The matrix in blocks[i] whose corner is at (j, k)."""
    return (
        (blocks[i, j, k], blocks[i, j, k + 1], blocks[i, j, k + 2]),
        (blocks[i, j + 1, k], blocks[i, j + 1, k + 1], blocks[i, j + 1, k + 2]),
        (blocks[i, j + 2, k], blocks[i, j + 2, k + 1], blocks[i, j + 2, k + 2]),
    )
