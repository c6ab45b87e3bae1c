"""Integrators of M a + B v + f_int(u) = f_ext in time.

Each one solves for the displacement u at which the forces balance. There

    velocity = damping · (u − u_n),    acceleration = inertia · (u − u_n) − damping · v_n,

so that the iteration matrix is A = inertia · M + damping · B + K. The contact law holds at that same u.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]


class Integrator(Protocol):
    """What a body asks of an integrator; `dt` is the step [s] that ends at the time t given."""

    @property
    def inertia(self) -> float:
        """The factor of M in A [1/s²]."""

    @property
    def damping(self) -> float:
        """The factor of B in A [1/s]."""

    def load_time(self, t: float) -> float:
        """When forces balance [s]."""

    def advance(self, moved: Floats, v_n: Floats) -> tuple[Floats, Floats]:
        """u_{n+1} − u_n and v_{n+1}, from the balanced u − u_n and the velocity at the start."""


@dataclass(frozen=True)
class Static:
    """No inertia and no damping: f_int(u) = f_ext at t."""

    inertia = 0.0
    damping = 0.0

    def load_time(self, t: float) -> float:
        """The end of the step."""
        return t

    def advance(self, moved: Floats, v_n: Floats) -> tuple[Floats, Floats]:
        """The balanced displacement; velocities have no part."""
        return moved, v_n


@dataclass(frozen=True)
class ImplicitEuler:
    """v_{n+1} = (u_{n+1} − u_n)/dt, a = (v_{n+1} − v_n)/dt, balanced at t_{n+1}: dissipative, of order 1."""

    dt: float

    @property
    def inertia(self) -> float:
        """1/dt² [1/s²]."""
        return 1 / self.dt**2

    @property
    def damping(self) -> float:
        """1/dt [1/s]."""
        return 1 / self.dt

    def load_time(self, t: float) -> float:
        """The end of the step."""
        return t

    def advance(self, moved: Floats, v_n: Floats) -> tuple[Floats, Floats]:
        """The balanced displacement, and the mean velocity of the step."""
        return moved, moved / self.dt


@dataclass(frozen=True)
class Midpoint:
    """Balanced at u = (u_n + u_{n+1})/2 and t − dt/2: of order 2, it conserves the energy of a linear body.

    With contact it does so where the nodes that may touch carry no mass (Khenous, Laborde and Renard, European Journal
    of Mechanics A/Solids 27, 2008): what remains is an ordinary differential equation with a Lipschitz force.
    """

    dt: float

    @property
    def inertia(self) -> float:
        """4/dt² [1/s²]."""
        return 4 / self.dt**2

    @property
    def damping(self) -> float:
        """2/dt [1/s]."""
        return 2 / self.dt

    def load_time(self, t: float) -> float:
        """The middle of the step."""
        return t - self.dt / 2

    def advance(self, moved: Floats, v_n: Floats) -> tuple[Floats, Floats]:
        """u_{n+1} − u_n = 2(u − u_n) and v_{n+1} = 2(u_{n+1} − u_n)/dt − v_n."""
        return 2 * moved, 4 * moved / self.dt - v_n
