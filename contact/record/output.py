"""From a running system to the plain arrays of its record on rank 0, and back from a checkpoint."""

from __future__ import annotations

from dataclasses import asdict
from typing import Any

import numpy as np
from numpy.typing import NDArray

from contact.loop import AcceptedStep
from contact.pairs import FiniteSliding, PointToPoint
from contact.record import Grid, StepData
from contact.step import StepResult
from contact.system import System
from fem.body import Body
from fem.model import Stressed

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

VTK_TYPES = {(1, 2): 3, (1, 3): 21, (2, 3): 5, (2, 6): 22, (3, 4): 10, (3, 10): 24}


class Gatherer:
    """Brings nodes and cells of all bodies together on rank 0, one body after the other, numbered as in the meshes.

    Collective on the bodies' communicator.
    """

    def __init__(self, system: System) -> None:
        self.system = system
        self.comm = system.comm
        counts = [body.space.piece.total for body in system.bodies]
        self.first: dict[Any, int] = dict(zip(system.bodies, np.cumsum([0, *counts[:-1]]).tolist(), strict=True))
        self.total = sum(counts)
        self.originals = {body: self._originals(body) for body in system.bodies}
        self.radius = self._device_radius()

    def _originals(self, body: Body) -> Ints:
        """The mesh's number of each node, by its distributed number; replicated."""
        piece = body.space.piece
        parts: list[Ints] = body.comm.allgather(piece.original[: piece.owned])
        return np.concatenate(parts)

    def _device_radius(self) -> Floats | None:
        """Outer radius of beams at all nodes [m], zero elsewhere; None where there is none."""
        if all(body.radius is None for body in self.system.bodies):
            return None
        radius = np.zeros(self.total)
        for body in self.system.bodies:
            if body.radius is not None:
                first = self.first[body]
                radius[first : first + len(body.radius) + 1] = np.append(body.radius, body.radius[-1])
        return radius

    def _gather(self, body: Body, mine: Any) -> list[Any] | None:
        """Every rank's share, on rank 0; a body that each rank has all of is given by rank 0 alone."""
        if body.comm.size < self.comm.size:
            return [mine] if self.comm.rank == 0 else None
        shares: list[Any] | None = self.comm.gather(mine)
        return shares

    def nodes(self, values: dict[Body, Floats]) -> Floats | None:
        """One array over all nodes from local nodal values (nodes, …) of each body, on rank 0."""
        result = None
        for body, local in values.items():
            parts = self._gather(body, local[: body.space.piece.owned])
            if parts is not None:
                joined = np.concatenate(parts)
                if result is None:
                    result = np.zeros((self.total, *joined.shape[1:]))
                result[self.first[body] + self.originals[body]] = joined
        return result

    def cells(self, values: dict[Body, Floats]) -> Floats | None:
        """One array over all cells from this rank's cell values of each body, on rank 0."""
        parts = [self._gather(body, values[body]) for body in self.system.bodies]
        return np.concatenate([np.concatenate(p) for p in parts if p is not None]) if self.comm.rank == 0 else None

    def grid(self) -> Grid | None:
        """The undeformed bodies, on rank 0."""
        points = self.nodes({b: _in_space(b.points) for b in self.system.bodies})
        lists = [self._gather(b, b.space.piece.original[b.space.piece.cells]) for b in self.system.bodies]
        if points is None:
            return None
        connectivity, sizes, types, body = [], [], [], []
        for number, (b, parts) in enumerate(zip(self.system.bodies, lists, strict=True)):
            cells = np.concatenate(parts or [])
            connectivity.append((self.first[b] + cells).ravel())
            sizes.append(np.full(len(cells), cells.shape[1]))
            types.append(np.full(len(cells), VTK_TYPES[b.space.dim, cells.shape[1]], dtype=np.uint8))
            body.append(np.full(len(cells), number))
        offsets = np.append(0, np.cumsum(np.concatenate(sizes)))
        return Grid(points, np.concatenate(connectivity), offsets, np.concatenate(types), np.concatenate(body))

    def step(self, accepted: AcceptedStep) -> StepData | None:
        """The record's row for a step, on rank 0."""
        bodies, result = self.system.bodies, accepted.result
        displacement = self.nodes({b: _in_space(b.displacement) for b in bodies})
        elastic = any(isinstance(b.model, Stressed) for b in bodies)
        stress = self.cells({b: _stress(b) for b in bodies}) if elastic else None
        checkpoint = self._checkpoint(result.lam)
        if displacement is None:
            return None
        rows, owner, nodes, areas, point, normals = self._contacts(result, displacement)
        lam = result.lam[rows]
        pressure, force, status = np.zeros(self.total), np.zeros((self.total, 3)), np.zeros(self.total)
        np.add.at(pressure, nodes, np.where(areas > 0, lam / np.where(areas > 0, areas, 1.0), 0.0))
        np.add.at(force, nodes, lam[:, None] * normals)
        np.maximum.at(status, nodes, (lam > 0).astype(float))
        point_data = {
            "displacement": displacement,
            "contact_pressure": pressure,
            "contact_force": force,
            "status": status,
        }
        if self.radius is not None:
            point_data["radius"] = self.radius
        return StepData(
            time=accepted.time,
            dt=accepted.dt,
            substeps=accepted.substeps,
            passes=result.passes,
            iterations=result.iterations,
            contacts=int(result.linearisation.met.sum()),
            converged=accepted.converged,
            certificate=asdict(result.certificate),
            seconds=accepted.seconds,
            point_data=point_data,
            cell_data={} if stress is None else {"stress": stress},
            lam=lam,
            gap=result.gap[rows],
            point=point,
            normal=normals,
            body=owner,
            status=(lam > 0).astype(np.int64),
            checkpoint=checkpoint,
        )

    def _contacts(self, result: StepResult, displacement: Floats) -> tuple[Ints, Ints, Ints, Floats, Floats, Floats]:
        """The constraints of the record: rows, bodies, nodes (over all bodies), areas, points and normals.

        Of a device these are its candidates; its points are those of the wall.
        """
        found: list[tuple[Any, ...]] = []
        start = 0
        for pair, part in zip(self.system.pairs, result.linearisation.constraints, strict=True):
            normals = _in_space(part.normals)
            body, rows, numbers, areas, point = pair.recorded()
            nodes = self.first[body] + self.originals[body][numbers]
            if point is None:
                point = _in_space(part.places)[rows] + displacement[nodes]
            owner = np.full(len(rows), self.system.bodies.index(body))
            found.append((start + rows, owner, nodes, areas, point, normals[rows]))
            start += part.count
        if not found:
            none = np.zeros(0, dtype=np.int64)
            return none, none, none, np.zeros(0), np.zeros((0, 3)), np.zeros((0, 3))
        rows, owner, nodes, areas, point, normals = (np.concatenate(parts) for parts in zip(*found, strict=True))
        return rows, owner, nodes, areas, point, normals

    def _checkpoint(self, lam: Floats) -> dict[str, Any]:
        state: dict[str, Any] = {"lambda": lam, "ranks": np.array([self.comm.size])}
        for number, body in enumerate(self.system.bodies):
            for name, mine in body.checkpoint().items():
                state[f"{name}/{number}"] = np.concatenate(body.comm.allgather(mine))
        for number, pair in enumerate(self.system.pairs):
            if isinstance(pair, FiniteSliding):
                state[f"met/{number}"] = pair.met.astype(np.int64)
        return state

    def restore(self, state: dict[str, Any] | None) -> Floats:
        """Put the bodies into the state of a checkpoint, given on rank 0; the contact forces. Collective.

        Raises
        ------
        ValueError
            where the checkpoint is of another scene or another number of ranks.
        """
        state = self.comm.bcast(state)
        assert state is not None
        ranks = int(np.ravel(state["ranks"])[0])
        if ranks != self.comm.size:
            raise ValueError(f"resume: the record was written by {ranks} ranks, must go on with as many")
        for number, body in enumerate(self.system.bodies):
            saved = {
                key.rpartition("/")[0]: np.asarray(value) for key, value in state.items() if key.endswith(f"/{number}")
            }
            size = np.size(saved.get("x", ()))
            if size != body.checkpoint()["x"].size and body.comm.allreduce(body.checkpoint()["x"].size) != size:
                raise ValueError(
                    f"resume: the record's body {number} has {size} unknowns, the scene's {body.space.size}"
                )
            # A body that every rank has all of takes all of it.
            mine = slice(body.space.first, body.space.first + body.space.owned) if body.comm.size > 1 else slice(None)
            body.resume({name: values[mine] for name, values in saved.items()})
        for number, pair in enumerate(self.system.pairs):
            if isinstance(pair, FiniteSliding):
                pair.met = np.asarray(state[f"met/{number}"]).astype(bool)
            if not isinstance(pair, PointToPoint):
                pair.accept()
        self.system.detect()  # the next step starts from the planes of this state
        lam: Floats = np.asarray(state["lambda"])
        return lam


def _in_space(x: Floats) -> Floats:
    """(n, D) padded to three coordinates."""
    return np.hstack([x, np.zeros((len(x), 3 - x.shape[1]))])


def _stress(body: Body) -> Floats:
    """σ of each cell as xx, yy, zz, xy, yz, xz, (m, 6) [Pa]; zero where a body has no such stress."""
    piece = body.space.piece
    if not isinstance(body.model, Stressed):
        return np.zeros((len(piece.cells), 6))
    sigma, _ = body.model.stress(piece.points, piece.cells, body.u[body.space.cell_dofs])
    return sigma[:, [0, 1, 2, 0, 1, 0], [0, 1, 2, 1, 2, 2]]
