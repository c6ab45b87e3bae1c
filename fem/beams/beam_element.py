"""A corotational beam element with two nodes, in whole-array numpy: the definition, and the oracle of `beam_kernels`.

With node frames R₁, R₂ (columns t, d₂, d₃), ψ = log(R₁ᵀR₂), the element's frame Rₘ = R₁ exp(½ψ) and its edge x₂ − x₁:

    c = Rₘᵀ(x₂ − x₁),    γ = Zc = c − ψ×(ψ×c)/24,    U = ½ (γ − γ₀)·D₁(γ − γ₀) + ½ (ψ − ψ₀)·D₂(ψ − ψ₀),

D₁ = diag(EA/ℓ, k₂, k₃), D₂ = diag(GJ, EI₂, EI₃)/ℓ. Z straightens the chord: on a helix γ = ℓe₁ but for θ⁴, and elastica
converge with h⁴ (h² with γ = c). Where torsion and bending mix along a curved element GJ ≠ EI leaves a small h² term.
Where an element bends as a cubic its chord leaves the mean frame under shear forces only: 1/kₛ = ℓ³/12EI + ℓ/GAₛ makes
it, in the linear range, the Hermite (Timoshenko) element.

Unknowns are increments dx and spatial spins dθ, R ← exp(dθ)R, in the order (dx₁, dθ₁, dx₂, dθ₂). In the mean frame,
with aᵢ = Rₘᵀdθᵢ, u = Rₘᵀ(dx₂ − dx₁), A = ½(a₁ + a₂), D = a₂ − a₁, z = ψ^ and θ = |ψ|:

    dψ = S D,                 S = (z/2) sinh⁻¹(z/2) = s I + r ψψᵀ,   s = ½θ/sin ½θ,   r = (1 − s)/θ²,
    dm = A + Q D,             Q = −½ tanh(z/4) = −q z,               q = tan(¼θ)/2θ   (spin of the mean frame),
    dc = u + c^ dm.

Z is S to second order; with S itself γ and ψ are the logarithm of the rigid motion from one node to the next.

Source: Crisfield, Comput. Methods Appl. Mech. Eng. 81 (1990) for the frame, Sonneville, Cardona & Brüls, ibid. 268
(2014) for the logarithm; the closed forms are derived here.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from fem.beams.beam_sections import Profile
from fem.rotations import cross_matrix, mean
from meshes.centrelines import Centreline

Floats = NDArray[np.float64]

SMALL = 0.25
"""Below this θ² the functions of θ are taken from their series, whose first term left out is then below round-off."""
SERIES_S = (
    1.0,
    1 / 24,
    7 / 5760,
    31 / 967680,
    127 / 154828800,
    73 / 3503554560,
    1414477 / 2678117105664000,
    8191 / 612141052723200,
)
"""s = Σ Sₖ θ²ᵏ; r = −Σ Sₖ₊₁ θ²ᵏ."""
SERIES_Q = (
    1 / 8,
    1 / 384,
    1 / 15360,
    17 / 10321920,
    31 / 743178240,
    691 / 653996851200,
    5461 / 204047017574400,
)
"""q = Σ Qₖ θ²ᵏ."""


class BeamData(NamedTuple):
    """Rest shape and stiffness of m elements.

    length : (m) rest length along the arc ℓ [m]
    chord, twist : (m, 3) γ₀ [m] and ψ₀ [rad]
    axial : (m, 3) the diagonal of D₁, [EA/ℓ, k₂, k₃] [N/m]
    bending : (m, 3) the diagonal of D₂, [GJ, EI₂, EI₃]/ℓ [N m]
    """

    length: Floats
    chord: Floats
    twist: Floats
    axial: Floats
    bending: Floats


def beam_data(centreline: Centreline, sections: Sequence[Profile]) -> BeamData:
    """The elements of a device whose rest shape is `centreline`, with the cross-section in the middle of each element.

    Raises
    ------
    ValueError
        The number of sections is not that of the centreline, or an element turns by π or more.
    """
    count = int(centreline.section.max()) + 1
    if len(sections) != count:
        raise ValueError(f"sections: {len(sections)} profiles: must be {count}, one for each section of the centreline")
    length = np.diff(centreline.arc)
    chord, twist = strains(np.diff(centreline.points, axis=0), centreline.frames)
    if (bad := np.flatnonzero(np.linalg.norm(twist, axis=1) > 0.9 * np.pi)).size:
        raise ValueError(f"elements: {bad.size} turn by more than 0.9 π, the first is {bad[0]}: must be shorter")
    s = centreline.relative()
    parts = [(np.flatnonzero(centreline.section == i), profile) for i, profile in enumerate(sections)]
    stiffness = np.empty((6, len(length)))
    for members, profile in parts:
        stiffness[:, members] = profile.at(s[members])[:6]
    EA, GJ, EI2, EI3, GA2, GA3 = stiffness
    k2 = 1 / (length**3 / (12 * EI3) + length / GA2)
    k3 = 1 / (length**3 / (12 * EI2) + length / GA3)
    axial = np.stack([EA / length, k2, k3], axis=1)
    bending = np.stack([GJ, EI2, EI3], axis=1) / length[:, None]
    return BeamData(length, chord, twist, axial, bending)


def strains(edges: Floats, R: Floats) -> tuple[Floats, Floats]:
    """γ (m, 3) [m] and ψ (m, 3) [rad] of the elements between successive nodes.

    Parameters
    ----------
    edges : x₂ − x₁ (m, 3) [m]
    R : frames of the nodes (m + 1, 3, 3)
    """
    Rm, psi = mean(R[:-1], R[1:])
    return _straightened(psi, np.einsum("mji,mj->mi", Rm, edges)), psi


def least_force(data: BeamData) -> float:
    """The least force that an imbalance is measured by: 1e-8 of it is a strain of 1e-15, the round-off of strains."""
    return 1e-7 * float((data.axial[:, 0] * data.length).max())


def energy(edges: Floats, R: Floats, data: BeamData) -> Floats:
    """U (m) [J]."""
    gamma, psi = strains(edges, R)
    return np.asarray(((gamma - data.chord) ** 2 * data.axial + (psi - data.twist) ** 2 * data.bending).sum(axis=1) / 2)


def forces(edges: Floats, R: Floats, data: BeamData) -> Floats:
    """∂U/∂(dx₁, dθ₁, dx₂, dθ₂), (m, 12) [N, N m].

    U has the derivatives N = Z D₁(γ − γ₀) to c and M to ψ; with L = N × c those to (u, A, D) are N, L and qψ×L + SM.
    """
    return _expand(*_forces(edges, R, data)[:2])


def stiffness(edges: Floats, R: Floats, data: BeamData) -> Floats:
    """Symmetric part (m, 12, 12) of ∂`forces`/∂(dx₁, dθ₁, dx₂, dθ₂); the rest vanishes where loads balance.

    On (u, A, D) the derivative is that of (N, L, P) and what the mean frame's turn adds, dm × (…).

    Source: Simo, Comput. Methods Appl. Mech. Eng. 96 (1992) on the symmetric part.
    """
    K = tangent(edges, R, data)
    return np.asarray((K + np.swapaxes(K, 1, 2)) / 2)


def tangent(edges: Floats, R: Floats, data: BeamData) -> Floats:
    """∂`forces`/∂(dx₁, dθ₁, dx₂, dθ₂), (m, 12, 12), not symmetric out of balance: the spins do not commute."""
    Rm, (N, L, P), c, M, psi = _forces(edges, R, data)
    E, F, V = _second_derivatives(c, psi, data)
    s, r, q, ds, dr, dq = (f[:, None, None] for f in coefficients((psi**2).sum(axis=1)))
    z, chord, N_, L_, P_ = (cross_matrix(a) for a in (psi, c, N, L, P))
    S, Q = s * np.eye(3) + r * _outer(psi, psi), -q * z
    # d(N, L, P) = (…) u + (…) dm + (…) dψ
    dN = E, E @ chord - N_, F
    dL = N_ - chord @ E, (N_ - chord @ E) @ chord - L_, -chord @ F
    psi_M = (psi * M).sum(axis=1)[:, None, None]
    dSM = ds * _outer(M, psi) + (dr * psi_M) * _outer(psi, psi) + r * (psi_M * np.eye(3) + _outer(psi, M))
    SF = S @ np.swapaxes(F, 1, 2)
    turn = dq * _outer(np.cross(psi, L), psi) - q * L_
    dP = q * z @ dL[0] + SF, q * z @ (dL[1] + L_) + SF @ chord - P_, turn + q * z @ dL[2] + dSM + S @ V
    K = np.concatenate([np.concatenate([u, m, m @ Q + w @ S], axis=2) for u, m, w in (dN, dL, dP)], axis=1)
    T = _to_element(Rm)
    return np.asarray(np.swapaxes(T, 1, 2) @ K @ T)


def coefficients(t: Floats) -> tuple[Floats, Floats, Floats, Floats, Floats, Floats]:
    """s, r, q and (ds/dθ)/θ, (dr/dθ)/θ, (dq/dθ)/θ as functions of t = θ² (m)."""
    small = t < SMALL
    x = np.where(small, t, 0.0)
    S, Q = np.polynomial.Polynomial(SERIES_S), np.polynomial.Polynomial(SERIES_Q)
    r_series = -np.polynomial.Polynomial(SERIES_S[1:])
    series = (S(x), r_series(x), Q(x), 2 * S.deriv()(x), 2 * r_series.deriv()(x), 2 * Q.deriv()(x))
    t = np.where(small, 1.0, t)
    half = np.sqrt(t) / 2
    w = np.cos(half)
    s = half / np.sin(half)
    r = (1 - s) / t
    q = np.tan(half / 2) / (4 * half)
    ds = s * (1 - s * w) / t
    closed = (s, r, q, ds, -(ds + 2 * r) / t, (1 / (4 * (1 + w)) - q) / t)
    s, r, q, ds, dr, dq = (np.where(small, a, b) for a, b in zip(series, closed, strict=True))
    return s, r, q, ds, dr, dq


def _forces(edges: Floats, R: Floats, data: BeamData) -> tuple[Floats, list[Floats], Floats, Floats, Floats]:
    Rm, psi = mean(R[:-1], R[1:])
    c = np.einsum("mji,mj->mi", Rm, edges)
    s, r, q = (f[:, None] for f in coefficients((psi**2).sum(axis=1))[:3])
    N = data.axial * (_straightened(psi, c) - data.chord)
    on_psi, on_c = (_dot(psi, a) for a in (N, c))
    M = data.bending * (psi - data.twist) + _dot(N, c) / 12 * psi - (on_c * N + on_psi * c) / 24
    N = _straightened(psi, N)
    L = np.cross(N, c)
    P = q * np.cross(psi, L) + s * M + r * _dot(psi, M) * psi
    return Rm, [N, L, P], c, M, psi


def _second_derivatives(c: Floats, psi: Floats, data: BeamData) -> tuple[Floats, Floats, Floats]:
    """∂²U: E to c twice, F to c and ψ, V to ψ twice, (m, 3, 3) each."""
    N = data.axial * (_straightened(psi, c) - data.chord)
    Z = np.eye(3) - cross_matrix(psi) @ cross_matrix(psi) / 24
    D1, I = _diagonal(data.axial), np.eye(3)
    B, B_N = (_outer(a, psi) / 12 - (_outer(psi, a) + _dot(psi, a)[..., None] * I) / 24 for a in (c, N))  # ∂(Za)/∂ψ
    V = _diagonal(data.bending) + np.swapaxes(B, 1, 2) @ D1 @ B
    V += _dot(N, c)[..., None] / 12 * I - (_outer(N, c) + _outer(c, N)) / 24
    return Z @ D1 @ Z, Z @ D1 @ B + B_N, V


def _straightened(psi: Floats, a: Floats) -> Floats:
    """Za = a − ψ×(ψ×a)/24."""
    return np.asarray(a - np.cross(psi, np.cross(psi, a)) / 24)


def _dot(a: Floats, b: Floats) -> Floats:
    return np.asarray((a * b).sum(axis=1, keepdims=True))


def _expand(Rm: Floats, f: list[Floats]) -> Floats:
    N, L, P = (np.einsum("mij,mj->mi", Rm, a) for a in f)
    return np.concatenate([-N, L / 2 - P, N, L / 2 + P], axis=1)


def _to_element(Rm: Floats) -> Floats:
    """T (m, 9, 12) with (u, A, D) = T (dx₁, dθ₁, dx₂, dθ₂)."""
    B, zero = np.swapaxes(Rm, 1, 2), np.zeros_like(Rm)
    return np.block([[-B, zero, B, zero], [zero, B / 2, zero, B / 2], [zero, -B, zero, B]])


def _outer(a: Floats, b: Floats) -> Floats:
    return a[:, :, None] * b[:, None, :]


def _diagonal(a: Floats) -> Floats:
    return a[:, :, None] * np.eye(3)
