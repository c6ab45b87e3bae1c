"""Compiled kernels are those of the present sources."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

from fem import kernel_cache

KERNEL = """
from numba import njit
from fem.constants import FACTOR
from fem.inner import inner

@njit(cache=True)
def outer(x):
    return FACTOR * inner(x)
"""
INNER = """
from numba import njit

@njit(cache=True)
def inner(x):
    return x + 1.0
"""


@pytest.fixture
def tree(tmp_path):
    """A package with a kernel, another inlined in it, a constant and a file that has nothing to do with them."""
    files = {"outer": KERNEL, "inner": INNER, "constants": "FACTOR = 2.0\n", "other": "NAME = 'a'\n"}
    (tmp_path / "fem").mkdir()
    for name, text in files.items():
        (tmp_path / "fem" / f"{name}.py").write_text(text)
    source = Path(kernel_cache.__file__).read_text()
    (tmp_path / "fem" / "kernel_cache.py").write_text(source)
    (tmp_path / "fem" / "__init__.py").write_text("from fem import kernel_cache\n\nkernel_cache.keep()\n")
    return tmp_path


def value(tree, **environment):
    """What a new process makes of the outer kernel at 1."""
    code = "from fem.outer import outer; print(outer(1.0))"
    cleared = {name: text for name, text in os.environ.items() if name != "NUMBA_CACHE_DIR"}
    done = subprocess.run(
        [sys.executable, "-c", code], cwd=tree, capture_output=True, text=True, check=True, env=cleared | environment
    )
    return float(done.stdout)


def edit(tree, name, old, new):
    file = tree / "fem" / f"{name}.py"
    file.write_text(file.read_text().replace(old, new))


def test_a_changed_kernel_or_constant_is_seen(tree):
    """Also where it stands compiled in another file's kernel, and the caches of before are gone."""
    assert value(tree) == 4.0
    edit(tree, "inner", "x + 1.0", "x + 2.0")
    assert value(tree) == 6.0
    edit(tree, "constants", "2.0", "3.0")
    assert value(tree) == 9.0
    folders = list((tree / "fem" / "__pycache__").glob("kernels-*"))
    assert len(folders) == 1
    assert list(folders[0].rglob("*.nbi"))


def test_key(tree):
    """It changes with what goes into kernels only."""
    before = kernel_cache.key(tree)
    edit(tree, "other", "a", "b")
    assert kernel_cache.key(tree) == before
    edit(tree, "constants", "2.0", "4.0")
    assert kernel_cache.key(tree) != before


def test_a_folder_of_the_environment_is_used(tree, tmp_path_factory):
    """As numba documents it."""
    folder = tmp_path_factory.mktemp("kernels")
    assert value(tree, NUMBA_CACHE_DIR=str(folder)) == 4.0
    assert list(folder.rglob("*.nbi"))
    assert not list((tree / "fem" / "__pycache__").glob("kernels-*"))
