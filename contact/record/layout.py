"""What a record holds: names, shapes and types, and the rows that one step adds.

Everything that grows does so along its first axis, by the rows of :func:`step_rows`; how many of them belong to
finished steps (:func:`committed_rows`) follows from one number, the attribute ``NSteps`` of ``/VTKHDF/Steps``,
which is written last.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any

import h5py
import numpy as np
from numpy.typing import ArrayLike, NDArray

Array = NDArray[Any]

CERTIFICATE = ("complementarity", "equilibrium", "surface_error", "penetration")
PHASES = ("assemble", "factor", "detect", "delassus", "solve", "output", "total")
_NUMBERS = ("time", "dt", "substeps", "passes", "contacts", "active", "iterations", *CERTIFICATE, "converged")
STEP_COLUMNS = (*_NUMBERS, *(f"seconds/{phase}" for phase in PHASES))
CONTACT_COLUMNS = ("lambda", "gap", "point", "normal", "body", "status")

# Points of each VTK cell type; a polyline (4) has any number of them from 2 on.
CELL_POINTS = {1: 1, 3: 2, 5: 3, 10: 4, 21: 3, 22: 6, 24: 10}
POLYLINE = 4

GRID = "/VTKHDF"
# VTK reads all of Values into room for NSteps numbers, so this one data set never has more rows than finished steps.
CLOCK = "/steps/time"
# Second names of data sets. The geometry never changes: each step reads it at offset 0, one column of zeros serves all.
LINKS = {
    f"{GRID}/Steps/Values": CLOCK,
    f"{GRID}/Steps/PointOffsets": f"{GRID}/Steps/PartOffsets",
    f"{GRID}/Steps/CellOffsets": f"{GRID}/Steps/PartOffsets",
    f"{GRID}/Steps/ConnectivityIdOffsets": f"{GRID}/Steps/PartOffsets",
    f"{GRID}/Steps/CellDataOffsets/body": f"{GRID}/Steps/PartOffsets",
}


@dataclass(frozen=True, eq=False)
class Grid:
    """The undeformed bodies of a scene as one unstructured grid.

    Attributes
    ----------
    points : (n, 3) float
        Reference positions [m].
    connectivity : (m,) int
        Points of all cells, one cell after the other, in VTK's order.
    offsets : (cells + 1,) int
        Where each cell begins in `connectivity`.
    types : (cells,) uint8
        VTK types: vertex 1, line 3, polyline 4, triangle 5, tetrahedron 10, and of second order 21, 22, 24.
    body : (cells,) int
        The body that each cell belongs to.

    Raises
    ------
    ValueError
        If shapes do not agree, a type is unknown or a cell has the wrong number of points or one that does not exist.
    """

    points: Array
    connectivity: Array
    offsets: Array
    types: Array
    body: Array

    def __post_init__(self) -> None:
        sizes = np.diff(self.offsets)
        if np.ndim(self.points) != 2 or np.shape(self.points)[1] != 3:
            raise ValueError(f"grid: points has shape {np.shape(self.points)}, allowed is (n, 3)")
        if not np.shape(self.types) == np.shape(self.body) == sizes.shape:
            raise ValueError(
                f"grid: types {np.shape(self.types)} and body {np.shape(self.body)} "
                f"must have one entry per cell, {sizes.shape}"
            )
        if self.offsets[0] != 0 or self.offsets[-1] != len(self.connectivity):
            raise ValueError(f"grid: offsets must run from 0 to {len(self.connectivity)}, the length of connectivity")
        expected = np.zeros(256, dtype=np.int64)
        expected[list(CELL_POINTS)] = list(CELL_POINTS.values())
        wrong = np.where(np.equal(self.types, POLYLINE), sizes < 2, sizes != expected[self.types])
        if wrong.any():
            cell = int(np.argmax(wrong))
            raise ValueError(
                f"grid: cell {cell} of VTK type {self.types[cell]} has {sizes[cell]} points, "
                f"allowed are (type: points) {CELL_POINTS} and polylines ({POLYLINE}) of at least 2"
            )
        if len(self.connectivity) and not 0 <= np.min(self.connectivity) <= np.max(self.connectivity) < len(
            self.points
        ):
            raise ValueError(f"grid: connectivity must lie in 0 to {len(self.points) - 1}")

    def datasets(self) -> dict[str, Array]:
        """The geometry as VTKHDF stores it: one part, written once."""
        return {
            f"{GRID}/NumberOfPoints": as_stored("points", [len(self.points)]),
            f"{GRID}/NumberOfCells": as_stored("cells", [len(self.types)]),
            f"{GRID}/NumberOfConnectivityIds": as_stored("connectivity", [len(self.connectivity)]),
            f"{GRID}/Points": np.ascontiguousarray(self.points, dtype=np.float64),
            f"{GRID}/Connectivity": as_stored("connectivity", self.connectivity),
            f"{GRID}/Offsets": as_stored("offsets", self.offsets),
            f"{GRID}/Types": np.asarray(self.types, dtype=np.uint8),
            f"{GRID}/CellData/body": as_stored("body", self.body),
        }


@dataclass(frozen=True, eq=False)
class StepData:
    """One accepted step.

    The names in `point_data`, `cell_data` and `checkpoint`, and the shapes but for the number of contacts and
    the first axis of checkpoint arrays, are those of the record's first step.

    Attributes
    ----------
    time, dt : float
        End of the step and its size [s].
    substeps, passes, iterations, contacts : int
        Substeps taken, detection passes, iterations of the contact solver, candidate contacts.
    converged : bool
        Whether the step met its certificate.
    certificate : mapping of str to float
        ``complementarity``, ``equilibrium``, ``surface_error``, ``penetration``: all four, finite.
    seconds : mapping of str to float
        Any of ``assemble``, ``factor``, ``detect``, ``delassus``, ``solve``, ``output``, ``total`` [s];
        a phase that did not run is 0. The writer adds its own time to ``output``.
    point_data, cell_data : mapping of str to (n, ...) and (cells, ...) arrays
        Fields on the grid.
    lam, gap : (c,) float
        Contact forces λ [N] and gaps δ [m].
    point, normal : (c, 3) float
        Contact points [m] and unit normals.
    body, status : (c,) int
        The body of each contact; 0 inactive, 1 active.
    checkpoint : mapping of str to array
        All that is needed to go on from here; a ``/`` in a name makes a group.
    """

    time: float
    dt: float
    substeps: int
    passes: int
    iterations: int
    contacts: int
    converged: bool
    certificate: Mapping[str, float]
    seconds: Mapping[str, float]
    point_data: Mapping[str, ArrayLike]
    cell_data: Mapping[str, ArrayLike]
    lam: ArrayLike
    gap: ArrayLike
    point: ArrayLike
    normal: ArrayLike
    body: ArrayLike
    status: ArrayLike
    checkpoint: Mapping[str, ArrayLike]


EMPTY_STEP = StepData(
    time=0.0,
    dt=0.0,
    substeps=0,
    passes=0,
    iterations=0,
    contacts=0,
    converged=False,
    certificate=dict.fromkeys(CERTIFICATE, 0.0),
    seconds={},
    point_data={},
    cell_data={},
    lam=np.zeros(0),
    gap=np.zeros(0),
    point=np.zeros((0, 3)),
    normal=np.zeros((0, 3)),
    body=np.zeros(0, dtype=np.int64),
    status=np.zeros(0, dtype=np.int64),
    checkpoint={},
)


def as_stored(name: str, values: ArrayLike) -> Array:
    """`values` in C order as float64, int64 or bool, the only types that grow in a record.

    Raises
    ------
    ValueError
        If they are not real numbers.
    """
    values = np.asarray(values)
    kinds = {"f": np.float64, "i": np.int64, "u": np.int64, "b": np.bool_}
    if values.dtype.kind not in kinds:
        raise ValueError(f"{name}: has type {values.dtype}, allowed are real numbers, integers and booleans")
    return np.asarray(values, dtype=kinds[values.dtype.kind], order="C")


def step_rows(step: StepData, index: int, points: int, cells: int, contacts: int) -> dict[str, Array]:
    """Rows that step number `index` appends to each data set.

    Parameters
    ----------
    step : StepData
    index, contacts : int
        Steps, and contacts in all of them, recorded before this one.
    points, cells : int
        Size of the grid.

    Raises
    ------
    ValueError
        If a name or a shape is not allowed, or a residual is not finite.
    """
    _expect_names("certificate", step.certificate, CERTIFICATE, required=CERTIFICATE)
    _expect_names("seconds", step.seconds, PHASES)
    numbers: dict[str, float] = {"time": float(step.time), "dt": float(step.dt)}
    numbers |= {name: int(getattr(step, name)) for name in ("substeps", "passes", "contacts")}
    numbers |= {"active": int(np.count_nonzero(np.greater(step.lam, 0))), "iterations": int(step.iterations)}
    numbers |= {name: float(step.certificate[name]) for name in CERTIFICATE}
    for name, value in numbers.items():
        if not np.isfinite(value):
            raise ValueError(f"step {index}: {name} is {value}, allowed are finite numbers")
    numbers |= {"converged": bool(step.converged)}
    numbers |= {f"seconds/{phase}": float(step.seconds.get(phase, 0.0)) for phase in PHASES}
    rows = {f"/steps/{name}": as_stored(name, [value]) for name, value in numbers.items()}

    count = np.size(step.lam)
    rows["/contact/offsets"] = as_stored("offsets", [contacts + count])
    for name, values, tail, dtype in (
        ("lambda", step.lam, (), np.float64),
        ("gap", step.gap, (), np.float64),
        ("point", step.point, (3,), np.float64),
        ("normal", step.normal, (3,), np.float64),
        ("body", step.body, (), np.int64),
        ("status", step.status, (), np.int64),
    ):
        if np.shape(values) != (count, *tail):
            raise ValueError(f"step {index}: {name} has shape {np.shape(values)}, expected {(count, *tail)}")
        rows[f"/contact/{name}"] = np.asarray(values, dtype=dtype, order="C")

    rows[f"{GRID}/Steps/PartOffsets"] = as_stored("PartOffsets", [0])
    rows[f"{GRID}/Steps/NumberOfParts"] = as_stored("NumberOfParts", [1])
    for kind, fields, size in (("Point", step.point_data, points), ("Cell", step.cell_data, cells)):
        for name, values in fields.items():
            if "/" in name or (kind, name) == ("Cell", "body"):
                raise ValueError(f"step {index}: a {kind.lower()} array cannot be named {name!r}")
            if np.shape(values)[:1] != (size,):
                raise ValueError(f"step {index}: {name} has shape {np.shape(values)}, expected ({size}, ...)")
            rows[f"{GRID}/{kind}Data/{name}"] = as_stored(name, values)
            rows[f"{GRID}/Steps/{kind}DataOffsets/{name}"] = as_stored(name, [index * size])
    return rows


def committed_rows(name: str, count: int, points: int, cells: int, contacts: int) -> int | None:
    """Rows of data set `name` after `count` steps with `contacts` contacts in all, None if it does not grow."""
    if name == f"{GRID}/CellData/body":
        return None
    for prefix, rows in {
        "/steps/": count,
        f"{GRID}/Steps/": count,
        "/contact/offsets": count + 1,
        "/contact/": contacts,
        f"{GRID}/PointData/": count * points,
        f"{GRID}/CellData/": count * cells,
    }.items():
        if name.startswith(prefix):
            return rows
    return None


def dataset_names(group: h5py.Group) -> Iterator[str]:
    """Full names of all data sets below `group`, sorted, each under its first name only."""
    for key in sorted(group):
        item = group[key]
        name = f"{group.name.rstrip('/')}/{key}"
        if isinstance(item, h5py.Group):
            yield from dataset_names(item)
        elif name not in LINKS:
            yield name


def _expect_names(
    what: str, given: Mapping[str, float], allowed: tuple[str, ...], required: tuple[str, ...] = ()
) -> None:
    if not set(required) <= set(given) <= set(allowed):
        raise ValueError(f"{what}: has the names {sorted(given)}, allowed are {', '.join(allowed)}")
