"""Cases of the catalogue and scenes of solids on the ranks of a communicator."""

from typing import Any

import numpy as np

import validation.cases  # noqa: F401  enters the cases
from contact.certificate import Tolerances
from contact.loop import AcceptedStep, march
from contact.scene.build import build
from contact.scene.schema import Scene
from contact.step import step
from fem.body import Body
from fem.elasticity import Elasticity
from fem.integrators import Static
from fem.loads import Support
from fem.space import Space
from meshes.generators import generate
from validation.case import CASES, Run

LEVELS: list[tuple[str, dict[str, Any], float, int]] = [
    ("hertz-line", {"constraint": "nodal"}, 1 / 12, 1),
    ("hertz-line", {"constraint": "nodal"}, 1 / 12, 2),
    ("hertz-line", {"constraint": "mortar"}, 1 / 12, 2),
    ("hertz-point", {"model": "3d"}, 0.15, 2),
    ("membrane-ball", {}, 4 / 24, 1),
    ("plug", {"nu": 0.4999}, 0.4, 2),
    ("plug", {"E1": 2.0}, 0.4, 2),
    ("wavy", {}, 1 / 10, 2),
    ("patch", {"dim": "3d", "tilt": 20.0, "cells": "free"}, 1 / 4, 2),
    ("layered-tube", {}, 0.8, 2),
    ("layered-tube", {"formulation": "mixed"}, 0.8, 2),
    ("v-groove", {}, 0.0, 1),
    ("two-bars", {}, 0.0, 1),
]


def quantities(comm: Any) -> dict[str, float]:
    """Every quantity of the cases above and of the block below, by name. Collective."""
    result = {}
    for name, changes, h, order in LEVELS:
        case = CASES[name]
        with Run(case, comm, case.configure(changes), h, order, case.method) as run:
            for quantity in case.solve(run):
                result[f"{name} {changes} {order}: {quantity.name}"] = quantity.computed
    return result | _sliding_block(comm) | _falling_block(comm) | _corner(comm) | _two_bodies(comm)


def _sliding_block(comm: Any) -> dict[str, float]:
    """A floating block pressed on a ball by a pressure, its contacts found along the motion."""
    body = {
        "name": "body",
        "mesh": {"shape": "box", "size": [1.0, 1.0], "n": 7, "order": 2, "structured": True},
        "material": {"E": 2.0, "nu": 0.3, "state": "plane-strain"},
        "supports": [{"tag": "left", "component": "x", "value": "0.01*y"}],
        "loads": [{"kind": "pressure", "tag": "top", "value": "0.02*(1 + x)*t"}],
    }
    surface = {"kind": "sphere", "centre": [0.3, -0.7], "radius": 0.7}
    pair = {"body": "body", "tag": "bottom", "surface": surface, "sliding": "finite"}
    system = build(Scene.model_validate({"body": [body], "contact": [pair]}), comm)
    system.prepare()
    found = step(system, 1.0)
    energy = comm.allreduce(float(system.bodies[0].internal_forces() @ system.bodies[0].owned(system.bodies[0].u)))
    system.close()
    return {"block: force": found.lam.sum(), "block: norm": float(np.linalg.norm(found.lam)), "block: energy": energy}


def _two_bodies(comm: Any) -> dict[str, float]:
    """Bodies on non-matching meshes pressed together: in space, and in the plane where one slides along the other."""
    result = {}
    for dim, sliding in ((3, "small"), (2, "finite")):
        state, across = ("3d" if dim == 3 else "plane-strain"), [1.0] * (dim - 1)
        bodies = [
            {
                "name": name,
                "mesh": {
                    "shape": "box",
                    "size": [*across, 0.5],
                    "origin": [0.1 * floor] * (dim - 1) + [floor],
                    "n": n,
                    "order": order,
                    "structured": True,
                },
                "material": {"E": 2.0, "nu": 0.3, "state": state},
                "supports": [
                    {"tag": far, "component": c, "value": value}
                    for c, value in zip("xyz"[:dim], [shift, *[0.0] * (dim - 2), push], strict=True)
                ],
            }
            for name, floor, n, order, far, shift, push in (
                ("lower", -0.5, 3, 2, "bottom", 0.0, 0.0),
                ("upper", 0.0, 4, 1, "top", 0.02, -0.01),
            )
        ]
        surface = {"kind": "body", "body": "lower", "tag": "top"}
        contact = {"body": "upper", "tag": "bottom", "surface": surface, "sliding": sliding}
        system = build(Scene.model_validate({"body": bodies, "contact": [contact]}), comm)
        system.prepare()
        found = step(system, 1.0, tolerances=Tolerances(1e-11, 1e-11))
        assert found.lam.sum() > 0
        result |= {f"two bodies {dim}: force": found.lam.sum(), f"two bodies {dim}: norm": float(found.lam @ found.lam)}
        system.close()
    return result


def _falling_block(comm: Any) -> dict[str, float]:
    """A block falls askew on a plane and leaves it, by either integrator: impulse, energy and the velocity's norm."""
    result = {}
    for integrator in ("midpoint", "implicit-euler"):
        body = {
            "name": "body",
            "mesh": {"shape": "box", "size": [1.0, 1.0], "n": 5, "structured": True},
            "material": {"E": 2.0, "nu": 0.3, "state": "plane-strain"},
            "density": 1.0,
            "rayleigh": [0.01, 0.02],
            "velocity": ["0.1*y", "-0.3 - 0.1*x"],
            "loads": [{"kind": "body", "value": [0.0, -0.1]}],
        }
        floor = {"kind": "plane", "point": [0.0, -0.05], "normal": [0.1, 1.0]}
        scene = Scene.model_validate(
            {
                "time": {"end": 3.0, "steps": 20, "integrator": integrator},
                "body": [body],
                "contact": [{"body": "body", "tag": "bottom", "surface": floor}],
            }
        )
        system = build(scene, comm)
        system.prepare()
        forces: list[float] = []

        def sink(accepted: AcceptedStep, forces: list[float] = forces) -> None:
            forces.append(accepted.result.lam.sum())

        march(system, scene, sink)
        (block,) = system.bodies
        v = block.checkpoint()["v"]
        assert max(forces) > 0
        assert forces[-1] == 0
        result |= {f"{integrator}: {name}": value for name, value in block.energy().items()}
        result[f"{integrator}: force"] = sum(forces)
        result[f"{integrator}: velocity"] = comm.allreduce(float(v @ v))
        system.close()
    return result


def _corner(comm: Any) -> dict[str, float]:
    """Where two supports disagree the later one holds, though its facet be on another rank than the node."""
    mesh = generate("box", size=[1.0, 1.0], n=1, structured=True) if comm.rank == 0 else None
    supports = [
        Support("right", 0, 0.02),
        Support("top", 0, 0.05),
        Support("left", 0, 0.01),
        Support("bottom", 0, 0.03),
    ]
    body = Body("box", Space(comm, mesh, 2), Elasticity(1.0, 0.3, "plane-strain"), supports)
    body.begin(0.0, Static())
    x, u = body.space.piece.points, body.displacement
    found = {(*point, value) for point, value in zip(x.tolist(), u[:, 0].tolist(), strict=True)}
    corners = sorted(set().union(*comm.allgather(found)))
    return {f"corner {x:g} {y:g}": value for x, y, value in corners}
