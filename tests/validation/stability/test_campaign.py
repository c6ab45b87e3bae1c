"""The stability campaign in its short form: points of every quick sweep, a few trials, and how they are judged."""

from dataclasses import asdict

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from contact.solvers import ContactNotConvergedError, InfeasibleError
from validation.case import Quantity
from validation.stability import campaign
from validation.stability.campaign import SWEEPS
from validation.stability.point import Answer, Sweep, try_point
from validation.stability.scenes import try_scene
from validation.stability.trials import try_problem

SEED = 2007
QUICK = [name for name in SWEEPS if name not in ("load", "insertion", "coil-packing", "aspect-ratio", "wire-fit")]


def test_the_set_is_as_large_as_it_must_be() -> None:
    """At least ten points a sweep, 500 in all, and every row of the extreme set among them."""
    assert all(len(set(sweep.values)) >= 10 for sweep in SWEEPS.values())
    assert sum(len(sweep.values) for sweep in SWEEPS.values()) >= 500
    rows = {sweep.row for sweep in SWEEPS.values()} - {""}
    assert len(rows) >= 11
    assert all(sweep.summary for sweep in SWEEPS.values())


@pytest.mark.parametrize("name", QUICK)
def test_ends_and_middle_of_a_sweep(name: str) -> None:
    """Right, or, where no row of the extreme set asks for more, refused."""
    sweep = SWEEPS[name]
    for value in {sweep.values[0], sweep.values[len(sweep.values) // 2], sweep.values[-1]}:
        point = try_point(sweep, value)
        assert point.verdict == "right" or (point.verdict == "refused" and not sweep.row), point


@pytest.mark.parametrize("value", [-1e-6, 1e-6])
def test_a_wire_as_wide_as_its_tube(value: float) -> None:
    point = try_point(SWEEPS["wire-fit"], value)
    assert point.verdict == "right"
    assert (point.error is None) == (value < 0)


def _point(feasible: bool, answer: Answer | Exception) -> str:
    def solve(value: float) -> Answer:
        if isinstance(answer, Exception):
            raise answer
        return answer

    return try_point(Sweep("made up", "x", (1.0,), solve, lambda value: feasible), 1.0).verdict


def _answer(error: float, residual: float) -> Answer:
    return Answer([Quantity("u", 1 + error, 1.0, 1e-6)], {"complementarity": residual}, 1, 1)


def test_verdicts() -> None:
    """What is claimed and not so is wrong, whatever else is right."""
    right, outside, missed = _answer(1e-7, 1e-9), _answer(1e-5, 1e-9), _answer(0.0, 1e-7)
    infeasible, stopped = InfeasibleError("no"), ContactNotConvergedError("slow", 1, 1.0)
    assert [_point(True, a) for a in (right, outside, missed)] == ["right", "wrong", "wrong"]
    assert [_point(True, a) for a in (infeasible, stopped, KeyError("k"))] == ["wrong", "refused", "wrong"]
    assert [_point(False, a) for a in (right, infeasible, stopped)] == ["wrong", "right", "refused"]
    assert _point(True, _answer(np.nan, 1e-9)) == _point(True, _answer(0.0, np.nan)) == "wrong"


def test_what_must_not_be_shown() -> None:
    """A refusal counts against a row of the extreme set, and against the share of all that are feasible."""
    point = asdict(try_point(SWEEPS["grazing"], 0.0))
    refused = {**point, "verdict": "refused", "reason": "slow"}
    assert campaign.failures({"points": [point], "trials": []}) == []
    lines = campaign.failures({"points": [point, refused], "trials": []})
    assert len(lines) == 2
    assert "grazing at 0: refused: slow" in lines[0]
    assert "50.00% of the feasible points refused" in lines[1]


@settings(max_examples=60, deadline=None, derandomize=True)
@given(st.integers(0, 2**31))
def test_random_problems(number: int) -> None:
    """A certificate or a truthful refusal, always."""
    trial = try_problem(SEED, number)
    assert trial.verdict != "wrong", trial


@pytest.mark.parametrize("number", [4734, 8782])
def test_no_proof_of_infeasibility_from_rounding(number: int) -> None:
    """Near the clamp of a wire gaps are smaller than the rounding of what others leave along the null direction."""
    trial = try_problem(SEED, number)
    assert trial.feasible is True
    assert trial.verdict != "wrong", trial


@pytest.mark.parametrize(("kind", "count"), [("solid", 30), ("wire", 6)])
def test_random_scenes(kind: str, count: int) -> None:
    for number in range(count):
        trial = try_scene(kind, SEED, number)
        assert trial.verdict != "wrong", trial


def test_a_seed_says_everything() -> None:
    """The same trial twice, and the same tasks in two processes as in one."""
    assert [{**asdict(try_problem(SEED, 7)), "seconds": 0}] * 2 == [
        {**asdict(try_problem(SEED, 7)), "seconds": 0} for _ in range(2)
    ]
    wanted = campaign.tasks(["fan-2"], SEED, 3)[:16]
    one, two = (campaign.run(wanted, jobs) for jobs in (1, 2))
    for part in one:
        for a, b in zip(one[part], two[part], strict=True):
            assert {**a, "seconds": 0} == {**b, "seconds": 0}
