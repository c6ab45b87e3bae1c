"""What holds a body and what acts on it: prescribed displacements and loads, numbers or functions of place and time."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Literal

import numpy as np
from numpy.typing import NDArray

from fem.geometry import map_cells, map_facets

if TYPE_CHECKING:
    from fem.body import Body

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


def external_forces(body: Body, loads: Sequence[Load], t: float) -> Floats:
    """f_ext = ∫ f·N dx + ∫ p·N ds + Σ F at the owned unknowns [N]. Collective."""
    f = np.zeros(len(body.space.local_dofs))
    for load in loads:
        dofs, values = (_on_points if load.kind == "force" else _distributed)(body, load, t)
        f += np.bincount(dofs.ravel(), values.ravel(), minlength=len(f))
    return body.space.sum(f)


def _distributed(body: Body, load: Load, t: float) -> tuple[Ints, Floats]:
    """Local unknowns of cells or facets, and the work-equivalent forces on them."""
    space, X, axisymmetric = body.space, body.space.piece.points, body.model.axisymmetric
    direction: float | Floats = 1.0
    if load.kind == "body":
        nodes = space.piece.cells
        cells = map_cells(X, nodes, VOLUME_DEGREE, axisymmetric)
        weights, shapes, at = cells.weights, cells.values, cells.points
    else:
        nodes = body.facets(load.tag or "")
        sides = map_facets(X, nodes, SURFACE_DEGREE, axisymmetric)
        weights, shapes, at = sides.weights, sides.values, sides.points
        if load.kind == "pressure":
            direction = -sides.normals
    width = 1 if load.kind == "pressure" else space.components
    values = direction * evaluate(load.value, at.reshape(-1, space.dim), t, width).reshape(*weights.shape, width)
    return space.dofs_of(nodes), np.einsum("mq,qa,mqc->mac", weights, shapes, values, optimize=True)


def _on_points(body: Body, load: Load, t: float) -> tuple[Ints, Floats]:
    """Local unknowns of points, and the forces on them, shared among the ranks that hold a point."""
    space = body.space
    nodes = np.unique(body.facets(load.tag or ""))
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
