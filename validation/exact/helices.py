"""Infinite helical rods pressed on the inside of a circular tube, with the end conditions of a finite piece."""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike
from scipy.optimize import brentq

from validation.exact.common import Floats, finite, positive, slope_angle

ANGLES = 4001  # samples of β that separate the energy's minima


@dataclass(frozen=True, kw_only=True)
class Helix(ABC):
    """Right-handed helix x(ξ) = (r cos φ, r sin φ, ξ cos β), φ = ξ sin β/r, ξ its arc length; r the tube's clearance.

    With t, N (towards the axis) and b = t×N: curvature κ = sin²β/r, torsion τ = sin β cos β/r. The internal force
    n = n_t t + n_b b and moment m = m_t t + m_b b are constant in this frame, and the wall's force per length is f N:
    n_b = m_t κ − m_b τ (from m′ + t×n = 0), n_t cos β + n_b sin β = −F (F the compression along the tube),
    f = n_b τ − n_t κ (from n′ + f N = 0).

    A finite piece 0 <= ξ <= L is in the same state under n(L), m(L) at its end and −n(0), −m(0) at its start, in space
    ("dead" vectors do, the state being an equilibrium); or with x, t, N, b of the ends held (`position`, `frame`).

    Checked: m′ + t×n = 0 and n′ + f N = 0 by finite differences of the vectors in space.
    Source: Love, Mathematical Theory of Elasticity, §§254, 270.
    """

    r: float

    @property
    @abstractmethod
    def angle(self) -> float:
        """β between tangent and axis [rad]."""

    @property
    @abstractmethod
    def moment(self) -> tuple[float, float]:
        """m_t, m_b: twisting and bending moment [N m]."""

    @property
    @abstractmethod
    def compression(self) -> float:
        """F along the tube [N]."""

    @property
    def kappa(self) -> float:
        """Curvature sin²β/r [1/m]."""
        return float(np.sin(self.angle) ** 2 / self.r)

    @property
    def tau(self) -> float:
        """Torsion sin β cos β/r [1/m]."""
        return float(np.sin(self.angle) * np.cos(self.angle) / self.r)

    @property
    def pitch(self) -> float:
        """2πr/tan β [m]."""
        return float(2 * np.pi * self.r / np.tan(self.angle))

    @property
    def internal_force(self) -> tuple[float, float]:
        """n_t, n_b [N]."""
        m_t, m_b = self.moment
        n_b = m_t * self.kappa - m_b * self.tau
        return float(-(self.compression + n_b * np.sin(self.angle)) / np.cos(self.angle)), n_b

    @property
    def f(self) -> float:
        """Force of the wall per length of the rod [N/m]."""
        n_t, n_b = self.internal_force
        return n_b * self.tau - n_t * self.kappa

    def position(self, xi: ArrayLike) -> Floats:
        """x(ξ), shape (n, 3) [m]."""
        xi = np.atleast_1d(np.asarray(xi, dtype=float))
        phi = xi * np.sin(self.angle) / self.r
        return np.column_stack([self.r * np.cos(phi), self.r * np.sin(phi), xi * np.cos(self.angle)])

    def frame(self, xi: ArrayLike) -> Floats:
        """t, N, b as columns, shape (n, 3, 3)."""
        s, c = np.sin(self.angle), np.cos(self.angle)
        phi = np.atleast_1d(np.asarray(xi, dtype=float)) * s / self.r
        e_r = np.column_stack([np.cos(phi), np.sin(phi), 0 * phi])
        e_phi = np.column_stack([-np.sin(phi), np.cos(phi), 0 * phi])
        e_z = np.array([0.0, 0.0, 1.0])
        frame: Floats = np.stack([s * e_phi + c * e_z, -e_r, s * e_z - c * e_phi], axis=-1)
        return frame

    def force_vector(self, xi: ArrayLike) -> Floats:
        """n(ξ) in space, the force of the part beyond ξ on the part before it, shape (n, 3) [N]."""
        n_t, n_b = self.internal_force
        vector: Floats = self.frame(xi) @ np.array([n_t, 0.0, n_b])
        return vector

    def moment_vector(self, xi: ArrayLike) -> Floats:
        """m(ξ) in space, likewise, shape (n, 3) [N m]."""
        m_t, m_b = self.moment
        vector: Floats = self.frame(xi) @ np.array([m_t, 0.0, m_b])
        return vector


@dataclass(frozen=True, kw_only=True)
class HelixTube(Helix):
    """A naturally straight rod, free to twist, buckled into a helix by the compression F: f = (s²/r)(F/c − EIs²/r²).

    s = sin β, c = cos β. No twisting moment: m_t = 0, m_b = EIκ. F without a value is 2EIs²c/r², which minimises
    ½EIκ² + F cos β over β (ends free to turn about the tube's axis: no torque about it); then f = EIs⁴/r³.

    Parameters
    ----------
    EI : bending stiffness [N m²]
    r : clearance, tube radius less rod radius [m]
    beta : angle between tangent and axis [rad]
    F : compression along the tube [N]

    Raises
    ------
    ValueError : a parameter outside its range; F so small that the rod leaves the wall.

    Checked: as `Helix`; the energy's derivative; no torque; the catalogue's figures. Source: Lubinski, Althouse &
    Logan, J. Petroleum Technology 14 (1962) 655 (P = 8π²EI/pitch², the limit β → 0).
    """

    EI: float
    beta: float
    F: float | None = None

    def __post_init__(self) -> None:
        positive(EI=self.EI, r=self.r)
        slope_angle(beta=self.beta)
        if self.F is not None:
            finite(F=self.F)
        if self.f < 0:
            raise ValueError(f"F = {self.F}: must be >= {self.selected_force / 2:.6g}, else the rod leaves the wall")

    @property
    def angle(self) -> float:
        """β [rad]."""
        return self.beta

    @property
    def moment(self) -> tuple[float, float]:
        """m_t = 0, m_b = EIκ [N m]."""
        return 0.0, self.EI * self.kappa

    @property
    def selected_force(self) -> float:
        """2EI sin²β cos β/r² [N]."""
        return float(2 * self.EI * np.sin(self.beta) ** 2 * np.cos(self.beta) / self.r**2)

    @property
    def compression(self) -> float:
        """F [N]."""
        return self.selected_force if self.F is None else self.F


@dataclass(frozen=True, kw_only=True)
class CoilTube(Helix):
    """A rod of natural curvature κ₀ and torsion τ₀ in a tube, infinitely long, free of axial force and torque.

    β minimises U = ½EI(s²/r − κ₀)² + ½GJ(sc/r − τ₀)², s = sin β, c = cos β;
    m_t = GJ(τ−τ₀), m_b = EI(κ−κ₀), f = m_b s²/r² + m_t sc/r².

    Parameters
    ----------
    EI, GJ : bending and torsional stiffness [N m²]
    r : clearance, tube radius less rod radius [m]
    kappa0, tau0 : natural curvature and torsion [1/m], κ₀ > 0, τ₀ >= 0 (the helix is right-handed)

    Raises
    ------
    ValueError : a parameter outside its range; a coil that does not press on the tube.

    Checked: as `Helix`; no torque; f by −dU/dr at the minimum; the catalogue's figures.
    """

    EI: float
    GJ: float
    kappa0: float
    tau0: float

    def __post_init__(self) -> None:
        positive(EI=self.EI, GJ=self.GJ, r=self.r, kappa0=self.kappa0)
        if not (np.isfinite(self.tau0) and self.tau0 >= 0):
            raise ValueError(f"tau0 = {self.tau0}: must be >= 0, the helix is right-handed")
        if self.f < 0:
            raise ValueError(
                f"r = {self.r}: must be <= {self.natural_radius:.6g}, else the coil does not touch the tube"
            )

    @property
    def natural_radius(self) -> float:
        """κ₀/(κ₀²+τ₀²) [m]."""
        return self.kappa0 / (self.kappa0**2 + self.tau0**2)

    @classmethod
    def from_natural_helix(cls, *, EI: float, GJ: float, r: float, radius: float, beta: float) -> CoilTube:
        """The coil whose stress-free shape is a helix of this radius [m] and angle β [rad]."""
        positive(radius=radius)
        slope_angle(beta=beta)
        s, c = np.sin(beta), np.cos(beta)
        return cls(EI=EI, GJ=GJ, r=r, kappa0=float(s**2 / radius), tau0=float(s * c / radius))

    @cached_property
    def angle(self) -> float:
        """β [rad], the deepest minimum of U in (0, π/2)."""
        beta = np.linspace(0, np.pi / 2, ANGLES)
        best = int(np.argmin(self.energy(beta)[1:-1])) + 1
        return float(brentq(self._energy_slope, beta[best - 1], beta[best + 1], xtol=1e-15, rtol=1e-15))

    def energy(self, beta: ArrayLike) -> Floats:
        """U(β) per length [N]."""
        s, c = np.sin(beta), np.cos(beta)
        bend, twist = s**2 / self.r - self.kappa0, s * c / self.r - self.tau0
        energy: Floats = 0.5 * self.EI * bend**2 + 0.5 * self.GJ * twist**2
        return energy

    @property
    def moment(self) -> tuple[float, float]:
        """m_t = GJ(τ−τ₀), m_b = EI(κ−κ₀) [N m]."""
        return self.GJ * (self.tau - self.tau0), self.EI * (self.kappa - self.kappa0)

    @property
    def compression(self) -> float:
        """0."""
        return 0.0

    def _energy_slope(self, beta: float) -> float:
        s, c = np.sin(beta), np.cos(beta)
        bend, twist = s**2 / self.r - self.kappa0, s * c / self.r - self.tau0
        return float((self.EI * bend * 2 * s * c + self.GJ * twist * (c**2 - s**2)) / self.r)
