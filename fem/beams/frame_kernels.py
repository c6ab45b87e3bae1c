"""The turning of frames between the nodes of a beam and from pass to pass, compiled.

Oracles: `fem.rotations`, and for the mean frame `beam_element`, whose symbols these are. Frames R (N, 3, 3) have the
axes t, d₂, d₃ of the nodes as columns. Between ends that turn by π against each other there is no mean frame: what
comes of it is not finite. Nodes are taken side by side: see `fem.lanes`.
"""

from __future__ import annotations

from itertools import accumulate
from math import cos, sin, sqrt

import numpy as np
from numba import njit
from numpy.typing import NDArray

from fem.lanes import ALL, LANES, read, read_matrix, write, write_matrix
from fem.vectors import Matrix, Vector, combined, cross, dot, times, transposed

Floats = NDArray[np.float64]

# φ/sin φ = Σ aₖ zᵏ, z = sin² ½φ, with a₀ = 1 and aₖ = 2k/(2k + 1) aₖ₋₁: to round-off for φ ≤ ¼π
A = tuple(accumulate(range(1, 20), lambda a, k: a * 2 * k / (2 * k + 1), initial=1.0))
A0, A1, A2, A3, A4, A5, A6, A7, A8, A9, A10, A11, A12, A13, A14, A15, A16, A17, A18, A19 = A
# Terms of sin h/h and of cos h: to round-off for h ≤ 1
S1, S2, S3, S4, S5, S6, S7, S8 = accumulate(range(2, 9), lambda a, k: -a / (2 * k * (2 * k + 1)), initial=-1 / 6)
C1, C2, C3, C4, C5, C6, C7, C8 = accumulate(range(2, 9), lambda a, k: -a / (2 * k * (2 * k - 1)), initial=-1 / 2)


@njit(cache=True, error_model="numpy", forceinline=True)
def _arc(w: float) -> float:
    """½θ/sin ½θ of w = cos ½θ for θ < π: φ/sin φ of φ = ¼θ, over cos φ."""
    c = sqrt(0.5 + 0.5 * w)
    z = 0.5 - 0.5 * c
    far = A10 + z * (A11 + z * (A12 + z * (A13 + z * (A14 + z * (A15 + z * (A16 + z * (A17 + z * (A18 + z * A19))))))))
    near = A0 + z * (A1 + z * (A2 + z * (A3 + z * (A4 + z * (A5 + z * (A6 + z * (A7 + z * (A8 + z * A9))))))))
    square = z * z
    fourth = square * square
    return (near + fourth * fourth * square * far) / c


@njit(cache=True, error_model="numpy", forceinline=True)
def _half_turn(A: Matrix, B: Matrix) -> tuple[float, Vector]:
    """cos ½θ and the components of n sin ½θ for the rotation by θ < π about n from one frame to another, by columns."""
    (a1, a2, a3), (b1, b2, b3) = A, B
    square = 1.0 + dot(a1, b1) + dot(a2, b2) + dot(a3, b3)
    w = 0.5 * sqrt(square if square > 0.0 else 0.0)
    f = 0.25 / w
    return w, (
        f * (dot(a3, b2) - dot(a2, b3)),
        f * (dot(a1, b3) - dot(a3, b1)),
        f * (dot(a2, b1) - dot(a1, b2)),
    )


@njit(cache=True, error_model="numpy", forceinline=True)
def mean_frame(A: Matrix, B: Matrix) -> tuple[float, float, Vector, Vector, Vector, Vector]:
    """s, cos ½θ, ψ in components, and the columns of the frame half way between two frames, all by columns."""
    w, v = _half_turn(A, B)
    s = _arc(w)
    psi = times(2.0 * s, v)
    # exp(½ψ) = I + k w̃ v^ + k v^v^ from the quaternion (1 + w, v)/√(2 + 2w)
    k = 1.0 / (1.0 + w)
    a1, a2, a3 = A
    x, y, z = v
    e1 = combined(1.0 - k * (y * y + z * z), a1, z + k * x * y, a2, k * x * z - y, a3)
    e2 = combined(k * x * y - z, a1, 1.0 - k * (x * x + z * z), a2, x + k * y * z, a3)
    e3 = combined(y + k * x * z, a1, k * y * z - x, a2, 1.0 - k * (x * x + y * y), a3)
    return s, w, psi, e1, e2, e3


@njit(cache=True, error_model="numpy")
def _turning(spin: Vector) -> tuple[float, float]:
    """f, g with exp(θ^) = I + f θ^ + g θ^θ^."""
    h = 0.25 * dot(spin, spin)
    if h <= 1.0:
        k = 1.0 + h * (S1 + h * (S2 + h * (S3 + h * (S4 + h * (S5 + h * (S6 + h * (S7 + h * S8)))))))
        w = 1.0 + h * (C1 + h * (C2 + h * (C3 + h * (C4 + h * (C5 + h * (C6 + h * (C7 + h * C8)))))))
    else:
        half = sqrt(h)
        k, w = sin(half) / half, cos(half)
    return k * w, 0.5 * k * k


@njit(cache=True, error_model="numpy", forceinline=True)
def _turned(spin: Vector, f: float, g: float, a: Vector) -> Vector:
    """a + f θ × a + g θ × (θ × a)."""
    first = cross(spin, a)
    return combined(1.0, a, f, first, g, cross(spin, first))


@njit(cache=True, error_model="numpy")
def relative_rotations(R1: Floats, R2: Floats) -> Floats:
    """log(R₂R₁ᵀ) (N, 3) [rad], for turns below π."""
    theta, S = np.empty((len(R1), 3)), np.empty(21 * LANES)
    for first in range(0, len(R1), LANES):
        count = min(LANES, len(R1) - first)
        for lane in range(LANES):
            i = first + min(lane, count - 1)
            for j in range(3):
                for k in range(3):
                    S[LANES * (3 * j + k) + lane] = R2[i, j, k]
                    S[LANES * (9 + 3 * j + k) + lane] = R1[i, j, k]
        for lane in range(ALL):
            # rows as columns: the turn between R₂ᵀ and R₁ᵀ has the components in the fixed frame
            w, v = _half_turn(read_matrix(S, 0, lane), read_matrix(S, 9, lane))
            write(S, 18, lane, times(2.0 * _arc(w), v))
        for lane in range(count):
            for k in range(3):
                theta[first + lane, k] = S[LANES * (18 + k) + lane]
    return theta


@njit(cache=True, error_model="numpy")
def turn_to(R: Floats, start: Floats, theta: Floats) -> Floats:
    """log(exp(θ^) R₀ Rᵀ), (3) [rad], for frames R and R₀ = `start` (1, 3, 3) and θ (3)."""
    turned, angles = np.empty((1, 3, 3)), (theta[0], theta[1], theta[2])
    f, g = _turning(angles)
    for k in range(3):
        axis = (start[0, 0, k], start[0, 1, k], start[0, 2, k])
        turned[0, 0, k], turned[0, 1, k], turned[0, 2, k] = _turned(angles, f, g, axis)
    spin: Floats = relative_rotations(R, turned)[0]
    return spin


@njit(cache=True, error_model="numpy")
def update(x: Floats, R: Floats, edges: Floats, d: Floats) -> tuple[Floats, Floats, Floats]:
    """x + dx, exp(dθ) R orthonormal to round-off (`rotations.composed`), and the edges, for d = (dx, dθ) (N, 6)."""
    x_new, R_new, edges_new = np.empty_like(x), np.empty_like(R), np.empty_like(edges)
    S = np.empty(23 * LANES)
    for first in range(0, len(x), LANES):
        count = min(LANES, len(x) - first)
        for lane in range(LANES):
            i = first + min(lane, count - 1)
            for j in range(3):
                for k in range(3):
                    S[LANES * (3 * j + k) + lane] = R[i, k, j]
                S[LANES * (9 + j) + lane] = d[i, 3 + j]
            S[LANES * 12 + lane], S[LANES * 13 + lane] = _turning((d[i, 3], d[i, 4], d[i, 5]))
        for lane in range(ALL):
            (a, b, c), theta = read_matrix(S, 0, lane), read(S, 9, lane)
            f, g = S[ALL * np.uint64(12) + lane], S[ALL * np.uint64(13) + lane]
            a, b, c = _turned(theta, f, g, a), _turned(theta, f, g, b), _turned(theta, f, g, c)
            ab, bc, ca = -0.5 * dot(a, b), -0.5 * dot(b, c), -0.5 * dot(c, a)
            a, b, c = (
                combined(1.5 - 0.5 * dot(a, a), a, ab, b, ca, c),
                combined(ab, a, 1.5 - 0.5 * dot(b, b), b, bc, c),
                combined(ca, a, bc, b, 1.5 - 0.5 * dot(c, c), c),
            )
            write_matrix(S, 14, lane, transposed((a, b, c)))
        for lane in range(count):
            for j in range(3):
                for k in range(3):
                    R_new[first + lane, j, k] = S[LANES * (14 + 3 * j + k) + lane]
    for i in range(len(x)):
        for k in range(3):
            x_new[i, k] = x[i, k] + d[i, k]
    for i in range(len(edges)):
        for k in range(3):
            edges_new[i, k] = edges[i, k] + (d[i + 1, k] - d[i, k])
    return x_new, R_new, edges_new
