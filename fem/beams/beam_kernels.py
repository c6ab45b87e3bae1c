"""The beam element, compiled: one loop over a chain of elements (i, i + 1) fills nodal forces and 6 × 6 blocks.

Oracle: `beam_element`, whose symbols these are. Here the work is done in the fixed frame, where ψ, c, N, L, M, P are
plain vectors, c is the element's edge, and every product with a cross-product matrix is a cross product: no matrix is
rotated. Elements are taken side by side (`fem.lanes`): their data are copied into lanes, what one element needs is
computed in all lanes at once, and the results are added up at the nodes.

Edges x₂ − x₁ (N − 1, 3) are kept beside the positions and updated by differences of increments: formed from positions
far from the origin they would lose digits that EA multiplies. An element whose ends turn by π against each other has no
mean frame; its forces are not finite.
"""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray

from fem.beams.beam_element import SERIES_Q, SERIES_S, SMALL, BeamData
from fem.beams.frame_kernels import mean_frame
from fem.lanes import ALL, LANES, read, read_matrix, write, write_matrix
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

# Where the numbers of an element stand in its lane: after the frames of its ends
EDGE, AXIAL, BENDING, CHORD, TWIST, STRESS, OUT = 18, 21, 24, 27, 30, 33, 39


@njit(cache=True, error_model="numpy", forceinline=True)
def _r(t: float, s: float) -> float:
    """(1 − s)/t."""
    small = -(S1 + t * (S2 + t * (S3 + t * (S4 + t * (S5 + t * (S6 + t * S7))))))
    return small if t < SMALL else (1.0 - s) / t


@njit(cache=True, error_model="numpy", forceinline=True)
def _rates(t: float, s: float, r: float, q: float, w: float) -> Vector:
    """(ds/dθ)/θ, (dr/dθ)/θ, (dq/dθ)/θ."""
    ds = 2 * (S1 + t * (2 * S2 + t * (3 * S3 + t * (4 * S4 + t * (5 * S5 + t * (6 * S6 + t * 7 * S7))))))
    dr = -2 * (S2 + t * (2 * S3 + t * (3 * S4 + t * (4 * S5 + t * (5 * S6 + t * 6 * S7)))))
    dq = 2 * (Q1 + t * (2 * Q2 + t * (3 * Q3 + t * (4 * Q4 + t * (5 * Q5 + t * 6 * Q6)))))
    small = t < SMALL
    ds = ds if small else s * (1.0 - s * w) / t
    return ds, dr if small else -(ds + 2.0 * r) / t, dq if small else (0.25 / (1.0 + w) - q) / t


@njit(cache=True, error_model="numpy", forceinline=True)
def _straightened(psi: Vector, a: Vector) -> Vector:
    """Za = a − ψ×(ψ×a)/24."""
    return add(times(1.0 + dot(psi, psi) / 24.0, a), times(-dot(psi, a) / 24.0, psi))


@njit(cache=True, error_model="numpy", forceinline=True)
def _stress(strain: Vector, rest: Vector, k: Vector, e1: Vector, e2: Vector, e3: Vector) -> Vector:
    """Σ kⱼ (strain·eⱼ − restⱼ) eⱼ."""
    f1, f2, f3 = dot(e1, strain) - rest[0], dot(e2, strain) - rest[1], dot(e3, strain) - rest[2]
    return combined(k[0] * f1, e1, k[1] * f2, e2, k[2] * f3, e3)


@njit(cache=True, error_model="numpy", forceinline=True)
def _moment(M: Vector, N: Vector, c: Vector, psi: Vector) -> Vector:
    """∂U/∂ψ where D₂(ψ − ψ₀) = M and D₁(γ − γ₀) = N: M + ψ N·c/12 − (N ψ·c + c ψ·N)/24."""
    return add(M, combined(dot(N, c) / 12.0, psi, -dot(psi, c) / 24.0, N, -dot(psi, N) / 24.0, c))


@njit(cache=True, error_model="numpy", forceinline=True)
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
def _load(S: Floats, k: int, rows: Floats, first: int, count: int) -> None:
    """Rows of (N − 1, w) numbers from the `first` on into lanes, from number k on; past `count` the last one again."""
    for lane in range(LANES):
        i = first + min(lane, count - 1)
        for j in range(rows.shape[1]):
            S[LANES * (k + j) + lane] = rows[i, j]


@njit(cache=True, error_model="numpy")
def _load_elements(S: Floats, edges: Floats, R: Floats, first: int) -> int:
    """The edges of elements, and the frames of their ends by columns, into lanes; how many elements there are."""
    count = min(LANES, len(edges) - first)
    _load(S, EDGE, edges, first, count)
    for lane in range(LANES):
        i = first + min(lane, count - 1)
        for j in range(3):
            for k in range(3):
                S[LANES * (3 * j + k) + lane], S[LANES * (9 + 3 * j + k) + lane] = R[i, k, j], R[i + 1, k, j]
    return count


@njit(cache=True, error_model="numpy", forceinline=True)
def _element(S: Floats, lane: int) -> tuple[float, float, Vector, Vector, Vector, Vector, Vector]:
    """s, cos ½θ, ψ and c of a lane's element, and the columns of its frame."""
    s, w, angles, e1, e2, e3 = mean_frame(read_matrix(S, 0, lane), read_matrix(S, 9, lane))
    return s, w, combined(angles[0], e1, angles[1], e2, angles[2], e3), read(S, EDGE, lane), e1, e2, e3


@njit(cache=True, error_model="numpy")
def assemble_forces(edges: Floats, R: Floats, data: BeamData) -> Floats:
    """The sum of `beam_element.forces` at the nodes, (N, 6) [N, N m].

    Parameters
    ----------
    edges : x₂ − x₁ (N − 1, 3) [m]
    R : frames (N, 3, 3)
    data : of the N − 1 elements
    """
    f, S = np.zeros((len(R), 6)), np.empty(LANES * (OUT + 9))
    for first in range(0, len(edges), LANES):
        count = _load_elements(S, edges, R, first)
        _load(S, AXIAL, data.axial, first, count)
        _load(S, BENDING, data.bending, first, count)
        _load(S, CHORD, data.chord, first, count)
        _load(S, TWIST, data.twist, first, count)
        for lane in range(ALL):
            s, w, psi, c, e1, e2, e3 = _element(S, lane)
            stress = _stress(_straightened(psi, c), read(S, CHORD, lane), read(S, AXIAL, lane), e1, e2, e3)
            moment = _stress(psi, read(S, TWIST, lane), read(S, BENDING, lane), e1, e2, e3)
            M = _moment(moment, stress, c, psi)
            N = _straightened(psi, stress)
            L = cross(N, c)
            r, q = _r(dot(psi, psi), s), 0.25 / (s * (1.0 + w))
            write(S, OUT, lane, N)
            write(S, OUT + 3, lane, L)
            write(S, OUT + 6, lane, combined(q, cross(psi, L), s, M, r * dot(psi, M), psi))
        for lane in range(count):
            i, N, L, P = first + lane, read(S, OUT, lane), read(S, OUT + 3, lane), read(S, OUT + 6, lane)
            for k in range(3):
                f[i, k] -= N[k]
                f[i, 3 + k] += 0.5 * L[k] - P[k]
                f[i + 1, k] += N[k]
                f[i + 1, 3 + k] += 0.5 * L[k] + P[k]
    return f


@njit(cache=True, error_model="numpy", forceinline=True)
def _tangent(
    s: float, w: float, psi: Vector, c: Vector, force: Vector, moment: Vector, D1: Matrix, D2: Matrix
) -> tuple[Matrix, Matrix, Matrix, Matrix, Matrix, Matrix]:
    """The stiffness of an element under `force` D₁(γ − γ₀) and `moment` D₂(ψ − ψ₀).

    E on u; what u of its second end has against the rotation of the first and of the second node; and the rotation of
    the first node, that of the second, and the first against the second.
    """
    M = _moment(moment, force, c, psi)
    N = _straightened(psi, force)
    L = cross(N, c)
    t, psi_M = dot(psi, psi), dot(psi, M)
    r, q = _r(t, s), 0.25 / (s * (1.0 + w))
    ds, dr, dq = _rates(t, s, r, q, w)
    turn = cross(psi, L)
    P = combined(q, turn, s, M, r * psi_M, psi)

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
    twice, both = symmetric(AA), symmetric(mixed)
    outer = summed(0.125, twice, 1.0, bent)
    on_D = summed(1.0, FS, -q, Gz)
    across = summed(1.0, summed(0.125, twice, -1.0, bent), 1.0, summed(1.0, mixed, -1.0, transposed(mixed)))
    return (
        E,
        summed(0.5, G, -1.0, on_D),
        summed(0.5, G, 1.0, on_D),
        summed(1.0, outer, -1.0, both),
        summed(1.0, outer, 1.0, both),
        across,
    )


@njit(cache=True, error_model="numpy")
def assemble_blocks(edges: Floats, R: Floats, data: BeamData, stress: Floats) -> tuple[Floats, Floats]:
    """The tangent; parameters as for `assemble_forces`.

    Parameters
    ----------
    stress : forces D₁(γ − γ₀) [N] and moments D₂(ψ − ψ₀) [N m] to form it with, in the element's frame, (N − 1, 6)

    Returns
    -------
    diagonal, upper : (N, 6, 6) and (N − 1, 6, 6), the sum of `beam_element.stiffness`: K's blocks (i, i) and (i, i + 1)
    """
    n, S = len(R), np.empty(LANES * (OUT + 54))
    diagonal, upper = np.zeros((n, 6, 6)), np.empty((n - 1, 6, 6))
    for first in range(0, n - 1, LANES):
        count = _load_elements(S, edges, R, first)
        _load(S, AXIAL, data.axial, first, count)
        _load(S, BENDING, data.bending, first, count)
        _load(S, STRESS, stress, first, count)
        for lane in range(ALL):
            s, w, psi, c, e1, e2, e3 = _element(S, lane)
            f, m = read(S, STRESS, lane), read(S, STRESS + 3, lane)
            force, moment = combined(f[0], e1, f[1], e2, f[2], e3), combined(m[0], e1, m[1], e2, m[2], e3)
            D1, D2 = spatial(read(S, AXIAL, lane), e1, e2, e3), spatial(read(S, BENDING, lane), e1, e2, e3)
            E, with_first, with_second, at_first, at_second, across = _tangent(s, w, psi, c, force, moment, D1, D2)
            write_matrix(S, OUT, lane, E)
            write_matrix(S, OUT + 9, lane, with_first)
            write_matrix(S, OUT + 18, lane, with_second)
            write_matrix(S, OUT + 27, lane, at_first)
            write_matrix(S, OUT + 36, lane, at_second)
            write_matrix(S, OUT + 45, lane, across)
        for lane in range(count):
            i, E = first + lane, read_matrix(S, OUT, lane)
            with_first, with_second = read_matrix(S, OUT + 9, lane), read_matrix(S, OUT + 18, lane)
            # What the element before has left at its second node is there already.
            put(diagonal, i, 0, 0, summed(1.0, at(diagonal, i, 0, 0), 1.0, E))
            put(diagonal, i, 0, 3, summed(1.0, at(diagonal, i, 0, 3), -1.0, with_first))
            put(diagonal, i, 3, 0, transposed(at(diagonal, i, 0, 3)))
            put(diagonal, i, 3, 3, summed(1.0, at(diagonal, i, 3, 3), 1.0, read_matrix(S, OUT + 27, lane)))
            put(diagonal, i + 1, 0, 0, E)
            put(diagonal, i + 1, 0, 3, with_second)
            put(diagonal, i + 1, 3, 3, read_matrix(S, OUT + 36, lane))
            put(upper, i, 0, 0, scaled(-1.0, E))
            put(upper, i, 0, 3, scaled(-1.0, with_second))
            put(upper, i, 3, 0, transposed(with_first))
            put(upper, i, 3, 3, read_matrix(S, OUT + 45, lane))
    put(diagonal, n - 1, 3, 0, transposed(at(diagonal, n - 1, 0, 3)))
    return diagonal, upper


@njit(cache=True, error_model="numpy")
def strains(edges: Floats, R: Floats) -> tuple[Floats, Floats]:
    """`beam_element.strains`: γ and ψ, (N − 1, 3) each."""
    gamma, psi, S = np.empty_like(edges), np.empty_like(edges), np.empty(LANES * (OUT + 6))
    for first in range(0, len(edges), LANES):
        count = _load_elements(S, edges, R, first)
        for lane in range(ALL):
            _, _, angles, e1, e2, e3 = mean_frame(read_matrix(S, 0, lane), read_matrix(S, 9, lane))
            c = read(S, EDGE, lane)
            write(S, OUT, lane, _straightened(angles, (dot(e1, c), dot(e2, c), dot(e3, c))))
            write(S, OUT + 3, lane, angles)
        for lane in range(count):
            i = first + lane
            gamma[i, 0], gamma[i, 1], gamma[i, 2] = read(S, OUT, lane)
            psi[i, 0], psi[i, 1], psi[i, 2] = read(S, OUT + 3, lane)
    return gamma, psi


@njit(cache=True, error_model="numpy")
def rest_in_motion(edges: Floats, R: Floats, data: BeamData, rate: float) -> tuple[Floats, Floats, Floats]:
    """D₁(γ − γ₀) and D₂(ψ − ψ₀), (N − 1, 6), and (γ₀ + rγ)/(1 + r), (ψ₀ + rψ)/(1 + r), (N − 1, 3), r = `rate`."""
    stress = np.empty((len(edges), 6))
    gamma, psi = strains(edges, R)
    share = 1.0 / (1.0 + rate)
    for i in range(len(edges)):
        for k in range(3):
            stress[i, k] = data.axial[i, k] * (gamma[i, k] - data.chord[i, k])
            stress[i, 3 + k] = data.bending[i, k] * (psi[i, k] - data.twist[i, k])
            gamma[i, k] = share * (data.chord[i, k] + rate * gamma[i, k])
            psi[i, k] = share * (data.twist[i, k] + rate * psi[i, k])
    return stress, gamma, psi


@njit(cache=True, error_model="numpy")
def extrapolated_stress(edges: Floats, R: Floats, data: BeamData, d: Floats) -> Floats:
    """D₁(γ + dγ − γ₀) and D₂(ψ + dψ − ψ₀), (N − 1, 6), linear in increments d (N, 6); others as for `assemble_forces`.

    dγ = Z dc + (∂Z/∂ψ dψ) c; everything in the element's frame.
    """
    stress, S = np.empty((len(edges), 6)), np.empty(LANES * (OUT + 18))
    for first in range(0, len(edges), LANES):
        count = _load_elements(S, edges, R, first)
        _load(S, OUT, d, first, count)
        _load(S, OUT + 6, d[1:], first, count)
        for lane in range(ALL):
            s, w, psi, e1, e2, e3 = mean_frame(read_matrix(S, 0, lane), read_matrix(S, 9, lane))
            edge, u1, u2 = read(S, EDGE, lane), read(S, OUT, lane), read(S, OUT + 6, lane)
            a1, a2 = read(S, OUT + 3, lane), read(S, OUT + 9, lane)
            u, A, D = add(u2, times(-1.0, u1)), times(0.5, add(a1, a2)), add(a2, times(-1.0, a1))
            c, u = (dot(e1, edge), dot(e2, edge), dot(e3, edge)), (dot(e1, u), dot(e2, u), dot(e3, u))
            A, D = (dot(e1, A), dot(e2, A), dot(e3, A)), (dot(e1, D), dot(e2, D), dot(e3, D))
            r, q = _r(dot(psi, psi), s), 0.25 / (s * (1.0 + w))
            dpsi = add(times(s, D), times(r * dot(psi, D), psi))
            dc = add(u, cross(c, add(A, times(-q, cross(psi, D)))))
            bent = combined(dot(psi, dpsi) / 12.0, c, -dot(c, dpsi) / 24.0, psi, -dot(psi, c) / 24.0, dpsi)
            write(S, OUT + 12, lane, add(_straightened(psi, add(c, dc)), bent))
            write(S, OUT + 15, lane, add(psi, dpsi))
        for lane in range(count):
            i, gamma, angles = first + lane, read(S, OUT + 12, lane), read(S, OUT + 15, lane)
            for k in range(3):
                stress[i, k] = data.axial[i, k] * (gamma[k] - data.chord[i, k])
                stress[i, 3 + k] = data.bending[i, k] * (angles[k] - data.twist[i, k])
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
