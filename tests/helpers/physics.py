"""Bodies, servos and a wave for the tests of the physics."""

import mujoco
import numpy as np
from numpy.typing import NDArray

from snakewalk.config.friction_law import LawName
from snakewalk.config.heightfield import HeightField
from snakewalk.config.loader import load_robot, load_world
from snakewalk.config.world import FrictionConfig
from snakewalk.controller.kinematics.smoothstep import quintic
from snakewalk.sim.physics.plant import MujocoPlant
from snakewalk.sim.plant import ServoDrive
from snakewalk.sim.servo.motor import MOTORS, make_drive, p_gain_per_rad

Floats = NDArray[np.float64]

ROBOT = load_robot("yaw16")
FLAT = load_world("flat")
HZ = 0.5
WAVELENGTH_JOINTS = 14.0


def a_body(
    mu: tuple[float, ...] = (0.1, 0.7),
    step_s: float = 0.002,
    ground: HeightField | None = None,
    law: LawName | None = None,
    **options: float,
) -> MujocoPlant:
    """A ``yaw16`` with friction ``mu`` (along, across, and perhaps back), straight, at rest."""
    back = mu[2] if len(mu) > 2 else None
    friction = FrictionConfig(along=mu[0], across=mu[1], back=back, law=law)
    world = FLAT.model_copy(update={"friction": friction})
    return MujocoPlant(ROBOT, world, ground, step_s, **options)  # type: ignore[arg-type]


def link_rotations(plant: MujocoPlant) -> Floats:
    """Columns (L, 3, 3): each link's forward, left and up axes in the world."""
    count = len(plant.link_positions_m)
    return np.array([plant.link_motion(link).rotation for link in range(count)])


def momentum(plant: MujocoPlant) -> tuple[Floats, Floats]:
    """Linear, N s, and angular about the centre of mass, N m s; (3,) each."""
    m, d = plant.mechanics.model, plant.mechanics.data
    assert len(plant.link_positions_m), "updates the kinematics"
    mujoco.mj_comVel(m, d)
    mujoco.mj_subtreeVel(m, d)
    return m.body_subtreemass[1] * d.subtree_linvel[1], d.subtree_angmom[1].copy()


def a_drive(*, torque_on: bool = True) -> ServoDrive:
    """Servos of ``yaw16`` as they leave the factory, on 12 V."""
    motor = MOTORS["XM430-W350"]
    drive = make_drive([motor] * ROBOT.joint_count, 12.0)
    drive.torque_on[:] = float(torque_on)
    drive.p_gain_per_rad[:] = p_gain_per_rad(ROBOT.servo.position_p_gain, motor)
    return drive


def serpenoid(time_s: float, amplitude_rad: float = 0.35) -> Floats:
    """Joint angles of a wave travelling backwards that grows from a straight body within 1 s."""
    x = min(max(time_s, 0.0), 1.0)
    grown = amplitude_rad * quintic(x)
    phase = HZ * time_s - np.arange(ROBOT.joint_count) / WAVELENGTH_JOINTS
    return np.asarray(grown * np.sin(2.0 * np.pi * phase))
