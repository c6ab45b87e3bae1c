"""Sums over ranks, and work of rank 0 whose failure every rank must learn of."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray


def total(comm: Any, values: NDArray[np.float64]) -> NDArray[np.float64]:
    """The sum of `values` over the ranks. Collective, and free of charge on one rank."""
    if comm.size == 1:
        return values
    result: NDArray[np.float64] = comm.allreduce(values)
    return result


def anywhere(comm: Any, marks: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """What is marked on some rank. Collective, and free of charge on one rank."""
    if comm.size == 1:
        return marks
    result: NDArray[np.bool_] = comm.allreduce(marks, op=np.logical_or)
    return result


def on_root[T](comm: Any, work: Callable[[], T]) -> T | None:
    """`work`() on rank 0, None elsewhere; its ValueError, ImportError or OSError on every rank. Collective."""
    result, error = None, None
    if comm.rank == 0:
        try:
            result = work()
        except (ValueError, ImportError, OSError) as problem:
            error = problem
    if error := comm.bcast(error):
        raise error
    return result
