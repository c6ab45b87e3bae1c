"""Small bodies and systems that the tests of contact share."""

from typing import Any

import numpy as np
from mpi4py import MPI
from numpy.typing import NDArray

from contact.scene.build import build
from contact.scene.schema import Scene
from contact.system import System
from fem.body import Body
from fem.elasticity import Elasticity, State
from fem.loads import Load, Support
from fem.space import Space
from meshes.generators import generate
from meshes.mesh import Mesh

Floats = NDArray[np.float64]
FLOOR = {
    2: {"kind": "plane", "point": [0.0, 0.0], "normal": [0.0, 1.0]},
    3: {"kind": "plane", "point": [0.0, 0.0, 0.0], "normal": [0.0, 0.0, 1.0]},
}
SCENE = """
[[body]]
name = "block"
material = { E = 1.0, nu = 0.3, state = "plane-strain" }
supports = [{ tag = "left", component = "x" }, { tag = "top", component = "y", value = "-0.01 * t" }]
mesh = { shape = "box", size = [1.0, 1.0], n = 4, structured = true }

[[contact]]
body = "block"
tag = "bottom"
surface = { kind = "plane", point = [0.0, 0.0], normal = [0.0, 1.0] }
"""
"""A block pressed on a floor, as a scene's file."""


def box(dim: int, order: int = 1, n: int = 3) -> Mesh:
    """A unit box on a graded grid, so that no two facets of a side need have the same area."""
    return generate("box", size=[1.0] * dim, n=n, order=order, structured=True, grading=2.0)


def solid(mesh: Mesh, state: State, *supports: Support, loads: tuple[Load, ...] = ()) -> Body:
    """An elastic body with E = 2, ν = .3."""
    return Body("body", Space(MPI.COMM_SELF, mesh, mesh.dim), Elasticity(2.0, 0.3, state), supports, loads)


def held(body: Body) -> Body:
    """The body with its matrix factorised."""
    body.assemble()
    body.factor()
    return body


def prepared(**scene: Any) -> System:
    """A scene's bodies and pairs, assembled and factorised."""
    system = build(Scene.model_validate(scene), MPI.COMM_SELF)
    system.prepare()
    return system


def on_floor(mesh: Mesh, state: State, loads: list[Any], supports: list[Any], **contact: Any) -> System:
    """A body with E = 2, ν = .3 that contact alone holds in the last direction, its bottom on a rigid floor."""
    body = {
        "name": "body",
        "mesh": mesh,
        "material": {"E": 2.0, "nu": 0.3, "state": state},
        "loads": loads,
        "supports": supports,
    }
    pair = {"body": "body", "tag": "bottom", "surface": FLOOR[mesh.dim], **contact}
    return prepared(body=[body], contact=[pair])
