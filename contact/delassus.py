"""The Delassus operator W = Σ_b H_b A_b⁻¹ H_bᵀ, formed by KSP solves on the columns of Hᵀ that the contact asks for."""

from __future__ import annotations

import os
from typing import Any

import numpy as np
from numpy.typing import NDArray

from contact.rows import Rows
from contact.solvers.problem import DenseDelassus
from fem.body import Body

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

BLOCK_BYTES = 256 * 2**20


class DirectDelassus(DenseDelassus):
    """W of bodies whose compliance between any two points is known without a solve.

    Parameters
    ----------
    H : for each body its rows of H, (c, owned), zero where displacements are prescribed
    W : (c, c), symmetric
    """

    noise = 0.0

    def __init__(self, H: dict[Body, Rows], W: Floats) -> None:
        self.H, self.W = H, W

    def diagonal(self, rows: Ints) -> Floats:
        """W_ii."""
        diagonal: Floats = self.W.diagonal()[rows]
        return diagonal

    def product(self, lam: Floats) -> Floats:
        """W λ, (c) [m]."""
        return np.asarray(self.W @ lam)


def compliance(H: dict[Any, Rows]) -> Floats | None:
    """H A⁻¹ Hᵀ of all bodies, or None where that of some takes solves."""
    parts = []
    for body, rows in H.items():
        W = rows.compliance(body)
        if W is None:
            return None
        parts.append(W)
    return None if not parts else parts[0] if len(parts) == 1 else np.asarray(np.sum(parts, axis=0))


def direct(H: dict[Any, Rows]) -> DirectDelassus | None:
    """The operator of beams and their walls, or None where some body's compliance takes solves."""
    W = compliance(H)
    return None if W is None else DirectDelassus(H, W)


class CompliantDelassus:
    """W by columns, each solved for at most once.

    Parameters
    ----------
    H : for each deformable body its rows of H, (c, owned), zero where displacements are prescribed

    Columns are solved in blocks whose right-hand sides stay below 256 MiB a body, reduced over the ranks, and kept.
    """

    def __init__(self, H: dict[Body, Rows], size: int) -> None:
        self.H, self.size = H, size
        self.solved = 0
        self._slot = np.full(size, -1)
        self._kept = np.empty((size, 0), order="F")

    def columns(self, rows: Ints) -> Floats:
        """W[:, rows], (c, len(rows)) [m/N]. Collective.

        Raises
        ------
        ValueError
            where the columns kept would not fit in half of the machine's memory.
        """
        rows = np.asarray(rows, dtype=np.int64)
        new = np.unique(rows[self._slot[rows] < 0])
        if new.size:
            self._reserve(len(new))
            self._kept[:, self.solved : self.solved + len(new)] = self._solve(new)
            self._slot[new] = self.solved + np.arange(len(new))
            self.solved += len(new)
        result: Floats = self._kept[:, self._slot[rows]]
        return result

    def _reserve(self, more: int) -> None:
        need = self.solved + more
        if need <= self._kept.shape[1]:
            return
        limit = os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES") / 2
        if 8.0 * self.size * need > limit:
            raise ValueError(
                f"the Delassus operator needs {need} columns of {self.size} rows, {8e-9 * self.size * need:.3g} GB, "
                f"more than half of this machine's memory ({limit * 1e-9:.3g} GB)"
            )
        width = min(max(need, 2 * self._kept.shape[1], 32), self.size, int(limit / (8 * self.size)))
        kept = np.empty((self.size, width), order="F")
        kept[:, : self.solved] = self._kept[:, : self.solved]
        self._kept = kept

    def _solve(self, rows: Ints) -> Floats:
        W = np.zeros((self.size, len(rows)), order="F")
        for body, H in self.H.items():
            comm = body.comm
            mine = rows[comm.allreduce(H.touching()[rows], op=np.logical_or)]
            where = np.searchsorted(rows, mine)
            block = max(1, BLOCK_BYTES // (8 * max(body.space.size, 1)))
            for start in range(0, len(mine), block):
                part = slice(start, start + block)
                W[:, where[part]] += comm.allreduce(H.solve(body, mine[part]))
        return W

    def product(self, lam: Floats) -> Floats:
        """W λ, (c) [m], from the columns where λ is not zero. Collective."""
        carrying = np.flatnonzero(lam)
        return np.asarray(self.columns(carrying) @ lam[carrying])

    def diagonal(self, rows: Ints) -> Floats:
        """W_ii where the column has been formed, infinity elsewhere: a certificate costs no solve."""
        slots = self._slot[rows]
        return np.where(slots >= 0, self._kept[rows, np.maximum(slots, 0)] if self.solved else 0.0, np.inf)
