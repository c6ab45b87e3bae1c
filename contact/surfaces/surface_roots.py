"""The first roots of a convolution surface's potential on segments, compiled."""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray

from contact.surfaces.surface_kernels import NOWHERE, Network, evaluate, locate

Floats = NDArray[np.float64]


@njit(cache=True, error_model="numpy")
def roots(net: Network, start: Floats, end: Floats, sign: float, tolerance: float) -> Floats:
    """The first s in [0, 1] with sign (F − 1) ≤ 0 on each segment, NaN without."""
    constants, table, keys, cells, bounds, groups, slots, plates, balls = net
    out, place, width = np.full(len(start), np.nan), NOWHERE, constants[4]
    for i in range(len(start)):
        a0, a1, a2 = start[i, 0], start[i, 1], start[i, 2]
        m0, m1, m2 = end[i, 0] - a0, end[i, 1] - a1, end[i, 2] - a2
        length = np.sqrt(m0 * m0 + m1 * m1 + m2 * m2)
        if length > 0.0:
            m0, m1, m2 = m0 / length, m1 / length, m2 / length
        # Advances while outside the wall, closes in on the root once it has passed it.
        low, high, s, closing = 0.0, length, 0.0, 0
        while closing < 100:
            y0, y1, y2 = a0 + s * m0, a1 + s * m1, a2 + s * m2
            place = locate(constants, table, keys, y0, y1, y2, place)
            cell = place[3]
            F = slope = 0.0
            if cell >= 0:
                F, n0, n1, n2, _, _, _, _, _, _ = evaluate(
                    constants, cells, groups, slots, plates, balls, cell, y0, y1, y2
                )
                slope = sign * (n0 * m0 + n1 * m1 + n2 * m2)
            g = sign * (F - 1.0)
            if g > 0.0:
                low = s
            else:
                high = s
                if s == 0.0:
                    break
                closing = max(closing, 1)
            if closing == 0:
                if s >= length:
                    s = np.nan
                    break
                step = width
                if cell >= 0:
                    # A tenth of the tolerance in F: |∇F| is near 2/r(k² − 1) at the wall; half of that for safety
                    depth = 0.1 * tolerance / (bounds[cell, 3] * (constants[2] ** 2 - 1.0))
                    reach = (min(g, 0.5) + depth) / bounds[cell, 0]
                    if sign > 0.0:
                        bend = bounds[cell, 1]
                        reach = max(reach, (slope + np.sqrt(slope * slope + 2.0 * bend * (g + depth))) / bend)
                    step = min(step, reach)
                s = min(s + step, length)
                continue
            closing += 1
            new = s - g / slope if slope < 0.0 else low
            if not (low < new < high):
                new = 0.5 * (low + high)
            settled = abs(new - s) <= 4e-16 * length or new <= low or new >= high
            s = new
            if settled:
                break
        out[i] = s / length if length > 0.0 else s
    return out
