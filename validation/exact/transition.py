"""The edge of a contact zone in isolation: the r^{3/2} singularity of a smooth Signorini problem."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from validation.exact.common import Complexes, Floats, finite, positive
from validation.exact.half_plane import HalfPlane, sqrt_cut_below


@dataclass(frozen=True, kw_only=True)
class Transition(HalfPlane):
    """Z = −C √(z−x₀): contact with the line y = 0 for x > x₀, lift-off for x < x₀.

    p = C √(x−x₀) for x > x₀,  u_y = (4C/3E*) |x−x₀|^{3/2} for x < x₀. Exact in any box whose other sides carry the
    exact displacement or traction.

    Parameters
    ----------
    C : intensity [Pa/√m], > 0
    x0 : edge of the contact zone [m]

    Checked: as `HalfPlane`; pressure, lift and a free surface on y = 0; |u|_H¹ = 2.608 for E=1, ν=.3, C=1, x₀=π/30 in
    [−1,1]×[0,1]. Source: the leading term at an edge of a smooth contact, Johnson, Contact Mechanics, §5.1.
    """

    C: float
    x0: float

    def __post_init__(self) -> None:
        super().__post_init__()
        positive(C=self.C)
        finite(x0=self.x0)

    @property
    def singular_points(self) -> tuple[float, ...]:
        """The edge x₀."""
        return (self.x0,)

    def potentials(self, z: Complexes) -> tuple[Complexes, Complexes, Complexes]:
        """Ẑ = −⅔C (z−x₀)^{3/2}, Z, Z′."""
        w = z - self.x0
        root = sqrt_cut_below(w)
        return -2 / 3 * self.C * w * root, -self.C * root, -0.5 * self.C / root

    def pressure(self, x: ArrayLike) -> Floats:
        """p(x) = C √(x−x₀)₊ on y = 0 [Pa]."""
        return self.C * np.sqrt(np.maximum(np.asarray(x, dtype=float) - self.x0, 0))

    def lift(self, x: ArrayLike) -> Floats:
        """u_y(x, 0) = (4C/3E*) (x₀−x)₊^{3/2} [m]."""
        return 4 * self.C / (3 * self.E_star) * np.maximum(self.x0 - np.asarray(x, dtype=float), 0) ** 1.5

    def force(self, x_max: float = 1.0) -> float:
        """P = ⅔C (x_max−x₀)₊^{3/2}, the force per thickness on [x₀, x_max] [N/m]."""
        finite(x_max=x_max)
        return float(2 / 3 * self.C * max(x_max - self.x0, 0) ** 1.5)
