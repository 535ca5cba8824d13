"""The load of a slope on a planar body: normal to the ground and down the slope."""

import numpy as np

from snakewalk.config.arrays import Floats
from snakewalk.config.heightfield import HeightField
from snakewalk.config.world import FrictionConfig
from snakewalk.controller.mechanics.rigid_motion import NoBalanceError, rigid_velocity

_HALVINGS = 20


def slope_load(ground: HeightField | None, link_m: Floats) -> tuple[Floats, Floats]:
    """Gravity on each link in weights of a link: (L, 2) along the ground in plan, (L,) into it.

    Args:
        ground: None is a level floor.
        link_m: (L, 2 or more) link centres in the world.

    """
    if ground is None:
        return np.zeros((len(link_m), 2)), np.ones(len(link_m))
    _, gx, gy = ground.plane(link_m[:, 0], link_m[:, 1])
    normal = 1.0 / np.sqrt(1.0 + gx**2 + gy**2)
    return np.stack([-gx * normal, -gy * normal], axis=1), normal


def holding_factor(
    points_m: Floats,
    headings_rad: Floats,
    friction: FrictionConfig,
    tangential: Floats,
    normal: Floats,
) -> float:
    """Largest factor on ``tangential``, at most 1, at which friction still holds the body."""
    still = np.zeros_like(points_m)
    low = 0.0
    high = 1.0
    for _ in range(_HALVINGS):
        factor = 0.5 * (low + high)
        try:
            rigid_velocity(
                points_m,
                headings_rad,
                still,
                friction,
                tangential=factor * tangential,
                normal=normal,
            )
            low = factor
        except NoBalanceError:
            high = factor
    return low
