"""A wire in a real arterial tree; skipped where the data is absent."""

from pathlib import Path

import numpy as np
import pytest
from mpi4py import MPI

from contact.loop import AcceptedStep, march, tolerances
from contact.scene.build import build
from contact.scene.schema import Scene
from meshes.vessels import read_swc

DATA = Path(__file__).parents[4] / "shared" / "data"
TREE = "aorta_neck.swc"


@pytest.mark.skipif(not (DATA / TREE).is_file(), reason="the arterial tree is not part of the project")
def test_a_wire_pushed_down_the_aorta() -> None:
    """Laid along the aorta and pushed 20 mm it touches the wall, and no point of it leaves the lumen."""
    tree = read_swc(DATA / TREE, 1e-3).resampled(4e-3)
    chain = max(tree.chains(), key=lambda c: np.linalg.norm(np.diff(tree.points[c], axis=0), axis=1).sum())
    path = tree.points[chain][::-1][: len(chain) // 2]
    wire = {
        "name": "wire",
        "kind": "beam",
        "rayleigh": [40.0, 5e-3],
        "sections": [{"length": 0.2, "elements": 100, "radius": 4e-4, "E": 10e9, "nu": 0.3, "density": 6450.0}],
        "placement": {"path": path.tolist()},
        "supports": [{"at": "start", "push": "0.04 * t"}],
    }
    vessels = {"kind": "vessels", "file": TREE, "scale": 1e-3, "spacing": 4e-3}
    scene = Scene.model_validate(
        {
            "body": [wire],
            "contact": [{"name": "wall", "body": "wire", "samples": 1, "surface": vessels}],
            "time": {"end": 0.5, "steps": 50, "integrator": "implicit-euler"},
        }
    )
    system = build(scene, MPI.COMM_SELF, DATA)
    system.prepare()
    steps: list[AcceptedStep] = []
    march(system, scene, steps.append)
    assert len(steps) == 50
    assert all(step.converged and step.result.certificate.within(tolerances(scene)) for step in steps)
    assert all((step.result.lam > 0).any() for step in steps[10:])
    surface = system.pairs[0].surface  # type: ignore[attr-defined]
    assert surface.potential(system.bodies[0].x).min() > 0  # type: ignore[attr-defined]
    system.close()
