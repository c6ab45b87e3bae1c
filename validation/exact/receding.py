"""Receding contact of a layer that lies freely on a rigid plane and is pressed by a strip load."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike
from scipy.optimize import brentq, newton
from scipy.special import jv

from validation.exact.chebyshev import chebyshev_sum, chebyshev_transform, composite_gauss
from validation.exact.common import Floats, positive

CUTOFF = 48.0  # ω e^{−ω} < 1e-18 beyond
TOLERANCE = 1e-10


@dataclass(frozen=True, kw_only=True)
class Receding:
    """Plane strain of the layer 0 < y < H on a frictionless unilateral plane under P spread over |x| < bH on top.

    A pressure of wave number k on both faces moves each inwards by (2/E*|k|) L_s, one that pushes the faces the same
    way by (2/E*|k|) L_a: L_s = 2 sinh²(ω/2)/(sinh ω + ω), L_a = 2 cosh²(ω/2)/(sinh ω − ω), ω = |k|H. The bottom stays
    flat in the contact |x| < a, so that its slope vanishes there:
    ∫₀^∞ [(L_s+L_a) p̂ + (L_s−L_a) p̂_top] sin(kx) dk = 0, with p̂(0) = p̂_top(0) = P and p = 0 at ±a.
    a/H and p(0)H/P depend on b only: not on P, E and ν.

    p = √(1−s²) Σ c_k U_2k(s), s = x/a. For a trial a, one more term β/√(1−s²) makes collocation square; a is where
    β = 0. The number of terms is doubled until a and p(0) stand still.

    Parameters
    ----------
    b : half-width of the load over H, >= 0 (0 is the line load)
    H : thickness [m]
    P : force per thickness [N/m]

    Raises
    ------
    ValueError : a parameter outside its range.
    RuntimeError : the expansion does not converge.

    Checked: L_s and L_a by the matrix exponential of the transformed equations of elasticity; p > 0; the bottom's slope
    by an independent quadrature in x and k; the catalogue's figures.
    Source: after Keer, Dundurs & Tsai, J. Appl. Mech. 39 (1972) 1115, with a rigid plane for their half-space.
    """

    b: float
    H: float = 1.0
    P: float = 1.0

    def __post_init__(self) -> None:
        if not (np.isfinite(self.b) and self.b >= 0):
            raise ValueError(f"b = {self.b}: must be >= 0, the load's half-width over the thickness")
        positive(H=self.H, P=self.P)

    @property
    def a(self) -> float:
        """Half-width of the contact [m]."""
        return self.H * self._expansion[0]

    @property
    def p0(self) -> float:
        """Pressure at x = 0 [Pa]."""
        return float(self.pressure(0.0))

    def pressure(self, x: ArrayLike) -> Floats:
        """p(x) on the plane [Pa]."""
        return self.P / self.H * chebyshev_sum(self._expansion[1], np.asarray(x, dtype=float) / self.a)

    @cached_property
    def _expansion(self) -> tuple[float, Floats]:
        """a/H and c_k H/P."""
        start = 8 * (1 + int(self.b / 3))  # fewer terms than about 8a/3H do not bracket a
        alpha = brentq(lambda alpha: self._collocate(alpha, start)[0], max(0.6, 0.8 * self.b), self.b + 1)
        c, n = self._collocate(alpha, start)[1], 2 * start
        while n <= 8 * start:
            finer_alpha = newton(lambda alpha, n=n: self._collocate(alpha, n)[0], alpha, tol=1e-13, rtol=1e-13)
            finer_c = self._collocate(finer_alpha, n)[1]
            change = np.abs(finer_c[: len(c)] - c).max()
            if abs(finer_alpha - alpha) <= TOLERANCE * alpha and change <= TOLERANCE * finer_c[0]:
                return finer_alpha, finer_c
            alpha, c, n = finer_alpha, finer_c, 2 * n
        raise RuntimeError(f"b = {self.b}: {8 * start} Chebyshev terms do not reach {TOLERANCE}")

    def _collocate(self, alpha: float, n: int) -> tuple[float, Floats]:
        """β and c_k in units of P/H for the trial a = αH, with the force balance eliminated: c₀ = 2/πα − 2β."""
        theta = (np.arange(n) + 0.5) * np.pi / (2 * n)
        omega, weight = composite_gauss(CUTOFF, panels=n // 4)
        symmetric, antisymmetric = _symbols_minus_one(omega)
        sine = weight * np.sin(alpha * np.outer(np.cos(theta), omega))

        k = np.arange(n)
        transform = alpha * chebyshev_transform(k, alpha * omega)
        transform[0] = -alpha * np.pi * jv(2, alpha * omega)  # of 1/√(1−s²) − 2√(1−s²), which carries no force
        system = sine @ (transform * (symmetric + antisymmetric)).T
        system += 2 * np.pi * np.cos(np.outer(theta, 2 * k + 1)) * np.where(k == 0, -2, 1)

        balanced, top = 2 * jv(1, alpha * omega) / (alpha * omega), np.sinc(self.b * omega / np.pi)
        load = sine @ (symmetric * (balanced + top) + antisymmetric * (balanced - top)) + 4 / alpha * np.cos(theta)
        beta, *c = np.linalg.solve(system, -load)
        return float(beta), np.array([2 / (np.pi * alpha) - 2 * beta, *c])


def _symbols_minus_one(omega: Floats) -> tuple[Floats, Floats]:
    """L_s − 1 and L_a − 1, in terms of e^{−ω} so that nothing overflows."""
    e = np.exp(-omega)
    symmetric = 2 * e * (e - 1 - omega) / (1 - e**2 + 2 * omega * e)
    antisymmetric = 2 * e * (e + 1 + omega) / (1 - e**2 - 2 * omega * e)
    return symmetric, antisymmetric
