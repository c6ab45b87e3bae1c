"""What a scene builds and what it leaves out, and why."""

from __future__ import annotations

from contact.scene.devices import BeamTable
from contact.scene.schema import BodyTable, ContactTable, Elastic, MeshFile, MeshShape, Scene
from contact.scene.surfaces import BodySurfaceTable

WITHOUT_GMSH = {"interval", "tube-wall", "vessel-wall", "bifurcation-wall", "catheter", "balloon"}


def explain(scene: Scene) -> str:
    """One line for each part that is built and for each that is not."""
    built, left_out = [], []
    dynamic = scene.time.integrator != "static"
    beams = {body.name for body in scene.bodies if isinstance(body, BeamTable)}
    rigid = [b.name for b in scene.bodies if b.kind == "rigid"]
    for body in scene.bodies:
        built.extend(_beam(body, dynamic) if isinstance(body, BeamTable) else _body(body, dynamic))
    for contact in scene.contacts:
        if contact.body in beams:
            built.append(f"contact {contact.name!r}: points along {contact.body}, rows for those near the surface only")
            if isinstance(contact.surface, BodySurfaceTable):
                built.extend(_wall(contact.name, contact.surface, rigid))
            continue
        if isinstance(contact.surface, BodySurfaceTable):
            built.append(_between(contact, contact.surface))
            continue
        rows = "one row of H per node" if contact.constraint == "nodal" else "one row of H per vertex (mortar)"
        planes = "formed once" if contact.sliding == "small" else "formed anew in each pass"
        built.append(f"contact {contact.name!r}: {rows} of {contact.body}/{contact.tag}, {planes}")
    if any(contact.body not in beams for contact in scene.contacts):
        built.append(f"Delassus operator: columns for the rows that method {scene.solver.method!r} asks for, each once")
    elif scene.contacts:
        walls = any(isinstance(c.surface, BodySurfaceTable) and c.surface.body not in rigid for c in scene.contacts)
        kept = ", and from a wall's columns that are kept" if walls else ""
        built.append(f"Delassus operator: entries from the inverse's blocks along the beam, without solves{kept}")
    if scene.solver.minimum_norm:
        built.append("minimum norm: columns of W for all closed rows, and of all forces that solve it the least")
    if scene.solver.compiled:
        built.append("step: one compiled call; the plain step takes those that need more than most do")
    if not dynamic:
        left_out.append("mass and damping matrices: the scene is quasi-static")
    left_out.append("tangential rows: no contact names friction")
    if rigid:
        left_out.append(f"stiffness matrix and solver of {', '.join(rigid)}: rigid")
    if not scene.contacts:
        left_out.append("detection, Delassus operator and contact solver: no contact")
    if not any(_uses_gmsh(b) for b in scene.bodies):
        left_out.append("gmsh: no mesh needs it")
    left_out.append("plotting libraries: loaded by --plot and the command plot only")
    return "\n".join([f"built: {line}" for line in built] + [f"left out: {line}" for line in left_out])


def _between(contact: ContactTable, surface: BodySurfaceTable) -> str:
    side = {"auto": "the finer side, else the softer", "body": contact.body, "other": surface.body}[contact.side]
    where = "of the undeformed state, once" if contact.sliding == "small" else "of the deformed state, in each pass"
    return (
        f"contact {contact.name!r}: facets of {contact.body}/{contact.tag} and {surface.body}/{surface.tag} clipped "
        f"{where}; one row of H per vertex that looks at the other body ({contact.multiplier} multipliers on {side})"
    )


def _wall(name: str, surface: BodySurfaceTable, rigid: list[str]) -> list[str]:
    """Of a surface that a beam touches."""
    lines = [f"contact {name!r}: a subdivision surface over the facets {surface.body}/{surface.tag}, smooth everywhere"]
    if surface.body not in rigid:
        lines.append(f"body {surface.body!r}: columns of its inverse for points where it has been touched, kept")
    return lines


def _body(body: BodyTable, dynamic: bool) -> list[str]:
    if body.kind == "rigid":
        how = "a mass matrix on its rigid motions" if dynamic else "rigid motions as unknowns of the contact problem"
        return [f"body {body.name!r}: {how}"]
    kind = body.material.formulation if isinstance(body.material, Elastic) else body.kind
    dynamic = dynamic and body.density > 0
    matrices = "mass and stiffness matrix" if dynamic else "stiffness matrix"
    return [
        f"body {body.name!r}: one {matrices} ({kind}{_regions(body)}), "
        f"factorised once{' per step length' if dynamic else ''}",
        f"body {body.name!r}: {len(body.supports)} support(s), {len(body.loads)} load(s)",
        *(
            f"body {body.name!r}: springs on {s.tag} ({s.component or 'all directions'}), in its stiffness matrix"
            for s in body.supports
            if s.stiffness is not None
        ),
    ]


def _regions(body: BodyTable) -> str:
    """The regions that have materials of their own, in words."""
    names = list(body.material.regions) if isinstance(body.material, Elastic) else []
    return f" of {', '.join(names)}" if names else ""


def _beam(body: BeamTable, dynamic: bool) -> list[str]:
    count = sum(section.elements for section in body.sections)
    inertia = f", {body.mass} mass" if dynamic else ""
    return [
        f"body {body.name!r}: {count} beam elements in {len(body.sections)} section(s){inertia}, "
        "one block-tridiagonal matrix, factorised where a pass does not contract",
        f"body {body.name!r}: {len(body.supports)} support(s), {len(body.loads)} load(s)",
    ]


def _uses_gmsh(body: BodyTable | BeamTable) -> bool:
    if isinstance(body, BeamTable):
        return False
    source = body.mesh
    if isinstance(source, MeshFile) or not isinstance(source, MeshShape):
        return False
    return source.shape not in WITHOUT_GMSH and not (source.model_extra or {}).get("structured", False)
