"""The pose of a chain of known shape from the detected line of its body.

The joints are measured, so only place and heading are unknown. The link centres by forward
kinematics are fitted to the line by Procrustes' rigid fit, evenly spaced from its middle. The
middle may shift slightly: a tip that is hidden or sticks out moves it.
"""

from dataclasses import dataclass

import numpy as np

from snakewalk.config.arrays import Floats
from snakewalk.config.robot import RobotConfig
from snakewalk.controller.kinematics.arc_length import arc_lengths
from snakewalk.controller.kinematics.links import body_in_world, pose_at
from snakewalk.drivers.attitude import heading_of
from snakewalk.drivers.least_squares import least_squares

_ROUNDS = 5
_BLUR_M = 0.003
"""Usual error of a link's place on the line."""
_TIPS_M = 0.02
"""Largest distance of the line's middle from the body's."""
_STIFF = _BLUR_M / _TIPS_M  # keeps the total slide near 0, not one step
_COMMON_ERROR = 0.2  # share of a link's variance common to all links (ours)
_REGULAR = 3e-5  # limits slide and shift of a straight body, which are equivalent


@dataclass(frozen=True, slots=True)
class PoseFit:
    """One fit of the chain to the line."""

    head_m: Floats
    """(2,) centre of the head link."""
    heading_rad: float
    """Heading of the head link, in (-pi, pi]."""
    links_m: Floats
    """(L, 2) centres of the links as fitted."""
    error_m: float
    """Root of the mean square distance of the links from their places on the line."""
    covariance: Floats
    """(3, 3) of the head's x, y (m) and of its heading (rad)."""


def fit_both_ends(robot: RobotConfig, line_m: Floats, joint_rad: Floats) -> tuple[PoseFit, PoseFit]:
    """Fit with the line's first end as the head, and with its last end.

    ``line_m`` (P, 2) is from tip to tip; ``joint_rad`` (J,) were measured at its time.
    """
    body = body_in_world(robot, pose_at(np.zeros(2), 0.0), joint_rad)
    links = body.link_m[:, :2]
    return _fit(robot, line_m, links), _fit(robot, line_m[::-1], links)


def _fit(robot: RobotConfig, line_m: Floats, links: Floats) -> PoseFit:
    arc = arc_lengths(line_m)
    ends = np.array(robot.link_ends)
    number = 0.5 * (ends[:-1] + ends[1:]) - 0.5 * len(links)
    middle_m = 0.5 * arc[-1] + number * robot.mean_link_length_m
    weight = np.ones(len(links))
    shift_along_m = 0.0
    for _ in range(_ROUNDS):
        line, ahead = _places_along_line(line_m, arc, middle_m + shift_along_m)
        turn, shift = _rigid(links, line, weight)
        turned = _turned_points(links, turn)
        away = line - turned - shift
        size = np.hypot(*away.T)
        usual = 1.4826 * float(np.median(size)) + 1e-4
        weight = 1.0 / np.maximum(1.0, size / (1.5 * usual))  # Huber
        shift_along_m += _shift_along(turned, ahead, away, weight, shift_along_m)
    error_m = float(np.sqrt((size * size).mean()))
    return PoseFit(
        shift,
        heading_of(turn),
        turned + shift,
        error_m,
        _covariance(turned, ahead, weight, error_m),
    )


def _places_along_line(line_m: Floats, arc: Floats, along: Floats) -> tuple[Floats, Floats]:
    """Places (L, 2) on the line and its directions; straight beyond its ends."""
    k = np.clip(np.searchsorted(arc, along), 1, len(arc) - 1)
    step = line_m[k] - line_m[k - 1]
    ahead = step / np.maximum(arc[k] - arc[k - 1], 1e-9)[:, None]
    return line_m[k - 1] + (along - arc[k - 1])[:, None] * ahead, ahead


def _shift_along(
    links: Floats, ahead: Floats, away: Floats, weight: Floats, shifted_m: float
) -> float:
    """Additional slide of the links along the line, from the body's bends.

    One least squares step for slide, shift and turn. Lost or protruding tips move the middle by a
    few millimetres; a straight body keeps it.
    """
    matrix = _motions(links, ahead, weight)
    target = np.append(away.ravel() * np.sqrt(np.repeat(weight, 2)), -_STIFF * shifted_m)
    return float(least_squares(matrix, target, np.full(4, _REGULAR))[3])


def _motions(links: Floats, ahead: Floats, weight: Floats) -> Floats:
    """(2 L + 1, 4) weighted motion of the links for a shift, a turn and a slide."""
    count = len(links)
    ones = np.ones(count)
    none = np.zeros(count)
    columns = [
        np.stack([ones, none], axis=1),
        np.stack([none, ones], axis=1),
        np.stack([-links[:, 1], links[:, 0]], axis=1),
        -ahead,
    ]
    row = np.sqrt(np.repeat(weight, 2))
    matrix = np.stack([column.ravel() for column in columns], axis=1) * row[:, None]
    return np.vstack([matrix, [0.0, 0.0, 0.0, _STIFF]])


def _covariance(links: Floats, ahead: Floats, weight: Floats, error_m: float) -> Floats:
    """(3, 3) of the head's place and heading; ``links`` (L, 2) are relative to the head."""
    matrix = _motions(links, ahead, weight)
    error_m = max(error_m, 0.5 * _BLUR_M)
    turn = 12.0 * _COMMON_ERROR / float(np.square(links[-1] - links[0]).sum() + 1e-9)
    least = error_m * error_m * np.diag([_COMMON_ERROR, _COMMON_ERROR, turn])
    return error_m * error_m * np.linalg.inv(matrix.T @ matrix)[:3, :3] + least


def _rigid(links: Floats, line: Floats, weight: Floats) -> tuple[Floats, Floats]:
    """Least squares rotation (2, 2) and shift (2,) of ``links`` to ``line``."""
    share = weight / weight.sum()
    a, b = (share[:, None] * links).sum(axis=0), (share[:, None] * line).sum(axis=0)
    p, q = links - a, line - b
    sin = float((share * (p[:, 0] * q[:, 1] - p[:, 1] * q[:, 0])).sum())
    cos = float((share * (p * q).sum(axis=1)).sum())
    size = float(np.hypot(sin, cos)) or 1.0
    turn = np.array([[cos, -sin], [sin, cos]]) / size
    return turn, b - _turned_points(a, turn)


def _turned_points(points: Floats, turn: Floats) -> Floats:
    """Points (..., 2) after ``turn`` (2, 2): ``points @ turn.T`` with a fixed order of sums."""
    return points[..., :1] * turn[:, 0] + points[..., 1:] * turn[:, 1]
