"""Periodic contact of an elastic half-plane with a rigid wavy obstacle (Westergaard)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from validation.exact.common import Complexes, Floats, as_points, positive
from validation.exact.half_plane import HalfPlane, log_cut_below, sqrt_cut_below


@dataclass(frozen=True, kw_only=True)
class Wavy(HalfPlane):
    """Obstacle y = −Δ(1 − cos 2πx/λ), contact for |x| < a in every period λ, no motion of the sides x = ±λ/2.

    With ζ = πz/λ, α = πa/λ, w = sin ζ, c = sin α and s = √(w−c)√(w+c): Z = −2p̄ i cos ζ/(w+s), so that
    p = 2p̄ cos ζ √(sin²α − sin²ζ)/sin²α, p̄ = p* sin²α, p* = πE*Δ/λ. Far away Z → −p̄, which would shorten the body
    along x; the strain (1−2ν)p̄/2G is added, which the sides hold back and which costs no traction on y = 0.

    Parameters
    ----------
    wavelength : period λ [m]
    amplitude : Δ, half the height of the waves [m]
    a : half-width of each contact [m], < λ/2

    Checked: as `HalfPlane`; the profile in contact and a gap elsewhere; the slope of the surface by Hilbert's periodic
    transform of the pressure; the mean pressure by quadrature; σ far away; the catalogue's p̄, p(0) and gap in the
    valley at λ=1, E*=1/.91, Δ=.01, a=.3. Source: Westergaard, J. Appl. Mech. 6 (1939) A49; Johnson, §13.2.
    """

    wavelength: float
    amplitude: float
    a: float

    def __post_init__(self) -> None:
        super().__post_init__()
        positive(wavelength=self.wavelength, amplitude=self.amplitude, a=self.a)
        if self.a >= self.wavelength / 2:
            raise ValueError(f"a = {self.a}: must be < wavelength/2 = {self.wavelength / 2}")

    @property
    def alpha(self) -> float:
        """πa/λ."""
        return np.pi * self.a / self.wavelength

    @property
    def p_mean(self) -> float:
        """Mean pressure p̄ = p* sin²α [Pa]."""
        return float(np.pi * self.E_star * self.amplitude / self.wavelength * np.sin(self.alpha) ** 2)

    @property
    def p0(self) -> float:
        """Largest pressure 2p̄/sin α [Pa]."""
        return float(2 * self.p_mean / np.sin(self.alpha))

    @property
    def valley(self) -> float:
        """Gap at x = λ/2: 2Δ[cos α − sin²α log cot(α/2)] [m]."""
        c = np.sin(self.alpha)
        return float(2 * self.amplitude * (np.cos(self.alpha) + c**2 * np.log(np.tan(self.alpha / 2))))

    @property
    def singular_points(self) -> tuple[float, ...]:
        """The edges ±a of the contact about x = 0."""
        return (-self.a, self.a)

    def potentials(self, z: Complexes) -> tuple[Complexes, Complexes, Complexes]:
        """Ẑ = −(p̄λ i/π) [w/(w+s) + log((w+s)/ic)], Z, Z′ = 2p̄ i (π/λ) (1 − c² w/(w+s))/(s(w+s)).

        |x| <= λ/2 is one period; rounding beyond it, where cos ζ changes its sign, does not leave that branch.
        """
        half = self.wavelength / 2
        zeta = np.pi / self.wavelength * (np.clip(z.real, -half, half) + 1j * np.maximum(z.imag, 0.0))
        w, c = np.sin(zeta), np.sin(self.alpha)
        w.imag = np.maximum(w.imag, 0.0)
        s = sqrt_cut_below(w - c) * sqrt_cut_below(w + c)
        scale = self.p_mean * self.wavelength / np.pi
        integral = -1j * scale * (w / (w + s) + log_cut_below(w + s) - np.log(c) - 0.5j * np.pi)
        derivative = 2j * self.p_mean**2 / scale * (1 - c**2 * w / (w + s)) / (s * (w + s))
        return integral, -2j * self.p_mean * np.cos(zeta) / (w + s), derivative

    def displacement(self, points: ArrayLike) -> Floats:
        """(u_x, u_y) at points (n, 2), |x| <= λ/2, shape (n, 2) [m]."""
        u: Floats = super().displacement(points) + as_points(points, 2) * self._held
        return u

    def displacement_gradient(self, points: ArrayLike) -> Floats:
        """∂u_i/∂x_j at points (n, 2), shape (n, 2, 2)."""
        gradient: Floats = super().displacement_gradient(points) + np.diag(self._held)
        return gradient

    def stress(self, points: ArrayLike) -> Floats:
        """σ_xx, σ_yy, σ_xy at points (n, 2), shape (n, 3) [Pa]; far away −ν p̄/(1−ν), −p̄, 0."""
        sigma: Floats = super().stress(points)
        sigma[:, 0] += 2 * self.G * self._held[0] / (1 - self.nu)
        return sigma

    @property
    def _held(self) -> Floats:
        """The uniform strains ε_xx and ε_yy with σ_yy = 0 that undo the shortening along x."""
        along = (1 - 2 * self.nu) * self.p_mean / (2 * self.G)
        return np.array([along, -self.nu / (1 - self.nu) * along])

    def pressure(self, x: ArrayLike) -> Floats:
        """p(x) on y = 0 [Pa], |x| <= λ/2."""
        zeta, c2 = np.pi * np.asarray(x, dtype=float) / self.wavelength, np.sin(self.alpha) ** 2
        p: Floats = 2 * self.p_mean / c2 * np.cos(zeta) * np.sqrt(np.maximum(c2 - np.sin(zeta) ** 2, 0))
        return p
