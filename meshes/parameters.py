"""Checks of the parameters of generators: ValueError with one line that names key, value and what is allowed."""

from __future__ import annotations

import math
from collections.abc import Collection, Sequence
from numbers import Integral, Real

import numpy as np


def bad(key: str, value: object, allowed: str) -> ValueError:
    """The error that every check raises."""
    shown = value.tolist() if isinstance(value, np.ndarray | np.generic) else value
    return ValueError(f"{key} = {shown!r}: must be {allowed}")


def number(key: str, value: object) -> float:
    """A finite number."""
    if isinstance(value, bool) or not isinstance(value, Real) or not math.isfinite(value):
        raise bad(key, value, "a finite number")
    return float(value)


def positive(key: str, value: object) -> float:
    """A finite number above zero."""
    if isinstance(value, bool) or not isinstance(value, Real) or not 0 < float(value) < math.inf:
        raise bad(key, value, "a positive number")
    return float(value)


def count(key: str, value: object) -> int:
    """A whole number above zero."""
    if isinstance(value, bool) or not isinstance(value, Integral) or value < 1:
        raise bad(key, value, "a positive whole number")
    return int(value)


def choice[T](key: str, value: T, allowed: Collection[T]) -> T:
    """One of the allowed values, of the same type (``True`` is not 1)."""
    if not any(type(value) is type(a) and value == a for a in allowed):
        raise bad(key, value, " or ".join(repr(a) for a in allowed))
    return value


def vector(key: str, value: object, lengths: Collection[int]) -> tuple[float, ...]:
    """A sequence of finite numbers with one of the allowed lengths."""
    if not isinstance(value, Sequence | np.ndarray) or isinstance(value, str) or len(value) not in lengths:
        raise bad(key, value, f"a list of {' or '.join(str(n) for n in lengths)} numbers")
    return tuple(number(f"{key}[{i}]", x) for i, x in enumerate(value))


def larger(key: str, value: object, than: str, bound: float) -> float:
    """A finite number above the positive one named `than`."""
    if (x := positive(key, value)) <= bound:
        raise bad(key, value, f"greater than {than} = {bound!r}")
    return x
