"""Loop's subdivision surface of second-order facets: limits, accuracy, continuity, closest points."""

from __future__ import annotations

import itertools

import numpy as np
import pytest
from numpy.typing import NDArray

from contact.surfaces import subdivision_kernel as kernel
from contact.surfaces.body_surface import BodySurface
from contact.surfaces.subdivision import smooth

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]


def second_order(points: Floats, triangles: Ints) -> tuple[Floats, Ints]:
    """Triangles with middles of their edges."""
    edges = triangles[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2)
    pairs, number = np.unique(np.sort(edges, axis=1), axis=0, return_inverse=True)
    return np.vstack([points, points[pairs].mean(axis=1)]), np.hstack([triangles, len(points) + number.reshape(-1, 3)])


def octahedron() -> tuple[Floats, Ints]:
    """A closed surface whose corners have four neighbours, pulled out of shape."""
    points = np.vstack([np.eye(3), -np.eye(3)]) * [1.0, 1.3, 0.8] + [0.1, 0.0, 0.05]
    faces = [[0, 1, 2], [1, 3, 2], [3, 4, 2], [4, 0, 2], [1, 0, 5], [3, 1, 5], [4, 3, 5], [0, 4, 5]]
    return second_order(points, np.array(faces))


def tube(n: int, bend: float = np.inf, mixed: bool = False, radius: float = 1.0) -> tuple[Floats, Ints]:
    """n × n rectangles cut in two on the inside of a tube of length 4 (or an arc of a torus), its nodes on it.

    Cut along one diagonal every node has six neighbours; where cuts are mixed, four or eight.
    """
    angle, z = np.meshgrid(np.arange(2 * n) * np.pi / n, np.linspace(-2, 2, 2 * n + 1), indexing="ij")
    across, up = radius * np.cos(angle), radius * np.sin(angle)
    if np.isfinite(bend):
        points = np.stack([(bend + across) * np.cos(z / bend) - bend, (bend + across) * np.sin(z / bend), up], axis=-1)
    else:
        points = np.stack([across, z, up], axis=-1)
    i, j = np.meshgrid(2 * np.arange(n), 2 * np.arange(n), indexing="ij")

    def at(a: int, b: int) -> Ints:
        node: Ints = ((i + a) % (2 * n)) * (2 * n + 1) + j + b
        return node.ravel()

    def cut(*corners: tuple[int, int]) -> Ints:
        following = corners[1:] + corners[:1]
        middles = [((a[0] + b[0]) // 2, (a[1] + b[1]) // 2) for a, b in zip(corners, following, strict=True)]
        return np.stack([at(*place) for place in (*corners, *middles)], axis=1)

    a, b, c, d = (0, 0), (2, 0), (2, 2), (0, 2)
    one, other = (cut(a, b, c), cut(a, c, d)), (cut(a, b, d), cut(b, c, d))
    flip = (((i + j) // 2) % 2 == 1).ravel()[:, None] & mixed
    facets = np.vstack([np.where(flip, o, m) for m, o in zip(one, other, strict=True)])
    return points.reshape(-1, 3), facets


def surface(points: Floats, facets: Ints) -> BodySurface:
    patches, Q = smooth(facets, len(points))
    return BodySurface(patches, 0, Q @ points, None)


def refined(points: Floats, triangles: Ints) -> tuple[Floats, Ints]:
    """One step of Loop's rules on a closed mesh, written out."""
    wings: dict[tuple[int, int], list[int]] = {}
    near: dict[int, set[int]] = {}
    for tri in triangles.tolist():
        for k in range(3):
            a, b, c = tri[k], tri[(k + 1) % 3], tri[(k + 2) % 3]
            wings.setdefault((min(a, b), max(a, b)), []).append(c)
            near.setdefault(a, set()).update((b, c))
    new = []
    for v in range(len(points)):
        n = len(near[v])
        beta = (5 / 8 - (3 / 8 + np.cos(2 * np.pi / n) / 4) ** 2) / n
        new.append((1 - n * beta) * points[v] + beta * points[list(near[v])].sum(axis=0))
    number = {}
    for (a, b), (c, d) in wings.items():
        number[a, b] = number[b, a] = len(new)
        new.append((3 * (points[a] + points[b]) + points[c] + points[d]) / 8)
    finer = []
    for a, b, c in triangles.tolist():
        ab, bc, ca = number[a, b], number[b, c], number[c, a]
        finer += [[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]]
    return np.array(new), np.array(finer)


def random_places(s: BodySurface, count: int, seed: int = 0) -> tuple[Ints, Floats]:
    rng = np.random.default_rng(seed)
    at = rng.random((count, 2))
    fold = at.sum(axis=1) > 1
    at[fold] = 1 - at[fold]
    return rng.integers(0, len(s.patches.net), count), at


def test_the_surface_is_the_limit_of_refinement() -> None:
    points, facets = octahedron()
    s = surface(points, facets)
    triangles = facets[:, [[0, 3, 5], [3, 1, 4], [5, 4, 2], [3, 4, 5]]].reshape(-1, 3)
    x = s.control
    for _ in range(5):
        x, triangles = refined(x, triangles)
    middle = x[triangles].mean(axis=1)
    away = np.abs(s.nearest(middle).distance).max()
    x, triangles = refined(x, triangles)
    finer = np.abs(s.nearest(x[triangles].mean(axis=1)).distance).max()
    # Refined nets are off their limit by the square of their size.
    assert away < 2e-4
    assert 3.0 < away / finer < 5.0


@pytest.mark.parametrize(
    ("bend", "mixed", "rates"), [(np.inf, False, (4, 3)), (6.0, False, (4, 3)), (6.0, True, (2, 1))]
)
def test_distance_and_normal_of_tubes_converge(bend: float, mixed: bool, rates: tuple[float, float]) -> None:
    """Away from the rim, where the surface ends on a spline of its nodes, which lie on the tube."""
    errors = []
    for n in (8, 16, 32):
        s = surface(*tube(n, bend, mixed))
        x, n_h = kernel.places(s.patches, s.control, *random_places(s, 4000))
        n_h /= np.linalg.norm(n_h, axis=1)[:, None]
        if np.isfinite(bend):
            rho, z = np.hypot(x[:, 0] + bend, x[:, 1]), bend * np.arctan2(x[:, 1], x[:, 0] + bend)
            out = np.column_stack([(x[:, 0] + bend) / rho, x[:, 1] / rho, np.zeros(len(x))])
            off = (rho - bend)[:, None] * out + x[:, 2:] * [0.0, 0.0, 1.0]
        else:
            z, off = x[:, 1], x * [1.0, 0.0, 1.0]
        r = np.linalg.norm(off, axis=1)
        inner = np.abs(z) < 1
        side = np.sign(np.einsum("qi,qi->q", n_h, off)[0])
        errors.append((np.abs(r - 1)[inner].max(), np.linalg.norm(n_h - side * off / r[:, None], axis=1)[inner].max()))
    fitted = np.log2(np.array(errors[:-1]) / errors[1:])[-1]
    assert fitted[0] > rates[0] - 0.3, (errors, fitted)
    assert fitted[1] > rates[1] - 0.3, (errors, fitted)
    assert errors[1][0] < (2e-3 if mixed else 2e-4)


def test_normals_agree_on_both_sides_of_every_edge() -> None:
    for points, facets in (octahedron(), tube(4, 6.0, mixed=True)):
        s = surface(points, facets)
        s.control += 0.05 * np.sin(5 * s.control[:, [1, 2, 0]])  # a wall that has given way
        net, across, turn = s.patches.net, s.patches.across, s.patches.turn
        for edge in range(3):
            mine = np.flatnonzero(across[:, edge] >= 0)
            for share in (0.1, 0.3, 0.7):
                sides = []
                for patch, corner, part in (
                    (mine, np.full(len(mine), edge), share),
                    (across[mine, edge], turn[mine, edge], 1 - share),
                ):
                    e = np.zeros((len(mine), 3))
                    e[np.arange(len(mine)), corner], e[np.arange(len(mine)), (corner + 1) % 3] = 1 - part, part
                    x, n = kernel.places(s.patches, s.control, patch, e[:, 1:])
                    sides.append((x, n / np.linalg.norm(n, axis=1)[:, None]))
                np.testing.assert_allclose(sides[0][0], sides[1][0], atol=1e-13)
                np.testing.assert_allclose(sides[0][1], sides[1][1], atol=1e-11)
        assert net.shape[1] >= 12


def test_the_gap_s_gradient_is_the_normal_and_the_shares() -> None:
    s = surface(*tube(6, 6.0, mixed=True))
    s.control += 0.03 * np.sin(4 * s.control[:, [1, 2, 0]])
    patch, at = random_places(s, 60, 3)
    y, n = kernel.places(s.patches, s.control, patch, at)
    x = y + np.random.default_rng(1).uniform(-0.1, 0.25, (len(y), 1)) * n / np.linalg.norm(n, axis=1)[:, None]
    patch, at = s.search(x)
    foot, shares, rim = s.closest(x, patch, at)
    inner = np.flatnonzero(~rim)
    eps = 1e-6
    for e in np.eye(3):
        moved = [s.closest(x + side * eps * e, patch.copy(), at.copy())[0] for side in (1, -1)]
        rate = (moved[0].distance - moved[1].distance) / (2 * eps)
        np.testing.assert_allclose(rate[inner], (foot.normal @ e)[inner], atol=1e-8)
        turn = (moved[0].normal - moved[1].normal) / (2 * eps)
        np.testing.assert_allclose(turn[inner], (foot.curvature @ e)[inner], atol=1e-4 * np.abs(foot.curvature).max())
    rng = np.random.default_rng(5)
    d, control = rng.normal(size=s.control.shape), s.control
    gaps = []
    for side in (1, -1):
        s.control = control + side * eps * d
        gaps.append(s.closest(x, patch.copy(), at.copy())[0].distance)
    rate = -np.einsum("qk,qkd,qd->q", shares, d[s.patches.net[patch]], foot.normal)
    np.testing.assert_allclose(((gaps[0] - gaps[1]) / (2 * eps))[inner], rate[inner], atol=1e-7)


def test_search_misses_no_patch() -> None:
    """Against the least distance from a dense cloud of points on all patches."""
    s = surface(*tube(6, 3.0, mixed=True))
    s.control += 0.15 * np.sin(3 * s.control[:, [1, 2, 0]])
    s._boxed = -1
    grid = np.array([(v, w) for v, w in itertools.product(np.linspace(0, 1, 21), repeat=2) if v + w <= 1 + 1e-9])
    patch = np.repeat(np.arange(len(s.patches.net)), len(grid))
    cloud, _ = kernel.places(s.patches, s.control, patch, np.tile(grid, (len(s.patches.net), 1)))
    x = cloud[:: len(cloud) // 200] + np.random.default_rng(0).normal(0, 0.4, (len(cloud[:: len(cloud) // 200]), 3))
    least = np.array([np.linalg.norm(cloud - p, axis=1).min() for p in x])
    foot = s.nearest(x)
    found = np.linalg.norm(x - foot.point, axis=1)
    assert np.all(found <= least + 1e-12)
    assert np.all(np.abs(s.lower_bound(x)) <= found + 1e-12)


def test_feet_are_followed_from_patch_to_patch() -> None:
    """A point dragged once around a bent tube: its foot is that of a fresh search, its normal turns without jumps."""
    s = surface(*tube(8, 5.0, mixed=True))
    angle = np.linspace(0, 2 * np.pi, 400)
    along = 1.5 * np.sin(angle)
    rho = 5 + 0.8 * np.cos(angle)
    way = np.column_stack([rho * np.cos(along / 5) - 5, rho * np.sin(along / 5), 0.8 * np.sin(angle)])
    patch, at = s.search(way[:1])
    normals = []
    for x in way:
        foot, _, _ = s.closest(x[None], patch, at)
        np.testing.assert_allclose(foot.distance, s.nearest(x[None]).distance, atol=1e-12)
        normals.append(foot.normal[0])
    turn = np.linalg.norm(np.diff(normals, axis=0), axis=1)
    step = np.linalg.norm(np.diff(way, axis=0), axis=1)
    assert (turn / step).max() < 3.5  # the tube's curvature is 1 at its wall, 1.25 here; that of single patches is more


@pytest.mark.parametrize("bend", [np.inf, 6.0])
def test_a_point_that_crosses_the_axis_leaves_the_wall_behind(bend: float) -> None:
    """In a plane of symmetry the distance stays stationary on the wall behind, which is the nearest no more."""
    s = surface(*tube(8, bend))
    for rho in (0.8, 0.3, -0.2, -0.7):
        x = np.array([[rho, 0.0, 0.0]])
        if rho == 0.8:
            patch, at = s.search(x)
        foot, _, _ = s.closest(x, patch, at)
        np.testing.assert_allclose(foot.distance, s.nearest(x).distance, atol=1e-10)
        assert abs(foot.distance[0] - (1 - abs(rho))) < 0.02


def test_beyond_the_rim_is_no_contact() -> None:
    s = surface(*tube(8))
    x = np.array([[0.9, 1.95, 0.0], [0.9, 2.2, 0.0], [1.1, -2.3, 0.0]])
    foot, _, rim = s.closest(x, *s.search(x))
    assert rim.tolist() == [False, True, True]
    np.testing.assert_allclose(foot.distance, [0.1, np.hypot(0.1, 0.2), np.hypot(0.1, 0.3)], atol=5e-3)


def test_what_is_no_smooth_surface_is_refused() -> None:
    points, facets = octahedron()
    with pytest.raises(ValueError, match="second-order"):
        smooth(facets[:, :3], len(points))
    twisted = facets.copy()
    twisted[0] = twisted[0][[1, 0, 2, 3, 5, 4]]
    with pytest.raises(ValueError, match="alike oriented"):
        smooth(twisted, len(points))
    with pytest.raises(ValueError, match="share a corner"):
        smooth(facets[[0, 5]], len(points))
