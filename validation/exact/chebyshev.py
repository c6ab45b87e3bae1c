"""Pressures √(1−s²) Σ c_k U_2k(s) on −1 < s < 1: their values, their Fourier transforms, and a quadrature for these."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.special import jv

from validation.exact.common import Floats


def chebyshev_sum(c: Floats, s: Floats) -> Floats:
    """√(1−s²) Σ c_k U_2k(s) = Σ c_k sin (2k+1)θ, s = cos θ, and 0 for |s| > 1."""
    theta = np.arccos(np.minimum(np.abs(s), 1))
    value: Floats = np.sin(np.multiply.outer(theta, 2 * np.arange(len(c)) + 1)) @ c
    return value


def chebyshev_transform(k: NDArray[np.int64], z: Floats) -> Floats:
    """∫₋₁¹ √(1−s²) U_2k(s) cos(zs) ds = (−1)ᵏ π (2k+1) J_2k+1(z)/z, shape (len(k), len(z))."""
    m = (2 * k + 1)[:, None]
    transform: Floats = (1 - 2 * (k % 2))[:, None] * np.pi * m * jv(m, z) / z
    return transform


def composite_gauss(length: float, panels: int) -> tuple[Floats, Floats]:
    """Nodes and weights on [0, length]: 32 Gauss points on each of equal panels (one long rule loses digits)."""
    node, weight = np.polynomial.legendre.leggauss(32)
    h = length / panels
    return (h * (np.arange(panels)[:, None] + 0.5 * (1 + node))).ravel(), np.tile(0.5 * h * weight, panels)
