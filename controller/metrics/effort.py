"""Effort of a gait from its log: electrical power, cost of transport, slip."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from snakewalk.config.arrays import Floats
from snakewalk.config.constants import GRAVITY_M_S2
from snakewalk.config.robot import RobotConfig
from snakewalk.controller.kinematics.links import body_in_world
from snakewalk.controller.metrics.ground_contact import CLEAR_M
from snakewalk.controller.motion.stop_profile import STOP_S
from snakewalk.controller.runlog.record import RunRecord
from snakewalk.drivers.types import BodyPose


@dataclass(frozen=True, slots=True)
class Winding:
    """Constants of a motor that give electrical power from current and speed."""

    resistance_ohm: float
    back_emf_v_s: float
    """Volts at one radian a second of the output shaft."""


@dataclass(frozen=True, slots=True)
class Effort:
    """Means over the time at full rate; NaN where the log does not hold what is needed."""

    power_w: float
    """Electrical, all motors, mean; what they give back is lost."""
    cost_of_transport: float
    """Power over weight times net speed; without the servos' own electronics."""
    climb_m_s: float
    slip: float
    """Distance that touching links slide sideways, over that of the centre; flat floors only."""


def effort(record: RunRecord, from_s: float, motor: Winding | None) -> Effort:
    """Return the effort of a gait run from ``from_s`` after the start until it stops.

    ``motor`` is that of the robot's servos; with None, all numbers are NaN.
    """
    header, cycle, pose = record.header, record.cycle, record.pose
    unknown = Effort(*(float("nan"),) * 4)
    end_s = record.end_s - STOP_S
    steady = (pose.time_s >= from_s) & (pose.time_s <= end_s)
    if motor is None or steady.sum() < 2 or not np.isfinite(pose.links_m[steady]).all():
        return unknown
    during = (cycle.time_s >= from_s) & (cycle.time_s <= end_s)
    current, speed = cycle.current_a[during], cycle.velocity_rad_s[during]
    # i^2 R is heat, k_e w i is work at the shaft with the losses of the gears
    watts = motor.resistance_ohm * current**2 + motor.back_emf_v_s * speed * current
    power = float(np.nanmean(np.clip(watts, 0.0, None).sum(axis=1)))
    span_s = float(pose.time_s[steady][-1] - pose.time_s[steady][0])
    moved_m = pose.centre_m[steady][-1] - pose.centre_m[steady][0]
    net_m_s = float(np.linalg.norm(moved_m)) / span_s
    weight_n = header.robot.link_mass_kg * (header.robot.joint_count + 1) * GRAVITY_M_S2
    cost = power / (weight_n * net_m_s) if net_m_s > 1e-6 else float("inf")
    return Effort(power, cost, float(moved_m[2]) / span_s, _slip(record, steady))


def _slip(record: RunRecord, steady: NDArray[np.bool_]) -> float:
    """Sideways distance of the lowest point of touching links, over the centre's distance."""
    header, pose = record.header, record.pose
    if header.world.ground.kind != "flat" or header.world.obstacle is not None:
        return float("nan")
    links, centre = pose.links_m[steady], pose.centre_m[steady]
    joints = record.cycle.measured_rad[np.searchsorted(record.cycle.time_s, pose.time_s[steady])]
    frames = _link_rotations(header.robot, pose.rotation[steady], joints)
    # the turn from one cycle to the next as a vector: half the skew part of R' R^T, for small turns
    turned = frames[1:] @ np.swapaxes(frames[:-1], -1, -2)
    skew = 0.5 * (turned - np.swapaxes(turned, -1, -2))
    turn = np.stack([skew[..., 2, 1], skew[..., 0, 2]], axis=-1)
    radius_m = header.robot.body_radius_m
    # v + w x (-r z): the point under the centre
    move = np.diff(links[..., :2], axis=0) + radius_m * np.stack([-turn[..., 1], turn[..., 0]], -1)
    forward = frames[:-1, :, :2, 0]
    across = np.abs(forward[..., 0] * move[..., 1] - forward[..., 1] * move[..., 0])
    touches = links[:-1, :, 2] < radius_m + CLEAR_M
    slid_m = float((across * touches).sum()) / links.shape[1]
    gone_m = float(np.linalg.norm((centre[-1] - centre[0])[:2]))
    return slid_m / gone_m if gone_m > 1e-3 else float("nan")


def _link_rotations(robot: RobotConfig, head: Floats, joint_rad: Floats) -> Floats:
    """(T, L, 3, 3) axes of all links from the head's (T, 3, 3) and joint angles (T, J)."""
    poses = (BodyPose(0.0, np.zeros(3), rotation) for rotation in head)
    bodies = (body_in_world(robot, *row) for row in zip(poses, joint_rad, strict=True))
    return np.array([body.rotation for body in bodies])
