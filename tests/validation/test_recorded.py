"""Contact problems recorded from a scene, and what methods make of them."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from contact.scene.schema import read_scene
from validation.recorded import answer, record, recorded
from validation.study.plan import treatments

SCENE = Path(__file__).parents[2] / "runs" / "tube.toml"


@pytest.fixture(scope="module")
def files(tmp_path_factory: pytest.TempPathFactory) -> list[Path]:
    """Two problems from the first six steps of a wire in a tube."""
    folder = tmp_path_factory.mktemp("problems")
    assert record(read_scene(SCENE)[0], SCENE.parent, folder, steps=6, problems=2) == ""
    return sorted(folder.iterdir())


def test_recorded_problems(files: list[Path]) -> None:
    """W is that of the matrices A and H beside it, and the step's own method solves it from the step's start."""
    assert [file.name for file in files] == ["step_00002.npz", "step_00005.npz"]
    for file in files:
        problem, start = recorded(file)
        with np.load(file) as stored:
            W, H = stored["W"], stored["H"]
        A = problem.primal.A[0].convert("dense").getDenseArray().copy()
        assert np.abs(H @ np.linalg.solve(A, H.T) - W).max() <= 1e-7 * np.abs(W).max()
        found = answer(problem, "status, warm", start, 1e-12, 0.0)
        assert (found.failure, found.claimed, len(found.times)) == ("", False, 1)
        delta = W @ found.lam + problem.q
        assert found.residual <= 1e-12
        assert np.abs(np.minimum(np.diag(W) * found.lam, delta)).max() <= 1e-12 * np.abs(W @ found.lam).max()
        problem.primal.destroy()


def test_refusal_is_told(files: list[Path]) -> None:
    """A method that cannot treat a problem says why; it has no answer."""
    problem, start = recorded(files[0])
    found = answer(problem, "vi-primal", start, 1e-12)
    assert "several entries" in found.failure
    assert (found.lam, found.residual, found.claimed) == (None, np.inf, False)
    problem.primal.destroy()


def test_time_ends_a_recording(tmp_path: Path) -> None:
    """The run stops at its limit, and what was recorded until then is there."""
    ticks = iter(range(1000))
    ended = record(read_scene(SCENE)[0], SCENE.parent, tmp_path, problems=100, limit=2.5, now=lambda: next(ticks))
    assert ended == "after 2.5 s"
    assert len(list(tmp_path.iterdir())) == 3


def test_treatments() -> None:
    """`status` is also started warm, PETSc's Newton methods have other line searches too."""
    found = treatments(("status", "lemke", "vi-ssls"))
    assert list(found) == [
        "status", "status, warm", "lemke", "vi-ssls", "vi-ssls, line search l2", "vi-ssls, line search basic",
    ]  # fmt: skip
    assert found["vi-ssls, line search l2"] == {"vi_ssls_snes_linesearch_type": "l2"}
