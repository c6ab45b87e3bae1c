"""Elements or nodes side by side, for compiled loops that the processor runs on all of them at once.

Number k of lane l stands at S[LANES k + l]. A loop over lanes becomes vector instructions if its bounds are unsigned,
which spares a test for negative indices, if functions in it that take arrays are inlined by force, and if both sides of
every condition in it may be computed.
"""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray

from fem.vectors import Matrix, Vector

Floats = NDArray[np.float64]

LANES = 8
# The bound of a loop over lanes
ALL = np.uint64(LANES)


@njit(cache=True, forceinline=True)
def read(S: Floats, k: int, lane: int) -> Vector:
    """Numbers k, k + 1, k + 2 of a lane."""
    i = ALL * np.uint64(k) + np.uint64(lane)
    return S[i], S[i + ALL], S[i + ALL + ALL]


@njit(cache=True, forceinline=True)
def read_matrix(S: Floats, k: int, lane: int) -> Matrix:
    """Nine numbers of a lane from k on, as three vectors."""
    return read(S, k, lane), read(S, k + 3, lane), read(S, k + 6, lane)


@njit(cache=True, forceinline=True)
def write(S: Floats, k: int, lane: int, a: Vector) -> None:
    """Numbers k, k + 1, k + 2 of a lane."""
    i = ALL * np.uint64(k) + np.uint64(lane)
    S[i], S[i + ALL], S[i + ALL + ALL] = a


@njit(cache=True, forceinline=True)
def write_matrix(S: Floats, k: int, lane: int, A: Matrix) -> None:
    """Three vectors to nine numbers of a lane from k on."""
    write(S, k, lane, A[0])
    write(S, k + 3, lane, A[1])
    write(S, k + 6, lane, A[2])
