"""What holds a body and what acts on it: prescribed displacements and loads, numbers or functions of place and time."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from fem.geometry import map_cells, map_facets
from fem.space import Space

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]
Field = float | Callable[[Floats, float], Any]

# Loads are given functions: rules well above the degree of the elements.
VOLUME_DEGREE, SURFACE_DEGREE = 4, 10


@dataclass(frozen=True)
class Support:
    """Prescribed displacement: `component` (None: all of them) of the nodes of `tag` follows `value`(x, t) [m]."""

    tag: str
    component: int | None = None
    value: Field = 0.0


@dataclass(frozen=True)
class Load:
    """A force per volume (`body`), a `traction`, a `pressure` (along −n) or a `force` on each point.

    `value` is a number for a pressure and one number per component otherwise, or a function (x, t) of them;
    a `body` load has no tag.
    """

    kind: Literal["body", "traction", "pressure", "force"]
    value: Sequence[float] | Field
    tag: str | None = None


def external_forces(space: Space, axisymmetric: bool, loads: Sequence[tuple[Load, Ints]], t: float) -> Floats:
    """f_ext = ∫ f·N dx + ∫ p·N ds + Σ F at the owned unknowns [N], for loads with the nodes they act on. Collective."""
    f = np.zeros(len(space.local_dofs))
    for load, nodes in loads:
        if load.kind == "force":
            dofs, values = _on_points(space, load, nodes, t)
        else:
            dofs, values = _distributed(space, axisymmetric, load, nodes, t)
        f += np.bincount(dofs.ravel(), values.ravel(), minlength=len(f))
    return space.sum(f)


def _distributed(space: Space, axisymmetric: bool, load: Load, nodes: Ints, t: float) -> tuple[Ints, Floats]:
    """Local unknowns of cells or facets, and the work-equivalent forces on them."""
    X = space.piece.points
    direction: float | Floats = 1.0
    if load.kind == "body":
        cells = map_cells(X, nodes, VOLUME_DEGREE, axisymmetric)
        weights, shapes, at = cells.weights, cells.values, cells.points
    else:
        sides = map_facets(X, nodes, SURFACE_DEGREE, axisymmetric)
        weights, shapes, at = sides.weights, sides.values, sides.points
        if load.kind == "pressure":
            direction = -sides.normals
    width = 1 if load.kind == "pressure" else space.components
    values = direction * evaluate(load.value, at.reshape(-1, space.dim), t, width).reshape(*weights.shape, width)
    return space.dofs_of(nodes), np.einsum("mq,qa,mqc->mac", weights, shapes, values, optimize=True)


def _on_points(space: Space, load: Load, nodes: Ints, t: float) -> tuple[Ints, Floats]:
    """Local unknowns of points, and the forces on them, shared among the ranks that hold a point."""
    nodes = np.unique(nodes)
    dofs = space.dofs_of(nodes[:, None])
    marks = np.zeros(len(space.local_dofs))
    marks[dofs.ravel()] = 1
    holders = space.local(space.sum(marks))[dofs]
    return dofs, evaluate(load.value, space.piece.points[nodes], t, space.components) / holders


def evaluate(value: Any, points: Floats, t: float, width: int) -> Floats:
    """`value`(points, t) as an array (points, width)."""
    result = np.asarray(value(points, t) if callable(value) else value, dtype=float)
    if callable(value) and result.ndim == 1:  # one number per point, for every component
        result = result[:, None]
    if result.ndim and result.shape[-1] not in (1, width):
        raise ValueError(f"value {value!r}: must give one number or {width}")
    return np.broadcast_to(result, (len(points), width))
