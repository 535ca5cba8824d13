"""``BatchBodies`` of the compiled simulator: what a batch has to agree with."""

import numpy as np

from snakewalk.config.robot import RobotConfig
from snakewalk.config.world import WorldConfig
from snakewalk.sim.batch.bodies import BatchBodies
from snakewalk.sim.physics.plant import MujocoPlant
from snakewalk.sim.plant import ServoDrive
from snakewalk.sim.servo.motor import make_drive, motors_of

INPUTS = ("torque_on", "goal_rad", "p_gain_per_rad", "pwm_limit", "supply_v", "current_limit_a")


class CompiledBodies(BatchBodies):
    """Each body is a ``MujocoPlant``."""

    def __init__(
        self, robot: RobotConfig, world: WorldConfig, count: int, step_s: float | None = None
    ) -> None:
        super().__init__(robot, world, count, step_s)
        self._plants = [MujocoPlant(robot, world, None, step_s) for _ in range(count)]
        self._drives: list[ServoDrive] = [make_drive(motors_of(robot), 0.0) for _ in range(count)]

    def run(self, steps: int) -> None:
        for row, (plant, drive) in enumerate(zip(self._plants, self._drives, strict=True)):
            mechanics = plant.mechanics
            if self._placed[row]:
                mechanics.data.qpos[:], mechanics.data.qvel[:] = self.qpos[row], self.qvel[row]
                mechanics.load_n[:] = self._load[row]
                mechanics.before_m[:] = self._before[row]
                for energy in (drive.drawn_j, drive.returned_j, drive.heat_j, drive.work_j):
                    energy[:] = 0.0
                mechanics.totals[:] = 0.0
                self._placed[row] = False
            for name in INPUTS:
                getattr(drive, name)[:] = getattr(self, name)[row]
            forward, across, back, law = (float(each) for each in self.friction[row])
            mechanics.mu = forward, across, back, law
            plant.steps.run(steps, drive)
            self.qpos[row], self.qvel[row] = mechanics.data.qpos, mechanics.data.qvel
            self.current_a[row], self.pwm[row] = drive.current_a, drive.pwm
            columns = (drive.drawn_j, drive.returned_j, drive.heat_j, drive.work_j)
            self.energies_j[:, row] = np.stack(columns)
            self.totals[row] = mechanics.totals[:2]
