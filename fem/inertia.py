"""The mass of a body, as element matrices; it exists only where a scene is dynamic."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fem.elements import order_of, shape
from fem.geometry import is_straight, map_cells
from fem.integrators import Integrator
from fem.space import Space

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]
MASSES = ("consistent", "lumped", "one-point")


@dataclass(frozen=True)
class Dynamics:
    """What a body brings to dynamics.

    Parameters
    ----------
    density : mass per volume, of a bar or string per length, of a membrane per area; 0 moves without inertia
    mass : ``consistent``, ``lumped``, or ``one-point``: that of the velocity in a cell's middle. In one dimension
        with first-order cells and dt = h/c the midpoint rule then has no dispersion, tan²(ω dt/2) = tan²(kh/2)
    rayleigh : a [1/s], b [s] of the damping B = a M + b K
    velocity, displacement : at the start: numbers, one per component, or a function (x, t) of them

    Raises
    ------
    ValueError
        for what is not among these, or damping of a body without mass.
    """

    density: float = 0.0
    mass: str = "consistent"
    rayleigh: Sequence[float] = (0.0, 0.0)
    velocity: Any = 0.0
    displacement: Any = 0.0

    def __post_init__(self) -> None:
        if not (np.isfinite(self.density) and self.density >= 0):
            raise ValueError(f"density = {self.density}: must be finite and >= 0")
        if self.mass not in MASSES:
            raise ValueError(f"mass = {self.mass!r}: must be one of {', '.join(MASSES)}")
        if len(self.rayleigh) != 2 or not all(np.isfinite(r) and r >= 0 for r in self.rayleigh):
            raise ValueError(f"rayleigh = {list(self.rayleigh)}: must be two numbers >= 0")
        if any(self.rayleigh) and not self.density:
            raise ValueError(f"rayleigh = {list(self.rayleigh)}: needs a density > 0")


class Inertia:
    """The mass matrix M of a space and the damping B = a M + b K that goes with it.

    Attributes
    ----------
    cells : the same matrix for each displacement component, (m, k, k) [kg]
    """

    def __init__(self, space: Space, axisymmetric: bool, dynamics: Dynamics) -> None:
        self.space, self.lumped = space, dynamics.mass == "lumped"
        self.a, self.b = dynamics.rayleigh
        self.cells = element_masses(space.piece.points, space.piece.cells, dynamics.density, axisymmetric)
        total = self.cells.sum(axis=(1, 2))
        if self.lumped:
            # Row sums vanish at the vertices of second-order cells: scaled diagonals do not (Hinton, Rock and
            # Zienkiewicz 1976), and both agree at order 1.
            diagonal = np.einsum("maa->ma", self.cells)
            self.cells = _diagonal(diagonal * (total / diagonal.sum(axis=1))[:, None])
        elif dynamics.mass == "one-point":
            dim = space.piece.points.shape[1]
            N = shape(np.full((1, dim), 1 / (dim + 1)), order_of(dim, self.cells.shape[1]))[0]
            self.cells = total[:, None, None] * np.outer(N, N)

    def factors(self, integrator: Integrator) -> tuple[float, float]:
        """The factors of M and K in A = inertia M + damping (a M + b K) + K."""
        return integrator.inertia + integrator.damping * self.a, 1 + integrator.damping * self.b

    def add(self, K: Floats, factor: float) -> None:
        """Add factor · M to element matrices (m, n, n) in place."""
        c, k = self.space.components, self.cells.shape[1]
        for i in range(c):
            K[:, i : c * k : c, i : c * k : c] += factor * self.cells

    def forces(self, acceleration: Floats) -> Floats:
        """M a at the owned unknowns [N] for a (owned) [m/s²]. Collective."""
        space, nodes = self.space, self.space.piece.cells
        a = space.local(acceleration)[space.displacements].reshape(-1, space.components)
        return space.sum_cells(np.matmul(self.cells, a[nodes]).reshape(len(nodes), -1), space.dofs_of(nodes))

    def redistribute(self, nodes: Ints) -> None:
        """Take the mass off local `nodes` and give it to the others of their cells. Collective.

        The velocity of a massless node is replaced by the mean of the others in its cell, M ← Pᵀ M P. Constants are
        kept, so that the body's mass and momentum are; its centre of gravity moves by O(h²). A cell of massless nodes
        alone leaves its mass to the whole body.

        Raises
        ------
        ValueError
            where no node with mass remains.
        """
        space = self.space
        marks = np.zeros(len(space.local_dofs))
        marks[space.dofs_of(np.asarray(nodes)[:, None])] = 1
        massless = space.local(space.sum(marks))[space.dofs_of(space.piece.cells[..., None])[..., 0]] > 0
        before = space.comm.allreduce(float(self.cells.sum()))
        heirs = ~massless
        shares = heirs / np.maximum(heirs.sum(axis=1), 1)[:, None]
        P = _diagonal(heirs.astype(float)) + massless[:, :, None] * shares[:, None, :]
        self.cells = np.matmul(P.swapaxes(1, 2), np.matmul(self.cells, P))
        if self.lumped:
            self.cells = _diagonal(self.cells.sum(axis=2))
        after = space.comm.allreduce(float(self.cells.sum()))
        if not after > 0:
            raise ValueError("every node may touch, none is left to carry the mass; refine, or use implicit-euler")
        self.cells *= before / after


def element_masses(points: Floats, cells: Ints, density: float, axisymmetric: bool) -> Floats:
    """∫ ρ N_a N_b dx, (m, k, k) [kg]."""
    order = order_of(points.shape[1], cells.shape[1])
    degree = 2 * order + (0 if is_straight(points, cells) else points.shape[1]) + axisymmetric
    mapped = map_cells(points, cells, degree, axisymmetric)
    N = mapped.values
    M: Floats = density * np.einsum("mq,qa,qb->mab", mapped.weights, N, N, optimize=True)
    return M


def _diagonal(values: Floats) -> Floats:
    """Diagonal matrices (m, k, k) of rows (m, k)."""
    return values[:, :, None] * np.eye(values.shape[1])
