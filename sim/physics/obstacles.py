"""Pole, pipe, pegs and walls in the model, and the placing of a coil at pole and pipe.

Bodies touch them with MuJoCo's own isotropic friction (``condim`` 3).
"""

import math
from dataclasses import dataclass

import mujoco
import numpy as np
from numpy.typing import ArrayLike
from scipy.optimize import least_squares
from scipy.spatial.transform import Rotation

from snakewalk.config.arrays import Floats
from snakewalk.config.robot import RobotConfig
from snakewalk.config.world import (
    CorridorObstacle,
    PegsObstacle,
    PipeObstacle,
    PoleObstacle,
    WorldConfig,
)
from snakewalk.sim.physics.mechanics import Mechanics
from snakewalk.sim.physics.solids import middle_m, solids

TAIL_UP_M = 0.01
"""Height of the lowest link above the floor at the start."""
COIL_MIN_RAD = 2.0
"""A body that turns less about its axis is not a coil."""
START_DEPTH_M = 0.005
"""Largest depth in an obstacle at which a body may start: contacts are soft and push it out at
once."""
OBSTACLE = "obstacle"
"""Prefix of the names of an obstacle's geoms."""


def obstacle_mjcf(world: WorldConfig) -> tuple[str, str]:
    """Options and geoms of the world's obstacle, as MJCF; empty without an obstacle."""
    thing = world.obstacle
    if thing is None:
        return "", ""
    common = f'contype="1" conaffinity="2" condim="3" priority="1" friction="{thing.friction!r}"'
    text = ""
    for k, part in enumerate(solids(thing)):
        size = " ".join(repr(float(v)) for v in part.half_m)
        xyxes = " ".join(repr(float(v)) for v in (*part.axes[:, 0], *part.axes[:, 1]))
        pos = " ".join(repr(float(v)) for v in part.centre_m)
        colour = " ".join(f"{v:g}" for v in part.colour)
        text += (
            f'<geom name="{OBSTACLE}{k}" type="{part.kind}" size="{size}" pos="{pos}" '
            f'xyaxes="{xyxes}" rgba="{colour}" {common}/>'
        )
    return ' cone="elliptic" impratio="10"', text


def start_fault(m: Mechanics, world: WorldConfig) -> str | None:
    """Why a placed body cannot start, because it is in a peg or wall; or None.

    A coil at a pole or in a pipe touches it on purpose.
    """
    contact = m.data.contact
    if not isinstance(world.obstacle, PegsObstacle | CorridorObstacle):
        return None
    for pair, depth_m in zip(contact.geom, -contact.dist, strict=True):
        things = [k for k in pair if m.model.geom(k).name.startswith(OBSTACLE)]
        if depth_m > START_DEPTH_M and things:
            link = int(m.model.geom_bodyid[pair].max()) - 1
            x, y, _ = m.model.geom(things[0]).pos
            return (
                f"link {link} would start {depth_m * 1e3:.0f} mm inside the obstacle at "
                f"({x:.2f}, {y:.2f}): move start_m, turn start_heading_rad, or move the obstacle"
            )
    return None


def place_at_obstacle(
    m: Mechanics, robot: RobotConfig, world: WorldConfig, heading_rad: float, joint_rad: ArrayLike
) -> bool:
    """Place a coiled body round the world's pole, or any body in its pipe, head up, at rest.

    The coil is opened or closed until it just touches. Returns False, without effect, for other
    worlds, or for a pole and no coil.

    Raises:
        ValueError: ``joint_rad`` is not (J,).

    """
    thing = world.obstacle
    q = np.asarray(joint_rad, dtype=float)
    if not isinstance(thing, PoleObstacle | PipeObstacle):
        return False
    if q.shape != (m.joint_count,):
        raise ValueError(f"joint_rad has shape {q.shape}; the robot has {m.joint_count} joints")
    coil = fit_coil(_links_m(m, q))
    winds = coil.wound_rad >= COIL_MIN_RAD
    if isinstance(thing, PoleObstacle) and not winds:
        return False
    if winds:
        q = _touching(m, robot, thing, q)
        coil = fit_coil(_links_m(m, q))
    up = np.array([0.0, 0.0, 1.0]) if thing.upright else np.array([1.0, 0.0, 0.0])
    turn = _rotation(coil.axis, up, heading_rad)
    place = middle_m(thing) - turn @ coil.centre_m
    links = _links_m(m, q) @ turn.T + place
    if thing.upright:
        place[2] += robot.body_radius_m + TAIL_UP_M - links[:, 2].min()
    quaternion = np.empty(4)
    mujoco.mju_mat2Quat(quaternion, turn.ravel())
    mujoco.mj_resetData(m.model, m.data)
    m.data.qpos[:3], m.data.qpos[3:7], m.data.qpos[7:] = place, quaternion, q
    mujoco.mj_forward(m.model, m.data)
    m.start_at_rest()
    return True


def _links_m(m: Mechanics, joint_rad: Floats) -> Floats:
    """(L, 3) centres of the links with the head at 0 along x."""
    m.data.qpos[:7] = 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0
    m.data.qpos[7:] = joint_rad
    mujoco.mj_kinematics(m.model, m.data)
    links: Floats = m.data.xipos[1:].copy()
    return links


def _touching(
    m: Mechanics, robot: RobotConfig, thing: PoleObstacle | PipeObstacle, q: Floats
) -> Floats:
    """Scale the bends of a coil until it just clears the obstacle."""
    pole = isinstance(thing, PoleObstacle)
    limit_m = thing.radius_m + (1.0 if pole else -1.0) * robot.body_radius_m

    def clears(scale: float) -> bool:
        radius = fit_coil(_links_m(m, scale * q)).radius_m
        return bool(radius.min() >= limit_m if pole else radius.max() <= limit_m)

    if clears(1.0):
        return q
    good, bad = (0.4, 1.0) if pole else (2.5, 1.0)
    for _ in range(20):
        middle = 0.5 * (good + bad)
        good, bad = (middle, bad) if clears(middle) else (good, middle)
    return good * q


def _rotation(line: Floats, up: Floats, about_rad: float) -> Floats:
    """(3, 3) rotation of unit ``line`` to ``up``, then about it."""
    upright = Rotation.align_vectors(up, line)[0]
    return (Rotation.from_rotvec(about_rad * up) * upright).as_matrix()


@dataclass(frozen=True, slots=True)
class Coil:
    """Cylinder through the links of a body."""

    axis: Floats
    """(3,) unit, from tail to head."""
    centre_m: Floats
    """(3,) on the axis, next to the middle of the body."""
    radius_m: Floats
    """(L,) distance of each link's centre from the axis."""
    wound_rad: float
    """Angle by which a body winds around a pole or a pipe."""


def fit_coil(links_m: Floats) -> Coil:
    """Cylinder through points (L, 3) of a helix: least squares of the distances from its axis."""
    bends = np.diff(links_m, n=2, axis=0)
    axis = np.linalg.svd(bends)[2][2] if np.abs(bends).max() > 1e-9 else links_m[0] - links_m[-1]
    axis = axis / np.linalg.norm(axis)
    side = np.linalg.svd(axis[None])[2][1:]
    middle = links_m.mean(axis=0)

    def distances(x: Floats) -> Floats:
        away = links_m - middle - x[2:4] @ side
        line = axis + x[:2] @ side
        line = line / np.linalg.norm(line)
        return np.asarray(np.linalg.norm(away - (away @ line)[:, None] * line, axis=1))

    def spread(x: Floats) -> Floats:
        d = distances(x)
        return np.asarray(d - d.mean())

    start = np.zeros(4)
    if np.abs(bends).max() > 1e-9:
        start = least_squares(spread, start, x_scale=0.1).x
    line = axis + start[:2] @ side
    line /= np.linalg.norm(line)
    line *= math.copysign(1.0, float(line @ (links_m[0] - links_m[-1])))
    centre = middle + start[2:4] @ side
    around = np.linalg.svd(line[None])[2][1:]
    x, y = around @ (links_m - centre).T
    unwrapped_rad = np.unwrap(np.arctan2(y, x))
    winds = abs(float(unwrapped_rad[-1] - unwrapped_rad[0])) if np.hypot(x, y).min() > 1e-6 else 0.0
    return Coil(line, centre, distances(start), winds)
