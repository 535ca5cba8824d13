"""The pitch fit: pitch goals that follow uneven ground ([PT] 2.6.5 for a chain of links).

The ground step places the links' middle line on the ground. Pitch goals bring the link centres as
near to it as possible; the residual is the misfit. A robot without pitch joints only tilts as a
whole.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from snakewalk.config.arrays import Floats
from snakewalk.config.heightfield import HeightField
from snakewalk.config.robot import RobotConfig
from snakewalk.controller.mechanics.ground_step import GroundStep
from snakewalk.drivers.least_squares import least_squares

_REGULAR = 0.05  # of a link length: keeps goals small if roll changes no height


@dataclass(frozen=True, slots=True)
class PitchFit:
    """Pitch goals and their fit."""

    goal_rad: Floats
    """(J,) goals, positive raises the head side; 0 on yaw joints."""
    gap_m: Floats
    """(J + 1,) height of each link's centre over where the ground step puts it."""
    pitch_rad: Floats
    """(J + 1,) inclination of each link in the ground step."""

    @property
    def residual_m(self) -> float:
        """Root mean square of the gaps."""
        return float(np.sqrt(np.mean(self.gap_m**2)))


class PitchFitter:
    """Pitch goals of one robot on one ground; ``None`` is a level floor."""

    def __init__(self, robot: RobotConfig, ground: HeightField | None, gain: float = 1.0) -> None:
        """``gain`` scales the fitted goals."""
        self._step = GroundStep(ground)
        self._gain = gain
        self._lengths_m = np.array(robot.link_lengths_m)
        self._link_m = robot.mean_link_length_m
        ends = (end / robot.link_count for end in robot.link_ends)
        self._half_m = np.array(robot.radii_at_m(tuple(ends)))
        self._pitch = np.array(robot.pitch_joints, dtype=np.intp)
        self._limit_rad = np.array(robot.limit_rad)[self._pitch]
        self._joints = robot.joint_count
        behind = np.arange(robot.joint_count + 1)[:, None] > self._pitch
        self._behind = behind.astype(float)

    def change_ground(self, ground: HeightField) -> None:
        """Use another ground from now on."""
        self._step = GroundStep(ground)

    def __call__(self, head_in_world_m: ArrayLike, heading_rad: Floats) -> PitchFit:
        """Fit the chain to the ground under it.

        At the slopes that [PT] allows (25 degrees), heights of link centres are linear in the
        joints: a joint raises the links behind it by their distance along its heading. The body's
        height, roll and pitch are free. One small least-squares problem gives the fit.

        Args:
            head_in_world_m: (2,) centre of the head link in plan.
            heading_rad: (J + 1,) headings of the links in plan.

        """
        forward = np.column_stack([np.cos(heading_rad), np.sin(heading_rad)])
        tip = np.asarray(head_in_world_m, float)[:2] + 0.5 * self._lengths_m[0] * forward[0]
        skeleton = self._step.place(
            heading_rad, tip, self._lengths_m, self._half_m, from_end="head"
        )
        height = 0.5 * (skeleton.points_m[1:, 2] + skeleton.points_m[:-1, 2])

        ends = np.zeros((self._joints + 2, 2))
        ends[1:] = -np.cumsum(self._lengths_m[:, None] * forward, axis=0)
        centres = 0.5 * (ends[1:] + ends[:-1])
        joint_ends = ends[self._pitch + 1]
        along = forward[self._pitch]
        ahead = (joint_ends - centres[:, None]) * along
        lever = self._behind * (ahead[..., 0] + ahead[..., 1])
        rise = np.column_stack([centres - centres.mean(axis=0), lever])

        mean = rise.mean(axis=0)
        centred = rise - mean
        target = height - height.mean()
        tilt = least_squares(centred, target, np.full(len(mean), _REGULAR * self._link_m))

        goal = np.zeros(self._joints)
        goal[self._pitch] = np.clip(self._gain * tilt[2:], -self._limit_rad, self._limit_rad)
        tilt[2:] = goal[self._pitch]
        return PitchFit(goal, (centred * tilt).sum(axis=1) - target, skeleton.pitch_rad)
