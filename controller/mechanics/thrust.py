"""Thrust of a joint motion: the forward speed predicted by the traction model."""

import numpy as np

from snakewalk.config.arrays import Floats
from snakewalk.config.robot import RobotConfig
from snakewalk.config.world import FrictionConfig
from snakewalk.controller.kinematics.links import SpineLinks, link_weights, pose_at
from snakewalk.controller.mechanics.body_slide import BodySlide

_STEPS = 400
"""Most steps into which a motion is divided (ours): a wave of the body has 30 or more."""
_STILL_SPEED_M_S = 1e-6


def forward_speed_m_s(
    robot: RobotConfig, friction: FrictionConfig, time_s: Floats, joint_rad: Floats
) -> float:
    """Return the mean speed of the links in the direction of the body's mean heading.

    The quasi-static balance of friction on a level floor gives each link's velocity. A standing
    wave has about 0, a backward motion a negative speed.

    Args:
        robot: chain of links.
        friction: of the ground.
        time_s: (T,) increasing, T at least 2.
        joint_rad: (T, J) joint angles.

    """
    spine = SpineLinks.of(robot)
    slide = BodySlide(link_weights(robot), friction)
    even_s = np.linspace(time_s[0], time_s[-1], min(len(time_s), _STEPS + 1))
    joints = np.stack([np.interp(even_s, time_s, column) for column in joint_rad.T], axis=1)
    level = pose_at(np.zeros(3), 0.0)
    step_s = float(even_s[1] - even_s[0])
    forward_m = 0.0
    before = spine.in_world(level, joints[0])
    for row in joints[1:]:
        after = spine.in_world(level, row)
        if slide.set_shapes(before, after, step_s) > _STILL_SPEED_M_S:
            u, v, turn_rad_s = slide.velocity()
            place_m = before.link_m[:, :2]
            moved_m = after.link_m[:, :2] - place_m
            moved_m = moved_m + step_s * (
                np.array([u, v]) + turn_rad_s * np.stack([-place_m[:, 1], place_m[:, 0]], axis=1)
            )
            ahead = np.array([np.cos(before.heading_rad), np.sin(before.heading_rad)])
            forward_m += float((moved_m @ ahead).mean())
        before = after
    return forward_m / float(even_s[-1] - even_s[0])
