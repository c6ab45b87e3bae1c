"""A linear body touched at changing points of its surface: A⁻¹ of forces there is kept, and combined.

The points of contact are combinations c = Q x of nodes (`Wall.touch`). A unit force on one of them moves the body by
a column of A⁻¹Qᵀ, solved for when a force first needs it and kept while A is what it was. From then on a contact
force there costs a combination of columns: at the points themselves (C = Q A⁻¹Qᵀ) in every pass, and of all the body's
unknowns only when somebody asks for them.

Equilibrium is certified likewise. The forces that the cells' stresses make of column j are Qᵀe_j but for D_j, measured
when the column is solved for; by linearity a state x_f + Σ f_j X_j under contact forces p is out of balance by

    ‖r(x_f) + Qᵀf − p‖ + Σ |f_j| ‖D_j‖

at most, with the residual r(x_f) of the free motion measured when that is solved for.
"""

from __future__ import annotations

import os
from typing import Any

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from fem import wall_kernels as kernels
from fem.body import Body
from fem.integrators import Integrator, Static
from fem.iteration_matrix import FACTORS
from fem.stresses import ForcesOfColumns

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
    errors : ‖D_j‖ of each, (m, 3)
    """

    def __init__(self, name: str, points: int, owned: int) -> None:
        self.name, self.count = name, 0
        self.slot: Ints = np.full(points, -1)
        self.C, self.X, self.errors = np.empty((0, points, 3, 3)), np.empty((0, owned)), np.empty((0, 3))

    def add(self, points: Ints, X: Floats, C: Floats, errors: Floats) -> None:
        """Keep the columns X (3 p, owned) of points (p), what they move, C (p, K, 3, 3), and their errors (p, 3).

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
            for kept, times in (("C", 1), ("X", 3), ("errors", 1)):
                old = getattr(self, kept)
                new = np.empty((times * width, *old.shape[1:]))
                new[: times * self.count] = old[: times * self.count]
                setattr(self, kept, new)
        part = slice(self.count, need)
        self.C[part], self.errors[part], self.X[3 * self.count : 3 * need] = C, errors, X
        self.slot[points] = np.arange(self.count, need)
        self.count = need


class Wall(Body):
    """A `Body` whose contact points c = Q x are known beforehand; supports must hold it.

    Without density it has no inertia: it follows at once, and its free motion is solved for once where neither loads
    nor supports change.

    Attributes
    ----------
    places : undeformed points, replicated, (K, 3) [m]
    forces : f on the points since u was last set, replicated, (K, 3) [N]
    version : rises with every motion
    """

    def __init__(self, *given: Any, **named: Any) -> None:
        self._u, self._moved_base, self._begun = np.empty(0), np.empty(0), False
        self._full: tuple[int, Floats, Floats] | None = None
        self._steady_free: Floats | None = None
        self._out_of_balance, self._inner = np.empty(0), np.empty(0)
        self.forces, self.version, self._acting = np.zeros((0, 3)), 0, np.empty(0, dtype=np.int64)
        super().__init__(*given, **named)
        values = [load.value for load in self.loads] + [support.value for support in self.supports]
        self._steady = not (self._dynamics.density or any(callable(value) for value in values))
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
        self._Q, self._Qt, self._nodes = Q, sp.csr_array(Q.T), len(numbers)
        X = np.zeros((self._nodes, 3))
        X[self._numbers] = self.points[local[mine]]
        self.places: Floats = Q @ space.comm.allreduce(X)
        self.forces = np.zeros((len(self.places), 3))
        self._followed, self._place = np.empty(0, dtype=np.int64), np.full(len(self.places), -1)
        self._wanted = np.zeros(len(self.places), dtype=bool)
        self._stale = True
        self._gathered = 0
        self._gathered_of: KeptColumns | None = None
        self._G = np.empty((0, 0))
        self._base: tuple[Floats, Floats] | None = None
        self._shift: Floats = np.zeros_like(self.places)
        self._seen = -1
        self._kept: dict[tuple[float, float], KeptColumns] = {}
        self._stresses = ForcesOfColumns(self.model, space)

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
        """Local unknowns, ghosts included, the motion due to `forces` in them."""
        return self._evaluated()[0]

    @u.setter
    def u(self, value: Floats) -> None:
        self._u = value
        self._be(np.zeros_like(self.forces))

    @property
    def _moved(self) -> Floats:
        return self._evaluated()[1]

    @_moved.setter
    def _moved(self, value: Floats) -> None:
        self._moved_base, self._full = value, None

    def _be(self, forces: Floats) -> None:
        """Take forces on the points."""
        self.forces, self._full, self._acting = forces, None, kernels.nonzero(forces)
        self.version += 1

    def _evaluated(self) -> tuple[Floats, Floats]:
        """u and the owned displacement in this step."""
        acting = self._acting
        if not acting.size:
            return self._u, self._moved_base
        if self._full is None or self._full[0] != self.version:
            self._keep(acting)
            columns = self._columns
            rows = 3 * columns.slot[acting][:, None] + np.arange(3)
            increment = kernels.combine(columns.X, rows.ravel(), self.forces[acting].ravel(), self.space.owned)
            self._full = self.version, self._u + self.space.local(increment), self._moved_base + increment
        return self._full[1:]

    def push(self, points: Ints, shares: Floats, normals: Floats, lam: Floats) -> None:
        """Move by A⁻¹ of forces −λ n shared out to points (c, k) by shares (c, k); normals (c, 3)."""
        self.want(points[lam != 0.0].ravel())
        forces = self.forces.copy()
        kernels.sum_forces(points, shares, normals, lam, forces)
        self._be(forces)

    def want(self, points: Ints) -> bool:
        """Follow these points too in this step; whether any is new."""
        self._wanted[points] = True
        if self._place[points].min(initial=0) >= 0:
            return False
        new = np.unique(points[self._place[points] < 0])
        if len(new):
            self._place[new] = len(self._followed) + np.arange(len(new))
            self._followed = np.append(self._followed, new)
            self.version += 1
        return True

    def displacement_of_points(self) -> Floats:
        """Displacements of the points, (K, 3) [m]: of those wanted, of the others when `follow_all` was last called."""
        if self._seen != self.version:
            shift, points = self._shift.copy(), self._followed
            moved = self._free_displacements[points]
            if self._acting.size:
                rows = 3 * self._place[self._acting][:, None] + np.arange(3)
                forces = self.forces[self._acting].ravel()
                moved += kernels.combine(self._compliance(), rows.ravel(), forces, 3 * len(points)).reshape(-1, 3)
            shift[points] = moved
            self._shift, self._seen = shift, self.version
        return self._shift

    @property
    def _free_displacements(self) -> Floats:
        """Displacements of the points without `forces`, (K, 3)."""
        if self._base is None or self._base[0] is not self._u:
            self._base = self._u, self._points_of(self.owned(self._u)[None])[0]
        return self._base[1]

    def follow_all(self) -> None:
        """Bring all points to where they are, not only those wanted."""
        if not self._stale:
            return
        shift = self._free_displacements
        if self._acting.size:
            self._keep(self._acting)
            columns = self._columns
            shift = shift + kernels.displace(columns.C, columns.slot[self._acting], self.forces[self._acting])
        self._shift, self._stale = shift, False
        self.version += 1

    def _forget(self) -> None:
        """Of the points followed only those wanted since the last step, and those with forces, stay so."""
        if len(self._followed) > 1.5 * np.count_nonzero(self._wanted) + 50:
            self._followed = np.flatnonzero(self._wanted | self.forces.any(axis=1))
            self._place[:] = -1
            self._place[self._followed] = np.arange(len(self._followed))
            self._gathered = 0
        self._wanted[:] = False
        self._stale = True
        self.version += 1

    def _compliance(self) -> Floats:
        """C between the points followed, (3 p, 3 p) and more. Collective where columns are missing."""
        self._keep(self._followed)
        columns, p = self._columns, len(self._followed)
        if self._gathered_of is not columns:
            self._gathered, self._gathered_of = 0, columns
        if self._gathered < p:
            if len(self._G) < 3 * p:
                G = np.empty((6 * p, 6 * p))
                G[: 3 * self._gathered, : 3 * self._gathered] = self._G[: 3 * self._gathered, : 3 * self._gathered]
                self._G = G
            kernels.gather(columns.C, columns.slot[self._followed], self._followed, self._gathered, self._G)
            self._gathered = p
        return self._G

    def state(self) -> tuple[Floats, ...]:
        """What a rejected step must give back."""
        rates = () if self.v is None else (self.v,)
        return self._u, self._u_n, self._moved_base, self.forces, *rates

    def restore(self, state: tuple[Floats, ...]) -> None:
        """Return to a `state`."""
        self._u, self._u_n, self._moved_base, forces, *rates = state
        self.v = rates[0] if rates else None
        self._be(forces)

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

    @property
    def columns_kept(self) -> int:
        """How many have been solved for."""
        return 3 * sum(columns.count for columns in self._kept.values())

    def _keep(self, points: Ints) -> None:
        """Solve for the columns of points that have none. Collective."""
        columns = self._columns
        new = points[columns.slot[points] < 0]
        if not len(new):
            return
        H = self._rows(new)
        for start in range(0, len(new), SOLVED // 3):
            part = new[start : start + SOLVED // 3]
            rows = H[3 * start : 3 * (start + len(part))]
            X = np.ascontiguousarray(self.solve_rows(rows).T)
            C = self._points_of(X).reshape(len(part), 3, -1, 3).transpose(0, 2, 3, 1)
            columns.add(part, X, C, self._errors(X, rows).reshape(-1, 3))

    def _errors(self, X: Floats, rows: sp.csr_array) -> Floats:
        """‖D_j‖ of columns X (k, owned), whose forces are `rows` (k, owned). Collective."""
        m, k = (0.0, 1.0) if self.inertia is None else self.inertia.factors(self.integrator)
        rest = k * self._stresses(X)
        rest -= rows.toarray()
        if self.inertia is not None:
            rest += m * np.stack([self.inertia.forces(x) for x in X])
        rest[:, self.fixed] = 0.0
        squares: Floats = self.space.comm.allreduce((rest**2).sum(axis=1))
        return np.sqrt(squares)

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
        nodal = self._Qt @ forces
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
        self.want(points.ravel())
        W: Floats = kernels.delassus(self._compliance(), self._place, points, shares, normals, len(self._followed))
        return W

    # --- the step -------------------------------------------------------------------------------------------------

    def begin(self, t: float, integrator: Integrator) -> None:
        """As a body; the points follow anew."""
        self._forget()
        if not self._dynamics.density:
            integrator = Static()
        if not (self._steady and self._begun):
            super().begin(t, integrator)
        self._begun = True

    def free_motion(self, contact: Floats | None = None) -> None:
        """As a body, but solved once where nothing but contact moves it."""
        if self._steady_free is not None:
            self.u = self._steady_free
        else:
            new = self._free is None
            super().free_motion()
            if new:
                inner, inertia = self._forces()
                self._inner, self._out_of_balance = inner + inertia, self.residual()
            if self._steady:
                self._steady_free = self._u
        if contact is not None:
            self.correct(self.solve(contact[:, None])[:, 0])

    def imbalance(self, contact: Floats) -> float:
        """A bound of a body's, for forces Hᵀλ: see this module. Collective."""
        if self._u is not (self._steady_free if self._free is None else self._free[0]):
            return super().imbalance(contact)
        acting = self._acting
        own = self.owned_forces(self.forces)
        rest = np.where(self.fixed, 0.0, own - contact + self._out_of_balance)
        squares = self.space.comm.allreduce(np.array([v @ v for v in (rest, self._inner + own, self.load, contact)]))
        out, *norms = np.sqrt(squares)
        if acting.size:
            self._keep(acting)
            columns = self._columns
            out += float((columns.errors[columns.slot[acting]] * np.abs(self.forces[acting])).sum())
        scale = max(sum(norms), 1e-8 * self._solver.scale * self.size)
        return float(out / scale)
