"""Latency of a camera's frames, from the joints' motion.

The body's shape in a frame is compared with the joints' shape at earlier times. The shape is that
of the headings along the body, minus their mean, so sliding does not matter.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from snakewalk.config.arrays import Floats
from snakewalk.config.robot import RobotConfig
from snakewalk.controller.cameras.overhead_camera import LineDetection
from snakewalk.controller.kinematics.arc_length import arc_lengths
from snakewalk.controller.kinematics.links import body_in_world, pose_at

_EARLIEST_S, _LATEST_S, _STEP_S = -0.1, 0.6, 0.005
_PARTS = 4  # of the record, whose latencies give the error
_LEAST_SAMPLES = 30  # frames, and joint reads
_LEAST_MOTION_RAD = 0.03  # standard deviation of a heading: less is picture noise (ours)
_LEAST_LIKENESS = 0.7  # least credible correlation (ours)


@dataclass(frozen=True, slots=True)
class LatencyFit:
    """Latency of frames."""

    latency_s: float
    error_s: float
    """Standard error, from parts of the record."""
    correlation: float
    """Correlation of the shapes' changes."""
    fault: str = ""
    """Reason for rejecting the latency; empty if it is valid."""


_NO_FIT = LatencyFit(float("nan"), float("nan"), float("nan"))


def fit_latency(
    robot: RobotConfig, lines: Sequence[LineDetection], joint_s: Floats, joint_rad: Floats
) -> LatencyFit:
    """Find the delay at which the visible body has the shape of the joints.

    Args:
        robot: its links.
        lines: the body's line in frames, with times of receipt.
        joint_s: (T,) times of the joint reads.
        joint_rad: (T, J) their angles; rows with NaN are dropped.

    """
    is_complete = np.isfinite(joint_rad).all(axis=1)
    joint_s, joint_rad = joint_s[is_complete], joint_rad[is_complete]
    finite_lines = [line for line in lines if np.isfinite(line.line_m).all()]
    if min(len(finite_lines), len(joint_s)) < _LEAST_SAMPLES:
        return replace(
            _NO_FIT,
            fault=f"the complete body was seen in {len(finite_lines)} frames, its joints were read "
            f"{len(joint_s)} times; {_LEAST_SAMPLES} are needed of each",
        )
    origin = pose_at(np.zeros(2), 0.0)
    bodies = [body_in_world(robot, origin, joint_row).headings_rad for joint_row in joint_rad]
    headings_rad = np.unwrap(np.unwrap(np.array(bodies), axis=1), axis=0)
    headings_rad -= headings_rad.mean(axis=1, keepdims=True)
    if headings_rad.std(axis=0).max() < _LEAST_MOTION_RAD:
        return replace(_NO_FIT, fault="the joints did not move: turn one to and fro, unevenly")
    frame_s = np.array([line.time_s for line in finite_lines])
    delays = np.arange(_EARLIEST_S, _LATEST_S + 1e-9, _STEP_S)
    inside = (frame_s - _LATEST_S >= joint_s[0]) & (frame_s - _EARLIEST_S <= joint_s[-1])
    if inside.sum() < _LEAST_SAMPLES:
        return replace(_NO_FIT, fault="the check was too short: frames and joints hardly overlap")
    frame_s = frame_s[inside]
    expected = np.stack(
        [
            np.stack(
                [
                    np.interp(frame_s - delay, joint_s, heading_column)
                    for heading_column in headings_rad.T
                ],
                axis=1,
            )
            for delay in delays
        ]
    )
    lines_m = [line.line_m for line, used in zip(finite_lines, inside, strict=True) if used]
    lines_m = _same_end_first(lines_m)
    shown, delay, likeness = max(
        (
            (shape, *_best_delay(delays, expected, shape))
            for shape in (_shapes(robot, lines_m), _shapes(robot, [line[::-1] for line in lines_m]))
        ),
        key=lambda tried: tried[2],
    )
    parts = [
        _best_delay(delays, expected[:, part], shown[part])[0]
        for part in np.array_split(np.arange(len(shown)), _PARTS)
    ]
    fit = LatencyFit(delay, float(np.std(parts, ddof=1) / np.sqrt(_PARTS)), likeness)
    if likeness < _LEAST_LIKENESS:
        return replace(fit, fault="the body in the picture does not move as the joints do")
    if not delays[0] < delay < delays[-1]:
        return replace(fit, fault=f"it is beyond {1e3 * _LATEST_S:.0f} ms")
    return fit


def _same_end_first(lines_m: Sequence[Floats]) -> list[Floats]:
    """Lines (P, 2) that begin at the same end as the first: tips move little."""
    ordered_lines = [lines_m[0]]
    for line in lines_m[1:]:
        off = [
            np.hypot(*(line_order[[0, -1]] - ordered_lines[-1][[0, -1]]).T).sum()
            for line_order in (line, line[::-1])
        ]
        ordered_lines.append(line if off[0] <= off[1] else line[::-1])
    return ordered_lines


def _shapes(robot: RobotConfig, lines_m: Sequence[Floats]) -> Floats:
    """(F, L) headings of the links along lines (P, 2) from the head, minus their mean."""
    share = np.array(robot.link_ends) / robot.link_ends[-1]
    shapes = []
    for line in lines_m:
        arc = arc_lengths(line)
        ends = np.stack([np.interp(share * arc[-1], arc, axis) for axis in line.T], axis=1)
        ahead = ends[:-1] - ends[1:]  # from the tail to the head
        heading = np.unwrap(np.arctan2(ahead[:, 1], ahead[:, 0]))
        shapes.append(heading - heading.mean())
    return np.array(shapes)


def _best_delay(delays: Floats, expected: Floats, shown: Floats) -> tuple[float, float]:
    """Delay with the best correlation of the changes (to a fraction of a step), and that."""
    deviation = (expected - expected.mean(axis=1, keepdims=True)).reshape(len(delays), -1)
    two = (shown - shown.mean(axis=0)).ravel()
    size = np.sqrt((deviation**2).sum(axis=1) * (two**2).sum())
    likeness = deviation @ two / np.maximum(size, 1e-12)
    k = int(likeness.argmax())
    if not 0 < k < len(delays) - 1:
        return float(delays[k]), float(likeness[k])
    low, top, high = likeness[k - 1 : k + 2]
    bend = low - 2.0 * top + high
    part = 0.0 if bend >= 0.0 else 0.5 * (low - high) / bend
    return float(delays[k] + part * _STEP_S), float(top)
