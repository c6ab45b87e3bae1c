"""A tree of boxes about facets, and which facets lie along the normals of others.

Boxes contain their facets, whatever these sizes: a search on them misses no pair, unlike one for nearest centres.
"""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray
from scipy.spatial import cKDTree

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]
LEAF = 4


class FacetTree:
    """A complete binary tree over facets in the order of a k-d tree of their centres.

    Parameters
    ----------
    low, high : (f, D) opposite corners of each facet's box [m]
    """

    def __init__(self, low: Floats, high: Floats) -> None:
        self.order = np.asarray(cKDTree((low + high) / 2, leafsize=LEAF).indices, dtype=np.int64)
        leaves = 1 << max(0, int(np.ceil(np.log2(len(low) / LEAF))))
        first = np.linspace(0, len(low), leaves + 1).astype(np.int64)
        self.first = first
        self.low, self.high = low, high
        # Node i has the children 2i and 2i + 1; the last `leaves` nodes are the leaves.
        self.node_low, self.node_high = np.empty((2 * leaves, low.shape[1])), np.empty((2 * leaves, low.shape[1]))
        self.node_low[leaves:] = np.minimum.reduceat(low[self.order], first[:-1])
        self.node_high[leaves:] = np.maximum.reduceat(high[self.order], first[:-1])
        for i in range(leaves - 1, 0, -1):
            self.node_low[i] = np.minimum(self.node_low[2 * i], self.node_low[2 * i + 1])
            self.node_high[i] = np.maximum(self.node_high[2 * i], self.node_high[2 * i + 1])

    def along(self, centres: Floats, radii: Floats, axes: Floats, widening: Floats, reach: float, depth: float) -> Ints:
        """Pairs (p, 2) of a ball and a facet whose box the ball may meet on its way along its axis.

        The way leads from `depth` behind the centre to `reach` before it, and the ball grows by `widening` times its
        length.
        """
        given = (self.order, self.first, self.low, self.high, self.node_low, self.node_high)
        count = _search(*given, centres, radii, axes, widening, reach, depth, np.empty((0, 2), dtype=np.int64))
        pairs = np.empty((count, 2), dtype=np.int64)
        _search(*given, centres, radii, axes, widening, reach, depth, pairs)
        return pairs


@njit(cache=True)
def _meets(
    low: Floats, high: Floats, centre: Floats, radius: float, axis: Floats, widening: float, reach: float, depth: float
) -> bool:
    axial = half = square = across = 0.0
    for d in range(len(low)):
        away, extent = (low[d] + high[d]) / 2 - centre[d], (high[d] - low[d]) / 2
        axial += axis[d] * away
        half += abs(axis[d]) * extent
        square += extent * extent
        across += away * away
    if axial - half - radius > reach or axial + half + radius < -depth:
        return False
    way = min(abs(axial) + half + radius, max(reach, depth))
    allowed = radius + widening * way + np.sqrt(square)
    return bool(across - axial * axial <= allowed * allowed * (1.0 + 1e-9))


@njit(cache=True)
def _search(
    order: Ints,
    first: Ints,
    low: Floats,
    high: Floats,
    node_low: Floats,
    node_high: Floats,
    centres: Floats,
    radii: Floats,
    axes: Floats,
    widening: Floats,
    reach: float,
    depth: float,
    pairs: Ints,
) -> int:
    """Count the pairs, and write as many as there is room for."""
    leaves, count = len(first) - 1, 0
    stack = np.empty(64, dtype=np.int64)
    for i in range(len(centres)):
        stack[0], top = 1, 1
        while top:
            top -= 1
            node = stack[top]
            if not _meets(node_low[node], node_high[node], centres[i], radii[i], axes[i], widening[i], reach, depth):
                continue
            if node < leaves:
                stack[top], stack[top + 1] = 2 * node, 2 * node + 1
                top += 2
                continue
            for place in range(first[node - leaves], first[node - leaves + 1]):
                j = order[place]
                if _meets(low[j], high[j], centres[i], radii[i], axes[i], widening[i], reach, depth):
                    if count < len(pairs):
                        pairs[count, 0], pairs[count, 1] = i, j
                    count += 1
    return count
