"""Pictures of solids that touch each other in space: cut open with their stress, and the pressure of the contact."""

from __future__ import annotations

import os
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from meshes.simplices import EDGES
from runs.pictures.frame import Frame
from runs.pictures.history import History, draw_history
from runs.pictures.plane import Bodies, Floats, Patches, edges, subdivided
from runs.pictures.sights import View
from runs.pictures.space import DECADES, WIDTH, draw_view, library, plotter_of
from runs.plot import DPI, caption, new_figure

if TYPE_CHECKING:
    from matplotlib.figure import Figure

# A quadratic tetrahedron as eight linear ones: its corners, and the octahedron between them around one diagonal.
PARTS = {
    10: np.array([[0, 1, 2, 3]]),
    24: np.array(
        [[0, 4, 6, 7], [4, 1, 5, 8], [6, 5, 2, 9], [7, 8, 9, 3], [4, 9, 5, 6], [4, 9, 6, 7], [4, 9, 7, 8], [4, 9, 8, 5]]
    ),
}
STRESS, PRESSURE = "viridis", "magma_r"
TILT = np.array([0.25, 0.45, 1.0])
"""From where bodies are seen, in parts of right, up and towards the eye."""


class Scale(NamedTuple):
    """What colours say: their name, the values at their ends, logarithmic where the lower one is not 0, a label."""

    colours: str
    top: float
    bottom: float
    label: str


class Cut(NamedTuple):
    """The plane behind which bodies are drawn: a point and the normal to the side that is taken away."""

    point: Floats
    normal: Floats


def solid_figure(path_record: str | os.PathLike[str], step: int = -1) -> Figure:
    """The bodies cut open through the contact, the contact pressure on the side that carries it, and the history.

    Parameters
    ----------
    path_record : path-like
    step : int
        Counted from 0, or from the end if negative.

    Raises
    ------
    ImportError
        where pyvista or matplotlib is missing.
    ValueError
        where the record or the step is not there.
    OSError
        where VTK finds nothing to render with.
    """
    library()
    frame, history = Frame.read(path_record, step), History.read(path_record)
    bodies = frame.bodies
    inside = hollow(frame)
    views = sight_of(frame, np.unique(bodies.grid.body)), sight_of(frame, np.unique(frame.contact["body"]))
    tall = max((WIDTH / 2 - 0.8) * view.height / view.width for view, _ in views)
    figure = new_figure((WIDTH, tall + 3.6))
    places = figure.add_gridspec(2, 1, height_ratios=(tall + 0.6, 2.4))
    above = places[0].subgridspec(1, 2, wspace=0.04)
    # Stress is singular at clamped edges: the last half percent must not take all the colours.
    stress, pressure = nodal(bodies), linear(bodies, frame.point_data["contact_pressure"])
    tops = float(np.quantile(stress, 0.995)) or 1.0, float(pressure.max()) or 1.0
    scales = (
        Scale(STRESS, tops[0], tops[0] / DECADES if unlike(bodies, stress) else 0.0, f"{bodies.label}, cut open"),
        Scale(PRESSURE, tops[1], 0.0, "contact pressure p [Pa]"),
    )
    for number, (values, scale, (view, cut)) in enumerate(zip((stress, pressure), scales, views, strict=True)):
        shown = bodies.grid.body if number == 0 else frame.contact["body"]
        image = shot(bodies, values, shown, view, cut if number == 0 or inside else None, scale)
        axes = figure.add_subplot(above[number])
        draw_view(axes, image, view)
        _draw_colours(figure, axes, scale, bool(values.max() > scale.top))
    draw_history(figure, places[1], history, float(frame.row["time"]))
    caption(figure, frame, 7.5)
    return figure


def sight_of(frame: Frame, shown: NDArray[Any]) -> tuple[View, Cut]:
    """The longest extent of the bodies numbered `shown` lies from left to right; the cut goes through the contact.

    Where all contact is on their lower sides, they are seen from below.
    """
    grid, x, contact = frame.bodies.grid, frame.bodies.positions, frame.contact
    owner = np.repeat(np.arange(len(grid.types)), np.diff(grid.offsets))
    x = x[np.unique(grid.connectivity[np.isin(grid.body[owner], shown)])]
    whole = frame.bodies.positions
    along = int(np.argmax(np.ptp(whole, axis=0)))
    right, up = np.eye(3)[along], np.eye(3)[2 if along < 2 else 0]
    towards, tilt = np.cross(right, up), TILT.copy()
    pushed = contact["lambda"] @ contact["normal"] if len(shown) < len(np.unique(grid.body)) else np.zeros(3)
    if not hollow(frame) and pushed @ up > 0.5 * np.linalg.norm(pushed):
        tilt[1] = -1.6 * tilt[1]
    eye = tilt @ np.stack([right, up, towards]) / np.linalg.norm(tilt)
    across = np.cross(up, eye) / np.linalg.norm(np.cross(up, eye))
    frames = np.stack([across, np.cross(eye, across)])
    low, high = (f(x @ frames.T, axis=0) for f in (np.min, np.max))
    width, height = 1.06 * (high - low)
    width, height = max(width, height / 0.8), max(height, 0.45 * width)
    centre = (low + high) / 2 @ frames + ((x.min(axis=0) + x.max(axis=0)) / 2 @ eye) * eye
    active = contact["lambda"] > 0
    middle = contact["point"][active].mean(axis=0) if active.any() else (x.min(axis=0) + x.max(axis=0)) / 2
    return View(frames[0], frames[1], eye, centre, float(width), float(height)), Cut(middle, towards)


def hollow(frame: Frame) -> bool:
    """Whether the contact is on the inside of the body that carries it, where only a cut shows it."""
    n, x = frame.contact["normal"], frame.contact["point"]
    return bool(((x - x.mean(axis=0)) * n).sum() > 0) if len(x) else False


def nodal(bodies: Bodies) -> Floats:
    """`values` at the nodes (n), the means over the cells around them."""
    if not bodies.in_cells:
        return bodies.values
    grid = bodies.grid
    owner = np.repeat(np.arange(len(grid.types)), np.diff(grid.offsets))
    total, count = np.zeros((2, len(grid.points)))
    np.add.at(total, grid.connectivity, bodies.values[owner])
    np.add.at(count, grid.connectivity, 1.0)
    return np.asarray(total / np.maximum(count, 1))


def unlike(bodies: Bodies, values: Floats) -> bool:
    """Whether the medians of nodal values on two bodies differ by more than a factor of ten."""
    grid = bodies.grid
    owner = grid.body[np.repeat(np.arange(len(grid.types)), np.diff(grid.offsets))]
    medians = [float(np.median(values[grid.connectivity[owner == number]])) for number in np.unique(owner)]
    return max(medians) > 10 * min(medians)


def linear(bodies: Bodies, values: Floats) -> Floats:
    """Nodal values, of which those at middle nodes are the means of the edge's ends: a pressure is one of vertices."""
    grid, result = bodies.grid, values.copy()
    cells = np.flatnonzero(grid.types == 24)
    nodes = grid.connectivity[grid.offsets[cells][:, None] + np.arange(10)]
    ends = np.array(EDGES[3])
    result[nodes[:, 4:]] = values[nodes[:, ends]].mean(axis=2)
    return result


def shot(
    bodies: Bodies, values: Floats, shown: NDArray[Any], view: View, cut: Cut | None, scale: Scale
) -> NDArray[np.uint8]:
    """The deformed solids numbered `shown` with nodal values as colours, rendered off screen, as an image (h, w, 3)."""
    plotter = plotter_of(view, 1.5 * DPI * (WIDTH / 2) / view.width, 4 * max(view.width, view.height))
    try:
        plotter.enable_anti_aliasing("ssaa")
        for number in np.unique(shown):
            solid = _solid(bodies, int(number), values)
            mesh = solid if cut is None else solid.clip(normal=cut.normal, origin=cut.point)
            if not mesh.n_cells:
                continue
            skin = mesh.extract_surface(algorithm=None)
            look: dict[str, Any] = {"scalars": "values", "cmap": scale.colours, "clim": (scale.bottom, scale.top)}
            look |= {"log_scale": scale.bottom > 0, "show_scalar_bar": False, "ambient": 0.35, "diffuse": 0.7}
            plotter.add_mesh(skin, smooth_shading=True, split_sharp_edges=True, **look)
            rim = skin.extract_feature_edges(35)
            lines = _mesh_lines(bodies, int(number), cut)
            for drawn, line, opacity in ((rim, 2.5, 1.0), (lines, 1.0, 0.25)):
                if drawn is not None and drawn.n_cells:
                    drawn.points = drawn.points + 2e-3 * view.height * view.eye
                    plotter.add_mesh(drawn, color="black", line_width=line, opacity=opacity, lighting=False)
        plotter.render()
        image: NDArray[np.uint8] = plotter.screenshot(return_img=True)
        return image
    finally:
        plotter.close()


def _solid(bodies: Bodies, number: int, values: Floats) -> Any:
    """One body as linear tetrahedra of its deformed shape."""
    pyvista, grid, parts = library(), bodies.grid, []
    for kind, split in PARTS.items():
        cells = np.flatnonzero((grid.types == kind) & (grid.body == number))
        size = int(split.max()) + 1
        nodes = grid.connectivity[grid.offsets[cells][:, None] + np.arange(size)]
        parts.append(nodes[:, split].reshape(-1, 4))
    tetrahedra = np.concatenate(parts)
    used, local = np.unique(tetrahedra, return_inverse=True)
    mesh = pyvista.UnstructuredGrid({pyvista.CellType.TETRA: local.reshape(-1, 4)}, bodies.positions[used])
    mesh["values"] = values[used]
    return mesh


def _mesh_lines(bodies: Bodies, number: int, cut: Cut | None) -> Any:
    """The edges of one body's outer faces, curved."""
    pyvista = library()
    for faces in bodies.faces:
        mine = bodies.grid.body[faces.cell] == number
        if mine.any():
            curves = subdivided(edges(Patches(2, faces.nodes[mine], faces.cell[mine])), bodies.positions, 4)
            if cut is not None:
                behind = ((curves - cut.point) @ cut.normal < 0).all(axis=1)
                curves = curves[behind]
            count, size = curves.shape[:2]
            rows = np.column_stack([np.full(count, size), np.arange(count * size).reshape(count, size)])
            return pyvista.PolyData(curves.reshape(-1, 3), lines=rows.ravel()) if count else None
    return None


def _draw_colours(figure: Figure, axes: Any, scale: Scale, beyond: bool) -> None:
    from matplotlib.cm import ScalarMappable
    from matplotlib.colors import LogNorm, Normalize

    power = int(np.clip(np.floor(np.log10(scale.top) / 3), 0, 3))
    low, high = scale.bottom / 10.0 ** (3 * power), scale.top / 10.0 ** (3 * power)
    bar = ScalarMappable(LogNorm(low, high) if low else Normalize(0.0, high), scale.colours)
    ends = {(False, False): "neither", (False, True): "max", (True, False): "min", (True, True): "both"}
    label = scale.label.replace("[Pa]", f"[{('Pa', 'kPa', 'MPa', 'GPa')[power]}]")
    figure.colorbar(
        bar, ax=axes, label=label, orientation="horizontal", shrink=0.8, aspect=35, pad=0.02,
        extend=ends[low > 0, beyond],
    )  # fmt: skip
