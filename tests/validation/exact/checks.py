"""Second ways: finite differences of fields, and Hooke's law."""

from __future__ import annotations

import numpy as np
from numpy.testing import assert_allclose

STEP = 2e-3


def gradient(field, points, step=STEP):
    """∂field/∂x_j by central differences of sixth order; the new axis is the last."""
    points = np.asarray(points, dtype=float)
    columns = []
    for e in np.eye(points.shape[1]) * step:
        d1, d2, d3 = (field(points + k * e) - field(points - k * e) for k in (1, 2, 3))
        columns.append((45 * d1 - 9 * d2 + d3) / (60 * step))
    return np.stack(columns, axis=-1)


def hooke(displacement_gradient, E, nu, extra_strain=0.0):
    """σ = 2Gε + λ tr ε 1 for (n, d, d) gradients; `extra_strain` is the normal strain out of their plane."""
    eps = 0.5 * (displacement_gradient + np.swapaxes(displacement_gradient, 1, 2))
    G, lam = E / (2 * (1 + nu)), E * nu / ((1 + nu) * (1 - 2 * nu))
    trace = np.trace(eps, axis1=1, axis2=2) + extra_strain
    return 2 * G * eps + lam * trace[:, None, None] * np.eye(eps.shape[1])


def divergence(tensor_field, points):
    """∂σ_ij/∂x_j of a field of tensors (n, d, d), shape (n, d)."""
    return np.trace(gradient(tensor_field, points), axis1=2, axis2=3)


def on_surface(x):
    """The points (x, 0) of a half-plane's surface."""
    return np.column_stack([x, np.zeros_like(x)])


def assert_elastic(body, points, stress_rtol, divergence_rtol):
    """∇u is u's, σ is Hooke's of ∇u in plane strain, div σ = 0; both relative to the largest stress."""
    grad = body.displacement_gradient(points)
    assert_allclose(grad, gradient(body.displacement, points), atol=1e-9 * np.abs(grad).max())
    xx, yy, xy = body.stress(points).T
    sigma = hooke(grad, body.E, body.nu)
    scale = np.abs(sigma).max()
    assert_allclose(np.stack([xx, yy, xy]), [sigma[:, 0, 0], sigma[:, 1, 1], sigma[:, 0, 1]], atol=stress_rtol * scale)

    def tensor(x):
        return body.stress(x)[:, [0, 2, 2, 1]].reshape(-1, 2, 2)

    assert np.abs(divergence(tensor, points)).max() < divergence_rtol * scale


def fourth(w, x, h):
    """w⁗(x) by central differences of step h."""
    return (w(x - 2 * h) - 4 * w(x - h) + 6 * w(x) - 4 * w(x + h) + w(x + 2 * h)) / h**4


def second(w, x, h):
    """w″(x) by central differences of step h."""
    return (w(x - h) - 2 * w(x) + w(x + h)) / h**2
