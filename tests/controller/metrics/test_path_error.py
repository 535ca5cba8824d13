"""Path error, waypoints and lengths against closed forms."""

import dataclasses

import numpy as np
import pytest
import scipy.signal

from snakewalk.controller.metrics.path_error import (
    distance_m,
    fitted_parabolas,
    ground_speed_m_s,
    length_m,
    path_error_m,
    smooth_track_m,
    travelled_m,
    waypoint_times_s,
)
from snakewalk.controller.runlog.record import PlanSummary, RunRecord
from snakewalk.controller.runlog.topics import PoseTable

UNKNOWN = np.array([np.nan])


def pose_along(points: np.ndarray, times: np.ndarray, along: np.ndarray | None = None) -> PoseTable:
    n = len(points)
    nan = np.full(n, np.nan)
    flat = np.column_stack([points, np.zeros(n)])
    links = np.full((n, 17, 3), np.nan)
    target = np.zeros(n, dtype=np.int64)
    s = nan if along is None else along
    eye = np.tile(np.eye(3), (n, 1, 1))
    return PoseTable(times, flat, eye, links, flat, nan, nan, nan, s, target)


@pytest.mark.parametrize("radius", [0.8, 1.0, 1.3])
def test_a_circle_beside_a_circle(radius: float) -> None:
    phi = np.linspace(0.0, 2 * np.pi, 721)
    path = np.column_stack([np.cos(phi), np.sin(phi)])
    at = np.linspace(0.3, 5.9, 400)
    points = radius * np.column_stack([np.cos(at), np.sin(at)])
    error = distance_m(points, path, at)
    assert error == pytest.approx(abs(radius - 1.0), abs=2e-5)


def test_only_the_start_goes_on_straight() -> None:
    path = np.array([[0.0, 0.0], [1.0, 0.0], [2.0, 0.0]])
    points = np.array([[-0.6, 0.1], [-3.0, 0.0], [2.3, -0.4], [1.0, 0.3]])
    along = np.array([0.0, 0.0, 2.0, 1.0])
    assert distance_m(points, path, along) == pytest.approx([0.1, 0.0, 0.5, 0.3])


def test_a_crossing_branch_is_not_the_way() -> None:
    path = np.array([[0.0, 0.0], [4.0, 0.0], [4.0, 2.0], [2.0, 2.0], [2.0, -2.0]])
    crossing = np.array([[2.0, 0.4]])  # near the last branch too
    assert distance_m(crossing, path, np.array([2.0])) == pytest.approx(0.4)
    assert distance_m(crossing, path, UNKNOWN) == pytest.approx(0.0)


def test_a_path_of_one_place() -> None:
    assert distance_m(np.array([[3.0, 4.0]]), np.zeros((2, 2)), UNKNOWN) == pytest.approx(5.0)


def test_a_body_that_goes_sideways_has_the_speed_of_its_centre() -> None:
    """The speed of the links along themselves is 0 there: it is no speed over the ground."""
    times = np.linspace(0.0, 5.0, 251)
    points = np.column_stack([0.1 * times, 0.2 * times])
    speed_m_s = ground_speed_m_s(pose_along(points, times))
    assert np.isnan(speed_m_s).tolist() == (times <= 2.0).tolist()
    assert speed_m_s[times > 2.0] == pytest.approx(np.hypot(0.1, 0.2))
    assert ground_speed_m_s(pose_along(points[:0], times[:0])).shape == (0,)


def test_the_first_pose_after_a_long_gap_has_no_speed() -> None:
    times = np.r_[np.linspace(0.0, 3.0, 31), 6.0, 6.1]
    speed_m_s = ground_speed_m_s(pose_along(np.column_stack([0.1 * times, 0.0 * times]), times))
    assert np.flatnonzero(np.isnan(speed_m_s[30:])).tolist() == [1]
    assert speed_m_s[32] == pytest.approx(0.1)


def test_lengths() -> None:
    phi = np.linspace(0.0, np.pi, 5000)
    half = np.column_stack([np.cos(phi), np.sin(phi), 3.0 * phi])
    assert length_m(half) == pytest.approx(np.pi, rel=1e-6)
    assert travelled_m(pose_along(half[:, :2], 20.0 * phi)) == pytest.approx(np.pi, rel=1e-4)


def test_waypoints_count_in_their_order_only() -> None:
    t = np.linspace(0.0, 10.0, 1001)
    pose = pose_along(np.column_stack([t, np.zeros_like(t)]), t)
    path = np.array([[0.0, 0.0], [10.0, 0.0]])
    for points, expected in (
        ([[2.0, 0.0], [6.0, 0.3]], [1.5, 5.6]),  # 0.3 aside: 0.4 before
        ([[6.0, 0.0], [2.0, 0.0]], [5.5]),  # passed before its turn
        ([[2.0, 0.6]], []),
    ):
        plan = PlanSummary(path, np.array(points), 0.5)
        assert waypoint_times_s(pose, plan) == pytest.approx(expected, abs=0.011)
    set_later = PlanSummary(path, np.array([[6.0, 0.0]]), 0.5, set_s=np.array([6.2]))
    assert waypoint_times_s(pose, set_later) == pytest.approx([6.2], abs=0.011)


def test_a_path_laid_again_counts_from_then_on(record: RunRecord) -> None:
    t = np.linspace(0.0, 4.0, 401)
    points = np.column_stack([t, np.full_like(t, 0.5)])
    moved = dataclasses.replace(
        record,
        pose=pose_along(points, t),
        paths=(
            (0.0, np.array([[0.0, 0.0], [4.0, 0.0]])),
            (2.0, np.array([[2.0, 0.4, 1.0], [4.0, 0.4, 1.0]])),
        ),
    )
    error = path_error_m(moved)
    assert error[t < 2.0] == pytest.approx(0.5)
    assert error[t >= 2.0] == pytest.approx(0.1)


def test_a_path_laid_again_holds_for_the_cycle_that_laid_it(record: RunRecord) -> None:
    """The pose of a cycle is logged after the new path, with its place on the new path."""
    time_s = record.pose.time_s
    (start_s, path), *_ = record.paths
    far = path + np.array([0.0, 50.0])
    laid_s = 0.5 * (time_s[40] + time_s[41])
    again = dataclasses.replace(record, paths=((start_s, path), (laid_s, far)))
    assert (np.flatnonzero(path_error_m(again) > 10.0) >= 40).all()
    assert path_error_m(again)[40] > 10.0


def test_many_points_at_once_are_each_alone() -> None:
    rng = np.random.default_rng(1)
    path = np.cumsum(rng.normal(size=(40, 2)), axis=0)
    points = rng.normal(size=(50, 2)) * 3
    both = distance_m(points, path, np.full(50, np.nan))
    one = [float(distance_m(p[None], path, UNKNOWN)[0]) for p in points]
    assert both == pytest.approx(one)


@pytest.mark.parametrize("hz", [50.0, 100.0])
def test_what_the_encoders_add_to_a_track_is_no_way(hz: float) -> None:
    """Noise of half a millimetre in each cycle, as measured on a run, beside an advance of 4 mm."""
    times = np.arange(0.0, 40.0, 1.0 / hz)
    noise = np.random.default_rng(0).normal(0.0, 0.0005, (len(times), 2))
    points = np.column_stack([0.2 * times, np.zeros(len(times))]) + noise
    assert length_m(points) > 8.05
    assert travelled_m(pose_along(points, times)) == pytest.approx(0.2 * times[-1], rel=1e-3)


def test_noise_of_single_poses_does_not_lengthen_the_track() -> None:
    rng, times = np.random.default_rng(5), np.arange(0.0, 40.0, 0.02)
    turn = 0.1 * times
    circle = 2.0 * np.column_stack([np.sin(turn), 1.0 - np.cos(turn)])
    noisy = circle + rng.normal(0.0, 0.03, circle.shape)
    assert travelled_m(pose_along(circle, times)) == pytest.approx(8.0, rel=1e-3)
    assert travelled_m(pose_along(noisy, times)) == pytest.approx(8.0, rel=0.02)


def test_the_smooth_track_keeps_parabolas_and_unknown_rows() -> None:
    times = np.arange(0.0, 4.0, 0.02)
    points = np.column_stack([times, 0.1 * times**2])
    pose = pose_along(points, times)
    pose.centre_m[50] = np.nan
    smooth = smooth_track_m(pose)
    assert np.isnan(smooth[50]).all()
    known = np.isfinite(smooth[:, 0])
    assert smooth[known, :2] == pytest.approx(points[known], abs=1e-4)


@pytest.mark.parametrize(("samples", "window"), [(5, 5), (60, 51), (400, 7)])
def test_fitted_parabolas_have_the_bits_of_scipy(samples: int, window: int) -> None:
    values = np.random.default_rng(samples).normal(size=samples).cumsum()
    expected = scipy.signal.savgol_filter(values, window, 2)
    assert np.array_equal(fitted_parabolas(values, window), expected)
