"""Pictures of a record's step; matplotlib is loaded only here, on demand."""

from __future__ import annotations

import os
import tomllib
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from pydantic import TypeAdapter

from contact.expression import Expression
from contact.record import CERTIFICATE, RecordReader
from contact.scene import apply_change
from contact.scene_surfaces import SurfaceTable, surface_of
from contact.surfaces import Surface
from runs.pictures import (
    ARROW,
    BLUE,
    GREEN,
    GREY,
    ORANGE,
    PURPLE,
    SKY,
    VERMILLION,
    Bodies,
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


@dataclass(frozen=True, eq=False)
class Profile:
    """Contact pressure or force along the contact.

    Attributes
    ----------
    place, value : (c,)
        Coordinate [m] and pressure or force of each constraint, sorted by place.
    active : (c,) bool
    exact : (2, s) or None
        Places and values of the exact curve.
    place_label, value_label : str
    """

    place: Floats
    value: Floats
    active: np.ndarray[Any, np.dtype[np.bool_]]
    exact: Floats | None
    place_label: str
    value_label: str


@dataclass(frozen=True, eq=False)
class Frame:
    """A step of a record, read."""

    title: str
    scene: Mapping[str, Any]
    run: Mapping[str, Any]
    row: Mapping[str, Any]
    bodies: Bodies
    point_data: Mapping[str, Floats]
    contact: Mapping[str, Floats]
    folders: tuple[Path, ...]

    @classmethod
    def read(cls, path: str | os.PathLike[str], step: int) -> Frame:
        """Step number `step`, negative from the end.

        Raises
        ------
        ValueError
            where `path` is no record, or has no such step or no displacement, or its scene is no TOML.
        """
        with RecordReader(path) as record:
            index = step + record.count if step < 0 else step
            point_data, cell_data = record.fields(index)
            if "displacement" not in point_data:
                raise ValueError(f"{path}: has the point arrays {', '.join(point_data) or 'none'}, needs displacement")
            try:
                scene = _as_run(record.scene)
            except tomllib.TOMLDecodeError as error:
                raise ValueError(f"{path}: the scene that it keeps is no TOML: {error}") from None
            u = point_data["displacement"]
            return cls(
                title=scene.get("title") or record.path.stem,
                scene=scene,
                run=record.run,
                row={name: values[index] for name, values in record.steps().items()},
                bodies=Bodies(record.grid(), u, *_coloured(u, point_data, cell_data)),
                point_data=point_data,
                contact=record.contact(index),
                folders=(*_folder(record.run), record.path.parent, Path(), Path(__file__).parent),
            )

    @property
    def axisymmetric(self) -> bool:
        """Whether x is a radius."""
        tables = self.scene.get("body", [])
        return any(body.get("material", {}).get("state") == "axisymmetric" for body in tables)

    def obstacles(self) -> list[tuple[Surface, int]]:
        """The rigid surfaces of the scene's contacts, and their numbers of coordinates.

        Raises
        ------
        FileNotFoundError
            where a surface's file is neither in the scene's folder, beside the record, in the current folder nor here.
        """
        tables = [table["surface"] for table in self.scene.get("contact", []) if table["surface"]["kind"] != "point"]
        read = TypeAdapter(SurfaceTable).validate_python
        return [(surface_of(read(table), self._folder_of(table)), len(_anchor(table))) for table in tables]

    def _folder_of(self, table: Mapping[str, Any]) -> Path:
        """Where the file of a surface's table is."""
        name = table.get("file")
        if name is None:
            return Path()
        for folder in self.folders:
            if (folder / name).is_file():
                return folder
        raise FileNotFoundError(f"{name}: neither beside the record nor in the current folder")

    def profile(self) -> Profile:
        """Pressure, or λ where the record has no pressure, over the undeformed place of the contact points."""
        x, nodes = self._contact_nodes()
        value, label = self.contact["lambda"], "contact force λ [N]"
        pressure = self.point_data.get("contact_pressure", np.zeros(len(self.bodies.grid.points)))[nodes]
        if pressure.any():
            unit = "Pa" if self.bodies.faces else "N/m"
            value, label = pressure, f"contact pressure p [{unit}]"
        place, place_label, path = self._along(x)
        order = np.argsort(place, kind="stable")
        exact = None
        text = self.scene.get("exact", {}).get("pressure")
        if text is not None and len(place):
            s = np.linspace(place.min(), place.max(), 4001)
            exact = np.stack([s, Expression(text)(path(s), float(self.row["time"]))])
        active = np.asarray(self.contact["status"] > 0)
        return Profile(place[order], value[order], active[order], exact, place_label, label)

    def _contact_nodes(self) -> tuple[Floats, Any]:
        """Undeformed positions of the contact points, and their nodes: those that are nearest after deformation."""
        from scipy.spatial import cKDTree

        nodes = cKDTree(self.bodies.positions).query(self.contact["point"])[1]
        return self.bodies.grid.points[nodes], nodes

    def _along(self, x: Floats) -> tuple[Floats, str, Any]:
        """Coordinate of the contact points x (c, 3) along the contact, its name, and positions as a function of it."""
        normals = self.contact["normal"]
        if self.bodies.in_space:
            pole = self._pole()
            axis = int(np.argmax(np.abs(normals).sum(axis=0)))
            offset = np.delete(x - pole, axis, axis=1)
            place = np.linalg.norm(offset, axis=1)
            outermost = x[np.argmax(place)] - pole if len(x) else np.zeros(3)
            outermost[axis] = 0.0
            ray = outermost / (np.linalg.norm(outermost) or 1.0)
            return place, "distance from the pole of contact r [m]", lambda s: pole + s[:, None] * ray
        if not self.bodies.faces or (np.abs(normals[:, 1]) > 0.5).all():
            place, label = x[:, 0], "r [m]" if self.axisymmetric else "x [m]"
        elif (np.abs(normals[:, 0]) > 0.5).all() and np.ptp(x[:, 0]) < np.ptp(x[:, 1]):
            place, label = x[:, 1], "z [m]" if self.axisymmetric else "y [m]"
        else:
            place, label = arc_length(x), "arc length along the contact s [m]"
        order = np.argsort(place, kind="stable")
        return place, label, lambda s: np.stack([np.interp(s, place[order], c[order]) for c in x.T], axis=1)

    def _pole(self) -> Floats:
        """The point from which radii are measured: where the first obstacle is anchored."""
        given = next((_anchor(table["surface"]) for table in self.scene.get("contact", [])), [])
        return np.append(np.asarray(given, dtype=float), np.zeros(3 - len(given)))


def _folder(run: Mapping[str, Any]) -> list[Path]:
    """The scene's folder, where the record of the run knows it."""
    return [Path(run["folder"])] if "folder" in run else []


def _as_run(text: str) -> dict[str, Any]:
    """A record's scene after the changes that follow its text."""
    scene = tomllib.loads(text)
    for line in text.splitlines():
        if line.startswith("# --set "):
            apply_change(scene, line.removeprefix("# --set "))
    return scene


def _anchor(table: Mapping[str, Any]) -> list[float]:
    """The point that a surface's table names, without coordinates where there is none."""
    return next((table[key] for key in ("origin", "centre", "point") if key in table), [])


def arc_length(x: Floats) -> Floats:
    """Length along the curve through points (c, 3) that is star-shaped about their centroid, from its widest gap on."""
    angle = np.arctan2(*(x - x.mean(axis=0))[:, 1::-1].T)
    order = np.argsort(angle, kind="stable")
    gaps = np.linalg.norm(x[order] - x[np.roll(order, 1)], axis=1)
    order = np.roll(order, -int(np.argmax(gaps)))
    steps = np.linalg.norm(np.diff(x[order], axis=0), axis=1)
    length = np.empty(len(x))
    length[order] = np.append(0.0, np.cumsum(steps))
    return length


def von_mises(stress: Floats) -> Floats:
    """√(½[(σ_xx−σ_yy)² + (σ_yy−σ_zz)² + (σ_zz−σ_xx)²] + 3(σ_xy² + σ_yz² + σ_xz²)) from (n, 6) in VTK's order [Pa]."""
    normal, shear = stress[:, :3], stress[:, 3:]
    return np.asarray(np.sqrt(0.5 * ((normal - np.roll(normal, 1, axis=1)) ** 2).sum(1) + 3 * (shear**2).sum(1)))


def _coloured(u: Floats, point_data: Mapping[str, Floats], cell_data: Mapping[str, Floats]) -> tuple[Floats, bool, str]:
    """What colours show: values, whether they belong to cells, their label."""
    for in_cells, data in ((False, point_data), (True, cell_data)):
        if "stress" in data and data["stress"].any():
            return von_mises(data["stress"]), in_cells, "von Mises stress [Pa]"
    return np.linalg.norm(u, axis=1), False, "displacement |u| [m]"


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
        from runs.device_pictures import animate

        animate(path_record, path_picture)
        return
    if devices:
        from runs.device_pictures import device_figure

        figure = device_figure(path_record, step)
    else:
        figure = record_figure(path_record, step)
    figure.savefig(path_picture, dpi=DPI)


def record_figure(path_record: str | os.PathLike[str], step: int = -1) -> Figure:
    """The figure of bodies without devices that `plot_record` saves; its parameters and errors."""
    figure = new_figure((12.0, 5.6))
    frame = Frame.read(path_record, step)
    places = figure.add_gridspec(1, 2, width_ratios=(1.25, 1))
    _draw_bodies(figure, places[0], frame)
    _draw_profile(figure.add_subplot(places[1]), frame)
    figure.suptitle(title(frame), color="black" if frame.row["converged"] else VERMILLION)
    figure.supxlabel(footer(frame), fontsize=8, color="0.3")
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


def footer(frame: Frame) -> str:
    """The certificate and the sizes, in two lines."""
    residuals = ",  ".join(f"{name.replace('_', ' ')} {frame.row[name]:.1e}" for name in CERTIFICATE)
    size = f"unknowns {frame.run['unknowns']}" if "unknowns" in frame.run else f"nodes {len(frame.bodies.grid.points)}"
    return f"{residuals}\n{size},  contacts {frame.row['contacts']},  active {frame.row['active']}"


def new_figure(size: tuple[float, float]) -> Figure:
    """An empty figure of this size [in]; ImportError where matplotlib is missing."""
    try:
        from matplotlib.figure import Figure
    except ImportError:
        raise ImportError("pictures need matplotlib: pip install 'signorini[plot]'") from None
    return Figure(figsize=size, layout="constrained")
