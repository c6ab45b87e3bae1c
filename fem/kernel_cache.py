"""Where numba keeps compiled kernels: a folder of each state of the sources that go into them.

numba looks only at the file of a kernel. What another file's kernel or constant has put into it would stay what it was
when that file changes, in an installation that is updated in place.
"""

from __future__ import annotations

import os
import re
import shutil
import sys
from collections.abc import Iterable
from contextlib import suppress
from hashlib import blake2b
from pathlib import Path

PACKAGES, NAME = ("fem", "contact"), "kernels-"
_IMPORTED = re.compile(rb"^from ((?:fem|contact)[\w.]*) import", re.MULTILINE)


def key(root: Path, packages: Iterable[str] = PACKAGES) -> str:
    """A hash of all files with compiled functions, and of those that they import from."""
    texts = {file: file.read_bytes() for package in packages for file in sorted((root / package).rglob("*.py"))}
    chosen = {file for file, text in texts.items() if b"njit" in text}
    for file in list(chosen):
        for name in _IMPORTED.findall(texts[file]):
            chosen.add((root / name.decode().replace(".", "/")).with_suffix(".py"))
    state = blake2b(digest_size=8)
    for file in sorted(chosen & texts.keys()):
        state.update(str(file.relative_to(root)).encode() + texts[file])
    return state.hexdigest()


def keep(root: Path = Path(__file__).parents[1]) -> None:
    """Let numba use the folder of the present sources, and remove those of others.

    Without effect where the environment names a folder, or this one cannot be written: numba has its own then, and
    after an update kernels may be old.
    """
    given = os.environ.get("NUMBA_CACHE_DIR")
    if given and not Path(given).name.startswith(NAME):  # by this function in the process that started this one
        return
    folder = root / "fem" / "__pycache__" / f"{NAME}{key(root)}"
    with suppress(OSError):
        folder.mkdir(parents=True, exist_ok=True)
    if not os.access(folder, os.W_OK):
        return
    for other in folder.parent.glob(f"{NAME}*"):
        if other != folder:
            shutil.rmtree(other, ignore_errors=True)
    os.environ["NUMBA_CACHE_DIR"] = str(folder)
    if "numba" in sys.modules:  # which has read the environment already
        sys.modules["numba"].config.CACHE_DIR = str(folder)
