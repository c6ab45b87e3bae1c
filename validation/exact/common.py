"""What every closed form needs: checks of its parameters, and a product that respects weak singularities."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

Floats = NDArray[np.float64]
Complexes = NDArray[np.complex128]
Regime = Literal["free", "point", "line"]


def finite(**parameters: float) -> None:
    """Raise ValueError for the first parameter that is not a finite number."""
    for name, value in parameters.items():
        if not np.isfinite(value):
            raise ValueError(f"{name} = {value}: must be a finite number")


def positive(**parameters: float) -> None:
    """Raise ValueError for the first parameter that is not finite and > 0."""
    finite(**parameters)
    for name, value in parameters.items():
        if value <= 0:
            raise ValueError(f"{name} = {value}: must be > 0")


def elastic(*, E: float, nu: float, body: str = "") -> None:
    """Raise ValueError unless E > 0 and -1 < nu <= 1/2; `body` is what follows E and nu in their names."""
    positive(**{f"E{body}": E})
    if not -1 < nu <= 0.5:
        raise ValueError(f"nu{body} = {nu}: must be > -1 and <= 1/2")


@dataclass(frozen=True, kw_only=True)
class ElasticBody:
    """An isotropic body against rigid ones.

    Parameters
    ----------
    E : Young's modulus [Pa]
    nu : Poisson's ratio, -1 < nu <= 1/2

    Raises
    ------
    ValueError : a parameter outside its range.
    """

    E: float
    nu: float

    def __post_init__(self) -> None:
        elastic(E=self.E, nu=self.nu)

    @property
    def E_star(self) -> float:
        """E* = E/(1−ν²) [Pa]."""
        return self.E / (1 - self.nu**2)

    @property
    def G(self) -> float:
        """Shear modulus E/2(1+ν) [Pa]."""
        return self.E / (2 * (1 + self.nu))


def slope_angle(**parameters: float) -> None:
    """Raise ValueError unless every angle [rad] lies in (0, pi/2)."""
    for name, value in parameters.items():
        if not 0 < value < np.pi / 2:
            raise ValueError(f"{name} = {value}: must be an angle in radians between 0 and pi/2")


def ascending(**parameters: float) -> None:
    """Raise ValueError unless the radii given are positive and strictly increasing."""
    positive(**parameters)
    names, values = list(parameters), list(parameters.values())
    for k in range(1, len(values)):
        if values[k] <= values[k - 1]:
            raise ValueError(f"{names[k]} = {values[k]}: must be > {names[k - 1]} = {values[k - 1]}")


def as_points(points: ArrayLike, *dimensions: int) -> Floats:
    """Points as a float array (n, d); raises ValueError unless d is one of `dimensions`."""
    array = np.asarray(points, dtype=float)
    if array.ndim != 2 or array.shape[1] not in dimensions:
        allowed = " or ".join(f"(n, {d})" for d in dimensions)
        raise ValueError(f"points of shape {array.shape}: must be {allowed}")
    return array


def radius(points: ArrayLike) -> Floats:
    """Distance of the points (n, d) from the origin, shape (n)."""
    r: Floats = np.linalg.norm(np.asarray(points, dtype=float), axis=-1)
    return r


def vanishing_product(distance: Floats, factor: NDArray[Any]) -> NDArray[Any]:
    """distance * factor, and 0 where the distance is 0: the factor's singularity there is weaker than 1/distance."""
    product: NDArray[Any] = np.multiply(distance, factor, out=np.zeros_like(factor), where=distance != 0)
    return product
