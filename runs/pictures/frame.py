"""A record's step as pictures show it: deformed bodies and their colours, obstacles, pressures along the contact."""

from __future__ import annotations

import os
import tomllib
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from pydantic import TypeAdapter

from contact.record import RecordReader
from contact.scene.expression import Expression
from contact.scene.schema import apply_change
from contact.scene.surfaces import SurfaceTable, surface_of
from contact.surfaces.implicit import Surface
from runs.pictures.plane import Bodies, Floats


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

    @property
    def touching_solids(self) -> bool:
        """Whether there are solids in space, and one body touches another."""
        between = any(table["surface"]["kind"] == "body" for table in self.scene.get("contact", []))
        return between and bool(np.isin(self.bodies.grid.types, (10, 24)).any())

    def obstacles(self) -> list[tuple[Surface, int]]:
        """The rigid surfaces of the scene's contacts, and their numbers of coordinates.

        Raises
        ------
        FileNotFoundError
            where a surface's file is neither in the scene's folder, beside the record, in the current folder nor here.
        """
        given = [table["surface"] for table in self.scene.get("contact", [])]
        tables = [table for table in given if table["kind"] not in ("point", "body")]
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
