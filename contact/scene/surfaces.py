"""The schema of a scene's surfaces, and the surfaces that its tables stand for."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

import numpy as np
from pydantic import Field, PlainValidator, model_validator

from contact.scene.tables import Name, Number, Positive, Table, Vector
from contact.surfaces import implicit as surfaces
from contact.surfaces.implicit import Surface

if TYPE_CHECKING:
    from meshes.vessels import VesselTree

Point = Annotated[list[Number], Field(min_length=3, max_length=3)]
Row4 = Annotated[list[Number], Field(min_length=4, max_length=4)]


class PlaneTable(Table):
    """The half-space n·(x − p) ≥ 0."""

    kind: Literal["plane"]
    point: Vector = Field(description="[m]")
    normal: Vector = Field(description="points to the allowed side")


class RoundTable(Table):
    """A sphere or circle, or a cylinder along `axis`."""

    kind: Literal["sphere", "cylinder"]
    centre: Vector = Field(description="[m]")
    radius: Positive = Field(description="[m]")
    axis: Vector | None = Field(None, description="direction of a cylinder")
    inside: bool = Field(False, description="whether bodies stay inside")

    @model_validator(mode="after")
    def _axis(self) -> RoundTable:
        if (self.axis is None) == (self.kind == "cylinder"):
            raise ValueError(f"axis = {self.axis!r}: a cylinder needs one, a sphere has none")
        return self


class GraphTable(Table):
    """A height over the plane of the first coordinates, with its pole at `origin`."""

    origin: Vector = Field(description="[m]")
    downward: bool = Field(False, description="the obstacle is above the body")


class ParaboloidTable(GraphTable):
    """A parabola or paraboloid with radius of curvature `radius` at its pole."""

    kind: Literal["paraboloid"]
    radius: Positive = Field(description="[m]")


class ConeTable(GraphTable):
    """A wedge (plane) or cone (space, axisymmetry)."""

    kind: Literal["cone"]
    slope: Positive = Field(description="tan α of the angle between its surface and the plane")


class SinusoidTable(GraphTable):
    """Waves along x."""

    kind: Literal["sinusoid"]
    amplitude: Positive = Field(description="half the height of a wave [m]")
    wavelength: Positive = Field(description="[m]")


class DomeTable(GraphTable):
    """A hemisphere, continued by its tangent cone beyond r = `rim`."""

    kind: Literal["dome"]
    radius: Positive = Field(description="[m]")
    rim: Positive = Field(description="[m], below the radius")

    @model_validator(mode="after")
    def _rim(self) -> DomeTable:
        if self.rim >= self.radius:
            raise ValueError(f"rim = {self.rim}: must be below the radius {self.radius}")
        return self


class TorusTable(Table):
    """A tube of `radius` whose axis is a circle of radius `bend` about `centre`, across `axis`."""

    kind: Literal["torus"]
    centre: Point = Field(description="[m]")
    axis: Point
    bend: Positive = Field(description="radius of the circle [m]")
    radius: Positive = Field(description="[m]")
    inside: bool = Field(False, description="whether bodies stay inside")

    @model_validator(mode="after")
    def _axis(self) -> TorusTable:
        if not any(self.axis):
            raise ValueError(f"axis = {self.axis}: must not be zero")
        return self


class BranchTable(Table):
    """A vessel's centreline."""

    name: Name
    points: list[Row4] = Field(min_length=2, description="rows x, y, z, r [m]; the first may lie on another axis")


class BallTable(Table):
    """A ball joined in: an aneurysm, or a point of a convolution surface."""

    centre: Point = Field(description="[m]")
    radius: Positive = Field(description="[m]")


class StenosisTable(Table):
    """Radii times 1 − `fraction` at `centre`, as they were half a `length` away."""

    centre: Point = Field(description="[m]")
    length: Positive = Field(description="[m]")
    fraction: Annotated[float, Field(gt=0, lt=1)]


class TumourTable(Table):
    """What the potential loses at `centre` (it is 1 on the wall), and less up to `radius`."""

    centre: Point = Field(description="[m]")
    radius: Positive = Field(description="[m]")
    strength: Positive = Field(description="[-]")


class BlendTable(Table):
    """What all convolution surfaces have in common."""

    inside: bool = Field(True, description="whether bodies stay inside")
    reach: Annotated[float, Field(gt=1, allow_inf_nan=False)] = Field(1.5, description="kernel's support over radius")
    sharpness: Annotated[float, Field(ge=3, allow_inf_nan=False)] = Field(16.0, description="exponent p of the union")
    aneurysms: list[BallTable] = Field([])
    tumours: list[TumourTable] = Field([])


class VesselsTable(BlendTable):
    """A vessel tree, from a `file` or from `branches`."""

    kind: Literal["vessels"]
    file: Name | None = Field(None, description="an SWC file, relative to the scene")
    scale: Positive | None = Field(None, description="the unit of the file [m], 1e-3 for mm")
    branches: list[BranchTable] = Field([])
    spacing: Positive | None = Field(None, description="of samples along the axes [m]")
    stenoses: list[StenosisTable] = Field([])

    @model_validator(mode="after")
    def _source(self) -> VesselsTable:
        if (self.file is None) == (not self.branches):
            raise ValueError(f"file = {self.file!r}: vessels take either a file or branches")
        if (self.file is None) != (self.scale is None):
            raise ValueError(f"scale = {self.scale!r}: must be given with a file, and only then")
        return self


class ConvolutionTable(BlendTable):
    """A convolution surface of the compact kernel; each list of segments is one chain."""

    kind: Literal["convolution"]
    segments: list[list[Row4]] = Field([], description="chains of points x, y, z, r [m]")
    triangles: list[list[Point]] = Field([], description="three corners each [m]")
    thickness: Positive | None = Field(None, description="of the plates that triangles make [m]")

    @model_validator(mode="after")
    def _some(self) -> ConvolutionTable:
        if not self.segments and not self.triangles and not self.aneurysms:
            raise ValueError("segments, triangles, aneurysms: there must be some")
        if bool(self.triangles) != (self.thickness is not None):
            raise ValueError(f"thickness = {self.thickness!r}: must be given with triangles, and only then")
        if any(len(chain) < 2 for chain in self.segments) or any(len(t) != 3 for t in self.triangles):
            raise ValueError("segments, triangles: must have at least two points, and three corners")
        return self


class CauchyTable(Table):
    """The level T of the integral of the kernel (1 + s²ρ²)⁻² along segments."""

    kind: Literal["cauchy"]
    segments: list[list[Point]] = Field(min_length=1, description="two ends each [m]")
    width: Positive = Field(description="s [1/m]")
    level: Positive = Field(description="T [m]")
    inside: bool = Field(False, description="whether bodies stay inside")


class BodyPointTable(Table):
    """One tagged point of another body; `normal` points from it to the body in contact."""

    kind: Literal["point"]
    body: Name
    tag: Name
    normal: Vector


class BodySurfaceTable(Table):
    """The facets `tag` of another body, as they deform."""

    kind: Literal["body"]
    body: Name
    tag: Name


SurfaceTable = Annotated[
    PlaneTable
    | RoundTable
    | ParaboloidTable
    | ConeTable
    | SinusoidTable
    | DomeTable
    | TorusTable
    | VesselsTable
    | ConvolutionTable
    | CauchyTable
    | BodyPointTable
    | BodySurfaceTable,
    Field(discriminator="kind"),
]


def _obstacle(value: Any) -> Any:
    """Any object with the methods of `contact.surfaces.implicit.Surface`."""
    if not all(callable(getattr(value, name, None)) for name in ("potential", "gradient", "lipschitz")):
        raise ValueError("must be a table with a known kind, or an object with potential, gradient and lipschitz")
    return value


Obstacle = Annotated[Any, PlainValidator(_obstacle)]


def surface_of(table: Any, folder: Path) -> Surface:
    """The surface of a scene's table; any object with the methods of `Surface` is taken as it is."""
    if isinstance(table, PlaneTable):
        return surfaces.Plane(np.array(table.point), np.array(table.normal))
    if isinstance(table, RoundTable):
        if table.kind == "sphere":
            return surfaces.Sphere(np.array(table.centre), table.radius, table.inside)
        return surfaces.Cylinder(np.array(table.centre), np.array(table.axis), table.radius, table.inside)
    if isinstance(table, ParaboloidTable):
        return surfaces.paraboloid(np.array(table.origin), table.radius, table.downward)
    if isinstance(table, ConeTable):
        return surfaces.cone(np.array(table.origin), table.slope, table.downward)
    if isinstance(table, SinusoidTable):
        return surfaces.sinusoid(np.array(table.origin), table.amplitude, table.wavelength, table.downward)
    if isinstance(table, DomeTable):
        return surfaces.dome(np.array(table.origin), table.radius, table.rim, table.downward)
    if isinstance(table, TorusTable):
        return surfaces.Torus(np.array(table.centre), np.array(table.axis), table.bend, table.radius, table.inside)
    if isinstance(table, BlendTable):
        return _blend(table, folder)
    if isinstance(table, CauchyTable):
        from contact.surfaces.cauchy import CauchySurface

        return CauchySurface(np.array(table.segments), table.width, table.level, table.inside)
    result: Surface = table
    return result


def _blend(table: BlendTable, folder: Path) -> Surface:
    """The convolution surface of vessels or of primitives."""
    from contact.surfaces.convolution import ConvolutionSurface

    segments, chains, plates = None, None, None
    if isinstance(table, VesselsTable):
        segments, chains = tree_of_table(table, folder).segments()
    elif isinstance(table, ConvolutionTable):
        lines = [np.array(chain) for chain in table.segments]
        if lines:
            rows = [np.column_stack([x[:-1, :3], x[1:, :3], x[:-1, 3], x[1:, 3]]) for x in lines]
            segments, chains = np.concatenate(rows), np.repeat(np.arange(len(lines)), [len(r) for r in rows])
        if table.triangles:
            corners = np.array(table.triangles).reshape(-1, 9)
            plates = np.column_stack([corners, np.full(len(corners), (table.thickness or 0.0) / 2)])
    balls = np.array([[*ball.centre, ball.radius] for ball in table.aneurysms]).reshape(-1, 4)
    dents = np.array([[*t.centre, t.radius, t.strength] for t in table.tumours]).reshape(-1, 5)
    return ConvolutionSurface(
        segments, chains, plates, balls, dents, reach=table.reach, sharpness=table.sharpness, inside=table.inside
    )


def tree_of_table(table: VesselsTable, folder: Path) -> VesselTree:
    """The vessel tree of a table, resampled, with its stenoses."""
    from meshes.vessels import read_swc, tree_of  # splines: only where a scene has vessels

    if table.file is None:
        tree = tree_of([(b.name, np.array(b.points)) for b in table.branches], table.spacing)
    else:
        tree = read_swc(folder / table.file, table.scale or 1.0)
        if table.spacing is not None:
            tree = tree.resampled(table.spacing)
    for stenosis in table.stenoses:
        tree = tree.narrowed(np.array(stenosis.centre), stenosis.length, stenosis.fraction)
    return tree
