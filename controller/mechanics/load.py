"""Joint loads: torque that the joints hold against the Coulomb friction of the links."""

import numpy as np

from snakewalk.config.arrays import Floats
from snakewalk.config.friction_law import gauges
from snakewalk.config.world import FrictionConfig

_STILL_SPEED_M_S = 1e-4


def friction_n(
    velocity_m_s: Floats, headings_rad: Floats, friction: FrictionConfig, weight_n: float
) -> Floats:
    """Force (L, 2) of level ground on sliding links.

    Args:
        velocity_m_s: (L, 2) of the link centres.
        headings_rad: (L,) link headings.
        friction: of the ground.
        weight_n: on each link.

    """
    cos, sin = np.cos(headings_rad), np.sin(headings_rad)
    along = cos * velocity_m_s[:, 0] + sin * velocity_m_s[:, 1]
    across = cos * velocity_m_s[:, 1] - sin * velocity_m_s[:, 0]
    mu_forward, mu_across, mu_back, law = friction.grip
    mu_along = np.where(along >= 0.0, mu_forward, mu_back)
    share_a, share_c, gauge_a, gauge_c = gauges(int(law), mu_along, mu_across, along, across)
    still = share_c * _STILL_SPEED_M_S
    ahead = -mu_along * share_a * along / np.hypot(gauge_a, still)
    left = -mu_across * share_c * across / np.hypot(gauge_c, still)
    return weight_n * np.stack([cos * ahead - sin * left, sin * ahead + cos * left], 1)


def yaw_load_n_m(
    centres_m: Floats, headings_rad: Floats, link_lengths_m: Floats, force_n: Floats
) -> Floats:
    """Moment (J,) about the vertical that each joint holds, without acceleration.

    It is the moment about the joint of the ground forces on the body behind it.

    Args:
        centres_m: (L, 2) link centres, head first.
        headings_rad: (L,)
        link_lengths_m: (L,) axis to axis; joint j is at the back end of link j.
        force_n: (L, 2) of the ground on each link.

    """
    ahead = np.stack([np.cos(headings_rad), np.sin(headings_rad)], axis=1)
    back = ahead * (-0.5 * link_lengths_m[:, None])
    joints_m = (centres_m + back)[:-1]
    behind = _tail_sums(force_n)[1:]
    about_origin = _tail_sums(_cross(centres_m, force_n))[1:]
    return about_origin - _cross(joints_m, behind)


def _tail_sums(values: Floats) -> Floats:
    return values[::-1].cumsum(axis=0)[::-1]


def _cross(a: Floats, b: Floats) -> Floats:
    return a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0]
