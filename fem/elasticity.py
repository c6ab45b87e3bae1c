"""Small-strain isotropic elasticity in plane strain, plane stress, axisymmetry and three dimensions.

Near ν = ½ displacements alone lock; the `mixed` formulation is Herrmann's with the Taylor–Hood pair: displacements of
order 2, a continuous pressure p of order 1 with σ = 2G ε(u) − p I, and the weak form

    ∫ 2G ε(u):ε(v) − p div v − q div u − p q/Λ dx = ∫ f·v dx,    Λ = Eν/((1+ν)(1−2ν)),

whose matrix is symmetric and quasi-definite for every ν < ½ (Boffi, Brezzi, Fortin 2013, section 8.8).
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from fem.geometry import MappedCells, is_straight, map_cells
from meshes.simplices import EDGES

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]
State = Literal["plane-strain", "plane-stress", "axisymmetric", "3d"]

CHUNK = 4096  # cells at a time: bounds the memory of the quadrature arrays


@dataclass(frozen=True)
class Elasticity:
    """Hooke's law σ = Λ tr ε I + 2G ε on simplices.

    Parameters
    ----------
    E, nu : Young's modulus [Pa] and Poisson's ratio
    state : which strains exist; plane states have unit thickness, axisymmetry integrates over 2πr
    mixed : the displacement–pressure formulation (second-order cells only, not in plane stress)

    Raises
    ------
    ValueError
        for the mixed formulation in plane stress or with ν ≤ 0, where Λ is not positive.
    """

    E: float
    nu: float
    state: State
    mixed: bool = False

    def __post_init__(self) -> None:
        if self.mixed and (self.state == "plane-stress" or self.nu <= 0):
            raise ValueError(
                f"mixed formulation with state = {self.state!r}, nu = {self.nu}: needs 0 < nu < 1/2, not plane stress"
            )

    @property
    def G(self) -> float:
        """Shear modulus E/(2(1+ν)) [Pa]."""
        return self.E / (2 * (1 + self.nu))

    @property
    def Lame(self) -> float:
        """Λ [Pa]; in plane stress the reduced 2GΛ/(Λ+2G)."""
        if self.state == "plane-stress":
            return self.E * self.nu / (1 - self.nu**2)
        return self.E * self.nu / ((1 + self.nu) * (1 - 2 * self.nu))

    @property
    def axisymmetric(self) -> bool:
        """Whether x = (r, z)."""
        return self.state == "axisymmetric"

    def _mapped(self, points: Floats, cells: Ints) -> Iterator[tuple[slice, MappedCells, Floats]]:
        """Chunks of cells with their divergence vectors d_a with div u = Σ d_a·u_a, (m, q, k, dim)."""
        order_two = cells.shape[1] > points.shape[1] + 1
        degree = 2 if is_straight(points, cells) else 4
        degree = degree if order_two or self.axisymmetric else 1
        degree = max(degree, 4) if self.axisymmetric and order_two else degree
        for start in range(0, len(cells), CHUNK):
            part = slice(start, min(start + CHUNK, len(cells)))
            mapped = map_cells(points, cells[part], degree, self.axisymmetric)
            divergence = mapped.gradients
            if self.axisymmetric:
                divergence = divergence.copy()
                divergence[..., 0] += mapped.values / mapped.points[..., :1]
            yield part, mapped, divergence

    def stiffness(self, points: Floats, cells: Ints) -> Floats:
        """Element matrices ∫ Λ div u div v + 2G ε(u):ε(v) dx, (m, n, n); of the mixed form, displacements first."""
        m, k = cells.shape
        dim = points.shape[1]
        nu, n = k * dim, k * dim + (dim + 1 if self.mixed else 0)
        K = np.empty((m, n, n))
        for part, mapped, divergence in self._mapped(points, cells):
            size = part.stop - part.start
            w = mapped.weights[:, :, None]
            g = mapped.gradients.reshape(size, -1, nu)
            d = divergence.reshape(size, -1, nu)
            T = np.matmul((w * g).swapaxes(1, 2), g).reshape(size, k, dim, k, dim)
            shear = self.G * T.transpose(0, 1, 4, 3, 2)
            trace = self.G * np.einsum("maibi->mab", T)
            for i in range(dim):
                shear[:, :, i, :, i] += trace
            if self.axisymmetric:
                h = (divergence - mapped.gradients)[..., 0]
                shear[:, :, 0, :, 0] += 2 * self.G * np.matmul((w * h).swapaxes(1, 2), h)
            K[part, :nu, :nu] = shear.reshape(size, nu, nu)
            if self.mixed:
                L = _pressure_values(mapped, dim)
                coupling = -np.matmul((w * d).swapaxes(1, 2), L)
                K[part, :nu, nu:] = coupling
                K[part, nu:, :nu] = coupling.swapaxes(1, 2)
                K[part, nu:, nu:] = -np.matmul((w * L).swapaxes(1, 2), L) / self.Lame
            else:
                # The products of gradients are those of divergences but for the hoop strain.
                trace_product = np.matmul((w * d).swapaxes(1, 2), d) if self.axisymmetric else T.reshape(size, nu, nu)
                K[part, :nu, :nu] += self.Lame * trace_product
        return K

    def forces(self, points: Floats, cells: Ints, u: Floats) -> Floats:
        """Internal forces ∫ σ(u):ε(v) dx of each cell from its stresses, (m, n), for its unknowns `u` (m, n)."""
        dim = points.shape[1]
        nu = cells.shape[1] * dim
        f = np.empty_like(u)
        for part, mapped, divergence in self._mapped(points, cells):
            a = u[part, :nu].reshape(-1, cells.shape[1], dim)
            grad = np.einsum("mqai,maj->mqji", mapped.gradients, a, optimize=True)
            dilatation = np.einsum("mqai,mai->mq", divergence, a, optimize=True)
            w = mapped.weights
            if self.mixed:
                L = _pressure_values(mapped, dim)
                pressure = u[part, nu:] @ L.T
                f[part, nu:] = -((w * (dilatation + pressure / self.Lame)) @ L)
            else:
                pressure = -self.Lame * dilatation
            shear = self.G * (grad + grad.swapaxes(2, 3))
            v = np.einsum("mq,mqji,mqai->maj", w, shear, mapped.gradients, optimize=True)
            v -= np.einsum("mq,mqai->mai", w * pressure, divergence, optimize=True)
            if self.axisymmetric:
                h = (divergence - mapped.gradients)[..., 0]
                hoop = 2 * self.G * np.einsum("mqa,ma->mq", h, a[:, :, 0])
                v[:, :, 0] += np.einsum("mq,mqa->ma", w * hoop, h)
            f[part, :nu] = v.reshape(-1, nu)
        return f

    def stress(self, points: Floats, cells: Ints, u: Floats) -> tuple[Floats, Floats]:
        """Cell averages of σ as a full tensor, (m, 3, 3) [Pa], and the cells' volumes (m)."""
        dim = points.shape[1]
        nu = cells.shape[1] * dim
        sigma, volume = np.zeros((len(cells), 3, 3)), np.empty(len(cells))
        for part, mapped, divergence in self._mapped(points, cells):
            a = u[part, :nu].reshape(-1, cells.shape[1], dim)
            grad = np.einsum("mq,mqai,maj->mji", mapped.weights, mapped.gradients, a, optimize=True)
            dilatation = np.einsum("mq,mqai,mai->m", mapped.weights, divergence, a, optimize=True)
            sigma[part, :dim, :dim] = self.G * (grad + grad.swapaxes(1, 2))
            if self.mixed:
                mean = -np.einsum("mq,mv,qv->m", mapped.weights, u[part, nu:], _pressure_values(mapped, dim))
            else:
                mean = self.Lame * dilatation
            if self.axisymmetric:
                h = (divergence - mapped.gradients)[..., 0]
                sigma[part, 2, 2] = 2 * self.G * np.einsum("mq,mqa,ma->m", mapped.weights, h, a[:, :, 0])
            last = 2 if self.state == "plane-stress" else 3
            for i in range(last):
                sigma[part, i, i] += mean
            volume[part] = mapped.weights.sum(axis=1)
        return sigma / volume[:, None, None], volume


def _pressure_values(mapped: MappedCells, dim: int) -> Floats:
    """The first-order shape functions at the same points: N_a of a vertex plus half of its edges' N_e, (q, dim+1)."""
    L = mapped.values[:, : dim + 1].copy()
    for e, (i, j) in enumerate(EDGES[dim]):
        L[:, i] += mapped.values[:, dim + 1 + e] / 2
        L[:, j] += mapped.values[:, dim + 1 + e] / 2
    return L
