"""Constraints of all pairs about one state, and the contact problem's rows and Delassus operator among them."""

from __future__ import annotations

from copy import copy
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray
from petsc4py import PETSc

from contact.clock import Clock
from contact.coupling import Coupling, coupled
from contact.delassus import CompliantDelassus, DirectDelassus, direct
from contact.pairs import Constraints
from contact.rows import Rows, SparseRows
from fem.body import Body

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]
REACH = 4.0  # a constraint that many changes of gaps away stays out of the contact problem


class TimedDelassus(CompliantDelassus):
    """A Delassus operator whose solves are charged to the phase `delassus`."""

    def __init__(self, H: dict[Body, Rows], size: int, clock: Clock) -> None:
        super().__init__(H, size)
        self._clock = clock

    def columns(self, rows: Ints) -> Floats:
        """W[:, rows]."""
        with self._clock("delassus"):
            return super().columns(rows)


class BodyMatrices:
    """`Primal` of the deformable bodies; H becomes a PETSc matrix only when a method asks for it."""

    def __init__(self, H: dict[Body, Rows]) -> None:
        self._columns = H

    @property
    def A(self) -> list[Any]:
        """A_b."""
        return [body.A for body in self._columns]

    @cached_property
    def H(self) -> list[Any]:
        """H_b as PETSc matrices (c, n_b). Collective."""
        return [_matrix(h, body) for body, h in self._columns.items()]


@dataclass(eq=False)
class Linearisation:
    """The constraints of all pairs in one order, and the rows among them that can carry force.

    `H` are the columns of all owned unknowns, `free` those of the unknowns that nothing prescribes. `movable` marks the
    constraints that some unknown can move; `met` are those among them that detection has met, the candidates, and
    `rows` those of them in the contact problem: all, or those close enough that they may carry force.
    `base` are contact forces that the free motion of the bodies includes, `coupling` is curvature that A leaves out,
    `brace` what A resists each gap's change with besides, (c) [N/m].
    """

    constraints: list[Constraints]
    H: dict[Body, Rows]
    free: dict[Body, Rows]
    offset: Floats
    movable: NDArray[np.bool_]
    met: NDArray[np.bool_]
    rows: Ints
    G: Floats | None
    clock: Clock
    base: Floats | None = field(default=None)
    coupling: Coupling | None = field(default=None)
    brace: Floats | None = field(default=None)

    @cached_property
    def W(self) -> TimedDelassus | DirectDelassus:
        """The Delassus operator on `rows`."""
        compliant = {body: h.take(self.rows) for body, h in self.free.items() if body.deformable}
        compliant |= {body: h.without(body.held) for body, h in compliant.items() if body.modes.shape[1]}
        with self.clock("delassus"):
            known = coupled(compliant, self.coupling, self.rows) if self.coupling else direct(compliant)
        return known or TimedDelassus(compliant, len(self.rows), self.clock)

    def with_operator(self, other: Linearisation) -> Linearisation:
        """These constraints with the operator of an earlier linearisation."""
        result = copy(self)
        result.W, result.rows = other.W, other.rows
        return result

    def covered(self, other: Linearisation) -> bool:
        """Whether every constraint violated here is in the contact problem of `other`, whose rows are met here."""
        outside = self.met & (self.offset < 0)
        outside[other.rows] = False
        return not outside.any() and bool(self.met[other.rows].all())

    def include(self, carrying: NDArray[np.bool_]) -> None:
        """Take constraints that carry force, where detection has met them, into the contact problem."""
        missing = carrying & self.met
        missing[self.rows] = False
        if missing.any():
            self.rows = np.union1d(self.rows, np.flatnonzero(missing))

    def narrow(self, gaps: Floats) -> None:
        """Leave out of the contact problem what its forces will not bring to the wall, by the `gaps` before them.

        They close the gaps of the constraints that carried force and open those that are violated; others are as far
        away as a few times that. What is missed all the same is violated, and in the problem, a pass later.
        """
        if self.base is None or "W" in self.__dict__:
            return
        gaps, carrying = gaps[self.rows], self.base[self.rows] > 0
        change = np.abs(gaps[carrying | (gaps < 0)]).max(initial=0.0)
        self.rows = self.rows[carrying | (gaps <= REACH * change)]

    def full(self, values: Floats, rest: float = 0.0) -> Floats:
        """Values of all constraints from those of the rows in the problem, `rest` elsewhere."""
        result = np.full(len(self.offset), rest)
        result[self.rows] = values
        return result

    def on_rows(self, values: Floats | None) -> Floats | None:
        """Values of the rows in the problem from those of all constraints, where these are as many."""
        return None if values is None or len(values) != len(self.offset) else values[self.rows]

    @cached_property
    def length(self) -> Floats:
        """What the gap of each constraint is measured against, (c), or () where it is the same for all [m]."""
        lengths = [part.length for part in self.constraints]
        if len(set(lengths)) == 1:
            return np.array(lengths[0])
        return np.concatenate([np.empty(0), *[np.full(part.count, part.length) for part in self.constraints]])


def join_rows(body: Body, parts: list[Constraints]) -> Rows:
    """The rows of all parts on one body."""
    if len(parts) == 1 and body in parts[0].H:
        return parts[0].H[body]
    given = [part.H.get(body) for part in parts]
    sample = next((rows for rows in given if rows is not None), None)
    if sample is None:
        return SparseRows(sp.csr_array((sum(part.count for part in parts), body.space.owned)))
    every = [sample.blank(part.count) if rows is None else rows for rows, part in zip(given, parts, strict=True)]
    if len({type(rows) for rows in every}) > 1:
        every = [SparseRows(rows.sparse()) for rows in every]
    return every[0].join(every[1:])


def _matrix(rows: Rows, body: Body) -> Any:
    """H on one body as a PETSc matrix, (c, n)."""
    Ht = rows.sparse().T.tocsr()
    Ht.sort_indices()
    csr = Ht.indptr.astype(PETSc.IntType), Ht.indices.astype(PETSc.IntType), Ht.data
    sizes = ((body.space.owned, body.space.size), (PETSc.DECIDE, Ht.shape[1]))
    transposed = PETSc.Mat().createAIJ(sizes, csr=csr, comm=body.comm)
    H = transposed.transpose(PETSc.Mat())
    transposed.destroy()
    return H
