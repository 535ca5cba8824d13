"""BatchBodies of W robots of one kind on a level floor.

``sim.physics`` places each body, so it starts as in a run. Reasons:
``docs/decisions/0142-bodies.md``.
"""

from abc import ABC, abstractmethod

import numpy as np
from numpy.typing import ArrayLike

from snakewalk.config.arrays import Bools, Floats
from snakewalk.config.errors import InputError
from snakewalk.config.robot import RobotConfig
from snakewalk.config.world import WorldConfig
from snakewalk.sim.physics.plant import MujocoPlant
from snakewalk.sim.physics.step_forces import has_friction
from snakewalk.sim.servo.backlash import BACKLASH
from snakewalk.sim.servo.motor import Gearbox, MotorColumns, gears_of, motors_of


def unsupported(robot: RobotConfig, world: WorldConfig) -> str | None:
    """Return why bodies of a robot cannot be advanced together on a ground, or None."""
    if world.ground.kind != "flat" or world.obstacle is not None:
        return f"world {world.name}: is not a level, open floor"
    gears = Gearbox.columns(gears_of(robot)).rows()
    if has_friction(gears) or gears[BACKLASH].any():
        return f"robot {robot.name}: its gears have friction or backlash"
    return None


class BatchBodies(ABC):
    """State and drive of the bodies of ``count`` robots.

    Args:
        robot: body and motors of all worlds.
        world: a level floor without an obstacle.
        count: number of worlds W.
        step_s: length of a step; None: as in a run.

    Raises:
        InputError: the robot's gears or the world are not supported.

    """

    def __init__(
        self, robot: RobotConfig, world: WorldConfig, count: int, step_s: float | None = None
    ) -> None:
        fault = unsupported(robot, world)
        if fault is not None:
            raise InputError(f"{fault}; use the backend processes")
        self.template = MujocoPlant(robot, world, None, step_s)
        """Body that is placed, and then copied to a world."""
        joints = robot.joint_count
        self.count = count
        self.step_s = self.template.step_s
        # the drive as in ``sim.plant.ServoDrive``, (W, J)
        self.torque_on, self.goal_rad, self.p_gain_per_rad = np.zeros((3, count, joints))
        self.pwm_limit, self.supply_v = np.ones((2, count, joints))
        self.current_limit_a = np.full((count, joints), np.inf)
        self.friction: Floats = np.tile(np.array(self.template.mechanics.mu), (count, 1))
        """(W, 4) coefficients of the worlds' friction (``FrictionConfig.grip``)."""
        self.motors = MotorColumns(motors_of(robot))
        self.qpos, self.qvel = np.zeros((count, 7 + joints)), np.zeros((count, 6 + joints))
        self.current_a, self.pwm = np.zeros((2, count, joints))
        self.energies_j = np.zeros((4, count, joints))
        """Energies of each motor since its world was placed: drawn, returned, heat, work at the
        shaft."""
        self.totals = np.zeros((count, 2))
        """Friction loss, J, and distance slipped across the links, m."""
        self._load, self._before = np.zeros((count, joints + 1)), np.zeros((count, joints + 1, 3))
        self._placed: Bools = np.ones(count, bool)
        """Worlds that were placed since the last ``run``."""
        for row in range(count):
            self._copy_template(row)

    def place(
        self, row: int, start_m: tuple[float, float], heading_rad: float, joint_rad: ArrayLike
    ) -> None:
        """Place the body of a world at rest, like ``MujocoPlant.reset``."""
        self.template.reset(start_m, heading_rad, joint_rad)
        self._copy_template(row)

    def _copy_template(self, row: int) -> None:
        mechanics = self.template.mechanics
        self.qpos[row], self.qvel[row] = mechanics.data.qpos, mechanics.data.qvel
        self._load[row], self._before[row] = mechanics.load_n, mechanics.before_m
        self.energies_j[:, row] = self.totals[row] = 0.0
        self._placed[row] = True

    @abstractmethod
    def run(self, steps: int) -> None:
        """Advance all worlds under the present drive.

        Raises:
            PhysicsError: a state diverged.

        """
