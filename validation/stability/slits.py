"""A slit between two plates, from too narrow for the block in it to too wide."""

from __future__ import annotations

from typing import Any

from validation.stability.point import decades

SLITS = (*(-w for w in decades(-9, -3)[::-1]), 0.0, *decades(-9, -3))
"""Its width less the height of a block of 1 m [m]."""


def plates(width: float, height: float = 1.0, dim: int = 2) -> list[dict[str, Any]]:
    """The contacts of a body named block, `height` [m] high, with a plate at its bottom and one `width` above its top.

    Where the slit is too narrow the overlap is declared.
    """
    at = {"lower": ("bottom", 0.0, 1.0), "upper": ("top", height + width, -1.0)}
    across = [0.0] * (dim - 1)
    return [
        {
            "name": name,
            "body": "block",
            "tag": tag,
            "surface": {"kind": "plane", "point": [*across, level], "normal": [*across, up]},
            "interference": max(0.0, -width),
        }
        for name, (tag, level, up) in at.items()
    ]
