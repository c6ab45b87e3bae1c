"""Places and closest points of a subdivision surface, compiled; see `subdivision`.

A point of the surface has a patch p and v, w ≥ 0, v + w ≤ 1 on it; control points are (n, 3) [m]. Oracle: the limit of
refinement by Loop's rules.
"""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray

from contact.surfaces.subdivision import LEVELS, QUARTIC, Patches

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

I, J, K = np.array(QUARTIC).T.copy()
FACTORIAL = np.array([1.0, 1.0, 2.0, 6.0, 24.0])
ITERATIONS = 60
SETTLED = 1e-12  # of an edge: the last step of Newton's method, which leaves less than its square
SADDLE = 1e-4  # where the distance falls along the surface by more, of what it rises on a plane, is no closest point


@njit(cache=True, error_model="numpy")
def quarter_of(patches: Patches, p: int, v: float, w: float) -> tuple[int, int, float, float, float]:
    """Halvings and quarter that hold (v, w), coordinates there, and their rate of change."""
    if patches.valence[p] == patches.regular:
        return 0, 0, v, w, 1.0
    level, scale = 0, 1.0
    while v + w <= 0.5 and level < LEVELS - 1:
        v, w, scale, level = 2.0 * v, 2.0 * w, 2.0 * scale, level + 1
    if v > 0.5:
        return level, 0, 2.0 * v - 1.0, 2.0 * w, 2.0 * scale
    if w > 0.5:
        return level, 1, 2.0 * v, 2.0 * w - 1.0, 2.0 * scale
    return level, 2, 1.0 - 2.0 * v, 1.0 - 2.0 * w, -2.0 * scale


@njit(cache=True, error_model="numpy")
def bezier_points(patches: Patches, control: Floats, p: int, level: int, quarter: int, b: Floats) -> None:
    """Bézier points (15, 3) of a quarter."""
    table = patches.tables[patches.valence[p], level, quarter]
    net = patches.net[p]
    b[:] = 0.0
    for k in range(table.shape[1]):
        x, y, z = control[net[k], 0], control[net[k], 1], control[net[k], 2]
        for m in range(15):
            t = table[m, k]
            b[m, 0] += t * x
            b[m, 1] += t * y
            b[m, 2] += t * z


@njit(cache=True, error_model="numpy")
def evaluate(b: Floats, v: float, w: float, rate: float, c: Floats, out: Floats) -> None:
    """S, S_v, S_w, S_vv, S_vw, S_ww (6, 3) by de Casteljau's algorithm; c (15, 3) is room for it."""
    u = 1.0 - v - w
    c[:] = b
    for d in range(4, 0, -1):
        # b of degree d at (j, k) is at j (d + 1) − j (j − 1)/2 + k
        if d == 2:
            for i in range(3):
                out[3, i] = 12.0 * rate * rate * (c[5, i] - 2.0 * c[3, i] + c[0, i])
                out[4, i] = 12.0 * rate * rate * (c[4, i] - c[3, i] - c[1, i] + c[0, i])
                out[5, i] = 12.0 * rate * rate * (c[2, i] - 2.0 * c[1, i] + c[0, i])
        if d == 1:
            for i in range(3):
                out[1, i] = 4.0 * rate * (c[2, i] - c[0, i])
                out[2, i] = 4.0 * rate * (c[1, i] - c[0, i])
        new = 0
        for j in range(d):
            row = j * (d + 1) - j * (j - 1) // 2
            below = (j + 1) * (d + 1) - (j + 1) * j // 2
            for k in range(d - j):
                for i in range(3):
                    c[new, i] = u * c[row + k, i] + v * c[below + k, i] + w * c[row + k + 1, i]
                new += 1
    out[0] = c[0]


@njit(cache=True, error_model="numpy")
def _weights(patches: Patches, p: int, v: float, w: float, out: Floats) -> None:
    """The shares of the control points in S(v, w), (K)."""
    level, quarter, v, w, _ = quarter_of(patches, p, v, w)
    u = 1.0 - v - w
    table = patches.tables[patches.valence[p], level, quarter]
    out[:] = 0.0
    for m in range(15):
        i, j, k = I[m], J[m], K[m]
        value = 24.0 / (FACTORIAL[i] * FACTORIAL[j] * FACTORIAL[k]) * u**i * v**j * w**k
        for n in range(len(out)):
            out[n] += value * table[m, n]


@njit(cache=True, error_model="numpy")
def _walk(patches: Patches, p: int, e: Floats) -> tuple[int, int]:
    """Bring barycentric coordinates e, which may be negative, into the patch that they lead to, in place.

    It returns that patch, and the corner opposite the rim where they led beyond it, else −1.
    """
    for _ in range(64):
        j = 0
        if e[1] < e[j]:
            j = 1
        if e[2] < e[j]:
            j = 2
        if e[j] >= 0.0:
            return p, -1
        a, b = (j + 1) % 3, (j + 2) % 3
        q = patches.across[p, a]
        if q < 0:
            e[a] += 0.5 * e[j]
            e[b] += 0.5 * e[j]
            e[j] = 0.0
            if e[a] < 0.0:
                e[a], e[b] = 0.0, 1.0
            elif e[b] < 0.0:
                e[a], e[b] = 1.0, 0.0
            return p, j
        # Over the edge c = a + b − d, d the far corner there: the surface is a regular net but for corners.
        k = patches.turn[p, a]
        ea, eb, ec = e[a], e[b], e[j]
        e[k], e[(k + 1) % 3], e[(k + 2) % 3] = eb + ec, ea + ec, -ec
        p = q
    for j in range(3):
        e[j] = 1.0 / 3.0
    return p, -1


@njit(cache=True, error_model="numpy")
def descend(
    patches: Patches,
    control: Floats,
    x: Floats,
    p: int,
    v: float,
    w: float,
    edge: float,
    S: Floats,
    b: Floats,
    c: Floats,
) -> tuple[int, float, float, float, int]:
    """The closest point to x from (p, v, w) on: patch, v, w, squared distance, and 1 where it is on the rim.

    Newton's method on |x − S|²/2, with the first fundamental form where its Hessian is not positive, and halved steps
    where the distance would grow. Where it ends on a saddle, opposite the nearest point of a tube, it goes on down its
    steepest side. S (6, 3) is that of the result; b and c (15, 3) are room.
    """
    e = np.empty(3)
    old_p, old_v, old_w, old = p, v, w, np.inf
    dv = dw = 0.0
    at_p, at_level, at_quarter, rim, beyond, stale = -1, -1, -1, -1, 0, True
    falling, down_v, down_w = 0.0, 0.0, 0.0
    for _ in range(ITERATIONS):
        level, quarter, lv, lw, rate = quarter_of(patches, p, v, w)
        if p != at_p or level != at_level or quarter != at_quarter:
            bezier_points(patches, control, p, level, quarter, b)
            at_p, at_level, at_quarter = p, level, quarter
        evaluate(b, lv, lw, rate, c, S)
        r0, r1, r2 = x[0] - S[0, 0], x[1] - S[0, 1], x[2] - S[0, 2]
        now = r0 * r0 + r1 * r1 + r2 * r2
        if now > old * (1.0 + 1e-12) + 1e-24 * edge * edge:
            dv, dw = 0.5 * dv, 0.5 * dw
            p, v, w = old_p, old_v, old_w
            stale = True
        else:
            old_p, old_v, old_w, old, stale = p, v, w, now, False
            gv = r0 * S[1, 0] + r1 * S[1, 1] + r2 * S[1, 2]
            gw = r0 * S[2, 0] + r1 * S[2, 1] + r2 * S[2, 2]
            Gvv = S[1, 0] * S[1, 0] + S[1, 1] * S[1, 1] + S[1, 2] * S[1, 2]
            Gvw = S[1, 0] * S[2, 0] + S[1, 1] * S[2, 1] + S[1, 2] * S[2, 2]
            Gww = S[2, 0] * S[2, 0] + S[2, 1] * S[2, 1] + S[2, 2] * S[2, 2]
            Hvv = Gvv - (r0 * S[3, 0] + r1 * S[3, 1] + r2 * S[3, 2])
            Hvw = Gvw - (r0 * S[4, 0] + r1 * S[4, 1] + r2 * S[4, 2])
            Hww = Gww - (r0 * S[5, 0] + r1 * S[5, 1] + r2 * S[5, 2])
            det, area, falling = Hvv * Hww - Hvw * Hvw, Gvv * Gww - Gvw * Gvw, 0.0
            if not (det > 1e-3 * area and Hvv > 0.0):
                # The least of the eigenvalues of H e = μ G e, and its e
                both = 0.5 * (Hvv * Gww + Hww * Gvv) - Hvw * Gvw
                falling = (both - np.sqrt(max(both * both - area * det, 0.0))) / area
                a, m, d = Hvv - falling * Gvv, Hvw - falling * Gvw, Hww - falling * Gww
                down_v, down_w = (m, -a) if abs(a) > abs(d) else (d, -m)
                Hvv, Hvw, Hww = Gvv, Gvw, Gww
                det = Hvv * Hww - Hvw * Hvw
            dv, dw = (Hww * gv - Hvw * gw) / det, (Hvv * gw - Hvw * gv) / det
            beyond = 0
            if rim >= 0:
                outward = -(dv + dw) if rim == 0 else dv if rim == 1 else dw
                if outward < 0.0:
                    # Along the rim only: from corner rim + 1 to corner rim + 2
                    beyond = 1
                    ev, ew = (-1.0, 1.0) if rim == 0 else (0.0, -1.0) if rim == 1 else (1.0, 0.0)
                    bent = ev * ev * Hvv + 2.0 * ev * ew * Hvw + ew * ew * Hww
                    along = (ev * gv + ew * gw) / bent
                    dv, dw = along * ev, along * ew
            if Gvv * dv * dv + 2.0 * Gvw * dv * dw + Gww * dw * dw <= (SETTLED * edge) ** 2:
                if beyond or falling >= -SADDLE:
                    break
                largest = max(abs(down_v), abs(down_w))
                dv, dw = (0.1 * down_v / largest, 0.1 * down_w / largest) if largest > 0.0 else (0.1, 0.0)
            longest = max(abs(dv), abs(dw))
            if longest > 1.0:
                dv, dw = dv / longest, dw / longest
        v, w = v + dv, w + dw
        e[0], e[1], e[2] = 1.0 - v - w, v, w
        before = rim
        p, rim = _walk(patches, p, e)
        v, w = e[1], e[2]
        if rim < 0 and before >= 0 and p == old_p and e[before] <= 0.0:
            rim = before
        stale = True
    if stale:
        level, quarter, lv, lw, rate = quarter_of(patches, old_p, old_v, old_w)
        bezier_points(patches, control, old_p, level, quarter, b)
        evaluate(b, lv, lw, rate, c, S)
    return old_p, old_v, old_w, old, beyond


@njit(cache=True, error_model="numpy")
def _foot(S: Floats, x: Floats, beyond: int, point: Floats, normal: Floats, curvature: Floats) -> float:
    """The signed distance of x from its foot, whose place, normal and Hessian of the distance at x are filled in.

    With the forms G and h: −G⁻¹h (G − d h)⁻¹ in the basis of the tangents, and zero at the rim or beyond a focus.
    """
    r0, r1, r2 = x[0] - S[0, 0], x[1] - S[0, 1], x[2] - S[0, 2]
    point[:] = S[0]
    n0 = S[1, 1] * S[2, 2] - S[1, 2] * S[2, 1]
    n1 = S[1, 2] * S[2, 0] - S[1, 0] * S[2, 2]
    n2 = S[1, 0] * S[2, 1] - S[1, 1] * S[2, 0]
    size = np.sqrt(n0 * n0 + n1 * n1 + n2 * n2)
    n0, n1, n2 = n0 / size, n1 / size, n2 / size
    curvature[:] = 0.0
    if beyond:
        away = np.sqrt(r0 * r0 + r1 * r1 + r2 * r2)
        if away > 0.0:
            n0, n1, n2 = r0 / away, r1 / away, r2 / away
        normal[0], normal[1], normal[2] = n0, n1, n2
        return float(away)
    normal[0], normal[1], normal[2] = n0, n1, n2
    d = r0 * n0 + r1 * n1 + r2 * n2
    Gvv = S[1, 0] * S[1, 0] + S[1, 1] * S[1, 1] + S[1, 2] * S[1, 2]
    Gvw = S[1, 0] * S[2, 0] + S[1, 1] * S[2, 1] + S[1, 2] * S[2, 2]
    Gww = S[2, 0] * S[2, 0] + S[2, 1] * S[2, 1] + S[2, 2] * S[2, 2]
    hvv = n0 * S[3, 0] + n1 * S[3, 1] + n2 * S[3, 2]
    hvw = n0 * S[4, 0] + n1 * S[4, 1] + n2 * S[4, 2]
    hww = n0 * S[5, 0] + n1 * S[5, 1] + n2 * S[5, 2]
    det = Gvv * Gww - Gvw * Gvw
    # C = G − d h, and M = −G⁻¹ h C⁻¹
    Cvv, Cvw, Cww = Gvv - d * hvv, Gvw - d * hvw, Gww - d * hww
    detC = Cvv * Cww - Cvw * Cvw
    if detC > 1e-6 * det and Cvv > 0.0:
        a = (Gww * hvv - Gvw * hvw) / det
        b = (Gww * hvw - Gvw * hww) / det
        c = (Gvv * hvw - Gvw * hvv) / det
        e = (Gvv * hww - Gvw * hvw) / det
        Mvv, Mvw = -(a * Cww - b * Cvw) / detC, -(b * Cvv - a * Cvw) / detC
        Mwv, Mww = -(c * Cww - e * Cvw) / detC, -(e * Cvv - c * Cvw) / detC
        Mvw = 0.5 * (Mvw + Mwv)
        for i in range(3):
            for j in range(3):
                curvature[i, j] = (
                    Mvv * S[1, i] * S[1, j] + Mvw * (S[1, i] * S[2, j] + S[2, i] * S[1, j]) + Mww * S[2, i] * S[2, j]
                )
    return float(d)


Feet = tuple[Floats, Floats, Floats, Floats, Floats, Ints]


@njit(cache=True, error_model="numpy")
def closest(patches: Patches, control: Floats, edge: float, x: Floats, patch: Ints, at: Floats) -> Feet:
    """Feet of x (q, 3) from places (patch, at) (q), (q, 2) near them, which are brought to the feet.

    Returns
    -------
    signed distance (q), foot and normal (q, 3), Hessian of the distance (q, 3, 3), shares of the patch's control points
    (q, K), and 1 where the foot is on the rim (q): there the distance is positive, and the normal leads to x
    """
    q = len(x)
    distance, point, normal = np.empty(q), np.empty((q, 3)), np.empty((q, 3))
    curvature, shares = np.empty((q, 3, 3)), np.empty((q, patches.net.shape[1]))
    rim = np.empty(q, dtype=np.int64)
    S, b, c = np.empty((6, 3)), np.empty((15, 3)), np.empty((15, 3))
    for i in range(q):
        p, v, w, _, beyond = descend(patches, control, x[i], patch[i], at[i, 0], at[i, 1], edge, S, b, c)
        patch[i], at[i, 0], at[i, 1], rim[i] = p, v, w, beyond
        _weights(patches, p, v, w, shares[i])
        distance[i] = _foot(S, x[i], beyond, point[i], normal[i], curvature[i])
    return distance, point, normal, curvature, shares, rim


@njit(cache=True, error_model="numpy")
def places(patches: Patches, control: Floats, patch: Ints, at: Floats) -> tuple[Floats, Floats]:
    """Points of the surface and S_v × S_w there, (q, 3) each."""
    q = len(patch)
    point, normal = np.empty((q, 3)), np.empty((q, 3))
    S, b, c = np.empty((6, 3)), np.empty((15, 3)), np.empty((15, 3))
    for i in range(q):
        level, quarter, v, w, rate = quarter_of(patches, patch[i], at[i, 0], at[i, 1])
        bezier_points(patches, control, patch[i], level, quarter, b)
        evaluate(b, v, w, rate, c, S)
        point[i] = S[0]
        for k in range(3):
            k1, k2 = (k + 1) % 3, (k + 2) % 3
            normal[i, k] = S[1, k1] * S[2, k2] - S[1, k2] * S[2, k1]
    return point, normal


@njit(cache=True, error_model="numpy")
def _slopes(patches: Patches, p: int, v: float, w: float, out: Floats) -> None:
    """The derivatives along v and w of the shares in S(v, w), (2, K)."""
    level, quarter, v, w, rate = quarter_of(patches, p, v, w)
    u = 1.0 - v - w
    table = patches.tables[patches.valence[p], level, quarter]
    out[:] = 0.0
    for m in range(15):
        i, j, k = I[m], J[m], K[m]
        factor = 24.0 * rate / (FACTORIAL[i] * FACTORIAL[j] * FACTORIAL[k])
        less = i * u ** max(i - 1, 0) * v**j * w**k
        along_v = factor * (j * u**i * v ** max(j - 1, 0) * w**k - less)
        along_w = factor * (k * u**i * v**j * w ** max(k - 1, 0) - less)
        for n in range(out.shape[1]):
            out[0, n] += along_v * table[m, n]
            out[1, n] += along_w * table[m, n]


@njit(cache=True, error_model="numpy")
def second_forms(
    patches: Patches, control: Floats, patch: Ints, at: Floats, distance: Floats
) -> tuple[Floats, Floats, Floats]:
    """−∂²d of the distance of points from the surface when both move, at feet (patch, at), (q), (q, 2).

    With e = y_α·(δp − δy) and s = n·∂_α δy, δy the motion of the surface at a fixed place, the foot moves by
    C⁻¹(e + d s), C = G − d h, and

        d ∂²d = eᵀG⁻¹e − (e + d s)ᵀC⁻¹(e + d s).

    Returns
    -------
    the matrices of −∂²d in (e, s), (q, 4, 4); the tangents y_v, y_w (q, 2, 3); the shares in ∂_v δy, ∂_w δy (q, 2, K)
    """
    q = len(patch)
    M, tangents = np.zeros((q, 4, 4)), np.empty((q, 2, 3))
    slopes = np.empty((q, 2, patches.net.shape[1]))
    S, b, c = np.empty((6, 3)), np.empty((15, 3)), np.empty((15, 3))
    G, h, C = np.empty((2, 2)), np.empty((2, 2)), np.empty((2, 2))
    for i in range(q):
        level, quarter, v, w, rate = quarter_of(patches, patch[i], at[i, 0], at[i, 1])
        bezier_points(patches, control, patch[i], level, quarter, b)
        evaluate(b, v, w, rate, c, S)
        _slopes(patches, patch[i], at[i, 0], at[i, 1], slopes[i])
        tangents[i] = S[1:3]
        n = np.cross(S[1], S[2])
        n /= np.sqrt(n[0] * n[0] + n[1] * n[1] + n[2] * n[2])
        for j in range(2):
            for k in range(2):
                G[j, k] = S[1 + j] @ S[1 + k]
                h[j, k] = n @ S[3 + j + k]
                C[j, k] = G[j, k] - distance[i] * h[j, k]
        det = C[0, 0] * C[1, 1] - C[0, 1] * C[1, 0]
        if det <= 0.0 or C[0, 0] <= 0.0:
            continue  # beyond a focus
        inverse = np.array([[C[1, 1], -C[0, 1]], [-C[1, 0], C[0, 0]]]) / det
        bent = np.linalg.solve(G, h) @ inverse
        M[i, :2, :2], M[i, :2, 2:], M[i, 2:, :2] = 0.5 * (bent + bent.T), inverse, inverse
        M[i, 2:, 2:] = distance[i] * inverse
    return M, tangents, slopes
