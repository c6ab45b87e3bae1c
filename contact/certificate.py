"""The certificate of a step: residuals recomputed from the forces and the distances of its final state."""

from __future__ import annotations

from dataclasses import asdict, dataclass

import numpy as np
from numpy.typing import NDArray

from contact.linearisation import Linearisation
from contact.system import System

Floats = NDArray[np.float64]

ROUNDING = 1e-7  # of the size: 1e-8 of that is the round-off of positions, below which gaps mean nothing
LOADED = 1e-8  # a contact whose force moves less than this part of ℓ does not count as active


@dataclass(frozen=True)
class Tolerances:
    """What each residual of a certificate may be at most."""

    complementarity: float = 1e-8
    equilibrium: float = 1e-8
    surface_error: float = 1e-3
    penetration: float = 1e-3


@dataclass(frozen=True)
class Certificate:
    """Scale-free residuals of a state with contact forces λ and true gaps δ.

    complementarity : max|min(D_i λ_i, δ_i)| / ℓ with ℓ = max(max(−δ_f)₊, max|δ − δ_f|, 1e-7 × size), D = diag W
    equilibrium : the worst body's ‖f_int − f_ext − Hᵀλ‖ / (‖f_int‖ + ‖f_ext‖ + ‖Hᵀλ‖)
    surface_error : the largest |δ_i| of active contacts, D_i |λ_i| > 1e-8 ℓ, over the body's size or device's radius
    penetration : the deepest −δ_i, over the same
    """

    complementarity: float
    equilibrium: float
    surface_error: float
    penetration: float

    def within(self, tolerances: Tolerances) -> bool:
        """Whether every residual is finite and at most its tolerance."""
        return (
            self.complementarity <= tolerances.complementarity
            and self.equilibrium <= tolerances.equilibrium
            and self.surface_error <= tolerances.surface_error
            and self.penetration <= tolerances.penetration
        )

    def beyond(self, tolerances: Tolerances) -> str:
        """The residuals above their tolerances, in words."""
        values, limits = asdict(self), asdict(tolerances)
        return ", ".join(f"{name} {value:.3g}" for name, value in values.items() if not value <= limits[name])

    @property
    def residual(self) -> float:
        """The larger of the two residuals that passes bring down."""
        return max(self.complementarity, self.equilibrium)


def certify(
    system: System, lin: Linearisation, lam: Floats, free_gaps: Floats, present: Linearisation | None = None
) -> Certificate:
    """The certificate of the system's present state with forces `lam` on all constraints. Collective.

    `lin` is the linearisation that was solved, on whose rows alone there are forces; `present` the one about the
    present state, along whose normals they act, which may be left out where constraints do not follow the motion.
    `free_gaps` are δ_f on those rows. W_ii = 0 (rigid bodies only) is replaced by ℓ / max λ, so that a force on an open
    gap shows there too; where a method never formed W_ii, the whole gap counts.
    """
    present = present or lin
    gaps, forces = system.gaps(), lam[lin.rows]
    active = np.flatnonzero(forces)  # a force below zero is an error, not an open contact
    forces, delta, surface_error = forces[active], gaps[lin.rows[active]], 0.0
    lowest, least_free = float(gaps[lin.movable].min(initial=0.0)), float(free_gaps.min(initial=0.0))
    moved = float(np.abs(delta - free_gaps[active]).max(initial=0.0))
    length = max(-lowest, -least_free, moved, ROUNDING * system.size)
    complementarity, sizes = -lowest, present.length
    if active.size:
        pull = np.maximum(lin.W.diagonal(active), length / np.abs(forces).max()) * forces
        complementarity = max(complementarity, float(np.abs(np.minimum(pull, delta)).max()))
        # A method that stops inside λ > 0 leaves forces of round-off on open gaps; complementarity counts those.
        errors = np.abs(delta / (sizes[lin.rows[active]] if sizes.ndim else sizes))
        surface_error = float(errors[np.abs(pull) > LOADED * length].max(initial=0.0))
    equilibrium = max((b.imbalance(present.free[b].apply_transpose(lam)) for b in system.bodies), default=0.0)
    penetration = -float((gaps / sizes).min(initial=0.0))
    return Certificate(complementarity / length, equilibrium, surface_error, penetration)
