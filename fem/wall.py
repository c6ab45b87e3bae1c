"""A linear body touched at changing points of its surface: A⁻¹ of forces there is kept, and combined.

The points of contact are combinations c = Q x of nodes (`Wall.touch`). A unit force on one of them moves the body by
a column of A⁻¹Qᵀ, solved for when a force first needs it and kept while A is what it was. From then on a contact
force there costs a combination of columns: at the points themselves (C = Q A⁻¹Qᵀ) in every pass, and of all the body's
unknowns only when somebody asks for them.
"""

from __future__ import annotations

import os
from typing import Any

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from fem import wall_kernels as kernels
from fem.body import Body
from fem.integrators import Integrator
from fem.iteration_matrix import FACTORS

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

SOLVED = 96  # right-hand sides at a time


class KeptColumns:
    """Columns of A⁻¹Qᵀ for some points, three each.

    Parameters
    ----------
    name : the body's, for messages
    points, owned : K and the unknowns of this rank

    Attributes
    ----------
    slot : where a point's columns are, −1 where it has none, (K)
    C : displacements of all points due to the kept ones, (m, K, 3, 3) [m/N], see `fem.wall_kernels`
    X : of all owned unknowns, (3 m, owned) [m/N]
    """

    def __init__(self, name: str, points: int, owned: int) -> None:
        self.name, self.count = name, 0
        self.slot: Ints = np.full(points, -1)
        self.C, self.X = np.empty((0, points, 3, 3)), np.empty((0, owned))

    def add(self, points: Ints, X: Floats, C: Floats) -> None:
        """Keep the columns X (3 p, owned) of points (p), and what they move, C (p, K, 3, 3).

        Raises
        ------
        ValueError
            where all of them would not fit in half of the machine's memory.
        """
        need = self.count + len(points)
        if need > len(self.C):
            width = min(max(need, 2 * len(self.C), 128), len(self.slot))
            limit = os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES") / 2
            size = 24.0 * width * (self.X.shape[1] + 3 * len(self.slot))
            if size > limit:
                raise ValueError(
                    f"body {self.name!r}: its compliance at {width} points takes {size * 1e-9:.3g} GB, more than half "
                    f"of this machine's memory ({limit * 1e-9:.3g} GB); use a coarser mesh"
                )
            for kept, rows in (("C", width), ("X", 3 * width)):
                old = getattr(self, kept)
                new = np.empty((rows, *old.shape[1:]))
                new[: self.count * rows // width] = old[: self.count * rows // width]
                setattr(self, kept, new)
        self.C[self.count : need], self.X[3 * self.count : 3 * need] = C, X
        self.slot[points] = np.arange(self.count, need)
        self.count = need


class Wall(Body):
    """A `Body` whose contact points c = Q x are known beforehand; supports must hold it.

    Its unknowns u are those of the last full evaluation and, once they are asked for, the motion due to `forces` on
    the points; `displacement_of_points` follows without them.

    Attributes
    ----------
    places : undeformed points, replicated, (K, 3) [m]
    forces : on the points since u was last evaluated, replicated, (K, 3) [N]
    version : rises with every motion
    """

    def __init__(self, *given: Any, **named: Any) -> None:
        self._u, self._prescribed = np.empty(0), False
        self._steady_free: tuple[Floats, Floats] | None = None
        self.forces, self.version = np.zeros((0, 3)), 0
        super().__init__(*given, **named)
        values = [load.value for load in self.loads] + [support.value for support in self.supports]
        self._steady = not any(callable(value) for value in values)
        if self.modes.shape[1]:
            raise ValueError(
                f"body {self.name!r}: {self.modes.shape[1]} rigid motion(s) that no support holds; a beam touches it, "
                "so that supports must hold it"
            )

    def touch(self, numbers: Ints, Q: sp.csr_array) -> None:
        """Take its points c = Q x, (K, N) with N replicated global node `numbers`. Collective."""
        space = self.space
        local = np.flatnonzero(np.isin(space.piece.nodes, numbers))
        first = space.local_dofs[space.components * local] - space.first
        mine = (first >= 0) & (first < space.owned)
        self._numbers = np.searchsorted(numbers, space.piece.nodes[local[mine]])
        self._firsts = first[mine]
        self._Q, self._nodes = Q, len(numbers)
        X = np.zeros((self._nodes, 3))
        X[self._numbers] = self.points[local[mine]]
        self.places: Floats = Q @ space.comm.allreduce(X)
        self.forces = np.zeros((len(self.places), 3))
        self._wanted = np.zeros(len(self.places), dtype=bool)
        self._base = self._points_of(np.zeros((1, space.owned)))[0]
        self._shift: Floats = self._base
        self._seen = -1
        self._kept: dict[tuple[float, float], KeptColumns] = {}

    def _points_of(self, X: Floats) -> Floats:
        """Displacements of the points for owned unknowns (k, owned), (k, K, 3). Collective."""
        at = np.zeros((self._nodes, len(X), 3))
        for a in range(3):
            at[self._numbers, :, a] = X[:, self._firsts + a].T
        if self.space.comm.size > 1:
            at = self.space.comm.allreduce(at)
        moved: Floats = (self._Q @ at.reshape(self._nodes, -1)).reshape(-1, len(X), 3)
        by_column: Floats = moved.transpose(1, 0, 2)
        return by_column

    # --- the state ------------------------------------------------------------------------------------------------

    @property
    def u(self) -> Floats:
        """Local unknowns, ghosts included; the motion due to `forces` is made up for first."""
        if self.forces.any():
            acting = np.flatnonzero(self.forces.any(axis=1))
            self._keep(acting)
            columns = self._columns
            rows = 3 * columns.slot[acting][:, None] + np.arange(3)
            increment = kernels.combine(columns.X, rows.ravel(), self.forces[acting].ravel())
            self._u, self._moved = self._u + self.space.local(increment), self._moved + increment
            self._reset()
        return self._u

    @u.setter
    def u(self, value: Floats) -> None:
        self._u = value
        self._reset()

    def _reset(self) -> None:
        """u is what it is without further forces."""
        self.forces = np.zeros_like(self.forces)
        self.version += 1
        self._based = False

    def push(self, points: Ints, shares: Floats, normals: Floats, lam: Floats) -> None:
        """Move by A⁻¹ of forces −λ n shared out to points (c, k) by shares (c, k); normals (c, 3)."""
        self.want(points[lam != 0.0])
        self.forces = self.forces.copy()
        kernels.sum_forces(points, shares, normals, lam, self.forces)
        self.version += 1

    def want(self, points: Ints) -> bool:
        """Follow these points too in this step; whether any is new."""
        new = not self._wanted[points].all()
        if new:
            self._wanted[points] = True
            self.version += 1
        return bool(new)

    def displacement_of_points(self) -> Floats:
        """Displacements of the points, (K, 3) [m]: of those wanted, of the others where u was last evaluated."""
        if self._seen == self.version:
            return self._shift
        if not self._based:
            free = self._steady_free
            if free is not None and self._u is free[0]:
                self._base = free[1]
            else:
                self._base = self._points_of(self.owned(self._u)[None])[0]
                self._shift = self._base
            self._based = True
        points = np.flatnonzero(self._wanted)
        shift = self._shift.copy()
        shift[points] = self._base[points]
        acting = np.flatnonzero(self.forces.any(axis=1))
        if acting.size:
            self._keep(points)
            columns = self._columns
            shift[points] += kernels.displace(columns.C, columns.slot[acting], self.forces[acting], points)
        self._shift, self._seen = shift, self.version
        return shift

    # --- the columns ----------------------------------------------------------------------------------------------

    @property
    def _columns(self) -> KeptColumns:
        """Those of the present A."""
        key = self._multiples
        if key not in self._kept:
            while len(self._kept) >= FACTORS:
                del self._kept[next(iter(self._kept))]
            self._kept[key] = KeptColumns(self.name, len(self.places), self.space.owned)
        return self._kept[key]

    def _keep(self, points: Ints) -> None:
        """Solve for the columns of points that have none. Collective."""
        columns = self._columns
        new = points[columns.slot[points] < 0]
        rows = self._rows(new) if len(new) else None
        for start in range(0, len(new), SOLVED // 3):
            part = new[start : start + SOLVED // 3]
            assert rows is not None
            X = np.ascontiguousarray(self.solve_rows(rows[3 * start : 3 * (start + len(part))]).T)
            C = self._points_of(X).reshape(len(part), 3, -1, 3).transpose(0, 2, 3, 1)
            columns.add(part, X, C)

    def _rows(self, points: Ints) -> sp.csr_array:
        """Three rows for each point on the owned unknowns that A moves, (3 p, owned)."""
        Q = self._Q[points][:, self._numbers].tocoo()
        rows = 3 * Q.row[:, None] + np.arange(3)
        columns = self._firsts[Q.col][:, None] + np.arange(3)
        values = np.where(self.held[columns], 0.0, Q.data[:, None])
        return sp.csr_array(
            (values.ravel(), (rows.ravel(), columns.ravel())), shape=(3 * len(points), self.space.owned)
        )

    def owned_forces(self, forces: Floats) -> Floats:
        """Forces on the points (K, 3) as forces on the owned unknowns [N]."""
        nodal = self._Q.T @ forces
        owned = np.zeros(self.space.owned)
        owned[self._firsts[:, None] + np.arange(3)] = nodal[self._numbers]
        return owned

    def rows_of(self, points: Ints, shares: Floats, normals: Floats) -> sp.csr_array:
        """−n shares Q on the owned unknowns, (c, owned)."""
        c, width = points.shape
        B = sp.csr_array((-shares.ravel(), points.ravel(), width * np.arange(c + 1)), shape=(c, len(self.places)))
        at = (B @ self._Q)[:, self._numbers].tocoo()
        columns = self._firsts[at.col][:, None] + np.arange(3)
        values = at.data[:, None] * normals[at.row]
        rows = np.broadcast_to(at.row[:, None], columns.shape)
        return sp.csr_array((values.ravel(), (rows.ravel(), columns.ravel())), shape=(c, self.space.owned))

    def point_delassus(self, points: Ints, shares: Floats, normals: Floats) -> Floats:
        """H A⁻¹ Hᵀ (c, c) of rows −n shares at points, from the kept columns. Collective where some are missing."""
        self._keep(np.unique(points))
        columns = self._columns
        W: Floats = kernels.delassus(columns.C, columns.slot, points, shares, normals)
        return W

    # --- the step -------------------------------------------------------------------------------------------------

    def begin(self, t: float, integrator: Integrator) -> None:
        """As a body; without inertia and with loads and supports that do not change its free motion stays."""
        super().begin(t, integrator)
        self._wanted[:] = False

    def _prescribe(self, t: float) -> None:
        if not (self._prescribed and self._steady):
            super()._prescribe(t)
        self._prescribed = True

    def free_motion(self, contact: Floats | None = None) -> None:
        """As a body, but solved once where nothing but contact moves it."""
        if self._steady_free is not None:
            self.u = self._steady_free[0]
            if contact is not None:
                self.correct(self.solve(contact[:, None])[:, 0])
            return
        super().free_motion(contact)
        if contact is None and self._steady and self.inertia is None:
            self._steady_free = self._u, self._points_of(self.owned(self._u)[None])[0]

    def _forces(self) -> tuple[Floats, Floats]:
        _ = self.u  # evaluated before the increment that it belongs to
        return super()._forces()

    def accept(self) -> None:
        """As a body; without inertia its velocity is that of its displacement."""
        u = self.owned(self.u)
        if self.v is None or self.inertia is not None:
            return super().accept()
        self.v = self.integrator.damping * (u - self._u_n)
        self._u_n = u
        return None
