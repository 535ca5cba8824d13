"""The path: exact on lines, passes through its points, keeps to its lap."""

import numpy as np
import pytest

from config.errors import InputError
from controller.terrain.path import SplinePath

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


def test_gap_is_the_distance_from_the_nearest_mark() -> None:
    path = SplinePath([(0.0, 0.0), (2.0, 1.0), (4.0, 0.0)])
    for point in np.random.default_rng(3).uniform(-1.0, 5.0, (20, 2)):
        s_m = path.nearest(point, 0.0, window_m=9.0)
        assert path.gap_m(point, s_m) == pytest.approx(np.hypot(*(path.position(s_m) - point)))
