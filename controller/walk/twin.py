"""A second, simulated body of the robot, and motions that use the friction of the ground."""

from typing import Protocol, runtime_checkable

from snakewalk.config.arrays import Floats
from snakewalk.config.robot import RobotConfig
from snakewalk.config.world import FrictionConfig
from snakewalk.controller.kinematics.links import BodyView, chain_angles_rad
from snakewalk.drivers.types import BodyPose


class Twin(Protocol):
    """A simulated body of the robot."""

    def begin(
        self, before: BodyPose, now: BodyPose, before_rad: Floats, now_rad: Floats, dt_s: float
    ) -> None:
        """Place the twin at the robot's pose, with the motion of the last ``dt_s``."""
        ...

    def use_friction(self, friction: FrictionConfig) -> None:
        """Set the friction of its ground."""
        ...

    def step(self, goal_rad: Floats, dt_s: float) -> tuple[BodyPose, Floats]:
        """Hold goals (J,) for ``dt_s``; return the final pose of the head and joints (J,)."""
        ...


@runtime_checkable
class UsesFriction(Protocol):
    """A motion, or a ``ShapeChooser``, whose predictions use friction."""

    def use_friction(self, friction: FrictionConfig) -> None:
        """Use this friction from the next prediction."""
        ...


def seen_state(robot: RobotConfig, view: BodyView) -> tuple[BodyPose, Floats]:
    """Head pose and joints (J,) of an observed body."""
    pose = BodyPose(0.0, view.link_m[0], view.rotation[0])
    return pose, chain_angles_rad(robot, view)
