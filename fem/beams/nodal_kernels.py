"""What acts on the nodes of a beam, compiled: mass, inertia, the moments of line loads, and norms of forces."""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray

Floats = NDArray[np.float64]


@njit(cache=True, error_model="numpy")
def weight(mass: Floats, acceleration: Floats) -> Floats:
    """Forces of an acceleration (3) on masses at the nodes (N), with no moments, (N, 6)."""
    f = np.zeros((len(mass), 6))
    for i in range(len(mass)):
        for a in range(3):
            f[i, a] = mass[i] * acceleration[a]
    return f


@njit(cache=True, error_model="numpy")
def add_inertia(diagonal: Floats, upper: Floats, nodes: Floats, links: Floats, J: Floats, factor: float) -> None:
    """Add `factor` times the mass: nodes (N) and links (N − 1) [kg] on translations, J (N, 3, 3) on rotations."""
    for i in range(len(nodes)):
        for a in range(3):
            diagonal[i, a, a] += factor * nodes[i]
            for b in range(3):
                diagonal[i, 3 + a, 3 + b] += factor * J[i, a, b]
    for i in range(len(links)):
        for a in range(3):
            upper[i, a, a] += factor * links[i]


@njit(cache=True, error_model="numpy")
def add_inertia_forces(
    f: Floats, moved: Floats, turned: Floats, v: Floats, w: Floats,
    nodes: Floats, links: Floats, J: Floats, factor: float, rate: float,
) -> None:  # fmt: skip
    """Add M (factor · moved − rate · v) and J (factor · turned − rate · w) to f (N, 6), all (N, 3)."""
    N = len(nodes)
    for i in range(N):
        for a in range(3):
            here = factor * moved[i, a] - rate * v[i, a]
            f[i, a] += nodes[i] * here
            if i > 0:
                f[i - 1, a] += links[i - 1] * here
            if i + 1 < N:
                f[i + 1, a] += links[i] * here
            total = 0.0
            for b in range(3):
                total += J[i, a, b] * (factor * turned[i, b] - rate * w[i, b])
            f[i, 3 + a] += total


@njit(cache=True, error_model="numpy")
def spatial_inertia(R: Floats, rotary: Floats) -> Floats:
    """R diag(rotary) Rᵀ of each node, (N, 3, 3), from moments about the node's axes (N, 3)."""
    J = np.empty_like(R)
    for i in range(len(R)):
        j0, j1, j2 = rotary[i, 0], rotary[i, 1], rotary[i, 2]
        for a in range(3):
            x, y, z = j0 * R[i, a, 0], j1 * R[i, a, 1], j2 * R[i, a, 2]
            for b in range(3):
                J[i, a, b] = x * R[i, b, 0] + y * R[i, b, 1] + z * R[i, b, 2]
    return J


@njit(cache=True, error_model="numpy")
def furthest(d: Floats) -> tuple[float, float]:
    """The largest components of displacements and of rotations d (N, 6)."""
    shift = turn = 0.0
    for i in range(len(d)):
        for a in range(3):
            shift, turn = max(shift, abs(d[i, a])), max(turn, abs(d[i, 3 + a]))
    return shift, turn


@njit(cache=True, error_model="numpy")
def add_line_moments(f: Floats, R: Floats, length: Floats, line: Floats) -> None:
    """Add ℓ²/12 (t₁ × q, −t₂ × q) to the moments of f (N, 6), for line loads q (N − 1, 3)."""
    for i in range(len(length)):
        arm = length[i] ** 2 / 12.0
        for a in range(3):
            b, c = (a + 1) % 3, (a + 2) % 3
            f[i, 3 + a] += arm * (R[i, b, 0] * line[i, c] - R[i, c, 0] * line[i, b])
            f[i + 1, 3 + a] -= arm * (R[i + 1, b, 0] * line[i, c] - R[i + 1, c, 0] * line[i, b])


@njit(cache=True, error_model="numpy")
def norms(inner: Floats, outer: Floats, contact: Floats, fixed: NDArray[np.bool_], unit: Floats) -> Floats:
    """‖inner − outer − contact‖ at unknowns that are not fixed, ‖inner‖, ‖outer‖ and ‖contact‖, weighed by `unit`."""
    squares = np.zeros(4)
    for i in range(len(inner)):
        u = unit[i] * unit[i]
        if not fixed[i]:
            squares[0] += u * (inner[i] - outer[i] - contact[i]) ** 2
        squares[1] += u * inner[i] ** 2
        squares[2] += u * outer[i] ** 2
        squares[3] += u * contact[i] ** 2
    return np.sqrt(squares)
