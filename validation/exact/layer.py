"""An elastic layer on a rigid base pressed by a rigid parabola, by its integral equation."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property, partial
from typing import Literal, NamedTuple, Self

import numpy as np
from numpy.typing import ArrayLike
from scipy.optimize import brentq

from validation.exact.chebyshev import chebyshev_sum, chebyshev_transform, composite_gauss
from validation.exact.common import ElasticBody, Floats, positive

CUTOFF = 24.0  # 1 − L(ω) < 1e-17 beyond
TOLERANCE = 1e-10
LARGEST_EXPANSION = 256


class Expansion(NamedTuple):
    """p(x) = √(1−s²) Σ c_k U_2k(s), s = x/a [Pa], and the approach δ [m]."""

    c: Floats
    delta: float


@dataclass(frozen=True, kw_only=True)
class Layer(ElasticBody):
    """Plane strain of the layer of thickness H pressed over |x| < a: u(x) = δ − x²/2R there, no friction on top.

    A pressure of wave number k indents the layer by (2/E*|k|) L(|k|H);
    frictionless base (bilateral): L = 2 sinh²ω/(sinh 2ω + 2ω);
    bonded: L = (2κ sinh 2ω − 4ω)/(2κ cosh 2ω + 1 + κ² + 4ω²), κ = 3−4ν.
    The kernel's logarithm acts on √(1−s²) U_2k in closed form, the remainder (L−1)/ω is integrated over ω, where
    the pressure's transform is a Bessel function. Collocation at Chebyshev points, doubled until p and δ stand still.

    Parameters
    ----------
    E, nu : layer [Pa], -1 < nu <= 1/2
    R : radius of curvature of the parabola [m]
    H : thickness [m]
    a : half-width of the contact [m]; `from_delta` takes the approach instead
    base : "frictionless" (bilateral) or "bonded"

    Raises
    ------
    ValueError : a parameter outside its range.
    RuntimeError : the expansion does not converge (a/H beyond about 30).

    Checked: L by the matrix exponential of the transformed equations of elasticity; the indentation of the computed
    pressure by an independent Fourier quadrature; H → ∞ (`HertzLine`) and a ≫ H (Winkler); the catalogue's figures.
    Source: Vorovich, Aleksandrov & Babeshko, Non-classical Mixed Problems of Elasticity (1974).
    """

    R: float
    H: float
    a: float
    base: Literal["frictionless", "bonded"]

    def __post_init__(self) -> None:
        super().__post_init__()
        positive(R=self.R, H=self.H, a=self.a)
        if self.base not in ("frictionless", "bonded"):
            raise ValueError(f"base = {self.base!r}: must be 'frictionless' or 'bonded'")

    @classmethod
    def from_delta(
        cls, *, E: float, nu: float, R: float, H: float, delta: float, base: Literal["frictionless", "bonded"]
    ) -> Self:
        """The layer pressed by the approach `delta` [m]; a by bracketing δ(a) = delta."""
        positive(R=R, H=H, delta=delta)
        layer = partial(cls, E=E, nu=nu, R=R, H=H, base=base)
        low = high = float(np.sqrt(2 * R * delta))
        while layer(a=low).delta > delta:
            low /= 2
        while layer(a=high).delta < delta:
            high *= 1.5
        if low == high:
            return layer(a=low)
        return layer(a=brentq(lambda a: layer(a=a).delta - delta, low, high, xtol=1e-15 * low, rtol=1e-14))

    @property
    def P(self) -> float:
        """Force per thickness ½πac₀ [N/m], both halves."""
        return float(0.5 * np.pi * self.a * self._expansion.c[0])

    @property
    def delta(self) -> float:
        """Approach [m]: the indentation at x = 0."""
        return self._expansion.delta

    @property
    def p0(self) -> float:
        """Pressure at x = 0 [Pa]."""
        return float(self.pressure(0.0))

    def pressure(self, x: ArrayLike) -> Floats:
        """p(x) on top [Pa]."""
        return chebyshev_sum(self._expansion.c, np.asarray(x, dtype=float) / self.a)

    @cached_property
    def _expansion(self) -> Expansion:
        coarse, n = self._collocate(8), 16
        while n <= LARGEST_EXPANSION:
            fine = self._collocate(n)
            change = np.abs(fine.c[: len(coarse.c)] - coarse.c).max()
            if change <= TOLERANCE * abs(fine.c[0]) and abs(fine.delta - coarse.delta) <= TOLERANCE * abs(fine.delta):
                return fine
            coarse, n = fine, 2 * n
        raise RuntimeError(f"a/H = {self.a / self.H}: {LARGEST_EXPANSION} Chebyshev terms do not reach {TOLERANCE}")

    def _collocate(self, n: int) -> Expansion:
        """Solve (2/π)α ∫ K(α|s−s′|) p/E* ds′ = δ/H − α²s²H/2R, α = a/H, at n+1 points for n coefficients and δ.

        K(t) = −log t + log 2 + ∫₀^∞ [(L−1) cos ωt + e^{−2ω}] dω/ω.
        """
        alpha = self.a / self.H
        theta = (np.arange(n + 1) + 0.5) * np.pi / (2 * (n + 1))
        s, k = np.cos(theta), np.arange(n)
        even = 2 * k + 2
        logarithm = -0.5 * np.pi * np.cos(np.outer(theta, even)) / even
        logarithm[:, 1:] += 0.5 * np.pi * np.cos(np.outer(theta, even[:-1])) / even[:-1]
        logarithm[:, 0] += 0.5 * np.pi * (np.log(2) + np.log(2 / alpha))

        omega, weight = composite_gauss(CUTOFF, panels=n // 4)
        transform = chebyshev_transform(k, alpha * omega)
        density = (weight / omega * _symbol_minus_one(omega, self.base, self.nu)) * transform
        remainder = np.cos(alpha * np.outer(s, omega)) @ density.T
        remainder[:, 0] += 0.5 * np.pi * weight @ (np.exp(-2 * omega) / omega)

        system = np.column_stack([2 / np.pi * alpha * (logarithm + remainder), -np.ones(n + 1)])
        solution = np.linalg.solve(system, -0.5 * (alpha * s) ** 2)
        return Expansion(solution[:n] * self.E_star * self.H / self.R, float(solution[n] * self.H**2 / self.R))


def _symbol_minus_one(omega: Floats, base: str, nu: float) -> Floats:
    """L(ω) − 1, in terms of e^{−2ω} so that nothing overflows."""
    e = np.exp(-2 * omega)
    if base == "frictionless":
        return 2 * e * (np.expm1(-2 * omega) - 2 * omega) / (4 * omega * e - np.expm1(-4 * omega))
    kappa = 3 - 4 * nu
    rest = 1 + kappa**2 + 4 * omega**2
    return -e * (2 * kappa * e + 4 * omega + rest) / (kappa * (1 + e**2) + rest * e)
