"""Bodies and pairs together: the contact problem of their present state, and the motion that answers it."""

from __future__ import annotations

from collections.abc import Callable
from copy import copy
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from contact.clock import Clock
from contact.coupling import CoupledDelassus, Coupling, joined
from contact.linearisation import BodyMatrices, Linearisation, join_rows
from contact.mixing import Mixing
from contact.pairs import Constraints, Pair
from contact.ranks import anywhere, total
from contact.rows import Rows
from contact.solvers.problem import ContactNotConvergedError, ContactProblem, Solution
from fem.body import Body
from fem.integrators import Integrator, Static

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]
ROUNDED = 16 * np.finfo(float).eps  # of the size: distances of undeformed bodies are known no better
STEADY = 0.5  # a pass that leaves more than this part of the residual wants columns of its own


class System:
    """Bodies, and the pairs of things that may touch.

    Parameters
    ----------
    comm : the communicator of the run; a body's own may be a part of it
    clock : charged with the time of each phase
    integrator : from the length of a step to the scheme in time
    """

    def __init__(
        self,
        comm: Any,
        bodies: list[Body],
        pairs: list[Pair],
        clock: Clock | None = None,
        integrator: Callable[[float], Integrator] = lambda dt: Static(),
    ) -> None:
        self.comm, self.bodies, self.pairs = comm, bodies, pairs
        self.clock = clock or Clock()
        self.integrator = integrator
        self.size = max((body.size for body in bodies), default=1.0)
        self.linear = all(body.linear for body in bodies)
        # Where further passes follow anyway, round-off of a single one is wasted.
        self.precision = 1e-12 if self.linear else 1e-10
        # In the place of `contact.step.step`, where there is something faster.
        self.advance: Callable[..., Any] | None = None
        self._detected: list[Constraints] = []
        self._linearisation: Linearisation | None = None
        self._base: Floats | None = None
        self._mixing = Mixing(comm, bodies)
        self._coupling: Coupling | None = None
        self._brace: Floats | None = None

    # --- free motion ----------------------------------------------------------------------------------------------

    def prepare(self) -> None:
        """Check the initial gaps. Collective."""
        with self.clock("detect"):
            for pair in self.pairs:
                pair.start()

    def begin(self, t: float, dt: float, lam: Floats | None = None) -> None:
        """Start a step of length dt that ends at t: supports, loads and A of that time. Collective.

        `lam` are the contact forces before it, whose curvature enters A.
        """
        integrator = self.integrator(dt)
        self._mixing = Mixing(self.comm, self.bodies)
        self._base = self._coupling = self._brace = None
        for body in self.bodies:
            body.begin(t, integrator)
        for pair in self.pairs:
            pair.begin()
        if lam is not None:
            if not self.linear:
                self.detect()  # the bodies have moved: curvature is that where they are
            self._stiffen(lam)
        self._factor()

    def _factor(self) -> None:
        """A of each body and its factor, where they are not those of the present state already."""
        for body in self.bodies:
            body.assemble()
        with self.clock("factor"):
            try:
                for body in self.bodies:
                    body.factor()
            except ArithmeticError as error:
                raise ContactNotConvergedError(str(error), 0, np.inf) from None

    def free_motion(self, lam: Floats | None = None) -> None:
        """Bring every body to its free configuration x_f. Collective.

        Bodies that are not linear take the contact forces `lam` of before along: nearly balanced, they move little, and
        their linearisation holds.
        """
        self._base = None
        if lam is not None and not self.linear and len(lam) == sum(part.count for part in self._detected):
            found = self.detect()
            found.include(lam > 0)
            self._free_with(found, lam)
            return
        with self.clock("factor"):
            for body in self.bodies:
                body.free_motion()

    def _free_with(self, found: Linearisation, lam: Floats) -> None:
        """The free motion with contact forces λ."""
        self._base = found.base = lam
        found.coupling, found.brace = self._coupling, self._brace
        operator = found.W if found.coupling else None
        before = operator.along() if isinstance(operator, CoupledDelassus) else None
        with self.clock("factor"):
            for body in self.bodies:
                found.free[body].free_motion(body, lam)
            if isinstance(operator, CoupledDelassus) and before is not None:
                operator.relax(before)

    def state(self) -> list[Any]:
        """What a step that fails must give back."""
        return [body.state() for body in self.bodies]

    def restore(self, state: list[Any]) -> None:
        """Return to a `state`."""
        for body, saved in zip(self.bodies, state, strict=True):
            body.restore(saved)

    # --- the contact problem --------------------------------------------------------------------------------------

    def detect(self) -> Linearisation:
        """Constraints about the present state; W is kept while they stay what they were. Collective."""
        with self.clock("detect"):
            found = [pair.detect() for pair in self.pairs]
            if self._linearisation is not None and all(f is None for f in found):
                self._linearisation.base = self._base
                return self._linearisation
            self._detected = [
                new or self._detected[i]  # a pair that finds nothing new says None
                for i, new in enumerate(found)
            ]
            self._linearisation = self._linearise(self._detected)
            self._linearisation.base, self._linearisation.coupling = self._base, self._coupling
            self._linearisation.brace = self._brace
            if self._base is not None and len(self._base) == len(self._linearisation.offset):
                self._linearisation.include(self._base > 0)  # what the free motion is with belongs to the problem
            return self._linearisation

    def relinearise(
        self, last: Linearisation, found: Linearisation, lam: Floats, settling: bool, progress: float
    ) -> Linearisation:
        """The next pass's linearisation about the present state, with the bodies in their free motion. Collective.

        A is formed anew, the curvature of the surfaces under the contact forces in it (a step of the sequential
        quadratic programme). Where one more pass is `settling` the step anyway, A and the columns of W stay those of
        the `last` pass, and only residuals, gaps and normals are new (a chord iteration). Where bodies are linear the
        columns are all that a new pass costs, and they stay as long as a pass makes `progress`, the part of the
        residual that it leaves. Where constraints too are those of before, what is missing are digits: the bodies stay
        where they are with the contact forces, and equilibrium is refined. Of a body that hardly anything holds, or
        in a long step, the free motion may be larger by many digits, which its sum with the corrective one has lost.
        """
        if self.linear:
            if found.constraints is last.constraints:
                self._refine(found, lam)
                found = copy(found)
                found.base = lam
                return found
            if self._mixing.advance(progress):
                for pair in self.pairs:
                    pair.moved()
                found = self.detect()
            if progress <= STEADY and np.array_equal(found.rows, last.rows):
                found = found.with_operator(last)
                self._free_with(found, lam)
            else:
                self.free_motion()
                found.base = None
            return found
        if settling and found.covered(last):
            found = found.with_operator(last)
        else:
            self._renew(lam)
            found.include(lam > 0)
        self._free_with(found, lam)
        return found

    def _refine(self, lin: Linearisation, lam: Floats) -> None:
        """u ← u + A⁻¹ (f_ext + Hᵀλ − f_int − inertia). Collective."""
        with self.clock("factor"):
            for body in self.bodies:
                if body in lin.W.H:
                    rest = body.residual() + lin.free[body].apply_transpose(lam)
                    body.correct(body.solve(np.where(body.held, 0.0, rest)[:, None])[:, 0])

    def _renew(self, lam: Floats) -> None:
        """A about the present state and forces, a cautious one where the exact one is not definite. Collective."""
        for cautious in (False, True):
            for body in self.bodies:
                body.renew(cautious)
            self._stiffen(lam, bulging=not cautious)
            self._factor()
            if all(body.definite for body in self.bodies):
                return

    def _stiffen(self, lam: Floats, bulging: bool = False) -> None:
        """Give the bodies the curvature of the surfaces under forces λ, for their next A."""
        self._coupling = self._brace = None
        counts = [part.count for part in self._detected]
        if len(lam) != sum(counts):
            return
        first, braces, couplings = 0, [], []
        with self.clock("assemble"):
            for pair, count in zip(self.pairs, counts, strict=True):
                brace, coupling = pair.stiffen(lam[first : first + count], bulging)
                braces.append(brace)
                if coupling:
                    couplings.append(replace(coupling, contacts=first + coupling.contacts))
                first += count
        if any(brace is not None for brace in braces):
            self._brace = _stacked([np.zeros(n) if b is None else b for b, n in zip(braces, counts, strict=True)])
        self._coupling = joined(couplings)

    def _linearise(self, parts: list[Constraints]) -> Linearisation:
        offset = _stacked([part.offset for part in parts])
        H = {body: join_rows(body, parts) for body in self.bodies}
        free = {body: h.without(body.fixed) for body, h in H.items()}
        movable = np.zeros(len(offset), dtype=bool)
        for body, h in free.items():
            movable |= anywhere(body.comm, h.touching())
        met = movable & np.isfinite(offset)
        close = [np.ones(part.count, dtype=bool) if part.close is None else part.close for part in parts]
        rows = np.flatnonzero(met & np.asarray(_stacked(close), dtype=bool))
        G = self._rigid_rates(free)
        if G is not None:
            # Where a body fits exactly between walls, the round-off of its place must not make it too large.
            offset = np.where(np.abs(offset) <= ROUNDED * self.size, 0.0, offset)
        return Linearisation(parts, H, free, offset, movable, met, rows, None if G is None else G[rows], self.clock)

    def _rigid_rates(self, free: dict[Body, Rows]) -> Floats | None:
        """G = H R for the floating bodies; ValueError where no constraint opposes one of their modes.

        Where constraints have opposed them before, a pass has led the body away: not converged.
        """
        floating = [body for body in self.bodies if body.modes.shape[1]]
        if not floating:
            return None
        blocks = []
        for body in floating:
            G_body = total(body.comm, free[body].sparse() @ body.modes)
            held = np.linalg.matrix_rank(G_body) if G_body.size else 0
            if held < body.modes.shape[1] and self._linearisation is not None:
                reason = f"body {body.name!r} has left the contacts that hold it"
                raise ContactNotConvergedError(reason, 0, np.inf)
            if held < body.modes.shape[1]:
                raise ValueError(
                    f"body {body.name!r}: {body.modes.shape[1]} rigid motion(s) that no support holds and "
                    f"only {held} that its contacts can oppose; add supports or contacts"
                )
            blocks.append(G_body)
        G: Floats = np.hstack(blocks)
        return G

    def problem(self, lin: Linearisation, calm: bool = False) -> ContactProblem:
        """The contact problem of linearisation `lin` about the present (free) state. Collective.

        Where passes are `calm`, the constraints out of reach are left out of it.
        """
        with self.clock("detect"):
            gaps = self._gaps(lin)
            if calm:
                lin.narrow(gaps)
            q = gaps[lin.rows]
        base = lin.on_rows(lin.base)
        if base is not None:
            q = q - lin.W.product(base)
        primal = BodyMatrices(lin.W.H) if lin.W.H else None
        if lin.G is None:
            return ContactProblem(lin.W, q, primal=primal)
        r = np.concatenate([total(b.comm, b.modes.T @ b.load) for b in self.bodies if b.modes.shape[1]])
        return ContactProblem(lin.W, q, lin.G, r, primal)

    def _gaps(self, lin: Linearisation) -> Floats:
        """δ = H u + offset for all constraints."""
        gaps = lin.offset
        for body, h in lin.H.items():
            gaps = gaps + total(body.comm, h.at(body))
        return gaps

    def correct(self, lin: Linearisation, solution: Solution) -> Floats:
        """u ← u + A⁻¹ Hᵀ λ + R α: the corrective motion; returns the contact forces of all constraints. Collective.

        Where A braces a contact, β (Δδ) of its λ has only resisted the brace, and is no force of the contact.
        """
        self._base, base = None, lin.on_rows(lin.base)  # the motion that it is in is used up
        change = solution.lam if base is None else solution.lam - base
        mode = 0
        with self.clock("factor"):
            if isinstance(lin.W, CoupledDelassus):
                lin.W.correct(change)
            for body in self.bodies:
                m = body.modes.shape[1]
                increment = body.modes @ solution.alpha[mode : mode + m]
                mode += m
                if body in lin.W.H:
                    lin.W.H[body].correct(body, change, increment)
                else:
                    body.correct(increment)
        for pair in self.pairs:
            pair.moved()
        if lin.brace is None:
            return lin.full(solution.lam)
        resisted = lin.brace[lin.rows] * (solution.gap - lin.offset[lin.rows])
        return lin.full(np.where(solution.lam > 0, np.maximum(solution.lam - resisted, 0.0), solution.lam))

    def gaps(self) -> Floats:
        """True gaps of the present state, for all constraints (c) [m]. Collective."""
        with self.clock("detect"):
            gaps: Floats = _stacked([pair.gaps() for pair in self.pairs])
            return gaps

    def driven_into(self, lin: Linearisation, depth: float) -> str:
        """Which contact has a point that no unknown moves more than `depth` lengths inside its surface; '' for none."""
        deep = np.flatnonzero((self.gaps() < -depth * lin.length) & ~lin.movable)
        ends = np.cumsum([part.count for part in lin.constraints])
        return self.pairs[int(np.searchsorted(ends, deep[0], side="right"))].name if deep.size else ""

    def crossed(self) -> str:
        """Which contact has a point that went through its surface on the way to the present state; '' for none."""
        with self.clock("detect"):
            return next((pair.name for pair in self.pairs if pair.crossed()), "")

    def adopt(self, lin: Linearisation) -> None:
        """Take over the last linearisation of a step that was solved elsewhere."""
        self._detected, self._linearisation = lin.constraints, lin
        self._base = self._coupling = self._brace = None

    def accept(self) -> None:
        """Take the present state as the start of the next step."""
        for body in self.bodies:
            body.accept()
        for pair in self.pairs:
            pair.accept()

    def close(self) -> None:
        """Destroy the bodies' PETSc objects. Collective."""
        for body in self.bodies:
            body.close()


def _stacked(parts: list[Any]) -> Any:
    """Arrays (c) of all pairs as one; of none, without entries."""
    return parts[0] if len(parts) == 1 else np.concatenate(parts) if parts else np.empty(0)
