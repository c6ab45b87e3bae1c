"""The campaign's own judgement of contact problems, with no code of the solvers that it judges.

Feasibility of Hx + q ≥ 0 is Farkas' alternative: either such an x exists, or some d ≥ 0 has Hᵀd = 0 and qᵀd < 0. With
W = FFᵀ the rows of F take the place of H; the x of least norm and the alternative both come out of one nonnegative
least-squares problem (Lawson & Hanson 1974, ch. 23, least distance programming).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import nnls

Floats = NDArray[np.float64]


def complementarity(W: Floats, q: Floats, lam: Floats) -> float:
    """max|min(Wᵢᵢ λᵢ, δᵢ)|/ℓ of a λ ≥ 0 in extended precision, ℓ = max(max(−q)₊, max|Wλ|); ∞ of any other λ."""
    if not (np.isfinite(lam).all() and lam.min(initial=0.0) >= 0):
        return np.inf
    carrying = np.flatnonzero(lam)
    elastic = W[:, carrying].astype(np.longdouble) @ lam[carrying].astype(np.longdouble)
    delta = elastic + q
    ell = max(-q.min(initial=0.0), np.abs(elastic).max(initial=0.0)) or np.abs(q).max(initial=0.0) or 1.0
    pull = np.diagonal(W) * lam
    return float(np.abs(np.minimum(pull, delta)).max(initial=0.0) / ell)


def gap_residual(F: Floats, q: Floats, lam: Floats, rigid: Floats | None = None) -> float:
    """max|min(Wᵢᵢ λᵢ, δᵢ)|/ℓ with δ = FFᵀλ + q + rigid, as `complementarity`; W's entries are double precision's.

    ℓ takes the rigid motion too; of rigid bodies a force on an open gap weighs as the gap.
    """
    if not (np.isfinite(lam).all() and lam.min(initial=0.0) >= 0):
        return np.inf
    carrying = np.flatnonzero(lam)
    W = (F @ F[carrying].T).astype(np.longdouble)
    elastic = W @ lam[carrying].astype(np.longdouble)
    moved = elastic if rigid is None else elastic + rigid
    delta = moved + q
    motions = max(float(np.abs(elastic).max(initial=0.0)), 0.0 if rigid is None else float(np.abs(rigid).max()))
    ell = max(float(-q.min(initial=0.0)), motions) or float(np.abs(q).max(initial=0.0)) or 1.0
    pull = np.zeros(len(q))
    pull[carrying] = (F[carrying] ** 2).sum(axis=1) * lam[carrying]
    if rigid is not None:
        pull = np.maximum(pull, ell * lam / (lam.max(initial=0.0) or 1.0))
    return float(np.abs(np.minimum(pull, delta)).max(initial=0.0) / ell)


def balance(G: Floats, r: Floats, lam: Floats) -> float:
    """|Gᵀλ + r| over the sum of the forces' magnitudes."""
    forces = float((np.abs(G).T @ lam + np.abs(r)).max(initial=0.0))
    return float(np.abs(G.T @ lam + r).max(initial=0.0) / forces) if forces else 0.0


def opened(F: Floats, q: Floats) -> bool:
    """Whether the motion of least norm is found and opens all gaps, to 1e-10 of the largest motion of a row."""
    x = least_motion(F, q)
    return x is not None and bool((F @ x + q).min() >= -1e-10 * max(float(np.abs(F @ x).max()), float(-q.min())))


def opposed(F: Floats, q: Floats) -> bool:
    """Whether some d ≥ 0 has Fᵀd = 0 and qᵀd < 0, to rounding: no motion can open all gaps."""
    norms = np.linalg.norm(F, axis=1)
    rows = np.where(norms > 0, norms, 1.0)
    unit, gaps = (F / rows[:, None]).T, q / rows
    depth = float(-gaps.min())
    E = np.vstack([unit, -gaps / depth])
    f = np.zeros(len(E))
    f[-1] = 1.0
    d, _ = nnls(E, f, maxiter=20 * len(q) + 200)
    return bool(np.abs(unit @ d).max() <= 1e-9 * d.sum() and gaps @ d < -1e-6 * depth * d.sum() / len(d))


def least_motion(F: Floats, q: Floats) -> Floats | None:
    """The x of least norm with F x + q ≥ 0; None where there is none.

    With E = [Fᵀ; −qᵀ] and f = (0, …, 0, 1), ρ = E u − f at the minimiser u ≥ 0 of |E u − f| gives x = −ρ/ρ_{n+1}; ρ = 0
    is the alternative. Rows are scaled to |Fᵢ| = 1 and q to its least entry.
    """
    norms = np.linalg.norm(F, axis=1)
    rows = np.where(norms > 0, norms, 1.0)
    gaps = q / rows
    depth = float(-gaps.min(initial=0.0))
    if depth == 0.0:
        return np.zeros(F.shape[1])
    E = np.vstack([(F / rows[:, None]).T, -gaps / depth])
    f = np.zeros(len(E))
    f[-1] = 1.0
    u, _ = nnls(E, f, maxiter=20 * len(q) + 200)
    rho = E @ u - f
    if -rho[-1] <= 1e-13 * max(1.0, float(np.abs(u).max(initial=0.0))):
        return None
    return np.asarray(-depth * rho[:-1] / rho[-1])
