"""Where a chain of known shape lies, from a line seen of its body.

The joints are measured, so only place and heading are open: the link centres by forward kinematics
are laid on the seen line, at equal ways from its middle, by Procrustes' rigid fit.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from config.robot import RobotConfig
from controller.runtime.body import body_in_world
from controller.runtime.forecast import pose_at

Floats = NDArray[np.float64]
_ROUNDS = 4


@dataclass(frozen=True, slots=True)
class PoseFit:
    """One way to lay the chain on the line."""

    head_m: Floats
    """(2,) centre of the head link."""
    heading_rad: float
    """Of the head link, in (-pi, pi]."""
    links_m: Floats
    """(L, 2) centres of the links as fitted."""
    error_m: float
    """Root of the mean square distance of the links from their places on the line."""


def both_ways(robot: RobotConfig, line_m: Floats, joint_rad: Floats) -> tuple[PoseFit, PoseFit]:
    """Fit with the line's first end as the head, and with its last end.

    Args:
        robot: its links.
        line_m: (P, 2) from tip to tip.
        joint_rad: (J,) measured when the line was seen.

    """
    body = body_in_world(robot, pose_at(np.zeros(2), 0.0), joint_rad)
    links = body.link_m[:, :2]
    return _fit(robot, line_m, links), _fit(robot, line_m[::-1], links)


def _fit(robot: RobotConfig, line_m: Floats, links: Floats) -> PoseFit:
    arc = np.concatenate([[0.0], np.hypot(*np.diff(line_m, axis=0).T).cumsum()])
    number = np.arange(len(links)) - 0.5 * (len(links) - 1)
    at = 0.5 * arc[-1] + number * robot.link_length_m
    seen = np.column_stack([np.interp(at, arc, axis) for axis in line_m.T])
    weight = np.ones(len(links))
    for _ in range(_ROUNDS):
        turn, shift = _rigid(links, seen, weight)
        away = np.hypot(*(links @ turn.T + shift - seen).T)
        usual = 1.4826 * float(np.median(away)) + 1e-4
        weight = 1.0 / np.maximum(1.0, away / (1.5 * usual))  # Huber
    return PoseFit(
        shift,
        float(np.arctan2(turn[1, 0], turn[0, 0])),
        links @ turn.T + shift,
        float(np.sqrt((away * away).mean())),
    )


def _rigid(links: Floats, seen: Floats, weight: Floats) -> tuple[Floats, Floats]:
    """Turn (2, 2) and shift (2,) that lay ``links`` on ``seen`` with the least squares."""
    share = weight / weight.sum()
    a, b = share @ links, share @ seen
    p, q = links - a, seen - b
    sin = float(share @ (p[:, 0] * q[:, 1] - p[:, 1] * q[:, 0]))
    cos = float(share @ (p * q).sum(axis=1))
    size = float(np.hypot(sin, cos)) or 1.0
    turn = np.array([[cos, -sin], [sin, cos]]) / size
    return turn, b - turn @ a
