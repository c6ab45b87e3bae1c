"""Convolution surfaces: tubes, plates and balls that blend, with a spatial index.

The potential F is 1 on the surface, more inside (`surface_kernels`); g = ±h (F − 1) with h such that |∇g| is
near 1 at the wall of the median radius. A straight tube of constant radius r has exactly that radius one support k r
away from its ends, whatever its length is divided into. Segments whose radius varies, that follow a curve or that lie
in a junction deviate: `radius_error` measures by how much. Where n chains and balls of one network meet, each of them
grows at most as if F were n^(1/p) times as large: to r √(k² − (k² − 1) n^(−1/p)), 2.7 % for two with k = 1.5, p = 16.

Source: Zanni, Bernhardt, Quiblier, Cani, SCALe-invariant Integral Surfaces, Computer Graphics Forum 32 (2013).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from contact.surfaces import surface_kernels as kernels
from contact.surfaces.implicit import Foot
from contact.surfaces.index import network
from contact.surfaces.segment_kernel import columns, pieces
from contact.surfaces.surface_newton import beside, closest, outward
from contact.surfaces.surface_roots import roots

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]


# At most so many steps of Newton's method: from the last foot, which lead to the next one soon or not at all, and from
# the wall in sight.
FOLLOWED, SOUGHT = 12, 20


def bulge(count: int, reach: float, sharpness: float) -> float:
    """How much a tube's radius grows at most, relative, where `count` tubes of a union coincide."""
    return float(np.sqrt(reach**2 - (reach**2 - 1) * count ** (-1 / sharpness)) - 1)


class ConvolutionSurface:
    """The union of chains of segments and triangles, and of balls, less dents.

    Parameters
    ----------
    segments : ends and radii there, a, b, r_a, r_b (n, 8) [m]
    chains : which segments add up along one axis; chains are joined by a p-norm, (n); one chain by default
    triangles : three corners and half the thickness of a plate, (t, 10) [m]; one chain of them all
    balls : centre and radius, each joined in like a chain, (b, 4) [m]
    dents : centre, radius and what is taken away from F there, (d, 5) [m, m, −]
    reach : k, the support of the kernel over the radius
    sharpness : p
    inside : whether bodies stay inside (a lumen) or outside (an obstacle)
    """

    def __init__(
        self,
        segments: Floats | None = None,
        chains: Ints | None = None,
        triangles: Floats | None = None,
        balls: Floats | None = None,
        dents: Floats | None = None,
        *,
        reach: float = 1.5,
        sharpness: float = 16.0,
        inside: bool = True,
    ) -> None:
        if not reach > 1:
            raise ValueError(f"reach = {reach}: must be above 1")
        if not sharpness >= 3:
            raise ValueError(f"sharpness = {sharpness}: must be at least 3")
        self.reach, self.sharpness, self.sign = reach, sharpness, 1.0 if inside else -1.0
        self.segments = _rows("segments", segments, 8, slice(6, 8))
        self.chains = np.zeros(len(self.segments), dtype=np.int64) if chains is None else np.asarray(chains)
        order = np.argsort(self.chains, kind="stable")
        self.segments, self.chains = self.segments[order], self.chains[order]
        plates, round_, hollow = (
            _rows("triangles", triangles, 10, slice(9, 10)),
            _rows("balls", balls, 4, slice(3, 4)),
            _rows("dents", dents, 5, slice(3, 4)),
        )
        if not len(self.segments) + len(plates) + len(round_):
            raise ValueError("segments, triangles, balls: there must be some")
        length = np.linalg.norm(self.segments[:, 3:6] - self.segments[:, :3], axis=1)
        if not np.all(length > 0):
            raise ValueError(f"segments[{np.argmin(length)}]: must not have length 0")
        divided, of = pieces(self.segments, reach)
        parts = [columns(divided, reach), plates, _padded(round_), _padded(hollow)]
        self.kind = np.repeat([kernels.SEGMENT, kernels.TRIANGLE, kernels.BALL, kernels.DENT], [len(p) for p in parts])
        first = self.chains.max(initial=-1) + 1
        others = first + np.append(np.zeros(len(plates), dtype=np.int64), 1 + np.arange(len(round_) + len(hollow)))
        self.data = np.concatenate(parts)
        self.net = network(self.kind, np.append(self.chains[of], others), self.data, reach, sharpness)
        self.steepest = float(self.net.bounds[:, 0].max())
        radii = np.concatenate([self.segments[:, 6:].ravel(), plates[:, 9], round_[:, 3]])
        self.scale = float(np.median(radii)) * (reach**2 - 1) / 2

    def potential(self, x: Floats) -> Floats:
        """±h (F − 1), constant where F < ½, (points) [m]."""
        F = kernels.values(self.net, np.ascontiguousarray(x))
        g: Floats = self.sign * self.scale * (np.maximum(F, 0.5) - 1)
        return g

    def gradient(self, x: Floats) -> Floats:
        """±h ∇F, zero where F < ½, (points, 3)."""
        values = kernels.potentials(self.net, np.ascontiguousarray(x))
        gradient: Floats = self.sign * self.scale * np.where(values[:, :1] < 0.5, 0.0, values[:, 1:4])
        return gradient

    def hessian(self, x: Floats) -> Floats:
        """±h ∇²F, zero where F < ½, (points, 3, 3) [1/m]."""
        values = kernels.potentials(self.net, np.ascontiguousarray(x))
        entries = self.sign * self.scale * np.where(values[:, :1] < 0.5, 0.0, values[:, 4:])
        hessian: Floats = entries[:, [0, 1, 2, 1, 3, 4, 2, 4, 5]].reshape(-1, 3, 3)
        return hessian

    def lipschitz(self, a: Floats, b: Floats) -> Floats:
        """The largest of the bounds of h |∇F| over the cells, (points)."""
        return np.full(len(a), self.scale * self.steepest)

    def lower_bound(self, x: Floats) -> Floats:
        """A signed distance that is never larger in magnitude than the true one, at most one cell, (points) [m]."""
        bound: Floats = self.sign * kernels.lower_bounds(self.net, np.ascontiguousarray(x))
        return bound

    def nearest(self, x: Floats, guess: Floats | None = None) -> Foot:
        """The foot of each point by Newton's method from `guess`; the distance is NaN where that fails.

        Without a guess it starts from the wall in sight, goes on from elsewhere, and always ends. On an axis, where
        several walls are in sight, it is the foot on one of them, not always the nearest.
        """
        x = np.ascontiguousarray(x)
        if guess is not None:
            return Foot(*closest(self.net, x, np.ascontiguousarray(guess), self.sign, FOLLOWED))
        foot = Foot(*closest(self.net, x, outward(self.net, x), self.sign, SOUGHT))
        if self._doubt(x, foot):
            self._find_lost(x, foot)
        return foot

    def _doubt(self, x: Floats, foot: Foot) -> int:
        """Mark feet that are on another wall, nearer than any can be or on the other side, as lost; how many are."""
        bound = self.lower_bound(x)
        least = np.abs(bound) * (1 - 1e-6)
        foot.distance[(np.abs(foot.distance) < least) | (foot.distance * bound < 0)] = np.nan
        return int(np.isnan(foot.distance).sum())

    def _find_lost(self, x: Floats, foot: Foot) -> None:
        """Look for the feet that are NaN from elsewhere; where Newton's method never settles, the wall in sight."""
        for start in (lambda x: beside(self.kind, self.data, x), self._seen):
            lost = np.flatnonzero(np.isnan(foot.distance))
            found = Foot(*closest(self.net, x[lost], start(x[lost]), self.sign, 200))
            self._doubt(x[lost], found)
            for mine, new in zip(foot, found, strict=True):
                mine[lost] = new
        lost = np.flatnonzero(np.isnan(foot.distance))
        if lost.size:
            y = self._seen(x[lost])
            n = self.gradient(y)
            n /= np.linalg.norm(n, axis=1)[:, None]
            foot.point[lost], foot.normal[lost] = y, n
            side = np.where(np.einsum("qd,qd->q", x[lost] - y, n) < 0, -1.0, 1.0)
            foot.distance[lost] = side * np.linalg.norm(x[lost] - y, axis=1)
            foot.curvature[lost] = 0.0

    def first_root(self, start: Floats, end: Floats, tolerance: float) -> Floats:
        """The first root on each segment, see `detection.first_root`."""
        found: Floats = roots(self.net, np.ascontiguousarray(start), np.ascontiguousarray(end), self.sign, tolerance)
        return found

    def _seen(self, x: Floats) -> Floats:
        """For each x the nearest point of the wall in 26 directions, (points, 3)."""
        rays = np.stack(np.meshgrid([-1, 0, 1], [-1, 0, 1], [-1, 0, 1]), axis=-1).reshape(-1, 3)
        rays = rays[np.any(rays != 0, axis=1)] / np.linalg.norm(rays[np.any(rays != 0, axis=1)], axis=1)[:, None]
        side = np.sign(kernels.values(self.net, x) - 1)
        far = 2 * float(self.net.bounds[:, 3].max())
        s = np.full((len(rays), len(x)), np.inf)
        for sign in (-1.0, 1.0):
            at = np.flatnonzero(side == sign)
            ends = (x[at] + far * rays[:, None]).reshape(-1, 3)
            root = roots(self.net, np.tile(x[at], (len(rays), 1)), ends, sign, 1e-3 * far)
            s[:, at] = np.nan_to_num(root, nan=1.0).reshape(len(rays), -1)
        best = np.argmin(s, axis=0)
        start: Floats = x + far * np.take_along_axis(s, best[None], axis=0)[0][:, None] * rays[best]
        return start

    def radius_error(self, directions: int = 8) -> tuple[Floats, Floats]:
        """Measured over asked radius, less one, at the middle of every segment: places (n, 3) and errors (n).

        The measured radius is the median distance to the wall in `directions` across the axis: in a junction, where
        half of them lead into another chain or more, it says nothing. NaN where the wall is beyond three radii.
        """
        a, b = self.segments[:, :3], self.segments[:, 3:6]
        middle, r = (a + b) / 2, self.segments[:, 6:].mean(axis=1)
        t = (b - a) / np.linalg.norm(b - a, axis=1)[:, None]
        e = np.cross(t, np.eye(3)[np.argmin(np.abs(t), axis=1)])
        e /= np.linalg.norm(e, axis=1)[:, None]
        angle = 2 * np.pi * np.arange(directions) / directions
        rays = np.cos(angle)[:, None, None] * e + np.sin(angle)[:, None, None] * np.cross(t, e)
        from_, to = np.broadcast_to(middle, rays.shape), middle + 3 * r[:, None] * rays
        root = roots(self.net, from_.reshape(-1, 3), to.reshape(-1, 3), 1.0, 1e-3 * float(r.min()))
        measured = 3 * np.median(root.reshape(directions, -1), axis=0)
        return middle, measured - 1


def _rows(key: str, value: Floats | None, width: int, radii: slice) -> Floats:
    rows = np.zeros((0, width)) if value is None else np.array(value, dtype=float, ndmin=2)
    if rows.ndim != 2 or rows.shape[1] != width:
        raise ValueError(f"{key}: must have {width} columns, not shape {rows.shape}")
    if not np.all(np.isfinite(rows)) or not np.all(rows[:, radii] > 0):
        raise ValueError(f"{key}: must be finite numbers with radii above 0")
    return rows


def _padded(rows: Floats) -> Floats:
    return np.pad(rows, [(0, 0), (0, 10 - rows.shape[1])])
