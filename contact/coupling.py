"""The curvature of gaps between two bodies that both move: a change of low rank of their iteration matrices.

The gap of a point from a surface that moves itself has mixed second derivatives, so that −Σ λ ∂²δ = ZᵀM Z couples the
two bodies. Rows Z are few, four a contact with force, and the bodies' own matrices stay what they are (a wall's is
factorised once): with Y = Z A⁻¹Zᵀ (Woodbury 1950)

    (A + ZᵀM Z)⁻¹ = A⁻¹ − A⁻¹Zᵀ S Z A⁻¹,    S = M (I + Y M)⁻¹,

and W = H A⁻¹Hᵀ − V S Vᵀ, V = H A⁻¹Zᵀ. The curvature acts on the motion since the linearisation: where the passes end
nothing is left of it.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import LinAlgError, cho_solve, cholesky

from contact.delassus import DirectDelassus, compliance
from contact.ranks import total
from contact.rows import Rows

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

BRACE = 30.0  # the stiffness across a contact, over what its force takes away along it


@dataclass(frozen=True)
class Coupling:
    """ZᵀM Z of some contacts.

    Z : for each body, k rows for each of q contacts, (q k, n)
    M : (q, k, k)
    contacts : their numbers among the constraints, (q)
    brace : λ/a of each, what their forces take away of the stiffness against sliding at most, (q) [N/m]
    """

    Z: dict[Any, Rows]
    M: Floats
    contacts: Ints
    brace: Floats

    @property
    def count(self) -> int:
        """The number q k of rows."""
        return len(self.M) * int(self.M.shape[1])


def joined(parts: list[Coupling]) -> Coupling | None:
    """All of them, one below the other; None for none."""
    if len(parts) < 2:
        return parts[0] if parts else None
    Z = {}
    for body in {body for part in parts for body in part.Z}:
        sample = next(part.Z[body] for part in parts if body in part.Z)
        first, *others = [part.Z.get(body) or sample.blank(part.count) for part in parts]
        Z[body] = first.join(others)
    M, contacts, brace = (
        np.concatenate([getattr(part, name) for part in parts]) for name in ("M", "contacts", "brace")
    )
    return Coupling(Z, M, contacts, brace)


class CoupledDelassus(DirectDelassus):
    """The operator of bodies that a `Coupling` couples.

    Parameters
    ----------
    Z : for each body the rows along which the coupling acts
    S, V : see this module
    """

    def __init__(self, H: dict[Any, Rows], W: Floats, Z: dict[Any, Rows], S: Floats, V: Floats) -> None:
        super().__init__(H, W)
        self._Z, self._S, self._V = Z, S, V

    def along(self) -> Floats:
        """Z x of the bodies as they are. Collective."""
        parts = [total(body.comm, rows.at(body)) for body, rows in self._Z.items()]
        value: Floats = np.sum(parts, axis=0)
        return value

    def relax(self, before: Floats) -> None:
        """Let a motion without the coupling, from Z x = `before` on, feel it. Collective."""
        self._push(-self._S @ (self.along() - before))

    def correct(self, lam: Floats) -> None:
        """Add to the motion by A⁻¹Hᵀλ what the coupling makes of it. Collective."""
        self._push(-self._S @ (self._V.T @ lam))

    def _push(self, forces: Floats) -> None:
        for body, rows in self._Z.items():
            rows.add(body, forces)


def coupled(H: dict[Any, Rows], coupling: Coupling, numbers: Ints) -> CoupledDelassus | None:
    """The operator on rows H with these `numbers`, or None where some body's compliance takes solves. Collective.

    Where A + ZᵀM Z is not positive definite, the contacts hold the bodies as a rule: a multiple of each one's hᵀh
    changes no increment that keeps it closed (Debreu 1952). Failing that the negative parts of M are left out.
    """
    if any(type(rows) is not type(coupling.Z.get(body, rows)) for body, rows in H.items()):
        return None  # a wall that solids touch too: all of its rows are one sparse matrix
    stacked = {
        body: rows.join([coupling.Z[body] if body in coupling.Z else rows.blank(coupling.count)])
        for body, rows in H.items()
    }
    C = compliance(stacked)
    if C is None:
        return None
    c = len(numbers)
    own = c + np.arange(coupling.count)
    among = np.flatnonzero(np.isin(coupling.contacts, numbers))
    held = np.searchsorted(numbers, coupling.contacts[among])
    along, S = own, _inner(C[c:, c:], _diagonal(coupling.M))
    if S is None:
        along = np.append(held, own)
        S = _inner(C[np.ix_(along, along)], _diagonal(coupling.M, BRACE * coupling.brace[among]))
    if S is None:
        values, vectors = np.linalg.eigh(coupling.M)
        positive = (vectors * np.maximum(values, 0.0)[:, None, :]) @ vectors.swapaxes(1, 2)
        along, S = own, _inner(C[c:, c:], _diagonal(positive))
    if S is None:
        S = np.zeros((len(own), len(own)))
    V = C[:c, along]
    Z = coupling.Z if along is own else {body: rows.take(along) for body, rows in stacked.items()}
    return CoupledDelassus(H, C[:c, :c] - V @ S @ V.T, Z, S, V)


def _diagonal(blocks: Floats, first: Floats | None = None) -> Floats:
    """The matrix of diagonal entries `first` and diagonal blocks (q, k, k)."""
    q, k, _ = blocks.shape
    a = 0 if first is None else len(first)
    M = np.zeros((a + q * k, a + q * k))
    if first is not None:
        M[np.arange(a), np.arange(a)] = first
    at = a + np.arange(q * k).reshape(q, k)
    M[at[:, :, None], at[:, None, :]] = blocks
    return M


def _inner(Y: Floats, M: Floats) -> Floats | None:
    """S = M − M L (I + LᵀM L)⁻¹ LᵀM with Y = L Lᵀ; None where A + ZᵀM Z is not positive definite."""
    # Tangents and slopes have units of their own: rows of Y are scaled to the same size.
    size = np.sqrt(np.maximum(np.diag(Y), 1e-300))
    try:
        L = size[:, None] * cholesky(Y / np.outer(size, size) + 1e-13 * np.eye(len(Y)), lower=True, check_finite=False)
        ML = M @ L
        R = cholesky(np.eye(len(M)) + L.T @ ML, lower=True, check_finite=False)
    except LinAlgError:
        return None
    return np.asarray(M - ML @ cho_solve((R, True), ML.T, check_finite=False))
