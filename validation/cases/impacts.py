"""Impacts: a point mass, and elastic bars in which each contact sends a front to and fro.

Contact begins with the first and ends with the last force above half of the plane wave's: what dispersion spreads of a
front stays out of the times, not out of the impulses.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from validation.case import Quantity, Run, case
from validation.exact.bar_impacts import BarImpact, BouncingBar, HangingBar, TwoBarImpact
from validation.exact.impacts import BallDrop

Floats = NDArray[np.float64]
EXACT, CLOSE = 1e-12, 1e-3
FLOOR = {"kind": "plane", "point": [0.0], "normal": [1.0]}


@dataclass(frozen=True)
class History:
    """What each step found: `time` of its balance [s], contact `force` [N], `energy` at its end [J]; `dt` [s]."""

    time: Floats
    force: Floats
    energy: Floats
    dt: float

    def between(self, start: float, end: float) -> History:
        """The steps from `start` to `end` [s]."""
        part = (self.time > start) & (self.time < end)
        return History(self.time[part], self.force[part], self.energy[part], self.dt)

    @property
    def impulse(self) -> float:
        """Σ λ dt [N s]."""
        return float(self.force.sum() * self.dt)

    def contact(self, pressure: float) -> tuple[float, float]:
        """The begin and end of forces above half of `pressure` [s]; NaN where there are none."""
        closed = self.time[self.force > pressure / 2]
        return (closed[0] - self.dt / 2, closed[-1] + self.dt / 2) if len(closed) else (np.nan, np.nan)


def _march(run: Run, end: float, dt: float, **tables: Any) -> History:
    steps = int(np.ceil(end / dt))

    def observe(system: Any, accepted: Any) -> tuple[float, float, float]:
        energy = sum(sum(body.energy().values()) for body in system.bodies)
        return accepted.time, accepted.result.lam.sum(), energy

    time = {"end": steps * dt, "steps": steps, "integrator": run["integrator"]}
    observed = np.array(run.march(observe=observe, time=time, **tables).observed)
    late = dt / 2 if run["integrator"] == "midpoint" else 0.0
    return History(observed[:, 0] - late, observed[:, 1], observed[:, 2], dt)


def _dt(run: Run, c: float) -> float:
    """The step asked for; else h/c, and h/(√2 c) for the midpoint rule.

    With that the dispersion of consistent masses and of the midpoint rule, ±k²h²/24 and −ω²dt²/12, cancel.
    """
    if run["dt"]:
        return float(run["dt"])
    return float(run.h / c / (np.sqrt(2) if run["integrator"] == "midpoint" else 1.0))


def _bar(run: Run, L: float, origin: float = 0.0, name: str = "bar", **table: Any) -> dict[str, Any]:
    mesh = {"shape": "interval", "length": L, "n": max(2, round(L / run.h)), "origin": origin}
    return {
        "name": name,
        "kind": "bar",
        "mesh": mesh,
        "material": {"EA": run["E"]},
        "density": run["rho"],
        **table,
    }


def _on_floor(bar: dict[str, Any]) -> dict[str, Any]:
    """The tables of a bar whose start meets the floor."""
    return {"body": [bar], "contact": [{"body": "bar", "tag": "start", "surface": FLOOR}]}


def _times(history: History, pressure: float, exact: tuple[float, float], prefix: str = "") -> list[Quantity]:
    """Begin and end of contact, within 2 dt."""
    names = (f"{prefix}contact_start", f"{prefix}contact_end")
    return [
        Quantity(name, t, e, 2 * history.dt / (e or 1.0))
        for name, t, e in zip(names, history.contact(pressure), exact, strict=True)
    ]


def _implicit_euler(
    run: Run, c: float, impulse: float, loss: float, march: Callable[[float], History]
) -> list[Quantity]:
    """What implicit Euler must show: a loss of impulse of order ½ in dt, and energy that never grows.

    `loss` is that of the relative impulse over √dt [s^−½], NaN where it is not known.
    """
    dt = _dt(run, c)
    coarse = march(dt)
    run.close()
    fine = march(dt / 4)
    lost = 1 - fine.impulse / impulse
    growth = np.diff(fine.energy).max() / fine.energy[0]
    law = [] if np.isnan(loss) else [Quantity("impulse_loss", lost, loss * np.sqrt(dt / 4), 0.1 if loss else CLOSE)]
    order = (
        []
        if np.isnan(loss) or not loss
        else [Quantity("order", np.log((1 - coarse.impulse / impulse) / lost) / np.log(4), 0.5, 0.05)]
    )
    return [
        Quantity("impulse_extrapolated", 2 * fine.impulse - coarse.impulse, impulse, CLOSE),
        *law,
        *order,
        Quantity("energy_growth", max(0.0, growth), 0.0, EXACT),
    ]


BARS: dict[str, float | str] = {"E": 900.0, "rho": 1.0, "L": 10.0, "h0": 5.0}
INTEGRATORS = ({"integrator": "midpoint"}, {"integrator": "implicit-euler"})


@case(
    "ball-drop",
    {"m": 1.0, "g": 9.81, "x0": 1.0, "dt": 0.1, "integrator": "implicit-euler"},
    variants=({}, {"g": 10.0}),
    orders=(1,),
)
def ball_drop(run: Run) -> list[Quantity]:
    """A point mass on a floor: implicit Euler's own sequence; g = 10 grazes the floor at its fourth step."""
    exact = BallDrop(**run.values("m", "g", "x0", "dt"))
    m, g, dt = run["m"], run["g"], run["dt"]
    steps = exact.contact_step + 10
    ball = {
        "name": "ball",
        "kind": "rigid",
        "mesh": {"shape": "interval", "length": 1.0, "n": 1, "origin": run["x0"]},
        "density": m,
        "loads": [{"kind": "body", "value": [-m * g]}],
    }

    def observe(system: Any, accepted: Any) -> tuple[float, float]:
        return accepted.result.lam.sum() * dt, run["x0"] + system.bodies[0].displacement[0, 0]

    time = {"end": steps * dt, "steps": steps, "integrator": run["integrator"]}
    tables = {"body": [ball], "contact": [{"body": "ball", "tag": "start", "surface": FLOOR}]}
    observed = np.array(run.march(observe=observe, time=time, **tables).observed)
    impulses, n = exact.impulses(steps)[1:], exact.contact_step
    names = {"impulse": n, "next_impulse": n + 1, "rest_impulse": n + 2}
    return [
        *[Quantity(name, observed[k - 1, 0], impulses[k - 1], EXACT) for name, k in names.items()],
        Quantity("impulse_deviation", np.abs(observed[:, 0] - impulses).max() / (m * g * dt), 0.0, EXACT),
        Quantity("position_deviation", np.abs(observed[:, 1] - exact.positions(steps)[1:]).max(), 0.0, EXACT),
    ]


@case(
    "bar-impact",
    {**BARS, "v0": 10.0, "dt": 0.0, "integrator": "midpoint"},
    levels=(1 / 20,),
    variants=INTEGRATORS,
    orders=(1,),
)
def bar_impact(run: Run) -> list[Quantity]:
    """A bar flies against a wall: ρcv₀ for 2L/c, restitution 1; implicit Euler loses √(c dt/πL) of the impulse."""
    exact = BarImpact(**run.values("E", "rho", "L", "h0", "v0"))
    tables = _on_floor(_bar(run, exact.L, exact.h0, velocity=-exact.v0))
    end = exact.contact[1] + 0.3 * exact.round_trip

    def march(dt: float) -> History:
        return _march(run, end, dt, **tables)

    if run["integrator"] == "implicit-euler":
        loss = exact.implicit_euler_impulse_error(1.0)
        return _implicit_euler(run, exact.c, exact.impulse, loss, march)
    history = march(_dt(run, exact.c))
    return [
        Quantity("impulse", history.impulse, exact.impulse, CLOSE),
        *_times(history, exact.peak_pressure, exact.contact),
    ]


@case(
    "hanging-bar",
    {"E": 1.0, "rho": 1.0, "L": 1.0, "h0": 0.5, "dt": 0.0, "integrator": "midpoint"},
    levels=(1 / 1000,),
    variants=INTEGRATORS,
    orders=(1,),
)
def hanging_bar(run: Run) -> list[Quantity]:
    """A bar fixed at its top is let go and touches the floor from L/c to 2L/c with E h₀/L; back at 3L/c.

    Of implicit Euler's loss there is as much as in `bar-impact`, of half the duration of contact: 2√(c dt/πL).
    """
    exact = HangingBar(**run.values("E", "rho", "L", "h0"))
    tables = _on_floor(
        _bar(
            run,
            exact.L,
            supports=[{"tag": "end"}],
            displacement=lambda x, t: exact.h0 * (1 - x[:, 0] / exact.L),
        )
    )

    def march(dt: float) -> History:
        return _march(run, 2.5 * exact.L / exact.c, dt, **tables)

    if run["integrator"] == "implicit-euler":
        loss = 2 * np.sqrt(exact.c / (np.pi * exact.L))
        return _implicit_euler(run, exact.c, exact.impulse, loss, march)
    history = march(_dt(run, exact.c))
    return [
        Quantity("impulse", history.impulse, exact.impulse, CLOSE),
        *_times(history, exact.peak_pressure, exact.contact),
    ]


@case(
    "two-bar-impact",
    {"E": 1.0, "rho": 1.0, "L1": 1.0, "L2": 2.0, "v0": 1.0, "dt": 0.0, "integrator": "midpoint"},
    levels=(1 / 400,),
    variants=(*INTEGRATORS, {"integrator": "implicit-euler", "L2": 1.0}),
    orders=(1,),
)
def two_bar_impact(run: Run) -> list[Quantity]:
    """A bar meets another at rest: ½ρcv₀ for 2L₁/c; with L₂ = 2L₁ they then touch without force until 4L₁/c.

    Where they part with the force implicit Euler's loss is that of `bar-impact`; where they stay together, none.
    """
    exact = TwoBarImpact(**run.values("E", "rho", "L1", "L2", "v0"))
    contact = {
        "body": "second",
        "tag": "start",
        "surface": {"kind": "point", "body": "first", "tag": "end", "normal": [1.0]},
    }
    tables = {
        "body": [
            _bar(run, exact.L1, -exact.L1, "first", velocity=exact.v0),
            _bar(run, exact.L2, 0.0, "second"),
        ],
        "contact": [contact],
    }

    def march(dt: float) -> History:
        return _march(run, 1.1 * max(exact.parting, exact.contact_end), dt, **tables)

    if run["integrator"] == "implicit-euler":
        apart, together = exact.L1 == exact.L2, max(exact.L1, exact.L2) >= 2 * min(exact.L1, exact.L2)
        loss = np.sqrt(exact.c / (np.pi * exact.L1)) if apart else 0.0 if together else np.nan
        return _implicit_euler(run, exact.c, exact.impulse, loss, march)
    history = march(_dt(run, exact.c))
    return [
        Quantity("impulse", history.impulse, exact.impulse, CLOSE),
        *_times(history, exact.peak_pressure, (0.0, exact.contact_end)),
    ]


@case(
    "bouncing-bar",
    {**BARS, "g": 10.0, "dt": 0.0, "integrator": "midpoint"},
    levels=(1 / 20,),
    orders=(1,),
)
def bouncing_bar(run: Run) -> list[Quantity]:
    """A bar falls and bounces for ever: p grows in the first contact and falls in the second."""
    exact = BouncingBar(**run.values("E", "rho", "L", "h0", "g"))
    weight = {"kind": "body", "value": -exact.rho * exact.g}
    tables = _on_floor(_bar(run, exact.L, exact.h0, loads=[weight]))
    history = _march(run, exact.contact[0] + exact.period + 0.3 * exact.round_trip, _dt(run, exact.c), **tables)
    middle, late = exact.contact[1] + exact.flight / 2, exact.second_contact[1] + exact.flight / 2
    first, second, third = (history.between(a, b) for a, b in ((0.0, middle), (middle, late), (late, np.inf)))
    pressure = exact.rho * exact.c * exact.v0
    start = first.contact(pressure)[0]
    return [
        Quantity("impulse", first.impulse, exact.impulse, CLOSE),
        Quantity("second_impulse", second.impulse, exact.impulse, CLOSE),
        *_times(first, pressure, exact.contact),
        *_times(second, pressure, exact.second_contact, "second_"),
        Quantity("period", third.contact(pressure)[0] - start, exact.period, 2 * history.dt / exact.period),
    ]
