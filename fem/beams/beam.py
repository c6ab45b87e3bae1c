"""A beam as a body: large rotations, one block-tridiagonal iteration matrix, factorised as often as it changes."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Self

import numpy as np
from mpi4py import MPI
from numpy.typing import NDArray

from fem.beams import beam_kernels as kernels
from fem.beams import frame_kernels, nodal_kernels
from fem.beams.beam_element import BeamData, least_force
from fem.beams.beam_parts import BeamInertia, BeamLoads, ChainSpace, Drive, Line, Motion, unheld
from fem.beams.chain import matrix_of
from fem.integrators import Integrator, Static

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]
Bools = NDArray[np.bool_]

# The largest rotation [rad] and displacement [radii, or elements of a beam without radius] of a node in one pass.
TURN, SHIFT = 0.3, 4.0


class Beam:
    """A chain of beam elements: A d = f_ext − f_int − inertia about its present configuration.

    Unknowns are, node by node, increments of position and spatial spins (dx, dθ): x ← x + dx, R ← exp(dθ) R. Every rank
    holds all of a beam and computes the same.

    Parameters
    ----------
    name : names it in scenes, messages and records
    x, R : nodes (N, 3) [m] and their frames (N, 3, 3), columns t, d₂, d₃, where the run starts
    data : rest shape and stiffness of the elements
    radius : outer radius of each element, (N − 1) [m]
    drives, loads : what holds it and what acts on it
    inertia : None in statics

    Attributes
    ----------
    u : the free increment d about the present configuration, (6 N)
    """

    deformable = True
    linear = False
    model = None

    def __init__(
        self,
        name: str,
        x: Floats,
        R: Floats,
        data: BeamData,
        radius: Floats,
        drives: Sequence[Drive] = (),
        loads: BeamLoads | None = None,
        inertia: BeamInertia | None = None,
    ) -> None:
        self.name, self.data, self.radius = name, data, radius
        self.drives, self.loads, self.inertia = list(drives), loads or BeamLoads(), inertia
        n = len(x)
        self.space, self.comm = ChainSpace(Line(x.copy())), MPI.COMM_SELF
        self.start, self.start_frames = x.copy(), R.copy()
        self.x, self.R, self.edges = x.copy(), R.copy(), np.diff(x, axis=0)
        self.v = np.tile(np.array(inertia.velocity if inertia else (0.0, 0.0, 0.0)), (n, 1))
        self.w = np.zeros((n, 3))
        self.u = np.zeros(6 * n)
        self.load = np.zeros(6 * n)
        self._line: Floats | None = None
        self.fixed = np.zeros(6 * n, dtype=bool)
        for drive in self.drives:
            self.fixed[6 * drive.node + np.array(drive.components, dtype=int)] = True
        self.modes = np.zeros((6 * n, 0))
        self.size = float(np.ptp(x, axis=0).max())
        self._history = self.state()
        # x − x_n; as a difference of positions it would lose the digits of short steps.
        self._increments = np.zeros_like(x)
        self._J = np.zeros_like(R)  # the spatial inertia of the nodes at the start of a step
        self._integrator: Integrator = Static()
        self._damped = data
        self._stress: Floats | None = None  # to form A with, where it is not that of the configuration
        self._extra: list[tuple[Ints, Floats]] = []
        self._forces: tuple[Floats, Floats] | None = None
        self._fresh = self._factorised = False
        self.matrix = matrix_of(self.fixed)
        # Moments are measured against forces by an element's length.
        self.reach = float(radius.max()) or float(data.length.max())
        self.unit = np.tile(np.repeat([1.0, 1 / float(data.length.mean())], 3), n)
        free = unheld(x, self.fixed, self.size) if inertia is None else 0
        if free:
            raise ValueError(
                f"body {name!r}: {free} rigid motion(s) that no support holds; "
                "add supports, or a density and an integrator in time"
            )

    # --- state ----------------------------------------------------------------------------------------------------

    @property
    def A(self) -> Any:
        """The iteration matrix as a PETSc matrix."""
        return self.matrix.A

    @property
    def definite(self) -> bool:
        """Whether the factor has shown A to be positive definite."""
        return self.matrix.definite

    @property
    def held(self) -> Bools:
        """The unknowns that A does not move."""
        return self.fixed

    def state(self) -> Motion:
        """What a rejected step must give back; whatever moves the beam makes new arrays."""
        return Motion(self.x, self.R, self.edges, self.v, self.w)

    def restore(self, state: Sequence[Floats]) -> None:
        """Return to a `state`."""
        self.x, self.R, self.edges, self.v, self.w = state
        self._increments = np.zeros_like(self.x)
        self._moved()

    def checkpoint(self) -> dict[str, Floats]:
        """The state by names, for a record."""
        return self.state()._asdict()

    def resume(self, saved: dict[str, Floats]) -> None:
        """Take up a `checkpoint`; ValueError where it is another beam's."""
        if saved.get("x", np.empty(0)).shape != self.x.shape:
            raise ValueError(f"resume: the record's body {self.name!r} has another number of nodes than the scene's")
        self.restore(Motion(*(np.array(saved[key], dtype=float, order="C") for key in Motion._fields)))

    def coordinates(self) -> Floats:
        """The free increment, in which constraints are linear."""
        return self.u

    def trial(self) -> tuple[Floats, Floats]:
        """Nodes and frames after the free increment."""
        if not self.u.any():
            return self.x, self.R
        x, R, _ = frame_kernels.update(self.x, self.R, self.edges, self.u.reshape(-1, 6))
        return x, R

    @property
    def points(self) -> Floats:
        """Positions of the nodes at the start, (N, 3) [m]."""
        return self.start

    @property
    def displacement(self) -> Floats:
        """Displacements of the nodes since the start, (N, 3) [m]."""
        moved: Floats = self.x - self.start
        return moved

    # --- a step ---------------------------------------------------------------------------------------------------

    def begin(self, t: float, integrator: Integrator) -> None:
        """Start a step that ends at t: loads and prescribed motion of t, the nodes where their velocities lead.

        Raises
        ------
        ValueError
            where a load or a prescribed motion is not finite.
        """
        self._history, self._increments, self._integrator = self.state(), np.zeros_like(self.x), integrator
        d, stress = np.zeros((self.space.nodes, 6)), None
        if self.inertia is not None:
            d[:, :3], d[:, 3:] = self.v / integrator.damping, self.w / integrator.damping
            d.reshape(-1)[self.fixed] = 0.0
            stress = self._begin_dynamics(integrator)
        for drive in self.drives:
            if drive.motion is not None:
                self._follow(drive, drive.motion(t), d[drive.node])
        weights = self.inertia.weights if self.inertia is not None else np.zeros(len(self.x))
        load, self._line = self.loads.at(t, self.data.length, weights)
        self.load = load.ravel()
        if not (np.isfinite(d).all() and np.isfinite(self.load).all()):
            raise ValueError(f"body {self.name!r}: a support or load is not finite at t = {t:.6g}")
        if self.inertia is not None and nodal_kernels.furthest(d)[0] > SHIFT * self.reach:
            # In a step that is long against its motion a body has long slowed down before it gets there.
            d = min((d, np.where(self.fixed.reshape(-1, 6), d, 0.0)), key=self._rest)
        self._shift(d)
        self._stress = stress
        self.renew()

    def _rest(self, d: Floats) -> float:
        """The size of the imbalance that increments d from the start of the step would leave."""
        self._shift(d)
        rest = float(np.linalg.norm(self.residual() * self.unit))
        self.restore(self._history)
        return rest if np.isfinite(rest) else np.inf

    def _follow(self, drive: Drive, motion: Floats, d: Floats) -> None:
        """The increments that bring a node to its prescribed place."""
        i, to = drive.node, np.empty(6)
        to[:3] = self.start[i] + motion[:3] - self.x[i]
        to[3:] = frame_kernels.turn_to(self.R[i : i + 1], self.start_frames[i : i + 1], motion[3:])
        held = list(drive.components)
        d[held] = to[held]

    def _begin_dynamics(self, integrator: Integrator) -> Floats:
        """Inertia and rates of strain; returns the stress before the step.

        The prediction stretches the beam: its geometric stiffness is better taken from the stress before it.
        """
        inertia, data = self.inertia, self.data
        assert inertia is not None
        self._J, rate = nodal_kernels.spatial_inertia(self.R, inertia.rotary), inertia.rayleigh[1] * integrator.damping
        stress, chord, twist = kernels.rest_in_motion(self.edges, self.R, data, rate)
        if rate:
            # b K v as a stress of the rate of strain: (1 + b/dt) C (γ − γ₀'), with γ₀' between γ₀ and γ_n.
            self._damped = BeamData(data.length, chord, twist, (1 + rate) * data.axial, (1 + rate) * data.bending)
        return stress

    def renew(self, cautious: bool = False) -> None:
        """Let A be formed anew about the present configuration; where `cautious`, with the stress of that."""
        self._fresh = self._factorised = False
        if cautious:
            self._stress = None

    def stiffen(self, elements: Ints, blocks: Floats) -> None:
        """Add blocks (q, 12, 12) of given elements to the next A."""
        self._extra.append((elements, blocks))

    def assemble(self) -> None:
        """Form A = inertia M + damping B + K about the present configuration, if it is not that already."""
        if self._fresh:
            return
        data, stress = self._damped, self._stress
        if stress is None:
            stress, _, _ = kernels.rest_in_motion(self.edges, self.R, data, 0.0)
        diagonal, upper = kernels.assemble_blocks(self.edges, self.R, data, stress)
        if self.inertia is not None:
            a, _ = self.inertia.rayleigh
            factor = self._integrator.inertia + a * self._integrator.damping
            nodal_kernels.add_inertia(diagonal, upper, self.inertia.nodes, self.inertia.links, self._J, factor)
        for elements, blocks in self._extra:
            kernels.add_element_blocks(diagonal, upper, elements, blocks)
        self._extra = []
        self.matrix.fill(diagonal, upper)
        self._fresh = True

    def factor(self) -> None:
        """Factorise A, if it is new."""
        if not self._factorised:
            self.matrix.factor()
            self._factorised = True

    def free_motion(self, contact: Floats | None = None) -> None:
        """u = A⁻¹ (f_ext − f_int − inertia + contact), the increment without new contact forces."""
        inner, outer = self._balance()
        rest = outer - inner
        if contact is not None:
            rest += contact
        self.u = self.solve(rest[:, None])[:, 0]

    def add(self, increment: Floats) -> None:
        """Add to the free increment."""
        self.u = self.u + increment

    def correct(self, increment: Floats) -> None:
        """Move by the free increment and `increment` together; the free increment is used up.

        Where the linearisation would turn or shift a node further than it holds, all move by a part of it.

        The next A takes the stress that the linearisation led to: where nodes turn by dθ the new configuration has
        axial forces of EA dθ²/2 that are not there in equilibrium, and in the geometric stiffness they would cost
        passes (Magisano, Leonetti, Garcea, Comput. Methods Appl. Mech. Eng. 313, 2017).
        """
        d = (self.u + increment).reshape(-1, 6)
        shift, turn = nodal_kernels.furthest(d)
        d = d / max(turn / TURN, shift / (SHIFT * self.reach), 1.0)
        stress = kernels.extrapolated_stress(self.edges, self.R, self._damped, d)
        self._shift(d)
        self._stress = stress

    def _shift(self, d: Floats) -> None:
        self.x, self.R, self.edges = frame_kernels.update(self.x, self.R, self.edges, d)
        self._increments = self._increments + d[:, :3]
        self._moved()

    def _moved(self) -> None:
        self.u = np.zeros(len(self.fixed))
        self._forces = self._stress = None
        self._fresh = False

    def accept(self) -> None:
        """The end of the step: velocities over it, v = (x − x_n)/dt and w = log(R R_nᵀ)/dt."""
        if self.inertia is not None:
            self.v = self._integrator.damping * self._increments
            self.w = self._integrator.damping * frame_kernels.relative_rotations(self._history[1], self.R)

    def adopt(
        self,
        integrator: Integrator,
        load: Floats,
        motion: Motion,
        increments: Floats,
        J: Floats,
        damped: BeamData,
        matrix: tuple[Floats, Floats, Floats],
        shown: int,
    ) -> None:
        """Take over a step from the present state that was solved elsewhere.

        Parameters
        ----------
        load : at its end, (6 N)
        motion, increments : its end, and the increments of the positions, (N, 3)
        J : `nodal_kernels.spatial_inertia` at its start
        damped : rest strains and stiffness with damping in them
        matrix, shown : the last A, as `Chain.adopt` takes it
        """
        self._history, self._integrator, self.load, self._line = self.state(), integrator, load, None
        self.x, self.R, self.edges, self.v, self.w = motion
        self._moved()
        self._increments, self._J, self._damped = increments, J, damped
        self.matrix.adopt(*matrix, shown)

    # --- forces ---------------------------------------------------------------------------------------------------

    def _balance(self) -> tuple[Floats, Floats]:
        """Internal with inertia forces, and external forces, of the present configuration, (6 N)."""
        if self._forces is None:
            inner = kernels.assemble_forces(self.edges, self.R, self._damped)
            if self.inertia is not None:
                self._add_inertia(inner)
            outer = self.load
            if self._line is not None:
                # What the Hermite interpolation makes of a line load, beside half of it a node.
                outer = outer.copy()
                nodal_kernels.add_line_moments(outer.reshape(-1, 6), self.R, self.data.length, self._line)
            self._forces = inner.ravel(), outer
        return self._forces

    def _add_inertia(self, f: Floats) -> None:
        """Add inertia and the damping a M v to forces (N, 6)."""
        inertia, scheme = self.inertia, self._integrator
        assert inertia is not None
        _, R_n, _, v_n, w_n = self._history
        turned = frame_kernels.relative_rotations(R_n, self.R)
        factor = scheme.inertia + inertia.rayleigh[0] * scheme.damping
        nodal_kernels.add_inertia_forces(
            f, self._increments, turned, v_n, w_n, inertia.nodes, inertia.links, self._J, factor, scheme.damping
        )

    def residual(self) -> Floats:
        """f_ext − f_int − inertia, zero at prescribed unknowns."""
        inner, outer = self._balance()
        return np.where(self.fixed, 0.0, outer - inner)

    def imbalance(self, contact: Floats) -> float:
        """‖f_int + inertia − f_ext − Hᵀλ‖ over the sum of the norms; moments count over an element's length."""
        inner, outer = self._balance()
        norms = nodal_kernels.norms(inner, outer, contact, self.fixed, self.unit)
        ratio = float(norms[0] / max(norms[1] + norms[2] + norms[3], least_force(self._damped)))
        return ratio if np.isfinite(ratio) else 1.0

    def reactions(self) -> Floats:
        """f_int + inertia − f_ext of each node where an unknown of it is prescribed, (N, 6) [N, N m]; contact apart."""
        inner, outer = self._balance()
        reactions: Floats = np.where(self.fixed, inner - outer, 0.0).reshape(-1, 6)
        return reactions

    def energy(self) -> dict[str, float]:
        """Kinetic and strain energy [J]."""
        gamma, psi = kernels.strains(self.edges, self.R)
        data = self.data
        strain = ((gamma - data.chord) ** 2 * data.axial + (psi - data.twist) ** 2 * data.bending).sum() / 2
        kinetic = self.inertia.energy(self.v, self.w, self.R) if self.inertia is not None else 0.0
        return {"kinetic": kinetic, "strain": float(strain)}

    # --- solves ---------------------------------------------------------------------------------------------------

    def solve(self, B: Floats) -> Floats:
        """X = A⁻¹ B, (6 N, k)."""
        return self.matrix.solve(B)

    def delassus(self, values: Floats, elements: Ints) -> Floats | None:
        """H A⁻¹ Hᵀ (c, c) for rows with entries (c, 12) on given elements, or None where only solves give it."""
        return self.matrix.delassus(values, elements)

    def close(self) -> None:
        """Destroy the matrix and its solver."""
        self.matrix.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *error: object) -> None:
        self.close()
