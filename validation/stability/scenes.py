"""Random scenes: small solids pressed on surfaces or held between plates, and wires in tubes."""

from __future__ import annotations

import time
from typing import Any

import numpy as np
from numpy.typing import NDArray

from contact.devices.device_contact import DeviceContact
from contact.system import System
from validation.case import Run
from validation.stability.generators import Random
from validation.stability.point import LIMITS, Verdict, bench, of_run, verdict_on
from validation.stability.slits import plates
from validation.stability.trials import Trial

Floats = NDArray[np.float64]
Tables = dict[str, Any]

# Deepest places inside a wall, over the body's size or the wire's radius, that a certificate of the scene allows.
SOLID, WIRE = 2e-8, 1e-3


def try_scene(kind: str, seed: int, number: int) -> Trial:
    """Draw a scene of `kind`, solid or wire, run it and judge what is claimed of it.

    A solution must carry its certificate, push and not pull, and have its points outside the walls by formulas of their
    own; all scenes are feasible but plates too close for a rigid block and wires too wide for their tubes.
    """
    rng = np.random.default_rng([seed, {"solid": 1, "wire": 2}[kind], number])
    tables, feasible = _solid(rng) if kind == "solid" else _wire(rng)
    begun, run = time.process_time(), bench()
    contacts, iterations, worst = 0, 0, None
    try:
        worst = _solved_solid(run, tables) if kind == "solid" else _solved_wire(run, tables)
        answer = of_run(run, [])
        contacts, iterations = answer.contacts, answer.iterations
        wrong = [f"{name} {value:.2g}" for name, value in answer.certificate.items() if not value <= LIMITS[name]]
        if not worst <= (SOLID if kind == "solid" else WIRE):
            wrong.append(f"a point {worst:.2g} inside")
        assert run.solved is not None
        if run.solved.result.lam.min(initial=0.0) < 0:
            wrong.append("a contact that pulls")
        if not feasible:
            wrong.append("an answer to what has none")
        verdict, reason = (Verdict.WRONG, ", ".join(wrong)) if wrong else (Verdict.RIGHT, "")
    except Exception as error:
        verdict, reason = verdict_on(error, feasible)
    finally:
        run.close()
    seconds = time.process_time() - begun
    return Trial(number, kind, contacts, feasible, verdict.value, " ".join(reason.split()), worst, iterations, seconds)


def _solid(rng: Random) -> tuple[Tables, bool]:
    """A block on a plane, ball or paraboloid, pressed down by its top or by a pressure, or between two plates."""
    dim = int(rng.integers(2, 4))
    size = rng.uniform(0.5, 2, dim) * 10.0 ** rng.integers(-3, 3)
    n, order = int(rng.integers(2, 6 if dim == 2 else 4)), int(rng.integers(1, 3))
    E = 10.0 ** rng.uniform(3, 11)
    H = float(size[-1])
    body: Tables = {
        "name": "block",
        "mesh": {"shape": "box", "size": size.tolist(), "n": n, "order": order, "structured": True},
        "material": {"E": E, "nu": rng.uniform(0, 0.45), "state": "3d" if dim == 3 else "plane-strain"},
        "supports": [{"tag": "left", "component": "x"}, {"tag": "front", "component": "y"}][: dim - 1],
        "loads": [],
    }
    touching: Tables = {"body": "block", "tag": "bottom"}
    touching["constraint"] = "mortar" if dim == 3 and order == 2 else str(rng.choice(["nodal", "mortar"]))
    kind = str(rng.choice(["plane", "sphere", "paraboloid", "slit"]))
    contact = [touching]
    feasible = True
    if kind == "slit":
        rigid, width = bool(rng.random() < 0.5), float(rng.choice([1e-2, 1e-6, 0.0, -1e-6, -1e-2])) * H
        if rigid:
            body |= {"kind": "rigid", "guided": True}
            body.pop("material")
            body["loads"] = [{"kind": "body", "value": [0.0] * (dim - 1) + [-1.0]}]
        else:
            body["loads"] = [{"kind": "body", "value": [0.0] * (dim - 1) + [-1e-3 * E / H]}]
        contact = [touching | plate for plate in plates(width, H, dim)]
        feasible = not rigid or width >= 0
    else:
        middle, radius = (size / 2).tolist()[:-1], float(rng.uniform(0.5, 4) * size.max())
        if kind == "plane":
            tilt = rng.uniform(0, 0.1)
            surface: Tables = {"kind": "plane", "point": [0.0] * dim, "normal": [-tilt, *[0.0] * (dim - 2), 1.0]}
            low = -tilt * float(size[0])
        elif kind == "sphere":
            surface, low = {"kind": "sphere", "centre": [*middle, -radius], "radius": radius}, 0.0
        else:
            surface, low = {"kind": "paraboloid", "origin": [*middle, 0.0], "radius": radius}, 0.0
        down = 10.0 ** rng.uniform(-4, -1.5) * H
        body["supports"].append({"tag": "top", "component": "z" if dim == 3 else "y", "value": low - down})
        touching |= {"surface": surface, "interference": 1.1 * float(size.max())}
        if kind == "plane":
            touching["interference"] = -low
        if kind == "sphere" and rng.random() < 0.5:
            touching["sliding"] = "finite"
    return {"body": [body], "contact": contact}, feasible


def _solved_solid(run: Run, tables: Tables) -> float:
    """Solve, and measure the deepest place inside a wall over the block's size, along the normals of small sliding."""
    solved = run.solve(**tables)
    block = solved.system.bodies[0]
    deepest = 0.0
    for k, table in enumerate(tables["contact"]):
        points = solved.points(k)
        X, u = points.positions(), points.displacements()
        gap = points.mean(_distance(table["surface"], X, u, table.get("sliding") == "finite"))
        deepest = max(deepest, float(-gap.min(initial=0.0)))
    return deepest / block.size


def _distance(surface: Tables, X: Floats, u: Floats, finite: bool) -> Floats:
    """Of points X + u to a plane, a ball or a paraboloid; of small sliding by the closest point of X."""
    if surface["kind"] == "plane":
        n = np.array(surface["normal"]) / np.linalg.norm(surface["normal"])
        return np.asarray((X + u - surface["point"]) @ n)
    if surface["kind"] == "sphere":
        if finite:
            return np.asarray(np.linalg.norm(X + u - surface["centre"], axis=1) - surface["radius"])
        away = X - surface["centre"]
        far = np.linalg.norm(away, axis=1)
        return np.asarray(far - surface["radius"] + (u * away).sum(axis=1) / far)
    # the foot s of (ρ, z) on z = −s²/2R solves s³ + 2R(R + z)s = 2R²ρ
    R, flat = surface["radius"], X[:, :-1] - surface["origin"][:-1]
    rho, z = np.linalg.norm(flat, axis=1), X[:, -1] - surface["origin"][-1]
    s = rho.copy()
    for _ in range(50):
        s -= (s**3 + 2 * R * (R + z) * s - 2 * R**2 * rho) / (3 * s**2 + 2 * R * (R + z))
    out = np.divide(flat, rho[:, None], out=np.zeros_like(flat), where=rho[:, None] > 0)
    normal = np.column_stack([(s / R)[:, None] * out, np.ones(len(X))]) / np.sqrt(1 + (s / R) ** 2)[:, None]
    foot = np.column_stack([s[:, None] * out, -(s**2) / (2 * R)])
    x = np.column_stack([flat, z])
    return np.asarray(((x - foot + u) * normal).sum(axis=1))


def _wire(rng: Random) -> tuple[Tables, bool]:
    """A wire in a straight or bent tube, loaded across, at its end, or pushed; one in ten is too wide for its tube."""
    a = 10.0 ** rng.uniform(-4, -2.5)
    L = a * rng.uniform(50, 400)
    EI = 10.0 ** rng.uniform(9, 11) * np.pi * a**4 / 4
    fits = bool(rng.random() < 0.9)
    clearance = a * 10.0 ** rng.uniform(-3, 0.5) * (1 if fits else -0.1)
    bent = bool(rng.random() < 0.5)
    R = L * rng.uniform(1.5, 6)
    axis, across = [[0.0, 0.0, 1.0], [1.0, 0.0, 0.0]]
    section = {"length": L, "elements": int(rng.integers(8, 25)), "radius": a, "EI": EI, "GJ": EI, "EA": 4 * EI / a**2}
    section |= {"mass": EI / L**4, "inertia": EI / L**4 * a**2}
    angle = rng.uniform(0, 2 * np.pi)
    q = rng.uniform(0, 3) * EI * max(a, abs(clearance)) / L**4 * 100
    loads: list[Tables] = [
        {"kind": "line", "value": [f"{float(q * v)!r} * t" for v in (0.0, np.cos(angle), np.sin(angle))]}
    ]
    if rng.random() < 0.5:
        P = rng.uniform(0, 2) * np.pi**2 * EI / L**2 / (0.05 + abs(clearance) / L * 10)
        P = min(P, 30 * EI / L**2)
        loads.append({"kind": "point", "at": "end", "value": [f"{float(-P)!r} * t", 0.0, 0.0]})
    phi = np.linspace(0, 1.1 * L / R, 300)
    placement: Tables = {"path": np.column_stack([R * np.sin(phi), R * (1 - np.cos(phi)), 0 * phi]).tolist()}
    tube: Tables = {"kind": "torus", "centre": [0.0, R, 0.0], "axis": axis, "bend": R}
    if not bent:
        placement, tube = {}, {"kind": "cylinder", "centre": [0.0] * 3, "axis": across}
    tube |= {"radius": a + clearance, "inside": True}
    wire = {
        "name": "wire",
        "kind": "beam",
        "sections": [section],
        "placement": placement,
        "supports": [{"at": "start", "hold": ["x", "y", "z", "rx"], "push": f"{float(0.02 * L * rng.random())!r} * t"}],
        "loads": loads,
    }
    contact = {"body": "wire", "samples": int(rng.integers(1, 3)), "surface": tube, "interference": 1e-3 * a}
    if bent:  # the pushed end stays on the axis of a straight tube only
        wire["supports"] = [{"at": "start", "hold": ["x", "y", "z", "rx"]}]
    time = {"end": 1.0, "steps": 10, "integrator": "implicit-euler"}
    return {"body": [wire], "contact": [contact], "time": time, "solver": {"max_halvings": 10}}, fits


def _solved_wire(run: Run, tables: Tables) -> float:
    """March, and measure the deepest place of the wire's surface inside the tube's wall, over the wire's radius."""
    tube, a = tables["contact"][0]["surface"], tables["body"][0]["sections"][0]["radius"]

    def deepest(system: System, accepted: Any) -> float:
        pair = system.pairs[0]
        assert isinstance(pair, DeviceContact)
        x = pair.at - np.array(tube["centre"])
        if tube["kind"] == "torus":
            from_axis = np.hypot(np.hypot(x[:, 0], x[:, 1]) - tube["bend"], x[:, 2])
        else:
            from_axis = np.hypot(x[:, 1], x[:, 2])
        return float((from_axis + a - tube["radius"]).max() / a)

    return max(float(depth) for depth in run.march(deepest, **tables).observed)
