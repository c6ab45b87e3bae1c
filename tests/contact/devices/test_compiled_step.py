"""The compiled step against its oracle, the plain one, on the same scenes."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import pytest
from device_examples import contact as contact_table
from device_examples import pushed, run, wire
from ranks import same_on_two_ranks

import contact.devices.compiled_step
import contact.devices.step_kernel as kernel
import contact.step
from contact.clock import Clock
from contact.devices.compiled_step import CompiledStep
from contact.scene.build import build
from contact.scene.schema import Scene, read_scene
from runs.cli import main

RUNS = Path(__file__).parents[3] / "runs"


def compiled(tables, **solver):
    """The scene with compiled steps."""
    return tables | {"solver": {"compiled": True, **solver}}


@pytest.fixture
def plain_steps(monkeypatch):
    """How many steps the plain one has taken."""
    taken = []

    def watched(*given):
        taken.append(given[1])
        return contact.step.step(*given)

    monkeypatch.setattr(contact.devices.compiled_step, "step", watched)
    return taken


def twisted(**changes):
    """A wire that is pushed and twisted into a bent vessel and weighs down on it."""
    tables = pushed(0.5, 0.1, 100, loads=[{"kind": "gravity", "value": [0.0, 0.0, -9.81]}])
    tables["body"][0]["supports"][0]["twist"] = "20.0 * t"
    return tables | changes


def same(one, other, tolerance):
    """The same steps: passes, forces, gaps, states and what is written of them."""
    (system, steps), (oracle, expected) = one, other
    assert len(steps) == len(expected)
    for mine, plain in zip(steps, expected, strict=True):
        a, b = mine.result, plain.result
        assert (mine.substeps, a.passes, a.iterations) == (plain.substeps, b.passes, b.iterations)
        assert a.details == b.details
        scale = max(b.lam.max(), 1e-3 * expected[-1].result.lam.max())
        np.testing.assert_allclose(a.lam, b.lam, rtol=0, atol=tolerance * scale)
        part, known = a.linearisation.constraints[0], b.linearisation.constraints[0]
        np.testing.assert_array_equal(a.linearisation.met, b.linearisation.met)
        np.testing.assert_array_equal(a.linearisation.rows, b.linearisation.rows)
        np.testing.assert_array_equal(a.rows, b.rows)
        met = a.linearisation.met
        np.testing.assert_allclose(a.gap[met], b.gap[met], rtol=0, atol=tolerance * part.length)
        np.testing.assert_allclose(part.normals[met], known.normals[met], rtol=0, atol=1e-6)
        np.testing.assert_allclose(a.problem.q, b.problem.q, rtol=0, atol=tolerance * part.length)
    body, other_body = system.bodies[0], oracle.bodies[0]
    for found, exact in zip(body.state(), other_body.state(), strict=True):
        np.testing.assert_allclose(found, exact, rtol=0, atol=tolerance * max(np.abs(exact).max(), 1.0))
    result = steps[-1].result
    (free,) = result.linearisation.free.values()
    assert body.imbalance(free.apply_transpose(result.lam)) == pytest.approx(result.certificate.equilibrium, rel=1e-6)
    assert body.definite == other_body.definite
    reactions = other_body.reactions()
    np.testing.assert_allclose(body.reactions(), reactions, rtol=0, atol=1e-6 * np.abs(reactions).max())
    system.close()
    oracle.close()


def test_the_same_steps(plain_steps):
    """Passes, contact forces, gaps and states are those of the plain step; but for the first step it takes all."""
    found = run(compiled(twisted()))
    assert len(plain_steps) == 1
    assert any((step.result.lam > 0).sum() > 1 for step in found[1])
    same(found, run(twisted()), 1e-9)


@pytest.mark.parametrize("name", ["coil", "guidewire"])
def test_shipped_scenes(name):
    """The first 60 steps of the scenes that ask for it."""
    scene = read_scene(RUNS / f"{name}.toml", [])[0]
    tables = scene.model_dump(by_alias=True, exclude_unset=True)
    tables["time"] |= {"end": scene.time.end * 60 / scene.time.steps, "steps": 60}
    assert tables["solver"] == {"compiled": True}
    same(run(tables), run(tables | {"solver": {}}), 1e-8)


def test_what_it_gives_up(plain_steps):
    """Long steps, which go far and are divided, end where those of the plain step end."""
    tables = twisted(time={"end": 0.1, "steps": 4, "integrator": "implicit-euler"})
    system, steps = found = run(compiled(tables))
    assert kernel.FAR in system.advance.given_up
    assert len(plain_steps) == 1 + sum(system.advance.given_up.values())
    assert all(step.result.certificate.residual <= 1e-8 for step in steps)
    same(found, run(tables), 1e-8)


def test_nothing_is_changed_by_a_step_that_is_given_up(monkeypatch):
    """One that is not settled after a pass leaves body and contact as they were."""
    tables = compiled(twisted())
    scene = Scene.model_validate(tables)
    system, _ = run(tables)
    pair = system.pairs[0]
    before = [a.copy() for a in (*system.bodies[0].state(), *pair.sight(), *pair.foot, pair.at, pair.candidates)]
    monkeypatch.setattr(contact.devices.compiled_step, "step", lambda *given: "plain")
    lam = np.where(pair.known < 1e-9, 1e-3, 0.0)
    limits = contact.step.Tolerances(complementarity=1e-300)
    with system.clock("assemble"):
        assert system.advance(system, 0.101, 1e-3, "status", lam, limits, scene.solver.max_passes) == "plain"
    after = (*system.bodies[0].state(), *pair.sight(), *pair.foot, pair.at, pair.candidates)
    for a, b in zip(before, after, strict=True):
        np.testing.assert_array_equal(a, b)
    system.close()


def test_seconds_of_phases():
    """They add up to the whole, and every phase has its part."""
    system, steps = run(compiled(twisted()))
    for step in steps[1:]:
        parts = [step.seconds[phase] for phase in ("assemble", "factor", "detect", "delassus", "solve")]
        assert min(parts) > 0
        assert sum(parts) <= step.seconds["total"] * (1 + 1e-9)
    system.close()


def test_shared_time():
    """What is shared is taken from the phase that runs."""
    now = iter([0.0, 0.0, 5.0, 5.0, 5.0])
    clock = Clock(lambda: next(now))
    with clock("assemble"):
        clock.share([0.0, 1.0, 2.0, 0.5, 0.25])
    lap = clock.lap()
    assert lap == {
        "assemble": 1.25, "factor": 1.0, "detect": 2.0, "delassus": 0.5, "solve": 0.25, "output": 0.0, "total": 5.0
    }  # fmt: skip


UNSUITABLE = {
    "statics": {"body": [wire(supports=[{"at": "start"}])], "time": {"steps": 2}},
    "two beams": {"body": [wire(), wire() | {"name": "other"}]},
    "a plane": {"contact": [contact_table({"kind": "plane", "point": [0, 0, -1], "normal": [0, 0, 1]})]},
    "a line load": {"body": [wire(loads=[{"kind": "line", "value": [0, 0, -1]}])]},
    "method = 'status'": {"solver": {"compiled": True, "method": "lemke"}},
    "without minimum_norm": {"solver": {"compiled": True, "minimum_norm": True}},
}


@pytest.mark.parametrize("what", UNSUITABLE)
def test_scenes_that_it_does_not_suit(what):
    """One line says which scenes it is for."""
    tables = compiled(pushed(0.5, 0.08, 80)) | UNSUITABLE[what]
    words = what if "'" in what or "without" in what else "one beam with a density"
    with pytest.raises(ValueError, match=rf"solver\.compiled = true: .*{words}"):
        build(Scene.model_validate(tables), None)


def test_explained(capsys):
    """The account of a scene says that its steps are compiled."""
    assert main(["explain", str(RUNS / "coil.toml")]) == 0
    assert "step: one compiled call" in capsys.readouterr().out


def test_command_line_refuses(tmp_path, capsys):
    """Exit code 2, one line, nothing written."""
    scene = str(RUNS / "hertz-line.toml")
    assert main(["run", scene, "--set", "solver.compiled=true", "-o", str(tmp_path / "out.vtkhdf")]) == 2
    assert capsys.readouterr().err.count("\n") == 1
    assert not list(tmp_path.iterdir())


def quantities(comm):
    """Forces and tip of a wire that compiled steps push, by name."""
    system, steps = run(compiled(twisted()), comm)
    assert isinstance(system.advance, CompiledStep)
    values = {"force": float(steps[-1].result.lam.sum())}
    values |= dict(zip("xyz", system.bodies[0].x[-1].tolist(), strict=True))
    system.close()
    return values


def test_two_ranks():
    """The same on two ranks."""
    same_on_two_ranks(sys.modules[__name__], 1e-12)
