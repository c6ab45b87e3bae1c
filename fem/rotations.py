"""Finite rotations as matrices and rotation vectors; every function takes stacks (..., 3) and (..., 3, 3)."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]


def cross_matrix(a: Floats) -> Floats:
    """The matrix a^ (..., 3, 3) with a^ b = a × b."""
    x, y, z = np.moveaxis(np.asarray(a, dtype=np.float64), -1, 0)
    zero = np.zeros_like(x)
    rows = [np.stack(row, axis=-1) for row in ([zero, -z, y], [z, zero, -x], [-y, x, zero])]
    return np.stack(rows, axis=-2)


def exp(theta: Floats) -> Floats:
    """The rotation by |θ| about θ: exp(θ^) = I + sinc(|θ|) θ^ + ½ sinc²(|θ|/2) θ^θ^ (Rodrigues).

    Parameters
    ----------
    theta : (..., 3) [rad]
    """
    angle = np.linalg.norm(theta, axis=-1)[..., None, None]
    z = cross_matrix(theta)
    return np.eye(3) + np.sinc(angle / np.pi) * z + 0.5 * np.sinc(angle / (2 * np.pi)) ** 2 * (z @ z)


def quaternion(R: Floats) -> Floats:
    """(cos ½θ, n sin ½θ) (..., 4) of rotations by θ in [0, π] about n.

    The row of q qᵀ with the largest diagonal entry is divided by its root, so that no angle loses digits.

    Source: Shepperd, J. Guidance Control 1 (1978).
    """
    R = np.asarray(R, dtype=np.float64)
    r = np.diagonal(R, axis1=-2, axis2=-1)
    trace = r.sum(axis=-1)
    outer = np.empty((*R.shape[:-2], 4, 4))
    outer[..., 1:, 1:] = R + np.swapaxes(R, -1, -2)
    outer[..., 0, 0] = 1 + trace
    for i in range(3):
        j, k = (i + 1) % 3, (i + 2) % 3
        outer[..., i + 1, i + 1] = 1 + 2 * r[..., i] - trace
        outer[..., 0, i + 1] = outer[..., i + 1, 0] = R[..., k, j] - R[..., j, k]
    largest = np.argmax(np.diagonal(outer, axis1=-2, axis2=-1), axis=-1)
    q = np.take_along_axis(outer, largest[..., None, None], axis=-2)[..., 0, :]
    q /= np.linalg.norm(q, axis=-1)[..., None]
    return np.asarray(np.where(q[..., :1] < 0, -q, q))


def log(R: Floats) -> Floats:
    """The rotation vector (..., 3) [rad] of R, of length at most π: the inverse of `exp`."""
    q = quaternion(R)
    sine = np.linalg.norm(q[..., 1:], axis=-1)
    angle = 2 * np.arctan2(sine, q[..., 0])
    factor = np.divide(angle, sine, out=np.full_like(angle, 2.0), where=sine > 0)
    return np.asarray(factor[..., None] * q[..., 1:])


def mean(R1: Floats, R2: Floats) -> tuple[Floats, Floats]:
    """The frame half way from R₁ to R₂, Rₘ = R₁ exp(½ψ), and ψ = log(R₁ᵀ R₂), its components the same in all three."""
    psi = log(np.swapaxes(R1, -1, -2) @ R2)
    return R1 @ exp(psi / 2), psi


def orthonormalised(R: Floats) -> Floats:
    """The nearest rotation to second order, R (3I − RᵀR)/2: a Newton step for the polar factor, for near-rotations.

    Source: Higham, SIAM J. Sci. Stat. Comput. 7 (1986).
    """
    corrected: Floats = R @ (1.5 * np.eye(3) - 0.5 * np.swapaxes(R, -1, -2) @ R)
    return corrected


def composed(theta: Floats, R: Floats) -> Floats:
    """exp(θ^) R, orthonormal to round-off however often it is applied; theta (..., 3) is a spatial spin [rad]."""
    return orthonormalised(exp(theta) @ R)
