"""A robot's MuJoCo model and data, and additional data for friction and water."""

from dataclasses import dataclass, field

import mujoco
import numpy as np

from snakewalk.config.arrays import Floats, Int32s
from snakewalk.config.heightfield import HeightField
from snakewalk.config.robot import RobotConfig
from snakewalk.config.world import WorldConfig
from snakewalk.sim.physics.tangent_planes import TangentPlanes
from snakewalk.sim.physics.water import water_constants
from snakewalk.sim.servo.backlash import BACKLASH, WHEEL_SHARE
from snakewalk.sim.servo.motor import Gearbox, gears_of

LEAST_DEPTH_M = 1e-9
"""Contacts of one link share its load by depth; this is the depth of one that just touches."""


GROUND = 1
FOOT = 2
"""Roles in contacts: the floor or a plane on it; a foot, whose friction is MuJoCo's own cone, since
it knows no direction. Everything else is 0: bellies, obstacles."""


class PhysicsError(RuntimeError):
    """The physics cannot continue: its state diverged, or this MuJoCo is unknown."""


@dataclass(slots=True)
class Mechanics:
    """One robot's model and data; link i is body ``1 + i``, joint j has position ``7 + j``.

    Links of the spine come first, then those of the legs.
    """

    model: mujoco.MjModel
    data: mujoco.MjData
    mu: tuple[float, float, float, float]
    """Coefficients of the ground's friction (``FrictionConfig.grip``)."""
    spine_links: int
    link_mass_kg: Floats
    """(L,) of each link; a leg's counts as a plain one of the spine."""
    radius_m: float
    """Radius of the body."""
    gears: Floats
    """(13, J) friction of each gearbox, powered or not, as ``sim.servo.motor.friction_n_m`` has it.
    The inertia of the rotors is MuJoCo's."""
    planes: TangentPlanes
    """Planes that support the body on a height field."""
    contact_role: Int32s
    """(geoms,) role of a geom in contacts: ``GROUND``, ``FOOT``, or 0 for others."""
    load_n: Floats
    """(L,) force of the ground on each link in the last step, N."""
    before_m: Floats
    """(L, 3) centres of the links at the start of the last step."""
    water: Floats
    """(L, 9) constants of the water forces (``sim.physics.water.water_constants``)."""
    rotor: Floats
    """(5, J) state of the backlash, as ``sim.servo.backlash`` has it."""
    totals: Floats = field(default_factory=lambda: np.zeros(3))
    """Energy lost to ground friction and water, J; mean distance slipped across the links, m;
    energy lost to the friction of the gears, J."""

    @classmethod
    def of(
        cls,
        model: mujoco.MjModel,
        robot: RobotConfig,
        world: WorldConfig,
        ground: HeightField | None,
    ) -> "Mechanics":
        """Collect the data of the steps."""
        load = np.zeros(robot.joint_count + 1)
        before = np.zeros((robot.joint_count + 1, 3))
        data = mujoco.MjData(model)
        legs_kg = (robot.limbs[joint.pair].segment_mass_kg for joint in robot.limb_joints)
        mass = np.array([*robot.link_masses_kg, *legs_kg])
        water = water_constants(world, robot)
        grip = world.friction.grip
        planes = TangentPlanes.of(model, ground)
        role = np.zeros(model.ngeom, dtype=np.int32)
        role[model.geom("ground").id] = GROUND
        role[planes.planes] = GROUND
        role[foot_geoms(model, robot)] = FOOT
        gears = Gearbox.columns(gears_of(robot)).rows()
        rotor = np.zeros((5, robot.joint_count))
        about = robot.link_count, mass, robot.body_radius_m, gears
        return cls(model, data, grip, *about, planes, role, load, before, water, rotor)

    @property
    def joint_count(self) -> int:
        """J."""
        return int(self.model.nv) - 6

    @property
    def step_s(self) -> float:
        """Length of a step."""
        return float(self.model.opt.timestep)

    def start_at_rest(self) -> None:
        """Initialise the memory after ``mj_forward`` for a state that was set."""
        self.model.dof_frictionloss[:] = 0.0  # it grows with torques, which are still zero
        self.rotor[:] = 0.0
        loose = np.flatnonzero(self.gears[BACKLASH] > 0.0)
        self.model.dof_armature[6 + loose] = WHEEL_SHARE * self.gears[0, loose]
        self.before_m[:] = self.data.xipos[1:] - self.step_s * velocities(self.model, self.data)[0]
        self.measure_loads()

    def measure_loads(self) -> None:
        """Set ``load_n`` from the contact forces in the data."""
        d = self.data
        row = np.asarray(d.contact.efc_address)
        bears = (row >= 0) & (self.contact_role[d.contact.geom[:, 0]] == GROUND)
        link = self.model.geom_bodyid[d.contact.geom[bears, 1]] - 1
        self.load_n[:] = np.bincount(link, d.efc_force[row[bears]], len(self.load_n))


def foot_geoms(model: mujoco.MjModel, robot: RobotConfig) -> list[int]:
    """Geoms of the feet, in the order of the legs' joints."""
    return [
        model.geom(f"foot{robot.link_count + k}").id
        for k, joint in enumerate(robot.limb_joints)
        if joint.has_foot
    ]


def velocities(model: mujoco.MjModel, data: mujoco.MjData) -> tuple[Floats, Floats]:
    """Velocities of the links' centres and their spins, world frame, (L, 3) each."""
    centre = data.xipos[1:]
    anchor = data.xanchor
    velocity = np.empty_like(centre)
    spin = np.empty_like(centre)
    velocity[0], spin[0] = data.qvel[:3], data.xmat[1].reshape(3, 3) @ data.qvel[3:6]
    for i in range(1, len(centre)):
        on = int(model.body_parentid[i + 1]) - 1
        spin[i] = spin[on] + data.xaxis[i] * data.qvel[5 + i]
        rise = np.cross(spin[on], anchor[i] - centre[on]) + np.cross(spin[i], centre[i] - anchor[i])
        velocity[i] = velocity[on] + rise
    return velocity, spin
