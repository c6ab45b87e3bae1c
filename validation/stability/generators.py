"""Contact problems by a factor of their Delassus operator, W = FFᵀ, and their free gaps q.

Factors of beams come from closed forms, not from a finite-element program: ∫(x − t)₊(s − t)₊ dt/EI is the deflection of
a cantilever at s under a unit force at x, and sin(kπx/L) are the modes of a beam on two supports.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Random = np.random.Generator
Problem = tuple[Floats, Floats]

NODES = 200  # places along a beam where it may touch
WIDE = 400  # columns at most of a dense random factor


def dense(rng: Random, c: int) -> Problem:
    """Well conditioned, most rows active, up to `WIDE` rows; more depend on one another, a unit motion opens them."""
    n = min(2 * c, WIDE)
    F = rng.standard_normal((c, n)) / np.sqrt(n)
    return F, rng.standard_normal(c) - 0.3 if c <= n else _opened(rng, F)


def conditioned(rng: Random, c: int, condition: float) -> Problem:
    """W of the given condition, its eigenvalues in geometric progression; gaps that a unit motion opens."""
    U, V = (np.linalg.qr(rng.standard_normal((c, c)))[0] for _ in range(2))
    F = (U * np.geomspace(1.0, condition**-0.5, c)) @ V.T
    return F, _opened(rng, F)


def patches(n: int) -> tuple[Floats, Floats]:
    """W ~ 1/πr between the middles of n × n patches of an elastic half-space, and the heights of a paraboloid there."""
    x = (np.arange(n) + 0.5) * 2 / n - 1
    X, Y = (values.ravel() for values in np.meshgrid(x, x))
    r = np.hypot(X[:, None] - X, Y[:, None] - Y)
    np.fill_diagonal(r, (2 / n) / (4 * np.log(1 + np.sqrt(2))))
    return 1 / (np.pi * r), (X**2 + Y**2) / 2


def half_space(rng: Random, c: int) -> Problem:
    """A paraboloid on about c patches of an elastic half-space."""
    W, height = patches(max(1, round(c**0.5)))
    return np.linalg.cholesky(W), height - rng.uniform(0.01, 0.6)


def cantilever(rng: Random, c: int) -> Problem:
    """A clamped wire in a curved tube: condition to 1e10 and beyond, singular where places repeat; few rows active."""
    node, normal = _touching(rng, c)
    h = 1.0 / NODES
    t = (np.arange(NODES)[:, None] * h + h * (0.5 + np.array([-1, 1]) / np.sqrt(12))).ravel()
    bending = np.maximum(node[:, None] * h - t, 0.0) * np.sqrt(h / 2)
    return _transverse(bending, normal), _gaps(rng, node * h, normal, 0.0)


def vibrating(rng: Random, c: int) -> Problem:
    """A wire between two supports over a step of implicit Euler: inertia makes near and far contacts independent."""
    node, normal = _touching(rng, c)
    x, k = node / (NODES + 1), np.arange(1, NODES)  # the far support itself does not move
    stiff = 0.5 * ((k * np.pi) ** 4 + 10.0 ** rng.uniform(4, 8))
    motion = np.sin(np.pi * np.outer(x, k)) / np.sqrt(stiff)
    return _transverse(motion, normal), _gaps(rng, x, normal, 0.1)


def repeated(rng: Random, c: int) -> Problem:
    """The vibrating wire with each contact twice or more."""
    F, q = vibrating(rng, max(1, c // int(rng.integers(2, 5))))
    again = np.resize(np.arange(len(q)), c)
    return F[again], q[again]


FAMILIES = {
    "dense": dense,
    "half-space": half_space,
    "cantilever": cantilever,
    "vibrating": vibrating,
    "repeated": repeated,
}


def _opened(rng: Random, F: Floats) -> Floats:
    """Gaps that some unit motion makes ≥ 0, about half of them 0."""
    x = rng.standard_normal(F.shape[1])
    x /= np.linalg.norm(x)
    spare = np.maximum(rng.standard_normal(len(F)), 0.0) * rng.uniform(0, 1)
    return np.asarray(spare - F @ x)


def _touching(rng: Random, c: int) -> tuple[NDArray[np.int64], Floats]:
    """c places along the beam, as evenly as nodes allow, and normals all round."""
    node = 1 + np.resize(np.arange(NODES), c) if c >= NODES else np.ceil(np.linspace(1 / c, 1, c) * NODES).astype(int)
    angle = rng.uniform(0, 2 * np.pi, c)
    return node, np.stack([np.cos(angle), np.sin(angle)], axis=1)


def _transverse(motion: Floats, normal: Floats) -> Floats:
    """The factor of normal motions from that of each transverse direction."""
    return np.hstack([normal[:, :1] * motion, normal[:, 1:] * motion])


def _gaps(rng: Random, x: Any, normal: Floats, waves: float) -> Floats:
    """Gaps of a straight wire in a tube of unit clearance about a curved axis, the wire's own waves added."""
    ramp = 1 - np.exp(-((5 * x) ** 2))
    phase, size = rng.uniform(0, 2 * np.pi, 2), rng.uniform(1, 15)
    axis = size * np.stack([ramp * np.sin(8 * x + phase[0]), ramp * np.sin(11 * x + phase[1])], axis=1)
    axis += waves * size * np.stack([np.sin(40 * x + phase[1]), np.sin(31 * x + phase[0])], axis=1)
    return np.asarray(1.0 - (normal * axis).sum(axis=1))
