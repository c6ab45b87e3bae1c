"""Wires and coils in tubes."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from contact.system import System
from validation.case import Parameter, Quantity, Run, Solved, case
from validation.cases.beams import beam_of, count, elements, planar, rod
from validation.exact.helices import CoilTube, HelixTube
from validation.exact.rods import WireTube
from validation.exact.tube_elastica import WireTubeElastica

Floats = NDArray[np.float64]
SOLVER = {"surface_error": 1e-6, "penetration": 1e-6}
STEPS = 20
MI=1.0


@case(
    "wire-tube",
    {"EI": 1.0, "L": 0.3, "R": 1.0, "c": 1e-3},
    levels=elements(16, 32, 64, 128),
    variants=({}, {"L": 0.2}, {"c": 0.01, "L": 0.5}),
    orders=(1,),
)
def wire_tube(run: Run) -> list[Quantity]:
    exact = WireTubeElastica(**run.values("EI", "L", "R", "c"))
    EI, L, R, c = (run[k] for k in ("EI", "L", "R", "c"))
    angle = np.linspace(-0.55, 0.55, 401) * L / R
    path = R * np.stack([np.sin(angle), -np.cos(angle), 0 * angle], axis=1)
    i0 = np.searchsorted(angle, -0.5 * L / R)
    s = np.linspace(-0.5, 0.6, 401) * L / R
    path = R * np.stack([np.sin(s), -np.cos(s), 0 * s], axis=1)
    n = count(run)
    middle = {"at": L / 2, "hold": ["x"]}
    inertia = 24 * EI / L**2 * (1 / (L**2)) * 1.0
    a = c
    beam = rod(run, a, section={"mass": inertia}, placement={"path": path.tolist()}, supports=planar(run, middle))
    tube = {"kind": "torus", "centre": [0.0, 0.0, 0.0], "axis": [0.0, 0.0, 1.0], "bend": R, "radius": c + a, "inside": True}
    time = {"end": float(STEPS), "steps": STEPS, "integrator": "implicit-euler"}
    solved = run.march(lambda *_: None, body=[beam], contact=[{"body": "beam", "samples": 1, "surface": tube}], solver=SOLVER, time=time)
    body, lam = beam_of(solved.system), solved.forces()
    print(np.flatnonzero(lam), lam[lam>0], abs(body.v).max(), body.reactions()[n//2,0])
    tip = (lam[0]+lam[-1])/2
    return [Quantity("tip_force", tip, exact.tip_force, 2e-3),
     Quantity("force", lam.sum(), exact.force, 2e-3)]


def _ends(run: Run, exact: Any, turns: float) -> Any:
    return None


@case(
    "helix-tube",
    {"EI": 1.0, "r": 1.0, "beta": np.radians(20.0), "n": 2.0},
    levels=(1.6,0.8,0.4,0.2),
    orders=(1,),
)
def helix_tube(run: Run) -> list[Quantity]:
    exact = HelixTube(**run.values("EI", "r", "beta"))
    EI, r = run["EI"], run["r"]
    L = run["n"] * exact.pitch / np.cos(exact.beta)
    n = 2*round(L / run.h/2)
    xi = np.linspace(0, 1.01 * L, 40 * int(run["n"]) + 1)
    a = 0.1 * r
    section = {"length": L, "elements": n, "radius": a, "EA": 1e5 * EI / r**2, "GJ": EI, "EI": EI, "mass": MI*exact.compression**2/EI}
    beam = {"name": "beam", "kind": "beam", "sections": [section], "placement": {"path": exact.position(xi).tolist()},
       "supports": [{"at": "start"}, {"at": "end", "hold": ["x", "y", "rx", "ry", "rz"]}],
        "loads": [{"kind": "point", "at": "end", "value": [0.0, 0.0, -exact.compression]}]}
    tube = {"kind": "cylinder", "centre": [0.0, 0.0, 0.0], "axis": [0.0, 0.0, 1.0], "radius": r + a, "inside": True}
    solved = run.march(lambda *_: None, body=[beam], contact=[{"body": "beam", "samples": 1, "surface": tube, "interference": 1e-3*r}], solver=SOLVER, time={"end": float(STEPS), "steps": STEPS, "integrator": "implicit-euler"})
    body, lam = beam_of(solved.system), solved.forces()
    s = np.linspace(0, L, len(lam))
    mid = abs(s - L/2) <= L/6
    f = lam[mid].sum()/(mid.sum()*L/(len(lam)-1))
    t = body.R[:,2,0]
    print(abs(body.v).max(), abs(lam[mid]).min(), solved.result.passes, "N", body.reactions()[[0,-1]], (lam>0).sum(), len(lam))
    return [Quantity("f", f, exact.f, 5e-3), Quantity("F", body.reactions()[0,2], exact.compression, 5e-3),
       Quantity("F2", -body.reactions()[-1,2], exact.compression, 5e-3),
       Quantity("beta", np.arccos(t[n//2]), exact.angle, 5e-3)]


@case(
    "coil-tube",
    {"EI": 1.0, "GJ": 1 / 1.3, "r": 1.0, "kappa0": np.sin(np.radians(80.0)) ** 2 / 1.5, "tau0": np.sin(np.radians(80.0))*np.cos(np.radians(80.0)) / 1.5, "n": 4.0},
    levels=(0.8,0.4,0.2,0.1),
    orders=(1,),
)
def coil_tube(run: Run) -> list[Quantity]:
    exact = CoilTube(**run.values("EI", "GJ", "r", "kappa0","tau0"))
    EI, r = run["EI"], run["r"]
    L = run["n"] * exact.pitch / np.cos(exact.angle)
    n = 2*round(L / run.h/2)
    xi = np.linspace(0, 1.01 * L, 40 * int(run["n"]) + 1)
    a = 0.1 * r
    k2=exact.kappa0**2+exact.tau0**2
    section = {"length": L, "elements": n, "radius": a, "EA": 1e5 * EI / r**2, "GJ": exact.GJ, "EI": EI, "mass": MI*EI/r**4,
       "shape": {"kind": "helix", "radius": exact.kappa0/k2, "pitch": 2*np.pi*exact.tau0/k2}}
    beam = {"name": "beam", "kind": "beam", "sections": [section], "placement": {"path": exact.position(xi).tolist(), "roll": np.pi},
       "supports": [{"at": "start"}, {"at": "end", "hold": ["x", "y", "rx", "ry", "rz"], "twist": exact.tau*L}]}
    tube = {"kind": "cylinder", "centre": [0.0, 0.0, 0.0], "axis": [0.0, 0.0, 1.0], "radius": r + a, "inside": True}
    def begin(system):
        b=beam_of(system)
        F=exact.frame(np.linspace(0,L,n+1))
        print("start frames", abs(b.R[0]-F[0]).max(), abs(b.R[:,:,0]-F[:,:,0]).max())
        b.resume({**b.checkpoint(), "R": F})
    solved = run.march(lambda *_: None, begin=begin, body=[beam], contact=[{"body": "beam", "samples": 1, "surface": tube, "interference": 1e-3*r}], solver=SOLVER, time={"end": float(STEPS), "steps": STEPS, "integrator": "implicit-euler"})
    body, lam = beam_of(solved.system), solved.forces()
    s = np.linspace(0, L, len(lam))
    mid = abs(s - L/2) <= L/6
    f = lam[mid].sum()/(mid.sum()*L/(len(lam)-1))
    t = body.R[:,2,0]
    print(abs(body.v).max(), solved.result.passes, "N", body.reactions()[[0,-1]], (lam>0).sum(), len(lam))
    return [Quantity("f", f, exact.f, 5e-3), 
       Quantity("beta", np.arccos(t[n//2]), exact.angle, 5e-3)]
