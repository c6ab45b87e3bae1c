"""Beams and columns against flat walls, small slopes: polynomials and sines with a free boundary."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike

from validation.exact.common import Floats, positive

Regime = Literal["free", "point", "line"]


def euler_load(*, EI: float, L: float, ends: Literal["pinned", "cantilever", "clamped"] = "pinned") -> float:
    """Smallest buckling load π²EI/(μL)² [N], μ = 1 pinned at both ends, 2 cantilever, 1/2 clamped at both ends."""
    positive(EI=EI, L=L)
    factors = {"pinned": 1.0, "cantilever": 2.0, "clamped": 0.5}
    if ends not in factors:
        raise ValueError(f"ends = {ends}: must be pinned, cantilever or clamped")
    return float(np.pi**2 * EI / (factors[ends] * L) ** 2)


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
class ColumnWalls:
    """Pinned column buckled by P between walls ±d, first mode, small slopes: EI w⁗ + P w″ = −λ, |w| <= d.

    With k² = P/EI, φ = kL/2: w = A sin kx + Vx/P up to the contact, V being the pins' lateral force.
    Point contact in the middle for π² < PL²/EI <= 4π²: R = 2V = −2Pkd cos φ/(sin φ − φ cos φ).
    Line contact up to 16π², where the flat part buckles: s = π/k, a force V = Pd/s at either end of it, none between.

    Parameters
    ----------
    EI : bending stiffness [N m²]
    L : length [m]
    P : axial load [N]
    d : clearance between the straight column and a wall [m]

    Raises
    ------
    ValueError : a parameter outside its range; PL²/EI not in (π², 16π²).

    Checked: the shape satisfies the equation and the end conditions by finite differences, the shortening by
    quadrature; the exact elastica tends to it as d → 0; the catalogue's figures. Source: Domokos, Holmes & Royce,
    J. Nonlinear Sci. 7 (1997) 281.
    """

    EI: float
    L: float
    P: float
    d: float

    def __post_init__(self) -> None:
        positive(EI=self.EI, L=self.L, P=self.P, d=self.d)
        if not 1 < self.P * (self.L / np.pi) ** 2 / self.EI < 16:
            low, high = (n**2 * euler_load(EI=self.EI, L=self.L) for n in (1, 4))
            raise ValueError(f"P = {self.P}: must be between {low:.6g} (buckling) and {high:.6g} (of the flat part)")

    @property
    def k(self) -> float:
        """√(P/EI) [1/m]."""
        return float(np.sqrt(self.P / self.EI))

    @property
    def regime(self) -> Regime:
        """point (the middle) or line."""
        return "point" if self.k * self.L <= 2 * np.pi else "line"

    @property
    def s(self) -> float:
        """Length between a pin and the first contact [m]."""
        return min(self.L / 2, float(np.pi / self.k))

    @property
    def pin_force(self) -> float:
        """V: lateral force of one pin [N]."""
        phi = self.k * self.s
        return float(-self.P * self.k * self.d * np.cos(phi) / (np.sin(phi) - phi * np.cos(phi)))

    @property
    def reaction(self) -> float:
        """Concentrated force [N]: R of the middle in point contact, each of the two in line contact."""
        return self.pin_force * (2 if self.regime == "point" else 1)

    @property
    def force(self) -> float:
        """Total contact force 2V [N]."""
        return 2 * self.pin_force

    @property
    def shortening(self) -> float:
        """Approach of the pins ½∫w′² dx [m]."""
        k, s, B, C = self.k, self.s, self.pin_force / self.P, self._slope_amplitude
        mean_square = B**2 * s + 2 * B * C * np.sin(k * s) / k + C**2 * (s / 2 + np.sin(2 * k * s) / (4 * k))
        return float(mean_square)

    def deflection(self, x: ArrayLike) -> Floats:
        """w(x) [m]."""
        x = np.asarray(x, dtype=float)
        y: Floats = np.minimum(np.minimum(x, self.L - x), self.s)
        return self._slope_amplitude * np.sin(self.k * y) / self.k + self.pin_force / self.P * y

    @property
    def _slope_amplitude(self) -> float:
        """kA, from w′(s) = 0."""
        return float(-self.pin_force / (self.P * np.cos(self.k * self.s)))


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


@dataclass(frozen=True, kw_only=True)
class DawsonPaslay:
    """Compressed rod of weight w per length lying along the bottom of a tube: sideways (sinusoidal) buckling.

    The rod's axis may leave the tube's by r. Sideways u lifts the weight by u²/2r, so EI u⁗ + P u″ + (w/r)u = 0 with
    u = u″ = 0 at both ends: u = sin(nπx/L), P_n = EI(nπ/L)² + (w/r)(L/nπ)², never below 2√(EIw/r).

    Parameters
    ----------
    EI : bending stiffness [N m²]
    w : weight per length [N/m]
    r : clearance, tube radius less rod radius [m]
    L : length between the supports [m]

    Checked: against the eigenvalues of a sine-free discretisation (finite differences); the catalogue's P₃.
    Source: Dawson & Paslay, J. Petroleum Technology 36 (1984) 1734.
    """

    EI: float
    w: float
    r: float
    L: float

    def __post_init__(self) -> None:
        positive(EI=self.EI, w=self.w, r=self.r, L=self.L)

    def load(self, n: int) -> float:
        """P_n [N]."""
        if n < 1:
            raise ValueError(f"n = {n}: must be >= 1")
        k2 = (n * np.pi / self.L) ** 2
        return float(self.EI * k2 + self.w / (self.r * k2))

    @property
    def n(self) -> int:
        """Number of half waves of the smallest load."""
        best = self.L / np.pi * (self.w / (self.r * self.EI)) ** 0.25
        return min((max(int(best), 1), int(best) + 1), key=self.load)

    @property
    def P(self) -> float:
        """Buckling load min P_n [N]."""
        return self.load(self.n)

    @property
    def infinite_load(self) -> float:
        """2√(EIw/r) [N]: of the infinite rod, a lower bound of P."""
        return float(2 * np.sqrt(self.EI * self.w / self.r))

    def mode(self, x: ArrayLike) -> Floats:
        """sin(nπx/L)."""
        return np.sin(self.n * np.pi / self.L * np.asarray(x, dtype=float))
