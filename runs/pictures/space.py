"""Views of bodies in space, rendered off screen by parallel projection; pyvista is loaded only on demand."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from runs.pictures.sights import View

WIDTH = 10.7
"""Of a still, 1600 pixels [in]."""

DECADES = 1e3
"""The largest contact force over the smallest one that has a colour of its own."""


def library() -> Any:
    """pyvista; ImportError with what to install where it is missing."""
    try:
        import pyvista
    except ImportError:
        raise ImportError("pictures in space need pyvista: pip install 'signorini[plot]'") from None
    return pyvista


def plotter_of(view: View, pixels: float, far: float) -> Any:
    """What renders a view, with its lights and camera; its owner closes it.

    Parameters
    ----------
    view : View
    pixels : float
        Of a metre.
    far : float
        The camera's distance from the view's centre, and the depth behind this that is seen [m].

    Raises
    ------
    OSError
        where VTK finds nothing to render with.
    """
    pyvista = library()
    # Without a display VTK complains before it finds EGL or OSMesa.
    pyvista.vtk_verbosity("off")
    size = round(view.width * pixels), round(view.height * pixels)
    plotter: Any = pyvista.Plotter(off_screen=True, window_size=size, lighting="light kit")
    if not plotter.render_window.SupportsOpenGL():
        plotter.close()
        raise OSError("pictures in space need OpenGL: VTK found neither a display nor EGL or OSMesa")
    plotter.set_background("white")
    camera = plotter.camera
    camera.parallel_projection = True
    camera.focal_point = view.centre
    camera.position = view.centre + far * view.eye
    camera.up = view.up
    camera.parallel_scale = view.height / 2
    camera.clipping_range = (0.005 * far, 2 * far)
    return plotter


def draw_view(axes: Any, image: NDArray[np.uint8], view: View) -> Any:
    """The image with a scale bar and the directions of the axes."""
    w, h = view.width, view.height
    axes.set_axis_off()
    shown = axes.imshow(image, extent=(0, w, 0, h), interpolation="antialiased")
    length = _round(0.25 * w)
    at = np.array([0.04 * w, 0.035 * h])
    axes.plot([at[0], at[0] + length], [at[1]] * 2, color="black", linewidth=2.5, solid_capstyle="butt")
    axes.annotate(
        f"{1e3 * length:g} mm",
        at + np.array([length / 2, 0]),
        (0, 4),
        textcoords="offset points",
        ha="center",
        fontsize=9,
    )
    arm, foot = 0.06 * h, at + np.array([0.03 * h, 0.17 * h])
    for name, e in zip("xyz", np.column_stack([view.right, view.up]), strict=True):
        tip = foot + arm * e
        axes.annotate("", tip, foot, arrowprops={"arrowstyle": "-|>", "color": "black", "linewidth": 0.9, "shrinkA": 0})
        if np.linalg.norm(e) > 0.25:
            axes.text(*(foot + arm * e * (1 + 0.35 / np.linalg.norm(e))), name, ha="center", va="center", fontsize=9)
    axes.set(xlim=(0, w), ylim=(0, h))
    return shown


def _round(length: float) -> float:
    """The largest of 1, 2, 5 times a power of ten that is not above `length`."""
    power = 10.0 ** np.floor(np.log10(length))
    return float(power * max(digit for digit in (1, 2, 5) if digit * power <= length * (1 + 1e-12)))
