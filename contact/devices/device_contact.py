"""Contact of a beam with a surface: points sampled along its centreline, kept at the device's radius from the wall."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from contact.devices import device_kernels
from contact.devices.element_rows import ElementRows
from contact.pairs import Constraints, Recorded, Stiffness, check_interference
from contact.surfaces.detection import first_root, follow, nearest
from contact.surfaces.implicit import Foot, Surface
from fem.beams import beam_points
from fem.beams.beam import Beam

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]
Bools = NDArray[np.bool_]

# Gaps below these parts of the radius make a point a candidate before any motion says so, and put it in the problem.
MARGIN, CLOSE = 1.0, 0.25
BRACE = 30.0  # the stiffness across a bulging wall, over what its curvature takes away along it


class DeviceContact:
    """Sampled points p of a beam against a surface: δ = d(p) − a, with d the distance to the surface, a the radius.

    A device of circular section touches where its centreline comes as near as its radius, so that the row of H is
    n·∂p/∂q with n = ∇d, and its curvature ∇²d. The first pass of a step takes the plane where the motion of a point
    from the last accepted state first meets the surface, or that of its closest point where it meets none; later passes
    take those of the closest points. Points whose last known gap is more than their motion since cannot touch (d is
    1-Lipschitz): they are no candidates and cost no look at the surface.

    Parameters
    ----------
    places : rest lengths from the start at which the beam is sampled, in rising order, (c) [m]
    interference : how deep a point may start in the wall [m]
    """

    close = CLOSE

    def __init__(self, name: str, body: Beam, surface: Surface, places: Floats, interference: float = 0.0) -> None:
        self.name, self.body, self.surface, self.interference = name, body, surface, interference
        arc = np.append(0.0, np.cumsum(body.data.length))
        m = len(body.data.length)
        self.elements: Ints = np.clip(np.searchsorted(arc, places, side="right") - 1, 0, m - 1)
        self.xi: Floats = np.clip((places - arc[self.elements]) / body.data.length[self.elements], 0.0, 1.0)
        self.radius: Floats = body.radius[self.elements]
        self.count = len(places)
        self.places = self._points(body.start, body.start_frames)
        self.areas = np.zeros(self.count)
        self.length = float(self.radius.max()) or body.size
        self._nothing, self._outside, self.margin = np.zeros(self.count), -2 * self.radius, MARGIN * self.radius
        self.first, self.close_by = 6 * self.elements, self.close * self.radius
        self.accepted = self.at = self.places
        self.candidates = np.zeros(self.count, dtype=bool)
        self.known = np.zeros(self.count)  # what the gap of each point is at least where it was last looked at …
        self.seen = self.places.copy()  # … and that place
        self._drift = np.zeros(self.count)  # how far the surface may have moved since
        normal = np.tile([1.0, 0.0, 0.0], (self.count, 1))
        self.foot = Foot(np.zeros(self.count), self.places.copy(), normal, np.zeros((self.count, 3, 3)))
        self._followed = np.zeros(self.count, dtype=bool)  # whether `foot` is that of the last look
        self._look(np.ones(self.count, dtype=bool), self.radius)
        self.clear = self._bound()  # what gaps are at least where the last accepted state has the points
        self._searching, self._fresh = True, False
        self._meeting = np.zeros(self.count, dtype=bool)  # points that the free motion of the step has brought in

    def _points(self, x: Floats, R: Floats) -> Floats:
        p: Floats = beam_points.centreline_points(x, R, self.elements, self.xi, self.body.data.length)
        return p

    def start(self) -> None:
        """Refuse an interference deeper than declared."""
        check_interference(self.name, self.known, self.interference, self.length)

    def begin(self) -> None:
        """Before the first pass of a step: candidates are found anew."""
        self._searching = True
        self._meeting[:] = False

    def moved(self) -> None:
        """The beam has moved: what was detected holds no more."""
        self._fresh = True

    # --- detection ------------------------------------------------------------------------------------------------

    def detect(self) -> Constraints | None:
        """Tangent planes at the candidates about the present state; None where they are those of the last call."""
        if self._searching:
            self.at = self._points(self.body.x, self.body.R)
            self._look(self._bound() <= self.margin, self.margin)
            self.candidates = self.known <= self.margin
        elif self._fresh:
            self.at = self._points(self.body.x, self.body.R)
            self._look(self.candidates | (self._bound() <= 0), self._nothing)
            # A foot that was lost, and not looked for anew, is out of reach.
            self.candidates = self.candidates & ~np.isnan(self.foot.distance) | (self.known <= 0)
            outside = self.known < self._outside
            if outside.any():  # the closest wall may be another one
                self._first_met(np.flatnonzero(outside), self.at)
        elif not self._meet():
            return None
        self._searching = self._fresh = False
        offset, normals, values = device_kernels.planes(
            self.candidates, self.at, self.foot, self.radius, self.body.R, self.elements, self.xi, self.body.data.length
        )
        H = ElementRows(values, self.first, self.body.space.size)
        close = self._meeting | (self.known <= self.close_by)
        return Constraints({self.body: H}, offset, normals, self.places, self.areas, self.length, close)

    def _meet(self) -> bool:
        """Make candidates of the points that the free motion could bring to the wall; whether there are any new ones.

        A point that comes from further away than its radius takes the plane where its way first meets the wall.
        """
        x, R = self.body.trial()
        if x is self.body.x:
            return False
        free = self._points(x, R)
        way = device_kernels.ways(self.at, free)
        new = ~self.candidates & (self._bound() <= way)
        if not new.any():
            return False
        self._look(new, way)
        new &= self.known <= way
        if not new.any():
            return False
        self.candidates |= new
        self._meeting |= new
        self._first_met(np.flatnonzero(new & (self.known > self.radius)), free)
        return True

    def _first_met(self, rows: Ints, end: Floats) -> None:
        """Give points the planes where their ways from the last accepted state to `end` first meet the wall."""
        start, way = self.accepted[rows], end[rows] - self.accepted[rows]
        s = first_root(self.surface, start, end[rows], 1e-3 * self.length)
        met = s > 0  # a point that starts in the wall, as its interference allows, keeps its closest plane
        point = start[met] + s[met, None] * way[met]
        gradient = self.surface.gradient(point)
        self.foot.point[rows[met]] = point
        self.foot.normal[rows[met]] = gradient / np.linalg.norm(gradient, axis=1)[:, None]

    def _bound(self) -> Floats:
        """What every gap is at least, from where it was last looked at, and where the surface was."""
        bound: Floats = device_kernels.bounds(self.known, self.at, self.seen, self._drift)
        return bound

    def _look(self, chosen: Bools, reach: Floats) -> None:
        """Closest points and gaps of the chosen points; of those beyond `reach` only what their gap is at least.

        Points whose last foot is near are followed from there: a gap can change by no more than the point has moved.
        """
        rows, others = device_kernels.split(chosen, self._followed)
        x, guess = device_kernels.moved_along(rows, self.at, self.seen, self.foot)
        lost = rows[self._find(rows, x, guess)]
        if lost.size:
            self._followed[lost] = False
            others = np.concatenate([lost, others])
        if others.size:
            self._find_anew(others, reach)

    def _find_anew(self, rows: Ints, reach: Floats) -> None:
        """Look for feet without a guess, where the surface may be within reach."""
        self.known[rows] = self.surface.lower_bound(self.at[rows]) - self.radius[rows]
        self.seen[rows], self._drift[rows] = self.at[rows], 0.0
        near = rows[self.known[rows] <= reach[rows]]
        self._find(near, self.at[near], None)

    def _find(self, rows: Ints, x: Floats, guess: Floats | None) -> Ints:
        """Look for the feet of some points at x; which are not found, or changed their gaps more than they can."""
        if not rows.size:
            return rows
        return self._settle(rows, x, nearest(self.surface, x) if guess is None else follow(self.surface, x, guess))

    def _settle(self, rows: Ints, x: Floats, found: Foot) -> Ints:
        """Take feet that were found; which were not, or changed the gaps of their points more than they can."""
        lost: Ints = device_kernels.settle(
            rows, x, found, self.radius, self.foot, self.known, self.seen, self._followed, self._drift,
            1e-9 * self.length, 4 * self.length,
        )  # fmt: skip
        return lost

    def gaps(self) -> Floats:
        """True gaps of the candidates, and what those of the others are at least, (c) [m]."""
        gaps: Floats = device_kernels.gaps(self.candidates, self.known, self.at, self.seen, self._drift)
        return gaps

    # --- the step -------------------------------------------------------------------------------------------------

    def stiffen(self, lam: Floats, bulging: bool = False) -> Stiffness:
        """Give the beam −Σ λ ∇²δ: the curvature of the wall, and of the centreline's interpolation.

        Where the wall bulges towards the device its curvature makes A indefinite, and W no Delassus operator, even
        where the contacts themselves hold the device. Those hold it across the wall: a brace β n nᵀ, a multiple of λ b
        with b the curvature of the bulge, changes no increment that keeps them closed, and makes A definite as a rule
        (Debreu 1952). Unless `bulging`, such curvature is left out: passes contract, but only at a steady rate.
        """
        elements, blocks, brace = device_kernels.stiffness(
            lam, self.foot, BRACE if bulging else 0.0, self.body.R, self.elements, self.xi, self.body.data.length
        )
        if len(elements):
            self.body.stiffen(elements, blocks)
        return Stiffness(brace if bulging else None)

    def crossed(self) -> bool:
        """Whether the centreline went through the wall on the straight way from the last accepted state."""
        # On a way through the wall a point has left the balls about both ends that are clear of it.
        clear = np.maximum(self.clear + self.radius, 0.0) + np.maximum(self._bound() + self.radius, 0.0)
        rows = np.flatnonzero(device_kernels.ways(self.accepted, self.at) >= clear)
        if not rows.size:
            return False
        tolerance = 1e-3 * self.length
        return bool((first_root(self.surface, self.accepted[rows], self.at[rows], tolerance) > 0).any())

    def accept(self) -> None:
        """Take the present state as the start of the next step's motion."""
        self.at = self.accepted = self._points(self.body.x, self.body.R)
        self.clear = self._bound()

    def sight(self) -> tuple[Floats, Floats, Floats, Bools]:
        """What is known of the points: gaps, where they were then, how far the wall may have moved, who is followed."""
        return self.known, self.seen, self._drift, self._followed

    def adopt(
        self,
        sight: tuple[Floats, Floats, Floats, Bools],
        foot: tuple[Floats, Floats, Floats, Floats],
        candidates: Bools,
        at: Floats,
        clear: Floats,
    ) -> None:
        """Take over a step that was solved elsewhere: what is known of the points, which are where, and `_bound`."""
        (self.known, self.seen, self._drift, self._followed), self.foot = sight, Foot(*foot)
        self.candidates, self.at, self.accepted, self.clear = candidates, at, at, clear
        self._searching = self._fresh = False

    def recorded(self) -> Recorded:
        """The candidates, each at the node next to it; where they touch is the wall's point."""
        rows = np.flatnonzero(self.candidates)
        nodes = (self.elements + (self.xi > 0.5))[rows]
        return self.body, rows, nodes, self.areas[rows], self.foot.point[rows]
