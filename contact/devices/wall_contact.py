"""Contact of a beam with the surface of another body, which gives way."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from contact.coupling import Coupling
from contact.devices.device_contact import MARGIN, DeviceContact
from contact.devices.element_rows import ElementRows
from contact.devices.wall_rows import WallRows
from contact.pairs import Constraints, Stiffness
from contact.surfaces.body_surface import BodySurface
from contact.surfaces.detection import first_root
from fem.beams import beam_points
from fem.beams.beam import Beam

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]
Bools = NDArray[np.bool_]


class WallContact(DeviceContact):
    """A `DeviceContact` whose surface is that of a body: feet are followed from patch to patch, rows couple both.

    The wall's compliance is kept, so that curvature does not enter its A, but the operator of both (`Coupling`).
    """

    surface: BodySurface
    close = 0.01  # rows of the wall cost more than those that a further pass finds wanting

    def __init__(self, name: str, body: Beam, surface: BodySurface, places: Floats, interference: float = 0.0) -> None:
        count, width = len(places), surface.patches.net.shape[1]
        self._patch, self._place = np.zeros(count, dtype=np.int64), np.zeros((count, 2))
        self._shares, self._beyond = np.zeros((count, width)), np.zeros(count, dtype=bool)
        self._settling = True  # until the first step there is no A to move the wall with
        super().__init__(name, body, surface, places, interference)

    def begin(self) -> None:
        """Before the first pass of a step: candidates are found anew."""
        super().begin()
        self._settling = False

    def detect(self) -> Constraints | None:
        """Tangent planes at the candidates about the present state, with the rows of the wall."""
        # Points that are not followed know their gaps from the wall that was there when they were looked at.
        self._follow(everywhere=self._searching and not self._followed.all())
        found = super().detect()
        wall = self.surface.wall
        if found is None or wall is None:
            return found
        rows = np.flatnonzero(self.candidates)
        normals = np.zeros((self.count, 3))
        normals[rows] = found.normals[rows]
        points = self.surface.first + self.surface.patches.net[self._patch]
        on_wall = WallRows(wall, points, self._shares.copy(), normals)
        return replace(found, H={**found.H, wall: on_wall}, offset=found.offset - on_wall.displacements())

    def stiffen(self, lam: Floats, bulging: bool = False) -> Stiffness:
        """The curvature of the centreline's interpolation for the beam's A, and that of the gaps of both bodies.

        It is −Σ λ ∂²δ in what the two do to each other at a contact: slide (e), and tilt the wall (s).
        """
        wall, rows = self.surface.wall, np.flatnonzero(lam > 0)
        if wall is None or not rows.size:
            return super().stiffen(lam, bulging)
        beam, radius, force, elements = self.body, self.radius[rows], lam[rows], self.elements[rows]
        normal, flat = self.foot.normal[rows], np.zeros((len(rows), 3, 3))
        length = beam.data.length
        blocks = beam_points.point_blocks(force, normal, flat, beam.R, elements, self.xi[rows], length)
        beam.stiffen(elements, blocks)
        forms, tangents, slopes = self.surface.second_forms(self._patch[rows], self._place[rows], radius)
        slides = [beam_points.point_rows(t, beam.R, elements, self.xi[rows], length) for t in tangents.swapaxes(0, 1)]
        still = np.zeros_like(slides[0])
        values = np.stack([*slides, still, still], axis=1).reshape(-1, 12)
        points = np.repeat(self.surface.first + self.surface.patches.net[self._patch[rows]], 4, axis=0)
        shares = np.stack([self._shares[rows]] * 2 + [slopes[:, 0], slopes[:, 1]], axis=1).reshape(len(points), -1)
        directions = np.stack([tangents[:, 0], tangents[:, 1], -normal, -normal], axis=1).reshape(-1, 3)
        coupling = Coupling(
            {
                beam: ElementRows(values, np.repeat(self.first[rows], 4), beam.space.size).without(beam.fixed),
                wall: WallRows(wall, points, shares, directions).without(wall.fixed),
            },
            force[:, None, None] * forms,
            rows,
            force / radius,
        )
        return Stiffness(coupling=coupling)

    def _look(self, chosen: Bools, reach: Floats) -> None:
        """As on any surface; points whose foot is on the rim are no candidates."""
        super()._look(chosen, reach)
        self.candidates &= ~self._beyond

    def _find_anew(self, rows: Ints, reach: Floats) -> None:
        """As on any surface, when all of it is where the wall is."""
        self._follow(everywhere=True)
        super()._find_anew(rows, reach)

    def _follow(self, everywhere: bool = False) -> None:
        """Bring the surface to where the wall is; what was known about distances from it is less sure then."""
        if way := self.surface.follow(everywhere):
            self._drift += way
            self.clear -= way

    def _find(self, rows: Ints, x: Floats, guess: Floats | None) -> Ints:
        """The closest points of some points at x, on from their last patches; anew where there is no guess."""
        if not rows.size:
            return rows
        if guess is None:
            patch, place = self.surface.search(x)
        else:
            patch, place = self._patch[rows], self._place[rows]
        while True:
            found, shares, rim = self.surface.closest(x, patch, place)
            near = found.distance <= (1 + MARGIN) * self.radius[rows]
            if self._settling or not self.surface.want(patch[near]):
                break
            self._follow()
        # Beyond the rim nothing touches: far enough to be no candidate, near enough to be looked at when it moves.
        found.distance[rim] = np.maximum(found.distance[rim], (1 + MARGIN) * self.radius[rows[rim]] * (1 + 1e-12))
        self._patch[rows], self._place[rows] = patch, place
        self._shares[rows], self._beyond[rows] = shares, rim
        return self._settle(rows, x, found)

    def _first_met(self, rows: Ints, end: Floats) -> None:
        """Give points the planes where their ways from the last accepted state to `end` first meet the wall."""
        start, way = self.accepted[rows], end[rows] - self.accepted[rows]
        s = first_root(self.surface, start, end[rows], 1e-3 * self.length)
        met = s > 0  # a point that starts in the wall, as its interference allows, keeps its closest plane
        rows, x = rows[met], start[met] + s[met, None] * way[met]
        if rows.size:
            patch, place = self.surface.search(x)
            foot, shares, _ = self.surface.closest(x, patch, place)
            self._patch[rows], self._place[rows], self._shares[rows] = patch, place, shares
            self.foot.point[rows], self.foot.normal[rows] = foot.point, foot.normal
            self.surface.want(patch)
