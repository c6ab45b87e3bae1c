"""Internal forces of tetrahedra for many displacements at once, from their stresses, compiled."""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]


@njit(cache=True, error_model="numpy", fastmath={"contract", "reassoc"})
def add_forces(
    points: Floats, cells: Ints, slopes: Floats, weights: Floats, Lame: float, G: float, U: Floats, F: Floats
) -> None:  # fmt: skip
    """Add ∫ σ(u):ε(v) dx, σ = Λ tr ε I + 2G ε, to F (n, 3, k) for displacements U (n, 3, k) of the nodes.

    Oracle: `fem.elasticity.Elasticity.forces`, column by column.

    Parameters
    ----------
    slopes, weights : ∂N_a/∂ξ (q, a, 3) and weights (q) of a quadrature on the reference tetrahedron
    """
    a_count, k = cells.shape[1], U.shape[2]
    u, f = np.empty((a_count, 3, k)), np.empty((a_count, 3, k))
    grad, g, J = np.empty((3, 3, k)), np.empty((a_count, 3)), np.empty((3, 3))
    for m in range(len(cells)):
        for a in range(a_count):
            u[a] = U[cells[m, a]]
        f[:] = 0.0
        for q in range(len(weights)):
            J[:] = 0.0  # J_ij = ∂x_j/∂ξ_i
            for a in range(a_count):
                for i in range(3):
                    for j in range(3):
                        J[i, j] += slopes[q, a, i] * points[cells[m, a], j]
            c00, c01 = J[1, 1] * J[2, 2] - J[1, 2] * J[2, 1], J[1, 2] * J[2, 0] - J[1, 0] * J[2, 2]
            c02 = J[1, 0] * J[2, 1] - J[1, 1] * J[2, 0]
            det = J[0, 0] * c00 + J[0, 1] * c01 + J[0, 2] * c02
            c10, c11 = J[0, 2] * J[2, 1] - J[0, 1] * J[2, 2], J[0, 0] * J[2, 2] - J[0, 2] * J[2, 0]
            c12 = J[0, 1] * J[2, 0] - J[0, 0] * J[2, 1]
            c20, c21 = J[0, 1] * J[1, 2] - J[0, 2] * J[1, 1], J[0, 2] * J[1, 0] - J[0, 0] * J[1, 2]
            c22 = J[0, 0] * J[1, 1] - J[0, 1] * J[1, 0]
            for a in range(a_count):
                s0, s1, s2 = slopes[q, a, 0] / det, slopes[q, a, 1] / det, slopes[q, a, 2] / det
                g[a, 0] = s0 * c00 + s1 * c10 + s2 * c20
                g[a, 1] = s0 * c01 + s1 * c11 + s2 * c21
                g[a, 2] = s0 * c02 + s1 * c12 + s2 * c22
            grad[:] = 0.0
            for a in range(a_count):
                for i in range(3):
                    for j in range(3):
                        h = g[a, j]
                        for c in range(k):
                            grad[i, j, c] += h * u[a, i, c]
            w = weights[q] * det
            for c in range(k):
                pressure = w * Lame * (grad[0, 0, c] + grad[1, 1, c] + grad[2, 2, c])
                for i in range(3):
                    for j in range(i):
                        shear = w * G * (grad[i, j, c] + grad[j, i, c])
                        grad[i, j, c], grad[j, i, c] = shear, shear
                    grad[i, i, c] = 2.0 * w * G * grad[i, i, c] + pressure
            for a in range(a_count):
                for i in range(3):
                    for j in range(3):
                        h = g[a, j]
                        for c in range(k):
                            f[a, i, c] += h * grad[i, j, c]
        for a in range(a_count):
            F[cells[m, a]] += f[a]
