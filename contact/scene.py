"""The schema of a scene: every key, its unit and what is allowed.

A scene file is TOML; its tables are these models, and unknown keys are refused. The catalogue of `validation` builds
the same models in Python, where a value may also be a function (x, t).
"""

from __future__ import annotations

import tomllib
from collections.abc import Callable
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import (
    BaseModel,
    ConfigDict,
    Discriminator,
    Field,
    PlainValidator,
    Tag,
    ValidationError,
    field_validator,
    model_validator,
)

from contact.expression import Expression
from meshes.mesh import Mesh

Positive = Annotated[float, Field(gt=0, allow_inf_nan=False)]
NotNegative = Annotated[float, Field(ge=0, allow_inf_nan=False)]
Number = Annotated[float, Field(allow_inf_nan=False)]
Vector = Annotated[list[Number], Field(min_length=1, max_length=3)]
Name = Annotated[str, Field(min_length=1)]
Component = Literal["x", "y", "z", "r", "u"]
Function = Callable[..., Any]
Value = Number | str | Function


class Table(BaseModel):
    """A table of a scene: typed, frozen, and without keys that nobody reads."""

    model_config = ConfigDict(extra="forbid", frozen=True, strict=True, arbitrary_types_allowed=True)


def _check_value(value: Any) -> Any:
    parts = value if isinstance(value, list) else [value]
    for part in parts:
        if isinstance(part, str):
            Expression(part)
    return value


class MeshFile(Table):
    """A mesh that meshio reads; physical groups become tags."""

    file: Name = Field(description="path, relative to the scene file")


class MeshShape(BaseModel):
    """A generated mesh: `shape` and the parameters of that generator in `meshes` [m]."""

    model_config = ConfigDict(extra="allow", frozen=True)
    shape: Name


class Elastic(Table):
    """Isotropic linear elasticity."""

    E: Positive = Field(description="Young's modulus [Pa]")
    nu: Annotated[float, Field(gt=-1, lt=0.5)] = Field(description="Poisson's ratio")
    state: Literal["plane-strain", "plane-stress", "axisymmetric", "3d"] = Field(description="which strains exist")
    formulation: Literal["displacement", "mixed"] = Field(
        "displacement", description="mixed: Taylor–Hood displacement–pressure, free of locking near nu = 1/2"
    )


class Tension(Table):
    """A bar's EA [N], a spring's stiffness [N/m], or the tension of a string [N] or membrane [N/m]."""

    EA: Positive | None = Field(None, description="axial stiffness of a bar [N]")
    k: Positive | None = Field(None, description="stiffness of a spring between the ends of its mesh [N/m]")
    T: Positive | None = Field(None, description="tension of a string [N] or membrane [N/m]")


def _mesh_kind(value: Any) -> str:
    """Which model a mesh's table follows."""
    if isinstance(value, Mesh):
        return "mesh"
    return "file" if isinstance(value, MeshFile) or (isinstance(value, dict) and "file" in value) else "shape"


def _material_kind(value: Any) -> str:
    """Which model a material's table follows."""
    tension = isinstance(value, Tension) or (isinstance(value, dict) and {"EA", "k", "T"} & set(value))
    return "tension" if tension else "elastic"


MeshSource = Annotated[
    Annotated[MeshFile, Tag("file")] | Annotated[MeshShape, Tag("shape")] | Annotated[Mesh, Tag("mesh")],
    Discriminator(_mesh_kind),
]
Material = Annotated[
    Annotated[Elastic, Tag("elastic")] | Annotated[Tension, Tag("tension")], Discriminator(_material_kind)
]


class SupportTable(Table):
    """Prescribed displacement of a tagged part."""

    tag: Name
    component: Component | None = Field(None, description="one direction; all of them where left out")
    value: Value = Field(0.0, description="displacement [m], a number or an expression in x, y, z [m] and t [s]")

    _value = field_validator("value")(_check_value)


class LoadTable(Table):
    """A load on a tagged part or on the whole body."""

    kind: Literal["body", "traction", "pressure", "force"]
    tag: Name | None = Field(None, description="where it acts; none for a body load")
    value: Value | list[Number | str] = Field(
        description="[N/m^d] body, [Pa] traction (per component) and pressure (along −n), [N] force; "
        "numbers or expressions"
    )

    _value = field_validator("value")(_check_value)

    @model_validator(mode="after")
    def _tagged(self) -> LoadTable:
        if (self.tag is None) != (self.kind == "body"):
            raise ValueError(
                f"tag = {self.tag!r}: a {self.kind} load {'has no' if self.kind == 'body' else 'needs a'} tag"
            )
        return self


class BodyTable(Table):
    """A body: its mesh, material, supports and loads."""

    name: Name
    kind: Literal["solid", "bar", "spring", "string", "membrane", "rigid"] = "solid"
    mesh: MeshSource = Field(description="a generator's `shape` and parameters, or a `file`")
    material: Material | None = None
    guided: bool = Field(False, description="a rigid body that does not rotate")
    supports: list[SupportTable] = []
    loads: list[LoadTable] = []

    @model_validator(mode="after")
    def _consistent(self) -> BodyTable:
        needs = {"solid": ("E, nu and state",), "bar": ("EA",), "spring": ("k",), "rigid": ()}.get(self.kind, ("T",))
        given: tuple[str, ...] = ()
        if isinstance(self.material, Elastic):
            given = ("E, nu and state",)
        elif isinstance(self.material, Tension):
            given = tuple(key for key in ("EA", "k", "T") if getattr(self.material, key) is not None)
        if given != needs:
            raise ValueError(f"material: a {self.kind} takes {' '.join(needs) or 'none'}")
        if self.guided and self.kind != "rigid":
            raise ValueError(f"guided = true: only a rigid body is guided, not a {self.kind}")
        return self


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


class BodyPointTable(Table):
    """One tagged point of another body; `normal` points from it to the body in contact."""

    kind: Literal["point"]
    body: Name
    tag: Name
    normal: Vector


SurfaceTable = Annotated[
    PlaneTable | RoundTable | ParaboloidTable | ConeTable | SinusoidTable | DomeTable | BodyPointTable,
    Field(discriminator="kind"),
]


def _obstacle(value: Any) -> Any:
    """Any object with the methods of `contact.surfaces.Surface`."""
    if not all(callable(getattr(value, name, None)) for name in ("potential", "gradient", "lipschitz")):
        raise ValueError("must be a table with a known kind, or an object with potential, gradient and lipschitz")
    return value


Obstacle = Annotated[Any, PlainValidator(_obstacle)]


class ContactTable(Table):
    """What may touch what."""

    name: Name = "contact"
    body: Name
    tag: Name
    surface: SurfaceTable | Obstacle = Field(
        description="plane, sphere, cylinder, paraboloid, cone, sinusoid, dome, or point"
    )
    constraint: Literal["nodal", "mortar"] = "nodal"
    sliding: Literal["small", "finite"] = Field(
        "small", description="small: normals stay those of the undeformed state; finite: detected along the motion"
    )
    direction: Vector | None = Field(None, description="fixed normal of small sliding; else that of the closest point")
    interference: NotNegative = Field(0.0, description="how deep points may start inside the surface [m]")
    copies: Annotated[int, Field(ge=1)] = Field(1, description="state the same contact several times over")

    @model_validator(mode="after")
    def _sliding(self) -> ContactTable:
        if self.direction is not None and self.sliding == "finite":
            raise ValueError(f"direction = {self.direction}: only small sliding has a fixed direction")
        return self


class SolverTable(Table):
    """How contact is solved and what is accepted."""

    method: Literal["status", "gauss-seidel", "lemke", "kkt", "vi-rsls", "vi-ssls", "tao", "vi-primal"] = "status"
    complementarity: Positive = 1e-8
    equilibrium: Positive = 1e-8
    surface_error: Positive = 1e-3
    penetration: Positive = 1e-3
    max_passes: Annotated[int, Field(ge=1)] = 20
    max_halvings: Annotated[int, Field(ge=0)] = 6


class TimeTable(Table):
    """Quasi-static steps up to `end`; loads and displacements may depend on t."""

    end: Positive = Field(default=1.0, description="[s]")
    steps: Annotated[int, Field(ge=1)] = 1


class ExactTable(Table):
    """Known answers, to be drawn beside the computed ones."""

    pressure: str | None = Field(default=None, description="contact pressure [Pa], an expression in x, y, z [m]")

    _pressure = field_validator("pressure")(_check_value)


class Scene(Table):
    """A scene."""

    title: str = ""
    bodies: Annotated[list[BodyTable], Field(min_length=1, alias="body")]
    contacts: list[ContactTable] = Field([], alias="contact")
    solver: SolverTable = SolverTable()
    time: TimeTable = TimeTable()
    exact: ExactTable = ExactTable()

    @model_validator(mode="after")
    def _names(self) -> Scene:
        names = [body.name for body in self.bodies]
        if len(set(names)) < len(names):
            raise ValueError(f"body names {names}: must differ")
        for contact in self.contacts:
            others = [contact.surface.body] if isinstance(contact.surface, BodyPointTable) else []
            for name in [contact.body, *others]:
                if name not in names:
                    raise ValueError(f"contact.body = {name!r}: must be one of {', '.join(names)}")
        return self


def read_scene(path: Path, changes: list[str] | None = None) -> tuple[Scene, str]:
    """The scene in a TOML file and its text, after `changes` of the form ``KEY=VALUE`` with dotted keys.

    Raises
    ------
    ValueError
        One line that names the file, the key, the value and what is allowed.
    """
    try:
        text = path.read_text(encoding="utf8")
        data = tomllib.loads(text)
    except FileNotFoundError:
        raise ValueError(f"{path}: no such file") from None
    except (OSError, UnicodeDecodeError) as error:
        raise ValueError(f"{path}: {error}") from None
    except tomllib.TOMLDecodeError as error:
        raise ValueError(f"{path}: {error}") from None
    for change in changes or []:
        _apply(data, change)
    try:
        return Scene.model_validate(data), text
    except ValidationError as error:
        raise ValueError(f"{path}: {first_error(error)}") from None


def first_error(error: ValidationError) -> str:
    """The first finding of a schema check as one line: key, value and what is allowed."""
    found = error.errors()[0]
    # pydantic names the branch of a union among the keys; a scene's author never wrote it.
    parts = [str(part) if isinstance(part, str) else part for part in found["loc"]]
    branch = {i + 1 for i, part in enumerate(parts) if isinstance(part, str) and part.startswith("tagged-union")}
    branch |= {i + 1 for i, part in enumerate(parts) if part in ("mesh", "material")}
    branch |= {i - 1 for i in branch if str(parts[i - 1]).startswith("tagged-union")}
    steps = [p for i, p in enumerate(parts) if i not in branch]
    key = "".join(f"[{p}]" if isinstance(p, int) else f".{p}" for p in steps).lstrip(".")
    message = found["msg"].removeprefix("Value error, ").strip()
    if found["type"] == "extra_forbidden":
        message = "unknown key"
    if found["type"] == "missing":
        return f"{key}: missing, must be given"
    value = found["input"]
    shown = f" = {value!r}" if isinstance(value, str | int | float | bool) else ""
    return f"{key}{shown}: {message[:1].lower()}{message[1:]}" if key else message


def _apply(data: dict[str, Any], change: str) -> None:
    """Set a dotted key (``body.0.material.E=2``) to a TOML value."""
    key, equals, value = change.partition("=")
    if not equals or not key:
        raise ValueError(f"--set {change!r}: must be KEY=VALUE")
    try:
        parsed = tomllib.loads(f"value = {value}")["value"]
    except tomllib.TOMLDecodeError:
        try:
            parsed = float(value)
        except ValueError:
            parsed = value
    *path, last = key.strip().split(".")
    target: Any = data
    try:
        for part in path:
            target = target[int(part)] if isinstance(target, list) else target.setdefault(part, {})
        target[int(last) if isinstance(target, list) else last] = parsed
    except (IndexError, ValueError, TypeError, AttributeError):
        raise ValueError(f"--set {change!r}: the scene has no such key") from None
