"""Functions of position and time written as text in a scene, such as ``"0.01 * x * (t < 1)"``."""

from __future__ import annotations

import ast
import math

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]

VARIABLES = ("x", "y", "z", "t")
FUNCTIONS = (
    "abs", "arccos", "arcsin", "arctan", "arctan2", "cos", "cosh", "exp", "log", "sin", "sinh", "sqrt", "tan", "tanh",
    "where",
)  # fmt: skip
_BARE = {"__builtins__": {}, "x": 0.0, "y": 0.0, "z": 0.0, "pi": math.pi}
_ARRAYS = _BARE | {name: getattr(np, name) for name in FUNCTIONS}
# The same for plain numbers, in a tenth of the time
_OWN = {"abs": abs, "where": lambda condition, a, b: a if condition else b}
_SCALARS = _BARE | _OWN | {name: getattr(math, name.replace("arc", "a")) for name in FUNCTIONS if name not in _OWN}


class Expression:
    """A function of x, y, z [m] and t [s], evaluated by numexpr on whole arrays.

    Raises
    ------
    ValueError
        where the text is no expression that numexpr can evaluate, or names anything but its variables, ``pi`` and the
        functions of `FUNCTIONS`.
    """

    def __init__(self, text: str) -> None:
        try:
            tree = ast.parse(text, mode="eval")
        except (SyntaxError, ValueError):
            raise ValueError(f"{text!r} is no expression") from None
        names = {node.id for node in ast.walk(tree) if isinstance(node, ast.Name)}
        unknown = names - {*VARIABLES, "pi", *FUNCTIONS}
        if unknown or any(isinstance(node, ast.Attribute | ast.Subscript | ast.Lambda) for node in ast.walk(tree)):
            raise ValueError(
                f"{text!r} may use {', '.join(VARIABLES)}, pi and {', '.join(FUNCTIONS)}"
                + (f", not {', '.join(sorted(unknown))}" if unknown else "")
            )
        self.text = text
        plain = not any(_needs_numpy(node) for node in ast.walk(tree))
        function = ast.parse("lambda t: 0", mode="eval")
        function.body.body = tree.body  # type: ignore[attr-defined]
        code = compile(function, "<expression>", "eval")
        self._arrays = eval(code, _ARRAYS)
        self._scalars = eval(code, _SCALARS) if plain else self._arrays
        try:
            self(np.ones((1, 3)), 1.0)
        except Exception as error:  # numexpr raises whatever its parser came upon
            raise ValueError(f"{text!r} cannot be evaluated: {error}") from None

    def at(self, t: float) -> float:
        """The value at the origin and time t: what a motion or load of a single place asks for in every step."""
        if self._scalars is not self._arrays:
            try:
                return float(self._scalars(float(t)))
            except (ArithmeticError, TypeError, ValueError):
                pass
        try:
            with np.errstate(all="ignore"):
                return float(self._arrays(np.float64(t)))
        except ArithmeticError:
            return np.nan

    def __call__(self, points: Floats, t: float) -> Floats:
        """Values at points (n, d) and time t, (n)."""
        import numexpr

        known = dict(zip(VARIABLES, points.T, strict=False)) | {"t": t, "pi": np.pi}
        for name in VARIABLES[points.shape[1] : 3]:
            known[name] = 0.0
        with np.errstate(all="ignore"):  # a body says of a value that is not finite where it stands
            values = numexpr.evaluate(self.text, local_dict=known, global_dict={})
        return np.broadcast_to(values, len(points)).astype(float)


def _needs_numpy(node: ast.AST) -> bool:
    """Whether Python may have another answer: to ~ and + of truth values, and to a root of a negative number."""
    if isinstance(node, ast.BinOp) and isinstance(node.op, ast.Pow):
        return not (isinstance(node.right, ast.Constant) and isinstance(node.right.value, int))
    if isinstance(node, ast.BinOp) and isinstance(node.op, ast.Add):
        return all(any(isinstance(part, ast.Compare) for part in ast.walk(side)) for side in (node.left, node.right))
    return isinstance(node, ast.Invert)
