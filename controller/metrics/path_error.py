"""Path error: waypoints reached in order, and distance of the body from its path."""

from functools import partial
from itertools import pairwise, starmap

import numpy as np
import scipy  # its modules load when they are first used

from snakewalk.config.arrays import Floats
from snakewalk.controller.runlog.column import by_rows
from snakewalk.controller.runlog.record import PlanSummary, RunRecord
from snakewalk.controller.runlog.topics import PoseTable

_WINDOW_M = 0.5  # around the place reached, so that a crossing branch is not the nearest
_ROUNDING_M = 2e-6  # of the log
_TRACK_S = 0.2
_SMOOTH_S = 2.0


def waypoint_times_s(pose: PoseTable, plan: PlanSummary) -> Floats:
    """Find the times (k,) at which the centre of mass came to the waypoints, in order, k <= w."""
    times: list[float] = []
    first = 0
    for k, waypoint in enumerate(plan.waypoints_m):
        if plan.set_s is not None:
            first = max(first, int(np.searchsorted(pose.time_s, plan.set_s[k])))
        far = np.hypot(*(pose.centre_m[first:, :2] - waypoint).T)
        inside = np.flatnonzero(far <= plan.waypoint_radius_m + _ROUNDING_M)
        if len(inside) == 0:
            break
        first += int(inside[0])
        times.append(float(pose.time_s[first]))
    return np.array(times)


def path_error_m(record: RunRecord) -> Floats:
    """Distance (P,) of the centre of mass from the path then in force, in the horizontal plane.

    A path that is laid again within a cycle holds for the pose of this cycle, whose place on the
    path is one on the new path already. NaN for a run without waypoints: its plan has no path.
    """
    pose = record.pose
    if len(record.header.plan.waypoints_m) == 0:
        return np.full(len(pose.time_s), np.nan)
    until_s = np.append(pose.time_s, np.inf)[1:]
    starts = np.searchsorted(until_s, [start for start, _ in record.paths], side="right")
    error = np.full(len(pose.time_s), np.nan)
    for rows, (_, path) in zip(
        starmap(slice, pairwise([*starts, None])), record.paths, strict=True
    ):
        error[rows] = distance_m(pose.centre_m[rows, :2], path[:, :2], pose.path_s_m[rows])
    return error


def distance_m(points_m: Floats, path_m: Floats, along_m: Floats) -> Floats:
    """Distance (n,) of points (n, 2) from a polyline (m, 2) near arc lengths ``along_m`` (n,).

    The path is taken to come straight to its start: a body that lies behind it is not off it.
    Where ``along_m`` is NaN the whole path is searched.
    """
    return np.asarray(by_rows(partial(_distance_m, path_m), points_m, along_m))


def _distance_m(path_m: Floats, points_m: Floats, along_m: Floats) -> Floats:
    step = np.diff(path_m, axis=0)
    length = np.hypot(*step.T)
    has_length = length > 1e-9
    if not has_length.any():
        return np.asarray(np.hypot(*(points_m - path_m[0]).T))
    a = path_m[:-1][has_length]
    step = step[has_length]
    length = length[has_length]
    end = np.cumsum(length)
    t = np.einsum("nmi,mi->nm", points_m[:, None] - a, step) / length**2
    low = np.zeros(len(a))
    low[0] = -np.inf
    foot = a + np.clip(t, low, 1.0)[..., None] * step
    gap = np.hypot(*np.moveaxis(points_m[:, None] - foot, -1, 0))
    clipped_m = np.clip(along_m, 0.0, end[-1])[:, None]
    far = (end < clipped_m - _WINDOW_M) | (end - length > clipped_m + _WINDOW_M)  # False where NaN
    return np.asarray(np.where(far, np.inf, gap).min(axis=1))


def travelled_m(pose: PoseTable, first: int = 0, last: int = -1) -> float:
    """Length of the track of the centre of mass in the horizontal plane, from row to row.

    The track is ``smooth_track_m``, sampled every 0.2 s.
    """
    time_s = pose.time_s
    if len(time_s) == 0:
        return 0.0
    due_s = np.arange(time_s[first], time_s[last] - 0.5 * _TRACK_S, _TRACK_S)
    rows = np.append(np.searchsorted(time_s, due_s), last)
    return length_m(smooth_track_m(pose)[rows])


def ground_speed_m_s(pose: PoseTable) -> Floats:
    """Speed (P,) of the centre of mass over the ground, mean of the last 2 s; NaN else."""
    time_s = pose.time_s
    row = np.searchsorted(time_s, time_s - _SMOOTH_S)
    span_s = row.clip(0, 1) * (time_s - time_s[row])
    span_s[span_s == 0.0] = np.nan
    return np.asarray(np.hypot(*(pose.centre_m - pose.centre_m[row]).T[:2]) / span_s)


def smooth_track_m(pose: PoseTable) -> Floats:
    """Return the track of the centre of mass (P, 3) without the noise of single poses.

    Parabolas are fitted to it over 2 s (Savitzky and Golay 1964). Noise of 1 cm and 3 degrees in
    every pose makes it 0.5 to 2.4 % longer than without noise; over 1 s it was 0.8 to 3.3 %
    (measured on rehearsals of six runs). Without noise both windows give the same length to 0.5 %.
    """
    time_s = pose.time_s
    centre_m = pose.centre_m
    is_known = np.isfinite(centre_m).all(axis=1)
    if is_known.sum() < 3:
        return centre_m
    step_s = float(np.median(np.diff(time_s[is_known])))
    even_s = np.arange(time_s[is_known][0], time_s[is_known][-1] + 0.5 * step_s, step_s)
    window = min(2 * round(0.5 * _SMOOTH_S / step_s) + 1, (len(even_s) - 1) // 2 * 2 + 1)
    if window <= 3:
        return centre_m
    smooth = centre_m.copy()
    for axis in range(3):
        even_m = np.interp(even_s, time_s[is_known], centre_m[is_known, axis])
        smooth[is_known, axis] = np.interp(
            time_s[is_known], even_s, fitted_parabolas(even_m, window)
        )
    return smooth


def fitted_parabolas(values: Floats, window: int) -> Floats:
    """Return the values (n,) of parabolas fitted to ``window`` values around each, an odd number.

    Near the ends it is the parabola of the first or last window. Equal to the bit to the result of
    ``scipy.signal.savgol_filter``, whose import needs a second of CPU time and 23 MB.
    """
    half = window // 2
    offsets = np.arange(half, -half - 1, -1, dtype=float)
    powers = offsets ** np.arange(3.0)[:, None]
    limit = np.finfo(float).eps * window
    weights = scipy.linalg.lstsq(powers, np.array([1.0, 0.0, 0.0]), cond=limit)[0]
    fitted = scipy.ndimage.convolve1d(values, weights, mode="constant")
    places = np.arange(window, dtype=float)
    first, last = (_parabola(places, some) for some in (values[:window], values[-window:]))
    fitted[:half], fitted[-half:] = first[:half], last[-half:]
    return fitted


def _parabola(places: Floats, values: Floats) -> Floats:
    """Values at ``places`` of the parabola that fits ``values`` there best."""
    powers = np.vander(places, 3)
    scale = np.sqrt((powers * powers).sum(axis=0))
    limit = np.finfo(float).eps * len(places)
    a, b, c = scipy.linalg.lstsq(powers / scale, values[:, None], cond=limit)[0][:, 0] / scale
    return np.asarray((a * places + b) * places + c)


def length_m(path_m: Floats) -> float:
    """Length of a polyline (m, 2 or 3) in the horizontal plane."""
    return float(np.hypot(*np.diff(path_m[:, :2], axis=0).T).sum())
