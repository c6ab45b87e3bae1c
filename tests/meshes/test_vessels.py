"""Vessel trees: files, chains, resampling, stenoses and bad input."""

from pathlib import Path

import numpy as np
import pytest

from meshes.vessels import VesselTree, read_swc, tree_of

AORTA = Path(__file__).parents[3] / "shared" / "data" / "aorta_neck.swc"
FORK = """# a trunk along x with two children
1 0 0 0 0 2.0 -1
2 0 1 0 0 2.0 1
3 0 2 0 0 1.5 2
5 0 1 1 0 1.0 2
4 0 1 2 0 0.5 5
"""


def test_chains_of_a_fork(tmp_path: Path) -> None:
    """The trunk goes on into its wider child; the branch starts on the axis, with its own radius."""
    (tmp_path / "fork.swc").write_text(FORK)
    tree = read_swc(tmp_path / "fork.swc", 1e-3)
    assert [c.tolist() for c in tree.chains()] == [[0, 1, 2], [1, 3, 4]]
    rows, chains = tree.segments()
    assert chains.tolist() == [0, 0, 1, 1]
    np.testing.assert_allclose(rows[1], [1e-3, 0, 0, 2e-3, 0, 0, 2e-3, 1.5e-3])
    np.testing.assert_allclose(rows[2], [1e-3, 0, 0, 1e-3, 1e-3, 0, 1e-3, 1e-3])


@pytest.mark.skipif(not AORTA.exists(), reason="no shared data")
def test_the_aorta() -> None:
    """1,919 points in 15 chains; resampled it keeps its forks, and its length but for what chords cut off."""
    tree = read_swc(AORTA, 1e-3)
    assert len(tree.points) == 1919
    assert len(tree.chains()) == 15
    thin = tree.resampled(4e-3)
    assert len(thin.chains()) == 15
    assert len(thin.points) < 600

    def length(t: VesselTree) -> float:
        rows, _ = t.segments()
        return float(np.linalg.norm(rows[:, 3:6] - rows[:, :3], axis=1).sum())

    assert 0.98 < length(thin) / length(tree) <= 1
    forks = np.bincount(tree.parents[1:])
    for i in np.flatnonzero(forks > 1):
        assert np.min(np.linalg.norm(thin.points - tree.points[i], axis=1)) < 1e-12


def test_branches_from_points() -> None:
    """A straight line stays straight with linear radii; a branch that starts on an axis is joined, another is free."""
    trunk = np.array([[0.0, 0, 0, 2], [5, 0, 0, 2], [10, 0, 0, 1]])
    side = np.array([[5.0, 0, 0, 1], [5, 5, 0, 1]])
    tree = tree_of([("trunk", trunk), ("side", side), ("free", side + np.array([0, 0, 9, 0]))], 0.5)
    chains = tree.chains()
    assert len(chains) == 3
    on = tree.points[chains[0]]
    np.testing.assert_allclose(on[:, 1:], 0, atol=1e-14)
    np.testing.assert_allclose(np.diff(on[:, 0]), 0.5)
    np.testing.assert_allclose(tree.points[chains[1][0]], [5, 0, 0], atol=1e-12)
    assert tree.parents[chains[2][0]] == -1
    np.testing.assert_allclose(tree.radii[chains[1][1:]], 1.0)


def test_stenosis() -> None:
    """Half the radius at the centre, all of it half a length away."""
    tree = tree_of([("a", np.array([[0.0, 0, 0, 2], [10, 0, 0, 2]]))], 0.5).narrowed(np.array([5.0, 0, 0]), 4.0, 0.5)
    x = tree.points[:, 0]
    assert tree.radii[x == 5.0] == pytest.approx(1.0)
    assert tree.radii[x == 6.0] == pytest.approx(1.5)
    np.testing.assert_array_equal(tree.radii[np.abs(x - 5) >= 2], 2.0)


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("1 0 0 0 0 2.0 -1", "1 0 0 0 0 0.0 -1", "radii[0] = 0: must be above 0"),
        ("1 0 0 0 0 2.0 -1", "1 0 0 0 0 2.0 3", "its own ancestor"),
        ("5 0 1 1 0 1.0 2", "5 0 1 1 0 1.0 7", "parent = 7 of point 5"),
        ("4 0 1 2 0", "5 0 1 2 0", "id = 5: must not appear twice"),
        ("4 0 1 2 0 0.5 5", "4 0 1 2 0 0.5", "must be id type x y z radius parent"),
    ],
)
def test_bad_files(tmp_path: Path, old: str, new: str, message: str) -> None:
    """One line that names the file and what is wrong."""
    (tmp_path / "bad.swc").write_text(FORK.replace(old, new))
    with pytest.raises(ValueError, match="bad") as caught:
        read_swc(tmp_path / "bad.swc")
    assert message in str(caught.value)
    assert "\n" not in str(caught.value)
