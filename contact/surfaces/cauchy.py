"""The surface of a Cauchy kernel's integral along segments, in closed form.

f = Σ ∫(1 + s²|x − a|²)⁻² da = T; endless lines have the radius √((π/2sT)^(2/3) − 1)/s. With A² = 1 + s²ρ², ρ the
distance from the segment's line and t the place along it, I_n = ∫(A² + s²t²)⁻ⁿ dt follows from
I₁ = atan(s t/A)/(A s) and 2n A² I_(n+1) = t (A² + s²t²)⁻ⁿ + (2n − 1) I_n.

Source: Sherstyuk, Kernel functions in convolution surfaces, The Visual Computer 15 (1999).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
TRUNCATION = 1e-12


class CauchySurface:
    """g = ±h (T − f) outside, with h such that |∇g| = 1 where an endless line has its wall.

    Parameters
    ----------
    segments : ends, (n, 2, 3) [m]
    width, level : s [1/m] and T [m]

    A segment counts up to the distance D where all of them together, of length L, could add L (1 + s²D²)⁻² = 1e-12 T:
    that bounds what truncation changes in f.
    """

    def __init__(self, segments: Floats, width: float, level: float, inside: bool = False) -> None:
        if segments.ndim != 3 or segments.shape[1:] != (2, 3):
            raise ValueError(f"segments: must have two ends each, not shape {segments.shape}")
        self.a = segments[:, 0]
        along = segments[:, 1] - self.a
        self.length = np.linalg.norm(along, axis=1)
        if not np.all(self.length > 0):
            raise ValueError(f"segments[{np.argmin(self.length)}]: must not have length 0")
        self.t = along / self.length[:, None]
        self.s, self.level, self.sign = width, level, -1.0 if inside else 1.0
        A2 = (np.pi / (2 * width * level)) ** (2 / 3)
        if A2 <= 1:
            raise ValueError(f"level = {level}: must be below {np.pi / (2 * width):g}, that of the axis")
        self.radius = float(np.sqrt(A2 - 1) / width)
        self.scale = 2 * A2**2.5 / (3 * np.pi * width * self.radius)
        self.support = float(np.sqrt(max((self.length.sum() / (TRUNCATION * level)) ** 0.5 - 1, 0.0)) / width)

    def _parts(self, x: Floats) -> tuple[Floats, Floats, Floats, Floats, Floats]:
        """Across each line p, and I₂, I₃, I₄ with the kernel at both ends of t, all (points, segments, …)."""
        v = x[:, None] - self.a
        t0 = -np.einsum("qnd,nd->qn", v, self.t)
        p = v + t0[:, :, None] * self.t
        rho2 = np.einsum("qnd,qnd->qn", p, p)
        A2 = 1 + self.s**2 * rho2
        ends = np.stack([t0, t0 + self.length])
        w = A2 + (self.s * ends) ** 2
        A = np.sqrt(A2)
        integral = np.arctan(self.s * ends / A) / (A * self.s)
        powers = []
        for n in (1, 2, 3):
            integral = (ends / w**n + (2 * n - 1) * integral) / (2 * n * A2)
            powers.append(integral[1] - integral[0])
        beyond = np.maximum(np.maximum(t0, -t0 - self.length), 0.0)
        near = rho2 + beyond**2 <= self.support**2
        return p, near * np.stack(powers), near / w, ends, near * 1.0

    def potential(self, x: Floats) -> Floats:
        """±h (T − f), (points) [m]."""
        _, I, _, _, _ = self._parts(x)
        g: Floats = self.sign * self.scale * (self.level - I[0].sum(axis=1))
        return g

    def gradient(self, x: Floats) -> Floats:
        """∓h ∇f, across −4 s² p I₃ and along the difference of the kernel at the ends, (points, 3)."""
        p, I, w, _, _ = self._parts(x)
        across = np.einsum("qn,qnd->qd", -4 * self.s**2 * I[1], p)
        along = (w[0] ** 2 - w[1] ** 2) @ self.t
        gradient: Floats = -self.sign * self.scale * (across + along)
        return gradient

    def hessian(self, x: Floats) -> Floats:
        """∓h ∇²f, (points, 3, 3) [1/m]."""
        p, I, w, ends, _ = self._parts(x)
        s2 = self.s**2
        tt = np.einsum("ni,nj->nij", self.t, self.t)
        H = np.einsum("qn,nij->qij", -4 * s2 * I[1], np.eye(3) - tt)
        H += np.einsum("qn,qni,qnj->qij", 24 * s2**2 * I[2], p, p)
        # The kernel's derivatives at the ends: across −4 s² p w⁻³, along +4 s² t w⁻³
        mixed = np.einsum("qn,qni,nj->qij", -4 * s2 * (w[0] ** 3 - w[1] ** 3), p, self.t)
        H += mixed + mixed.transpose(0, 2, 1)
        H += np.einsum("qn,nij->qij", 4 * s2 * (ends[0] * w[0] ** 3 - ends[1] * w[1] ** 3), tt)
        hessian: Floats = -self.sign * self.scale * H
        return hessian

    def lipschitz(self, a: Floats, b: Floats) -> Floats:
        """h times the endless line's steepest slope and the kernel's largest value, for each segment, (points)."""
        steepest = np.hypot(np.pi * 0.75 * 1.25**-2.5, 1.0)
        return np.full(len(a), self.scale * steepest * len(self.length))

    def lower_bound(self, x: Floats) -> Floats:
        """g over the bound of |∇g|, (points) [m]."""
        bound: Floats = self.potential(x) / self.lipschitz(x, x)
        return bound
