"""The spatial index of a subdivision surface: which patches can be nearest to a point, compiled.

A complete binary tree: node k has the children 2k + 1 and 2k + 2; leaf m holds patches order[first[m]:first[m + 1]].
Oracle: a minimisation over all patches.
"""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray

from contact.surfaces.subdivision import Patches
from contact.surfaces.subdivision_kernel import bezier_points, descend, evaluate, quarter_of

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

LEAF = 4  # patches in a leaf, at most


def arrange(centres: Floats) -> tuple[Ints, Ints]:
    """The order of patches by their centres (p, 3), halved in the longest direction, and where leaves begin."""
    parts = [np.arange(len(centres))]
    while max(len(part) for part in parts) > LEAF:
        halves = []
        for part in parts:
            x = centres[part]
            axis = int(np.argmax(np.ptp(x, axis=0))) if len(part) else 0
            part = part[np.argsort(x[:, axis], kind="stable")]
            halves += [part[: (len(part) + 1) // 2], part[(len(part) + 1) // 2 :]]
        parts = halves
    return np.concatenate(parts), np.append(0, np.cumsum([len(part) for part in parts]))


@njit(cache=True, error_model="numpy")
def fit(patches: Patches, control: Floats, order: Ints, first: Ints, boxes: Floats) -> None:
    """Boxes (2 leaves − 1, 6) of the nodes, about the control points: no patch leaves their hull."""
    leaves = len(first) - 1
    for node in range(2 * leaves - 2, -1, -1):
        box = boxes[node]
        box[:3], box[3:] = np.inf, -np.inf
        if node >= leaves - 1:
            for m in range(first[node - leaves + 1], first[node - leaves + 2]):
                net = patches.net[order[m]]
                for k in range(len(net)):
                    for i in range(3):
                        box[i] = min(box[i], control[net[k], i])
                        box[3 + i] = max(box[3 + i], control[net[k], i])
        else:
            for child in (2 * node + 1, 2 * node + 2):
                for i in range(3):
                    box[i] = min(box[i], boxes[child, i])
                    box[3 + i] = max(box[3 + i], boxes[child, 3 + i])


@njit(cache=True, error_model="numpy")
def _to_box(box: Floats, x: Floats) -> float:
    """Squared distance from a box."""
    total = 0.0
    for i in range(3):
        away = max(box[i] - x[i], 0.0, x[i] - box[3 + i])
        total += away * away
    return total


@njit(cache=True, error_model="numpy")
def search(
    patches: Patches, control: Floats, edge: float, order: Ints, first: Ints, boxes: Floats, x: Floats
) -> tuple[Ints, Floats]:
    """Patch and place of the closest point to each x: every patch whose box is nearer than the best is descended."""
    leaves = len(first) - 1
    patch, at = np.zeros(len(x), dtype=np.int64), np.zeros((len(x), 2))
    stack = np.empty(128, dtype=np.int64)
    S, b, c = np.empty((6, 3)), np.empty((15, 3)), np.empty((15, 3))
    for i in range(len(x)):
        best, top = np.inf, 1
        stack[0] = 0
        while top > 0:
            top -= 1
            node = stack[top]
            if not _to_box(boxes[node], x[i]) < best:
                continue
            if node < leaves - 1:
                near, far = 2 * node + 1, 2 * node + 2
                if _to_box(boxes[far], x[i]) < _to_box(boxes[near], x[i]):
                    near, far = far, near
                stack[top], stack[top + 1] = far, near
                top += 2
                continue
            for m in range(first[node - leaves + 1], first[node - leaves + 2]):
                p, v, w, square, _ = descend(patches, control, x[i], order[m], 1 / 3, 1 / 3, edge, S, b, c)
                if square < best:
                    best, patch[i], at[i, 0], at[i, 1] = square, p, v, w
    return patch, at


@njit(cache=True, error_model="numpy")
def lower_bounds(patches: Patches, control: Floats, order: Ints, first: Ints, boxes: Floats, x: Floats) -> Floats:
    """The distance of each x from the nearest leaf's box, with the sign of its side of a patch there, (q)."""
    leaves = len(first) - 1
    result = np.empty(len(x))
    stack = np.empty(128, dtype=np.int64)
    S, b, c = np.empty((6, 3)), np.empty((15, 3)), np.empty((15, 3))
    for i in range(len(x)):
        best, leaf, top = np.inf, leaves - 1, 1
        stack[0] = 0
        while top > 0 and best > 0.0:
            top -= 1
            node = stack[top]
            away = _to_box(boxes[node], x[i])
            if not away < best:
                continue
            if node < leaves - 1:
                near, far = 2 * node + 1, 2 * node + 2
                if _to_box(boxes[far], x[i]) < _to_box(boxes[near], x[i]):
                    near, far = far, near
                stack[top], stack[top + 1] = far, near
                top += 2
            else:
                best, leaf = away, node
        p = order[first[leaf - leaves + 1]]
        level, quarter, v, w, rate = quarter_of(patches, p, 1 / 3, 1 / 3)
        bezier_points(patches, control, p, level, quarter, b)
        evaluate(b, v, w, rate, c, S)
        side = 0.0
        for k in range(3):
            k1, k2 = (k + 1) % 3, (k + 2) % 3
            side += (x[i, k] - S[0, k]) * (S[1, k1] * S[2, k2] - S[1, k2] * S[2, k1])
        result[i] = np.sqrt(best) if side >= 0.0 else -np.sqrt(best)
    return result
