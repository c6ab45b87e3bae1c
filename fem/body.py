"""A deformable body: its unknowns, its forces, and its motion in a step."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property
from typing import Any, Self

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from fem.factor import Factor
from fem.foundation import Foundation, OnFoundation
from fem.inertia import Dynamics, Inertia
from fem.integrators import Integrator, Static
from fem.iteration_matrix import IterationMatrices
from fem.loads import Load, Support, evaluate, external_forces
from fem.model import Model
from fem.rigid import floating_modes, pin, rigid_modes
from fem.space import Space
from fem.supports import Supports

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]
SURFACE = "surface"
ROUNDING = 20 * float(np.finfo(float).eps) / 1e-8


class Body:
    """A linear body: A u = b with A = inertia M + damping B + K, factorised once for each time step; K in statics.

    Parameters
    ----------
    name : names it in scenes, messages and records
    space, model : unknowns and material
    frame : (components, D), the direction in space of each displacement component; None where they are the axes
    supports, loads : what holds it (rigidly, or as a `Foundation`, by springs) and what acts on it
    density, mass, rayleigh, velocity, displacement : what it brings to dynamics, see `fem.inertia.Dynamics`

    Attributes
    ----------
    u : local unknowns (ghosts included), displacements [m] then pressures [Pa]
    v : their rates at the start of the step, owned; None in statics
    load : f_ext at the owned unknowns [N]
    inertia : its mass; None in statics, and for a body without density

    Creating, updating and solving are collective on the body's communicator; close it to destroy its PETSc objects.
    """

    linear = True
    definite = True  # on what supports or contacts hold
    radius: Floats | None = None  # of a beam's elements

    def __init__(
        self,
        name: str,
        space: Space,
        model: Model,
        supports: Sequence[Support | Foundation] = (),
        loads: Sequence[Load] = (),
        frame: Floats | None = None,
        **dynamics: Any,
    ) -> None:
        self.name, self.space, self.model = name, space, model
        self.supports, self.loads = [s for s in supports if isinstance(s, Support)], list(loads)
        self.frame = np.eye(space.dim) if frame is None else np.asarray(frame, dtype=float)
        if len(self.frame) != space.components:
            raise ValueError(f"body {name!r}: frame has {len(self.frame)} directions for {space.components} components")
        if (space.components != space.dim or space.dim == 1) and any(load.kind == "pressure" for load in self.loads):
            raise ValueError(f"body {name!r}: kind = 'pressure': only a solid has a pressure on its sides")
        inmost = space.comm.allreduce(float(space.piece.points[:, 0].min(initial=0.0)), op=min)
        if model.axisymmetric and inmost < -1e-12 * self.size:
            raise ValueError(f"body {name!r}: its mesh reaches r = {inmost:.6g}: must be r >= 0 in axisymmetry")
        try:
            self._dynamics = Dynamics(**dynamics)
        except ValueError as error:
            raise ValueError(f"body {name!r}: {error}") from None
        self.u = self._nodal_field("displacement", self._dynamics.displacement)
        self.v: Floats | None = None
        # In dynamics u = u_n + moved: taken as a difference of positions it would lose the digits of slow motions.
        self._u_n, self._moved = self.owned(self.u), np.zeros(space.owned)
        self._free: tuple[Floats, Floats] | None = None
        self._massless = np.empty(0, dtype=np.int64)
        self.integrator: Integrator = Static()
        self.inertia: Inertia | None = None
        self.load = np.zeros(space.owned)
        self._loaded_at: float | None = None
        self._supports = Supports(name, space, self.facets, self.supports)
        self.fixed = self._supports.fixed
        R = self.rigid_modes()
        resisted = np.zeros((R.shape[1], R.shape[1]))
        if springs := [s for s in supports if isinstance(s, Foundation)]:
            self.model = founded = OnFoundation(name, model, space, springs, self.facets)
            resisted = founded.gram(space, R)
        self.modes = floating_modes(space.comm, R, self.fixed, resisted)
        self.pins = pin(space.comm, self.modes)
        self._matrices = IterationMatrices(space, R)
        self._factor: Factor | None = None

    @property
    def comm(self) -> Any:
        """The communicator."""
        return self.space.comm

    @property
    def deformable(self) -> bool:
        """Whether forces move it by A⁻¹."""
        return True

    def rigid_modes(self) -> Floats:
        """The motions without strain at the owned unknowns, (owned, m)."""
        return rigid_modes(self.space, self.model.axisymmetric)

    # --- geometry -------------------------------------------------------------------------------------------------

    @property
    def points(self) -> Floats:
        """Undeformed positions of the local nodes in space, (nodes, D) [m]."""
        X = self.space.piece.points
        D = self.frame.shape[1]
        return np.hstack([X, np.zeros((len(X), D - X.shape[1]))])

    @property
    def displacement(self) -> Floats:
        """Displacements of the local nodes in space, (nodes, D) [m]."""
        return self._in_space(self.u)

    @property
    def velocity(self) -> Floats:
        """Velocities of the local nodes in space, (nodes, D) [m/s]; zero in statics."""
        return self._in_space(np.zeros_like(self.u) if self.v is None else self.space.local(self.v))

    def _in_space(self, local: Floats) -> Floats:
        return local[self.space.displacements].reshape(-1, self.space.components) @ self.frame

    def _nodal_field(self, key: str, value: Any) -> Floats:
        """Local unknowns with `value`, or value(x, 0), as displacements."""
        wanted = f"body {self.name!r}: {key} = {value!r}: must"
        try:
            field = evaluate(value, self.space.piece.points, 0.0, self.space.components)
        except ValueError:
            raise ValueError(f"{wanted} give {self.space.components} components") from None
        local = np.zeros(len(self.space.local_dofs))
        local[self.space.displacements] = field.ravel()
        if not self.space.comm.allreduce(bool(np.isfinite(local).all()), op=min):
            raise ValueError(f"{wanted} be finite")
        return local

    @cached_property
    def size(self) -> float:
        """The body's largest extent [m]."""
        X = self.space.piece.points
        low = self.space.comm.allreduce(X.min(axis=0, initial=np.inf), op=np.minimum)
        high = self.space.comm.allreduce(X.max(axis=0, initial=-np.inf), op=np.maximum)
        return float((high - low).max())

    def facets(self, tag: str) -> Ints:
        """Local nodes of the facets that carry `tag` on this rank, (f, k).

        A body that moves across its own plane (string, membrane) touches with its cells, under the tag ``surface``.
        """
        if tag == SURFACE and self.frame.shape[1] > self.space.dim:
            cells: Ints = self.space.piece.cells
            return cells
        if tag not in self.space.piece.facets:
            known = ", ".join(sorted(self.space.piece.facets)) or "none"
            raise ValueError(f"body {self.name!r}: its mesh has no tag {tag!r} (it has: {known})")
        facets: Ints = self.space.piece.facets[tag]
        return facets

    # --- the step -------------------------------------------------------------------------------------------------

    def begin(self, t: float, integrator: Integrator) -> None:
        """Start a step that ends at time t [s]: supports and loads where forces balance; the free motion is forgotten.

        Raises
        ------
        ValueError
            where a support or load is not finite.
        """
        self.integrator, self._free = integrator, None
        if integrator.inertia and self.v is None:
            self._start_moving(self._first_velocity())
        self._factor = self._matrices.find(self._multiples)
        t = integrator.load_time(t)
        self._prescribe(t)
        if self._loaded_at is None or (self._loaded_at != t and any(callable(load.value) for load in self.loads)):
            cells = self.space.piece.cells
            loads = [(load, cells if load.tag is None else self.facets(load.tag)) for load in self.loads]
            self.load = external_forces(self.space, self.model.axisymmetric, loads, t)
            self._loaded_at = t
        finite = np.isfinite(self.u).all() and np.isfinite(self.load).all()
        if not self.space.comm.allreduce(bool(finite), op=min):
            raise ValueError(f"body {self.name!r}: a support or load is not finite at t = {t:.6g}")

    def _prescribe(self, t: float) -> None:
        if self.supports:
            self.u = self.space.local(self._supports.prescribe(self.coordinates(), t))

    def renew(self, cautious: bool = False) -> None:
        """Let A be formed anew about the present state: nothing, as it does not depend on that."""

    def _first_velocity(self) -> Floats:
        """The velocity at t = 0 of the owned unknowns; the body is brought to where its supports are then."""
        # The midpoint rule never forgets a wrong velocity of a support: it is that of the first balance.
        t = 1 / self.integrator.damping
        self._prescribe(t)
        after = self.coordinates()
        self._prescribe(0.0)
        self._u_n = self.coordinates()
        start = self.owned(self._nodal_field("velocity", self._dynamics.velocity))
        return np.where(self.fixed, (after - self._u_n) / t, start)

    def _start_moving(self, v: Floats) -> None:
        """Take what dynamics needs: velocities, mass; a body with mass is not floating, as A is regular."""
        self.v = v
        if not self._dynamics.density:
            return
        self.inertia = Inertia(self.space, self.model.axisymmetric, self._dynamics)
        self.modes, self.pins = self.modes[:, :0], self.pins[:0]
        if self.space.comm.allreduce(len(self._massless)):
            try:
                self.inertia.redistribute(self._massless)
            except ValueError as error:
                raise ValueError(f"body {self.name!r}: {error}") from None

    def redistribute(self, nodes: Ints) -> None:
        """Let local `nodes` that may touch carry no mass, as `Midpoint` wants them; before the first step."""
        self._massless = np.union1d(self._massless, nodes)

    def free_motion(self, contact: Floats | None = None) -> None:
        """u ← u₀ + A⁻¹ (f_ext − forces(u₀)), the motion without contact, plus A⁻¹ of `contact` forces (owned) [N].

        In statics u₀ has the present rigid motion and prescribed displacements only: round-off of the last shape would
        stay. In dynamics it is the motion without acceleration. Solved once a step. Collective.
        """
        if self._free is None:
            u = self.coordinates()
            moved = self._rest(u) - self._u_n if self.inertia is None else self._coast()
            self._moved = np.where(self.fixed, u - self._u_n, moved)
            self.u = self.space.local(np.where(self.fixed, u, self._u_n + moved))
            self.correct(self.solve(self.residual()[:, None])[:, 0])
            self._free = self.u, self._moved
        self.u, self._moved = self._free
        if contact is not None:
            self.correct(self.solve(contact[:, None])[:, 0])

    def _rest(self, u: Floats) -> Floats:
        """The rigid motion in u, of a floating body."""
        comm = self.space.comm
        gram = comm.allreduce(self.modes.T @ self.modes)
        along = comm.allreduce(self.modes.T @ np.where(self.fixed, 0.0, u))
        rest: Floats = self.modes @ np.linalg.solve(gram, along)
        return rest

    def _coast(self) -> Floats:
        """The displacement in this step without acceleration."""
        assert self.v is not None
        return self.integrator.damping / self.integrator.inertia * self.v

    def correct(self, increment: Floats) -> None:
        """Add an increment, given at the owned unknowns."""
        self.u, self._moved = self.u + self.space.local(increment), self._moved + increment

    def add(self, increment: Floats) -> None:
        """Add an increment to the unknowns."""
        self.correct(increment)

    def accept(self) -> None:
        """End the step: u and v as the integrator has them; nothing in statics."""
        if self.v is None:
            return
        moved, self.v = self.integrator.advance(self._moved, self.v)
        self._u_n = self._u_n + moved
        self.u = self.space.local(self._u_n)

    def state(self) -> tuple[Floats, ...]:
        """What a rejected step must give back."""
        return (self.u, self._u_n, self._moved) if self.v is None else (self.u, self._u_n, self._moved, self.v)

    def restore(self, state: tuple[Floats, ...]) -> None:
        """Return to a `state`."""
        self.u, self._u_n, self._moved, *rates = state
        self.v = rates[0] if rates else None

    def checkpoint(self) -> dict[str, Floats]:
        """Owned values of an accepted state: `x`, and in dynamics `v`."""
        x = {"x": self.coordinates()}
        return x if self.v is None else {**x, "v": self.v.copy()}

    def resume(self, values: dict[str, Floats]) -> None:
        """Go on from a `checkpoint`. Collective."""
        if "v" in values:
            self._start_moving(np.array(values["v"]))
        self._u_n = np.array(values["x"])
        self.u = self.space.local(self._u_n)

    def energy(self) -> dict[str, float]:
        """`kinetic` ½ v·M v and `strain` ½ u·f_int(u) of an accepted state [J]. Collective."""
        strain = float(self.coordinates() @ self.internal_forces()) / 2
        M, v = self.inertia, self.v
        kinetic = 0.0 if M is None or v is None else float(v @ M.forces(v)) / 2
        kinetic, strain = self.space.comm.allreduce(np.array([kinetic, strain])).tolist()
        return {"kinetic": kinetic, "strain": strain}

    # --- forces and solves ----------------------------------------------------------------------------------------

    def owned(self, local: Floats) -> Floats:
        """The entries of a local vector that this rank owns."""
        owned, mine = np.empty(self.space.owned), self.space.local_dofs - self.space.first
        inside = (mine >= 0) & (mine < self.space.owned)
        owned[mine[inside]] = local[inside]
        return owned

    def coordinates(self) -> Floats:
        """The owned unknowns u, in which constraints are linear."""
        return self.owned(self.u)

    def internal_forces(self, u: Floats | None = None) -> Floats:
        """f_int(u), of the present u if none, at the owned unknowns [N]: from the cells' stresses, not from A."""
        piece, u = self.space.piece, self.u if u is None else u
        return self.space.sum_cells(self.model.forces(piece.points, piece.cells, u[self.space.cell_dofs]))

    def _forces(self) -> tuple[Floats, Floats]:
        """Internal forces with the damping b K v, and inertia with the damping a M v, at the owned unknowns [N]."""
        if self.inertia is None or self.v is None:
            return self.internal_forces(), np.zeros(self.space.owned)
        velocity = self.integrator.damping * self._moved
        acceleration = self.integrator.inertia * self._moved - self.integrator.damping * self.v
        strained = self.u + self.space.local(self.inertia.b * velocity) if self.inertia.b else self.u
        return self.internal_forces(strained), self.inertia.forces(acceleration + self.inertia.a * velocity)

    def residual(self) -> Floats:
        """f_ext − f_int(u) − inertia at the owned unknowns, zero where displacements are prescribed."""
        inner, inertia = self._forces()
        return np.where(self.fixed, 0.0, self.load - inner - inertia)

    @property
    def held(self) -> NDArray[np.bool_]:
        """Owned unknowns that A does not move: the prescribed ones and the pins of a floating body."""
        held = self.fixed.copy()
        held[self.pins] = True
        return held

    def imbalance(self, contact: Floats) -> float:
        """‖f_int + inertia − f_ext − Hᵀλ‖ of free unknowns over the sum of norms, for forces Hᵀλ. Collective."""
        inner, inertia = self._forces()
        rest = np.where(self.fixed, 0.0, inner + inertia - self.load - contact)
        # Where a body moves as a whole its forces are round-off of positions, not to be measured against themselves:
        # with this floor a residual within the default tolerance of 1e-8 is at most 20 eps ‖A‖ × size.
        moved = self.coordinates()[: self.space.components * self.space.piece.owned]
        length = max(self.size, float(np.sqrt(self.space.comm.allreduce(float(moved @ moved)))))
        forces = (self._matrices.unit * f for f in (rest, inner, inertia, self.load, contact))
        return self._ratio(*forces, least=ROUNDING * (self._factor.scale if self._factor else 0.0) * length)

    def _ratio(self, rest: Floats, *forces: Floats, least: float = 0.0) -> float:
        squares = self.space.comm.allreduce(np.array([v @ v for v in (rest, *forces)]))
        rest_norm, *norms = np.sqrt(squares)
        scale = max(sum(norms), least)
        return float(rest_norm / scale) if scale > 0 else 0.0

    @property
    def _multiples(self) -> tuple[float, float]:
        """The multiples of M and K in A, without the round-off in dt = t_{n+1} − t_n that would make each step new."""
        if self.inertia is None:
            return 0.0, 1.0
        m, k = self.inertia.factors(self.integrator)
        return float(f"{m:.10g}"), float(f"{k:.10g}")

    @property
    def _solver(self) -> Factor:
        assert self._factor is not None, "begin, assemble and factor come before a solve"
        return self._factor

    @property
    def A(self) -> Any:
        """The matrix of the present step; None before it is assembled."""
        return self._factor and self._factor.A

    @property
    def _ksp(self) -> Any:
        return self._factor and self._factor.ksp

    def assemble(self) -> None:
        """Form A, with unit rows where displacements are prescribed or pinned, unless that of this step is kept."""
        self._factor = self._matrices.form(self._multiples, self.model, self.inertia, self.held)

    def factor(self) -> None:
        """Set up the solver of A, unless it is kept: a factorisation, or what ``-free_ksp_…`` ask for."""
        self._solver.setup()

    def solve(self, B: Floats) -> Floats:
        """X = A⁻¹ B for a block of right-hand sides at the owned unknowns, (owned, k). Collective."""
        return self._solver.solve(B)

    def solve_rows(self, H: sp.csr_array) -> Floats:
        """X = A⁻¹ Hᵀ for sparse rows H on displacements that A moves, (owned, k). Collective."""
        return self._solver.solve_rows(H)

    def close(self) -> None:
        """Destroy the matrices and the solvers. Collective."""
        self._matrices.close()
        self._factor = None
        self.space.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *error: object) -> None:
        self.close()
