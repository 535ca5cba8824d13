"""A pose from the joints alone: what friction makes of the measured shape change, integrated.

It drifts: it is too coarse to reach waypoints with. It is what is left where nothing
measures the pose, so that a run on metal can be watched and its log compared.
"""

import numpy as np

from snakewalk.config.arrays import Floats
from snakewalk.config.robot import RobotConfig
from snakewalk.config.world import FrictionConfig
from snakewalk.controller.kinematics.links import (
    body_in_world,
    link_weights,
    mean_heading_rad,
    pose_at,
)
from snakewalk.controller.mechanics.rigid_motion import rigid_velocity
from snakewalk.drivers.types import BodyPose, JointState


class DeadReckoning:
    """Call with each joint state, in order of time; returns the estimated pose."""

    def __init__(
        self,
        robot: RobotConfig,
        friction: FrictionConfig,
        start_m: tuple[float, float],
        heading_rad: float,
    ) -> None:
        self._robot, self._friction = robot, friction
        self._head_m = np.array(start_m, dtype=float)
        self._heading_rad = heading_rad
        self._velocity = np.zeros(3)
        self._last: tuple[float, Floats] | None = None

    def __call__(self, state: JointState) -> BodyPose:
        """Advance to the state's time."""
        joints = np.array(state.position_rad)
        if self._last is None:
            self._heading_rad -= mean_heading_rad(self._robot, joints)
        elif state.time_s > self._last[0]:
            self._integrate(state.time_s - self._last[0], self._last[1], joints)
        self._last = (state.time_s, joints)
        return pose_at(self._head_m, self._heading_rad, state.time_s)

    def _integrate(self, step_s: float, before_rad: Floats, after_rad: Floats) -> None:
        origin = pose_at(np.zeros(2), 0.0)
        before = body_in_world(self._robot, origin, before_rad)
        after = body_in_world(self._robot, origin, after_rad)
        shape_m_s = (after.link_m - before.link_m)[:, :2] / step_s
        if np.abs(shape_m_s).max() < 1e-6:
            return
        self._velocity = rigid_velocity(
            before.link_m[:, :2],
            before.headings_rad,
            shape_m_s,
            self._friction,
            self._velocity,
            normal=link_weights(self._robot),
        )
        c, s = np.cos(self._heading_rad), np.sin(self._heading_rad)
        u, v = self._velocity[:2]
        self._head_m = self._head_m + step_s * np.array([c * u - s * v, s * u + c * v])
        self._heading_rad += step_s * float(self._velocity[2])
