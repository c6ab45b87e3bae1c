"""A tube of two layers in an elastic (Winkler) surrounding, under inner pressure, by Lamé's solution in each layer."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from validation.exact.common import Floats, as_points, ascending, elastic, finite, positive, radius
from validation.exact.cylinders import tube


@dataclass(frozen=True, kw_only=True)
class LayeredTube:
    """Layers a < r < b and b < r < c, bonded, plane strain, with springs −k u_r per area outside; uniform pressures.

    The pressures q at b and s at c under the pressure p at a solve u₁(b; p, q) = u₂(b; q, s) and s = k u₂(c; q, s).

    Parameters
    ----------
    E1, nu1 : inner layer [Pa]
    E2, nu2 : outer layer [Pa]
    a, b, c : radii [m]
    k : stiffness of the surrounding [Pa/m], 0 where the tube is free outside

    Checked: equal layers are one tube; k → ∞ is a rigid mould; the displacements, strains and Robin condition against
    the boundary-value problem of the radial equation solved numerically.
    Source: Timoshenko & Goodier, Theory of Elasticity, §28.
    """

    E1: float
    nu1: float
    E2: float
    nu2: float
    a: float
    b: float
    c: float
    k: float = 0.0

    def __post_init__(self) -> None:
        elastic(E=self.E1, nu=self.nu1, body="1")
        elastic(E=self.E2, nu=self.nu2, body="2")
        ascending(a=self.a, b=self.b, c=self.c)
        finite(k=self.k)
        if self.k < 0:
            raise ValueError(f"k = {self.k}: must be >= 0")

    def pressures(self, p: float) -> tuple[float, float]:
        """q at b and s at c [Pa] under the inner pressure p [Pa]."""
        inner, outer = (self.E1, self.nu1, self.a, self.b), (self.E2, self.nu2, self.b, self.c)
        at_b, at_c = np.array(self.b), np.array(self.c)
        matrix = [
            [
                tube(at_b, *outer, inner=1.0, outer=0.0) - tube(at_b, *inner, inner=0.0, outer=1.0),
                tube(at_b, *outer, inner=0.0, outer=1.0),
            ],
            [
                -self.k * tube(at_c, *outer, inner=1.0, outer=0.0),
                1.0 - self.k * tube(at_c, *outer, inner=0.0, outer=1.0),
            ],
        ]
        q, s = np.linalg.solve(np.array(matrix), [tube(at_b, *inner, inner=p, outer=0.0), 0.0])
        return float(q), float(s)

    def radial(self, r: ArrayLike, p: float) -> Floats:
        """u_r at radii r under the inner pressure p [m]."""
        r = np.asarray(r, dtype=float)
        q, s = self.pressures(p)
        inner = tube(r, self.E1, self.nu1, self.a, self.b, inner=p, outer=q)
        outer = tube(r, self.E2, self.nu2, self.b, self.c, inner=q, outer=s)
        return np.where(r <= self.b, inner, outer)

    def displacement(self, points: ArrayLike, p: float) -> Floats:
        """(u_x, u_y) at points (n, 2), the axis at the origin, under the inner pressure p, (n, 2) [m]."""
        points = as_points(points, 2)
        r = radius(points)
        return points * (self.radial(r, p) / r)[:, None]

    def press_fit(self, delta: float) -> float:
        """The pressure of a rigid core of radius a + δ, without friction [Pa]."""
        positive(delta=delta)
        return delta / float(self.radial(self.a, 1.0))
