"""Contacts stated several times over share their forces alike, where the scene asks for those of minimum norm."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest
from contact_examples import SCENE, box, on_floor
from device_examples import RADIUS, contact, run, wire

from contact.solvers import METHODS
from contact.solvers.minimum_norm import minimum_norm
from contact.step import step
from fem.elasticity import State
from runs.cli import main

COPIES = 3
SHARED = """copies = {copies}

[solver]
minimum_norm = true
"""


def written(copies: int, method: str, folder: Path) -> Any:
    """The forces in the record of the block's run."""
    (folder / "scene.toml").write_text(SCENE + SHARED.format(copies=copies), encoding="utf8")
    assert main(["run", str(folder / "scene.toml"), "-o", str(folder / "r.vtkhdf"), "--method", method]) == 0
    with h5py.File(folder / "r.vtkhdf") as file:
        return file["contact/lambda"][:].reshape(copies, -1)


@pytest.mark.parametrize("method", ["status", "gauss-seidel", "kkt", "tao", "vi-primal"])
def test_in_a_record(method: str, tmp_path: Path) -> None:
    """By methods on W, on the saddle-point system and on displacements."""
    one, shares = written(1, method, tmp_path), written(COPIES, method, tmp_path)
    assert one.min() > 0
    np.testing.assert_allclose(shares, np.tile(one / COPIES, (COPIES, 1)), rtol=1e-9)
    np.testing.assert_allclose(shares, np.tile(shares[0], (COPIES, 1)), rtol=1e-12)


@pytest.mark.parametrize("state", ["plane-strain", "3d"])
def test_mortar_constraints_of_a_body_that_contact_holds(state: State) -> None:
    """Rows of unlike weight on a graded mesh, and rigid modes: the copies share alike, and the pressure is even."""
    dim = 3 if state == "3d" else 2
    supports = [{"tag": tag, "component": axis} for tag, axis in (("left", "x"), ("front", "y"))][: dim - 1]
    load = {"kind": "pressure", "tag": "top", "value": 0.4}
    system = on_floor(box(dim), state, [load], supports, constraint="mortar", copies=COPIES)
    result = step(system, 1.0, method=minimum_norm(METHODS["status"]))
    shares = result.lam.reshape(COPIES, -1)
    areas = result.linearisation.constraints[0].areas
    np.testing.assert_allclose(shares / areas, 0.4 / COPIES, rtol=1e-9)
    np.testing.assert_allclose(shares, np.tile(shares[0], (COPIES, 1)), rtol=1e-12)
    system.close()


def test_a_device() -> None:
    """A wire that slides over a post, its planes and matrix renewed in each pass: motion and resultants of one post.

    The curvature under the forces of every copy enters the wire's matrix, so that passes are as many as with one.
    """

    def bent(copies: int) -> tuple[Any, Any, list[int]]:
        post = {"kind": "cylinder", "centre": [-0.02, 0.0, -RADIUS - 2e-3], "axis": [0.0, 1.0, 0.0], "radius": 1.9e-3}
        held = [{"at": "start"}, {"at": "end", "displacement": [0.0, 0.0, "-2e-3 * t"], "hold": ["z", "y"]}]
        system, steps = run(
            {
                "body": [wire(supports=held)],
                "contact": [contact(post, copies=copies)],
                "time": {"steps": 4},
                "solver": {"minimum_norm": True},
            }
        )
        x = system.bodies[0].x.copy()
        system.close()
        return x, steps[-1].result.lam.reshape(copies, -1), [step.result.passes for step in steps]

    (x, one, passes), (y, shares, again) = bent(1), bent(COPIES)
    assert one.max() > 0
    assert again == passes
    np.testing.assert_allclose(y, x, rtol=0, atol=1e-8 * RADIUS)
    np.testing.assert_allclose(shares, np.tile(one / COPIES, (COPIES, 1)), rtol=0, atol=1e-6 * one.max())
    np.testing.assert_allclose(shares, np.tile(shares[0], (COPIES, 1)), rtol=0, atol=1e-10 * one.max())


def test_what_explain_says(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "scene.toml").write_text(SCENE + SHARED.format(copies=2), encoding="utf8")
    assert main(["explain", str(tmp_path / "scene.toml")]) == 0
    assert "built: minimum norm: " in capsys.readouterr().out
    assert main(["explain", str(tmp_path / "scene.toml"), "--set", "solver.minimum_norm=false"]) == 0
    assert "minimum norm" not in capsys.readouterr().out
