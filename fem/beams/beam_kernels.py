"""The beam element, compiled: one loop over a chain of elements (i, i + 1) fills nodal forces and 6 × 6 blocks.

Oracle: `beam_element`, whose symbols these are. Here the work is done in the fixed frame, where ψ, c, N, L, M, P are
plain vectors, c is the element's edge, and every product with a cross-product matrix is a cross product: no matrix is
rotated.

Edges x₂ − x₁ (N − 1, 3) are kept beside the positions and updated by differences of increments: formed from positions
far from the origin they would lose digits that EA multiplies. An element whose ends turn by π against each other has no
mean frame; its forces are not finite.
"""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray

from fem.beams.beam_element import SERIES_Q, SERIES_S, SMALL
from fem.beams.frame_kernels import frame
from fem.vectors import (
    Matrix,
    Vector,
    add,
    at,
    combined,
    cross,
    dot,
    minus_spin,
    put,
    rows_cross,
    scaled,
    spatial,
    summed,
    symmetric,
    times,
    transposed,
)

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

S0, S1, S2, S3, S4, S5, S6, S7 = SERIES_S
Q0, Q1, Q2, Q3, Q4, Q5, Q6 = SERIES_Q


@njit(cache=True, error_model="numpy")
def _r(t: float, s: float) -> float:
    """(1 − s)/t."""
    if t < SMALL:
        return -(S1 + t * (S2 + t * (S3 + t * (S4 + t * (S5 + t * (S6 + t * S7))))))
    return (1.0 - s) / t


@njit(cache=True, error_model="numpy")
def _rates(t: float, s: float, r: float, q: float, w: float) -> Vector:
    """(ds/dθ)/θ, (dr/dθ)/θ, (dq/dθ)/θ."""
    if t < SMALL:
        ds = 2 * (S1 + t * (2 * S2 + t * (3 * S3 + t * (4 * S4 + t * (5 * S5 + t * (6 * S6 + t * 7 * S7))))))
        dr = -2 * (S2 + t * (2 * S3 + t * (3 * S4 + t * (4 * S5 + t * (5 * S6 + t * 6 * S7)))))
        dq = 2 * (Q1 + t * (2 * Q2 + t * (3 * Q3 + t * (4 * Q4 + t * (5 * Q5 + t * 6 * Q6)))))
        return ds, dr, dq
    ds = s * (1.0 - s * w) / t
    return ds, -(ds + 2.0 * r) / t, (0.25 / (1.0 + w) - q) / t


@njit(cache=True, error_model="numpy")
def _straightened(psi: Vector, a: Vector) -> Vector:
    """Za = a − ψ×(ψ×a)/24."""
    return add(times(1.0 + dot(psi, psi) / 24.0, a), times(-dot(psi, a) / 24.0, psi))


@njit(cache=True, error_model="numpy")
def _stress(strain: Vector, rest: Floats, stiffness: Floats, i: int, e1: Vector, e2: Vector, e3: Vector) -> Vector:
    """Σ kⱼ (strain·eⱼ − restⱼ) eⱼ."""
    f1 = stiffness[i, 0] * (dot(e1, strain) - rest[i, 0])
    f2 = stiffness[i, 1] * (dot(e2, strain) - rest[i, 1])
    f3 = stiffness[i, 2] * (dot(e3, strain) - rest[i, 2])
    return combined(f1, e1, f2, e2, f3, e3)


@njit(cache=True, error_model="numpy")
def _moment(M: Vector, N: Vector, c: Vector, psi: Vector) -> Vector:
    """∂U/∂ψ where D₂(ψ − ψ₀) = M and D₁(γ − γ₀) = N: M + ψ N·c/12 − (N ψ·c + c ψ·N)/24."""
    return add(M, combined(dot(N, c) / 12.0, psi, -dot(psi, c) / 24.0, N, -dot(psi, N) / 24.0, c))


@njit(cache=True, error_model="numpy")
def _second_derivatives(D1: Matrix, D2: Matrix, N: Vector, c: Vector, psi: Vector) -> tuple[Matrix, Matrix, Matrix]:
    """E, F, V as `beam_element` has them; N = D₁(γ − γ₀)."""
    alpha, psi_c = 1.0 + dot(psi, psi) / 24.0, dot(psi, c)
    w = dot(D1[0], psi), dot(D1[1], psi), dot(D1[2], psi)
    v = dot(D1[0], c), dot(D1[1], c), dot(D1[2], c)
    psi_w, psi_v = dot(psi, w), dot(psi, v)
    # D₁B with B = ∂(Zc)/∂ψ = cψᵀ/12 − (ψcᵀ + ψ·c I)/24, and ψ and c times it
    DB = (
        combined(v[0] / 12.0, psi, -w[0] / 24.0, c, -psi_c / 24.0, D1[0]),
        combined(v[1] / 12.0, psi, -w[1] / 24.0, c, -psi_c / 24.0, D1[1]),
        combined(v[2] / 12.0, psi, -w[2] / 24.0, c, -psi_c / 24.0, D1[2]),
    )
    psi_DB = combined(psi_v / 12.0, psi, -psi_w / 24.0, c, -psi_c / 24.0, w)
    c_DB = combined(dot(c, v) / 12.0, psi, -psi_v / 24.0, c, -psi_c / 24.0, v)
    on_E = add(times(psi_w / 576.0, psi), times(-alpha / 24.0, w))
    E = (
        combined(alpha * alpha, D1[0], psi[0], on_E, -alpha / 24.0 * w[0], psi),
        combined(alpha * alpha, D1[1], psi[1], on_E, -alpha / 24.0 * w[1], psi),
        combined(alpha * alpha, D1[2], psi[2], on_E, -alpha / 24.0 * w[2], psi),
    )
    both, f = times(-1.0 / 24.0, add(psi_DB, N)), -dot(psi, N) / 24.0
    F = (
        add((f, 0.0, 0.0), combined(alpha, DB[0], psi[0], both, N[0] / 12.0, psi)),
        add((0.0, f, 0.0), combined(alpha, DB[1], psi[1], both, N[1] / 12.0, psi)),
        add((0.0, 0.0, f), combined(alpha, DB[2], psi[2], both, N[2] / 12.0, psi)),
    )
    g, h, on_V = dot(N, c) / 12.0, -psi_c / 24.0, times(1.0 / 12.0, c_DB)
    V = (
        add(add(D2[0], (g, 0.0, 0.0)), add(combined(psi[0], on_V, c[0], both, h, DB[0]), times(-N[0] / 24.0, c))),
        add(add(D2[1], (0.0, g, 0.0)), add(combined(psi[1], on_V, c[1], both, h, DB[1]), times(-N[1] / 24.0, c))),
        add(add(D2[2], (0.0, 0.0, g)), add(combined(psi[2], on_V, c[2], both, h, DB[2]), times(-N[2] / 24.0, c))),
    )
    return E, F, V


@njit(cache=True, error_model="numpy")
def _add_forces(f: Floats, i: int, N: Vector, L: Vector, P: Vector) -> None:
    for k in range(3):
        f[i, k] -= N[k]
        f[i, 3 + k] += 0.5 * L[k] - P[k]
        f[i + 1, k] += N[k]
        f[i + 1, 3 + k] += 0.5 * L[k] + P[k]


@njit(cache=True, error_model="numpy")
def assemble_forces(
    edges: Floats, R: Floats, chord: Floats, twist: Floats, axial: Floats, bending: Floats
) -> Floats:  # fmt: skip
    """The sum of `beam_element.forces` at the nodes, (N, 6) [N, N m].

    Parameters
    ----------
    edges : x₂ − x₁ (N − 1, 3) [m]
    R : frames (N, 3, 3)
    chord, twist, axial, bending : (N − 1, 3), as in `beam_element.BeamData`
    """
    f = np.zeros((len(R), 6))
    for i in range(len(edges)):
        s, w, angles, e1, e2, e3 = frame(R, i)
        c = (edges[i, 0], edges[i, 1], edges[i, 2])
        psi = combined(angles[0], e1, angles[1], e2, angles[2], e3)
        stress = _stress(_straightened(psi, c), chord, axial, i, e1, e2, e3)
        M = _moment(_stress(psi, twist, bending, i, e1, e2, e3), stress, c, psi)
        N = _straightened(psi, stress)
        L = cross(N, c)
        r, q = _r(dot(psi, psi), s), 0.25 / (s * (1.0 + w))
        P = combined(q, cross(psi, L), s, M, r * dot(psi, M), psi)
        _add_forces(f, i, N, L, P)
    return f


@njit(cache=True, error_model="numpy")
def assemble_blocks(
    edges: Floats, R: Floats, chord: Floats, twist: Floats, axial: Floats, bending: Floats, stress: Floats | None = None
) -> tuple[Floats, Floats]:
    """The tangent; parameters as for `assemble_forces`.

    Parameters
    ----------
    stress : (N − 1, 6) forces D₁(γ − γ₀) [N] and moments D₂(ψ − ψ₀) [N m] in the element's frame to form it with,
        instead of those of the configuration

    Returns
    -------
    diagonal, upper : (N, 6, 6) and (N − 1, 6, 6), the sum of `beam_element.stiffness`: K's blocks (i, i) and (i, i + 1)
    """
    n = len(R)
    diagonal, upper = np.zeros((n, 6, 6)), np.empty((n - 1, 6, 6))
    for i in range(n - 1):
        s, w, angles, e1, e2, e3 = frame(R, i)
        c = (edges[i, 0], edges[i, 1], edges[i, 2])
        psi = combined(angles[0], e1, angles[1], e2, angles[2], e3)
        if stress is None:
            force = _stress(_straightened(psi, c), chord, axial, i, e1, e2, e3)
            moment = _stress(psi, twist, bending, i, e1, e2, e3)
        else:
            force = combined(stress[i, 0], e1, stress[i, 1], e2, stress[i, 2], e3)
            moment = combined(stress[i, 3], e1, stress[i, 4], e2, stress[i, 5], e3)
        M = _moment(moment, force, c, psi)
        N = _straightened(psi, force)
        L = cross(N, c)
        t, psi_M = dot(psi, psi), dot(psi, M)
        r, q = _r(t, s), 0.25 / (s * (1.0 + w))
        ds, dr, dq = _rates(t, s, r, q, w)
        turn = cross(psi, L)
        P = combined(q, turn, s, M, r * psi_M, psi)

        D1, D2 = spatial(axial, i, e1, e2, e3), spatial(bending, i, e1, e2, e3)
        E, F, V = _second_derivatives(D1, D2, force, c, psi)
        # On u: E, G = Ec^ − N^, GQ + FS. On A and D, with X = Gᵀc^: X − L^, (X − L^)Q − c^FS, qzX − P^ + SFᵀc^, …
        G = minus_spin(rows_cross(E, c), N)
        Gz = rows_cross(G, psi)
        FS = (
            add(times(s, F[0]), times(r * dot(F[0], psi), psi)),
            add(times(s, F[1]), times(r * dot(F[1], psi), psi)),
            add(times(s, F[2]), times(r * dot(F[2], psi), psi)),
        )
        SFc = rows_cross(transposed(FS), c)
        SFcz = rows_cross(SFc, psi)
        X = rows_cross(transposed(G), c)
        AA = minus_spin(X, L)
        AAz = rows_cross(AA, psi)
        DA = minus_spin(scaled(-q, transposed(rows_cross(transposed(X), psi))), P)
        DAz = rows_cross(DA, psi)

        # dP's part in dψ, symmetric: a I + sym(p ψᵀ) + s²V with p collecting all that multiplies ψ
        Y = dot(V[0], psi), dot(V[1], psi), dot(V[2], psi)
        along = dr * psi_M + 2.0 * r * r * psi_M + r * r * dot(psi, Y)
        p = add(combined(dq + q * r, turn, ds + r * s, M, along, psi), times(2.0 * s * r, Y))
        isotropic = r * s * psi_M

        bent = (times(0.5 * p[0], psi), times(0.5 * p[1], psi), times(0.5 * p[2], psi))
        bent = summed(s * s, V, 1.0, symmetric(bent))
        bent = summed(1.0, bent, -1.0, symmetric(summed(0.5 * q, DAz, q, SFcz)))
        bent = (
            add(bent[0], (isotropic, 0.0, 0.0)),
            add(bent[1], (0.0, isotropic, 0.0)),
            add(bent[2], (0.0, 0.0, isotropic)),
        )
        mixed = summed(0.25, transposed(DA), 0.5, transposed(SFc))
        mixed = summed(1.0, mixed, -0.25 * q, AAz)
        outer, both = summed(0.125, symmetric(AA), 1.0, bent), symmetric(mixed)
        # on u of either end against the rotation of the first and the second node
        ud = summed(1.0, FS, -q, Gz)
        first, second = summed(0.5, G, -1.0, ud), summed(0.5, G, 1.0, ud)

        # What the element before has left at its second node is there already.
        put(diagonal, i, 0, 0, summed(1.0, at(diagonal, i, 0, 0), 1.0, E))
        put(diagonal, i, 0, 3, summed(1.0, at(diagonal, i, 0, 3), -1.0, first))
        put(diagonal, i, 3, 0, transposed(at(diagonal, i, 0, 3)))
        put(diagonal, i, 3, 3, summed(1.0, at(diagonal, i, 3, 3), 1.0, summed(1.0, outer, -1.0, both)))
        put(diagonal, i + 1, 0, 0, E)
        put(diagonal, i + 1, 0, 3, second)
        put(diagonal, i + 1, 3, 3, summed(1.0, outer, 1.0, both))
        put(upper, i, 0, 0, scaled(-1.0, E))
        put(upper, i, 0, 3, scaled(-1.0, second))
        put(upper, i, 3, 0, transposed(first))
        skew = summed(1.0, mixed, -1.0, transposed(mixed))
        put(upper, i, 3, 3, summed(1.0, summed(0.125, symmetric(AA), -1.0, bent), 1.0, skew))
    put(diagonal, n - 1, 3, 0, transposed(at(diagonal, n - 1, 0, 3)))
    return diagonal, upper


@njit(cache=True, error_model="numpy")
def strains(edges: Floats, R: Floats) -> tuple[Floats, Floats]:
    """`beam_element.strains`: γ and ψ, (N − 1, 3) each."""
    chord, twist = np.empty_like(edges), np.empty_like(edges)
    for i in range(len(edges)):
        _, _, psi, e1, e2, e3 = frame(R, i)
        c = (edges[i, 0], edges[i, 1], edges[i, 2])
        chord[i, 0], chord[i, 1], chord[i, 2] = _straightened(psi, (dot(e1, c), dot(e2, c), dot(e3, c)))
        twist[i, 0], twist[i, 1], twist[i, 2] = psi
    return chord, twist


@njit(cache=True, error_model="numpy")
def rest_in_motion(
    edges: Floats, R: Floats, chord: Floats, twist: Floats, axial: Floats, bending: Floats, rate: float
) -> tuple[Floats, Floats, Floats]:
    """D₁(γ − γ₀) and D₂(ψ − ψ₀), (N − 1, 6), and (γ₀ + rγ)/(1 + r), (ψ₀ + rψ)/(1 + r), (N − 1, 3), r = `rate`."""
    stress = np.empty((len(edges), 6))
    gamma, psi = strains(edges, R)
    share = 1.0 / (1.0 + rate)
    for i in range(len(edges)):
        for k in range(3):
            stress[i, k] = axial[i, k] * (gamma[i, k] - chord[i, k])
            stress[i, 3 + k] = bending[i, k] * (psi[i, k] - twist[i, k])
            gamma[i, k] = share * (chord[i, k] + rate * gamma[i, k])
            psi[i, k] = share * (twist[i, k] + rate * psi[i, k])
    return stress, gamma, psi


@njit(cache=True, error_model="numpy")
def extrapolated_stress(
    edges: Floats, R: Floats, chord: Floats, twist: Floats, axial: Floats, bending: Floats, d: Floats
) -> Floats:
    """D₁(γ + dγ − γ₀) and D₂(ψ + dψ − ψ₀), (N − 1, 6), linear in increments d (N, 6); others as for `assemble_forces`.

    dγ = Z dc + (∂Z/∂ψ dψ) c; everything in the element's frame.
    """
    stress = np.empty((len(edges), 6))
    for i in range(len(edges)):
        s, w, psi, e1, e2, e3 = frame(R, i)
        edge = (edges[i, 0], edges[i, 1], edges[i, 2])
        u = (d[i + 1, 0] - d[i, 0], d[i + 1, 1] - d[i, 1], d[i + 1, 2] - d[i, 2])
        a1, a2 = (d[i, 3], d[i, 4], d[i, 5]), (d[i + 1, 3], d[i + 1, 4], d[i + 1, 5])
        A, D = combined(0.5, a1, 0.5, a2, 0.0, a1), add(a2, times(-1.0, a1))
        c, u = (dot(e1, edge), dot(e2, edge), dot(e3, edge)), (dot(e1, u), dot(e2, u), dot(e3, u))
        A, D = (dot(e1, A), dot(e2, A), dot(e3, A)), (dot(e1, D), dot(e2, D), dot(e3, D))
        r, q = _r(dot(psi, psi), s), 0.25 / (s * (1.0 + w))
        dpsi = add(times(s, D), times(r * dot(psi, D), psi))
        dc = add(u, cross(c, add(A, times(-q, cross(psi, D)))))
        bent = combined(dot(psi, dpsi) / 12.0, c, -dot(c, dpsi) / 24.0, psi, -dot(psi, c) / 24.0, dpsi)
        gamma = add(_straightened(psi, add(c, dc)), bent)
        for k in range(3):
            stress[i, k] = axial[i, k] * (gamma[k] - chord[i, k])
            stress[i, 3 + k] = bending[i, k] * (psi[k] + dpsi[k] - twist[i, k])
    return stress


@njit(cache=True, error_model="numpy")
def add_element_blocks(diagonal: Floats, upper: Floats, elements: Ints, blocks: Floats) -> None:
    """Add symmetric blocks (q, 12, 12) of elements (q), which may repeat."""
    for k in range(len(elements)):
        i = elements[k]
        for a in range(6):
            for b in range(6):
                diagonal[i, a, b] += blocks[k, a, b]
                diagonal[i + 1, a, b] += blocks[k, 6 + a, 6 + b]
                upper[i, a, b] += blocks[k, a, 6 + b]
