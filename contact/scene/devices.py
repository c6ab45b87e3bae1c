"""The schema of a scene's beams: devices and rods made of sections in a row."""

from __future__ import annotations

from typing import Annotated, Any, Literal

from pydantic import Field, field_validator, model_validator

from contact.scene.tables import Name, NotNegative, Number, Positive, Table, Value, check_value

Vector3 = Annotated[list[Number], Field(min_length=3, max_length=3)]
Values3 = Annotated[list[Number | str], Field(min_length=3, max_length=3)]
Freedom = Literal["x", "y", "z", "rx", "ry", "rz"]
FREEDOMS: tuple[Freedom, ...] = ("x", "y", "z", "rx", "ry", "rz")


class StraightTable(Table):
    """A straight rest shape."""

    kind: Literal["straight"] = "straight"


class ArcTable(Table):
    """A rest shape bent to a circle."""

    kind: Literal["arc"]
    radius: Positive = Field(description="of the circle [m]")
    plane: Number = Field(0.0, description="angle of the plane of bending about the tangent [rad]")


class HelixTable(Table):
    """A helical rest shape."""

    kind: Literal["helix"]
    radius: Positive = Field(description="of the helix [m]")
    pitch: Number = Field(description="advance in one turn [m]")
    plane: Number = Field(0.0, description="angle of the plane of bending about the tangent [rad]")


class PolylineTable(Table):
    """A rest shape through points, with rotation-minimising frames; the section's length is theirs."""

    kind: Literal["polyline"]
    points: Annotated[list[Vector3], Field(min_length=2)] = Field(description="[m]")


class LinesTable(Table):
    """A rest shape along a line mesh that meshio reads, as of gmsh; the section's length is the mesh's."""

    kind: Literal["lines"]
    file: Name = Field(description="path, relative to the scene file")


RestShape = Annotated[StraightTable | ArcTable | HelixTable | PolylineTable | LinesTable, Field(discriminator="kind")]


class SectionTable(Table):
    """One section of a beam: its length, elements, rest shape, and a material with radii or the stiffnesses as such."""

    length: Positive | None = Field(None, description="[m]; none for a shape that has its own")
    elements: Annotated[int, Field(ge=1)]
    shape: RestShape = StraightTable()
    radius: NotNegative = Field(description="outer radius [m]; 0 only where stiffnesses are given")
    end_radius: Positive | None = Field(None, description="outer radius at the section's end, tapering to it [m]")
    inner_radius: NotNegative = Field(0.0, description="[m]")
    E: Positive | None = Field(None, description="Young's modulus [Pa]")
    nu: Annotated[float, Field(gt=-1, le=0.5)] | None = Field(None, description="Poisson's ratio, or G")
    G: Positive | None = Field(None, description="shear modulus [Pa]")
    density: NotNegative = Field(0.0, description="[kg/m^3]")
    shear: bool = Field(False, description="whether cross-sections shear (Timoshenko)")
    EA: Positive | None = Field(None, description="stretching stiffness [N]")
    GJ: Positive | None = Field(None, description="torsional stiffness [N m^2]")
    EI: Positive | None = Field(None, description="bending stiffness [N m^2]")
    mass: NotNegative = Field(0.0, description="per length [kg/m]")
    inertia: NotNegative = Field(0.0, description="rotary, of the section about a diameter [kg m]")

    @model_validator(mode="after")
    def _material(self) -> SectionTable:
        if (self.length is None) != isinstance(self.shape, PolylineTable | LinesTable):
            raise ValueError(f"length = {self.length}: a polyline and lines have their own, other shapes need one")
        direct = [key for key in ("EA", "GJ", "EI") if getattr(self, key) is not None]
        if self.E is None and len(direct) < 3:
            raise ValueError("E: missing; a section takes E with nu or G, or EA, GJ and EI")
        if self.E is not None and (direct or self.mass or self.inertia):
            given = direct[0] if direct else "mass" if self.mass else "inertia"
            raise ValueError(f"{given}: a section with E has its stiffness and mass from radius and density")
        if self.E is not None and self.radius <= 0:
            raise ValueError(f"radius = {self.radius}: must be above 0 where E is given")
        if self.E is None and (self.density or self.shear or self.end_radius or self.inner_radius):
            raise ValueError("EA, GJ, EI: a section with these takes mass and inertia, no density, shear or taper")
        return self


class PlacementTable(Table):
    """Where a beam starts: in its rest shape from a point, straight from there, or along a smooth path."""

    start: Vector3 = Field(default=[0.0, 0.0, 0.0], description="[m]")
    direction: Vector3 = Field(default=[1.0, 0.0, 0.0], description="tangent at the start")
    roll: Number = Field(default=0.0, description="angle about that tangent [rad]")
    straight: bool = Field(default=False, description="laid out straight, whatever the rest shape")
    path: Annotated[list[Vector3], Field(min_length=2)] | None = Field(
        default=None, description="points to lay it along, from its start [m]"
    )

    @model_validator(mode="after")
    def _one(self) -> PlacementTable:
        if self.path is not None and self.straight:
            raise ValueError("straight = true: a beam laid along a path is not straight; leave one of them out")
        return self


class BeamSupportTable(Table):
    """Prescribed motion of the node nearest to a place."""

    at: Literal["start", "end"] | NotNegative = Field(description="start, end, or rest length from the start [m]")
    hold: list[Freedom] = Field(list(FREEDOMS), description="which of x, y, z [m], rx, ry, rz [rad]")
    push: Value = Field(0.0, description="displacement along the initial tangent [m], a number or expression in t")
    twist: Value = Field(0.0, description="rotation about the initial tangent [rad]")
    displacement: Values3 | None = Field(None, description="displacement [m], numbers or expressions in t")
    rotation: Values3 | None = Field(None, description="rotation vector [rad]")

    _values = field_validator("push", "twist", "displacement", "rotation")(check_value)


class BeamLoadTable(Table):
    """A dead load: per rest length, by gravity, or at the node nearest to a place."""

    kind: Literal["line", "gravity", "point"]
    at: Literal["start", "end"] | NotNegative | None = Field(None, description="of a point load, as for supports")
    value: Values3 = Field([0.0, 0.0, 0.0], description="[N/m] line, [m/s^2] gravity, [N] point")
    moment: Values3 | None = Field(None, description="of a point load [N m]")

    _values = field_validator("value", "moment")(check_value)

    @model_validator(mode="after")
    def _place(self) -> BeamLoadTable:
        if (self.at is None) == (self.kind == "point"):
            raise ValueError(f"at = {self.at!r}: a {self.kind} load {'needs a' if self.at is None else 'has no'} place")
        if self.moment is not None and self.kind != "point":
            raise ValueError(f"moment: a {self.kind} load has none")
        return self


class BeamTable(Table):
    """A beam: sections in a row, where it starts, supports and loads."""

    name: Name
    kind: Literal["beam"]
    sections: Annotated[list[SectionTable], Field(min_length=1)]
    placement: PlacementTable = PlacementTable()
    supports: list[BeamSupportTable] = Field([])
    loads: list[BeamLoadTable] = Field([])
    mass: Literal["consistent", "lumped"] = "lumped"
    rayleigh: Annotated[list[NotNegative], Field(min_length=2, max_length=2)] = Field(
        [0.0, 0.0], description="a [1/s], b [s] of the damping a M + b K"
    )
    velocity: Vector3 = Field([0.0, 0.0, 0.0], description="at the start [m/s]")


def is_beam(value: Any) -> bool:
    """Whether a body's table is a beam's."""
    return isinstance(value, BeamTable) or (isinstance(value, dict) and value.get("kind") == "beam")
