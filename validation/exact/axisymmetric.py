"""Frictionless axisymmetric contact of an elastic half-space: one potential, whose density F(t) is the punch."""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from validation.exact.common import Complexes, ElasticBody, Floats, as_points, vanishing_product


class Density(NamedTuple):
    """The even density F of degree 2 in |t| on [−a, a], by what its integrals need.

    `F_a`, `dF_a` and `ddF` are F, F′ and F″ at t = a [N/m, N/m², N/m³]; `dF_0` is F′(0+), the kink of a pointed punch.
    """

    a: float
    F_a: float
    dF_a: float
    ddF: float
    dF_0: float


class Derivatives(NamedTuple):
    """ψ and χ at points: `chi_r_r` is χ_r/r, `psi_r` and `psi_rz` are whole derivatives (not divided by r)."""

    psi: Floats
    psi_r: Floats
    psi_z: Floats
    psi_rz: Floats
    psi_zz: Floats
    chi_r_r: Floats


@dataclass(frozen=True, kw_only=True)
class AxisymmetricContact(ElasticBody, ABC):
    """The body z >= 0 pressed by a rigid axisymmetric punch from below, contact for r < a.

    D = √(r²+(z+it)²), ψ = ∫₋ₐᵃ F/D dt, χ = ∫₋ₐᵃ F log(z+it+D) dt, so that χ_z = ψ and
    u_r = −[(1−2ν)χ_r + zψ_r]/4πG,  u_z = [2(1−ν)ψ − zψ_z]/4πG,
    σ_zz = (ψ_z − zψ_zz)/2π,  σ_rz = −zψ_rz/2π,
    σ_rr = [−(1−2ν)χ_rr − zψ_rr + 2νψ_z]/2π,  σ_θθ = [−(1−2ν)χ_r/r − zψ_r/r + 2νψ_z]/2π.
    On z = 0 the shear vanishes, u_z = ψ/πE* and u_z(0, 0) = F(0)/E*; P = ∫ F dt.

    F is a polynomial in |t|, so the integrals end after three integrations by parts, each with ∂/∂t = i ∂/∂ζ, ζ = z+it:
    ∫₀ᵃ F g₀ dt = [−i F g₁ + F′ g₂ + i F″ g₃]₀ᵃ, where g_k+1 is the primitive of g_k in ζ. They hold in all of z >= 0,
    on the contact too, where a quadrature in t fails. Relative error about 1e-16 (ρ/a)³ at the distance ρ ≫ a.

    Checked: against quadrature in t, equilibrium and Hooke's law by finite differences, and the traction on z = 0.
    Source: Green & Zerna, Theoretical Elasticity, §5.8; Barber, Contact Mechanics, ch. 5 (Collins's complex potential).

    Parameters
    ----------
    E : Young's modulus [Pa]
    nu : Poisson's ratio, -1 < nu <= 1/2

    Points are (n, 2) = (r, z) or (n, 3) = (x, y, z) with the axis along z.

    Raises
    ------
    ValueError : a parameter outside its range; a point below z = 0 by more than rounding.
    """

    @abstractmethod
    def density(self) -> Density:
        """The punch."""

    @property
    def P(self) -> float:
        """Force ∫₋ₐᵃ F dt [N]."""
        a, F_a, dF_a, ddF, _ = self.density()
        return 2 * a * (F_a - a * dF_a / 2 + a**2 * ddF / 6)

    def displacement(self, points: ArrayLike) -> Floats:
        """(u_r, u_z) at (n, 2) or (u_x, u_y, u_z) at (n, 3) points, of the same shape [m]."""
        points = as_points(points, 2, 3)
        r, z = self._cylindrical(points)
        d = self._derivatives(r, z)
        ur_r = -(1 - 2 * self.nu) * d.chi_r_r - vanishing_product(z, d.psi_r) / r
        uz = 2 * (1 - self.nu) * d.psi - vanishing_product(z, d.psi_z)
        return np.column_stack([points[:, :-1] * ur_r[:, None], uz]) / (4 * np.pi * self.G)

    def displacement_gradient(self, points: ArrayLike) -> Floats:
        """∂u_i/∂x_j: (n, 2, 2) in the (r, z) plane, where u_r/r is the hoop strain besides, or (n, 3, 3)."""
        points = as_points(points, 2, 3)
        r, z = self._cylindrical(points)
        d = self._derivatives(r, z)
        nu, psi_r_r = self.nu, d.psi_r / r
        hoop = -(1 - 2 * nu) * d.chi_r_r - vanishing_product(z, psi_r_r)
        rr = (1 - 2 * nu) * (d.chi_r_r + d.psi_z) + vanishing_product(z, psi_r_r + d.psi_zz)
        rz = -2 * (1 - nu) * d.psi_r - vanishing_product(z, d.psi_rz)
        zr = 2 * (1 - nu) * d.psi_r - vanishing_product(z, d.psi_rz)
        zz = (1 - 2 * nu) * d.psi_z - vanishing_product(z, d.psi_zz)
        if points.shape[1] == 2:
            gradient = np.stack([rr, rz, zr, zz], axis=-1).reshape(-1, 2, 2)
        else:
            n = points[:, :2] / r[:, None]
            gradient = np.zeros((len(points), 3, 3))
            gradient[:, :2, :2] = np.einsum("p,ij->pij", hoop, np.eye(2))
            gradient[:, :2, :2] += np.einsum("p,pi,pj->pij", rr - hoop, n, n)
            gradient[:, :2, 2] = rz[:, None] * n
            gradient[:, 2, :2] = zr[:, None] * n
            gradient[:, 2, 2] = zz
        return gradient / (4 * np.pi * self.G)

    def stress(self, points: ArrayLike) -> Floats:
        """σ_rr, σ_zz, σ_θθ, σ_rz at points (r, z) of shape (n, 2), shape (n, 4) [Pa]."""
        r, z = self._cylindrical(as_points(points, 2))
        d = self._derivatives(r, z)
        nu, psi_r_r = self.nu, d.psi_r / r
        rr = (1 - 2 * nu) * (d.chi_r_r + d.psi_z) + vanishing_product(z, psi_r_r + d.psi_zz) + 2 * nu * d.psi_z
        hoop = -(1 - 2 * nu) * d.chi_r_r - vanishing_product(z, psi_r_r) + 2 * nu * d.psi_z
        zz = d.psi_z - vanishing_product(z, d.psi_zz)
        return np.stack([rr, zz, hoop, -vanishing_product(z, d.psi_rz)], axis=-1) / (2 * np.pi)

    def _cylindrical(self, points: Floats) -> tuple[Floats, Floats]:
        """r and z; the axis is taken as the limit r → 0, where r² underflows, and z = -rounding as 0."""
        r, z = np.hypot.reduce(points[:, :-1], axis=1), points[:, -1]
        if np.any(z < -1e-9 * self.density().a):
            raise ValueError(f"z = {z.min()}: must be >= 0, the body is the half-space above z = 0")
        return np.maximum(r, 1e-150), np.maximum(z, 0.0)

    def _derivatives(self, r: Floats, z: Floats) -> Derivatives:
        a, F_a, dF_a, ddF, dF_0 = self.density()
        # The factors' principal branches give D → i√(a²−r²) as z → 0+ inside the contact, and no cancellation at r = a.
        D: Complexes = np.sqrt(z + 1j * (a + r)) * np.sqrt(z + 1j * (a - r))
        with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
            edge = _primitives(r, z + 1j * a, D)
            axis = _primitives(r, z, np.hypot(r, z)) if dF_0 else None

            def integral(chain: int, k: int) -> Floats:
                g1, g2, g3 = edge[chain][k : k + 3]
                value: Floats = (dF_a * g2 + 1j * ddF * g3).real
                if F_a:
                    value = value + F_a * g1.imag
                if axis is not None:  # all primitives are real at t = 0, so that only the kink's term survives there
                    value = value - dF_0 * axis[chain][k + 1].real
                return 2 * value

            return Derivatives(
                psi=integral(0, 2),
                psi_r=r * integral(1, 1),
                psi_z=integral(0, 1),
                psi_rz=r * integral(1, 0),
                psi_zz=integral(0, 0),
                chi_r_r=integral(1, 2),
            )


def _primitives(r: Floats, zeta: NDArray[Any], D: NDArray[Any]) -> tuple[list[NDArray[Any]], list[NDArray[Any]]]:
    """Two chains, each entry the ζ-derivative of the next: from ∂(1/D)/∂ζ, and from (1/r) ∂(1/D)/∂r."""
    sum_ = zeta + D
    log = np.log(sum_)
    log_once = zeta * log - D
    plain = [-zeta / D**3, 1 / D, log, log_once, (0.5 * zeta**2 - 0.25 * r**2) * log - 0.75 * zeta * D]
    radial = [
        -1 / D**3,
        1 / (D * sum_),
        -1 / sum_,
        -0.5 * (zeta / sum_ + log),
        -0.5 * ((D**2 + D * zeta + zeta**2) / (3 * sum_) + log_once),
    ]
    return plain, radial
