"""A robot's MuJoCo model and data, and what friction and water need beside them."""

from dataclasses import dataclass, field

import mujoco
import numpy as np
from numpy.typing import NDArray

from snakewalk.config.arrays import Floats
from snakewalk.config.heightfield import HeightField
from snakewalk.config.robot import RobotConfig
from snakewalk.config.world import WorldConfig
from snakewalk.sim.physics.tangent_planes import TangentPlanes
from snakewalk.sim.physics.water import water_constants

LEAST_DEPTH_M = 1e-9
"""Contacts of one link share its load by depth; this is the depth of one that just touches."""


class PhysicsError(RuntimeError):
    """The physics cannot go on: its state diverged, or this MuJoCo is not the one it knows."""


@dataclass(slots=True)
class Mechanics:
    """One robot's model and data; link i is body ``1 + i``, joint j has position ``7 + j``."""

    model: mujoco.MjModel
    data: mujoco.MjData
    mu: tuple[float, float, float]
    """Coefficients of friction: sliding forward, across and back."""
    link_mass_kg: float
    radius_m: float
    gear_drag_n_m_s: Floats
    """(J,) viscous loss of each gearbox, powered or not."""
    planes: TangentPlanes
    """What bears the body on a height field."""
    is_ground: NDArray[np.int32]
    """(geoms,) 1 for the floor and the planes, 0 for bellies and obstacles."""
    load_n: Floats
    """(L,) what the ground bore of each link in the last step, N."""
    before_m: Floats
    """(L, 3) centres of the links at the start of the last step."""
    water: Floats
    """(6,) ``sim.physics.water.water_constants``."""
    totals: Floats = field(default_factory=lambda: np.zeros(3))
    """Energy lost to ground friction and water, J; mean distance slipped across the links, m;
    energy lost to the drag of the gears, J."""

    @classmethod
    def of(
        cls,
        model: mujoco.MjModel,
        robot: RobotConfig,
        world: WorldConfig,
        ground: HeightField | None,
    ) -> "Mechanics":
        """Gather what the steps need."""
        mu = world.friction
        load, before = np.zeros(robot.joint_count + 1), np.zeros((robot.joint_count + 1, 3))
        data = mujoco.MjData(model)
        mass, radius = robot.link_mass_kg, robot.body_radius_m
        water = water_constants(world, robot)
        grip = mu.along, mu.across, mu.backward
        planes = TangentPlanes.of(model, ground, radius)
        is_ground = np.zeros(model.ngeom, dtype=np.int32)
        is_ground[model.geom("ground").id] = 1
        is_ground[planes.planes] = 1
        about = mass, radius, np.array(robot.gear_drags_n_m_s)
        return cls(model, data, grip, *about, planes, is_ground, load, before, water)

    @property
    def joint_count(self) -> int:
        """J."""
        return int(self.model.nv) - 6

    @property
    def step_s(self) -> float:
        """Length of a step."""
        return float(self.model.opt.timestep)

    def start_at_rest(self) -> None:
        """Set up the memory for a state that was set, not stepped to, after ``mj_forward``."""
        self.before_m[:] = self.data.xipos[1:] - self.step_s * velocities(self.data)[0]
        self.measure_loads()

    def measure_loads(self) -> None:
        """Set ``load_n`` from the contact forces in the data."""
        d = self.data
        row = np.asarray(d.contact.efc_address)
        bears = (row >= 0) & (self.is_ground[d.contact.geom[:, 0]] > 0)
        link = self.model.geom_bodyid[d.contact.geom[bears, 1]] - 1
        self.load_n[:] = np.bincount(link, d.efc_force[row[bears]], len(self.load_n))


def velocities(data: mujoco.MjData) -> tuple[Floats, Floats]:
    """Velocity of the links' centres and their spins, world frame, (L, 3) each."""
    centre, anchor = data.xipos[1:], data.xanchor[1:]
    head_spin = data.xmat[1].reshape(3, 3) @ data.qvel[3:6]
    spin = np.vstack([head_spin, data.xaxis[1:] * data.qvel[6:, None]]).cumsum(axis=0)
    rise = np.cross(spin[:-1], anchor - centre[:-1]) + np.cross(spin[1:], centre[1:] - anchor)
    return np.vstack([data.qvel[:3], rise]).cumsum(axis=0), spin
