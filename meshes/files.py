"""Reading of meshes from files and writing of gmsh's format."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from contextlib import redirect_stderr, redirect_stdout
from io import StringIO
from os import PathLike
from pathlib import Path
from typing import IO, Any

import numpy as np
from numpy.typing import NDArray

from meshes.mesh import Mesh
from meshes.simplices import NAMES

REST = "no region"
"""The physical group of cells in no region: meshio cannot read files in which only some cells have a group."""

GMSH_TYPES = {"vertex": 15, "line": 1, "triangle": 2, "tetra": 4, "line3": 8, "triangle6": 9, "tetra10": 11}


def read(path: str | PathLike[str]) -> Mesh:
    """Read a mesh from any format that meshio reads; gmsh's ``.msh`` 2.2 and 4.1 with their physical groups.

    The cells are those of the highest dimension. Groups of them become regions, groups of their facets become facets
    under the same name, or under their number where they have none; cells of lower dimensions are left out.
    Trailing coordinates that are the same at all nodes are dropped: a mesh in a plane z = const. is two-dimensional.

    Raises
    ------
    ValueError
        Names the file: it is missing or cannot be read, its cells are of several types or no simplices, it is a curved
        surface or line, or `Mesh` refuses it.
    """
    raw = raw_mesh(Path(path))
    try:
        return _convert(raw)
    except ValueError as error:
        raise ValueError(f"{path}: {error}") from None


def raw_mesh(path: Path) -> Any:
    """A file as meshio reads it; ValueError in one line where there is none, or none that it can read."""
    import meshio

    if not path.is_file():
        raise ValueError(f"{path}: no such file")
    said = StringIO()
    try:
        with redirect_stdout(said), redirect_stderr(said):
            return meshio.read(path)
    except (Exception, SystemExit) as error:  # meshio exits the interpreter where no reader accepts the file
        reason = said.getvalue() if isinstance(error, SystemExit) else str(error)
        if "gmsh:physical" in reason:
            reason = "some cells have no physical group: save only those that have one (gmsh's Mesh.SaveAll = 0)"
        reason = " ".join(reason.split()) or type(error).__name__
        raise ValueError(f"{path}: cannot be read: {reason}") from None


def _convert(raw: Any) -> Mesh:
    dim = max((block.dim for block in raw.cells), default=0)
    if dim == 0:
        raise ValueError("no cells: must have lines, triangles or tetrahedra")
    cells, regions = _groups(raw, dim)
    facets, names = _groups(raw, dim - 1)
    points = np.asarray(raw.points, dtype=float)
    used = points[np.unique(cells)]
    scale = np.ptp(used, axis=0).max()
    while points.shape[1] > dim and np.ptp(used[:, points.shape[1] - 1]) <= 1e-12 * scale:
        points = points[:, :-1]
    if points.shape[1] != dim:
        raise ValueError(f"cells of dimension {dim} with {points.shape[1]} coordinates that vary: must be {dim}")
    regions.pop(REST, None)
    return Mesh(points, cells, {name: facets[rows] for name, rows in names.items()}, regions)


def _groups(raw: Any, dim: int) -> tuple[NDArray[np.int64], dict[str, NDArray[np.int64]]]:
    """All cells of a dimension, and by name the rows of them in each group; facets are cut to their vertices."""
    blocks = [(k, block) for k, block in enumerate(raw.cells) if block.dim == dim and len(block.data)]
    types = sorted({block.type for _, block in blocks})
    if unsupported := [name for name in types if name not in NAMES]:
        raise ValueError(f"{', '.join(unsupported)} cells are unsupported: must be one of {', '.join(NAMES)}")
    top = max(block.dim for block in raw.cells)
    if dim == top and len(types) > 1:
        raise ValueError(f"{' and '.join(types)} cells are mixed: must be of one type")
    named = {tuple(value): name for name, value in raw.field_data.items() if np.shape(value) == (2,)}
    rows: dict[str, list[NDArray[np.int64]]] = {name: [] for (_, d), name in named.items() if d == dim}
    physical = raw.cell_data.get("gmsh:physical")
    start = 0
    for k, block in blocks:
        for number in [] if physical is None else np.unique(physical[k]):
            if number:  # 0 is none
                name = named.get((number, dim), str(number))
                rows.setdefault(name, []).append(start + np.flatnonzero(physical[k] == number))
        for name, sets in raw.cell_sets.items():
            if not name.startswith("gmsh:") and sets[k] is not None and len(sets[k]):
                rows.setdefault(name, []).append(start + np.asarray(sets[k], dtype=np.int64))
        start += len(block.data)
    width = dim + 1 if dim < top else None
    nodes = [np.asarray(block.data, dtype=np.int64)[:, :width] for _, block in blocks]
    cells = np.concatenate(nodes) if nodes else np.empty((0, dim + 1), dtype=np.int64)
    return cells, {name: np.concatenate([np.empty(0, dtype=np.int64), *parts]) for name, parts in rows.items()}


def write(path: str | PathLike[str], mesh: Mesh) -> None:
    """Write a mesh as gmsh's ``.msh`` 4.1 (ASCII), facets and regions as physical groups; `read` gives it back equal.

    meshio's own writer keeps one group per cell and renumbers nodes, so it is not used.

    Raises
    ------
    ValueError
        The file's name does not end in ``.msh``, or a tag cannot be written.
    """
    if Path(path).suffix != ".msh":
        raise ValueError(f"{path}: must end in .msh")
    names = [*mesh.facets, *mesh.regions]
    for name in names:
        if names.count(name) > 1 or name in ("", REST) or any(c in name for c in '"\\\n\r'):
            raise ValueError(
                f"{path}: tag {name!r}: must be non-empty, not {REST!r}, the name of a facet or of a region but not of "
                "both, and without quotes, backslashes and line breaks"
            )
    number = {name: i + 1 for i, name in enumerate([*names, REST])}
    with open(path, "w", encoding="utf-8") as file:
        file.write("$MeshFormat\n4.1 0 8\n$EndMeshFormat\n$PhysicalNames\n")
        groups = [(mesh.dim - 1, name) for name in mesh.facets] + [(mesh.dim, name) for name in (*mesh.regions, REST)]
        file.write(f"{len(groups)}\n" + "".join(f'{dim} {number[name]} "{name}"\n' for dim, name in groups))
        file.write("$EndPhysicalNames\n")
        _write_entities(file, mesh, number)


def _write_entities(file: IO[str], mesh: Mesh, number: Mapping[str, int]) -> None:
    """Nodes and elements: an entity for each set of groups that facets, or cells, share."""
    d = mesh.dim
    facets = np.unique(np.concatenate([mesh.boundary()[:0], *mesh.facets.values()]), axis=0)
    facet_groups = np.zeros((len(facets), len(mesh.facets)), dtype=bool)
    for j, named in enumerate(mesh.facets.values()):
        at = np.unique(np.concatenate([facets, named]), axis=0, return_inverse=True)[1].ravel()
        facet_groups[at[len(facets) :], j] = True
    cell_groups = np.zeros((len(mesh.cells), len(mesh.regions) + 1), dtype=bool)
    for j, region in enumerate(mesh.regions.values()):
        cell_groups[region, j] = True
    cell_groups[:, -1] = ~cell_groups.any(axis=1)

    entities: list[list[str]] = [[], [], [], []]
    blocks: list[tuple[int, int, NDArray[np.int64]]] = []
    for dim, cells, groups, names in (
        (d - 1, facets, facet_groups, list(mesh.facets)),
        (d, mesh.cells, cell_groups, [*mesh.regions, REST]),
    ):
        sets, entity = np.unique(groups, axis=0, return_inverse=True)
        for i, members in enumerate(sets):
            tags = " ".join(str(number[name]) for name, member in zip(names, members, strict=True) if member)
            box = "0 0 0" if dim == 0 else "0 0 0 0 0 0"
            entities[dim].append(f"{i + 1} {box} {members.sum()} {tags}" + (" 0" if dim else ""))
        blocks += [(dim, int(entity.ravel()[run[0]]) + 1, cells[run]) for run in _runs(entity.ravel())]

    file.write("$Entities\n" + " ".join(str(len(lines)) for lines in entities) + "\n")
    file.write("".join(f"{line}\n" for lines in entities for line in lines) + "$EndEntities\n")

    n = len(mesh.points)
    file.write(f"$Nodes\n1 {n} 1 {n}\n{d} 1 0 {n}\n")
    np.savetxt(file, np.arange(1, n + 1), "%d")
    np.savetxt(file, np.pad(mesh.points, ((0, 0), (0, 3 - d))), "%.17g")
    total = len(facets) + len(mesh.cells)
    file.write(f"$EndNodes\n$Elements\n{len(blocks)} {total} 1 {total}\n")
    names_by_kind = {kind: name for name, kind in NAMES.items()}
    start = 1
    for dim, entity_tag, cells in blocks:
        kind = names_by_kind[dim, mesh.order if dim else 1]
        nodes = cells[:, [0, 1, 2, 3, 4, 5, 6, 7, 9, 8]] if kind == "tetra10" else cells  # gmsh's order of edges
        file.write(f"{dim} {entity_tag} {GMSH_TYPES[kind]} {len(cells)}\n")
        np.savetxt(file, np.column_stack([np.arange(start, start + len(cells)), nodes + 1]), "%d")
        start += len(cells)
    file.write("$EndElements\n")


def _runs(values: NDArray[np.int64]) -> Iterator[NDArray[np.int64]]:
    """Indices of the runs of equal values, in order: cells keep their order in the file."""
    if len(values):
        yield from np.split(np.arange(len(values)), np.flatnonzero(np.diff(values)) + 1)
