"""Bodies and pairs together: the contact problem of their present state, and the motion that answers it."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray
from petsc4py import PETSc

from contact.clock import Clock
from contact.delassus import CompliantDelassus
from contact.pairs import Constraints, Pair
from contact.solvers.problem import ContactProblem, Solution
from fem.body import Body

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]


class TimedDelassus(CompliantDelassus):
    """A Delassus operator whose solves are charged to the phase `delassus`."""

    def __init__(self, H: dict[Body, sp.csr_array], size: int, clock: Clock) -> None:
        super().__init__(H, size)
        self._clock = clock

    def columns(self, rows: Ints) -> Floats:
        """W[:, rows]."""
        with self._clock("delassus"):
            return super().columns(rows)


class BodyMatrices:
    """`Primal` of the deformable bodies; H becomes a PETSc matrix only when a method asks for it."""

    def __init__(self, H: dict[Body, sp.csr_array]) -> None:
        self._columns = H

    @property
    def A(self) -> list[Any]:
        """A_b."""
        return [body.A for body in self._columns]

    @cached_property
    def H(self) -> list[Any]:
        """H_b as PETSc matrices (c, n_b). Collective."""
        return [_transposed(h.T.tocsr(), body) for body, h in self._columns.items()]


@dataclass(frozen=True)
class Linearisation:
    """The constraints of all pairs in one order, and the rows among them that can carry force.

    `H` are the columns of all owned unknowns, `free` those of the unknowns that nothing prescribes. `movable` marks the
    constraints that some unknown can move; `rows` are those among them that detection has met: the contact problem's.
    """

    constraints: list[Constraints]
    H: dict[Body, sp.csr_array]
    free: dict[Body, sp.csr_array]
    offset: Floats
    movable: NDArray[np.bool_]
    rows: Ints
    W: CompliantDelassus
    G: Floats | None

    def full(self, values: Floats, rest: float = 0.0) -> Floats:
        """Values of all constraints from those of the rows in the problem, `rest` elsewhere."""
        result = np.full(len(self.offset), rest)
        result[self.rows] = values
        return result

    def on_rows(self, values: Floats | None) -> Floats | None:
        """Values of the rows in the problem from those of all constraints, where these are as many."""
        return None if values is None or len(values) != len(self.offset) else values[self.rows]


class System:
    """Bodies, and the pairs of things that may touch.

    Parameters
    ----------
    comm : the communicator of all bodies
    clock : charged with the time of each phase
    """

    def __init__(self, comm: Any, bodies: list[Body], pairs: list[Pair], clock: Clock | None = None) -> None:
        self.comm, self.bodies, self.pairs = comm, bodies, pairs
        self.clock = clock or Clock()
        self._detected: list[Constraints] = []
        self._linearisation: Linearisation | None = None

    # --- free motion ----------------------------------------------------------------------------------------------

    def prepare(self) -> None:
        """Assemble and factorise each body's A, once, and check the initial gaps. Collective."""
        with self.clock("assemble"):
            for body in self.bodies:
                body.assemble()
        with self.clock("factor"):
            for body in self.bodies:
                body.factor()
        with self.clock("detect"):
            for pair in self.pairs:
                pair.start()

    def free_motion(self, t: float) -> None:
        """Bring every body to its free configuration x_f at time t. Collective."""
        with self.clock("assemble"):
            for body in self.bodies:
                body.update(t)
        with self.clock("factor"):
            for body in self.bodies:
                body.free_motion()

    def state(self) -> list[Floats]:
        """Copies of the bodies' unknowns."""
        return [body.u.copy() for body in self.bodies]

    def restore(self, state: list[Floats]) -> None:
        """Return to a `state`."""
        for body, u in zip(self.bodies, state, strict=True):
            body.u = u.copy()

    # --- the contact problem --------------------------------------------------------------------------------------

    def detect(self) -> Linearisation:
        """Constraints about the present state; W is kept while they stay what they were. Collective."""
        with self.clock("detect"):
            found = [pair.detect() for pair in self.pairs]
            if self._linearisation is not None and all(f is None for f in found):
                return self._linearisation
            self._detected = [
                new or self._detected[i]  # a pair that finds nothing new says None
                for i, new in enumerate(found)
            ]
            self._linearisation = self._linearise(self._detected)
            return self._linearisation

    def _linearise(self, parts: list[Constraints]) -> Linearisation:
        counts = [part.count for part in parts]
        offset = np.concatenate([np.empty(0), *[part.offset for part in parts]])
        H: dict[Body, sp.csr_array] = {}
        for body in self.bodies:
            blocks = [
                part.H.get(body, sp.csr_array((count, body.space.owned)))
                for part, count in zip(parts, counts, strict=True)
            ]
            H[body] = sp.vstack(blocks, format="csr") if blocks else sp.csr_array((0, body.space.owned))
        free = {body: _columns_where(h, ~body.fixed) for body, h in H.items()}
        rates = np.zeros(len(offset))
        for h in free.values():
            rates += self.comm.allreduce(np.abs(h).sum(axis=1))
        movable = rates > 0
        rows = np.flatnonzero(movable & np.isfinite(offset))
        compliant = {body: _columns_where(h[rows], ~body.held) for body, h in free.items() if body.deformable}
        W = TimedDelassus(compliant, len(rows), self.clock)
        G = self._rigid_rates(free)
        return Linearisation(parts, H, free, offset, movable, rows, W, None if G is None else G[rows])

    def _rigid_rates(self, free: dict[Body, sp.csr_array]) -> Floats | None:
        """G = H R for the floating bodies; ValueError where no constraint opposes one of their modes."""
        floating = [body for body in self.bodies if body.modes.shape[1]]
        if not floating:
            return None
        blocks = []
        for body in floating:
            G_body = self.comm.allreduce(free[body] @ body.modes)
            held = np.linalg.matrix_rank(G_body) if G_body.size else 0
            if held < body.modes.shape[1]:
                raise ValueError(
                    f"body {body.name!r}: {body.modes.shape[1]} rigid motion(s) that no support holds and "
                    f"only {held} that its contacts can oppose; add supports or contacts"
                )
            blocks.append(G_body)
        G: Floats = np.hstack(blocks)
        return G

    def problem(self, lin: Linearisation) -> ContactProblem:
        """The contact problem of linearisation `lin` about the present (free) state. Collective."""
        with self.clock("detect"):
            q = self._gaps(lin)[lin.rows]
        primal = BodyMatrices(lin.W.H) if lin.W.H else None
        if lin.G is None:
            return ContactProblem(lin.W, q, primal=primal)
        r = np.concatenate([self.comm.allreduce(b.modes.T @ b.load) for b in self.bodies if b.modes.shape[1]])
        return ContactProblem(lin.W, q, lin.G, r, primal)

    def _gaps(self, lin: Linearisation) -> Floats:
        """δ = H u + offset for all constraints."""
        moved = np.zeros(len(lin.offset))
        for body, h in lin.H.items():
            moved += h @ body.owned(body.u)
        gaps: Floats = lin.offset + self.comm.allreduce(moved)
        return gaps

    def correct(self, lin: Linearisation, solution: Solution) -> None:
        """u ← u + A⁻¹ Hᵀ λ + R α: the corrective motion. Collective."""
        lam = lin.full(solution.lam)
        mode = 0
        with self.clock("factor"):
            for body in self.bodies:
                increment = body.solve((lin.free[body].T @ lam)[:, None])[:, 0]
                m = body.modes.shape[1]
                increment += body.modes @ solution.alpha[mode : mode + m]
                mode += m
                body.correct(increment)

    def gaps(self) -> Floats:
        """True gaps of the present state, for all constraints (c) [m]. Collective."""
        with self.clock("detect"):
            return np.concatenate([np.empty(0), *[pair.gaps() for pair in self.pairs]])

    def accept(self) -> None:
        """Take the present state as the start of the next step."""
        for pair in self.pairs:
            pair.accept()

    def close(self) -> None:
        """Destroy the bodies' PETSc objects. Collective."""
        for body in self.bodies:
            body.close()


def _columns_where(H: sp.csr_array, keep: NDArray[np.bool_]) -> sp.csr_array:
    """H with the columns of other unknowns emptied."""
    result = H @ sp.diags_array(keep.astype(float), format="csr")
    result.eliminate_zeros()
    return result.tocsr()


def _transposed(Ht: sp.csr_array, body: Body) -> Any:
    """The PETSc matrix whose transpose has this rank's rows Ht (owned, c)."""
    Ht.sort_indices()
    csr = Ht.indptr.astype(PETSc.IntType), Ht.indices.astype(PETSc.IntType), Ht.data
    sizes = ((body.space.owned, body.space.size), (PETSc.DECIDE, Ht.shape[1]))
    rows = PETSc.Mat().createAIJ(sizes, csr=csr, comm=body.space.comm)
    H = rows.transpose(PETSc.Mat())
    rows.destroy()
    return H
