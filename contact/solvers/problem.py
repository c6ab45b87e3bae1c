"""The contact problem that every method solves, and what a method returns."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]
Bools = NDArray[np.bool_]


class Delassus(Protocol):
    """W = H A⁻¹ Hᵀ, symmetric and positive semidefinite, given by its columns."""

    @property
    def size(self) -> int:
        """The number c of constraints."""

    def columns(self, rows: Ints) -> Floats:
        """W[:, rows], shape (c, len(rows)) [m/N]; collective on the bodies' communicator."""


class DenseDelassus:
    """A Delassus operator whose entries are all known.

    Parameters
    ----------
    W : (c, c) [m/N]; its symmetric part is taken, `noise` is the largest |Wᵢⱼ − Wⱼᵢ| over √(Wᵢᵢ Wⱼⱼ)

    `memo` is what a method leaves for the next problem with the same W.
    """

    memo: Any = None

    def __init__(self, W: Floats) -> None:
        W = np.array(W, float)
        root = np.sqrt(np.abs(np.diag(W)))
        with np.errstate(divide="ignore", invalid="ignore"):
            skew = np.abs(W - W.T) / root / root[:, None]
        self.noise = float(np.nan_to_num(skew, nan=0.0).max(initial=0.0))
        self.W: Floats = (W + W.T) / 2

    @property
    def size(self) -> int:
        """The number c of constraints."""
        return len(self.W)

    def columns(self, rows: Ints) -> Floats:
        """W[:, rows]."""
        return self.W[rows].T


class Primal(Protocol):
    """The finite-element side of a contact problem: one block per deformable body.

    A[b] is the iteration matrix (n_b, n_b) and H[b] the rows of H on that body (c, n_b), both PETSc matrices,
    so that W = Σ_b H[b] A[b]⁻¹ H[b]ᵀ. The methods `kkt` and `vi-primal` need it.
    """

    @property
    def A(self) -> list[Any]:
        """A_b, (n_b, n_b)."""

    @property
    def H(self) -> list[Any]:
        """H_b, (c, n_b)."""


@dataclass(frozen=True)
class ContactProblem:
    """Find λ and α with 0 ≤ δ = W λ + G α + δ_f ⊥ λ ≥ 0 and Gᵀλ + r = 0.

    Parameters
    ----------
    W : the Delassus operator, (c, c) [m/N]
    q : the free gaps δ_f, (c) [m]
    G : H R, the gaps' rates along the rigid modes that no support holds, (c, m); None where every body is held
    r : Rᵀb, the load on those modes, (m)
    primal : the matrices behind W, where there are any
    """

    W: Delassus
    q: Floats
    G: Floats | None = None
    r: Floats | None = None
    primal: Primal | None = None


@dataclass(frozen=True)
class Solution:
    """What a method found.

    `lam` (c) [N], `alpha` (m) amplitudes of the rigid modes, `gap` = W λ + G α + δ_f (c) [m] as the method
    formed it; `iterations` as the method counts them, `details` its further counts (factorisations, columns, changes of
    status …).
    """

    lam: Floats
    alpha: Floats
    gap: Floats
    iterations: int
    details: dict[str, float] = field(default_factory=dict)


Method = Callable[..., Solution]

# The complementarity residual, relative to ℓ, above which no method may say that it has solved a problem.
SOLVED = 1e-9


class ContactNotConvergedError(RuntimeError):
    """A method stopped before its residual was small; `lam` is what it had reached, None where it had nothing.

    `claimed` is whether a library's solver called that a solution all the same.
    """

    def __init__(
        self, reason: str, iterations: int, residual: float, lam: Floats | None = None, claimed: bool = False
    ) -> None:
        super().__init__(f"not converged after {iterations} iterations: {reason} (residual {residual:.3g})")
        self.reason, self.iterations, self.residual = reason, iterations, residual
        self.lam, self.claimed = lam, claimed


class InfeasibleError(RuntimeError):
    """No λ ≥ 0 balances the load, or no position satisfies the constraints.

    `proven` is whether that is so of the bodies themselves, not only of a linearisation on the way.
    """

    def __init__(self, reason: str, proven: bool = False) -> None:
        super().__init__(reason)
        self.proven = proven
