"""Impacts: a point mass, and elastic bars in which each contact sends a front to and fro.

The midpoint rule runs on bars without dispersion: one-point masses and dt = h/c. Nodes that touch are without mass, in
cells of a quarter of the others', as the wave passes their cell without inertia.

Contact begins and ends where the force, linear between the times of balance, passes half of the plane wave's.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from meshes.mesh import Mesh
from meshes.structured import grid
from validation.case import Parameter, Quantity, Run, case, fitted_rate
from validation.exact.bar_impacts import BarImpact, BouncingBar, HangingBar, TwoBarImpact
from validation.exact.impacts import BallDrop

Floats = NDArray[np.float64]
EXACT, CLOSE = 1e-12, 1e-3
TOUCHING = 0.25  # length of the cells that touch, over that of the others
EULER_CELLS = 40  # in the shortest bar, for implicit Euler
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

    def contact(self, first: float, last: float | None = None) -> tuple[float, float]:
        """When the force rises above half of the pressure `first`, and falls below half of `last` [s]; NaN if never."""
        time = np.concatenate([[self.time[0] - self.dt], self.time, [self.time[-1] + self.dt]])
        force = np.concatenate([[0.0], self.force, [0.0]])
        rise, fall = first / 2, (first if last is None else last) / 2
        up, down = np.flatnonzero(force > rise), np.flatnonzero(force > fall)
        if not (len(up) and len(down)):
            return np.nan, np.nan
        i, j = up[0], down[-1]
        begin = time[i] - self.dt * (force[i] - rise) / (force[i] - force[i - 1])
        end = time[j] + self.dt * (force[j] - fall) / (force[j] - force[j + 1])
        return float(begin), float(end)


def _march(run: Run, end: float, dt: float, **tables: Any) -> History:
    steps = int(np.ceil(end / dt))

    def observe(system: Any, accepted: Any) -> tuple[float, float, float]:
        energy = sum(sum(body.energy().values()) for body in system.bodies)
        return accepted.time, accepted.result.lam.sum(), energy

    time = {"end": steps * dt, "steps": steps, "integrator": run["integrator"]}
    observed = np.array(run.march(observe=observe, time=time, **tables).observed)
    late = dt / 2 if run["integrator"] == "midpoint" else 0.0
    return History(observed[:, 0] - late, observed[:, 1], observed[:, 2], dt)


def _levels(cells: int, *lengths: str) -> Callable[[dict[str, Parameter]], tuple[float, ...]]:
    """`cells` in the shortest bar; fewer for implicit Euler, whose loss hardly depends on h."""

    def sizes(parameters: dict[str, Parameter]) -> tuple[float, ...]:
        L = min(float(parameters[length]) for length in lengths)
        return (L / (EULER_CELLS if parameters["integrator"] == "implicit-euler" else cells),)

    return sizes


def _dt(run: Run, c: float) -> float:
    """The step asked for, else h/c."""
    return float(run["dt"] or run.h / c)


def _bar(
    run: Run, L: float, origin: float = 0.0, name: str = "bar", touching: str = "start", **table: Any
) -> dict[str, Any]:
    """The table of a bar that touches with its start or its end."""
    return {
        "name": name,
        "kind": "bar",
        "mesh": _mesh(run, L, origin, touching),
        "material": {"EA": run["E"]},
        "density": run["rho"],
        "mass": "one-point" if run["integrator"] == "midpoint" else "consistent",
        **table,
    }


def _mesh(run: Run, L: float, origin: float, touching: str) -> Mesh:
    n = max(2, round(L / run.h))
    x = np.linspace(0, L, n + 1)
    if run["integrator"] == "midpoint":
        x = np.concatenate([[0.0], x[:-1] + TOUCHING * L / n, [L]])
    return grid([origin + (x if touching == "start" else (L - x)[::-1])], [("start", "end")], 1)


def _on_floor(bar: dict[str, Any]) -> dict[str, Any]:
    """The tables of a bar whose start meets the floor."""
    return {"body": [bar], "contact": [{"body": "bar", "tag": "start", "surface": FLOOR}]}


def _times(history: History, pressures: tuple[float, float], exact: tuple[float, float], name: str) -> list[Quantity]:
    """Begin and end of contact, within 2 dt; `pressures` are the exact ones there."""
    return [
        Quantity(f"{name}_{which}", t, e, 2 * history.dt / (e or 1.0))
        for which, t, e in zip(("start", "end"), history.contact(*pressures), exact, strict=True)
    ]


def _implicit_euler(
    run: Run, c: float, impulse: float, loss: float | None, march: Callable[[float], History]
) -> list[Quantity]:
    """What implicit Euler must show: a loss of impulse of order ½ in dt, and energy that never grows.

    `loss` is that of the relative impulse over √dt [s^−½], None where it is not known. Steps of 2h/c, h/c, h/2c (or dt,
    dt/2, dt/4): below, the mesh shows.
    """
    first = float(run["dt"] or 2 * run.h / c)
    steps = [first, first / 2, first / 4]
    impulses, growth = [], 0.0
    for dt in steps:
        run.close()
        history = march(dt)
        impulses.append(history.impulse)
        growth = max(growth, float(np.diff(history.energy).max() / history.energy[0]))
    losses = [1 - found / impulse for found in impulses]
    # I(dt) = I − a √dt
    extrapolated = (np.sqrt(2) * impulses[2] - impulses[1]) / (np.sqrt(2) - 1)
    quantities = [
        Quantity("impulse_extrapolated", extrapolated, impulse, CLOSE),
        Quantity("energy_growth", growth, 0.0, EXACT),
    ]
    if loss is not None:
        quantities.append(Quantity("impulse_loss", losses[2], loss * np.sqrt(steps[2]), 0.1 if loss else CLOSE))
    if loss:
        quantities.append(Quantity("order", fitted_rate(steps, losses), 0.5, 0.05))
    return quantities


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
    tables: dict[str, Any] = {"body": [ball], "contact": [{"body": "ball", "tag": "start", "surface": FLOOR}]}
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
    levels=_levels(200, "L"),
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
        return _implicit_euler(run, exact.c, exact.impulse, exact.implicit_euler_impulse_error(1.0), march)
    history, p = march(_dt(run, exact.c)), exact.peak_pressure
    return [
        Quantity("impulse", history.impulse, exact.impulse, CLOSE),
        *_times(history, (p, p), exact.contact, "contact"),
    ]


@case(
    "hanging-bar",
    {"E": 1.0, "rho": 1.0, "L": 1.0, "h0": 0.5, "dt": 0.0, "integrator": "midpoint"},
    levels=_levels(400, "L"),
    variants=INTEGRATORS,
    orders=(1,),
)
def hanging_bar(run: Run) -> list[Quantity]:
    """A bar fixed at its top is let go and touches the floor from L/c to 2L/c with E h₀/L; again after 3L/c."""
    exact = HangingBar(**run.values("E", "rho", "L", "h0"))
    tables = _on_floor(
        _bar(
            run,
            exact.L,
            supports=[{"tag": "end"}],
            displacement=lambda x, t: exact.h0 * (1 - x[:, 0] / exact.L),
        )
    )
    back = exact.period

    def march(dt: float) -> History:
        return _march(run, 2.5 * exact.L / exact.c, dt, **tables)

    if run["integrator"] == "implicit-euler":
        return _implicit_euler(run, exact.c, exact.impulse, exact.implicit_euler_impulse_error(1.0), march)
    history = _march(run, back + exact.contact[0] + 0.1 * exact.L / exact.c, _dt(run, exact.c), **tables)
    first, second, p = history.between(0.0, back), history.between(back, np.inf), exact.peak_pressure
    period = second.contact(p)[0] - first.contact(p)[0]
    return [
        Quantity("impulse", first.impulse, exact.impulse, CLOSE),
        *_times(first, (p, p), exact.contact, "contact"),
        Quantity("period", period, exact.period, 2 * history.dt / exact.period),
    ]


@case(
    "two-bar-impact",
    {"E": 1.0, "rho": 1.0, "L1": 1.0, "L2": 2.0, "v0": 1.0, "dt": 0.0, "integrator": "midpoint"},
    levels=_levels(200, "L1", "L2"),
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
            _bar(run, exact.L1, -exact.L1, "first", "end", velocity=exact.v0),
            _bar(run, exact.L2, 0.0, "second"),
        ],
        "contact": [contact],
    }

    def march(dt: float) -> History:
        return _march(run, 1.1 * exact.parting, dt, **tables)

    if run["integrator"] == "implicit-euler":
        known = exact.L1 == exact.L2 or max(exact.L1, exact.L2) >= 2 * min(exact.L1, exact.L2)
        loss = exact.implicit_euler_impulse_error(1.0) if known else None
        return _implicit_euler(run, exact.c, exact.impulse, loss, march)
    history, p = march(_dt(run, exact.c)), exact.peak_pressure
    return [
        Quantity("impulse", history.impulse, exact.impulse, CLOSE),
        *_times(history, (p, p), (0.0, exact.contact_end), "contact"),
    ]


@case(
    "bouncing-bar",
    {**BARS, "g": 10.0, "dt": 0.0, "integrator": "midpoint"},
    levels=_levels(100, "L"),
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
    low = exact.rho * exact.c * exact.v0
    high = low + exact.rho * exact.c * exact.g * exact.round_trip
    period = third.contact(low)[0] - first.contact(low)[0]
    return [
        Quantity("impulse", first.impulse, exact.impulse, CLOSE),
        Quantity("second_impulse", second.impulse, exact.impulse, CLOSE),
        *_times(first, (low, high), exact.contact, "contact"),
        *_times(second, (high, low), exact.second_contact, "second_contact"),
        Quantity("period", period, exact.period, 2 * history.dt / exact.period),
    ]
