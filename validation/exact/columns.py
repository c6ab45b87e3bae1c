"""Columns under axial loads, small slopes: Euler's load, between walls, along the bottom of a tube."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike

from validation.exact.common import Floats, Regime, positive


def euler_load(*, EI: float, L: float, ends: Literal["pinned", "cantilever", "clamped"] = "pinned") -> float:
    """Smallest buckling load π²EI/(μL)² [N], μ = 1 pinned at both ends, 2 cantilever, 1/2 clamped at both ends."""
    positive(EI=EI, L=L)
    factors = {"pinned": 1.0, "cantilever": 2.0, "clamped": 0.5}
    if ends not in factors:
        raise ValueError(f"ends = {ends}: must be pinned, cantilever or clamped")
    return float(np.pi**2 * EI / (factors[ends] * L) ** 2)


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
