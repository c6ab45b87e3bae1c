"""The patch: Hooke's law of its displacements gives the tractions, and the blocks meet on the interface."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.testing import assert_allclose

from validation.exact.patch import Patch

from .checks import gradient, hooke


@pytest.mark.parametrize("tilt", [0.0, 23.0])
@pytest.mark.parametrize("dim", [2, 3])
def test_tractions_and_interface(dim, tilt):
    patch = Patch(E1=1, nu1=0.3, E2=7, nu2=0.2, p=0.02, tilt=tilt, dim=dim)
    x = np.random.default_rng(1).uniform(-1, 1, (9, dim))
    n = np.eye(dim)[-1] - np.eye(dim)[0] * np.tan(np.deg2rad(tilt))
    n /= np.linalg.norm(n)
    for field, E, nu in (
        (patch.displacement_upper, patch.E1, patch.nu1),
        (patch.displacement_lower, patch.E2, patch.nu2),
    ):
        sigma = hooke(gradient(field, x), E, nu)
        sides = -patch.side_pressure * np.eye(dim)
        sides[-1, -1] = -patch.p
        assert_allclose(sigma, np.broadcast_to(sides, sigma.shape), atol=1e-12)
        assert_allclose(sigma @ n, np.broadcast_to(-patch.p * n, x.shape), atol=1e-12)
        on = x - np.outer(x @ n, n)
        assert_allclose(field(on) @ n, 0, atol=1e-16)
    assert_allclose(patch.force * n[-1], patch.p)


def test_parameters_outside_the_formula_are_refused():
    with pytest.raises(ValueError, match=r"tilt = 95\.0"):
        Patch(E1=1, nu1=0.3, E2=1, nu2=0.3, p=1, tilt=95.0, dim=2)
