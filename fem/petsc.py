"""Where PETSc comes from: the one file that knows the name of the wheel."""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import suppress

HOW_TO_GET_PETSC = (
    "signorini needs petsc4py >= 3.23.5: pip install 'signorini[petsc]' brings it as a wheel "
    "(Linux x86_64, Python >= 3.12), or install your own build of PETSc and petsc4py"
)

with suppress(ImportError):
    import dolfinx_solver  # noqa: F401  the wheel orders MPI ahead of petsc4py, so it comes first
try:
    import petsc4py
except ImportError:
    raise ImportError(HOW_TO_GET_PETSC) from None


def initialise(options: Sequence[str] = ()) -> None:
    """Start PETSc with command-line `options`; must run before anything imports ``petsc4py.PETSc``.

    Collective on the world communicator.
    """
    petsc4py.init(["signorini", *options])
