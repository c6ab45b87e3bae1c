"""Pictures of devices in vessels, stills and animations; pyvista is loaded only on demand."""

from __future__ import annotations

import os
import sys
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from contact.surfaces.implicit import Surface
from runs.pictures.frame import Frame
from runs.pictures.history import History, draw_contacts, draw_history
from runs.pictures.sights import Sight, View, beams_of, sight_of, smooth
from runs.pictures.space import DECADES, WIDTH, draw_view, library, plotter_of
from runs.pictures.walls import lining_of
from runs.plot import DPI, caption, new_figure, title

if TYPE_CHECKING:
    from matplotlib.figure import Figure

COLOUR_BAR = 0.9
"""Width of a bar of colours [in]."""

FRAMES, PER_SECOND = 150, 15
"""Of an animation, at most, and how many it shows a second."""

COLOURS, LINING, STEEL, WALL = "plasma", "GnBu", "#64768A", np.array([0.90, 0.40, 0.33])


class Stage:
    """A view of a record's walls, rendered off screen; devices and contacts come and go with `shot`. Close it.

    Raises
    ------
    OSError
        where VTK finds nothing to render with.
    """

    def __init__(self, sight: Sight, view: View, pixels: float) -> None:
        pyvista = library()
        self.sight, self.view, self.plotter = sight, view, plotter_of(view, pixels, 2 * sight.size)
        for wall in sight.walls:
            if len(wall.points):
                # Translucent triangles are drawn from the furthest to the nearest: depth peeling, which would order
                # them, shows nothing where VTK renders without a graphics card.
                depth = (wall.points @ view.eye)[wall.triangles].sum(axis=1)
                mesh = pyvista.PolyData.from_regular_faces(wall.points, wall.triangles[np.argsort(depth)])
                mesh.point_data.active_normals = wall.normals
                # Like glass: opaque where the wall is seen edgeways.
                steep = 1 - np.abs(wall.normals @ view.eye)
                colour = np.column_stack([np.tile(WALL, (len(steep), 1)), 0.11 + 0.6 * steep**3])
                mesh["colour"] = (255 * colour).astype(np.uint8)
                actor = self.plotter.add_mesh(mesh, scalars="colour", rgb=True, ambient=0.45, diffuse=0.65)
                # The normals are those of the potential; none are to be computed from the triangles.
                actor.prop.interpolation = "phong"
                actor.ForceTranslucentOn()

    def shot(self, frame: Frame) -> NDArray[np.uint8]:
        """The step as an image (h, w, 3)."""
        pyvista = library()
        x, radius = frame.bodies.positions, frame.point_data["radius"]
        # Nothing is rendered, and the camera stays, until all is there.
        look = {"reset_camera": False, "render": False}
        for number, beam in enumerate(beams_of(frame)):
            points, r = smooth(x[beam], radius[beam])
            line = pyvista.MultipleLines(points)
            line["radius"] = r
            tube = line.tube(scalars="radius", absolute=True, n_sides=20, capping=True)
            metal = {"color": STEEL, "smooth_shading": True, "ambient": 0.15, "specular": 0.6, "specular_power": 20}
            self.plotter.add_mesh(tube, name=f"device {number}", **metal, **look)
        self.plotter.remove_actor(["planes", "rims", "points", "lining"], **look)
        if lining := lining_of(frame, x[np.concatenate(beams_of(frame))], self.view.eye):
            mesh = pyvista.PolyData.from_regular_faces(lining.points, lining.triangles)
            mesh["moved"] = 1e3 * lining.moved
            shades = {
                "scalars": "moved",
                "cmap": LINING,
                "clim": (0.0, 1e3 * self.sight.moved),
                "ambient": 0.5,
                "diffuse": 0.55,
            }
            self.plotter.add_mesh(mesh, name="lining", show_scalar_bar=False, **shades, **look)
        active = frame.contact["lambda"] > 0
        if active.any():
            contacts = pyvista.PolyData(frame.contact["point"][active])
            contacts["normal"], contacts["force"] = frame.contact["normal"][active], frame.contact["lambda"][active]
            disc = max(2 * float(radius.max()), 0.012 * self.sight.size)
            plane = pyvista.Disc(inner=0, outer=disc, normal=(1, 0, 0), r_res=1, c_res=32)
            rim = pyvista.Disc(inner=disc, outer=1.1 * disc, normal=(1, 0, 0), r_res=1, c_res=32)
            ball = pyvista.Sphere(radius=0.4 * disc)
            look["show_scalar_bar"] = False
            for name, shape, colour in (("planes", plane, "white"), ("rims", rim, "dimgrey")):
                shapes = contacts.glyph(orient="normal", scale=False, geom=shape)
                self.plotter.add_mesh(shapes, name=name, color=colour, lighting=False, **look)
            points = contacts.glyph(orient=False, scale=False, geom=ball)
            colours = {"scalars": "force", "cmap": COLOURS, "clim": (self.sight.top / DECADES, self.sight.top)}
            self.plotter.add_mesh(
                points, name="points", log_scale=True, smooth_shading=True, ambient=0.4, **colours, **look
            )
        self.plotter.render()
        image: NDArray[np.uint8] = self.plotter.screenshot(return_img=True)
        return image

    def __enter__(self) -> Stage:
        return self

    def __exit__(self, *_: object) -> None:
        self.plotter.close()


def device_figure(path_record: str | os.PathLike[str], step: int = -1) -> Figure:
    """The scene from two sides with its contacts, and below it forces, contacts and times over all steps.

    Parameters
    ----------
    path_record : path-like
    step : int
        Counted from 0, or from the end if negative.

    Raises
    ------
    ImportError
        where pyvista or matplotlib is missing.
    ValueError
        where the record or the step is not there.
    OSError
        where VTK finds nothing to render with.
    """
    library()
    frame = Frame.read(path_record, step)
    history = History.read(path_record)
    lam = frame.contact["lambda"]
    sight = sight_of(frame, _surfaces(frame), float(lam.max(initial=0.0)) or 1.0)
    widths = [view.width for view in sight.views]
    tall = (WIDTH - COLOUR_BAR) * sight.views[0].height / sum(widths)
    figure = new_figure((WIDTH, tall + 3.1))
    places = figure.add_gridspec(2, 1, height_ratios=(tall, 2.4))
    above = places[0].subgridspec(1, 2, width_ratios=widths, wspace=0.02)
    axes = []
    for i, view in enumerate(sight.views):
        with Stage(sight, view, 1.5 * DPI * WIDTH / sum(widths)) as stage:
            image = stage.shot(frame)
        axes.append(figure.add_subplot(above[i]))
        draw_view(axes[-1], image, view)
    _draw_colours(figure, axes, sight)
    draw_history(figure, places[1], history, float(frame.row["time"]))
    caption(figure, frame, 7.5)
    return figure


def animate(path_record: str | os.PathLike[str], path_movie: str | os.PathLike[str]) -> None:
    """The scene in front over all steps, thinned to `FRAMES`: a .gif, or an .mp4 where imageio-ffmpeg is installed.

    Raises
    ------
    ImportError, ValueError, OSError
        as `device_figure`, and where the ending is another or what writes it is missing.
    """
    library()
    writer = _writer(Path(path_movie))
    history = History.read(path_record)
    last = Frame.read(path_record, -1)
    sight = sight_of(last, _surfaces(last), float(history.largest.max()) or 1.0)
    view = sight.views[0]
    tall = (8.0 - COLOUR_BAR) * view.height / view.width
    figure = new_figure((8.0, tall + 1.9))
    places = figure.add_gridspec(2, 1, height_ratios=(tall, 1.4))
    axes, below = figure.add_subplot(places[0]), figure.add_subplot(places[1])
    steps = np.unique(np.linspace(0, len(history.time) - 1, FRAMES).round().astype(int))
    with Stage(sight, view, 110 * 8.0 / view.width) as stage:
        shown = draw_view(axes, stage.shot(last), view)
        _draw_colours(figure, [axes], sight)
        draw_contacts(below, history)
        below.set_xlabel("time t [s]")
        below.legend(fontsize=8, loc="upper left")
        now = below.axvline(float(last.row["time"]), color="black", linewidth=0.8)
        heading = figure.suptitle(title(last), fontsize=11)
        # Laid out once: every frame has the same places.
        figure.draw_without_rendering()
        figure.set_layout_engine("none")
        with writer.saving(figure, os.fspath(path_movie), 100):
            for step in steps:
                frame = Frame.read(path_record, int(step))
                shown.set_data(stage.shot(frame))
                now.set_xdata([frame.row["time"]] * 2)
                heading.set_text(title(frame))
                writer.grab_frame()


def _surfaces(frame: Frame) -> list[Surface]:
    """The scene's obstacles; none, and a line that says so, where their file is missing."""
    try:
        return [surface for surface, _ in frame.obstacles()]
    except FileNotFoundError as error:
        print(f"signorini: {error}: drawn without the wall", file=sys.stderr)
        return []


def _draw_colours(figure: Figure, axes: list[Any], sight: Sight) -> None:
    from matplotlib.cm import ScalarMappable
    from matplotlib.colors import LogNorm, Normalize

    if sight.moved:
        shades = ScalarMappable(Normalize(0.0, 1e3 * sight.moved), LINING)
        figure.colorbar(shades, ax=axes, label="the wall has moved by [mm]", shrink=0.8, aspect=30, pad=0.01)
    colours = ScalarMappable(LogNorm(sight.top / DECADES, sight.top), COLOURS)
    figure.colorbar(colours, ax=axes, label="contact force λ [N]", shrink=0.8, aspect=30, pad=0.01, extend="min")


def _writer(path: Path) -> Any:
    """What writes frames to a file of this ending."""
    from matplotlib import animation, rcParams

    if path.suffix == ".gif":
        return animation.PillowWriter(fps=PER_SECOND)
    try:
        ffmpeg = import_module("imageio_ffmpeg")
    except ImportError:
        raise ImportError(
            f"{path}: an .mp4 needs imageio-ffmpeg: pip install imageio-ffmpeg, or write a .gif"
        ) from None
    rcParams["animation.ffmpeg_path"] = ffmpeg.get_ffmpeg_exe()
    return animation.FFMpegWriter(fps=PER_SECOND)
