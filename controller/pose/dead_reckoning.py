"""A pose from the joints, and the attitude of an IMU where the robot has one.

The way is what friction makes of the measured shape change, integrated. It drifts: it is too coarse
to reach waypoints with. It is what is left where nothing measures the pose, so that a run on metal
can be watched and its log compared. An IMU adds which way is up, which does not drift, and the
heading, which drifts with the bias of its gyro instead of with the ground.
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
from snakewalk.drivers.attitude import rotation_by
from snakewalk.drivers.types import BodyPose, JointState

_NOWHERE = np.zeros(3)
_UP = np.array([0.0, 0.0, 1.0])


class DeadReckoning:
    """Call with each joint state, in order of time; returns the estimated pose."""

    def __init__(
        self,
        robot: RobotConfig,
        friction: FrictionConfig,
        start_m: tuple[float, float],
        heading_rad: float,
        *,
        imu: bool = False,
    ) -> None:
        """Prepare.

        Args:
            robot: whose joints they are.
            friction: of the ground.
            start_m: where the head begins.
            heading_rad: mean heading of the links at the beginning.
            imu: take the attitude from the robot's IMU, from its first reading on.

        """
        self._robot, self._friction = robot, friction
        self._head_m = np.array(start_m, dtype=float)
        self._heading_rad = heading_rad
        self._imu_link = robot.imu.link if imu and robot.imu is not None else None
        self._zero_rad: float | None = None
        self._velocity = np.zeros(3)
        self._tilt = np.eye(3)
        self._last: tuple[float, Floats, Floats] | None = None

    def __call__(self, state: JointState) -> BodyPose:
        """Advance to the state's time."""
        joints = np.array(state.position_rad)
        if self._last is None:
            self._heading_rad -= mean_heading_rad(self._robot, joints)
        turned_rad = self._take_attitude(state, joints)
        if self._last is not None and state.time_s > self._last[0]:
            rate_rad_s = self._integrate(state.time_s - self._last[0], *self._last[1:], joints)
            if turned_rad is None:
                self._heading_rad += (state.time_s - self._last[0]) * rate_rad_s
        if turned_rad is not None:
            self._heading_rad = turned_rad
        self._last = (state.time_s, joints, self._tilt)
        level = pose_at(self._head_m, self._heading_rad, state.time_s)
        return level._replace(rotation=level.rotation @ self._tilt)

    def _take_attitude(self, state: JointState, joints: Floats) -> float | None:
        """Take the head's tilt from the IMU; returns its heading, None where there is none."""
        if self._imu_link is None or state.imu is None:
            return None
        behind = body_in_world(self._robot, BodyPose(0.0, _NOWHERE, np.eye(3)), joints)
        head = BodyPose(0.0, _NOWHERE, state.imu.rotation @ behind.rotation[self._imu_link].T)
        heading_rad = head.heading_rad
        self._tilt = rotation_by(-heading_rad * _UP) @ head.rotation
        if self._zero_rad is None:  # the device's north is any: at first its heading is what it was
            self._zero_rad = self._heading_rad - heading_rad
        return heading_rad + self._zero_rad

    def _integrate(
        self, step_s: float, before_rad: Floats, before_tilt: Floats, after_rad: Floats
    ) -> float:
        """Move the head as the shape change does; returns the rate at which the body turns."""
        before = body_in_world(self._robot, BodyPose(0.0, _NOWHERE, before_tilt), before_rad)
        after = body_in_world(self._robot, BodyPose(0.0, _NOWHERE, self._tilt), after_rad)
        shape_m_s = (after.link_m - before.link_m)[:, :2] / step_s
        if np.abs(shape_m_s).max() < 1e-6:
            return 0.0
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
        return float(self._velocity[2])
