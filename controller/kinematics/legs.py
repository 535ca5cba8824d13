"""Positions of leg segments, from the spine and the joint angles."""

import numpy as np

from snakewalk.config.arrays import Floats
from snakewalk.config.robot import RobotConfig
from snakewalk.controller.kinematics.links import BodyView


def leg_segments_m(robot: RobotConfig, body: BodyView, joint_rad: Floats) -> Floats:
    """Return (S, 2, 3): the joint and the far end of each leg segment, in the bus's order.

    Args:
        robot: the robot with legs.
        body: spine in the world.
        joint_rad: (J,) angles of all joints, spine first.

    """
    segments_m = np.empty((len(robot.limb_joints), 2, 3))
    turn = np.eye(3)
    end_m = np.zeros(3)
    for k, (joint, angle) in enumerate(
        zip(robot.limb_joints, joint_rad[robot.link_count - 1 :], strict=True)
    ):
        pair = robot.limbs[joint.pair]
        side = joint.outward
        if joint.place == 0:
            turn = body.rotation[pair.link]
            end_m = body.link_m[pair.link] + side * pair.hip_m * turn[:, 1]
        c, s = np.cos(angle), side * np.sin(angle)
        if pair.joint_axes[joint.place] == "y":  # positive swings forward
            turn = turn @ np.array([[c, s, 0.0], [-s, c, 0.0], [0.0, 0.0, 1.0]])
        else:  # positive lifts
            turn = turn @ np.array([[1.0, 0.0, 0.0], [0.0, c, -s], [0.0, s, c]])
        segments_m[k, 0] = end_m
        end_m = end_m + side * pair.segments_m[joint.place] * turn[:, 1]
        segments_m[k, 1] = end_m
    return segments_m
