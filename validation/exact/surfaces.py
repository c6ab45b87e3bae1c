"""Convolution surfaces whose radius is one line."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from validation.exact.common import Floats, positive


@dataclass(frozen=True, kw_only=True)
class SpringSurface:
    """A point on a spring k, anchored at the depth d outside the tube of an infinite line with the Cauchy kernel.

    The potential at the distance ρ is ∫ (1+s²(ρ²+z²))⁻² dz = π/(2s) (1+s²ρ²)^{−3/2}; at the level T the tube has the
    radius a = √((π/2sT)^{2/3} − 1)/s. It rests at the closest point of the wall with the force kd along the normal.

    Parameters
    ----------
    k : stiffness [N/m]
    d : depth of the anchor outside the surface [m]
    s : sharpness of the kernel [1/m]
    T : level, 0 < T < π/2s [m]

    Raises
    ------
    ValueError : a parameter outside its range; a level that no point of space reaches.

    Checked: the potential by quadrature; the catalogue's radius.
    Source: Sherstyuk, The Visual Computer 15 (1999) 171 (kernel).
    """

    k: float
    d: float
    s: float
    T: float

    def __post_init__(self) -> None:
        positive(k=self.k, d=self.d, s=self.s, T=self.T)
        if np.pi / (2 * self.s) <= self.T:
            raise ValueError(
                f"T = {self.T}: must be < pi/(2 s) = {np.pi / (2 * self.s):.6g}, the potential on the line"
            )

    @property
    def radius(self) -> float:
        """a [m]."""
        return float(np.sqrt((np.pi / (2 * self.s * self.T)) ** (2 / 3) - 1) / self.s)

    @property
    def reaction(self) -> float:
        """kd [N]."""
        return self.k * self.d

    def potential(self, rho: ArrayLike) -> Floats:
        """∫ kernel dz at the distance ρ from the line [m]."""
        return np.pi / (2 * self.s) * (1 + (self.s * np.asarray(rho, dtype=float)) ** 2) ** -1.5
