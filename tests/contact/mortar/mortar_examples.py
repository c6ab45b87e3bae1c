"""Two bodies on non-matching meshes that the tests of mortar contact share."""

from typing import Any

import numpy as np
from contact_examples import prepared
from numpy.typing import NDArray

from contact.system import System
from meshes.generators import generate
from meshes.mesh import Mesh

Floats = NDArray[np.float64]
E, NU, P = 2.0, 0.3, 0.05


def rotation(dim: int, angle: float) -> Floats:
    c, s = np.cos(angle), np.sin(angle)
    if dim == 2:
        return np.array([[c, -s], [s, c]])
    return np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]]) @ np.array([[1, 0, 0], [0, c, -s], [0, s, c]])


def blocks(
    dim: int, orders: tuple[int, int], n: tuple[int, int], angle: float = 0.0, **contact: Any
) -> tuple[dict[str, Any], Floats]:
    """Two unit blocks one on the other, turned by an angle, whose far sides follow a uniform strain; that strain."""
    down, aside = (-(1 - NU**2), NU * (1 + NU)) if dim == 2 else (-1.0, NU)
    R = rotation(dim, angle)
    strain = P / E * R @ np.diag([*[aside] * (dim - 1), down]) @ R.T
    bodies = []
    for name, order, cells, floor, far in zip(
        ("lower", "upper"), orders, n, (0.0, 1.0), ("bottom", "top"), strict=True
    ):
        origin = [0.0] * (dim - 1) + [floor]
        graded = {"grading": 2.0} if name == "lower" else {}
        box = generate("box", size=[1.0] * dim, n=cells, order=order, structured=True, origin=origin, **graded)
        bodies.append(
            {
                "name": name,
                "mesh": Mesh(box.points @ R.T, box.cells, box.facets),
                "material": {"E": E, "nu": NU, "state": "plane-strain" if dim == 2 else "3d"},
                "supports": [{"tag": far, "value": lambda x, t: x @ strain}],
            }
        )
    pair = {"body": "upper", "tag": "bottom", "surface": {"kind": "body", "body": "lower", "tag": "top"}, **contact}
    return {"body": bodies, "contact": [pair]}, strain


def moments(system: System, finite: bool = False) -> Floats:
    """Σ over both bodies of H times the translations and rotations about the origin, (c, m): zero."""
    result = 0.0
    found = system.detect().constraints[0]
    for body, rows in found.H.items():
        x = body.points[: body.space.piece.owned]
        x = x + body.displacement[: len(x)] if finite else x
        dim = x.shape[1]
        modes = [np.eye(dim)[i] + np.zeros_like(x) for i in range(dim)]
        modes += [np.cross(np.eye(3)[i], x) for i in range(3)] if dim == 3 else [np.stack([-x[:, 1], x[:, 0]], axis=1)]
        result = result + rows.sparse() @ np.stack([m.ravel() for m in modes], axis=1)
    return np.asarray(result)


def rings(order: int, side: str = "body", **contact: Any) -> System:
    """Two concentric tubes of different meshes with a clearance of .05."""
    bodies = [
        {
            "name": name,
            "mesh": {"shape": "ring", "inner": inner, "outer": outer, "h": h, "order": order},
            "material": {"E": E, "nu": NU, "state": "plane-strain"},
            "supports": [{"tag": "start", "component": "y"}, {"tag": "end", "component": "x"}],
        }
        for name, inner, outer, h in (("inner", 1.0, 1.95, 0.4), ("outer", 2.0, 3.0, 0.3))
    ]
    pair = {"body": "inner", "tag": "outer", "surface": {"kind": "body", "body": "outer", "tag": "inner"}}
    return prepared(body=bodies, contact=[{**pair, "side": side, **contact}])


def stack(state: str, *layers: dict[str, Any], pressure: float = P, **contact: Any) -> System:
    """Unit blocks one on the other, each with its keys of a mesh, under a pressure; sides free, held at x = 0."""
    dim = 3 if state == "3d" else 2
    sides = [{"tag": "left", "component": "r" if state == "axisymmetric" else "x"}]
    sides += [{"tag": "front", "component": "y"}] if dim == 3 else []
    bodies, contacts = [], []
    for number, layer in enumerate(layers):
        origin = [0.0] * (dim - 1) + [float(number)]
        shape = {key: value for key, value in layer.items() if key in ("n", "order")}
        body = {
            "name": f"body {number}",
            "mesh": {"shape": "box", "size": [1.0] * dim, "structured": True, "origin": origin, **shape},
            "supports": [*sides],
            **{key: value for key, value in layer.items() if key not in shape},
        }
        if body.get("kind") != "rigid":
            body["material"] = {"E": E, "nu": NU, "state": state, **body.get("material", {})}
        bodies.append(body)
        if number:
            surface = {"kind": "body", "body": f"body {number - 1}", "tag": "top"}
            contacts.append(
                {"name": str(number), "body": f"body {number}", "tag": "bottom", "surface": surface, **contact}
            )
    bodies[0]["supports"].append({"tag": "bottom", "component": "z" if state in ("axisymmetric", "3d") else "y"})
    bodies[-1]["loads"] = [{"kind": "pressure", "tag": "top", "value": pressure}]
    return prepared(body=bodies, contact=contacts)
