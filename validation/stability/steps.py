"""Time steps from a millionth of the natural period to a million of them."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from contact.system import System
from validation.case import Quantity
from validation.cases.beams import beam_of
from validation.stability.point import Answer, bench, decades, of_run, sweep

Floats = NDArray[np.float64]

STEPS = 24


@sweep("time-step", "Δt over the natural period [-]", decades(-6, 6, 2), row="step to t → ∞")
def time_step(ratio: float) -> Answer:
    """A sprung mass thrown against a stop: each step the minimiser over u ≤ g, by one formula; energy never grows."""
    k, m, g, v0 = 4.0, 1.0, 0.05, 0.3
    dt = ratio * 2 * np.pi * np.sqrt(m / k)
    g = min(g, 3.5 * dt * v0)  # met within the first steps, however short
    u, v, force, energy = 0.0, v0, [], [m * v0**2 / 2]
    for _ in range(STEPS):
        free = (m / dt**2 * (u + dt * v)) / (m / dt**2 + k)
        new = min(free, g)
        force.append((m / dt**2 + k) * (free - new))
        u, v = new, (new - u) / dt
        energy.append(k * u**2 / 2 + m * v**2 / 2)
    bar = {
        "name": "bar",
        "kind": "spring",
        "mesh": {"shape": "interval", "length": 1.0, "n": 1},
        "material": {"k": k},
        "density": 3 * m,  # a third of it is what moves with the end
        "supports": [{"tag": "start"}],
        # the fixed end is at rest whatever the expression says of it
        "velocity": f"{v0!r} * x",
    }
    stop = {"body": "bar", "tag": "end", "surface": {"kind": "plane", "point": [1.0 + g], "normal": [-1.0]}}
    return _history([bar], [stop], dt, [np.array(force), np.array(energy)], g)


def _history(
    body: list[dict[str, Any]], contact: list[dict[str, Any]], dt: float, exact: list[Floats], length: float
) -> Answer:
    """March and compare forces and energies of all steps with those of the recursion."""

    def observe(system: System, accepted: Any) -> tuple[float, float, float]:
        result = accepted.result
        worst = max(result.certificate.complementarity, result.certificate.equilibrium)
        return float(result.lam.sum()), sum(system.bodies[0].energy().values()), worst

    with bench() as run:
        time = {"end": STEPS * dt, "steps": STEPS, "integrator": "implicit-euler"}
        solved = run.march(observe, body=body, contact=contact, time=time)
        force, energy, worst = np.array(solved.observed).T
        F, E = exact
        energy = np.concatenate([E[:1], energy])
        answer = of_run(
            run,
            [
                Quantity("impulse", force.sum(), F.sum(), 1e-9),
                Quantity("forces", float(np.abs(force - F).max() / (F.max() or 1.0)), 0.0, 1e-9),
                Quantity("energies", float(np.abs(energy - E).max() / E[0]), 0.0, 1e-9),
                Quantity("energy_growth", float(np.diff(energy).max(initial=0.0) / E[0]), 0.0, 1e-12),
            ],
        )
        worst_residuals = {**answer.certificate, "complementarity": float(worst.max())}
        return Answer(answer.quantities, worst_residuals, answer.iterations, answer.contacts, answer.condition)


@sweep("time-step-bar", "Δt over the time of a wave along the bar and back [-]", decades(-6, 6, 2))
def time_step_bar(ratio: float) -> Answer:
    """An elastic bar thrown onto a floor: every step certified, its energy never grows, its impulse at most 2ρLv₀."""
    E, rho, L, v0 = 900.0, 1.0, 10.0, 10.0
    dt = ratio * 2 * L / np.sqrt(E / rho)
    height = min(0.5, 3.5 * v0 * dt)

    def observe(system: System, accepted: Any) -> tuple[float, float]:
        return float(accepted.result.lam.sum()) * dt, sum(system.bodies[0].energy().values())

    bar = {
        "name": "bar",
        "kind": "bar",
        "mesh": {"shape": "interval", "length": L, "n": 20, "origin": height},
        "material": {"EA": E},
        "density": rho,
        "velocity": -v0,
    }
    floor = {"body": "bar", "tag": "start", "surface": {"kind": "plane", "point": [0.0], "normal": [1.0]}}
    with bench() as run:
        time = {"end": STEPS * dt, "steps": STEPS, "integrator": "implicit-euler"}
        solved = run.march(observe, body=[bar], contact=[floor], time=time)
        impulse, energy = np.array(solved.observed).T
        energy = np.concatenate([[rho * L * v0**2 / 2], energy])
        body = solved.system.bodies[0]
        assert body.v is not None
        momentum = float(np.ones(len(body.v)) @ body.inertia.forces(body.v)) if body.inertia is not None else np.nan
        return of_run(
            run,
            [
                Quantity("energy_growth", float(np.diff(energy).max(initial=0.0) / energy[0]), 0.0, 1e-12),
                Quantity("momentum", (momentum + rho * L * v0 - impulse.sum()) / (rho * L * v0), 0.0, STEPS * 1e-8),
                Quantity("impulse_above", max(0.0, float(impulse.sum() / (2 * rho * L * v0) - 1)), 0.0, 1e-9),
            ],
        )


@sweep("time-step-beam", "Δt over the period of the first mode [-]", decades(-6, 6))
def time_step_beam(ratio: float) -> Answer:
    """A cantilever thrown at a floor under its tip: every step certified, energy never grows.

    The energy is that of a linear beam, from its stiffness and its masses; slopes are 1e-3.
    """
    L, EI, mass, a = 1.0, 1.0, 1.0, 1e-2
    period = 2 * np.pi / (1.8751040687**2 * np.sqrt(EI / mass) / L**2)
    dt = ratio * period
    d, v0 = 1e-3, 1e-2
    d = min(d, 3.5 * v0 * dt)
    section = {"length": L, "elements": 10, "radius": a, "EA": 1e4, "EI": EI, "GJ": EI, "mass": mass, "inertia": 1e-4}

    def observe(system: System, accepted: Any) -> tuple[float, float]:
        return sum(system.bodies[0].energy().values()), float(beam_of(system).displacement[-1, 1])

    beam = {
        "name": "beam",
        "kind": "beam",
        "sections": [section],
        "supports": [{"at": "start"}],
        "velocity": [0.0, -v0, 0.0],
    }
    plane = {"kind": "plane", "point": [0.0, -d - a, 0.0], "normal": [0.0, 1.0, 0.0]}
    with bench() as run:
        solved = run.march(
            observe,
            body=[beam],
            contact=[{"body": "beam", "samples": 1, "surface": plane}],
            solver={"max_halvings": 12},
            time={"end": STEPS * dt, "steps": STEPS, "integrator": "implicit-euler"},
        )
        energy, tip = np.array(solved.observed).T
        scale = mass * L * v0**2 / 2
        energy = np.concatenate([[scale], energy])
        return of_run(
            run,
            [
                Quantity("energy_growth", float(np.diff(energy).max(initial=0.0) / scale), 0.0, 1e-6),
                Quantity("below_floor_over_d", max(0.0, float((-d - tip.min()) / d)), 0.0, 1e-3),
            ],
        )
