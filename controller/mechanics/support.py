"""Support: weight that the ground bears under each link, from the torque of the joints.

Quasi-static, with vertical support forces: weight, support and the joint's torque balance on the
body behind each pitch joint. The torques are linear in the support; the whole body adds three
equations. Links outnumber equations, but the ground only pushes. Non-negative least squares (C. L.
Lawson, R. J. Hanson, Solving Least Squares Problems, 1974) finds the few links that bear.
"""

import numpy as np
import scipy  # its modules load when they are first used: optimize needs 0.3 s

from snakewalk.config.arrays import Bools, Floats
from snakewalk.config.constants import GRAVITY_M_S2
from snakewalk.config.robot import RobotConfig
from snakewalk.controller.kinematics.links import (
    BodyView,
    chain_axes,
    chain_points_m,
    link_weights,
)

TORQUE_NOISE_N_M = 0.005
"""Error of a torque against which an even load weighs: two units of Present Current (ours)."""
LIFTED_SHARE = 0.1
"""A link that bears less than this share of its weight is taken to be lifted (ours)."""


def support_n(robot: RobotConfig, body: BodyView, torque_n_m: Floats) -> Floats:
    """Vertical force (L,) of the ground on each link, 0 or more.

    Args:
        robot: links and joints.
        body: poses of the links.
        torque_n_m: (J,) of the servos; only pitch joints are used.

    """
    links = robot.joint_count + 1
    weight_n = robot.mean_link_mass_kg * GRAVITY_M_S2
    share = link_weights(robot)
    joints_m = chain_points_m(robot, body)[1:-1]
    axes = chain_axes(robot, body)
    pitch = np.array(robot.pitch_joints, dtype=int)
    # lever (P, L): moment about a joint's axis of an upward unit force on a link behind it
    arm_m = body.link_m[None] - joints_m[pitch, None]
    lever_m = axes[pitch, None, 0] * arm_m[..., 1] - axes[pitch, None, 1] * arm_m[..., 0]
    lever_m = np.where(np.arange(links) > pitch[:, None], lever_m, 0.0)
    middle_m = body.link_m - body.centre_m
    profile = np.stack([np.full(links, robot.mean_link_length_m), middle_m[:, 0], middle_m[:, 1]])
    even = np.eye(links) * (TORQUE_NOISE_N_M / weight_n)
    rows = np.concatenate([lever_m, profile, even])
    target = (rows * share).sum(axis=1) * weight_n
    target[: len(pitch)] -= torque_n_m[pitch]
    return np.asarray(scipy.optimize.nnls(rows, target)[0])


def lifted(robot: RobotConfig, bears_n: Floats) -> Bools:
    """Whether each link is lifted, from the supporting force; any shape."""
    weight_n = robot.mean_link_mass_kg * link_weights(robot) * GRAVITY_M_S2
    return np.asarray(bears_n < LIFTED_SHARE * weight_n)
