"""What a beam is given: prescribed motions, loads and mass; and its unknowns as a space."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]


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
