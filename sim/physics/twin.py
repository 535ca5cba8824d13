"""A twin: a second simulated body at the robot's pose, to try a motion on.

Its joints have motors like servos, without a bus. Its steps are twice as long as the robot's.
"""

import mujoco
import numpy as np

from snakewalk.config.arrays import Floats
from snakewalk.config.heightfield import HeightField
from snakewalk.config.robot import RobotConfig
from snakewalk.config.world import FrictionConfig, WorldConfig
from snakewalk.drivers.types import BodyPose
from snakewalk.sim.physics.plant import FLOOR_STEP_S, MujocoPlant
from snakewalk.sim.servo.motor import MotorColumns, make_drive, motors_of, p_gain_per_rad


class PlantTwin:
    """A ``MujocoPlant`` without servos that runs with the robot."""

    def __init__(self, robot: RobotConfig, world: WorldConfig, ground: HeightField | None) -> None:
        """Make a body with torque and the robot's gains."""
        self._plant = MujocoPlant(robot, world, ground, FLOOR_STEP_S, is_placed=False)
        motors = motors_of(robot)
        self._drive = make_drive(motors, robot.servo.supply_v)
        self._drive.torque_on[:] = 1.0
        gains = np.array(robot.position_p_gains)
        self._drive.p_gain_per_rad[:] = p_gain_per_rad(gains, MotorColumns(motors))
        self._drive.current_limit_a[:] = robot.current_limits_a

    def begin(
        self, before: BodyPose, now: BodyPose, before_rad: Floats, now_rad: Floats, dt_s: float
    ) -> None:
        """Place it at the robot's pose, moving as the robot did since ``dt_s`` (> 0) ago.

        ``before_rad`` and ``now_rad`` are (J,).
        """
        self._plant.set_state(_qpos(before, before_rad), _qpos(now, now_rad), dt_s)

    def use_friction(self, friction: FrictionConfig) -> None:
        """Set the friction of its ground."""
        self._plant.mechanics.mu = friction.grip

    def step(self, goal_rad: Floats, dt_s: float) -> tuple[BodyPose, Floats]:
        """Hold goals (J,) for ``dt_s``; return the head's pose and the joints (J,) then.

        Raises:
            PhysicsError: the state diverged.

        """
        self._drive.goal_rad[:] = goal_rad
        self._plant.advance(self._plant.time_s + dt_s, self._drive)
        return self._plant.head_pose(), self._plant.position_rad.copy()


def _qpos(pose: BodyPose, joint_rad: Floats) -> Floats:
    """(7 + J,) MuJoCo's coordinates of a body."""
    quaternion = np.empty(4)
    mujoco.mju_mat2Quat(quaternion, np.ascontiguousarray(pose.rotation).ravel())
    return np.concatenate([pose.head_in_world_m, quaternion, joint_rad])
