"""Putting a body down so that it lies still."""

import mujoco
import numpy as np
from numpy.typing import ArrayLike, NDArray

from config.heightfield import HeightField
from config.robot import RobotConfig
from sim.physics.mechanics import Mechanics

Floats = NDArray[np.float64]

LIMP_ARMATURE_KG_M2 = 1e-3
"""Of pitch joints while the body is laid down: a hand turns the rotors."""
CALM_PER_S = 15.0
"""Rate at which motion dies while the body is laid down."""
STILL_M_S, STILL_RAD_S = 1e-3, 1e-2
SHORTEST_S, LONGEST_S = 0.3, 4.0


def place(
    m: Mechanics,
    robot: RobotConfig,
    ground: HeightField | None,
    start_m: tuple[float, float],
    heading_rad: float,
    joint_rad: ArrayLike,
) -> None:
    """Lay the body down with its head above ``start_m``; ends at rest, with its contact forces.

    It is lowered until it first touches, then settles, strongly damped, the head free to sink and
    lean but not to slide or turn. Yaw joints are held; pitch joints are held on a plane and limp on
    a height field, where they drape the body over the ground.

    Raises:
        ValueError: ``joint_rad`` is not (J,).

    """
    model, data = m.model, m.data
    q = np.asarray(joint_rad, dtype=float)
    if q.shape != (m.joint_count,):
        raise ValueError(f"joint_rad has shape {q.shape}; the robot has {m.joint_count} joints")
    mujoco.mj_resetData(model, data)
    data.qpos[:2] = start_m
    data.qpos[3:7] = np.cos(heading_rad / 2), 0.0, 0.0, np.sin(heading_rad / 2)
    data.qpos[7:] = q
    mujoco.mj_kinematics(model, data)
    centre = np.asarray(data.xipos[1:])
    data.qpos[2] = float((_rest_height_m(ground, centre, robot.body_radius_m) - centre[:, 2]).max())
    limp = () if ground is None else robot.pitch_joints
    _settle(m, np.array(limp, dtype=int))
    data.qvel[:] = 0.0
    mujoco.mj_forward(model, data)
    m.rest()


def _settle(m: Mechanics, limp: NDArray[np.int_]) -> None:
    model, data = m.model, m.data
    firm = np.setdiff1d(np.arange(m.joint_count), limp)
    held = data.qpos[7 + firm].copy()
    start = data.qpos[:2].copy()
    armature = model.dof_armature.copy()
    model.dof_armature[6 + limp] = LIMP_ARMATURE_KG_M2
    for _ in range(int(LONGEST_S / m.step_s)):
        mujoco.mj_step(model, data)
        data.qvel[:] *= np.exp(-CALM_PER_S * m.step_s)
        data.qvel[:2] = 0.0
        data.qvel[5] = 0.0
        data.qvel[6 + firm] = 0.0
        data.qpos[7 + firm] = held
        data.qpos[:2] = start
        fall, turn = np.abs(data.qvel[2]), np.abs(data.qvel[3:]).max()
        if data.time > SHORTEST_S and fall < STILL_M_S and turn < STILL_RAD_S:
            break
    model.dof_armature[:] = armature


def _rest_height_m(ground: HeightField | None, centre: Floats, radius_m: float) -> Floats:
    """Least height (L,) at which balls of ``radius_m`` at ``centre`` (L, 3) clear the ground."""
    if ground is None:
        return np.full(len(centre), radius_m)
    offsets = np.linspace(-1.0, 1.0, 9) * radius_m
    dx, dy = (each.ravel() for each in np.meshgrid(offsets, offsets))
    inside = dx**2 + dy**2 <= radius_m**2
    dx, dy = dx[inside], dy[inside]
    cap = np.sqrt(radius_m**2 - dx**2 - dy**2)
    z = ground.elevation_m(centre[:, :1] + dx, centre[:, 1:2] + dy)
    return np.asarray((z + cap).max(axis=1))
