"""The same problems in other units: as many iterations, and the same numbers to 1e-10."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache

from validation.case import CASES, Parameter, Quantity
from validation.stability.point import Answer, decades, of_case, sweep

SAME = 1e-10
# How parameters scale with the units of length and of stress, and h over the unit of length.
PROBLEMS: dict[str, tuple[float, dict[str, tuple[int, int]], dict[str, Parameter]]] = {
    "bar-stop": (1 / 8, {"E": (0, 1), "A": (2, 0), "L": (1, 0), "F": (2, 1), "g": (1, 0)}, {}),
    "layer": (1 / 10, {"E": (0, 1), "R": (1, 0), "H": (1, 0), "a": (1, 0)}, {"E": 1.0}),
    "v-groove": (1.0, {"F": (2, 1)}, {}),
    "cantilever-floor": (1 / 32, {"EI": (4, 1), "L": (1, 0), "q": (1, 1), "d": (1, 0)}, {}),
}
FACTORS = decades(-9, 9)


def _solved(name: str, length: float, stress: float) -> Answer:
    """The answer in units of `length` and `stress`."""
    h, powers, changes = PROBLEMS[name]
    parameters = CASES[name].configure(changes)
    scaled = {p: float(parameters[p]) * length**a * stress**b for p, (a, b) in powers.items()}
    return of_case(name, h * length, **{**parameters, **scaled})


@cache
def _unit(name: str) -> Answer:
    return _solved(name, 1.0, 1.0)


def _compared(name: str, length: float, stress: float) -> Answer:
    """What it computes over its exact value, beside that ratio in the first units; closed forms scale exactly."""
    first, now = _unit(name), _solved(name, length, stress)
    quantities = [
        Quantity(q.name, *((q.computed / q.exact, p.computed / p.exact) if q.exact else (q.computed, p.computed)), SAME)
        for p, q in zip(first.quantities, now.quantities, strict=True)
        # an error over a length of the case's own is a number without a unit, but as small as rounding
        if q.exact
    ]
    iterations = Quantity("iterations", now.iterations, first.iterations, 1e-12)
    return Answer([*quantities, iterations], now.certificate, now.iterations, now.contacts, now.condition)


def _lengths(name: str) -> Callable[[float], Answer]:
    def solve(factor: float) -> Answer:
        return _compared(name, factor, 1.0)

    solve.__doc__ = f"`{name}` with its lengths, and forces, in another unit."
    return solve


def _stresses(name: str) -> Callable[[float], Answer]:
    def solve(factor: float) -> Answer:
        return _compared(name, 1.0, factor)

    solve.__doc__ = f"`{name}` with its stresses, and forces, in another unit."
    return solve


for _name in PROBLEMS:
    sweep(f"length-{_name}", "unit of length [m]", FACTORS, row="units")(_lengths(_name))
    if _name != "v-groove":
        sweep(f"stress-{_name}", "unit of stress [Pa]", FACTORS, row="units")(_stresses(_name))
