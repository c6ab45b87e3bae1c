"""Bodies that do not deform: they move by their rigid modes, which contact forces balance, and have no matrix."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from fem.body import Body
from fem.loads import Load, Support
from fem.space import Space

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]


class _Rigid:
    """No strain energy."""

    mixed = False

    def __init__(self, axisymmetric: bool = False) -> None:
        self.axisymmetric = axisymmetric

    def stiffness(self, points: Floats, cells: Ints) -> Floats:
        """Nothing."""
        raise TypeError("a rigid body has no stiffness matrix")

    def forces(self, points: Floats, cells: Ints, u: Floats) -> Floats:
        """Zero."""
        return np.zeros_like(u)


class RigidBody(Body):
    """A body whose displacement is R α with its rigid modes R: small translations and, unless guided, rotations.

    Parameters
    ----------
    guided : whether it only translates, as on linear guides
    """

    deformable = False

    def __init__(
        self,
        name: str,
        space: Space,
        supports: Sequence[Support] = (),
        loads: Sequence[Load] = (),
        guided: bool = False,
        axisymmetric: bool = False,
    ) -> None:
        if any(callable(s.value) or np.any(s.value) for s in supports):
            raise ValueError(f"body {name!r}: the supports of a rigid body prescribe zero displacement only")
        self._guided = guided
        super().__init__(name, space, _Rigid(axisymmetric), supports, loads)

    def rigid_modes(self) -> Floats:
        """Translations, and rotations unless guided."""
        R = super().rigid_modes()
        return R[:, : self.space.components] if self._guided else R

    def assemble(self) -> None:
        """Nothing to assemble."""

    def factor(self) -> None:
        """Nothing to factorise."""

    def solve(self, B: Floats) -> Floats:
        """Zero: no force deforms it."""
        return np.zeros_like(B)

    def imbalance(self, contact: Floats) -> float:
        """The resultant of all forces on the rigid modes over that of each."""
        force = self.load + contact
        gram = self.space.comm.allreduce(self.modes.T @ self.modes)
        project = self.modes @ np.linalg.solve(gram, self.space.comm.allreduce(self.modes.T @ force))
        return self._ratio(project, self.load, contact)
