"""Columns of W, each asked for once, and the linear algebra on the rows that are active."""

from __future__ import annotations

import numpy as np
from scipy.linalg import lapack

from contact.solvers.problem import Delassus, DenseDelassus, Floats, Ints

# A pivot below this part of its diagonal entry is rounding: the row depends on those before it.
PIVOT = 1e-13
TIE = 1e-9
EPSILON, TINY = float(np.finfo(float).eps), float(np.finfo(float).tiny)


class FormedColumns:
    """The columns of W formed so far.

    `values[k]` is column `rows[k]` of W, and `slot[i]` its k or −1. Entries that were formed twice, Wᵢⱼ in column j and
    Wⱼᵢ in column i, are made equal, so that the formed rows see one symmetric matrix whatever the linear solver's
    tolerance; `noise` is the largest difference found, over √(Wᵢᵢ Wⱼⱼ). Of a DenseDelassus every column is there from
    the beginning, without a copy.
    """

    def __init__(self, W: Delassus) -> None:
        self.W = W
        self.size = W.size
        if isinstance(W, DenseDelassus):
            self.values, self.slot, self.rows, self.noise = W.W, np.arange(self.size), np.arange(self.size), W.noise
        else:
            self.values, self.slot = np.empty((0, self.size)), np.full(self.size, -1)
            self.rows, self.noise = np.empty(0, np.int64), 0.0
            self.root = np.zeros(self.size)
        self._peak = np.full(self.size, -1.0)

    def form(self, rows: Ints) -> None:
        """Ask for the columns among `rows` that are missing, as one block."""
        new = rows[self.slot[rows] < 0]
        if not len(new):
            return
        old, n, m = self.rows, len(self.rows), len(self.rows) + len(new)
        if m > len(self.values):
            grown = np.empty((min(self.size, max(2 * m, 16)), self.size))
            grown[:n] = self.values[:n]
            self.values = grown
        block = self.values[n:m]
        block[:] = self.W.columns(new).T
        self.slot[new] = np.arange(n, m)
        self.rows = np.concatenate([old, new])

        # what column j says of row i, and column i of row j
        here, there = block[:, self.rows], self.values[:m, new].T
        self.root[new] = np.sqrt(np.abs(np.diagonal(here[:, n:])))
        scale = np.maximum(self.root[new][:, None] * self.root[self.rows], TINY)
        self.noise = max(self.noise, float((np.abs(here - there) / scale).max()))
        block[:, old] = there[:, :n]
        block[:, new] = (here[:, n:] + there[:, n:]) / 2

    def diagonal(self, rows: Ints) -> Floats:
        """Wᵢᵢ of formed rows."""
        return self.values[self.slot[rows], rows]

    def block(self, rows: Ints, columns: Ints) -> Floats:
        """W[rows, columns] of formed columns."""
        return self.values[self.slot[columns]].take(rows, axis=1).T

    def product(self, lam: Floats) -> Floats:
        """W λ for a λ that vanishes on rows not formed."""
        carrying = np.flatnonzero(lam)
        n = len(self.rows)
        if 2 * len(carrying) < n:
            return np.asarray(lam[carrying] @ self.values[self.slot[carrying]])
        return np.asarray(lam[self.rows] @ self.values[:n])

    @property
    def pivot(self) -> float:
        """The relative pivot below which a row counts as dependent."""
        return max(PIVOT, 4 * self.noise)

    def peak(self, rows: Ints) -> Floats:
        """maxᵢ |Wᵢⱼ| of the formed columns j in `rows` [m/N]."""
        new = rows[self._peak[rows] < 0]
        self._peak[new] = np.abs(self.values[self.slot[new]]).max(axis=1, initial=0.0)
        return self._peak[rows]

    @property
    def accuracy(self) -> float:
        """The relative error of W's entries and of a product with them."""
        return max(self.noise, 4 * EPSILON)


def dense(W: Delassus) -> Floats:
    """All of W, its symmetric part."""
    values = W.columns(np.arange(W.size))
    return (values + values.T) / 2


def extend(L: Floats, columns: Floats, pivot: float) -> tuple[Floats, Ints]:
    """Continue a Cholesky factorisation.

    L (p, p) is the lower factor of the leading rows, `columns` (n, n − p) the remaining columns of the matrix. Returns
    the lower factor and the rows that it covers, in its order: all of them, or where the rest is semidefinite (a pivot
    below `pivot` times its diagonal entry) an independent subset, chosen by complete pivoting.
    """
    n, p = len(columns), len(L)
    border = lapack.dtrtrs(L, columns[:p], lower=1)[0] if p else columns[:0]
    schur = columns[p:] - border.T @ border
    scale = np.sqrt(np.abs(np.diagonal(columns[p:])))
    tail, info = lapack.dpotrf(schur, lower=1, clean=1)
    kept = np.arange(n - p)
    if info != 0 or np.any(np.diagonal(tail) <= np.sqrt(pivot) * scale):
        tail, kept = independent(schur, scale, pivot)
    m = p + len(kept)
    factor = np.zeros((m, m), order="F")
    factor[:p, :p], factor[p:, :p], factor[p:, p:] = L, border[:, kept].T, tail
    return factor, np.concatenate([np.arange(p), p + kept])


def independent(W: Floats, scale: Floats, pivot: float) -> tuple[Floats, Ints]:
    """The lower Cholesky factor of independent rows of a semidefinite W (n, n), and these rows, by complete pivoting.

    Where a pivot, over `scale`² (n) of its row, is below `pivot`, the rest depends on them.
    """
    # of equal rows the first is kept, whatever rounding makes of their pivots
    scale = np.where(scale == 0, 1.0, scale) * (1 + TIE * np.arange(len(W)))
    L, order, rank, _ = lapack.dpstrf(W / np.outer(scale, scale), tol=pivot, lower=1)
    rank = np.count_nonzero(np.diagonal(L)[:rank] ** 2 > pivot)  # LAPACK takes the first pivot untested
    rows = order[:rank] - 1
    return np.tril(L[:rank, :rank]) * scale[rows][:, None], rows
