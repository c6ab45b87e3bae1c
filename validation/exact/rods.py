"""Beams against flat walls and a wire in a curved tube, small slopes: polynomials with a free boundary."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from validation.exact.common import Floats, Regime, positive


def lifted_profile(x: Floats, *, EI: float, q: float, s: float) -> Floats:
    """Height q u³(2s−u)/24EI, u = (s−x)₊, of a heavy beam lifted at x = 0 off the floor it leaves at s."""
    u = np.maximum(s - x, 0)
    return q * u**3 * (2 * s - u) / (24 * EI)


@dataclass(frozen=True, kw_only=True)
class CantileverFloor:
    """Cantilever clamped at x = 0 at the height d over a floor, pressed down by q per length: EI w⁗ = q − λ, w <= d.

    The tip touches at q = 8EId/L⁴ and alone carries R = 3qL/8 − 3EId/L³ up to q = 72EId/L⁴, where its slope vanishes.
    Then the beam lies flat beyond s = (72EId/q)^¼, with the force qs/3 concentrated at s and q per length from s to L.

    Parameters
    ----------
    EI : bending stiffness [N m²]
    L : length [m]
    q : load per length [N/m]
    d : height of the clamp over the floor [m]

    Checked: scipy's `solve_bvp` with the free boundary s unknown; EI w⁗ = q by finite differences; the catalogue's s,
    R₀ and total at EI=L=q=1, d=1e-3.
    """

    EI: float
    L: float
    q: float
    d: float

    def __post_init__(self) -> None:
        positive(EI=self.EI, L=self.L, q=self.q, d=self.d)

    @property
    def regime(self) -> Regime:
        """free, point (the tip) or line."""
        load = self.q * self.L**4 / (self.EI * self.d)
        return "free" if load <= 8 else "point" if load <= 72 else "line"

    @property
    def s(self) -> float:
        """Free span [m]; L until the tip lies flat."""
        return float((72 * self.EI * self.d / self.q) ** 0.25) if self.regime == "line" else self.L

    @property
    def reaction(self) -> float:
        """Concentrated force at s [N]."""
        if self.regime == "line":
            return self.q * self.s / 3
        return max(3 * self.q * self.L / 8 - 3 * self.EI * self.d / self.L**3, 0.0)

    @property
    def force(self) -> float:
        """Total contact force: the concentrated one and q(L−s) [N]."""
        return self.reaction + self.q * (self.L - self.s)

    @property
    def clamp_force(self) -> float:
        """Force of the clamp qs − R [N]; with the floor's it carries qL."""
        return self.q * self.s - self.reaction

    @property
    def clamp_moment(self) -> float:
        """Moment of the clamp qs²/2 − Rs [N m]."""
        return self.q * self.s**2 / 2 - self.reaction * self.s

    def deflection(self, x: ArrayLike) -> Floats:
        """w(x) downwards [m]."""
        s = self.s
        y: Floats = np.minimum(np.asarray(x, dtype=float), s)
        w: Floats = y**2 * (self.q * (6 * s**2 - 4 * s * y + y**2) - 4 * self.reaction * (3 * s - y)) / (24 * self.EI)
        return w


@dataclass(frozen=True, kw_only=True)
class HeavyBeam:
    """Heavy beam on a floor, its end x = 0 lifted by H without moment: EI w⁗ = λ − q, w >= 0.

    Free over s = (24EIH/q)^¼; the lifting force is qs/2, as is the floor's concentrated one at s; q per length beyond.

    Parameters
    ----------
    EI : bending stiffness [N m²]
    L : length [m], > s
    q : weight per length [N/m]
    H : lift [m]

    Raises
    ------
    ValueError : a parameter outside its range; s > L, where the beam stands on its far end alone.

    Checked: scipy's `solve_bvp` with s unknown; EI w⁗ = −q by finite differences; balance of forces and moments.
    """

    EI: float
    L: float
    q: float
    H: float

    def __post_init__(self) -> None:
        positive(EI=self.EI, L=self.L, q=self.q, H=self.H)
        if self.s > self.L:
            raise ValueError(f"L = {self.L}: must be >= s = {self.s:.6g}, the length that leaves the floor")

    @property
    def s(self) -> float:
        """Free span [m]."""
        return float((24 * self.EI * self.H / self.q) ** 0.25)

    @property
    def lift_force(self) -> float:
        """Force at the lifted end, and at s from the floor: qs/2 [N]."""
        return self.q * self.s / 2

    @property
    def force(self) -> float:
        """Total force of the floor qL − qs/2 [N]."""
        return self.q * self.L - self.lift_force

    def height(self, x: ArrayLike) -> Floats:
        """w(x) over the floor [m]."""
        return lifted_profile(np.asarray(x, dtype=float), EI=self.EI, q=self.q, s=self.s)


@dataclass(frozen=True, kw_only=True)
class BeamStop:
    """Simply supported beam pressed by q per length onto a flat stop at the depth d: EI w⁗ = q − λ, w <= d.

    Touches in the middle at qL⁴/EId = 76.8 and carries R = 5qL/8 − 48EId/L³ there up to 384, where the curvature
    vanishes; then it lies flat between two forces qs/2 at s = (24EId/q)^¼ from either support, with q per length there.

    Parameters
    ----------
    EI : bending stiffness [N m²]
    L : span [m]
    q : load per length [N/m]
    d : depth of the stop under the supports [m]

    Checked: scipy's `solve_bvp`; EI w⁗ = q by finite differences; both limits by the formulae on their other side.
    """

    EI: float
    L: float
    q: float
    d: float

    def __post_init__(self) -> None:
        positive(EI=self.EI, L=self.L, q=self.q, d=self.d)

    @property
    def regime(self) -> Regime:
        """free, point (the middle) or line."""
        load = self.q * self.L**4 / (self.EI * self.d)
        return "free" if load <= 76.8 else "point" if load <= 384 else "line"

    @property
    def s(self) -> float:
        """Free span beside a support [m]; L/2 until the middle lies flat."""
        return float((24 * self.EI * self.d / self.q) ** 0.25) if self.regime == "line" else self.L / 2

    @property
    def reaction(self) -> float:
        """Concentrated force [N]: of the middle in point contact, at each of the two ends s of line contact."""
        if self.regime == "line":
            return self.q * self.s / 2
        return max(5 * self.q * self.L / 8 - 48 * self.EI * self.d / self.L**3, 0.0)

    @property
    def force(self) -> float:
        """Total contact force [N]."""
        return self.q * (self.L - self.s) if self.regime == "line" else self.reaction

    @property
    def support_force(self) -> float:
        """Force of one support (qL − λ)/2 [N]."""
        return (self.q * self.L - self.force) / 2

    def deflection(self, x: ArrayLike) -> Floats:
        """w(x) downwards [m]."""
        x = np.asarray(x, dtype=float)
        y: Floats = np.minimum(x, self.L - x)
        if self.regime == "line":
            return self.d - lifted_profile(y, EI=self.EI, q=self.q, s=self.s)
        q, R, L = self.q, self.reaction, self.L
        w: Floats = y * (2 * q * (L**3 - 2 * L * y**2 + y**3) - R * (3 * L**2 - 4 * y**2)) / (48 * self.EI)
        return w


@dataclass(frozen=True, kw_only=True)
class WireTube:
    """Straight wire with free ends in a long circular tube, or an arc in a straight tube, small slopes.

    The tube's axis has the curvature 1/R, and the wire's axis may leave it by the clearance c: EI (v″ + 1/R)″ = λ,
    |v| <= c, with v the offset towards the centre of curvature and x = 0 the wire's middle.
    No contact for L² <= 16cR. Three-point contact (the middle at v = c, the tips at −c) up to L² = 48cR with the tip
    force T = 24EI(L²/8R − 2c)/L³, the middle carrying 2T. Beyond, the middle follows the inner wall without pressure,
    and ends in forces T at s = √(12cR) from the tips, T = EI/(Rs), whatever L.

    A pre-curved wire κ₀ in a straight tube is the same with R = 1/κ₀ (v towards the outside of the arc).

    Parameters
    ----------
    EI : bending stiffness [N m²]
    L : length of the wire [m]
    R : radius of the tube's axis [m]
    c : clearance, tube radius less wire radius [m]

    Checked: the shape satisfies its equation and end conditions by finite differences; the exact elasticas tend to it;
    the catalogue's figures.
    """

    EI: float
    L: float
    R: float
    c: float

    def __post_init__(self) -> None:
        positive(EI=self.EI, L=self.L, R=self.R, c=self.c)

    @property
    def regime(self) -> Regime:
        """free, point (three points) or line."""
        length = self.L**2 / (self.c * self.R)
        return "free" if length <= 16 else "point" if length <= 48 else "line"

    @property
    def s(self) -> float:
        """Length between a tip and the next contact [m]."""
        return min(self.L / 2, float(np.sqrt(12 * self.c * self.R)))

    @property
    def tip_force(self) -> float:
        """T [N]."""
        return max(3 * self.EI * (self.s**2 / (2 * self.R) - 2 * self.c) / self.s**3, 0.0)

    @property
    def force(self) -> float:
        """Sum of all contact forces 4T [N]: half on the outer wall, half on the inner one."""
        return 4 * self.tip_force

    def offset(self, x: ArrayLike) -> Floats:
        """v(x), x from the middle [m]; raises ValueError without contact, where it is not unique."""
        if self.regime == "free":
            raise ValueError(f"L = {self.L}: must be > {4 * np.sqrt(self.c * self.R):.6g}, else the wire lies anywhere")
        xi: Floats = np.maximum(np.abs(np.asarray(x, dtype=float)) - (self.L / 2 - self.s), 0)
        # In line contact T s = EI/R, and the two quadratic terms cancel.
        v: Floats = self.c + self.tip_force * xi**2 * (3 * self.s - xi) / (6 * self.EI) - xi**2 / (2 * self.R)
        return v
