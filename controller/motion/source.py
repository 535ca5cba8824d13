"""The interface of everything that moves joints: walker, gait, recording, live operator."""

from dataclasses import dataclass
from typing import Protocol, runtime_checkable

import numpy as np

from snakewalk.config.arrays import Floats
from snakewalk.config.robot import RobotConfig
from snakewalk.controller.gaits.gait import Needs
from snakewalk.controller.kinematics.links import BodyView

HEADROOM = 0.9
"""Share of the robot's limits that a motion uses by itself: the rest is left for joins."""


@dataclass(frozen=True, slots=True)
class Pace:
    """Largest speeds and accelerations of joints, of a source or of a robot's limits."""

    speed_rad_s: Floats
    """(J,) largest speeds of the joints, rad/s."""
    acceleration_rad_s2: Floats
    """(J,) largest accelerations of the joints, rad/s^2."""

    @staticmethod
    def limit(robot: RobotConfig) -> "Pace":
        """Return the limits of ``robot`` for plans."""
        ones = np.ones(robot.joint_count)
        return Pace(
            robot.joint_speed_limit_rad_s * ones, robot.joint_acceleration_limit_rad_s2 * ones
        )

    @staticmethod
    def still(joints: int) -> "Pace":
        """Return the pace of joints at rest."""
        return Pace(np.zeros(joints), np.zeros(joints))


class MotionSource(Protocol):
    """Joint targets over time, within the robot's limits.

    A ``step`` with a shorter time is the same motion at a slower rate; joins and derating use that.
    """

    @property
    def needs(self) -> Needs:
        """Joints that the motion needs."""
        ...

    @property
    def done(self) -> bool:
        """Whether the motion has ended and rests."""
        ...

    def goal_rad(self) -> Floats:
        """(J,) present joint targets."""
        ...

    def velocity_rad_s(self) -> Floats:
        """(J,) their present speeds."""
        ...

    def pace(self) -> Pace:
        """Largest speeds and accelerations from now on."""
        ...

    def step(self, dt_s: float, view: BodyView) -> Floats:
        """Advance by ``dt_s`` (0 or more) and return the new targets (J,)."""
        ...


@runtime_checkable
class StartsAnywhere(Protocol):
    """Optional interface of a ``MotionSource`` that starts at the measured angles."""

    def start_at(self, joint_rad: Floats) -> None:
        """Start at the angles (J,) measured before the first cycle."""
        ...


class Hold:
    """Joints that stay at given angles."""

    needs = Needs()
    done = True

    def __init__(self, joint_rad: Floats) -> None:
        self._joint_rad = np.array(joint_rad, dtype=float)

    def goal_rad(self) -> Floats:
        """(J,) the given angles."""
        return self._joint_rad

    def velocity_rad_s(self) -> Floats:
        """(J,) zeros."""
        return np.zeros(len(self._joint_rad))

    def pace(self) -> Pace:
        """Zero speeds and accelerations."""
        return Pace.still(len(self._joint_rad))

    def step(self, dt_s: float, view: BodyView) -> Floats:
        """Return the given angles."""
        return self._joint_rad
