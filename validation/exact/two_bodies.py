"""Two elastic bodies instead of one on a rigid obstacle: what each has of the common gap."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from validation.exact.common import Floats, elastic

Field = Callable[[ArrayLike], Floats]


@dataclass(frozen=True, kw_only=True)
class TwoBodies:
    """Body 1 above and body 2 below their common plane, half-planes or half-spaces, frictionless.

    1/E* = (1−ν₁²)/E₁ + (1−ν₂²)/E₂. Under one pressure p the surface of body i moves by E*/E*ᵢ of what closes the gap,
    E*ᵢ = Eᵢ/(1−νᵢ²): the problem of both splits into two of one body each on a rigid obstacle, whose profile (x²/2R,
    Δ(1−cos 2πx/λ), …) and approach are those of the pair times its share. So a parabola of 1/R becomes one of
    E*/E*ᵢR for each, with the same a, p and P. Which of the bodies has the profile is of no account in the linear
    theory: it enters as the gap of two plane surfaces.

    Parameters
    ----------
    E1, nu1, E2, nu2 : Young's moduli [Pa] and Poisson's ratios, -1 < nu <= 1/2

    Checked: the two surfaces of a Hertz and of a wavy pair, each from its body's own field, close the gap in contact.
    Source: Johnson, Contact Mechanics, §4.2.
    """

    E1: float
    nu1: float
    E2: float
    nu2: float

    def __post_init__(self) -> None:
        elastic(E=self.E1, nu=self.nu1, body="1")
        elastic(E=self.E2, nu=self.nu2, body="2")

    @property
    def E_star(self) -> float:
        """Contact modulus E* [Pa]."""
        return 1 / sum((1 - nu**2) / E for E, nu in ((self.E1, self.nu1), (self.E2, self.nu2)))

    @property
    def shares(self) -> tuple[float, float]:
        """E*/E*₁ and E*/E*₂, which add up to 1."""
        first, second = ((1 - nu**2) / E for E, nu in ((self.E1, self.nu1), (self.E2, self.nu2)))
        return first * self.E_star, second * self.E_star


def below(field: Field) -> Field:
    """The displacement of the mirror image in the plane y = 0 (z = 0) of a body above it."""

    def mirrored(points: ArrayLike) -> Floats:
        x = _reflected(points)
        return _reflected(field(x))

    return mirrored


def _reflected(vectors: ArrayLike) -> Floats:
    """The vectors with their last component reversed."""
    result: Floats = np.array(vectors, dtype=float)
    result[:, -1] *= -1
    return result
