"""Commands, states and poses between controller and servos: read-only arrays, SI units, head first.

Named tuples, because a frozen dataclass needs five times as long and several are made per cycle.
"""

from typing import NamedTuple

import numpy as np

from snakewalk.config.arrays import Bools, Bytes, Floats

LIMIT_SLACK_RAD = 0.2
"""Largest measured angle of a joint beyond its limit, at the start and in a run (ours)."""


class JointCommand(NamedTuple):
    """Goal positions of all joints."""

    time_s: float
    """Clock time for which the command was computed."""
    goal_rad: Floats
    """(J,) goal positions; 0 is straight, positive yaw bends the body to the left."""


class ImuState(NamedTuple):
    """Newest reading of the robot's IMU, in the axes of its link."""

    rotation: Floats
    """(3, 3) columns: the link's forward, left and up axes in a world whose up is right and whose
    heading is arbitrary, and drifts."""
    rate_rad_s: Floats
    """(3,) rates of turning about the body's axes, rad/s."""
    age_s: float
    """Largest possible time since the measurement, s."""
    valid: bool
    """Whether this cycle's read succeeded."""


class JointState(NamedTuple):
    """Newest known state of all joints; after a failed read old values stay and age."""

    time_s: float
    """Clock time at the end of the read."""
    position_rad: Floats
    """(J,) measured joint angles, rad."""
    velocity_rad_s: Floats
    """(J,) measured joint velocities, rad/s."""
    current_a: Floats
    """(J,) measured motor currents, A."""
    temperature_c: Floats
    """(J,) from the slow round; NaN until first read."""
    voltage_v: Floats
    """(J,) from the slow round; NaN until first read."""
    hardware_error: Bytes
    """(J,) register 70, from the slow round or at once when a status packet carries the alert."""
    error: Bytes
    """(J,) error byte of the last status packet."""
    age_s: Floats
    """(J,) since position, velocity and current were last measured, at most: counted from the end
    of the request, as a servo measures between it and its reply."""
    valid: Bools
    """(J,) whether a read of this cycle succeeded."""
    slow_age_s: Floats
    """(J,) the same for temperature and voltage; infinite until first read."""
    imu: ImuState | None = None
    """Attitude measured by the robot's IMU; None without an IMU, or before its first attitude."""
    stalled_s: float = 0.0
    """Total time by which reads ended late because the computer paused."""


class BodyPose(NamedTuple):
    """Pose of the head link, as a simulator or a camera measures it."""

    time_s: float
    head_in_world_m: Floats
    """(3,) centre of the head link."""
    rotation: Floats
    """(3, 3) columns: the head link's forward, left and up axes in the world."""

    @property
    def heading_rad(self) -> float:
        """Direction of the head link in the horizontal plane, rad, in (-pi, pi]."""
        return float(np.arctan2(self.rotation[1, 0], self.rotation[0, 0]))
