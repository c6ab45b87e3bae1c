"""Pictures of a record's step; matplotlib is loaded only here, on demand."""

from __future__ import annotations

import os
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from contact.record import CERTIFICATE, RecordReader
from runs.pictures.frame import Frame, Profile
from runs.pictures.plane import (
    ARROW,
    BLUE,
    GREEN,
    GREY,
    ORANGE,
    PURPLE,
    SKY,
    VERMILLION,
    Floats,
    draw_forces,
    draw_obstacle,
    draw_plane,
    draw_space,
)  # fmt: skip

if TYPE_CHECKING:
    from matplotlib.figure import Figure

DPI = 150
"""Of pictures [1/in]."""

MARKERS = "osD^v<>P"
COLOURS = (BLUE, VERMILLION, GREEN, ORANGE, PURPLE, SKY, "black", "0.5")


def plot_record(path_record: str | os.PathLike[str], path_picture: str | os.PathLike[str], step: int = -1) -> None:
    """Draw a step of a record: devices in their vessel, or deformed bodies and contact pressures beside the exact ones.

    Parameters
    ----------
    path_record : path-like
    path_picture : path-like
        Any format that matplotlib writes, by its ending; of devices also a .gif or .mp4, which shows all steps.
    step : int
        Counted from 0, or from the end if negative.

    Raises
    ------
    ImportError
        where a library that draws is missing.
    ValueError
        where the record or the step is not there, or an animation is asked for that is none of devices.
    """
    with RecordReader(path_record) as record:
        devices = "/VTKHDF/PointData/radius" in record.names
    moving = Path(path_picture).suffix in (".gif", ".mp4")
    if moving and not devices:
        raise ValueError(f"-o {path_picture}: only records of devices can be animated, must be a picture")
    if moving:
        from runs.pictures.devices import animate

        animate(path_record, path_picture)
        return
    if devices:
        from runs.pictures.devices import device_figure

        figure = device_figure(path_record, step)
    else:
        figure = record_figure(path_record, step)
    figure.savefig(path_picture, dpi=DPI)


def record_figure(path_record: str | os.PathLike[str], step: int = -1) -> Figure:
    """The figure of bodies without devices that `plot_record` saves; its parameters and errors.

    Solids that touch each other in space hide their contact: they are drawn by `runs.pictures.solids`.
    """
    figure = new_figure((12.0, 5.6))
    frame = Frame.read(path_record, step)
    if frame.touching_solids:
        from runs.pictures.solids import solid_figure

        return solid_figure(path_record, step)
    places = figure.add_gridspec(1, 2, width_ratios=(1.25, 1))
    _draw_bodies(figure, places[0], frame)
    _draw_profile(figure.add_subplot(places[1]), frame)
    caption(figure, frame, 8)
    return figure


def _draw_bodies(figure: Figure, place: Any, frame: Frame) -> None:
    from matplotlib.colors import Normalize
    from matplotlib.transforms import ScaledTranslation

    bodies, contact = frame.bodies, frame.contact
    # Stress is singular at corners and edges of contact: the last half percent must not take all the colours.
    top = float(np.quantile(bodies.values, 0.995)) or 1.0
    style = {"cmap": "viridis", "norm": Normalize(0.0, top)}
    active = contact["status"] > 0
    points, forces = contact["point"][active], (contact["lambda"][:, None] * contact["normal"])[active]
    extent = np.ptp(bodies.positions, axis=0)
    length, zorder = ARROW * float(np.linalg.norm(extent)), 5.0
    if bodies.in_space:
        axes: Any = figure.add_subplot(place, projection="3d")
        eye = _viewpoint(frame)
        colours = draw_space(axes, bodies, style, eye)
        axes.set(xlabel="x [m]", ylabel="y [m]", zlabel="z [m]")
        axes.set_box_aspect(None, zoom=0.95)
        # Forces that push towards the eye act on faces that it does not see.
        zorder = 0.5 if forces.sum(axis=0) @ eye > 0 else 5.0
    else:
        axes = figure.add_subplot(place)
        colours = draw_plane(axes, bodies, style)
        axes.set(xlabel="r [m]" if frame.axisymmetric else "x [m]", ylabel="z [m]" if frame.axisymmetric else "y [m]")
        points, forces = points[:, :2], forces[:, :2]
        if not bodies.faces:
            # The axes of a string have different scales: arrows fit the one along which they point.
            length = 2 * ARROW * float(extent[np.argmax(np.abs(forces).sum(axis=0))]) or length
    if forces.any():
        label = f"contact force λ, at most {contact['lambda'][active].max():.4g} N"
        draw_forces(axes, points, forces, length, label, zorder)
    if bodies.faces:
        axes.set_aspect("equal")
    elif not extent[1]:
        axes.set(ylim=(-1, 1), yticks=[], ylabel="")
    if not bodies.in_space:
        axes.margins(0.05)
        for obstacle, dim in frame.obstacles():
            draw_obstacle(axes, obstacle, dim)
    axes.plot([], [], color=GREY, label="undeformed")
    # Below the axis label by a length, not by a part of the axes, which may be flat.
    below = axes.transAxes + ScaledTranslation(0, -0.45, figure.dpi_scale_trans)
    axes.legend(loc="upper center", bbox_to_anchor=(0.5, 0), bbox_transform=below, ncols=2, fontsize=8, frameon=False)
    moved = float(np.linalg.norm(bodies.displacement, axis=1).max(initial=0.0))
    # Seen from below, 3D axes have their labels at the top.
    pad = 22 if bodies.in_space else None
    axes.set_title(f"deformed at true scale (×1), largest displacement {moved:.3g} m", fontsize=10, pad=pad)
    figure.colorbar(
        colours, ax=axes, label=bodies.label, shrink=0.8, pad=0.1 if bodies.in_space else 0.02,
        extend="max" if bodies.values.max() > top else "neither",
    )  # fmt: skip


def _viewpoint(frame: Frame) -> Floats:
    """From where the picture is seen: from above, on the side of the contact; from below where only that shows it."""
    x, contact, lam = frame.bodies.positions, frame.contact, frame.contact["lambda"]
    side, height = np.array([0.6, -1.0, 0.0]), 0.4
    if lam.any():
        offset = np.average(contact["point"], axis=0, weights=lam) - (x.min(axis=0) + x.max(axis=0)) / 2
        offset[2] = 0.0
        if np.linalg.norm(offset) > 0.1 * float(np.ptp(x, axis=0).max()):
            # Turned from the diagonal, along which the two cuts of a quarter model would look alike.
            side = offset + 0.3 * np.array([-offset[1], offset[0], 0.0])
        elif lam @ contact["normal"][:, 2] > 0:
            height = -height
    return np.asarray(side / np.linalg.norm(side) + [0.0, 0.0, height])


def _draw_profile(axes: Any, frame: Frame) -> None:
    if not len(frame.contact["lambda"]):
        axes.set_axis_off()
        axes.text(0.5, 0.5, "no contact in this step", ha="center", va="center", transform=axes.transAxes)
        return
    profile = frame.profile()
    axes.axhline(0, color="0.8", linewidth=0.8, zorder=0)
    if profile.exact is not None:
        axes.plot(*profile.exact, color="black", linewidth=1.2, label="exact", zorder=2)
    for active, face, label in ((True, BLUE, "active"), (False, "white", "not active")):
        chosen = profile.active == active
        if not chosen.any():
            continue
        axes.plot(
            profile.place[chosen], profile.value[chosen], "o", color=BLUE, markerfacecolor=face, markersize=4,
            markeredgewidth=0.8, label=f"computed, {label} ({chosen.sum()})", zorder=3,
        )  # fmt: skip
    axes.set(xlabel=profile.place_label, ylabel=profile.value_label)
    axes.set_xlim(*_shown(profile, frame.bodies.grid.points[:, 0]))
    axes.set_title("along the contact, at undeformed places", fontsize=10)
    axes.grid(alpha=0.3)
    axes.legend(fontsize=8)


def _shown(profile: Profile, x: Floats) -> tuple[float, float]:
    """The places around the active ones, all of them where none is, and the bodies' x where there is one only."""
    place = profile.place if np.ptp(profile.place) else x
    low, high = place.min(), place.max()
    loaded = profile.place[profile.active]
    if len(loaded) > 1 and np.ptp(loaded):
        around = 0.6 * np.ptp(loaded)
        low, high = max(low, loaded.min() - around), min(high, loaded.max() + around)
    margin = 0.04 * (high - low)
    return low - margin, high + margin


def title(frame: Frame) -> str:
    """The scene's title, the time, and whether the step failed."""
    state = "" if frame.row["converged"] else "   NOT CONVERGED"
    return f"{frame.title},  t = {frame.row['time']:g} s{state}"


def caption(figure: Figure, frame: Frame, letters: float) -> None:
    """The title above; below, in two lines of small `letters` [pt], the certificate and the sizes."""
    residuals = ",  ".join(f"{name.replace('_', ' ')} {frame.row[name]:.1e}" for name in CERTIFICATE)
    size = f"unknowns {frame.run['unknowns']}" if "unknowns" in frame.run else f"nodes {len(frame.bodies.grid.points)}"
    contacts = f"contacts {frame.row['contacts']},  active {frame.row['active']}"
    figure.suptitle(title(frame), fontsize=12, color="black" if frame.row["converged"] else VERMILLION)
    figure.supxlabel(f"{residuals}\n{size},  {contacts}", fontsize=letters, color="0.3")


def new_figure(size: tuple[float, float]) -> Figure:
    """An empty figure of this size [in]; ImportError where matplotlib is missing."""
    try:
        from matplotlib.figure import Figure
    except ImportError:
        raise ImportError("pictures need matplotlib: pip install 'signorini[plot]'") from None
    return Figure(figsize=size, layout="constrained")
