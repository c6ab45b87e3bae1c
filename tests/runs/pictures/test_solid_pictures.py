"""Scenes of solids that touch each other, and their pictures: balances, cuts, colours."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from mpi4py import MPI

from contact.loop import AcceptedStep, march
from contact.scene.build import build
from contact.scene.schema import read_scene
from fem.geometry import map_facets
from runs.cli import main
from runs.pictures.frame import Frame
from runs.pictures.solids import PRESSURE, Scale, hollow, linear, nodal, shot, sight_of, unlike
from runs.plot import record_figure

RUNS = Path(__file__).parents[3] / "runs"
ORGANS = ["body.0.mesh.h=0.012", "body.1.mesh.h=0.010", "time.end=0.3125", "time.steps=5"]
BALLOON = ["body.0.mesh.h=1e-3", "body.1.mesh.h=9e-4", "time.steps=2"]


@pytest.fixture(scope="module")
def balloon(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A coarse balloon's record."""
    path = tmp_path_factory.mktemp("record") / "balloon.vtkhdf"
    changes = [word for change in BALLOON for word in ("--set", change)]
    assert main(["run", str(RUNS / "balloon.toml"), "-o", str(path), *changes]) == 0
    return path


def test_organs_balance() -> None:
    """Each step converges; what the contact presses with is what the elastic tissue below carries, k ∫ u ds."""
    scene, _ = read_scene(RUNS / "organs.toml", ORGANS)
    system = build(scene, MPI.COMM_SELF)
    system.prepare()
    steps: list[AcceptedStep] = []
    carried = []

    def look(accepted: AcceptedStep) -> None:
        steps.append(accepted)
        lower = system.bodies[0]
        facets = lower.facets("top")
        base = map_facets(lower.points, facets, 4)
        u = np.einsum("qa,fad->fqd", base.values, lower.displacement[facets])
        carried.append(1e6 * np.einsum("fq,fqd->d", base.weights, u))

    march(system, scene, look)
    assert all(step.converged for step in steps)
    for step, force in zip(steps, carried, strict=True):
        pressed = step.result.lam @ step.result.linearisation.constraints[0].normals
        assert pressed[2] > 0.05
        np.testing.assert_allclose(-force, pressed, atol=1e-6 * np.linalg.norm(pressed))
    # On its way up to the crest the upper organ pushes the lower one along.
    assert carried[-1][0] > 0.05 * abs(carried[-1][2])
    system.close()


def test_balloon_opens_the_artery(balloon: Path) -> None:
    """The narrow place is pushed open by about the same all around; its picture is cut open along the vessel."""
    frame = Frame.read(balloon, -1)
    assert frame.row["converged"]
    x, u = frame.bodies.grid.points, frame.bodies.displacement
    radius = np.hypot(x[:, 0], x[:, 1])
    throat = (np.abs(x[:, 2]) < 1e-9) & (np.abs(radius - 1.05e-3) < 1e-9)
    opened = (u[throat, :2] * x[throat, :2]).sum(axis=1) / radius[throat]
    assert throat.sum() >= 16
    assert opened.min() > 2e-5
    assert np.ptp(opened) < 0.2 * opened.mean()
    assert hollow(frame)
    view, cut = sight_of(frame, np.array([0]))
    np.testing.assert_allclose(np.abs(cut.normal), [0, 1, 0], atol=1e-12)
    assert abs(cut.point[0]) < 1e-4
    assert view.eye @ cut.normal > 0
    assert view.width > 0.014 > view.height


def test_pressure_is_drawn_where_it_acts(balloon: Path) -> None:
    """Dark colours of contact are there, in the middle, only where bodies touch; no colours without a pressure."""
    frame = Frame.read(balloon, -1)
    pressure = linear(frame.bodies, frame.point_data["contact_pressure"])
    view, cut = sight_of(frame, np.array([0]))
    scale = Scale(PRESSURE, float(pressure.max()), 0.0, "p [Pa]")
    image = shot(frame.bodies, pressure, np.array([0]), view, cut, scale).astype(float)
    bare = shot(frame.bodies, 0 * pressure, np.array([0]), view, cut, scale).astype(float)
    columns = np.flatnonzero((np.abs(image - bare).sum(axis=2) > 60).any(axis=0)) / image.shape[1]
    assert 0.2 < columns.min() < 0.45
    assert 0.55 < columns.max() < 0.8
    assert (bare < 250).any()


def test_middle_nodes_and_means(balloon: Path) -> None:
    """A linear field is its own; cell values become means of the cells about a node; bodies differ in stress."""
    bodies = Frame.read(balloon, -1).bodies
    x = bodies.grid.points
    straight = linear(bodies, x[:, 2])
    vertices = np.unique(bodies.grid.connectivity.reshape(-1, 10)[:, :4])
    np.testing.assert_array_equal(straight[vertices], x[vertices, 2])
    np.testing.assert_allclose(straight, x[:, 2], atol=1e-4)
    stress = nodal(bodies)
    assert bodies.values.min() <= stress.min() <= stress.max() <= bodies.values.max()
    assert unlike(bodies, stress)
    assert not unlike(bodies, np.ones(len(x)))


def test_the_figure(balloon: Path) -> None:
    """Two views with their colours in units that read well, and four panels of the history."""
    figure = record_figure(balloon)
    labels = {axes.get_xlabel() for axes in figure.axes}
    assert {"von Mises stress [MPa], cut open", "contact pressure p [kPa]", "time t [s]"} <= labels
    assert len(figure.axes) == 8
