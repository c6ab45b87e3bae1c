"""Finite rotations: exp and log are inverse to each other, at every angle."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.linalg import expm, logm

from fem.rotations import composed, cross_matrix, exp, log, mean, orthonormalised, quaternion

RNG = np.random.default_rng(3)
AXES = RNG.normal(size=(20, 3))
AXES = np.concatenate([np.eye(3), -np.eye(3), AXES / np.linalg.norm(AXES, axis=1)[:, None]])
ANGLES = [0.0, 1e-300, 1e-9, 1e-4, 0.1, 1.0, 2.0, 3.0, np.pi - 1e-4, np.pi - 1e-9]


def test_cross_matrix():
    a, b = RNG.normal(size=(2, 5, 3))
    np.testing.assert_allclose(np.einsum("nij,nj->ni", cross_matrix(a), b), np.cross(a, b), rtol=1e-15)


def test_exp_is_the_matrix_exponential():
    theta = 2.5 * AXES
    np.testing.assert_allclose(exp(theta), [expm(cross_matrix(t)) for t in theta], atol=1e-14)


@pytest.mark.parametrize("angle", ANGLES)
def test_log_is_the_inverse_of_exp(angle):
    theta = angle * AXES
    np.testing.assert_allclose(log(exp(theta)), theta, rtol=1e-14, atol=1e-15 * (1 + angle))


def test_log_of_a_half_turn():
    """At π the axis is known up to its sign."""
    found = log(exp(np.pi * AXES))
    np.testing.assert_allclose(np.linalg.norm(found, axis=1), np.pi, rtol=1e-15)
    np.testing.assert_allclose(np.abs((found * AXES).sum(axis=1)), np.pi, rtol=1e-14)


def test_quaternion_turns_vectors():
    R = exp(1.7 * AXES)
    q, a = quaternion(R), RNG.normal(size=(len(AXES), 3))
    w, v = q[:, :1], q[:, 1:]
    turned = a + 2 * w * np.cross(v, a) + 2 * np.cross(v, np.cross(v, a))
    np.testing.assert_allclose(turned, np.einsum("nij,nj->ni", R, a), atol=1e-14)
    np.testing.assert_allclose(w[:, 0], np.cos(0.85), rtol=1e-14)


def test_mean_is_half_way():
    """R₁ᵀRₘ = RₘᵀR₂ = exp(½ψ), and ψ is scipy's matrix logarithm."""
    R1, R2 = exp(AXES), exp(AXES[::-1] * 0.7)
    Rm, psi = mean(R1, R2)
    T = np.swapaxes
    np.testing.assert_allclose(T(R1, 1, 2) @ Rm, exp(psi / 2), atol=1e-14)
    np.testing.assert_allclose(T(Rm, 1, 2) @ R2, exp(psi / 2), atol=1e-14)
    np.testing.assert_allclose(cross_matrix(psi[0]), logm(R1[0].T @ R2[0]).real, atol=1e-13)


def test_thousands_of_compositions_stay_rotations():
    """Their product is that of the sum of the angles, about one axis."""
    R, step = np.eye(3), np.array([0.3, -0.2, 0.5])
    for _ in range(3_000):
        R = composed(step, R)
    np.testing.assert_allclose(R.T @ R, np.eye(3), atol=5e-16)
    np.testing.assert_allclose(R, exp(3e3 * step), atol=1e-11)


def test_orthonormalising_is_of_second_order():
    R, E = exp(AXES), RNG.normal(size=(len(AXES), 3, 3))
    errors = []
    for h in (1e-2, 1e-3, 1e-4):
        Q = orthonormalised(R + h * E)
        errors.append(np.abs(np.swapaxes(Q, 1, 2) @ Q - np.eye(3)).max())
    np.testing.assert_allclose(np.log10(np.divide(errors[:-1], errors[1:])), 2, atol=0.1)
