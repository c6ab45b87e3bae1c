"""The supports of a body: which unknowns they hold, and at which values."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import NDArray

from fem.loads import Support, evaluate
from fem.space import Space

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]


class Supports:
    """Prescribed displacements on the nodes of tags.

    Parameters
    ----------
    name : the body's, for messages
    space : its unknowns
    facets : from a tag to local nodes (f, k)
    supports : where two disagree the later one holds

    Attributes
    ----------
    fixed : the owned unknowns that they prescribe

    Raises
    ------
    ValueError
        for a component that the body does not have. Collective.
    """

    def __init__(
        self, name: str, space: Space, facets: Callable[[str], Ints], supports: Sequence[Support] = ()
    ) -> None:
        self.space = space
        self._parts = []
        marks = np.zeros(len(space.local_dofs))
        c = space.components
        for support in supports:
            if support.component is not None and not 0 <= support.component < c:
                raise ValueError(f"body {name!r}: support on {support.tag!r} has no component {support.component}")
            nodes = np.unique(facets(support.tag))
            dofs = c * nodes[:, None] + (np.arange(c) if support.component is None else support.component)
            marks[dofs] = 1
            self._parts.append((support, nodes, dofs))
        self.fixed: NDArray[np.bool_] = space.sum(marks) > 0

    def prescribe(self, owned: Floats, t: float) -> Floats:
        """Owned unknowns with the displacements of time t [s]. Collective."""
        # One after the other: where two disagree the later one holds, on whichever ranks their facets are.
        for support, nodes, dofs in self._parts:
            values, marks = np.zeros((2, len(self.space.local_dofs)))
            values[dofs] = evaluate(support.value, self.space.piece.points[nodes], t, dofs.shape[1])
            marks[dofs] = 1
            total, count = self.space.sum(values), self.space.sum(marks)
            owned = np.where(count > 0, total / np.maximum(count, 1), owned)
        return owned
