"""Products of 6 × 6 matrices, compiled, on arrays F of numbers in which a matrix is six rows of eight.

The last two numbers of a row are padding that no product mixes with the others: a row is as wide as the processor's
vectors (`fem.lanes`).
"""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray

from fem.lanes import ALL, LANES

Floats = NDArray[np.float64]

Six = tuple[float, float, float, float, float, float]
Square = tuple[Six, Six, Six, Six, Six, Six]

MATRIX = 6 * LANES  # numbers of a matrix in F
ONE, TWO, THREE, FOUR, FIVE = (np.uint64(LANES * a) for a in range(1, 6))


@njit(cache=True, forceinline=True)
def column(F: Floats, at: int, k: int) -> Six:
    """Column k of the matrix that starts at `at`."""
    i = np.uint64(at) + np.uint64(k)
    return F[i], F[i + ONE], F[i + TWO], F[i + THREE], F[i + FOUR], F[i + FIVE]


@njit(cache=True, forceinline=True)
def row(F: Floats, at: int) -> Six:
    """Six numbers from `at` on."""
    i = np.uint64(at)
    return F[i], F[i + np.uint64(1)], F[i + np.uint64(2)], F[i + np.uint64(3)], F[i + np.uint64(4)], F[i + np.uint64(5)]


@njit(cache=True, forceinline=True)
def rows(F: Floats, at: int) -> Square:
    """The matrix that starts at `at`."""
    return (
        row(F, at),
        row(F, at + LANES),
        row(F, at + 2 * LANES),
        row(F, at + 3 * LANES),
        row(F, at + 4 * LANES),
        row(F, at + 5 * LANES),
    )


@njit(cache=True, forceinline=True)
def columns(F: Floats, at: int) -> Square:
    """Its transpose."""
    return (
        column(F, at, 0),
        column(F, at, 1),
        column(F, at, 2),
        column(F, at, 3),
        column(F, at, 4),
        column(F, at, 5),
    )


@njit(cache=True, fastmath={"contract"}, forceinline=True)
def along(a: Six, b: Six) -> float:
    """a·b."""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2] + a[3] * b[3] + a[4] * b[4] + a[5] * b[5]


@njit(cache=True, fastmath={"contract"}, forceinline=True)
def plus(x: Six, f: float, a: Six) -> Six:
    """x + f a."""
    return x[0] + f * a[0], x[1] + f * a[1], x[2] + f * a[2], x[3] + f * a[3], x[4] + f * a[4], x[5] + f * a[5]


@njit(cache=True, fastmath={"contract"}, forceinline=True)
def minus(a: Six, b: Six) -> Six:
    """a − b."""
    return a[0] - b[0], a[1] - b[1], a[2] - b[2], a[3] - b[3], a[4] - b[4], a[5] - b[5]


@njit(cache=True, fastmath={"contract"}, forceinline=True)
def times(A: Square, x: Six) -> Six:
    """A x."""
    return along(A[0], x), along(A[1], x), along(A[2], x), along(A[3], x), along(A[4], x), along(A[5], x)


@njit(cache=True, forceinline=True)
def _each(a: Six, p: Six) -> Six:
    return a[0] * p[0], a[1] * p[1], a[2] * p[2], a[3] * p[3], a[4] * p[4], a[5] * p[5]


@njit(cache=True, forceinline=True)
def weighed(A: Square, p: Six) -> Square:
    """A diag(p)."""
    return _each(A[0], p), _each(A[1], p), _each(A[2], p), _each(A[3], p), _each(A[4], p), _each(A[5], p)


@njit(cache=True, forceinline=True)
def put(F: Floats, at: int, x: Six) -> None:
    """Six numbers to `at` on."""
    F[at], F[at + 1], F[at + 2], F[at + 3], F[at + 4], F[at + 5] = x


@njit(cache=True, forceinline=True)
def load(F: Floats, at: int, blocks: Floats, i: int) -> None:
    """The matrix blocks[i] of (n, 6, 6) to `at` on; padding stays as it is."""
    for a in range(6):
        for b in range(6):
            F[at + LANES * a + b] = blocks[i, a, b]


@njit(cache=True, forceinline=True)
def copy(F: Floats, at: int, G: Floats, to: int) -> None:
    """The matrix at `at` in F to `to` in G."""
    for k in range(np.uint64(MATRIX)):
        G[np.uint64(to) + k] = F[np.uint64(at) + k]


@njit(cache=True, forceinline=True)
def transpose(F: Floats, at: int, G: Floats, to: int) -> None:
    """The transpose of the matrix at `at` in F to `to` in G."""
    for a in range(6):
        for b in range(6):
            G[to + LANES * a + b] = F[at + LANES * b + a]
        for b in range(6, LANES):
            G[to + LANES * a + b] = 0.0


@njit(cache=True, fastmath={"contract"}, forceinline=True)
def product(f: float, A: Square, F: Floats, right: int, out: int) -> None:
    """F[out] ← f A F[right]."""
    for k in range(ALL):
        x, o = times(A, column(F, right, k)), np.uint64(out) + k
        F[o] = f * x[0]
        F[o + ONE] = f * x[1]
        F[o + TWO] = f * x[2]
        F[o + THREE] = f * x[3]
        F[o + FOUR] = f * x[4]
        F[o + FIVE] = f * x[5]


@njit(cache=True, fastmath={"contract"}, forceinline=True)
def add_product(f: float, A: Square, F: Floats, right: int, out: int) -> None:
    """F[out] ← F[out] + f A F[right]."""
    for k in range(ALL):
        x, o = times(A, column(F, right, k)), np.uint64(out) + k
        F[o] += f * x[0]
        F[o + ONE] += f * x[1]
        F[o + TWO] += f * x[2]
        F[o + THREE] += f * x[3]
        F[o + FOUR] += f * x[4]
        F[o + FIVE] += f * x[5]
