"""A body without inertia that slides on a plane by a friction."""

import numpy as np

from snakewalk.config.heightfield import HeightField
from snakewalk.config.loader import load_robot
from snakewalk.config.world import FrictionConfig
from snakewalk.controller.kinematics.links import BodyView, body_in_world, mean_heading_rad
from snakewalk.controller.mechanics.rigid_motion import rigid_velocity
from snakewalk.controller.mechanics.slope_load import slope_load
from snakewalk.drivers.types import BodyPose

ROBOT = load_robot("yaw16")
FILE = FrictionConfig(along=0.1, across=0.7)
CYCLE_S = 0.02


def posed(joint_rad: np.ndarray, heading_rad: float, centre_m: np.ndarray) -> BodyView:
    """The body with its centre and mean heading there."""
    turn = heading_rad - mean_heading_rad(ROBOT, joint_rad)
    c, s = np.cos(turn), np.sin(turn)
    rotation = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
    there = body_in_world(ROBOT, BodyPose(0.0, np.zeros(3), rotation), joint_rad)
    head_m = np.append(centre_m, 0.03) - there.centre_m * [1.0, 1.0, 0.0]
    return body_in_world(ROBOT, BodyPose(0.0, head_m, rotation), joint_rad)


def joints_rad(time_s: float) -> np.ndarray:
    """A wave that turns one way and the other."""
    phase = 2.0 * np.pi * (0.4 * time_s + np.arange(ROBOT.joint_count) / 14.0)
    return np.asarray(0.4 * np.sin(phase) + 0.05 * np.sin(0.7 * time_s))


def sliding(
    friction: FrictionConfig,
    seconds: float,
    later: FrictionConfig | None = None,
    ground: HeightField | None = None,
) -> list[BodyView]:
    """A body that slides by a friction, from half of the time on by another, a cycle a step.

    The ground is a plane, None a level floor.
    """
    centre_m, heading = np.zeros(2), 0.3
    views = [posed(joints_rad(0.0), heading, centre_m)]
    for k in range(round(seconds / CYCLE_S)):
        here = views[-1]
        there = posed(joints_rad((k + 1) * CYCLE_S), heading, centre_m)
        tangential, normal = slope_load(ground, here.link_m)
        velocity = rigid_velocity(
            (0.5 * (here.link_m + there.link_m) - here.centre_m)[:, :2],
            0.5 * (here.headings_rad + there.headings_rad),
            (there.link_m - here.link_m)[:, :2] / CYCLE_S,
            friction if later is None or k * CYCLE_S < 0.5 * seconds else later,
            tangential=tangential,
            normal=normal,
        )
        centre_m = centre_m + velocity[:2] * CYCLE_S
        heading += float(velocity[2]) * CYCLE_S
        views.append(posed(joints_rad((k + 1) * CYCLE_S), heading, centre_m))
    return views
