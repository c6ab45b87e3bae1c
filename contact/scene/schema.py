"""The schema of a scene: every key, its unit and what is allowed.

A scene file is TOML; its tables are these models, and unknown keys are refused. The catalogue of `validation` builds
the same models in Python, where a value may also be a function (x, t).
"""

from __future__ import annotations

import tomllib
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import (
    BaseModel,
    ConfigDict,
    Discriminator,
    Field,
    Tag,
    ValidationError,
    field_validator,
    model_validator,
)

from contact.scene.devices import BeamTable, is_beam
from contact.scene.surfaces import BodyPointTable, BodySurfaceTable, Obstacle, SurfaceTable
from contact.scene.tables import Name, NotNegative, Number, Positive, Table, Value, Vector, check_value
from meshes.mesh import Mesh

Component = Literal["x", "y", "z", "r", "u"]


class MeshFile(Table):
    """A mesh that meshio reads; physical groups become tags."""

    file: Name = Field(description="path, relative to the scene file")


class MeshShape(BaseModel):
    """A generated mesh: `shape`, the parameters of that generator in `meshes` [m], and its `placement`."""

    model_config = ConfigDict(extra="allow", frozen=True)
    shape: Name


Ratio = Annotated[float, Field(gt=-1, lt=0.5)]


class RegionTable(Table):
    """The moduli of a region of the mesh."""

    E: Positive = Field(description="Young's modulus [Pa]")
    nu: Ratio = Field(description="Poisson's ratio")


class Elastic(Table):
    """Isotropic linear elasticity: E and nu of the whole body, or of its regions, or of what these leave."""

    E: Positive | None = Field(None, description="Young's modulus [Pa]")
    nu: Ratio | None = Field(None, description="Poisson's ratio")
    regions: dict[Name, RegionTable] = Field({}, description="by the mesh's name for it, E and nu of each region")
    state: Literal["plane-strain", "plane-stress", "axisymmetric", "3d"] = Field(description="which strains exist")
    formulation: Literal["displacement", "mixed"] = Field(
        "displacement", description="mixed: Taylor–Hood displacement–pressure, free of locking near nu = 1/2"
    )

    @model_validator(mode="after")
    def _moduli(self) -> Elastic:
        for key, value, other in (("E", self.E, self.nu), ("nu", self.nu, self.E)):
            if value is None and (other is not None or not self.regions):
                raise ValueError(f"{key}: missing, must be given" + (", or regions" if other is None else ""))
        return self


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
    """Prescribed displacement of a tagged part, or an elastic (Winkler) surrounding of it."""

    tag: Name
    component: Component | Literal["normal"] | None = Field(
        None, description="one direction, or of an elastic surrounding the normal; all of them where left out"
    )
    value: Value = Field(0.0, description="displacement [m], a number or an expression in x, y, z [m] and t [s]")
    stiffness: Positive | None = Field(None, description="of an elastic surrounding [Pa/m]")

    _value = field_validator("value")(check_value)

    @model_validator(mode="after")
    def _kind(self) -> SupportTable:
        if self.stiffness is not None and self.value != 0.0:
            raise ValueError(f"value = {self.value!r}: an elastic surrounding (stiffness) stands still")
        if self.stiffness is None and self.component == "normal":
            raise ValueError("component = 'normal': only of an elastic surrounding, with a stiffness")
        return self


class LoadTable(Table):
    """A load on a tagged part or on the whole body."""

    kind: Literal["body", "traction", "pressure", "force"]
    tag: Name | None = Field(None, description="where it acts; none for a body load")
    value: Value | list[Number | str] = Field(
        description="[N/m^d] body, [Pa] traction (per component) and pressure (along −n), [N] force; "
        "numbers or expressions"
    )

    _value = field_validator("value")(check_value)

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
    density: NotNegative = Field(0.0, description="[kg/m^3]; of a bar or string per length, of a membrane per area")
    mass: Literal["consistent", "lumped", "one-point"] = Field(
        "consistent", description="one-point: of linear cells, without dispersion at dt = h/c with the midpoint rule"
    )
    rayleigh: Annotated[list[NotNegative], Field(min_length=2, max_length=2)] = Field(
        [0.0, 0.0], description="a [1/s], b [s] of the damping a M + b K"
    )
    velocity: Value | list[Number | str] = Field(0.0, description="at the start [m/s], one entry per component")
    displacement: Value | list[Number | str] = Field(0.0, description="at the start [m]")
    supports: list[SupportTable] = Field([])
    loads: list[LoadTable] = Field([])

    _values = field_validator("velocity", "displacement")(check_value)

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
        if self.kind != "solid" and any(support.stiffness is not None for support in self.supports):
            raise ValueError(f"supports: stiffness: only a solid has an elastic surrounding, not a {self.kind}")
        if self.guided and self.kind != "rigid":
            raise ValueError(f"guided = true: only a rigid body is guided, not a {self.kind}")
        return self


def _body_kind(value: Any) -> str:
    """Which model a body's table follows."""
    return "beam" if is_beam(value) else "mesh"


AnyBody = Annotated[
    Annotated[BodyTable, Tag("mesh")] | Annotated[BeamTable, Tag("beam")],
    Discriminator(_body_kind),
]


class ContactTable(Table):
    """What may touch what."""

    name: Name = "contact"
    body: Name
    tag: Name | None = Field(None, description="of the mesh; a beam touches with all of its length")
    samples: Annotated[int, Field(ge=1)] | None = Field(None, description="contact points per element of a beam (2)")
    spacing: Positive | None = Field(None, description="of contact points along a beam, instead of samples [m]")
    surface: SurfaceTable | Obstacle = Field(
        description="plane, sphere, cylinder, paraboloid, cone, sinusoid, dome, point, or body"
    )
    constraint: Literal["nodal", "mortar"] = Field("nodal", description="against another body's surface: mortar")
    multiplier: Literal["vertex", "dual"] = Field(
        "vertex", description="functions of the pressure between two bodies: hats of the vertices, or their dual basis"
    )
    side: Literal["auto", "body", "other"] = Field(
        "auto", description="which of two bodies carries the multipliers; auto: the finer, else the softer"
    )
    sliding: Literal["small", "finite"] = Field(
        "small", description="small: normals stay those of the undeformed state; finite: detected along the motion"
    )
    direction: Vector | None = Field(None, description="fixed normal of small sliding; else that of the closest point")
    interference: NotNegative = Field(0.0, description="how deep points may start inside the surface [m]")
    clearance: Value = Field(
        0.0, description="initial gap of two bodies besides that of their meshes [m], a number or expression in x, y, z"
    )
    copies: Annotated[int, Field(ge=1)] = Field(1, description="state the same contact several times over")

    _clearance = field_validator("clearance")(check_value)

    @model_validator(mode="before")
    @classmethod
    def _between_bodies(cls, data: Any) -> Any:
        """Facets of two bodies touch by mortar."""
        if isinstance(data, dict) and data.get("tag") is not None:
            surface = data.get("surface")
            kind = surface.get("kind") if isinstance(surface, dict) else getattr(surface, "kind", None)
            if kind == "body":
                return {"constraint": "mortar", **data}
        return data

    @model_validator(mode="after")
    def _two_bodies(self) -> ContactTable:
        if not isinstance(self.surface, BodySurfaceTable):
            if given := self.model_fields_set & {"multiplier", "side", "clearance"}:
                raise ValueError(f"{min(given)}: only of a contact with surface.kind = 'body'")
        elif self.tag is not None:
            if self.constraint == "nodal":
                raise ValueError("constraint = 'nodal': the surface of a body takes 'mortar'")
            if self.direction is not None:
                raise ValueError(f"direction = {self.direction}: normals are those of the body's surface")
        return self

    @property
    def other(self) -> str | None:
        """The other body, where there is one."""
        return self.surface.body if isinstance(self.surface, BodyPointTable | BodySurfaceTable) else None

    @model_validator(mode="after")
    def _sliding(self) -> ContactTable:
        if self.direction is not None and self.sliding == "finite":
            raise ValueError(f"direction = {self.direction}: only small sliding has a fixed direction")
        return self

    def check_body(self, beam: bool) -> None:
        """ValueError for keys that the contact of a beam, or of a mesh, does not have."""
        if (self.tag is None) != beam:
            raise ValueError(f"contact.tag = {self.tag!r}: a beam has none, a mesh needs one")
        if not beam and (self.samples is not None or self.spacing is not None):
            raise ValueError("contact.samples, spacing: only a beam has them")
        if self.samples is not None and self.spacing is not None:
            raise ValueError(f"contact.spacing = {self.spacing}: a beam takes samples or spacing, not both")
        if beam and (self.direction is not None or self.constraint != "nodal" or self.sliding != "small"):
            raise ValueError("contact.constraint, sliding, direction: not of a beam, whose contact follows the motion")
        if beam and isinstance(self.surface, BodyPointTable):
            raise ValueError("contact.surface.kind = 'point': a beam touches surfaces only")


class SolverTable(Table):
    """How contact is solved and what is accepted."""

    method: Literal["status", "gauss-seidel", "lemke", "kkt", "vi-rsls", "vi-ssls", "tao", "vi-primal"] = "status"
    complementarity: Positive = 1e-8
    equilibrium: Positive = 1e-8
    surface_error: Positive = 1e-3
    penetration: Positive = 1e-3
    minimum_norm: bool = Field(default=False, description="of all forces that solve the contact, the least √Σλ² [N]")
    compiled: bool = Field(default=False, description="one compiled call a step, for one beam in vessels")
    max_passes: Annotated[int, Field(ge=1)] = 20
    max_halvings: Annotated[int, Field(ge=0)] = 6


class TimeTable(Table):
    """Steps up to `end`; loads and displacements may depend on t."""

    end: Positive = Field(default=1.0, description="[s]")
    steps: Annotated[int, Field(ge=1)] = 1
    integrator: Literal["static", "implicit-euler", "midpoint"] = "static"


class ExactTable(Table):
    """Known answers, to be drawn beside the computed ones."""

    pressure: str | None = Field(default=None, description="contact pressure [Pa], an expression in x, y, z [m]")

    _pressure = field_validator("pressure")(check_value)


class Scene(Table):
    """A scene."""

    title: str = ""
    bodies: Annotated[list[AnyBody], Field(min_length=1, alias="body")]
    contacts: list[ContactTable] = Field([], alias="contact")
    solver: SolverTable = SolverTable()
    time: TimeTable = TimeTable()
    exact: ExactTable = ExactTable()

    @model_validator(mode="after")
    def _names(self) -> Scene:
        names = [body.name for body in self.bodies]
        beams = {body.name for body in self.bodies if isinstance(body, BeamTable)}
        if len(set(names)) < len(names):
            raise ValueError(f"body names {names}: must differ")
        for contact in self.contacts:
            for key, name in (("body", contact.body), ("surface.body", contact.other)):
                if name is not None and name not in names:
                    raise ValueError(f"contact.{key} = {name!r}: must be one of {', '.join(names)}")
            if isinstance(contact.surface, BodySurfaceTable):
                if contact.surface.body in beams:
                    raise ValueError(f"contact.surface.body = {contact.surface.body!r}: a beam has no facets")
                if self.time.integrator == "midpoint":
                    raise ValueError("time.integrator = 'midpoint': two bodies touch by 'static' or 'implicit-euler'")
            contact.check_body(contact.body in beams)
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
    except (OSError, UnicodeDecodeError, tomllib.TOMLDecodeError) as error:
        raise ValueError(f"{path}: {error}") from None
    for change in changes or []:
        apply_change(data, change)
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
    branch |= {2} if parts[:1] == ["body"] and len(parts) > 2 else set()
    branch |= {i + 1 for i, part in enumerate(parts) if part in ("mesh", "material") and i not in branch}
    branch |= {i + 1 for i, part in enumerate(parts) if part == "shape" and i not in branch}
    branch |= {i for i, part in enumerate(parts) if str(part).startswith("literal[") or part == "float"}
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
    if message[1:2].islower():  # a sentence, not a symbol
        message = message[:1].lower() + message[1:]
    return f"{key}{shown}: {message}" if key else message


def apply_change(data: dict[str, Any], change: str) -> None:
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
