"""The campaign's own judgement: problems whose answer is one line."""

import numpy as np
import pytest

from validation.stability.judge import balance, complementarity, gap_residual, least_motion, opened, opposed

SLIT = np.array([[1.0, 0.0], [-1.0, 0.0]])


def test_least_motion_of_a_corner() -> None:
    """x ≥ 1, y ≥ 2 is nearest at (1, 2); a third constraint behind it changes nothing."""
    F = np.array([[1.0, 0.0], [0.0, 1.0], [1.0, 1.0]])
    x = least_motion(F, np.array([-1.0, -2.0, -2.5]))
    assert x is not None
    np.testing.assert_allclose(x, [1.0, 2.0], rtol=1e-12)


@pytest.mark.parametrize("width", [1.0, 1e-6, 0.0])
def test_a_slit_is_open(width: float) -> None:
    assert opened(SLIT, np.array([-1.0, 1.0 + width]))
    assert not opposed(SLIT, np.array([-1.0, 1.0 + width]))


@pytest.mark.parametrize("width", [-1.0, -1e-3])
def test_a_slit_of_negative_width_is_opposed(width: float) -> None:
    assert opposed(SLIT, np.array([-1.0, 1.0 + width]))
    assert not opened(SLIT, np.array([-1.0, 1.0 + width]))


def test_residuals() -> None:
    """Zero of the solution, the relative gap of half of it, infinite of a force that pulls."""
    F, q = np.array([[2.0]]), np.array([-1.0])
    for lam, expected in ((0.25, 0.0), (0.125, 0.5), (-0.1, np.inf)):
        assert gap_residual(F, q, np.array([lam])) == pytest.approx(expected)
        assert complementarity(F @ F.T, q, np.array([lam])) == pytest.approx(expected)
    G = np.array([[1.0], [1.0]])
    assert balance(G, np.array([-1.0]), np.array([0.5, 0.5])) == 0.0
    assert balance(G, np.array([-1.0]), np.array([0.5, 0.25])) == pytest.approx(0.25 / 1.75)
