"""A ``sim.plant.Plant`` in MuJoCo: placing, stepping and measuring a body."""

import math
from functools import partial

import mujoco
import numpy as np
from numpy.typing import ArrayLike

from snakewalk.config.arrays import Floats
from snakewalk.config.errors import InputError
from snakewalk.config.heightfield import HeightField
from snakewalk.config.robot import RobotConfig
from snakewalk.config.world import WorldConfig
from snakewalk.drivers.types import BodyPose
from snakewalk.sim.imu import Imu
from snakewalk.sim.physics.body import build_model
from snakewalk.sim.physics.mechanics import Mechanics, PhysicsError
from snakewalk.sim.physics.obstacles import place_at_obstacle, start_fault
from snakewalk.sim.physics.placing import float_at, lay_down, place
from snakewalk.sim.physics.stepper import Steps, make_steps
from snakewalk.sim.plant import LinkMotion, ServoDrive

FLOOR_STEP_S = 0.002
FIELD_STEP_S = 0.001
"""On hills a body creeps and falls from link to link. In 4 s of a wave the error is 1 to 3 % of the
distance at 2 ms, and 0.1 to 2 % at 1 ms (``python -m benchmarks step_length``)."""


class MujocoPlant:
    """A chain on its ground; starts straight at the origin, heading along x, at rest.

    With ``is_placed=False`` it needs ``reset`` or ``set_state``: placing on hills needs 0.25 s.
    """

    def __init__(
        self,
        robot: RobotConfig,
        world: WorldConfig,
        ground: HeightField | None = None,
        step_s: float | None = None,
        *,
        is_placed: bool = True,
    ) -> None:
        self.robot = robot
        self.world = world
        self.ground = ground
        if step_s is None:
            step_s = FLOOR_STEP_S if ground is None else FIELD_STEP_S
        self.step_s = step_s
        model = build_model(
            robot,
            world,
            ground,
            step_s,
        )
        self.mechanics = Mechanics.of(model, robot, world, ground)
        self._data = self.mechanics.data
        self._position_rad: Floats = self._data.qpos[7:]
        self._velocity_rad_s: Floats = self._data.qvel[6:]
        self._count = 0
        if is_placed:
            self._place_body((0.0, 0.0), 0.0, np.zeros(robot.joint_count))
        self.steps: Steps = make_steps(self.mechanics)
        """The loop that advances the body."""

    @property
    def time_s(self) -> float:
        """Seconds of whole steps since the last reset."""
        return self._count * self.step_s

    @property
    def position_rad(self) -> Floats:
        """(J,) live view of the shaft angles."""
        return self._position_rad

    @property
    def velocity_rad_s(self) -> Floats:
        """(J,) live view, rad/s."""
        return self._velocity_rad_s

    def advance(self, until_s: float, drive: ServoDrive) -> None:
        """Step to the last whole step at or before ``until_s``.

        Raises:
            PhysicsError: the state diverged.

        """
        steps = math.floor(until_s / self.step_s + 1e-6) - self._count
        if steps <= 0:
            return
        count = self._count + steps
        try:
            time_s = self.steps.run(steps, drive)
            self._count = count
        except BaseException:
            # A signal may end it anywhere; later steps of the shutdown continue from there.
            self._count = round(self._data.time / self.step_s)
            raise
        if abs(time_s - count * self.step_s) > 0.5 * self.step_s:  # MuJoCo resets a diverged state
            raise PhysicsError(
                f"the physics diverged before {self.time_s:.3f} s; "
                f"a step of {self.step_s * 1e3:g} ms may be too long for this robot"
            )

    def reset(self, start_m: tuple[float, float], heading_rad: float, joint_rad: ArrayLike) -> None:
        """Place the body on the ground, at rest, at time 0.

        Yaw joints start at ``joint_rad`` (J,). Pitch joints start from it and drape over the
        ground, like those of an unpowered robot (on a plane they keep it). A coil goes round a
        pole, everything into a pipe; a floating body floats. ``start_m`` is on the floor.

        Raises:
            ValueError: ``joint_rad`` is not (J,).
            InputError: the body would start inside a peg or a wall.

        """
        self._place_body(start_m, heading_rad, joint_rad)
        fault = start_fault(self.mechanics, self.world)
        if fault is not None:
            raise InputError(f"world {self.world.name}: {fault}")

    def lay_down(
        self, start_m: tuple[float, float], heading_rad: float, joint_rad: ArrayLike
    ) -> None:
        """Move the body on its level floor, at rest, between two steps.

        It is quick enough for a running control loop, because the body does not settle. Time,
        energy and distance continue.

        Raises:
            ValueError: ``joint_rad`` is not (J,), or the ground is not a level, open floor.

        """
        if self.world.ground.kind != "flat" or self.world.obstacle is not None:
            raise ValueError(f"world {self.world.name}: not a level, open floor")
        lay_down(self.mechanics, self.robot, start_m, heading_rad, joint_rad)

    def set_state(self, before: Floats, now: Floats, dt_s: float) -> None:
        """Set MuJoCo's coordinates ``now`` (7 + J,); the velocity is that from ``before`` in dt_s.

        The loads on the links are those of this state; time is 0.
        """
        m, d = self.mechanics, self._data
        mujoco.mj_resetData(m.model, d)
        mujoco.mj_differentiatePos(m.model, d.qvel, dt_s, before, now)
        d.qpos[:] = now
        m.planes.lay(d)
        mujoco.mj_forward(m.model, d)
        m.start_at_rest()
        self._count = 0
        m.totals[:] = 0.0

    def _place_body(
        self, start_m: tuple[float, float], heading_rad: float, joint_rad: ArrayLike
    ) -> None:
        m = self.mechanics
        if not place_at_obstacle(
            m, self.robot, self.world, heading_rad, joint_rad
        ) and not float_at(m, self.robot, self.world, self.ground, start_m, heading_rad, joint_rad):
            place(m, self.robot, self.ground, start_m, heading_rad, joint_rad)
        self._count = 0
        self._data.time = 0.0
        self.mechanics.totals[:] = 0.0

    def head_pose(self) -> BodyPose:
        """Head link's centre and axes."""
        place = self._data.qpos
        axes = np.empty(9)
        mujoco.mju_quat2Mat(axes, place[3:7])
        return BodyPose(self._count * self.step_s, place[:3].copy(), axes.reshape(3, 3))

    @property
    def link_positions_m(self) -> Floats:
        """(L, 3) centres of the links."""
        self._update_kinematics()
        return np.array(self._data.xipos[1:])

    def link_motion(self, link: int) -> LinkMotion:
        """Motion of a link of the spine."""
        m, d = self.mechanics.model, self._data
        mujoco.mj_kinematics(m, d)
        body = m.body(f"link{link}").id
        return LinkMotion(self.time_s, d.xipos[body].copy(), d.xmat[body].reshape(3, 3).copy())

    @property
    def contact_count(self) -> int:
        """Number of links that bear load."""
        d = self._data
        row = np.asarray(d.contact.efc_address)
        bears = row >= 0
        bears[bears] = d.efc_force[row[bears]] > 0.0
        bodies = self.mechanics.model.geom_bodyid[d.contact.geom[bears]].max(axis=1)
        return len(np.unique(bodies))

    @property
    def energy_j(self) -> tuple[float, float]:
        """Potential (zero at z = 0) and kinetic energy, rotors included."""
        m, d = self.mechanics.model, self._data
        self._update_kinematics()
        moved = np.empty(m.nv)  # mj_energyVel of MuJoCo 3.2 gives 0
        mujoco.mj_mulM(m, d, moved, d.qvel)
        potential_j = -float(m.body_mass[1:] @ (d.xipos[1:] @ m.opt.gravity))
        return potential_j, 0.5 * float(moved @ d.qvel)

    @property
    def slip_m(self) -> float:
        """Mean distance slipped across the links since the reset."""
        return float(self.mechanics.totals[1])

    @property
    def qpos(self) -> Floats:
        """(7 + J,) copy of MuJoCo's coordinates, for a film."""
        copy: Floats = self._data.qpos.copy()
        return copy

    def _update_kinematics(self) -> None:
        """Update positions and axes: a step leaves those of its start."""
        m, d = self.mechanics.model, self._data
        mujoco.mj_kinematics(m, d)
        mujoco.mj_comPos(m, d)
        mujoco.mj_crb(m, d)


def plant_imu(robot: RobotConfig, plant: MujocoPlant, baud: int, seed: int = 0) -> Imu | None:
    """The robot's IMU in the body of ``plant``, or None."""
    if robot.imu is None:
        return None
    return Imu(robot.imu, partial(plant.link_motion, robot.imu.link), baud, seed)
