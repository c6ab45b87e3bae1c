"""Bars, springs and rigid stops: contact problems whose answer is one line."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from validation.exact.common import Floats, finite, positive, slope_angle


@dataclass(frozen=True, kw_only=True)
class BarStop:
    """Bar fixed at x = 0, pulled by F at its end and by q per length, rigid stop at the distance g from x = L.

    −EA u″ = q, u(0) = 0, 0 <= g − u(L) ⊥ λ >= 0 with EA u′(L) = F − λ, so that λ = (F + qL/2 − EAg/L)₊.

    Parameters
    ----------
    E, A, L : Young's modulus [Pa], section [m²], length [m]
    F, q : end force [N] and load per length [N/m] towards the stop
    g : gap [m]; negative is an interference

    Checked: u solves the boundary-value problem (finite differences, exact for quadratics) and is complementary to λ.
    """

    E: float
    A: float
    L: float
    F: float = 0.0
    q: float = 0.0
    g: float

    def __post_init__(self) -> None:
        positive(E=self.E, A=self.A, L=self.L)
        finite(F=self.F, q=self.q, g=self.g)

    @property
    def k(self) -> float:
        """Stiffness EA/L seen by the end [N/m]."""
        return self.E * self.A / self.L

    @property
    def free_load(self) -> float:
        """F + qL/2 [N]: what the stop would carry with g = 0."""
        return self.F + 0.5 * self.q * self.L

    @property
    def reaction(self) -> float:
        """λ [N]."""
        return max(self.free_load - self.k * self.g, 0.0)

    @property
    def end_displacement(self) -> float:
        """u(L) [m]; exactly g in contact."""
        return self.g if self.reaction > 0 else self.free_load / self.k

    def displacement(self, x: ArrayLike) -> Floats:
        """u(x) = u(L) x/L + q x(L−x)/2EA [m]."""
        x = np.asarray(x, dtype=float)
        return self.end_displacement * x / self.L + self.q * x * (self.L - x) / (2 * self.E * self.A)

    def duplicated(self, N: int) -> Floats:
        """The multipliers of minimum norm, λ/N each, when the stop is stated N times: u and Σλ do not change."""
        if N < 1:
            raise ValueError(f"N = {N}: must be >= 1")
        return np.full(N, self.reaction / N)


@dataclass(frozen=True, kw_only=True)
class Slit:
    """Spring k pulled by F, its end held in the slit g <= u <= g + w by two opposed stops.

    u = clip(F/k, g, g+w); λ₁ (of u <= g+w) minus λ₂ (of u >= g) is F − ku. With w = 0 only this difference is unique,
    and u = g exactly. A bar is the spring k = EA/L with F + qL/2 for F.

    Parameters
    ----------
    k : stiffness [N/m]
    F : force [N]
    g : where the slit begins [m]
    w : its width [m], >= 0: a slit of negative width has no solution

    Checked: balance F − ku = λ₁ − λ₂ and complementarity over a range of F.
    """

    k: float
    F: float
    g: float
    w: float = 0.0

    def __post_init__(self) -> None:
        positive(k=self.k)
        finite(F=self.F, g=self.g, w=self.w)
        if self.w < 0:
            raise ValueError(f"w = {self.w}: must be >= 0, a slit of negative width is infeasible")

    @property
    def displacement(self) -> float:
        """u [m]."""
        return float(np.clip(self.F / self.k, self.g, self.g + self.w))

    @property
    def reaction_difference(self) -> float:
        """λ₁ − λ₂ = F − ku [N]."""
        free = self.F / self.k
        return 0.0 if self.g <= free <= self.g + self.w else self.F - self.k * self.displacement


@dataclass(frozen=True, kw_only=True)
class TwoBars:
    """Spring k₁ pulled by F towards spring k₂ at the distance g: u₁ − u₂ <= g.

    λ = k₂(F−k₁g)₊/(k₁+k₂), u₂ = λ/k₂ (never by subtraction: u₂ ≪ u₁ when k₂ ≫ k₁), u₁ = (F+k₂g)/(k₁+k₂) in contact.
    Bars are springs with k = EA/L.

    Parameters
    ----------
    k1, k2 : stiffnesses [N/m]
    F : force on the first [N]
    g : gap [m]

    Checked: both balances k₁u₁ = F − λ, k₂u₂ = λ in rational arithmetic, at k₂/k₁ = 1e12 also.
    """

    k1: float
    k2: float
    F: float
    g: float

    def __post_init__(self) -> None:
        positive(k1=self.k1, k2=self.k2)
        finite(F=self.F, g=self.g)

    @property
    def reaction(self) -> float:
        """λ [N]."""
        return max(self.F - self.k1 * self.g, 0.0) / (self.k1 / self.k2 + 1)

    @property
    def u1(self) -> float:
        """Displacement of the loaded spring [m]."""
        if self.reaction == 0:
            return self.F / self.k1
        return (self.F + self.k2 * self.g) / (self.k1 + self.k2)

    @property
    def u2(self) -> float:
        """Displacement of the second spring [m]."""
        return self.reaction / self.k2


def v_groove(*, F: float, beta: float) -> float:
    """Force N = F/(2 sin β) [N] on each wall of a symmetric V-groove of half-opening β [rad] that carries the weight F.

    The walls' normals make the angle β with the horizontal. Checked by the vertical balance 2N sin β = F.
    """
    if not (np.isfinite(F) and F >= 0):
        raise ValueError(f"F = {F}: must be >= 0, the weight that presses into the groove")
    if beta != np.pi / 2:
        slope_angle(beta=beta)
    return float(F / (2 * np.sin(beta)))
