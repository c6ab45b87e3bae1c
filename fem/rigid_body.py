"""Bodies that do not deform: they move by their rigid modes, and have no matrix.

In statics contact forces balance them; in dynamics A⁻¹ = R (RᵀAR)⁻¹ Rᵀ with A = inertia M + damping a M.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from fem.body import Body
from fem.geometry import map_cells
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
    total_mass : its mass [kg], in place of a density
    density, mass, rayleigh, velocity : as of `Body`
    """

    def __init__(
        self,
        name: str,
        space: Space,
        supports: Sequence[Support] = (),
        loads: Sequence[Load] = (),
        guided: bool = False,
        axisymmetric: bool = False,
        total_mass: float | None = None,
        **dynamics: Any,
    ) -> None:
        if any(callable(s.value) or np.any(s.value) for s in supports):
            raise ValueError(f"body {name!r}: the supports of a rigid body prescribe zero displacement only")
        if total_mass is not None:
            if "density" in dynamics:
                raise ValueError(f"body {name!r}: total_mass = {total_mass}: a body has this or a density, not both")
            volume = map_cells(space.piece.points, space.piece.cells, 4, axisymmetric).weights.sum()
            dynamics["density"] = total_mass / space.comm.allreduce(float(volume))
        self._guided = guided
        super().__init__(name, space, _Rigid(axisymmetric), supports, loads, **dynamics)
        self._free_modes = self.modes
        self._mass = np.zeros((0, 0))

    @property
    def deformable(self) -> bool:
        """Whether forces move it by A⁻¹: in dynamics."""
        return self.inertia is not None

    def rigid_modes(self) -> Floats:
        """Translations, and rotations unless guided."""
        R = super().rigid_modes()
        return R[:, : self.space.components] if self._guided else R

    def _start_moving(self, v: Floats) -> None:
        """Take mass and velocities.

        Raises
        ------
        ValueError
            for velocities that no rigid motion has.
        """
        super()._start_moving(v)
        R = self._free_modes
        if self.inertia is not None:
            columns = [self.inertia.forces(mode) for mode in R.T]
            self._mass = self.space.comm.allreduce(R.T @ np.reshape(columns, R.T.shape).T)
        error, size = self.space.comm.allreduce(np.array([np.sum((self._project(v) - v) ** 2), v @ v]))
        if error > 1e-18 * size:
            raise ValueError(
                f"body {self.name!r}: velocity = {self._dynamics.velocity!r}: not one of its rigid motions"
            )

    def redistribute(self, nodes: Ints) -> None:
        """Nothing: its mass moves as one."""

    def assemble(self) -> None:
        """Nothing to assemble."""

    def factor(self) -> None:
        """Nothing to factorise."""

    def solve(self, B: Floats) -> Floats:
        """R (RᵀAR)⁻¹ Rᵀ B; zero in statics, where no force moves it by itself. Collective."""
        return self._compliance(self.space.comm.allreduce(self._free_modes.T @ B))

    def solve_rows(self, H: sp.csr_array) -> Floats:
        """A⁻¹ Hᵀ, (owned, k). Collective."""
        return self._compliance(self.space.comm.allreduce((H @ self._free_modes).T))

    def _compliance(self, forces: Floats) -> Floats:
        """The motion due to forces on the modes, (owned, k)."""
        R = self._free_modes
        if self.inertia is None:
            return np.zeros((len(R), forces.shape[1]))
        motion: Floats = R @ np.linalg.solve(self.inertia.factors(self.integrator)[0] * self._mass, forces)
        return motion

    def _project(self, values: Floats) -> Floats:
        """The part of owned values that rigid motions have."""
        R, comm = self._free_modes, self.space.comm
        part: Floats = R @ np.linalg.solve(comm.allreduce(R.T @ R), comm.allreduce(R.T @ values))
        return part

    def imbalance(self, contact: Floats) -> float:
        """The resultant of all forces on the rigid modes over that of each."""
        _, inertia = self._forces()
        return self._ratio(self._project(self.load + contact - inertia), self.load, contact, inertia)
