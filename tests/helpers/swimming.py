"""A robot on the physics that follows a gait."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from snakewalk.config.loader import load_robot, load_world
from snakewalk.config.robot import RobotConfig
from snakewalk.config.world import WorldConfig
from snakewalk.controller.gaits.gait import Gait
from snakewalk.controller.kinematics.smoothstep import quintic
from snakewalk.controller.motion.gait_cycle import GaitCycle
from snakewalk.sim.physics.plant import MujocoPlant
from snakewalk.sim.plant import ServoDrive
from snakewalk.sim.servo.motor import MOTORS, make_drive, p_gain_per_rad

Floats = NDArray[np.float64]
FRAME_S = 0.02


@dataclass(frozen=True)
class Followed:
    """What a body did."""

    time_s: Floats
    centre_m: Floats
    """(T, 3) mean of the links."""
    joint_rad: Floats
    """(T, J) as measured."""
    frequency_hz: float
    plant: MujocoPlant

    def way_m(self, cycles: int) -> Floats:
        """(3,) in the last whole cycles, of one cycle."""
        frames = round(cycles / self.frequency_hz / FRAME_S)
        return np.asarray((self.centre_m[-1] - self.centre_m[-1 - frames]) / cycles)


def follow(
    gait: Gait,
    robot_name: str,
    world: str | WorldConfig,
    seconds: float,
    *,
    hold_s: float = 0.0,
    grow_s: float = 0.0,
    make_plant: Callable[..., MujocoPlant] = MujocoPlant,
) -> Followed:
    """Run a gait; joints are held for ``hold_s`` first, or grow from straight in ``grow_s``."""
    robot = load_robot(robot_name)
    cycle = GaitCycle(gait, robot)
    place = load_world(world) if isinstance(world, str) else world
    plant = make_plant(robot, place)
    plant.reset((0.0, 0.0), 0.0, cycle.goal_rad() * float(grow_s <= 0.0))
    motor = MOTORS[robot.servo.model]
    drive = make_drive([motor] * robot.joint_count, 12.0)
    drive.torque_on[:] = 1.0
    drive.p_gain_per_rad[:] = p_gain_per_rad(gait.p_gain or 800, motor)
    drive.current_limit_a[list(robot.pitch_joints)] = 1.5
    time_s = FRAME_S * np.arange(1, round(seconds / FRAME_S) + 1)
    centre, joints = np.zeros((len(time_s), 3)), np.zeros((len(time_s), robot.joint_count))
    for k, t in enumerate(time_s):
        x = min(t / grow_s, 1.0) if grow_s else 1.0
        goal = cycle.goal_rad() if t <= hold_s else cycle.step(FRAME_S, None)  # type: ignore[arg-type]
        drive.goal_rad[:] = goal * quintic(x)
        plant.advance(float(t), drive)
        centre[k], joints[k] = plant.link_positions_m.mean(axis=0), plant.position_rad
    return Followed(time_s, centre, joints, cycle.frequency_hz, plant)


def a_still_drive(robot: RobotConfig) -> ServoDrive:
    """Servos that hold every joint straight."""
    motor = MOTORS[robot.servo.model]
    drive = make_drive([motor] * robot.joint_count, 12.0)
    drive.torque_on[:] = 1.0
    drive.p_gain_per_rad[:] = p_gain_per_rad(800, motor)
    return drive
