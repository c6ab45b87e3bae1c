"""A user's mistake: exit code 2, one line that names the file or case and what is wrong, and nothing written."""

from __future__ import annotations

from pathlib import Path

import pytest
from program import program

from runs.cli import BAD_INPUT, NOT_CONVERGED, main

MESH = 'mesh = { shape = "box", size = [1.0, 1.0], n = 2, structured = true }'
MATERIAL = 'material = { E = 1.0, nu = 0.3, state = "plane-strain" }'
SUPPORTS = 'supports = [{ tag = "left", component = "x" }, { tag = "top", component = "y", value = "-0.01 * t" }]'
SURFACE = 'surface = { kind = "plane", point = [0.0, 0.0], normal = [0.0, 1.0] }'
GOOD = f"""
[[body]]
name = "block"
{MATERIAL}
{SUPPORTS}
{MESH}

[[contact]]
name = "floor"
body = "block"
tag = "bottom"
{SURFACE}

[time]
steps = 1
"""

# Two triangles on the unit square; the second one of `INVERTED` runs clockwise.
NODES = "$Nodes\n1 4 1 4\n2 1 0 4\n1\n2\n3\n4\n0 0 0\n1 0 0\n1 1 0\n0 1 0\n$EndNodes\n"
NAMES = '$MeshFormat\n4.1 0 8\n$EndMeshFormat\n$PhysicalNames\n1\n2 1 "all"\n$EndPhysicalNames\n'
ENTITIES = "$Entities\n0 0 1 0\n1 0 0 0 1 1 0 1 1 0\n$EndEntities\n"
HEAD = NAMES + ENTITIES + NODES
TRIANGLES = "$Elements\n1 2 1 2\n2 1 2 2\n1 1 2 3\n2 1 {last}\n$EndElements\n"
MSH = {
    "inverted.msh": HEAD + TRIANGLES.format(last="4 3"),
    "degenerate.msh": HEAD + TRIANGLES.format(last="3 3"),
    "quad.msh": HEAD + "$Elements\n1 1 1 1\n2 1 3 1\n1 1 2 3 4\n$EndElements\n",
    "mixed.msh": HEAD + "$Elements\n2 2 1 2\n2 1 2 1\n1 1 2 3\n2 1 3 1\n2 1 2 3 4\n$EndElements\n",
    "broken.msh": "$MeshFormat\n4.1 0 8\n$EndMeshFormat\n$Nodes\n",
}


def changed(old: str, new: str) -> str:
    """The good scene with one thing wrong."""
    assert old in GOOD
    return GOOD.replace(old, new)


def with_mesh(name: str) -> str:
    """The good scene on a mesh file."""
    return changed(MESH, f'mesh = {{ file = "{name}" }}')


SCENES: dict[str, tuple[str, list[str]]] = {
    "not TOML": ("[[body\nname = 1", ["line 1"]),
    "empty": ("", ["body", "missing"]),
    "unknown table": (GOOD + "[friction]\nmu = 0.3\n", ["friction", "unknown key"]),
    "unknown key": (changed("nu = 0.3", "nu = 0.3, rho = 1.0"), ["body[0].material.rho", "unknown key"]),
    "wrong type": (changed("E = 1.0", 'E = "stiff"'), ["body[0].material.E", "'stiff'", "number"]),
    "negative stiffness": (changed("E = 1.0", "E = -2.0"), ["body[0].material.E", "-2.0", "greater than 0"]),
    "infinite stiffness": (changed("E = 1.0", "E = inf"), ["body[0].material.E", "inf"]),
    "incompressible": (changed("nu = 0.3", "nu = 0.5"), ["body[0].material.nu", "0.5", "less than 0.5"]),
    "moduli without one": (changed("E = 1.0, ", ""), ["body[0].material", "E", "missing"]),
    "no moduli": (changed("E = 1.0, nu = 0.3, ", ""), ["body[0].material", "E", "missing", "regions"]),
    "a region that the mesh has not": (
        changed("nu = 0.3", "nu = 0.3, regions = { media = { E = 1.0, nu = 0.3 } }"),
        ["'block'", "material.regions", "media", "none"],
    ),
    "negative stiffness of a region": (
        changed("nu = 0.3", "nu = 0.3, regions = { media = { E = -1.0, nu = 0.3 } }"),
        ["body[0].material.regions.media.E", "-1.0", "greater than 0"],
    ),
    "negative surrounding": (
        changed(SUPPORTS, 'supports = [{ tag = "left", stiffness = -3.0 }]'),
        ["body[0].supports[0].stiffness", "-3.0", "greater than 0"],
    ),
    "normal without a surrounding": (
        changed('component = "x"', 'component = "normal"'),
        ["body[0].supports[0]", "'normal'", "stiffness"],
    ),
    "surrounding that moves": (
        changed('component = "x"', "value = 0.1, stiffness = 1.0"),
        ["body[0].supports[0]", "value = 0.1", "stiffness"],
    ),
    "surrounding on an unknown tag": (
        changed('tag = "left", component = "x"', 'tag = "lefft", stiffness = 1.0'),
        ["'block'", "'lefft'", "left"],
    ),
    "surrounding along a wrong component": (
        changed('component = "x"', 'component = "z", stiffness = 1.0'),
        ["'block'", "component = 'z'", "x, y"],
    ),
    "wall of one layer": (
        changed(
            MESH, 'mesh = { shape = "tube-wall", radius = 1.0, thickness = 0.1, length = 1.0, h = 1.0, layers = 1 }'
        ),
        ["'block'", "'tube-wall'", "layers = 1", "at least 2"],
    ),
    "wall along no file": (
        changed(MESH, 'mesh = { shape = "vessel-wall", centreline = "no.swc", scale = 1.0, ratio = 0.1, h = 1.0 }'),
        ["'block'", "'vessel-wall'", "no.swc", "no such file"],
    ),
    "unknown state": (changed("plane-strain", "flat"), ["body[0].material.state", "'flat'", "'plane-strain'"]),
    "state of another dimension": (changed("plane-strain", "3d"), ["'block'", "'3d'", "dimension 2"]),
    "no material": (changed(MATERIAL, ""), ["body[0]", "E, nu and state"]),
    "unknown shape": (changed('"box"', '"teapot"'), ["'block'", "'teapot'", "box"]),
    "unknown parameter of a shape": (changed("n = 2", "n = 2, width = 3.0"), ["'block'", "width"]),
    "missing parameter of a shape": (changed("size = [1.0, 1.0], ", ""), ["'block'", "size"]),
    "negative size": (changed("size = [1.0, 1.0]", "size = [-1.0, 1.0]"), ["'block'", "size"]),
    "no elements": (changed("n = 2", "n = 0"), ["'block'", "n", "0"]),
    "missing mesh file": (with_mesh("nowhere.msh"), ["'block'", "nowhere.msh", "no such file"]),
    "mesh file that is none": (with_mesh("broken.msh"), ["'block'", "broken.msh"]),
    "inverted cell": (with_mesh("inverted.msh"), ["'block'", "inverted"]),
    "degenerate cell": (with_mesh("degenerate.msh"), ["'block'"]),
    "quadrilaterals": (with_mesh("quad.msh"), ["'block'", "quad"]),
    "mixed cells": (with_mesh("mixed.msh"), ["'block'", "quad"]),
    "unknown surface": (changed('kind = "plane"', 'kind = "knot"'), ["contact[0].surface", "'knot'"]),
    "surface without its keys": (changed(", normal = [0.0, 1.0]", ""), ["contact[0].surface", "normal", "missing"]),
    "zero normal": (changed("normal = [0.0, 1.0]", "normal = [0.0, 0.0]"), ["'floor'", "normal", "[0.0, 0.0]"]),
    "vector of wrong length": (changed("point = [0.0, 0.0]", "point = [0.0]"), ["'floor'", "point", "2 coordinates"]),
    "unknown constraint": (
        changed('tag = "bottom"', 'tag = "bottom"\nconstraint = "segment"'),
        ["contact[0].constraint", "'segment'", "'nodal'"],
    ),
    "unknown contact tag": (changed('tag = "bottom"', 'tag = "belly"'), ["'block'", "'belly'", "bottom"]),
    "unknown support tag": (changed('tag = "left"', 'tag = "lefft"'), ["'block'", "'lefft'", "left"]),
    "contact of an unknown body": (changed('body = "block"', 'body = "blok"'), ["'blok'", "block"]),
    "wrong component": (changed('component = "x"', 'component = "z"'), ["'block'", "component = 'z'", "x, y"]),
    "unknown component": (changed('component = "x"', 'component = "w"'), ["body[0].supports[0].component", "'w'"]),
    "undeclared interference": (changed("point = [0.0, 0.0]", "point = [0.0, 0.05]"), ["'floor'", "interference"]),
    "nothing can hold it": (GOOD.split("[[contact]]")[0].replace(SUPPORTS, ""), ["'block'", "3 rigid motion"]),
    "contact cannot hold it": (changed(SUPPORTS, ""), ["'block'", "rigid motion"]),
    "no steps": (changed("steps = 1", "steps = 0"), ["time.steps", "0", "greater than or equal to 1"]),
    "fraction of a step": (changed("steps = 1", "steps = 1.5"), ["time.steps", "1.5", "integer"]),
    "expression of an unknown name": (changed("-0.01 * t", "-0.01 * tt"), ["body[0].supports[1].value", "tt"]),
    "expression that is no formula": (changed("-0.01 * t", "0.01 *"), ["body[0].supports[1].value", "0.01 *"]),
    "expression that runs code": (changed("-0.01 * t", "__import__('os').getcwd()"), ["body[0].supports[1].value"]),
    "unknown method": (GOOD + '[solver]\nmethod = "magic"\n', ["solver.method", "'magic'", "'status'"]),
    "minimum norm of a wrong type": (GOOD + "[solver]\nminimum_norm = 2\n", ["solver.minimum_norm", "2", "boolean"]),
    "negative tolerance": (GOOD + "[solver]\ncomplementarity = -1e-8\n", ["solver.complementarity", "-1e-08"]),
    "load without a tag": (
        changed(SUPPORTS, SUPPORTS + '\nloads = [{ kind = "pressure", value = 1.0 }]'),
        ["body[0].loads[0]", "tag"],
    ),
    "load of wrong length": (
        changed(SUPPORTS, SUPPORTS + '\nloads = [{ kind = "body", value = [1.0, 2.0, 3.0] }]'),
        ["'block'", "body load", "2 entries"],
    ),
}


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A folder to work in, with mesh files that are wrong."""
    for name, text in MSH.items():
        (tmp_path / name).write_text(text, encoding="utf8")
    monkeypatch.chdir(tmp_path)
    return tmp_path


def refused(arguments: list[str], words: list[str], folder: Path, capfd: pytest.CaptureFixture[str]) -> None:
    """Assert exit code 2, one line with all `words` on standard error, and that nothing was written."""
    before = sorted(folder.rglob("*"))
    capfd.readouterr()
    try:
        code = main(arguments)
    except SystemExit as exit_:  # argparse's
        code = int(exit_.code or 0)
    out, err = capfd.readouterr()
    assert code == BAD_INPUT, err
    assert err.count("\n") == 1, err
    assert err.endswith("\n"), err
    for word in words:
        assert word in err
    assert "Traceback" not in err
    assert "pydantic" not in err
    assert out == ""
    assert sorted(folder.rglob("*")) == before


@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize("name", SCENES)
def test_scene(name: str, folder: Path, capfd: pytest.CaptureFixture[str]) -> None:
    """A scene with one mistake; the line names the file, the key or body, and the value."""
    text, words = SCENES[name]
    (folder / "scene.toml").write_text(text, encoding="utf8")
    refused(["run", "scene.toml"], ["scene.toml", *words], folder, capfd)


def test_the_good_scene(folder: Path) -> None:
    """Without a mistake the scene runs."""
    (folder / "scene.toml").write_text(GOOD, encoding="utf8")
    assert main(["run", "scene.toml"]) == 0
    assert (folder / "scene.vtkhdf").exists()


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["run", "nowhere.toml"], ["nowhere.toml", "no such file"]),
        (["explain", "nowhere.toml"], ["nowhere.toml", "no such file"]),
        (["run", "."], ["."]),
        (["run", "good.toml", "--set", "time.steps"], ["time.steps", "KEY=VALUE"]),
        (["run", "good.toml", "--set", "body.7.name=a"], ["body.7.name=a", "no such key"]),
        (["run", "good.toml", "--set", "body.0.material.E=-1"], ["good.toml", "body[0].material.E", "-1"]),
        (["run", "good.toml", "--set", "speed=1"], ["good.toml", "speed", "unknown key"]),
        (["run", "good.toml", "--method", "magic"], ["--method", "'magic'", "'status'"]),
        (["run", "good.toml", "--method", "vi-primal", "--set", 'contact.0.constraint="mortar"'], ["vi-primal", "row"]),
        (["run", "good.toml", "-o", "nowhere/record.vtkhdf"], ["nowhere", "folder"]),
        (["run", "good.toml", "--plot", "nowhere/picture.png"], ["nowhere", "folder"]),
        (["run", "good.toml", "--plot", "picture.xyz"], ["picture.xyz", "png"]),
        (["run", "good.toml", "--resume", "nowhere.vtkhdf"], ["nowhere.vtkhdf", "no such file"]),
        (["run", "good.toml", "--resume", "good.toml"], ["good.toml", "HDF5"]),
        (["show", "nowhere.vtkhdf"], ["nowhere.vtkhdf", "no such file"]),
        (["show", "good.toml"], ["good.toml", "HDF5"]),
        (["plot", "nowhere.vtkhdf"], ["nowhere.vtkhdf", "no such file"]),
        (["compare", "nowhere.vtkhdf", "good.toml"], ["nowhere.vtkhdf", "no such file"]),
        (["validate", "hertz-lime"], ["'hertz-lime'", "hertz-line"]),
        (["validate", "bar-stop", "--set", "k=1"], ["bar-stop", "k = 1", "E, A, L, F, q, g"]),
        (["validate", "bar-stop", "--set", "E"], ["'E'", "KEY=VALUE"]),
        (["validate", "bar-stop", "--set", "E=soft"], ["bar-stop", "E = soft", "number"]),
        (["validate", "bar-stop", "--set", "E=-1"], ["bar-stop", "E = -1"]),
        (["validate", "bar-stop", "--set", "E=nan"], ["bar-stop", "E = nan", "finite"]),
        (["validate", "plug", "--set", "nu=0.5"], ["plug", "nu = 0.5"]),
        (["validate", "layer", "--set", "base=glued"], ["layer", "base = 'glued'", "bonded"]),
        (["validate", "hertz-line", "--set", "constraint=segment"], ["hertz-line", "'segment'", "'nodal'"]),
        (["validate", "hertz-point", "--set", "model=4d"], ["hertz-point", "4d", "axisymmetric"]),
        (["validate", "hertz-line", "--h", "-1"], ["--h", "-1.0", "positive"]),
        (["validate", "hertz-line", "--h", "nan"], ["--h", "nan", "positive"]),
        (["validate", "hertz-line", "--h", "fine"], ["--h", "'fine'"]),
        (["validate", "hertz-line", "--n", "9"], ["--n 9", "hertz-line", "--h"]),
        (["validate", "membrane-ball", "--n", "2"], ["--n 2", "at least 3"]),
        (["validate", "membrane-ball", "--order", "2"], ["membrane-ball", "order = 2"]),
        (["validate", "receding", "--h", "0.2", "--method", "vi-primal"], ["receding", "vi-primal"]),
        (["validate", "bar-stop", "-o", "good.toml"], ["good.toml"]),
        (["simulate"], ["'simulate'"]),
    ],
    ids=lambda value: " ".join(value) if value and value[0] in ("run", "explain", "validate", "show", "plot") else "",
)
def test_command(arguments: list[str], words: list[str], folder: Path, capfd: pytest.CaptureFixture[str]) -> None:
    """A command line with one mistake."""
    (folder / "good.toml").write_text(GOOD, encoding="utf8")
    refused(arguments, words, folder, capfd)


def test_as_a_program(folder: Path) -> None:
    """The installed command does the same, and MPI and PETSc add nothing to it."""
    (folder / "scene.toml").write_text(SCENES["inverted cell"][0], encoding="utf8")
    done = program("run", "scene.toml")
    assert done.returncode == BAD_INPUT
    assert done.stderr.count("\n") == 1
    assert done.stderr.startswith("signorini: scene.toml: body 'block': mesh: ")
    assert not (folder / "scene.vtkhdf").exists()


def test_infeasible(folder: Path, capfd: pytest.CaptureFixture[str]) -> None:
    """A block between walls closer than it allows: exit code 3, one line, and a record that says so."""
    walls = "\n".join(
        f'[[contact]]\nname = "{tag}"\nbody = "bar"\ntag = "end"\ninterference = 0.2\n'
        f'surface = {{ kind = "plane", point = [{at}], normal = [{normal}] }}'
        for tag, at, normal in (("lower", 1.1, 1.0), ("upper", 1.0, -1.0))
    )
    (folder / "slit.toml").write_text(
        '[[body]]\nname = "bar"\nkind = "bar"\nmaterial = { EA = 1.0 }\nsupports = [{ tag = "start" }]\n'
        'mesh = { shape = "interval", length = 1.0, n = 4 }\n' + walls,
        encoding="utf8",
    )
    assert main(["run", "slit.toml"]) == NOT_CONVERGED
    out, err = capfd.readouterr()
    assert out == ""
    assert err.count("\n") == 1, err
    assert "walls overlap" in err or "infeasible" in err.lower() or "no position" in err, err
    assert main(["show", "slit.vtkhdf", "--steps", "--json"]) == 0
    assert '"converged": [false]' in capfd.readouterr().out
