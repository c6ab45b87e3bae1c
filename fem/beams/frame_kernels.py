"""The turning of frames between the nodes of a beam and from pass to pass, compiled.

Oracles: `fem.rotations`, and for the mean frame `beam_element`, whose symbols these are. Frames R (N, 3, 3) have the
axes t, d₂, d₃ of the nodes as columns. Between ends that turn by π against each other there is no mean frame: what
comes of it is not finite.
"""

from __future__ import annotations

from math import atan2, cos, sin, sqrt

import numpy as np
from numba import njit
from numpy.typing import NDArray

from fem.vectors import Vector, column, combined, cross, dot, put, times, transposed

Floats = NDArray[np.float64]


@njit(cache=True, error_model="numpy")
def _half_turn(R: Floats, i: int) -> tuple[float, Vector]:
    """cos ½θ and the components of n sin ½θ for the rotation by θ < π about n from node i's frame to the next one's."""
    a1, a2, a3 = column(R, i, 0), column(R, i, 1), column(R, i, 2)
    b1, b2, b3 = column(R, i + 1, 0), column(R, i + 1, 1), column(R, i + 1, 2)
    w = 0.5 * sqrt(max(0.0, 1.0 + dot(a1, b1) + dot(a2, b2) + dot(a3, b3)))
    f = 0.25 / w
    v = (dot(a3, b2) - dot(a2, b3), dot(a1, b3) - dot(a3, b1), dot(a2, b1) - dot(a1, b2))
    return w, times(f, v)


@njit(cache=True, error_model="numpy")
def frame(R: Floats, i: int) -> tuple[float, float, Vector, Vector, Vector, Vector]:
    """s, cos ½θ, ψ in components, and the columns of the mean frame of element i."""
    w, v = _half_turn(R, i)
    sine = sqrt(dot(v, v))
    s = atan2(sine, w) / sine if sine > 0.0 else 1.0
    psi = times(2.0 * s, v)
    # exp(½ψ) = I + k w̃ v^ + k v^v^ from the quaternion (1 + w, v)/√(2 + 2w)
    k = 1.0 / (1.0 + w)
    a1, a2, a3 = column(R, i, 0), column(R, i, 1), column(R, i, 2)
    x, y, z = v
    e1 = combined(1.0 - k * (y * y + z * z), a1, z + k * x * y, a2, k * x * z - y, a3)
    e2 = combined(k * x * y - z, a1, 1.0 - k * (x * x + z * z), a2, x + k * y * z, a3)
    e3 = combined(y + k * x * z, a1, k * y * z - x, a2, 1.0 - k * (x * x + y * y), a3)
    return s, w, psi, e1, e2, e3


@njit(cache=True, error_model="numpy")
def _turning(spin: Vector) -> tuple[float, float]:
    """f, g with exp(θ^) = I + f θ^ + g θ^θ^."""
    half = 0.5 * sqrt(dot(spin, spin))
    k = 1.0 if half == 0.0 else sin(half) / half
    return k * cos(half), 0.5 * k * k


@njit(cache=True, error_model="numpy")
def _turned(spin: Vector, f: float, g: float, a: Vector) -> Vector:
    """a + f θ × a + g θ × (θ × a)."""
    first = cross(spin, a)
    return combined(1.0, a, f, first, g, cross(spin, first))


@njit(cache=True, error_model="numpy")
def relative_rotations(R1: Floats, R2: Floats) -> Floats:
    """log(R₂R₁ᵀ) (N, 3) [rad], for turns below π."""
    theta = np.empty((len(R1), 3))
    pair = np.empty((2, 3, 3))
    for i in range(len(R1)):
        # rows as columns: the turn between R₂ᵀ and R₁ᵀ has the components in the fixed frame
        for j in range(3):
            for k in range(3):
                pair[0, j, k], pair[1, j, k] = R2[i, k, j], R1[i, k, j]
        _, _, psi, _, _, _ = frame(pair, 0)
        theta[i, 0], theta[i, 1], theta[i, 2] = psi
    return theta


@njit(cache=True, error_model="numpy")
def turn_to(R: Floats, start: Floats, theta: Floats) -> Floats:
    """log(exp(θ^) R₀ Rᵀ), (3) [rad], for frames R and R₀ = `start` (1, 3, 3) and θ (3)."""
    turned, angles = np.empty((1, 3, 3)), (theta[0], theta[1], theta[2])
    f, g = _turning(angles)
    for k in range(3):
        a = _turned(angles, f, g, column(start, 0, k))
        turned[0, 0, k], turned[0, 1, k], turned[0, 2, k] = a
    spin: Floats = relative_rotations(R, turned)[0]
    return spin


@njit(cache=True, error_model="numpy")
def update(x: Floats, R: Floats, edges: Floats, d: Floats) -> tuple[Floats, Floats, Floats]:
    """x + dx, exp(dθ) R orthonormal to round-off (`rotations.composed`), and the edges, for d = (dx, dθ) (N, 6)."""
    x_new, R_new, edges_new = np.empty_like(x), np.empty_like(R), np.empty_like(edges)
    for i in range(len(x)):
        for k in range(3):
            x_new[i, k] = x[i, k] + d[i, k]
        theta = (d[i, 3], d[i, 4], d[i, 5])
        f, g = _turning(theta)
        a = _turned(theta, f, g, column(R, i, 0))
        b = _turned(theta, f, g, column(R, i, 1))
        c = _turned(theta, f, g, column(R, i, 2))
        ab, bc, ca = -0.5 * dot(a, b), -0.5 * dot(b, c), -0.5 * dot(c, a)
        a, b, c = (
            combined(1.5 - 0.5 * dot(a, a), a, ab, b, ca, c),
            combined(ab, a, 1.5 - 0.5 * dot(b, b), b, bc, c),
            combined(ca, a, bc, b, 1.5 - 0.5 * dot(c, c), c),
        )
        put(R_new, i, 0, 0, transposed((a, b, c)))
    for i in range(len(edges)):
        for k in range(3):
            edges_new[i, k] = edges[i, k] + (d[i + 1, k] - d[i, k])
    return x_new, R_new, edges_new
