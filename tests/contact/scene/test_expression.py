"""Functions of place and time written as text."""

import numpy as np
import pytest

from contact.scene.expression import Expression

POINTS = np.array([[1.0, 2.0], [3.0, 4.0]])


@pytest.mark.parametrize(
    ("text", "values"),
    [
        ("x + 10*y", [21, 43]),
        ("1/2", [0.5, 0.5]),
        ("-x**2", [-1, -9]),
        ("z", [0, 0]),
        ("0.01 * x * (t < 1)", [0.01, 0.03]),
        ("where(x > 2, sin(pi/2), t)", [0.5, 1]),
        ("arctan2(y, x)", np.arctan2([2, 4], [1, 3])),
        ("3000000000 * x", [3e9, 9e9]),
    ],
)
def test_values(text: str, values: list[float]) -> None:
    """Numbers, one per point, as floats."""
    found = Expression(text)(POINTS, 0.5)
    assert found.dtype == float
    np.testing.assert_allclose(found, values, rtol=1e-15)


@pytest.mark.parametrize(
    "text",
    [
        "t",
        "2",
        "0.0446 * t",
        "pi * where(t < 1, 0.0, where(t < 2, (t - 1)/0.5, 1.0))",
        "sin(t) + cos(t)*arctan2(t, 2) - exp(-t)*sqrt(t) + log(t + 3) + tanh(t)",
        "abs(t - 2)**2 + arcsin(t/10) + sinh(t)",
        "where(~(t < 1), 1.0, 2.0)",
        "(t > 1) * 3 + x + y*z",
        "0.1 * ((t > 1) + (t > 2))",
        "0.1 * (t > 1) + 0.1 * (t > 2)",
        "(t - 1)**0.5",
        "abs((t - 1)**0.5)",
        "where(t < 1, 0.0, 1/(t - 1))",
        "log(t - 1)",
        "exp(1000*t)",
        "t  # of a step",
    ],
)
def test_a_place_has_the_value_of_the_points(text: str) -> None:
    """At the origin plain numbers give what arrays do, where these are finite; elsewhere what is not finite."""
    expression = Expression(text)
    for t in (0.0, 0.3, 1.0, 1.5, 2.5):
        expected = expression(np.zeros((1, 3)), t)[0]
        found = expression.at(t)
        assert isinstance(found, float)
        if np.isfinite(expected):
            assert found == pytest.approx(expected, rel=1e-15, abs=1e-15)
        else:
            assert not np.isfinite(found)


def test_points_of_any_dimension() -> None:
    """Coordinates that a mesh lacks are zero; no points give no values."""
    expression = Expression("x + 2*y + 4*z")
    np.testing.assert_array_equal(expression(np.ones((2, 1)), 0.0), [1, 1])
    np.testing.assert_array_equal(expression(np.ones((2, 3)), 0.0), [7, 7])
    assert expression(np.ones((0, 3)), 0.0).shape == (0,)


@pytest.mark.parametrize("text", ["", "x +", "x; y", "x := 1", "2 x"])
def test_no_expression(text: str) -> None:
    """Text that does not parse is quoted."""
    with pytest.raises(ValueError, match="is no expression"):
        Expression(text)


@pytest.mark.parametrize("text", ["u", "__import__('os')", "x.real", "x[0]", "lambda: 1", "sum(x)"])
def test_unknown_names(text: str) -> None:
    """Only the variables, pi and the listed functions exist."""
    with pytest.raises(ValueError, match="may use x, y, z, t, pi and abs"):
        Expression(text)


@pytest.mark.parametrize("text", ["x and y", "x^2", "1 < x < 2", "sin", "sin(x, y)", "x(1)", "(x, y)", "'a'", "not x"])
def test_what_numexpr_does_not_know(text: str) -> None:
    """Python that parses but cannot be evaluated is refused when it is read, not when it is first used."""
    with pytest.raises(ValueError, match="cannot be evaluated"):
        Expression(text)
