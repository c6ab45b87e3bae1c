"""Bars, springs and rigid bodies whose answer is one line, and the degenerate constraints of the extreme set."""

from __future__ import annotations

import numpy as np

from validation.case import Quantity, Run, Solved, case
from validation.exact.bars import BarStop, Slit, TwoBars, v_groove

EXACT = 1e-10
SHARED = 1e-12


def _bar(
    name: str, EA: float, L: float, cells: int, fixed: str, loads: list[dict[str, object]], origin: float = 0.0
) -> dict[str, object]:
    """A bar's table."""
    return {
        "name": name,
        "kind": "bar",
        "mesh": {"shape": "interval", "length": L, "n": cells, "origin": origin},
        "material": {"EA": EA},
        "supports": [{"tag": fixed}],
        "loads": loads,
    }


def _spring(k: float) -> dict[str, object]:
    """What a spring has in place of a bar's entries."""
    return {"kind": "spring", "material": {"k": k}}


def _end(solved: Solved, body: int = 0, last: bool = True) -> float:
    """The displacement of a bar's end."""
    b = solved.system.bodies[body]
    x = b.space.piece.points[:, 0] * (1 if last else -1)
    found = (float(x.max()), float(b.u[np.argmax(x)])) if len(x) else (-np.inf, 0.0)
    return float(max(b.space.comm.allgather(found))[1])


def _stop(at: float, tag: str = "end", towards: float = 1.0, **options: object) -> dict[str, object]:
    """A rigid stop for a bar's end that moves `towards` it."""
    return {
        "body": "bar",
        "tag": tag,
        "surface": {"kind": "plane", "point": [at], "normal": [-towards]},
        **options,
    }


@case("bar-stop", {"E": 1.0, "A": 1.0, "L": 1.0, "F": 1.0, "q": 0.0, "g": 0.1}, levels=(1 / 8,), orders=(1,))
def bar_stop(run: Run) -> list[Quantity]:
    """A bar pulled against a rigid stop: R = F + qL/2 − EAg/L."""
    exact = BarStop(**run.values("E", "A", "L", "F", "q", "g"))
    solved = _solve_bar_stop(run, 1)
    return [
        Quantity("reaction", solved.forces().sum(), exact.reaction, EXACT),
        Quantity("end_displacement", _end(solved), exact.end_displacement, EXACT),
    ]


def _solve_bar_stop(run: Run, copies: int, **solver: object) -> Solved:
    E, A, L = run["E"], run["A"], run["L"]
    loads = [{"kind": "force", "tag": "end", "value": run["F"]}, {"kind": "body", "value": run["q"]}]
    cells = max(1, round(L / run.h))
    return run.solve(
        body=[_bar("bar", E * A, L, cells, "start", loads)],
        contact=[_stop(L + run["g"], copies=copies, interference=max(0.0, -run["g"]))],
        solver=solver,
    )


@case(
    "duplicated",
    {"E": 1.0, "A": 1.0, "L": 1.0, "F": 1.0, "q": 0.0, "g": 0.1, "N": 5.0, "norm": "any"},
    levels=(1 / 8,),
    variants=({}, {"norm": "minimum"}),
    orders=(1,),
)
def duplicated(run: Run) -> list[Quantity]:
    """The same stop stated N times: W is singular, u and Σλ are those of one stop; of minimum `norm` each λ is R/N."""
    exact = BarStop(**run.values("E", "A", "L", "F", "q", "g"))
    N, least = int(run["N"]), run["norm"] == "minimum"
    if run["norm"] not in ("any", "minimum"):
        raise ValueError(f"duplicated: norm = {run['norm']}: must be any or minimum")
    solved = _solve_bar_stop(run, N, minimum_norm=least)
    lam = solved.result.lam
    quantities = [
        Quantity("reaction", lam.sum(), exact.reaction, EXACT),
        Quantity("end_displacement", _end(solved), exact.end_displacement, EXACT),
    ]
    if least:
        shares = exact.duplicated(N)
        quantities += [
            Quantity("least_force", lam.min(), shares.min(), SHARED),
            Quantity("largest_force", lam.max(), shares.max(), SHARED),
        ]
    return quantities


@case("opposed", {"E": 1.0, "A": 1.0, "L": 1.0, "F": 1.0, "g": 0.1, "w": 0.0}, levels=(1 / 8,), orders=(1,))
def opposed(run: Run) -> list[Quantity]:
    """A bar's end in a slit from g to g + w: u and λ₁ − λ₂ are unique at w = 0 too, the forces bounded."""
    E, A, L, g, w = (run[k] for k in ("E", "A", "L", "g", "w"))
    solved = run.solve(
        body=[
            _bar(
                "bar", E * A, L, max(1, round(L / run.h)), "start", [{"kind": "force", "tag": "end", "value": run["F"]}]
            )
        ],
        contact=[
            _stop(L + g + w, interference=max(0.0, -g - w), name="upper"),
            _stop(L + g, towards=-1.0, interference=max(0.0, g), name="lower"),
        ],
    )
    exact = Slit(k=E * A / L, F=run["F"], g=g, w=w)  # after the solution: a slit of negative width has none
    upper, lower = solved.forces(0).sum(), solved.forces(1).sum()
    bound = 10 * (abs(run["F"]) + abs(E * A / L * g))
    return [
        Quantity("end_displacement", _end(solved), exact.displacement, EXACT),
        Quantity("reaction_difference", upper - lower, exact.reaction_difference, EXACT),
        Quantity("excess_over_bound", max(0.0, upper - bound, lower - bound), 0.0, EXACT),
    ]


@case("two-bars", {"k1": 1.0, "k2": 1.0, "F": 2.0, "g": 1.0}, orders=(1,))
def two_bars(run: Run) -> list[Quantity]:
    """A spring k₁ pulled by F across a gap g on a spring k₂; any ratio of stiffness."""
    k1, k2, F, g = (run[k] for k in ("k1", "k2", "F", "g"))
    exact = TwoBars(k1=k1, k2=k2, F=F, g=g)
    solved = run.solve(
        body=[
            {**_bar("left", k1, 1.0, 1, "start", [{"kind": "force", "tag": "end", "value": F}]), **_spring(k1)},
            {**_bar("right", k2, 1.0, 1, "end", [], origin=1.0 + g), **_spring(k2)},
        ],
        contact=[
            {
                "body": "right",
                "tag": "start",
                "surface": {"kind": "point", "body": "left", "tag": "end", "normal": [1.0]},
                "interference": max(0.0, -g),
            }
        ],
    )
    return [
        Quantity("reaction", solved.forces().sum(), exact.reaction, EXACT),
        Quantity("u1", _end(solved, 0), exact.u1, EXACT),
        Quantity("u2", _end(solved, 1, last=False), exact.u2, EXACT),
    ]


@case("v-groove", {"F": 1.0, "beta": np.pi / 6}, orders=(1,))
def groove(run: Run) -> list[Quantity]:
    """A rigid block of weight F in a groove of half-opening β [rad], held by contact alone: N = F/(2 sin β)."""
    F, beta = run["F"], run["beta"]
    c, s = np.cos(beta), np.sin(beta)
    corners = {"left": [0.0, 0.0], "right": [1.0, 0.0]}
    planes = {
        side: {"kind": "plane", "point": corners[side], "normal": [c if side == "left" else -c, s]} for side in corners
    }
    solved = run.solve(
        body=[
            {
                "name": "block",
                "kind": "rigid",
                "guided": True,
                "mesh": {"shape": "box", "size": [1.0, 1.0], "n": 1, "structured": True},
                "loads": [{"kind": "body", "value": [0.0, -F]}],
            }
        ],
        contact=[{"name": side, "body": "block", "tag": side, "surface": plane} for side, plane in planes.items()],
    )
    N = v_groove(F=F, beta=beta)
    return [
        Quantity("left", solved.forces(0).sum(), N, EXACT),
        Quantity("right", solved.forces(1).sum(), N, EXACT),
    ]
