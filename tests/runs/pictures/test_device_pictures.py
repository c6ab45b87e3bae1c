"""Pictures of devices: walls lie on their surfaces, views show what is there, figures what was recorded."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from contact.record import CERTIFICATE, Grid, Record, StepData
from contact.surfaces.implicit import Plane, Sphere, Torus
from runs.cli import BAD_INPUT, main
from runs.pictures import devices as device_pictures
from runs.pictures.devices import Stage, device_figure
from runs.pictures.frame import Frame
from runs.pictures.sights import View, Wall, beams_of, focus, sight_of, smooth, views_of, wall_of

R, r, N = 5e-3, 4e-4, 24
TUBE = f"surface = {{kind = 'cylinder', centre = [0.0, 0.0, 0.0], axis = [1.0, 0.0, 0.0], radius = {R}, inside = true}}"
SCENE = f"title = 'Wire in a tube'\n[[contact]]\nbody = 'wire'\n{TUBE}\n"
LAM = np.array([2e-3, 0.0, 5e-4])


def device(path: Path, scene: str = SCENE, steps: int = 4) -> Path:
    """A wire along x that bends more at every step; it meets the tube's wall in three candidates, with force in two."""
    x = np.column_stack([np.linspace(0, 0.03, N + 1), np.zeros(N + 1), np.zeros(N + 1)])
    cells = np.column_stack([np.arange(N), np.arange(1, N + 1)])
    grid = Grid(x, cells.ravel(), 2 * np.arange(N + 1), np.full(N, 3), np.zeros(N, dtype=int))
    with Record.create(path, grid, scene, {"unknowns": 6 * (N + 1)}) as record:
        for step in range(steps):
            bend = (step + 1) / steps * (R - r) * (x[:, 0] / 0.03) ** 2
            u = np.column_stack([0 * bend, bend, -0.3 * bend])
            places = np.array([[0.01, R, 0], [0.02, R, 0], [0.03, 0.8 * R, 0.6 * R]])
            record.append(
                StepData(
                    time=0.1 * (step + 1),
                    dt=0.1,
                    substeps=1 + step,
                    passes=3 + step,
                    iterations=5,
                    contacts=3,
                    converged=True,
                    certificate=dict.fromkeys(CERTIFICATE, 1e-10),
                    seconds={"total": 2e-3 * (step + 1)},
                    point_data={"displacement": u, "radius": np.full(N + 1, r)},
                    cell_data={},
                    lam=(step + 1) * LAM,
                    gap=np.zeros(3),
                    point=places,
                    normal=-places * [0, 1 / R, 1 / R],
                    body=np.zeros(3, dtype=int),
                    status=(LAM > 0).astype(int),
                    checkpoint={},
                )
            )
    return path


@pytest.fixture(scope="module")
def wire(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return device(tmp_path_factory.mktemp("devices") / "wire.vtkhdf")


def area(wall: Wall) -> float:
    a, b, c = np.moveaxis(wall.points[wall.triangles], 1, 0)
    return float(np.linalg.norm(np.cross(b - a, c - a), axis=1).sum() / 2)


def test_wall_of_a_ball_lies_on_it_and_its_area_converges_at_order_two() -> None:
    centre, box = np.array([1.0, 2.0, 3.0]), np.full(3, 1.3)
    errors = []
    for h in (0.2, 0.1, 0.05):
        wall = wall_of(Sphere(centre, 1.0, inside=True), centre - box, centre + box, h)
        away = wall.points - centre
        assert np.allclose(np.linalg.norm(away, axis=1), 1, atol=1e-12)
        # Normals point to the allowed side, which is inside.
        assert np.allclose(wall.normals, -away, atol=1e-12)
        errors.append(1 - area(wall) / (4 * np.pi))
    rates = np.log2(np.divide(errors[:-1], errors[1:]))
    assert np.all(np.abs(rates - 2) < 0.15), rates


def test_wall_of_a_torus_is_closed_and_a_plane_ends_at_the_box() -> None:
    torus = wall_of(Torus(np.zeros(3), np.array([0, 0, 1.0]), 1.0, 0.2), np.full(3, -1.3), np.full(3, 1.3), 0.04)
    edges = np.sort(torus.triangles[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1)
    assert np.all(np.unique(edges, axis=0, return_counts=True)[1] == 2)
    assert np.isclose(area(torus), 4 * np.pi**2 * 0.2, rtol=0.01)
    plane = wall_of(Plane(np.array([0, 0, 0.31]), np.array([0, 0, 1.0])), np.zeros(3), np.ones(3), 0.125)
    assert np.allclose(plane.points[:, 2], 0.31, atol=1e-15)
    assert np.isclose(area(plane), 1)
    beyond = wall_of(Plane(np.array([0, 0, 9.0]), np.array([0, 0, 1.0])), np.zeros(3), np.ones(3), 0.125)
    assert len(beyond.points) == len(beyond.triangles) == 0


def test_devices_are_smooth_through_their_nodes() -> None:
    errors = []
    for n in (16, 32):
        t = np.linspace(0, 2 * np.pi, n + 1)
        x, radius = smooth(np.column_stack([np.cos(t), np.sin(t), 0.1 * t]), 1 + t, parts=4)
        assert np.allclose(x[::4], np.column_stack([np.cos(t), np.sin(t), 0.1 * t]))
        assert np.allclose(radius, 1 + np.linspace(0, 2 * np.pi, 4 * n + 1))
        errors.append(np.abs(np.hypot(x[:, 0], x[:, 1]) - 1).max())
    assert errors[0] / errors[1] > 8
    assert errors[1] < 1e-4


def test_straight_stretch_behind_a_device_is_left_out() -> None:
    t = np.linspace(0, np.pi / 2, 21)
    bow = np.column_stack([np.sin(t), 1 - np.cos(t), 0 * t])
    tail = np.column_stack([np.linspace(-10, 0, 100, endpoint=False), np.zeros(100), np.zeros(100)])
    x = np.concatenate([tail, bow])
    seen = focus(x, np.full(len(x), 0.01))
    assert np.array_equal(seen[-21:], bow)
    # The bow is √2 in size; the bend that shows is a little in front of its start.
    assert -np.sqrt(2) / 3 < seen[0, 0] < 0
    assert focus(tail, np.full(100, 0.01)) is tail
    short = x[90:]
    assert focus(short, np.full(len(short), 0.01)) is short


def test_views_share_a_scale_and_hold_all_points() -> None:
    x = np.random.default_rng(0).uniform(-1, 1, (50, 3)) * [3, 0.5, 2] + 7
    front, side = views_of(x)
    assert front.eye[1] < -0.8  # the points are flattest along y, and x is to the right
    assert front.right[0] > 0.8
    assert front.height == side.height
    for view in (front, side):
        axes = np.stack([view.right, view.up, view.eye])
        assert np.allclose(axes @ axes.T, np.eye(3))
        assert np.linalg.det(axes) > 0
        across, upwards, _ = np.abs((x - view.centre) @ axes.T).T
        assert across.max() <= view.width / 2
        assert upwards.max() <= view.height / 2


def test_device_is_where_its_nodes_are_and_contacts_have_their_colours(wire: Path) -> None:
    frame = Frame.read(wire, -1)
    (beam,) = beams_of(frame)
    assert beam.tolist() == list(range(N + 1))
    sight = sight_of(frame, [surface for surface, _ in frame.obstacles()], float(frame.contact["lambda"].max()))
    assert np.allclose(np.hypot(*sight.walls[0].points[:, 1:].T), R)
    # Along the tube's axis nothing hides the contacts on the wall behind.
    eye, up = np.array([0, 0, 1.0]), np.array([0, 1.0, 0])
    view = View(np.array([1.0, 0, 0]), up, eye, np.array([0.015, 0, 0]), 0.04, 0.016)
    scale = 20_000
    with Stage(sight, view, scale) as stage:
        image = stage.shot(frame).astype(float)
        earlier = stage.shot(Frame.read(wire, 0)).astype(float)
    assert image.shape == (320, 800, 3)

    def pixel(picture: np.ndarray, x: np.ndarray) -> np.ndarray:
        column, row = 400 + scale * (x[0] - 0.015), 160 - scale * x[1]
        return np.asarray(picture[int(row), int(column)])

    assert (image[2, 2] == 255).all()
    positions = frame.bodies.positions
    # The middle of the wire is dark steel, beside it is the wall's translucent red.
    node = positions[N // 2]
    assert pixel(image, node).max() < 140
    for side in (-3 * r, 3 * r):
        red, green, blue = pixel(image, node + np.array([0, side, 0]))
        assert red > 170
        assert red > green + 5 > blue
    # Wires of earlier steps are gone.
    tip = positions[-2]
    assert pixel(image, tip).max() < 140 < pixel(earlier, tip).max()
    # The largest force has the last colour of the scale, yellow; the candidate without force has no point.
    red, green, blue = pixel(image, np.array([0.01, R + 3e-4, 0]))
    assert min(red, green) > 1.5 * blue
    assert np.ptp(pixel(image, np.array([0.02, R + 3e-4, 0]))) == 0


def test_figure_shows_the_history_of_the_record(wire: Path) -> None:
    figure = device_figure(wire, 1)
    assert figure._suptitle.get_text() == "Wire in a tube,  t = 0.2 s"
    assert "contacts 3,  active 2" in figure._supxlabel.get_text()
    front, side, *_ = figure.axes
    for axes in (front, side):
        # The scale bar is as long as it says: the axes' unit is the metre.
        (bar,) = axes.get_lines()
        text = next(t.get_text() for t in axes.texts if t.get_text().endswith("mm"))
        assert np.isclose(np.ptp(bar.get_xdata()), 1e-3 * float(text.removesuffix(" mm")))
    lines = {line.get_label(): np.asarray(line.get_ydata()) for axes in figure.axes for line in axes.get_lines()}
    steps = np.arange(1, 5)
    assert np.allclose(lines["sum"], 2.5 * steps)  # mN
    assert np.allclose(lines["largest"], 2 * steps)
    assert lines["candidates"].tolist() == [3] * 4
    assert lines["with force"].tolist() == [2] * 4
    assert lines["passes"].tolist() == [3, 4, 5, 6]
    assert lines["substeps"].tolist() == [1, 2, 3, 4]
    assert "median 5 ms" in lines


def test_animation_has_the_steps_thinned(wire: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(device_pictures, "FRAMES", 3)
    assert main(["plot", str(wire), "-o", str(tmp_path / "wire.gif")]) == 0
    with Image.open(tmp_path / "wire.gif") as movie:
        assert movie.n_frames == 3


def test_changes_of_the_run_are_drawn(tmp_path: Path) -> None:
    path = device(tmp_path / "a.vtkhdf", SCENE + "\n# --set contact.0.surface.radius=0.007", steps=1)
    ((surface, dim),) = Frame.read(path, 0).obstacles()
    assert dim == 3
    assert np.isclose(surface.potential(np.array([[0.0, 0.007, 0.0]]))[0], 0, atol=1e-18)


def test_file_of_the_vessel_is_looked_for_beside_the_record(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    scene = "[[contact]]\nsurface = {kind = 'vessels', file = 'tree.swc', scale = 1e-3}\n"
    path = device(tmp_path / "a.vtkhdf", scene, steps=1)
    assert main(["plot", str(path), "--step", "0"]) == 0
    said = capsys.readouterr().err
    assert said.startswith("signorini: tree.swc: neither beside the record nor in the current folder")
    assert len(said.splitlines()) == 1
    (tmp_path / "tree.swc").write_text("1 3 -5 0 0 5 -1\n2 3 40 0 0 5 1\n")
    ((surface, _),) = Frame.read(path, 0).obstacles()
    assert np.isclose(surface.potential(np.array([[0.015, R, 0.0]]))[0], 0, atol=1e-12)


def test_what_cannot_be_drawn_is_said_in_one_line(
    wire: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, "imageio_ffmpeg", None)
    assert main(["plot", str(wire), "-o", str(tmp_path / "a.mp4")]) == BAD_INPUT
    assert "an .mp4 needs imageio-ffmpeg" in capsys.readouterr().err
    assert main(["plot", str(wire), "--step", "9"]) == BAD_INPUT
    assert "there is no step 9, allowed is 0 to 3" in capsys.readouterr().err
    monkeypatch.setitem(sys.modules, "pyvista", None)
    assert main(["plot", str(wire), "-o", str(tmp_path / "a.png")]) == BAD_INPUT
    assert capsys.readouterr().err == "signorini: pictures in space need pyvista: pip install 'signorini[plot]'\n"
    assert not list(tmp_path.iterdir())
