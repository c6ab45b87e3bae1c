"""A pin in a slightly larger hole of an infinite plate of the same material (Persson)."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike
from scipy.integrate import quad

from validation.exact.common import Complexes, Floats, as_points, elastic, positive

TERMS = 240  # harmonics of the pressure: (R/r)^TERMS is below rounding where r > 1.2 R or r < R/1.2


@dataclass(frozen=True, kw_only=True)
class PinHole:
    """Plane stress; the pin's centre is pushed by Q along +x, the plate is held far away; contact for |θ| < ε.

    The hole of radius R is larger by ΔR ≪ R: the linear theory, in which both meet on the circle r = R and the gap
    before loading is ΔR (1 − cos θ). With b = tan ½ε, y = tan ½θ and L(y) = ln[(√(b²+1)+√(b²−y²))/(√(b²+1)−√(b²−y²))]

        EΔR/Q = 2(1−b²)/πb² − I/π²b²(1+b²),  I = ∫₋ᵇᵇ L(y)/(1+y²) dy,
        pR/Q = 2√(b²−y²)/(π√(b²+1)(1+y²)) + L(y)/2πb²(1+b²).

    It does not depend on ν, and ε not on the size of Q and ΔR but on their quotient: the contact grows from nothing.
    The gap under load, u_r of the plate less that of the pin added, is

        g(θ) = ΔR(1−cos θ) + 2p₀/E + T cos θ + 4/πE ∫ p(φ) k(θ−φ) dφ,  k(x) = −cos x ln|2 sin ½x| − ½ − ¼cos x,

    pₙ the harmonics of p = Σ pₙ cos nθ, k = Σ n cos nx/(n²−1) over n ≥ 2, and T the rigid motion that closes it.

    Displacements come from 2G(u+iv) = κφ − zΦ̄ − ψ̄, κ = (3−ν)/(1+ν), z in units of R, Φ = φ′, Ψ = ψ′ and
    σ_rr − iσ_rθ = Φ + Φ̄ − e^{2iθ}(z̄Φ′ + Ψ). Both bodies have Φ = c₁/z, Ψ = −κc₁/z of the force, c₁ = −p₁/2(1+κ), and
    plate: Φ −½pₙ z⁻ⁿ, Ψ p₀z⁻² + (2c₁+½p₁)z⁻³ − ½npₙ z⁻ⁿ⁻²; pin: Φ −½p₀ − (½p₁+2c₁)z − ½pₙ zⁿ, Ψ ½npₙ zⁿ⁻²; n ≥ 2.

    Parameters
    ----------
    E, nu : Young's modulus [Pa] and Poisson's ratio of both bodies
    R : radius [m]
    delta : ΔR, the difference of the radii [m]
    eps : contact angle ε [degrees], below about 84.9, where ΔR = 0

    Checked: g = 0 in contact and > 0 elsewhere; the force by quadrature; equilibrium and Hooke's law by finite
    differences, the tractions at r = R, and their resultant on other circles; the catalogue's EΔR/Q at 30° and 60°.
    Source: Persson, On the stress distribution of cylindrical elastic bodies in contact (1964); Muskhelishvili, Some
    basic problems of the mathematical theory of elasticity, §§56, 59.
    """

    E: float
    nu: float
    R: float
    delta: float
    eps: float

    def __post_init__(self) -> None:
        elastic(E=self.E, nu=self.nu)
        positive(R=self.R, delta=self.delta, eps=self.eps)
        if self.eps >= 90 or self.ratio <= 0:
            raise ValueError(f"eps = {self.eps}: must be below 84.9 degrees, where the clearance is 0")

    @property
    def angle(self) -> float:
        """ε [rad]."""
        return float(np.deg2rad(self.eps))

    @property
    def b(self) -> float:
        """tan ½ε."""
        return float(np.tan(self.angle / 2))

    @cached_property
    def ratio(self) -> float:
        """EΔR/Q."""
        b2 = self.b**2
        integral = quad(lambda y: float(self._log(y)) / (1 + y**2), -self.b, self.b, epsabs=1e-13)[0]
        return float(2 * (1 - b2) / (np.pi * b2) - integral / (np.pi**2 * b2 * (1 + b2)))

    @property
    def Q(self) -> float:
        """Force per thickness [N/m]."""
        return self.E * self.delta / self.ratio

    def pressure(self, theta: ArrayLike) -> Floats:
        """p(θ) [Pa], |θ| < π."""
        y, b2 = np.tan(np.asarray(theta, dtype=float) / 2), self.b**2
        root = np.sqrt(np.maximum(b2 - y**2, 0))
        first = 2 * root / (np.pi * np.sqrt(b2 + 1) * (1 + y**2))
        p: Floats = self.Q / self.R * (first + self._log(y) / (2 * np.pi * b2 * (1 + b2)))
        return p

    @property
    def p0(self) -> float:
        """Largest pressure, at θ = 0 [Pa]."""
        return float(self.pressure(0.0))

    def gap(self, theta: float) -> float:
        """The gap g(θ) under load [m]."""
        p0, T = self._harmonics[0], self._closing
        return float(
            self.delta * (1 - np.cos(theta))
            + self.R * (2 * p0 + 4 / np.pi * self._convolution(theta)) / self.E
            + T * np.cos(theta)
        )

    def displacement_plate(self, points: ArrayLike) -> Floats:
        """(u_x, u_y) of the plate at points (n, 2), |x| > 1.2 R, shape (n, 2) [m]."""
        z, p, c1, n = self._unknowns(points)
        log: Complexes = np.log(z)
        phi = c1 * log
        psi = -self._kappa * phi - p[0] / z - (c1 + p[1] / 4) / z**2
        powers = z[:, None] ** -n
        phi = phi + powers @ (p[2:] / (2 * (n - 1))) * z
        Phi = c1 * z**-1 - powers @ (p[2:] / 2)
        psi = psi + powers @ (n * p[2:] / (2 * (n + 1))) / z
        return self._vectors(z, phi, Phi, psi)

    def displacement_pin(self, points: ArrayLike) -> Floats:
        """(u_x, u_y) of the pin at points (n, 2), 0 < |x| < R/1.2, with its rigid motion, shape (n, 2) [m]."""
        z, p, c1, n = self._unknowns(points)
        e1 = -p[1] / 2 - 2 * c1
        log: Complexes = np.log(z)
        phi = c1 * log - p[0] / 2 * z + e1 / 2 * z**2
        psi = -self._kappa * c1 * log
        powers = z[:, None] ** n
        phi = phi - powers @ (p[2:] / (2 * (n + 1))) * z
        Phi = c1 * z**-1 - p[0] / 2 + e1 * z - powers @ (p[2:] / 2)
        psi = psi + powers @ (n * p[2:] / (2 * (n - 1))) / z
        # the first harmonic of the gap is T: what the series give of it is taken back by a rigid motion
        first = p[1] / 4 + c1 + e1 - self._kappa * e1 / 2
        shift = (first - 2 * self._G / self.R * self._closing) / self._kappa
        return self._vectors(z, phi + shift, Phi, psi)

    def _log(self, y: ArrayLike) -> Floats:
        """L(y)."""
        b2 = self.b**2
        root = np.sqrt(np.maximum(b2 - np.asarray(y, dtype=float) ** 2, 0))
        value: Floats = 2 * np.arctanh(root / np.sqrt(b2 + 1))
        return value

    @cached_property
    def _harmonics(self) -> Floats:
        """pₙ [Pa], n = 0 … TERMS, by Gauss's rule for √(b²−y²) times smooth functions."""
        m = 2 * TERMS
        angle = np.pi * np.arange(1, m + 1) / (m + 1)
        y = self.b * np.cos(angle)
        weights = np.pi / (m + 1) * self.b * np.sin(angle) * 2 / (1 + y**2)
        theta = 2 * np.arctan(y)
        p = np.cos(np.outer(np.arange(TERMS + 1), theta)) @ (weights * self.pressure(theta)) / np.pi
        p[0] /= 2
        return np.asarray(p)

    def _convolution(self, theta: float) -> float:
        """∫ p(φ) k(θ−φ) dφ."""

        def integrand(phi: float) -> float:
            x = theta - phi
            log = np.log(max(abs(2 * np.sin(x / 2)), 1e-300))
            return float(self.pressure(phi) * (-np.cos(x) * log - 0.5 - np.cos(x) / 4))

        breaks = [theta] if abs(theta) < self.angle else None
        return float(quad(integrand, -self.angle, self.angle, points=breaks, epsabs=0, epsrel=1e-10, limit=400)[0])

    @cached_property
    def _closing(self) -> float:
        """T [m], from g(0) = 0."""
        return float(-self.R * (2 * self._harmonics[0] + 4 / np.pi * self._convolution(0.0)) / self.E)

    @property
    def _kappa(self) -> float:
        return (3 - self.nu) / (1 + self.nu)

    @property
    def _G(self) -> float:
        return self.E / (2 * (1 + self.nu))

    def _unknowns(self, points: ArrayLike) -> tuple[Complexes, Floats, float, Floats]:
        """z, the harmonics, c₁ and n = 2 … TERMS."""
        x, y = as_points(points, 2).T / self.R
        p = self._harmonics
        return x + 1j * y, p, -p[1] / (2 * (1 + self._kappa)), np.arange(2.0, TERMS + 1)

    def _vectors(self, z: Complexes, phi: Complexes, Phi: Complexes, psi: Complexes) -> Floats:
        u = self.R / (2 * self._G) * (self._kappa * phi - z * Phi.conj() - psi.conj())
        return np.stack([u.real, u.imag], axis=1)
