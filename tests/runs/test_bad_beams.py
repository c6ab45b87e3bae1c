"""A mistake in a scene with a beam: exit code 2, one line with the file, the key, the value, and nothing written."""

from __future__ import annotations

from pathlib import Path

import pytest
from test_bad_input import refused

from runs.cli import DONE, main

SECTION = "length = 0.05, elements = 5, radius = 2.5e-4, E = 20e9, nu = 0.3, density = 8000.0"
DIRECT = "length = 0.05, elements = 5, radius = 2.5e-4, EA = 1e3, GJ = 1e-3, EI = 1e-3, mass = 1.0"
SUPPORT = 'at = "start"'
LOAD = 'kind = "line", value = [0.0, 0.0, -0.1]'
PLACE = "start = [0.0, 0.0, 0.0]"
SURFACE = 'kind = "plane", point = [0.0, 0.0, -1e-3], normal = [0.0, 0.0, 1.0]'
AXIS = "[[-0.01, 0, 0, 1e-3], [0.03, 0, 0, 1e-3], [0.06, 0, 0, 1e-3]]"
VESSELS = f'kind = "vessels", branches = [{{ name = "t", points = {AXIS} }}]'
GOOD = f"""
[[body]]
name = "wire"
kind = "beam"
sections = [{{ {SECTION} }}]
placement = {{ {PLACE} }}
supports = [{{ {SUPPORT} }}]
loads = [{{ {LOAD} }}]

[[contact]]
name = "wall"
body = "wire"
surface = {{ {SURFACE} }}

[time]
steps = 1
"""
S, P, B, L, C = "body[0].sections[0]", "body[0].placement", "body[0].supports[0]", "body[0].loads[0]", "contact[0]"


def changed(old: str, new: str, text: str = GOOD) -> str:
    """The scene with one thing wrong."""
    assert text.count(old) == 1, old
    return text.replace(old, new)


def section(old: str, new: str) -> str:
    """The good scene with a change to its section."""
    return changed(SECTION, changed(old, new, SECTION))


def more(table: str, keys: str) -> str:
    """The good scene with keys added to a table."""
    return changed(table, f"{table}, {keys}")


def body(line: str) -> str:
    """The good scene with a line added to its beam."""
    return changed('kind = "beam"', f'kind = "beam"\n{line}')


SCENES: dict[str, tuple[str, list[str]]] = {
    # the body
    "unknown key": (body("stiffness = 3.0"), ["body[0].stiffness", "unknown key"]),
    "material of a solid": (body("material = { EA = 1.0 }"), ["body[0].material", "unknown key"]),
    "no name": (changed('name = "wire"\n', ""), ["body[0].name", "missing"]),
    "empty name": (changed('name = "wire"', 'name = ""'), ["body[0].name", "at least 1 character"]),
    "unknown kind": (changed('kind = "beam"', 'kind = "rope"'), ["body[0]", "'rope'"]),
    "no sections": (changed(f"sections = [{{ {SECTION} }}]\n", ""), ["body[0].sections", "missing"]),
    "empty sections": (changed(f"[{{ {SECTION} }}]", "[]"), ["body[0].sections", "at least 1 item"]),
    "sections of wrong type": (changed(f"[{{ {SECTION} }}]", "3"), ["body[0].sections = 3", "list"]),
    "unknown mass": (body('mass = "diagonal"'), ["body[0].mass = 'diagonal'", "'consistent'", "'lumped'"]),
    "one Rayleigh coefficient": (body("rayleigh = [0.1]"), ["body[0].rayleigh", "at least 2 items"]),
    "negative Rayleigh": (
        body("rayleigh = [0.1, -1e-3]"),
        ["body[0].rayleigh[1] = -0.001", "greater than or equal to 0"],
    ),
    "velocity of two": (body("velocity = [0.0, 1.0]"), ["body[0].velocity", "at least 3 items"]),
    "infinite velocity": (body("velocity = [0.0, 1.0, inf]"), ["body[0].velocity[2] = inf", "finite"]),
    # sections
    "unknown key of a section": (section("nu = 0.3", "nu = 0.3, rho = 1.0"), [f"{S}.rho", "unknown key"]),
    "no length": (section("length = 0.05, ", ""), [f"{S}", "length = None", "need one"]),
    "negative length": (section("length = 0.05", "length = -0.05"), [f"{S}.length = -0.05", "greater than 0"]),
    "length that is a text": (section("length = 0.05", 'length = "5 cm"'), [f"{S}.length = '5 cm'", "number"]),
    "no elements": (section("elements = 5, ", ""), [f"{S}.elements", "missing"]),
    "zero elements": (section("elements = 5", "elements = 0"), [f"{S}.elements = 0", "greater than or equal to 1"]),
    "half an element": (section("elements = 5", "elements = 5.5"), [f"{S}.elements = 5.5", "integer"]),
    "no radius": (section("radius = 2.5e-4, ", ""), [f"{S}.radius", "missing"]),
    "negative radius": (
        section("radius = 2.5e-4", "radius = -1.0"),
        [f"{S}.radius = -1.0", "greater than or equal to 0"],
    ),
    "no radius with E": (section("radius = 2.5e-4", "radius = 0.0"), ["radius = 0", "above 0 where E is given"]),
    "hollow without a wall": (
        section("nu = 0.3", "nu = 0.3, inner_radius = 3e-4"),
        ["'wire'", "inner_radius = 0.0003"],
    ),
    "negative inner radius": (section("nu = 0.3", "nu = 0.3, inner_radius = -1e-4"), [f"{S}.inner_radius", "-0.0001"]),
    "taper to nothing": (
        section("nu = 0.3", "nu = 0.3, end_radius = 0.0"),
        [f"{S}.end_radius = 0.0", "greater than 0"],
    ),
    "no stiffness": (section("E = 20e9, nu = 0.3", "nu = 0.3"), [S, "E: missing", "EA, GJ and EI"]),
    "negative E": (section("E = 20e9", "E = -20e9"), [f"{S}.E = -20000000000.0", "greater than 0"]),
    "E that is not a number": (section("E = 20e9", "E = nan"), [f"{S}.E", "nan"]),
    "nu too large": (section("nu = 0.3", "nu = 0.6"), [f"{S}.nu = 0.6", "less than or equal to 0.5"]),
    "nu and G": (
        section("nu = 0.3", "nu = 0.3, G = 1e9"),
        ["'wire'", "nu, G = 0.3, 1000000000.0", "one and not the other"],
    ),
    "neither nu nor G": (section("nu = 0.3, ", ""), ["'wire'", "nu, G = None, None"]),
    "negative G": (section("nu = 0.3", "G = -1e9"), [f"{S}.G = -1000000000.0", "greater than 0"]),
    "negative density": (
        section("density = 8000.0", "density = -1.0"),
        [f"{S}.density = -1.0", "greater than or equal"],
    ),
    "E and EA": (section("nu = 0.3", "nu = 0.3, EA = 1.0"), [S, "EA: a section with E"]),
    "E and mass": (section("nu = 0.3", "nu = 0.3, mass = 1.0"), [S, "mass: a section with E"]),
    "E and inertia": (section("nu = 0.3", "nu = 0.3, inertia = 1.0"), [S, "inertia: a section with E"]),
    "EI missing": (changed(SECTION, DIRECT.replace("EI = 1e-3, ", "")), [S, "EA, GJ and EI"]),
    "negative GJ": (changed(SECTION, DIRECT.replace("GJ = 1e-3", "GJ = -1.0")), [f"{S}.GJ = -1.0", "greater than 0"]),
    "zero EA": (changed(SECTION, DIRECT.replace("EA = 1e3", "EA = 0.0")), [f"{S}.EA = 0.0", "greater than 0"]),
    "zero EI": (changed(SECTION, DIRECT.replace("EI = 1e-3", "EI = 0.0")), [f"{S}.EI = 0.0", "greater than 0"]),
    "negative mass": (
        changed(SECTION, DIRECT.replace("mass = 1.0", "mass = -1.0")),
        [f"{S}.mass = -1.0", "greater than"],
    ),
    "negative inertia": (changed(SECTION, f"{DIRECT}, inertia = -1.0"), [f"{S}.inertia = -1.0", "greater than"]),
    "EA and density": (changed(SECTION, f"{DIRECT}, density = 1.0"), [S, "no density, shear or taper"]),
    "shear of wrong type": (section("nu = 0.3", 'nu = 0.3, shear = "yes"'), [f"{S}.shear = 'yes'", "boolean"]),
    # rest shapes
    "unknown shape": (section("nu = 0.3", 'nu = 0.3, shape = { kind = "knot" }'), [f"{S}.shape", "'knot'", "'helix'"]),
    "shape without a kind": (section("nu = 0.3", "nu = 0.3, shape = { radius = 1.0 }"), [f"{S}.shape", "kind"]),
    "arc without radius": (section("nu = 0.3", 'nu = 0.3, shape = { kind = "arc" }'), [f"{S}.shape.radius", "missing"]),
    "arc of no radius": (
        section("nu = 0.3", 'nu = 0.3, shape = { kind = "arc", radius = 0.0 }'),
        [f"{S}.shape.radius = 0.0", "greater than 0"],
    ),
    "arc of a plane in words": (
        section("nu = 0.3", 'nu = 0.3, shape = { kind = "arc", radius = 0.1, plane = "xy" }'),
        [f"{S}.shape.plane = 'xy'", "number"],
    ),
    "arc with a pitch": (
        section("nu = 0.3", 'nu = 0.3, shape = { kind = "arc", radius = 0.1, pitch = 1.0 }'),
        [f"{S}.shape.pitch = 1.0", "unknown key"],
    ),
    "helix without a pitch": (
        section("nu = 0.3", 'nu = 0.3, shape = { kind = "helix", radius = 0.1 }'),
        [f"{S}.shape.pitch", "missing"],
    ),
    "elements that turn by more than π": (
        section("nu = 0.3", 'nu = 0.3, shape = { kind = "arc", radius = 1e-3 }'),
        ["'wire'", "turn"],
    ),
    "polyline of one point": (
        section("nu = 0.3", 'nu = 0.3, shape = { kind = "polyline", points = [[0.0, 0.0, 0.0]] }'),
        [f"{S}.shape.points", "at least 2 items"],
    ),
    "polyline in the plane": (
        section("nu = 0.3", 'nu = 0.3, shape = { kind = "polyline", points = [[0.0, 0.0], [1.0, 0.0]] }'),
        [f"{S}.shape.points[0]", "at least 3 items"],
    ),
    "polyline with a length beside it": (
        section("nu = 0.3", 'nu = 0.3, shape = { kind = "polyline", points = [[0.0, 0.0, 0.0], [0.0, 0.0, 0.0]] }'),
        [f"{S}", "length = 0.05", "polyline"],
    ),
    # where it starts
    "unknown key of the placement": (more(PLACE, "at = 3.0"), [f"{P}.at", "unknown key"]),
    "start of two": (changed(PLACE, "start = [0.0, 0.0]"), [f"{P}.start", "at least 3 items"]),
    "start in words": (changed(PLACE, 'start = "here"'), [f"{P}.start = 'here'", "list"]),
    "no direction": (more(PLACE, "direction = [0.0, 0.0, 0.0]"), ["'wire'", "direction"]),
    "roll in words": (more(PLACE, 'roll = "left"'), [f"{P}.roll = 'left'", "number"]),
    "straight in words": (more(PLACE, 'straight = "yes"'), [f"{P}.straight = 'yes'", "boolean"]),
    "path of one point": (more(PLACE, "path = [[0.0, 0.0, 0.0]]"), [f"{P}.path", "at least 2 items"]),
    "path too short": (
        more(PLACE, "path = [[0.0, 0.0, 0.0], [0.01, 0.0, 0.0]]"),
        ["'wire'", "0 .. 0.05", "length 0.01"],
    ),
    "path and straight": (
        more(PLACE, "straight = true, path = [[0.0, 0.0, 0.0], [0.1, 0.0, 0.0]]"),
        ["straight", "path"],
    ),
    # supports
    "unknown key of a support": (more(SUPPORT, "force = 1.0"), [f"{B}.force", "unknown key"]),
    "support nowhere": (changed(SUPPORT, "push = 0.0"), [f"{B}.at", "missing"]),
    "support at a name": (changed(SUPPORT, 'at = "middle"'), [f"{B}.at = 'middle'", "'start'"]),
    "support before the start": (changed(SUPPORT, "at = -0.01"), [f"{B}.at = -0.01", "'start'"]),
    "support beyond the end": (changed(SUPPORT, "at = 0.06"), ["'wire'", "at = 0.06", "up to its length 0.05"]),
    "hold a wrong freedom": (more(SUPPORT, 'hold = ["x", "w"]'), [f"{B}.hold[1] = 'w'", "'rz'"]),
    "hold nothing": (more(SUPPORT, "hold = []"), ["hold"]),
    "push of an unknown name": (more(SUPPORT, 'push = "0.1 * s"'), [f"{B}.push = '0.1 * s'", "s"]),
    "push that is no formula": (more(SUPPORT, 'push = "0.1 *"'), [f"{B}.push = '0.1 *'"]),
    "twist of a list": (more(SUPPORT, "twist = [1.0]"), [f"{B}.twist"]),
    "displacement of two": (more(SUPPORT, "displacement = [0.0, 1.0]"), [f"{B}.displacement", "at least 3 items"]),
    "displacement of an unknown name": (
        more(SUPPORT, 'displacement = [0.0, "q", 0.0]'),
        [f"{B}.displacement", "q"],
    ),
    "rotation of a word": (more(SUPPORT, "rotation = [0.0, true, 0.0]"), [f"{B}.rotation[1] = True", "number"]),
    "a push that is not finite": (more(SUPPORT, 'push = "1 / (t - 1)"'), ["'wire'", "not finite", "t = 1"]),
    "a push that is infinite": (more(SUPPORT, "push = inf"), [f"{B}.push = inf", "finite"]),
    # loads
    "unknown key of a load": (more(LOAD, "factor = 2.0"), [f"{L}.factor", "unknown key"]),
    "unknown load": (changed('kind = "line"', 'kind = "wind"'), [f"{L}.kind = 'wind'", "'gravity'"]),
    "load without a kind": (changed('kind = "line", ', ""), [f"{L}.kind", "missing"]),
    "line load at a place": (more(LOAD, 'at = "end"'), [L, "at = 'end'", "a line load has no place"]),
    "point load without a place": (changed('kind = "line"', 'kind = "point"'), [L, "a point load needs a place"]),
    "line load with a moment": (more(LOAD, "moment = [0.0, 0.0, 1.0]"), [L, "moment: a line load has none"]),
    "load of two": (changed("[0.0, 0.0, -0.1]", "[0.0, -0.1]"), [f"{L}.value", "at least 3 items"]),
    "load of an unknown name": (changed("[0.0, 0.0, -0.1]", '[0.0, 0.0, "w * t"]'), [f"{L}.value", "w"]),
    "point load beyond the end": (changed('kind = "line"', 'kind = "point", at = 0.2'), ["'wire'", "at = 0.2", "0.05"]),
    "gravity without mass": (
        changed("density = 8000.0", "density = 0.0", changed('kind = "line"', 'kind = "gravity"')),
        ["'wire'", "gravity: needs a density or mass"],
    ),
    # contact
    "tag of a beam": (
        changed('body = "wire"', 'body = "wire"\ntag = "end"'),
        ["contact.tag = 'end'", "a beam has none"],
    ),
    "no samples": (
        changed('body = "wire"', 'body = "wire"\nsamples = 0'),
        [f"{C}.samples = 0", "greater than or equal to 1"],
    ),
    "no spacing": (changed('body = "wire"', 'body = "wire"\nspacing = 0.0'), [f"{C}.spacing = 0.0", "greater than 0"]),
    "samples and spacing": (
        changed('body = "wire"', 'body = "wire"\nsamples = 2\nspacing = 1e-3'),
        ["samples or spacing"],
    ),
    "mortar": (
        changed('body = "wire"', 'body = "wire"\nconstraint = "mortar"'),
        ["contact.constraint", "not of a beam"],
    ),
    "finite sliding": (changed('body = "wire"', 'body = "wire"\nsliding = "finite"'), ["sliding", "not of a beam"]),
    "a fixed direction": (
        changed('body = "wire"', 'body = "wire"\ndirection = [0.0, 0.0, 1.0]'),
        ["direction", "not of a beam"],
    ),
    "a plane in two dimensions": (
        changed("point = [0.0, 0.0, -1e-3]", "point = [0.0, -1e-3]"),
        ["'wall'", "surface.point", "3 coordinates"],
    ),
    "undeclared interference": (changed("-1e-3]", "-1e-4]"), ["'wall'", "0.00015 m inside", "interference = 0"]),
    "negative interference": (
        changed('body = "wire"', 'body = "wire"\ninterference = -1.0'),
        [f"{C}.interference = -1.0"],
    ),
    "missing vessel file": (
        changed(SURFACE, 'kind = "vessels", file = "nowhere.swc", scale = 1e-3'),
        ["nowhere.swc", "no such file"],
    ),
    "vessel file that is none": (
        changed(SURFACE, 'kind = "vessels", file = "bad.swc", scale = 1e-3'),
        ["bad.swc", "line 2"],
    ),
    "vessel file with a loop": (changed(SURFACE, 'kind = "vessels", file = "loop.swc", scale = 1e-3'), ["loop.swc"]),
    "vessel file of a radius below 0": (
        changed(SURFACE, 'kind = "vessels", file = "thin.swc", scale = 1e-3'),
        ["thin.swc", "radi"],
    ),
    "empty vessel file": (changed(SURFACE, 'kind = "vessels", file = "empty.swc", scale = 1e-3'), ["empty.swc"]),
    "vessels without a scale": (changed(SURFACE, 'kind = "vessels", file = "bad.swc"'), ["scale", "must be given"]),
    "vessels of nothing": (changed(SURFACE, 'kind = "vessels"'), ["file", "either a file or branches"]),
    "a branch without radii": (changed(SURFACE, VESSELS.replace(", 1e-3]", "]", 1)), ["points[0]", "at least 4 items"]),
    "a branch of radius 0": (changed(SURFACE, VESSELS.replace("0.03, 0, 0, 1e-3", "0.03, 0, 0, 0")), ["radi"]),
    "a branch that stands still": (
        changed(SURFACE, VESSELS.replace("0.03, 0, 0", "-0.01, 0, 0").replace("0.06, 0, 0", "-0.01, 0, 0")),
        ["point"],
    ),
    "a wire outside its vessel": (
        changed(SURFACE, VESSELS.replace("0, 0, 1e-3", "0.1, 0, 1e-3")),
        ["'wall'", "inside"],
    ),
    # supports, mass and time
    "nothing holds it": (changed(f"supports = [{{ {SUPPORT} }}]\n", ""), ["'wire'", "6 rigid motion"]),
    "a pin holds half of it": (more(SUPPORT, 'hold = ["x", "y", "z"]'), ["'wire'", "3 rigid motion", "add supports"]),
    "no density in time": (
        changed("density = 8000.0", "density = 0.0", GOOD + 'integrator = "implicit-euler"\n'),
        ["'wire'", "density"],
    ),
    "midpoint": (GOOD + 'integrator = "midpoint"\n', ["time.integrator = 'midpoint'", "'implicit-euler'"]),
    "velocity in statics": (body("velocity = [0.0, 0.0, 1.0]"), ["velocity", "statics"]),
    "damping in statics": (body("rayleigh = [1.0, 0.0]"), ["rayleigh", "statics"]),
}
SWC = {
    "bad.swc": "# a comment\n1 0 zero 0 0 1 -1\n",
    "loop.swc": "1 0 0 0 0 1 2\n2 0 1 0 0 1 1\n",
    "thin.swc": "1 0 0 0 0 1 -1\n2 0 9 0 0 -1 1\n",
    "empty.swc": "# nothing\n",
}


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A folder to work in, with vessel files that are wrong."""
    for name, text in SWC.items():
        (tmp_path / name).write_text(text, encoding="utf8")
    monkeypatch.chdir(tmp_path)
    return tmp_path


@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize("name", SCENES)
def test_scene(name: str, folder: Path, capfd: pytest.CaptureFixture[str]) -> None:
    """A scene with one mistake; the line names the file, the key or body, and the value."""
    text, words = SCENES[name]
    (folder / "scene.toml").write_text(text, encoding="utf8")
    refused(["run", "scene.toml"], ["scene.toml", *words], folder, capfd)


def test_the_good_scene(folder: Path) -> None:
    """Without a mistake the scene runs, with stiffnesses given directly and in a vessel too."""
    for i, text in enumerate((GOOD, GOOD.replace(SECTION, DIRECT), GOOD.replace(SURFACE, VESSELS))):
        (folder / f"{i}.toml").write_text(text, encoding="utf8")
        assert main(["run", f"{i}.toml"]) == DONE
        assert (folder / f"{i}.vtkhdf").exists()
