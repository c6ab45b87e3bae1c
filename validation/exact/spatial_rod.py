"""The geometrically exact rod in space as a boundary-value problem: a clamped arc under a dead tip force."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike
from scipy.integrate import solve_bvp
from scipy.spatial.transform import Rotation

from validation.exact.common import Floats, finite, positive

LOAD_STEPS = 8
NODES = 33
TOLERANCE = 1e-9

Field = Callable[[Floats], Floats]


@dataclass(frozen=True, kw_only=True)
class ArcRod:
    """A circular arc in the x-y plane, clamped at the origin with its tangent along y and its centre at (R, 0, 0).

    Directors (t, d₂, d₃) = columns of Q, at rest d₂ towards the centre and d₃ = t×d₂ = −z; the tip's force F is dead:
    x′ = Q (e₁ + diag(1/EA, 1/GA, 1/GA) Qᵀ F),  Q′ = Q κ̂,  κ = (0, 0, 1/R) + diag(1/GJ, 1/EI, 1/EI) Qᵀ m,
    m′ = −x′×F,  m(L) = 0,  0 <= ξ <= L = R·angle.
    Q is a unit quaternion; `solve_bvp` on the ten unknowns, the load raised in equal steps.

    Parameters
    ----------
    EI, GJ : bending (both ways) and torsional stiffness [N m²]
    R : radius of the arc [m]
    angle : its opening [rad]
    Fx, Fy, Fz : tip force [N]
    EA, GA : axial and shear stiffness [N]; infinite if not given

    Raises
    ------
    ValueError : a parameter outside its range.
    RuntimeError : `solve_bvp` does not converge.

    Checked: by shooting with an explicit integrator of eighth order and rotation matrices; by three tolerances; a
    straight limit by `elastica.CantileverElastica`.
    Source: Simo & Vu-Quoc, Comput. Methods Appl. Mech. Eng. 58 (1986) 79.
    """

    EI: float
    GJ: float
    R: float
    angle: float
    Fx: float = 0.0
    Fy: float = 0.0
    Fz: float = 0.0
    EA: float = np.inf
    GA: float = np.inf

    def __post_init__(self) -> None:
        positive(EI=self.EI, GJ=self.GJ, R=self.R, angle=self.angle)
        finite(Fx=self.Fx, Fy=self.Fy, Fz=self.Fz)
        for name, value in {"EA": self.EA, "GA": self.GA}.items():
            if not value > 0:
                raise ValueError(f"{name} = {value}: must be > 0 (infinite is allowed)")

    @classmethod
    def bathe_bolourchi(cls, *, P: float, E: float = 1e7, R: float = 100.0, side: float = 1.0) -> ArcRod:
        """The 45° bend of square section, ν = 0, with the force P out of its plane.

        EI = E side⁴/12, GJ = G side⁴/6, EA = E side², GA = G side² with G = E/2: the polar moment for torsion and no
        shear correction, as Simo & Vu-Quoc took them (Saint-Venant's torsion of a square would have .1406 for 1/6).
        """
        EI, EA = E * side**4 / 12, E * side**2
        return cls(EI=EI, GJ=EI, EA=EA, GA=EA / 2, R=R, angle=np.pi / 4, Fz=P)

    @property
    def L(self) -> float:
        """Length of the arc [m]."""
        return self.R * self.angle

    @property
    def tip(self) -> Floats:
        """Position of the tip, shape (3) [m]."""
        tip: Floats = self.position(self.L)[0]
        return tip

    @property
    def tip_frame(self) -> Floats:
        """t, d₂, d₃ of the tip as columns, shape (3, 3)."""
        frame: Floats = _rotation(self._solution(np.array([1.0]))[3:7])[0]
        return frame

    @property
    def clamp_moment(self) -> Floats:
        """m(0), of the rod beyond on the clamp's section, shape (3) [N m]."""
        return self.EI / self.L * self._solution(np.array([0.0]))[7:, 0]

    def position(self, xi: ArrayLike) -> Floats:
        """x(ξ) at arc lengths ξ, shape (n, 3) [m]."""
        return self.L * self._solution(np.atleast_1d(np.asarray(xi, dtype=float)) / self.L)[:3].T

    def _solution(self, s: Floats) -> Floats:
        return self._interpolant(s)

    @cached_property
    def _interpolant(self) -> Field:
        return self.solve(TOLERANCE)

    def solve(self, tolerance: float) -> Field:
        """The spline of (x/L, quaternion, mL/EI) over ξ/L; |residual| <= tolerance relative to the derivatives."""
        s = np.linspace(0, 1, NODES)
        phi = s * self.angle
        at_rest = _quaternion(_arc_frame(phi))
        arc = [(1 - np.cos(phi)) / self.angle, np.sin(phi) / self.angle, 0 * s]
        y = np.vstack([arc, at_rest, np.zeros((3, NODES))])
        clamp = at_rest[:, 0]

        def ends(start: Floats, end: Floats) -> Floats:
            return np.concatenate([start[:3], start[3:7] - clamp, end[7:]])

        for step in range(1, LOAD_STEPS + 1):
            result = solve_bvp(self._equations(step / LOAD_STEPS), ends, s, y, tol=tolerance, max_nodes=20000)
            if not result.success:
                raise RuntimeError(f"solve_bvp at {step}/{LOAD_STEPS} of the load: {result.message}")
            s, y = result.x, result.y
        spline: Field = result.sol
        return spline

    def _equations(self, fraction: float) -> Callable[[Floats, Floats], Floats]:
        force = fraction * np.array([self.Fx, self.Fy, self.Fz])
        unit = force * self.L**2 / self.EI
        give = np.array([1 / self.EA, 1 / self.GA, 1 / self.GA])
        flexibility = np.array([self.EI / self.GJ, 1.0, 1.0])

        def rhs(_: Floats, y: Floats) -> Floats:
            Q = _rotation(y[3:7])
            stretch = np.array([1.0, 0, 0]) + give * (force @ Q)
            slope = np.einsum("nij,nj->ni", Q, stretch)
            kappa = flexibility * np.einsum("nji,jn->ni", Q, y[7:]) + np.array([0, 0, self.angle])
            return np.vstack([slope.T, _spin(y[3:7], kappa.T), -np.cross(slope, unit).T])

        return rhs


def _arc_frame(phi: Floats) -> Floats:
    """Directors of the arc at rest, (n, 3, 3)."""
    s, c, o = np.sin(phi), np.cos(phi), 0 * phi
    return np.stack([np.stack(d, axis=-1) for d in ([s, c, o], [c, -s, o], [o, o, o - 1])], axis=-1)


def _quaternion(Q: Floats) -> Floats:
    """Unit quaternions (x, y, z, w) of rotations (n, 3, 3), shape (4, n), continuous along n."""
    q = Rotation.from_matrix(Q).as_quat()
    flips = np.cumprod(np.where(np.sum(q[1:] * q[:-1], axis=1) < 0, -1, 1))
    q[1:] *= flips[:, None]
    return np.ascontiguousarray(q.T)


def _rotation(q: Floats) -> Floats:
    """Rotations (n, 3, 3) of quaternions (4, n)."""
    Q: Floats = Rotation.from_quat(q.T).as_matrix()
    return Q


def _spin(q: Floats, kappa: Floats) -> Floats:
    """q′ = ½ q ⊗ (κ, 0) for directors' components κ, shapes (4, n) and (3, n)."""
    v, w = q[:3], q[3]
    return 0.5 * np.vstack([w * kappa + np.cross(v.T, kappa.T).T, -np.sum(v * kappa, axis=0)])
