"""The path: exact on lines, passes through its points, keeps to its lap."""

import numpy as np
import pytest

from snakewalk.config.errors import InputError
from snakewalk.controller.terrain.path import WINDOW_M, SplinePath

SQUARE = [(0, 0), (2, 0), (2, 2), (0, 2), (0, 0)]


def test_a_straight_path_is_its_chord() -> None:
    path = SplinePath([(0, 0), (3, 4)])
    assert path.length_m == pytest.approx(5.0)
    np.testing.assert_allclose(path.position(2.5), [1.5, 2.0], atol=1e-9)
    assert path.heading_rad(1.0) == pytest.approx(np.arctan2(4, 3))
    np.testing.assert_allclose(path.position([-1.0, 99.0]), [[0, 0], [3, 4]], atol=1e-12)


def test_it_passes_through_every_point_in_order() -> None:
    path = SplinePath(SQUARE)
    at = 0.0
    for point in SQUARE[1:]:
        s = path.nearest(point, at, window_m=4.0)
        assert s > at
        np.testing.assert_allclose(path.position(s), point, atol=0.01)
        at = s


def test_nearest_does_not_jump_to_another_lap() -> None:
    path = SplinePath(SQUARE)
    assert path.nearest((0.0, 0.0), 0.0) == pytest.approx(0.0, abs=0.02)
    assert path.nearest((0.0, 0.0), path.length_m - 1.0) == pytest.approx(path.length_m, abs=0.02)


def test_arc_length_is_arc_length() -> None:
    path = SplinePath(SQUARE)
    s = np.linspace(0.0, path.length_m, 4000)
    step = np.hypot(*np.diff(path.position(s), axis=0).T)
    np.testing.assert_allclose(step, s[1], rtol=2e-3)


def test_a_path_of_one_point_is_refused() -> None:
    with pytest.raises(InputError, match="two different points"):
        SplinePath([(1, 1), (1, 1)])


def test_a_lap_passes_its_waypoints_in_order_and_its_start_again_at_the_end() -> None:
    path = SplinePath(SQUARE)
    at = [path.first_pass((0, 0))]
    for corner in SQUARE[1:]:
        at.append(path.first_pass(corner, at[-1] + 0.1))
    assert at[0] == 0.0
    assert at == sorted(at)
    assert at[-1] == pytest.approx(path.length_m)
    np.testing.assert_allclose(path.position(at), SQUARE, atol=0.01)


def test_followers_go_where_each_is_nearest_and_know_how_far_away() -> None:
    path = SplinePath([(0.0, 0.0), (2.0, 1.0), (4.0, 0.0)])
    points = np.random.default_rng(3).uniform(0.0, 4.0, (20, 2))
    start_m = np.linspace(0.0, path.length_m, 20)
    at_m, gap_m = start_m.copy(), np.empty(20)
    path.project(points, at_m, gap_m)
    assert at_m.tolist() == [path.nearest(p, s) for p, s in zip(points, start_m, strict=True)]
    assert gap_m == pytest.approx(np.hypot(*(path.position(at_m) - points).T))
    table = np.arange(0.0, path.length_m, 0.001)
    for k in range(20):  # by brute force, with the window
        inside = table[(table >= start_m[k]) & (table <= start_m[k] + WINDOW_M)]
        least = np.hypot(*(path.position(inside) - points[k]).T).min(initial=np.inf)
        assert gap_m[k] == pytest.approx(least, abs=0.011) or k == 19
