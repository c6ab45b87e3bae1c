"""What a beam is given: prescribed motions, loads and mass; and its unknowns as a space."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from fem.beams import nodal_kernels

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]


class Motion(NamedTuple):
    """Where a beam is and how fast: nodes x (N, 3) [m], frames R (N, 3, 3), edges, v and w (N, 3) [m/s, rad/s]."""

    x: Floats
    R: Floats
    edges: Floats
    v: Floats
    w: Floats


@dataclass(frozen=True)
class Drive:
    """A node whose unknowns are prescribed.

    node : its number
    components : which of (x, y, z, rx, ry, rz) are held
    motion : from t [s] to its displacement and rotation vector since the start, (6) [m, rad]; None where it rests
    """

    node: int
    components: tuple[int, ...] = (0, 1, 2, 3, 4, 5)
    motion: Callable[[float], Floats] | None = None


@dataclass(frozen=True)
class BeamLoads:
    """Dead loads on a beam, as functions of t [s] or constants.

    line : force per rest length of each element, (N − 1, 3) [N/m], taken up by its nodes as the Hermite interpolation
        does
    gravity : acceleration (3) [m/s²] on the mass of a beam in dynamics
    points : pairs of a node and its force and moment (6) [N, N·m]
    """

    line: Callable[[float], Floats] | None = None
    gravity: Callable[[float], Floats] | None = None
    points: Sequence[tuple[int, Callable[[float], Floats]]] = ()

    def at(self, t: float, length: Floats, weights: Floats) -> tuple[Floats, Floats | None]:
        """Forces and moments on the nodes at time t, (N, 6), and the line load, (N − 1, 3).

        Half of a line load is at each node; what the interpolation adds depends on the tangents there. `weights` are
        the masses (N) [kg] that gravity pulls.
        """
        f, line = np.zeros((len(weights), 6)), None
        if self.gravity is not None:
            f = nodal_kernels.weight(weights, self.gravity(t))
        if self.line is not None:
            line = self.line(t)
            half = length[:, None] / 2 * line
            f[:-1, :3] += half
            f[1:, :3] += half
        for node, value in self.points:
            f[node] += value(t)
        return f, line


@dataclass(frozen=True)
class BeamInertia:
    """The mass of a beam; it exists only where a scene is dynamic.

    nodes, links : the tridiagonal mass matrix of each displacement component, (N) and (N − 1) [kg]
    rotary : moments of inertia about the node's axes t, d₂, d₃, (N, 3) [kg m²]
    rayleigh : a [1/s], b [s] of the damping a M + b K; b acts on the rates of strain: it resists no rigid motion
    velocity : at the start, (3) [m/s]
    """

    nodes: Floats
    links: Floats
    rotary: Floats
    rayleigh: tuple[float, float] = (0.0, 0.0)
    velocity: tuple[float, float, float] = (0.0, 0.0, 0.0)

    @cached_property
    def weights(self) -> Floats:
        """The sums of the mass matrix's rows, (N) [kg]."""
        weights = self.nodes.copy()
        weights[:-1] += self.links
        weights[1:] += self.links
        return weights

    def energy(self, v: Floats, w: Floats, R: Floats) -> float:
        """½ vᵀM v + ½ wᵀJ w [J], for velocities v, w (N, 3) and frames R (N, 3, 3)."""
        momentum = self.nodes[:, None] * v
        momentum[:-1] += self.links[:, None] * v[1:]
        momentum[1:] += self.links[:, None] * v[:-1]
        turning = np.einsum("nij,ni->nj", R, w)
        return float((momentum * v).sum() + (self.rotary * turning**2).sum()) / 2


@dataclass(frozen=True)
class Line:
    """The nodes and elements of a chain, numbered from its start; the names are those of `meshes.partition.Piece`."""

    points: Floats

    @property
    def total(self) -> int:
        """The number of nodes."""
        return len(self.points)

    owned = total

    @property
    def original(self) -> Ints:
        """The number of each node."""
        return np.arange(self.total)

    @property
    def cells(self) -> Ints:
        """The nodes of each element."""
        return np.stack([self.original[:-1], self.original[1:]], axis=1)


@dataclass(frozen=True)
class ChainSpace:
    """The unknowns of a beam as a space: six per node, all on this rank."""

    piece: Line
    dim: int = 1

    @property
    def nodes(self) -> int:
        """The number of nodes."""
        return self.piece.total

    @property
    def size(self) -> int:
        """The number of unknowns."""
        return 6 * self.nodes

    @property
    def owned(self) -> int:
        """All of them."""
        return self.size


def unheld(x: Floats, fixed: NDArray[np.bool_], size: float) -> int:
    """How many rigid motions of nodes x (N, 3) none of the `fixed` unknowns (6 N) resists; `size` is the body's [m]."""
    arm = x - x.mean(axis=0)
    modes = np.zeros((len(arm), 6, 6))
    modes[:, :3, :3] = modes[:, 3:, 3:] = np.eye(3)
    for i, e in enumerate(np.eye(3)):
        modes[:, :3, 3 + i] = np.cross(e, arm) / size
    return 6 - int(np.linalg.matrix_rank(modes.reshape(-1, 6)[fixed], tol=1e-9)) if fixed.any() else 6
