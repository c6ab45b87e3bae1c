"""Mixing of passes: a linear iteration ends when its slow motions are seen; contact that follows a tilting block."""

from typing import Any

import numpy as np
import pytest
from contact_examples import box, prepared, solid
from mpi4py import MPI

from contact import mixing
from contact.mixing import Mixing
from contact.solvers.problem import ContactNotConvergedError
from contact.step import step


def test_a_linear_iteration() -> None:
    """y = M x + b with three slow motions, one of which grows: solved after these have been seen."""
    body = solid(box(2), "plane-strain")
    n = body.space.owned
    rng = np.random.default_rng(0)
    Q = np.linalg.qr(rng.normal(size=(n, n)))[0]
    M = Q @ np.diag([1.3, 0.9, -0.7, *np.zeros(n - 3)]) @ Q.T
    exact = rng.normal(size=n)
    passes, residual = Mixing(MPI.COMM_SELF, [body]), 1.0
    for _ in range(8):
        x = body.coordinates()
        body.correct(M @ (x - exact) + exact - x)
        left = float(np.linalg.norm(body.coordinates() - x))
        passes.advance(left / residual)
        residual = left
    np.testing.assert_allclose(body.coordinates(), exact, atol=1e-9)


def _leaning() -> Any:
    """A block pressed on another by a load under which the upper one tends to lean, hung at its top."""
    bodies = []
    for name, order, n, floor in (("lower", 2, 4, 0.0), ("upper", 1, 5, 1.0)):
        shape = {"size": [1.0, 1.0], "n": n, "order": order, "structured": True, "origin": [0.0, floor]}
        mesh = {"shape": "box", **shape}
        bodies.append({"name": name, "mesh": mesh, "material": {"E": 2.0, "nu": 0.3, "state": "plane-strain"}})
    bodies[0]["supports"] = [{"tag": "bottom"}]
    bodies[1]["supports"] = [{"tag": "top", "component": "x", "value": 0.1}]
    bodies[1]["loads"] = [{"kind": "pressure", "tag": "top", "value": "0.03 + 0.01*x"}]
    surface = {"kind": "body", "body": "lower", "tag": "top"}
    return prepared(body=bodies, contact=[{"body": "upper", "tag": "bottom", "surface": surface, "sliding": "finite"}])


def test_a_slow_motion_settles(monkeypatch: pytest.MonkeyPatch) -> None:
    """Without mixing 20 passes leave more than 1e-6 of the residual; with it half as many settle the step."""
    system = _leaning()
    result = step(system, 1.0)
    assert result.passes <= 12
    force = result.lam @ result.linearisation.constraints[0].normals
    assert force[1] == pytest.approx(0.035, rel=1e-7)
    system.close()
    monkeypatch.setattr(mixing, "SLOW", np.inf)
    system = _leaning()
    with pytest.raises(ContactNotConvergedError, match="passes of detection"):
        step(system, 1.0)
    system.close()
