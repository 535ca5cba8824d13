"""A pose from the joints, and from an IMU if the robot has one.

It integrates the displacement that friction makes of the measured shape change. It drifts too much
to reach waypoints, but a run without a measured pose can be watched and compared. An IMU adds the
vertical without drift, and a heading that drifts with the gyro's bias.
"""

import numpy as np

from snakewalk.config.arrays import Floats
from snakewalk.config.robot import RobotConfig
from snakewalk.config.world import FrictionConfig
from snakewalk.controller.kinematics.links import BodyView, SpineLinks, link_weights
from snakewalk.controller.mechanics.body_slide import BodySlide
from snakewalk.drivers.attitude import about_up
from snakewalk.drivers.types import BodyPose, ImuState, JointState

_ORIGIN = np.zeros(3)
_LEVEL_ROTATION = np.eye(3)
_STILL_SPEED_M_S = 1e-6
"""Speed of a link up to which the shape counts as unchanged (ours)."""


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
            imu: use the attitude from the robot's IMU, from its first reading onwards.

        """
        self._spine = SpineLinks.of(robot)
        self._slide = BodySlide(link_weights(robot), friction)
        self._head_m = np.array(start_m, dtype=float)
        self._heading_rad = heading_rad
        self._imu_link = robot.imu.link if imu and robot.imu is not None else None
        self._zero_rad: float | None = None
        self._tilt = _LEVEL_ROTATION
        self._last: tuple[float, BodyView] | None = None

    def __call__(self, state: JointState) -> BodyPose:
        """Advance to the state's time."""
        return self.advance(state.time_s, state.position_rad, state.imu)

    def advance(self, time_s: float, joints: Floats, imu: ImuState | None = None) -> BodyPose:
        """Advance to a time with joint angles (J,); returns the estimated pose."""
        last = self._last
        if last is None:
            level = self._spine.in_world(BodyPose(0.0, _ORIGIN, _LEVEL_ROTATION), joints)
            self._heading_rad -= level.heading_rad
        turned_rad = self._take_attitude(imu, joints)
        body = self._spine.in_world(BodyPose(0.0, _ORIGIN, self._tilt), joints)
        if last is not None and time_s > last[0]:
            rate_rad_s = self._integrate(time_s - last[0], last[1], body)
            if turned_rad is None:
                self._heading_rad += (time_s - last[0]) * rate_rad_s
        if turned_rad is not None:
            self._heading_rad = turned_rad
        self._last = (time_s, body)
        rotation = about_up(self._heading_rad) @ self._tilt
        return BodyPose(time_s, np.append(self._head_m, 0.0), rotation)

    def _take_attitude(self, imu: ImuState | None, joints: Floats) -> float | None:
        """Set the head's tilt from the IMU; return its heading, None without a reading."""
        if self._imu_link is None or imu is None:
            return None
        behind = self._spine.in_world(BodyPose(0.0, _ORIGIN, _LEVEL_ROTATION), joints)
        head = BodyPose(0.0, _ORIGIN, imu.rotation @ behind.rotation[self._imu_link].T)
        heading_rad = head.heading_rad
        self._tilt = about_up(-heading_rad) @ head.rotation
        if self._zero_rad is None:  # the device's north is any: at first its heading is what it was
            self._zero_rad = self._heading_rad - heading_rad
        return heading_rad + self._zero_rad

    def _integrate(self, step_s: float, before: BodyView, after: BodyView) -> float:
        """Move the head as the shape change does; returns the rate at which the body turns."""
        slide = self._slide
        if slide.set_shapes(before, after, step_s) < _STILL_SPEED_M_S:
            return 0.0
        u, v, rate_rad_s = slide.velocity().tolist()
        self._head_m += step_s * (about_up(self._heading_rad)[:2, :2] @ (u, v))
        return float(rate_rad_s)
