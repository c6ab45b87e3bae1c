"""On what machine and with which versions something ran; no names of hosts, people or paths."""

from __future__ import annotations

import ctypes
import os
import platform
import subprocess
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

from fem import petsc  # noqa: F401  PETSc is found through it

LIBRARIES = ("numpy", "scipy", "numba", "gmsh", "h5py", "mpi4py")


def machine() -> dict[str, str | float]:
    """The processor's model, its cores, the memory [GiB], and the kind of operating system."""
    memory = os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES") / 2**30
    return {
        "processor": _processor(),
        "cores": os.cpu_count() or 1,
        "memory [GiB]": round(memory, 1),
        "system": f"{platform.system()} {platform.machine()}",
    }


def versions() -> dict[str, str]:
    """Versions of this program, its commit, Python, and the libraries that its numbers depend on."""
    from petsc4py import PETSc

    found = {"signorini": version("signorini"), "commit": commit(), "python": platform.python_version()}
    found["petsc"] = ".".join(str(n) for n in PETSc.Sys.getVersion())
    found["mumps"] = _mumps()
    for library in LIBRARIES:
        try:
            found[library] = version(library)
        except PackageNotFoundError:
            found[library] = "unknown"
    return found


def commit() -> str:
    """The commit of the sources, with ``+`` where tracked files differ from it; ``unknown`` outside a repository."""

    def git(*words: str) -> str:
        done = subprocess.run(["git", *words], cwd=Path(__file__).parent, capture_output=True, text=True, check=False)
        return done.stdout.strip() if done.returncode == 0 else ""

    try:
        name = git("rev-parse", "HEAD")
        changed = name and git("status", "--porcelain", "--untracked-files=no")
    except OSError:
        return "unknown"
    return f"{name}+" if changed else name or "unknown"


def _processor() -> str:
    try:
        lines = Path("/proc/cpuinfo").read_text(encoding="utf8").splitlines()
    except OSError:
        lines = []
    names = [line.partition(":")[2].strip() for line in lines if line.startswith("model name")]
    return names[0] if names else platform.processor() or "unknown"


def _mumps() -> str:
    """The version that the library behind PETSc states of itself."""
    from petsc4py import PETSc

    library, text = ctypes.CDLL(PETSc.__file__), ctypes.create_string_buffer(b" " * 32, 32)
    try:
        library.mumps_set_version_(text, ctypes.c_size_t(32))
    except AttributeError:
        return "unknown"
    return text.raw.decode("ascii", "replace").strip("\0 ") or "unknown"
