"""A finite-element space on a distributed mesh: the numbering of unknowns and the way between cells and PETSc.

An unknown is owned by the rank that owns its node. On a rank the displacements of its nodes come first, node by node,
then, in the mixed formulation, the pressures of its vertices.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray
from petsc4py import PETSc

from meshes.mesh import Mesh
from meshes.partition import split

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]


class Space:
    """Displacements with `components` per node, and one pressure per vertex where `mixed`.

    Pressures jump where the material changes: a vertex has one in each of the regions `apart` that meet there, and one
    for the cells outside them. Collective on `comm`; the mesh is needed on rank 0 only.

    Raises
    ------
    ValueError
        where the mesh has no region of a name in `apart`.

    Attributes
    ----------
    piece : what this rank holds of the mesh
    local_dofs : global numbers of the local unknowns, displacements node by node, then pressures
    cell_dofs : local numbers of each cell's unknowns, (m, n)
    owned, size : unknowns of this rank and of all
    """

    def __init__(
        self, comm: Any, mesh: Mesh | None, components: int, mixed: bool = False, apart: Sequence[str] = ()
    ) -> None:
        self.comm = comm.tompi4py() if hasattr(comm, "tompi4py") else comm
        pieces = split(mesh, self.comm.size) if self.comm.rank == 0 and mesh is not None else None
        self.piece = self.comm.scatter(pieces)
        self.components = components
        piece, c = self.piece, components
        self.dim = piece.points.shape[1]
        nodes = len(piece.points)
        region = np.zeros(len(piece.cells), dtype=np.int64)
        for number, name in enumerate(apart, 1):
            if name not in piece.regions:
                raise ValueError(
                    f"{name}: the mesh has no such region (it has: {', '.join(sorted(piece.regions)) or 'none'})"
                )
            region[piece.regions[name]] = number
        parts = [np.flatnonzero(region == number) for number in range(len(apart) + 1)] if mixed else []
        vertices = [np.unique(piece.cells[part, : self.dim + 1]) for part in parts]
        # A vertex that this rank owns may be used only by other ranks' cells, hence the exchange.
        node_scatter = _Scatter(self.comm, piece.owned, piece.nodes)
        owned_vertices = []
        for used in vertices:
            is_vertex = np.zeros(nodes)
            is_vertex[used] = 1
            owned_vertices.append(np.flatnonzero(node_scatter.sum(is_vertex) > 0))
        self.owned = c * piece.owned + sum(len(mine) for mine in owned_vertices)
        self.first = int(self.comm.exscan(self.owned) or 0)
        self.size = int(self.comm.allreduce(self.owned))
        node_dof = node_scatter.local(self.first + c * np.arange(piece.owned, dtype=float)).astype(np.int64)
        self.node_dofs = node_dof
        self.displacements = slice(0, c * nodes)
        local_dofs = [(node_dof[:, None] + np.arange(c)).ravel()]
        self.cell_dofs = (c * piece.cells[:, :, None] + np.arange(c)).reshape(
            len(piece.cells), c * piece.cells.shape[1]
        )
        number, local, columns = self.first + c * piece.owned, c * nodes, np.zeros((len(region), self.dim + 1), int)
        for part, used, mine in zip(parts, vertices, owned_vertices, strict=True):
            pressure = np.zeros(piece.owned)
            pressure[mine] = number + np.arange(len(mine))
            local_dofs.append(node_scatter.local(pressure).astype(np.int64)[used])
            position = np.zeros(nodes, dtype=np.int64)
            position[used] = local + np.arange(len(used))
            columns[part] = position[piece.cells[part, : self.dim + 1]]
            number, local = number + len(mine), local + len(used)
        if mixed:
            self.cell_dofs = np.hstack([self.cell_dofs, columns])
        self.local_dofs = np.concatenate(local_dofs)
        node_scatter.close()
        self._scatter = _Scatter(self.comm, self.owned, self.local_dofs)

    def local(self, owned: Floats) -> Floats:
        """The values at all local unknowns, ghosts included, from those at the owned ones. Collective."""
        return self._scatter.local(owned)

    def sum(self, local: Floats) -> Floats:
        """The values at owned unknowns, summed over the ranks that hold them. Collective."""
        return self._scatter.sum(local)

    def sum_cells(self, values: Floats, dofs: Ints | None = None) -> Floats:
        """Owned sums of cell (or facet) vectors (m, n) given at local unknowns `dofs`. Collective."""
        dofs = self.cell_dofs if dofs is None else dofs
        return self.sum(np.bincount(dofs.ravel(), values.ravel(), minlength=len(self.local_dofs)))

    def sum_matrices(self, K: Floats) -> Any:
        """The global matrix of element matrices K (m, n, n), an AIJ with block size `components`. Collective."""
        c, cells, number = self.components, self.piece.cells, self.local_dofs.astype(PETSc.IntType)
        if self.cell_dofs.shape[1] == c * cells.shape[1]:
            blocks = _sum_blocks(K, cells, c)
            rows, cols = np.repeat(number[: blocks.shape[0]], np.diff(blocks.indptr)), number[blocks.indices]
            values = blocks.data
        else:
            dofs, n = number[self.cell_dofs], self.cell_dofs.shape[1]
            rows, cols, values = np.repeat(dofs, n, axis=1).ravel(), np.tile(dofs, n).ravel(), K.ravel()
        A = PETSc.Mat().create(self.comm)
        A.setSizes(((self.owned, self.size), (self.owned, self.size)))
        if self.size == c * self.piece.total:
            A.setBlockSize(c)
        A.setType("aij")
        A.setPreallocationCOO(rows, cols)
        A.setValuesCOO(values)
        A.setOption(PETSc.Mat.Option.SYMMETRIC, True)
        return A

    def dofs_of(self, nodes: Ints) -> Ints:
        """Local numbers of the displacements of local `nodes` (…, k), (…, k·components)."""
        c = self.components
        return (c * nodes[..., None] + np.arange(c)).reshape(*nodes.shape[:-1], c * nodes.shape[-1])

    def close(self) -> None:
        """Destroy the scatter between ranks. Collective."""
        self._scatter.close()


class _Scatter:
    """Between a distributed vector's owned entries and the local ones that a rank works with."""

    def __init__(self, comm: Any, owned: int, numbers: Ints) -> None:
        self.alone = comm.size == 1
        if self.alone:
            # One rank numbers its own unknowns; only their order differs.
            self.numbers = numbers
            return
        self.distributed = PETSc.Vec().createMPI((owned, None), comm=comm)
        self.sequential = PETSc.Vec().createSeq(len(numbers))
        index = PETSc.IS().createGeneral(numbers.astype(PETSc.IntType), comm=PETSc.COMM_SELF)
        self.scatter = PETSc.Scatter().create(self.distributed, index, self.sequential, None)
        index.destroy()

    def close(self) -> None:
        if not self.alone:
            for thing in (self.scatter, self.distributed, self.sequential):
                thing.destroy()

    def local(self, owned: Floats) -> Floats:
        if self.alone:
            return owned[self.numbers]
        self.distributed.array[:] = owned
        self.scatter.scatter(self.distributed, self.sequential)
        return np.array(self.sequential.array)

    def sum(self, local: Floats) -> Floats:
        if self.alone:
            return np.bincount(self.numbers, local, minlength=len(local))
        self.distributed.set(0.0)
        self.sequential.array[:] = local
        self.scatter.scatter(
            self.sequential, self.distributed, addv=PETSc.InsertMode.ADD_VALUES, mode=PETSc.ScatterMode.REVERSE
        )
        return np.array(self.distributed.array)


def _sum_blocks(K: Floats, nodes: Ints, c: int) -> sp.csr_array:
    """The sum of element matrices over equal pairs of local nodes, by rows.

    PETSc then finds each entry of the matrix once, not once a cell, and in order: it need not sort.
    """
    m, k = nodes.shape
    count = int(nodes.max(initial=-1)) + 1
    pairs = (nodes[:, :, None] * count + nodes[:, None, :]).ravel()
    order = np.argsort(pairs, kind="stable")
    keys = pairs[order]
    starts = np.flatnonzero(np.diff(keys, prepend=-1))
    first, second = np.divmod(keys[starts], max(count, 1))
    blocks = K.reshape(m, k, c, k, c).transpose(0, 1, 3, 2, 4).reshape(m * k * k, c * c)
    gather = sp.csr_array((np.ones(len(order)), order, np.append(starts, len(order))), shape=(len(starts), len(order)))
    pointer = np.append(0, np.cumsum(np.bincount(first, minlength=count)))
    return sp.bsr_array(((gather @ blocks).reshape(-1, c, c), second, pointer), shape=(count * c, count * c)).tocsr()
