"""Structured meshes of simplices on graded grids, in numpy."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from itertools import permutations

import numpy as np
from numpy.typing import NDArray

from meshes.mesh import Mesh, face_table, faces_of
from meshes.parameters import bad, choice, count, number, positive
from meshes.refine import Refine
from meshes.simplices import EDGES

type Grading = float | Callable[[NDArray[np.float64]], NDArray[np.float64]]
"""Size of the last cell over that of the first (geometric progression), or an increasing map of [0, 1] onto itself."""

type PerAxis[T] = T | Sequence[T]
"""One value for all axes, or one per axis."""


def interval(length: float, n: int, order: int = 1, origin: float = 0.0) -> Mesh:
    """`n` equal cells on [origin, origin + length] [m]; tags ``start`` and ``end``."""
    axis = number("origin", origin) + positive("length", length) * np.linspace(0, 1, count("n", n) + 1)
    return grid([axis], [("start", "end")], order)


def check_style(
    h: float | None,
    n: PerAxis[int] | None,
    refine: Refine | None,
    structured: bool,
    grading: PerAxis[Grading] | None,
) -> None:
    """ValueError unless the parameters of a shape that may be structured go together."""
    choice("structured", structured, (True, False))
    if (h is None) == (n is None):
        raise bad("h, n", [h, n], "given one and not the other")
    if structured and refine is not None:
        raise bad("refine", refine, "left out of a structured mesh, which has grading")
    if not structured and n is not None:
        raise bad("n", n, "given with structured = true, otherwise h")
    if not structured and grading is not None:
        raise bad("grading", "…" if callable(grading) else grading, "given with structured = true, otherwise refine")


def per_axis[T](key: str, value: PerAxis[T], axes: int) -> list[T]:
    """`value` for each of the axes."""
    if not isinstance(value, Sequence | np.ndarray) or isinstance(value, str):
        return [value] * axes
    if len(value) != axes:
        raise bad(key, value, f"one value or a list of {axes}")
    return list(value)


def axes_of(
    size: Sequence[float], h: float | None, n: PerAxis[int] | None, grading: PerAxis[Grading] | None
) -> list[NDArray[np.float64]]:
    """Nodes of a graded grid on [0, size_i] along each axis: `n` cells, or as many as give the mean size `h` [m]."""
    if n is None:
        cells = [int(np.ceil(length / positive("h", h) - 1e-9)) for length in size]
    else:
        cells = [count("n", value) for value in per_axis("n", n, len(size))]
    gradings: list[Grading] = per_axis("grading", 1.0 if grading is None else grading, len(size))
    return [length * _unit_axis(k, grade) for length, k, grade in zip(size, cells, gradings, strict=True)]


def _unit_axis(n: int, grading: Grading) -> NDArray[np.float64]:
    s = np.linspace(0, 1, n + 1)
    if callable(grading):
        s = np.asarray(grading(s), dtype=float)
        if s.shape != (n + 1,) or not (abs(s[0]) < 1e-12 and abs(s[-1] - 1) < 1e-12 and (np.diff(s) > 0).all()):
            raise bad("grading", grading, "an increasing map of [0, 1] onto itself")
        s[[0, -1]] = 0, 1
        return s
    ratio = positive("grading", grading)
    if ratio == 1 or n == 1:
        return s
    s = np.expm1(np.arange(n + 1) * np.log(ratio) / (n - 1))  # (qⁱ − 1)/(qⁿ − 1) with q = ratio^{1/(n−1)}
    return np.asarray(s / s[-1])


def grid(axes: Sequence[NDArray[np.float64]], tags: Sequence[tuple[str, str]], order: int) -> Mesh:
    """Simplices on the tensor product of axes: each cell of the grid is cut into d! along its diagonal (Kuhn, 1960).

    Parameters
    ----------
    axes : sequence of (n_i,) [m]
        Coordinates of the nodes, increasing or decreasing; the first axis runs fastest in the numbering.
        The diagonals start at the first node of every axis.
    tags : one (first, last) per axis
        Names of the sides at the first and at the last coordinate.
    order : 1 or 2
    """
    choice("order", order, (1, 2))
    dim = len(axes)
    shape = tuple(len(axis) for axis in axes)
    points = np.stack([x.ravel(order="F") for x in np.meshgrid(*axes, indexing="ij")], axis=1)
    index = np.arange(len(points)).reshape(shape, order="F")
    cells = np.stack([_simplex(index, path) for path in permutations(range(dim))], axis=1).reshape(-1, dim + 1)
    if sum(axis[0] > axis[-1] for axis in axes) % 2:  # an odd number of reflections
        cells[:, -2:] = cells[:, :-3:-1]
    boundary = faces_of(cells, dim, face_table(cells, dim).outer())
    facets = {
        tag: boundary[(points[boundary, i] == axis[end]).all(axis=1)]
        for i, axis in enumerate(axes)
        for tag, end in zip(tags[i], (0, -1), strict=True)
    }
    return Mesh(*(quadratic(points, cells) if order == 2 else (points, cells)), facets)


def _simplex(index: NDArray[np.int64], path: tuple[int, ...]) -> NDArray[np.int64]:
    """The simplex of every cell of the grid whose vertices go from corner to corner along the axes `path`."""
    corner = np.zeros(index.ndim, dtype=int)
    vertices = []
    for step in (None, *path):
        if step is not None:
            corner[step] = 1
        window = tuple(slice(c, size - 1 + c) for c, size in zip(corner, index.shape, strict=True))
        vertices.append(index[window].ravel(order="F"))
    if np.linalg.det(np.eye(len(path))[list(path)]) < 0:
        vertices[-2:] = vertices[:-3:-1]
    return np.stack(vertices, axis=1)


def quadratic(points: NDArray[np.float64], cells: NDArray[np.int64]) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
    """Straight quadratic simplices from linear ones: a node in the middle of each edge, after all vertices."""
    dim = cells.shape[1] - 1
    edges = np.sort(cells[:, np.array(EDGES[dim])].reshape(-1, 2), axis=1)
    key, which = np.unique(edges[:, 0] * len(points) + edges[:, 1], return_inverse=True)
    ends = np.stack(np.divmod(key, len(points)), axis=1)
    middles = which.reshape(len(cells), -1) + len(points)
    return np.concatenate([points, points[ends].mean(axis=1)]), np.concatenate([cells, middles], axis=1)
