"""The certificate: each residual has the size of the error that was made, and all are finite where nothing happens."""

from collections.abc import Iterator

import numpy as np
import pytest
from contact_examples import box, on_floor, prepared

from contact.certificate import Certificate, Tolerances, certify
from contact.step import StepResult, step
from contact.system import System
from fem.elasticity import State


@pytest.fixture(scope="module")
def pressed() -> Iterator[tuple[System, StepResult]]:
    """A block pressed on a parabola by its top: some contacts are closed, some open."""
    body = {
        "name": "body",
        "mesh": box(2, 1, n=6),
        "material": {"E": 2.0, "nu": 0.3, "state": "plane-strain"},
        "supports": [{"tag": "top", "component": "y", "value": -0.02}, {"tag": "left", "component": "x"}],
    }
    surface = {"kind": "paraboloid", "origin": [0.0, 0.0], "radius": 5.0}
    system = prepared(body=[body], contact=[{"body": "body", "tag": "bottom", "surface": surface}])
    result = step(system, 1.0)
    assert 1 < (result.lam > 0).sum() < len(result.lam)
    yield system, result
    system.close()


def _certify(pressed: tuple[System, StepResult], lam: np.ndarray, u: np.ndarray | None = None) -> Certificate:
    """The certificate of other forces or displacements than those found."""
    system, result = pressed
    body = system.bodies[0]
    found = body.u.copy()
    if u is not None:
        body.u = found + body.space.local(u)
    lin = result.linearisation
    free_gaps = result.gap - lin.W.columns(np.arange(lin.W.size)) @ result.lam
    certificate = certify(system, lin, lam, free_gaps[lin.rows])
    body.u = found
    return certificate


def _bottom(pressed: tuple[System, StepResult], constraint: int) -> np.ndarray:
    """A unit motion of a contact's node along its normal."""
    system, result = pressed
    h = result.linearisation.H[system.bodies[0]].sparse().toarray()[constraint]
    motion: np.ndarray = h / (h @ h)
    return motion


def test_what_was_found_passes(pressed: tuple[System, StepResult]) -> None:
    """All residuals of the solution are round-off."""
    certificate = _certify(pressed, pressed[1].lam)
    assert certificate.within(Tolerances(1e-12, 1e-12, 1e-12, 1e-12))
    assert pressed[1].certificate.within(Tolerances(1e-12, 1e-12, 1e-12, 1e-12))


def test_wrong_forces(pressed: tuple[System, StepResult]) -> None:
    """A force that is wrong by a part of 1e-6 unbalances the body by that part; distances do not change."""
    lam = pressed[1].lam.copy()
    lam[np.argmax(lam)] *= 1 + 1e-6
    certificate = _certify(pressed, lam)
    assert 1e-8 < certificate.equilibrium < 1e-6
    assert certificate.within(Tolerances(equilibrium=1e-6))
    assert not certificate.within(Tolerances())


def test_force_on_an_open_gap(pressed: tuple[System, StepResult]) -> None:
    """λ > 0 where δ > 0 is a complementarity residual and a surface error of δ."""
    result = pressed[1]
    far = int(np.argmax(result.gap))
    lam = result.lam.copy()
    lam[far] = lam.max()
    certificate = _certify(pressed, lam)
    assert certificate.surface_error == pytest.approx(result.gap[far], rel=1e-12)
    assert certificate.complementarity > 0.1
    assert certificate.equilibrium > 0.1
    assert certificate.penetration < 1e-12
    # a small force on an open gap shows as its part of the largest, not as the gap
    lam[far] = 1e-5 * result.lam.max()
    assert 1e-7 < _certify(pressed, lam).complementarity < 1e-4


def test_adhesion(pressed: tuple[System, StepResult]) -> None:
    """A contact that pulls (λ < 0) is no solution, though its gap be closed."""
    lam = pressed[1].lam.copy()
    closed = int(np.argmax(lam))
    lam[closed] *= -1
    assert _certify(pressed, lam).complementarity > 0.1


@pytest.mark.parametrize("closed", [True, False])
def test_penetration(pressed: tuple[System, StepResult], closed: bool) -> None:
    """A contact pushed to 1e-5 below the surface shows that depth over the body's size, loaded or not."""
    result = pressed[1]
    which = int(np.argmax(result.lam) if closed else np.argmax(result.gap))
    certificate = _certify(pressed, result.lam, -(1e-5 + result.gap[which]) * _bottom(pressed, which))
    assert certificate.penetration == pytest.approx(1e-5, rel=1e-8)
    assert certificate.surface_error == pytest.approx(1e-5 if closed else 0.0, abs=1e-12)
    assert not certificate.within(Tolerances(equilibrium=1.0, penetration=9e-6))
    assert certificate.complementarity > 1e-5


def test_open_under_load(pressed: tuple[System, StepResult]) -> None:
    """A loaded contact 1e-5 above the surface shows that distance, and no penetration."""
    result = pressed[1]
    which = int(np.argmax(result.lam))
    certificate = _certify(pressed, result.lam, 1e-5 * _bottom(pressed, which))
    assert certificate.surface_error == pytest.approx(1e-5, rel=1e-8)
    assert certificate.penetration < 1e-12
    assert certificate.complementarity > 1e-5


def test_not_a_number_never_passes() -> None:
    """NaN is within no tolerance."""
    for name in ("complementarity", "equilibrium", "surface_error", "penetration"):
        values = dict.fromkeys(("complementarity", "equilibrium", "surface_error", "penetration"), 0.0)
        assert Certificate(**values).within(Tolerances())
        assert not Certificate(**values | {name: float("nan")}).within(Tolerances())
        assert not Certificate(**values | {name: 1.1e-3}).within(Tolerances())


def test_default_tolerances() -> None:
    """Those of the contract."""
    assert Tolerances() == Tolerances(1e-8, 1e-8, 1e-3, 1e-3)


@pytest.mark.parametrize("load", [0.0, 1e-200])
def test_zero_load(load: float) -> None:
    """Nothing, or next to nothing, presses a block that lies on the floor: all residuals are finite and pass."""
    system = on_floor(
        box(2),
        "plane-strain",
        [{"kind": "pressure", "tag": "top", "value": load}],
        [{"tag": "left", "component": "x"}],
    )
    result = step(system, 1.0)
    assert result.certificate.within(Tolerances())
    np.testing.assert_allclose(system.bodies[0].u, 0, atol=1e-150)
    system.close()


@pytest.mark.parametrize("nudge", [0.0, 1e-17, -1e-17, 1e-13, -1e-13])
def test_exact_grazing(nudge: float) -> None:
    """F = EA g/L (1 ± round-off) brings a bar's end to its stop and no further: λ ≈ 0, residuals finite."""
    EA, L, g = 3.0, 2.0, 0.1
    bar = {
        "name": "bar",
        "kind": "bar",
        "mesh": {"shape": "interval", "length": L, "n": 7},
        "material": {"EA": EA},
        "supports": [{"tag": "start"}],
        "loads": [{"kind": "force", "tag": "end", "value": EA * g / L * (1 + nudge)}],
    }
    stop = {"body": "bar", "tag": "end", "surface": {"kind": "plane", "point": [L + g], "normal": [-1.0]}}
    system = prepared(body=[bar], contact=[stop])
    result = step(system, 1.0)
    assert result.certificate.within(Tolerances())
    assert np.all(result.lam <= 1e-12)
    assert system.bodies[0].u.max() == pytest.approx(g, rel=1e-12)
    system.close()


@pytest.mark.parametrize(("state", "gap"), [("plane-strain", 0.0), ("plane-strain", 0.2), ("3d", 0.0)])
def test_unloading(state: State, gap: float) -> None:
    """After a load is taken away only round-off is left, and it passes; so does the next load, however small."""
    mesh = box(3 if state == "3d" else 2)
    sides = [{"tag": "left", "component": "x"}, *([{"tag": "front", "component": "y"}] if mesh.dim == 3 else [])]
    floor = {"kind": "plane", "point": [0.0] * (mesh.dim - 1) + [-gap], "normal": [0.0] * (mesh.dim - 1) + [1.0]}
    load = {"kind": "pressure", "tag": "top", "value": "0.1*t"}
    system = on_floor(mesh, state, [load], sides, surface=floor)
    for t in (1.0, 0.0, 0.5, 0.0, 1e-9, 1e-5, 0.0):
        result = step(system, t)
        assert result.lam.sum() == pytest.approx(0.1 * t, rel=1e-9, abs=1e-15)
    system.close()


@pytest.mark.parametrize("n", [3, 12])
def test_a_body_carried_by_its_supports(n: int) -> None:
    """A body that its supports shift as a whole has no forces but round-off, and is certified."""
    mesh = {"shape": "box", "size": [1.0, 1.0, 0.5], "n": n, "structured": True, "origin": [0.3, 0.2, 5.0]}
    shifts = {"x": 0.1, "y": 0.03, "z": 0.07}
    body = {
        "name": "body",
        "mesh": mesh,
        "material": {"E": 1.0, "nu": 0.3, "state": "3d"},
        "supports": [{"tag": "top", "component": c, "value": v} for c, v in shifts.items()],
    }
    system = prepared(body=[body])
    assert step(system, 1.0).certificate.equilibrium < 1e-8
    np.testing.assert_allclose(
        system.bodies[0].displacement, np.tile([*shifts.values()], (system.bodies[0].space.piece.total, 1))
    )
    system.close()
