"""Whether measured poses agree with the joints: turning, sideways swing, axes and scale.

Slip hardly changes how the head turns and swings, so they are compared with dead reckoning. The way
that a body travels depends on the ground, and shows nothing about the source.
"""

from collections import deque
from typing import NamedTuple

import numpy as np

from snakewalk.config.arrays import Floats
from snakewalk.controller.pose.motion_history import Moment
from snakewalk.controller.pose.tracked_body import HeadMeasurement
from snakewalk.drivers.attitude import heading_of

WINDOW_S = 4.0
"""Duration of a comparison, one to two waves of a walk (ours)."""
LEAST_S = 2.5
"""Least time that is compared."""
SAMPLE_S = 0.04
JUDGE_S = 0.5
"""Time between two samples and between two judgements."""
DOUBT_S = 3.0
"""Longest time for which a body may move without agreement (ours)."""
NAMED_S = 1.5
"""Longest time for which a body may move with a contradiction that has a name (ours)."""
CAUTIOUS_S = 8.0
"""Longest time for which a run moves slowly before the first agreement (ours)."""
LEAST_UP = 0.7
"""Least cosine between the head's up axis and the vertical (ours)."""
LEAST_TURN_RAD = 0.12
LEAST_SWING_M = 0.025
"""Root mean square turning and swing below which a window shows nothing (ours)."""
QUIET_SHARE = 0.5
"""Share of the time that counts as doubt while turns agree, and the swing is too small (ours)."""
SHARE = 0.8
"""Least correlation of turns that agree (ours)."""
TURNS = (0.6, 1.5)
"""Measured over expected turning that agrees: 0.84 to 1.23 in 13 walks of sound sources."""
SCALES = (0.6, 1.5)
"""Measured over expected swing that agrees on a floor: 0.74 to 1.29 in five walks."""
SCALES_FLOOR = (0.8, 1.25)
"""The same on a floor, as the median of ``WINDOWS`` windows: within 0.04 of 1 in five walks."""
SCALES_HILLS = (0.5, 1.7)
"""Measured over expected swing that agrees on hills, as the median of ``WINDOWS`` windows: dead
reckoning knows no hills, and single windows of sound sources have 0.57 to 1.75."""
TURNED_DEG = 45.0
"""Direction of the swing beyond which the frame is turned (ours)."""
UNIT = 20.0
"""Least ratio of measured to expected swing that shows another unit (ours)."""
WINDOWS = 5
"""Windows before the scale is judged on hills, or its accuracy stated (ours)."""
ENDS = 8
"""Samples at each end of a window whose mean is a place."""
STEP_RAD = 0.12
STEP_ROWS = 10
"""Least step of the heading that a frame or a marker made, and number of samples whose mean is
compared with that of the samples before: 0.10 rad in a sound walk (ours)."""
SCALE_SD = 0.02
"""Least standard deviation of the scale (ours)."""
SCALE_FLAT = 0.05
SCALE_HILLS = 0.3
"""Difference of the swing of a sound source from the expected one, on a floor and on hills: means
of 13 walks are within 0.04 and 0.2."""


class Agreement:
    """Call ``add`` with each measurement, in order of time."""

    def __init__(self, *, is_level: bool = True) -> None:
        """Prepare; ``is_level`` says that the ground is a floor."""
        self._is_level = is_level
        self._allowed = SCALE_FLAT if is_level else SCALE_HILLS
        self._rows: deque[_Row] = deque()
        self._scales: list[float] = []
        self._judged_s = self._scaled_s = -np.inf
        self._doubt_s = self._seconds = 0.0
        self._named: str | None = None
        self.scale_sd = self._allowed
        """Standard deviation of the source's scale, over 1."""
        self._aside_m = 0j
        self._summed_s = self._untimed_s = -np.inf
        self._begun_s = np.inf
        self.step_rad = 0.0
        """Largest step of the heading of poses, by which the joints did not turn; 0 on hills."""
        self.has_agreed = False
        """Whether the source ever agreed with the joints."""

    @property
    def fault(self) -> str | None:
        """Contradiction between source and joints; None while they agree."""
        if self._named is not None and self._doubt_s >= NAMED_S and not self.has_agreed:
            return self._named
        if self._doubt_s < DOUBT_S:
            return None
        why = self._named or (
            "it does not turn as the joints turn the head; check that it is this robot, and that "
            "the tracked body is fixed to its link"
        )
        begun = "it agreed with the joints before, but not" if self.has_agreed else "not confirmed"
        return f"unconfirmed pose: {begun} for {self._doubt_s:.1f} s of motion: {why}"

    @property
    def is_confirmed(self) -> bool:
        """Whether the source has agreed with the joints, and does not contradict them since."""
        return self.has_agreed and self._doubt_s < NAMED_S

    @property
    def aside_m(self) -> float:
        """How far the poses went aside in all, though the joints did not; 0 on hills.

        A body on a floor goes aside by at most 3 cm in a window; a source may drift.
        """
        return abs(self._aside_m)

    @property
    def is_cautious(self) -> bool:
        """Whether the run should move slowly until the source has agreed."""
        return not self.has_agreed and self._seconds < CAUTIOUS_S

    def _note_scale(self, scale: float) -> None:
        self._scales.append(scale)
        if len(self._scales) < WINDOWS:
            return
        scales = np.array(self._scales)
        spread = float(scales.std(ddof=1)) / np.sqrt(len(scales))
        over = max(abs(float(np.median(scales)) - 1.0) - self._allowed, 0.0)
        self.scale_sd = float(np.hypot(max(spread, SCALE_SD), over))

    def forget(self) -> None:
        """Begin again after a body moved without its joints; ``has_agreed`` stays."""
        self._rows.clear()
        self._doubt_s = 0.0
        self._named = None

    def add(self, measured: HeadMeasurement, then: Moment, *, is_timed: bool = True) -> None:
        """Compare a measurement with those before; a head that lies on its side shows nothing.

        Unless the delay of the source is known (``is_timed``), a turning head looks like a step.
        """
        if measured.rotation[2, 2] < LEAST_UP:
            self._rows.clear()
            return
        rows = self._rows
        time_s = then.time_s
        if rows and time_s - rows[-1].time_s < SAMPLE_S:
            return
        if rows and time_s - rows[-1].time_s > JUDGE_S:
            rows.clear()
        if not is_timed:
            self._untimed_s = time_s
        self._begun_s = min(self._begun_s, time_s)
        self._seconds = time_s - self._begun_s
        seen_rad = heading_of(measured.rotation)
        place_m, predicted_m = complex(*measured.position_m[:2]), complex(*then.place[:2])
        rows.append(_Row(time_s, place_m, seen_rad, predicted_m, float(then.place[2])))
        while time_s - rows[0].time_s > WINDOW_S:
            rows.popleft()
        if time_s - rows[0].time_s >= LEAST_S and time_s - self._judged_s >= JUDGE_S:
            self._judged_s = time_s
            self._judge()

    def _judge(self) -> None:
        columns = (np.array(column) for column in zip(*self._rows, strict=True))
        times, measured_m, measured_rad, predicted_m, predicted_rad = columns
        line = np.column_stack([np.ones(len(times)), times - times.mean()])
        predicted_rad, measured_rad = np.unwrap(predicted_rad), np.unwrap(measured_rad)
        expected = _detrended_values(predicted_rad, line)
        turns = _detrended_values(measured_rad, line)
        if np.sqrt(np.mean(expected**2)) < LEAST_TURN_RAD:
            return
        share = float(turns @ expected / (expected @ expected))
        related = float(expected @ turns) / _size(expected, turns)
        off_rad = measured_rad - predicted_rad
        means_rad = np.convolve(off_rad, np.full(STEP_ROWS, 1.0 / STEP_ROWS), "valid")
        step_rad = float(np.abs(means_rad[STEP_ROWS:] - means_rad[:-STEP_ROWS]).max(initial=0.0))
        if self._is_level and step_rad > STEP_RAD and times[0] > self._untimed_s:
            self.step_rad = max(self.step_rad, step_rad)
        slow_rad = off_rad - _detrended_values(off_rad, line)
        steps = np.diff(predicted_m) * np.exp(1j * slow_rad[:-1])
        way_m = np.concatenate([[0.0], np.cumsum(steps)])
        swing = _detrended_values(way_m, line)
        if self._is_level and times[-1] - self._summed_s >= WINDOW_S:
            self._summed_s = times[-1]
            ahead_m = _travel(way_m)
            off = (_travel(measured_m) - ahead_m) / (ahead_m or 1.0)
            self._aside_m += 1j * off.imag * ahead_m
        shape = _detrended_values(measured_m, line)
        named = _mirrored_swing(related, shape, swing)
        swings = related > SHARE and np.sqrt(np.mean(np.abs(swing) ** 2)) >= LEAST_SWING_M
        is_alike = swings and abs(np.vdot(swing, shape)) > SHARE * _size(swing, shape)
        if is_alike and named is None:
            named = self._swing_fault(shape, swing, times[-1])
        agrees = named is None and related > SHARE and TURNS[0] < share < TURNS[1]
        doubt_s = JUDGE_S if swings or not agrees else QUIET_SHARE * JUDGE_S
        if named is None and not is_alike and (self._named or not self.has_agreed):
            if agrees and self._named is None and self.is_cautious and not self._is_level:
                return  # hills may hide the swing for a while
            named = self._named  # a window without a swing clears nothing
            agrees = False
        self._named = named
        self._doubt_s = 0.0 if agrees else self._doubt_s + doubt_s
        self.has_agreed |= agrees

    def _swing_fault(self, shape: Floats, swing: Floats, time_s: float) -> str | None:
        """Return what is wrong with direction or size of a measured swing; None if nothing is."""
        same = np.vdot(swing, shape) / np.vdot(swing, swing).real
        angle_deg = np.degrees(np.angle(same))
        if abs(angle_deg) > TURNED_DEG:
            return (
                f"wrong frame: the head moves {angle_deg:+.0f} degrees off the direction "
                "that it points to; correct pose.offset_deg or the source's axes"
            )
        scale = float(abs(same))
        if time_s - self._scaled_s >= WINDOW_S:  # windows that do not overlap
            self._scaled_s = time_s
            self._note_scale(scale)
        if len(self._scales) < WINDOWS:
            low, high = SCALES if self._is_level else (0.0, UNIT)
        else:
            low, high = SCALES_FLOOR if self._is_level else SCALES_HILLS
            scale = float(np.median([*self._scales, scale][-WINDOWS:]))
        if low < scale < high:
            return None
        return (
            f"wrong scale: the head swings {scale:.2f} times as far as its joints say; correct "
            "pose.scale, or the robot's link_length_m"
        )


class _Row(NamedTuple):
    time_s: float
    measured_m: complex
    measured_rad: float
    predicted_m: complex
    predicted_rad: float


def _mirrored_swing(related: float, shape: Floats, swing: Floats) -> str | None:
    if related < -SHARE:
        return (
            "mirrored axes: the head turns the other way than its joints say; send a "
            "right-handed frame, z up"
        )
    size = _size(shape, swing)
    mirrored = abs(np.vdot(swing.conj(), shape))
    if mirrored > SHARE * size > abs(np.vdot(swing, shape)) + 0.2 * size:
        return (
            "mirrored axes: the head moves to the other side than its joints say; send a "
            "right-handed frame, z up"
        )
    return None


def _travel(places_m: Floats) -> complex:
    """Return the way from the first places (n,) to the last ones, without most of their noise."""
    return complex(np.mean(places_m[-ENDS:]) - np.mean(places_m[:ENDS]))


def _size(a: Floats, b: Floats) -> float:
    return float(np.linalg.norm(a) * np.linalg.norm(b)) or 1.0


def _detrended_values(values: Floats, line: Floats) -> Floats:
    """Return values (n,), real or complex, without their straight line (n, 2)."""
    return np.asarray(values - line @ np.linalg.lstsq(line, values)[0])
