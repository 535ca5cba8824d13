"""Placing a body on the ground or in water at rest."""

from dataclasses import dataclass
from typing import Self

import mujoco
import numpy as np
from numpy.typing import ArrayLike

from snakewalk.config.arrays import Floats, Ints
from snakewalk.config.heightfield import HeightField
from snakewalk.config.robot import RobotConfig
from snakewalk.config.world import Water, WorldConfig
from snakewalk.drivers.least_squares import least_squares
from snakewalk.sim.physics.body import belly_points_m
from snakewalk.sim.physics.mechanics import Mechanics, foot_geoms
from snakewalk.sim.physics.water import floating_height_m

DRAPE_ROUNDS = 8
DRAPE_STIFF_M_RAD = 0.01
"""Height that is given up rather than bend a joint, or lean the head, by a radian."""
SETTLE_DAMPING_PER_S = 15.0
"""Rate at which motion is damped while the body settles."""
STILL_M_S, STILL_RAD_S = 1e-3, 1e-2
SETTLE_MIN_S, SETTLE_MAX_S = 0.3, 4.0


def place(
    m: Mechanics,
    robot: RobotConfig,
    ground: HeightField | None,
    start_m: tuple[float, float],
    heading_rad: float,
    joint_rad: ArrayLike,
) -> None:
    """Place the body at rest, its head above ``start_m``, with its contact forces.

    On a height field the pitch joints bend to the ground. Then the body is lowered until it
    touches, and settles with strong damping and constant joints; the head may sink and lean, but
    not slide or turn.

    Raises:
        ValueError: ``joint_rad`` is not (J,).

    """
    model = m.model
    data = m.data
    _pose(m, start_m, heading_rad, joint_rad)
    balls = _Balls.of(robot)
    if ground is not None:
        _drape(m, robot, ground, balls)
    data.qpos[2] -= float(_clearance_m(m, robot, ground, balls).min())
    _settle(m)
    data.qvel[:] = 0.0
    m.planes.lay(data)
    mujoco.mj_forward(model, data)
    m.start_at_rest()


@dataclass(frozen=True, slots=True)
class _Balls:
    """The balls of all bellies of a robot's spine."""

    link: Ints
    """(P,) link of each."""
    along_m: Floats
    """(P, 1) position along the link's axis, from its centre."""
    aside_m: Floats
    """(P, 1) position across the link's axis."""
    radius_m: Floats
    """(P,) radius."""

    @classmethod
    def of(cls, robot: RobotConfig) -> Self:
        rows = [belly_points_m(robot, k).reshape(-1, 3) for k in range(robot.link_count)]
        link = np.repeat(np.arange(robot.link_count), [len(row) for row in rows])
        along_m, aside_m, _ = np.concatenate(rows).T[..., None]
        return cls(link, along_m, aside_m, np.array(robot.link_radii_m)[link])


def lay_down(
    m: Mechanics,
    robot: RobotConfig,
    start_m: tuple[float, float],
    heading_rad: float,
    joint_rad: ArrayLike,
) -> None:
    """Place the body on a level floor, at rest, without settling, in a millisecond.

    Its lowest link touches the floor without load. The time of the data does not change.

    Raises:
        ValueError: ``joint_rad`` is not (J,).

    """
    model = m.model
    data = m.data
    time_s = data.time
    _pose(m, start_m, heading_rad, joint_rad)
    data.qpos[2] -= float(_clearance_m(m, robot, None, _Balls.of(robot)).min())
    m.planes.lay(data)
    mujoco.mj_forward(model, data)
    m.start_at_rest()
    data.time = time_s


def float_at(
    m: Mechanics,
    robot: RobotConfig,
    world: WorldConfig,
    ground: HeightField | None,
    start_m: tuple[float, float],
    heading_rad: float,
    joint_rad: ArrayLike,
) -> bool:
    """Place a floating body at its height in water; False if it would touch the ground.

    Raises:
        ValueError: ``joint_rad`` is not (J,).

    """
    water = world.ground
    if not isinstance(water, Water) or water.buoyancy < 1.0:
        return False
    _pose(m, start_m, heading_rad, joint_rad)
    mujoco.mj_kinematics(m.model, m.data)
    height = floating_height_m(water, robot.body_radius_m)
    m.data.qpos[2] += height - float(m.data.xipos[1:, 2].mean())
    if _clearance_m(m, robot, ground, _Balls.of(robot)).min() < 0.0:
        return False
    mujoco.mj_forward(m.model, m.data)
    m.start_at_rest()
    return True


def _pose(
    m: Mechanics, start_m: tuple[float, float], heading_rad: float, joint_rad: ArrayLike
) -> None:
    q = np.asarray(joint_rad, dtype=float)
    if q.shape != (m.joint_count,):
        raise ValueError(f"joint_rad has shape {q.shape}; the robot has {m.joint_count} joints")
    mujoco.mj_resetData(m.model, m.data)
    m.data.qpos[:2] = start_m
    m.data.qpos[3:7] = np.cos(heading_rad / 2), 0.0, 0.0, np.sin(heading_rad / 2)
    m.data.qpos[7:] = q


def _drape(m: Mechanics, robot: RobotConfig, ground: HeightField, balls: _Balls) -> None:
    """Fit height, lean and pitch joints to the ground: Gauss-Newton on clearances.

    Clearances are those of the bellies, which bridge a trench and rest on an edge.
    """
    model = m.model
    data = m.data
    free = np.array([2, 3, 4, *(6 + j for j in robot.pitch_joints)])
    limit = np.array([robot.limit_rad[j] for j in robot.pitch_joints])
    pitch = 7 + np.array(robot.pitch_joints, dtype=int)
    stiff = np.full(len(free), DRAPE_STIFF_M_RAD)
    stiff[0] = 0.0

    def above_m() -> Floats:
        clear = _clearance_m(m, robot, ground, balls)
        return clear[np.isfinite(clear)]

    for _ in range(DRAPE_ROUNDS):
        rest_m = above_m()
        qpos = data.qpos.copy()
        slopes = np.empty((len(rest_m), len(free)))
        for column, dof in enumerate(free):
            step = np.zeros(model.nv)
            step[dof] = 1e-4
            mujoco.mj_integratePos(model, data.qpos, step, 1.0)
            slopes[:, column] = (above_m() - rest_m) / 1e-4
            data.qpos[:] = qpos
        change = np.zeros(model.nv)
        change[free] = least_squares(slopes, -rest_m, stiff)
        change[3:] = np.clip(change[3:], -0.3, 0.3)
        mujoco.mj_integratePos(model, data.qpos, change, 1.0)
        data.qpos[pitch] = np.clip(data.qpos[pitch], -limit, limit)


def _settle(m: Mechanics) -> None:
    model = m.model
    data = m.data
    joint_rad = data.qpos[7:].copy()
    start = data.qpos[:2].copy()
    for _ in range(int(SETTLE_MAX_S / m.step_s)):
        m.planes.lay(data)
        mujoco.mj_step(model, data)
        data.qvel[:] *= np.exp(-SETTLE_DAMPING_PER_S * m.step_s)
        data.qvel[:2] = 0.0
        data.qvel[5:] = 0.0
        data.qpos[7:] = joint_rad
        data.qpos[:2] = start
        fall = np.abs(data.qvel[2])
        turn = np.abs(data.qvel[3:]).max()
        if data.time > SETTLE_MIN_S and fall < STILL_M_S and turn < STILL_RAD_S:
            break


def _clearance_m(
    m: Mechanics, robot: RobotConfig, ground: HeightField | None, balls: _Balls
) -> Floats:
    """(L,) height of each link's belly or foot above the ground, negative below it.

    Infinite for links without support: leg segments without a foot, links of length zero.
    """
    mujoco.mj_kinematics(m.model, m.data)
    spine = robot.link_count
    link = balls.link
    axes = m.data.xmat[1 : 1 + spine].reshape(-1, 3, 3)
    # products by hand: BLAS sums in a processor-dependent order
    centres = m.data.xipos[1 : 1 + spine][link]
    points = centres + balls.along_m * axes[link, :, 0] + balls.aside_m * axes[link, :, 1]
    clear = np.full(m.joint_count + 1, np.inf)
    np.minimum.at(clear, link, points[:, 2] - _rest_height_m(ground, points, balls.radius_m))
    for foot in foot_geoms(m.model, robot):
        foot_m = m.model.geom_size[foot, :1]
        low = m.data.geom_xpos[foot : foot + 1]
        clear[m.model.geom_bodyid[foot] - 1] = low[0, 2] - _rest_height_m(ground, low, foot_m)[0]
    return clear


def _rest_height_m(ground: HeightField | None, centre: Floats, radius_m: Floats) -> Floats:
    """Least height (P,) at which balls at ``centre`` (P, 3) clear the ground."""
    if ground is None:
        return radius_m
    rest_m = np.empty(len(centre))
    for radius in np.unique(radius_m):
        offsets = np.linspace(-1.0, 1.0, 9) * radius
        dx, dy = (offset.ravel() for offset in np.meshgrid(offsets, offsets))
        inside = dx**2 + dy**2 <= radius**2
        dx, dy = dx[inside], dy[inside]
        cap = np.sqrt(radius**2 - dx**2 - dy**2)
        is_same_radius = radius_m == radius
        z = ground.elevation_m(centre[is_same_radius, :1] + dx, centre[is_same_radius, 1:2] + dy)
        rest_m[is_same_radius] = (z + cap).max(axis=1)
    return rest_m
