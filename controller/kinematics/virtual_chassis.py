"""The virtual chassis: a frame of the whole body that does not swing with a link.

The origin is the mean of the link centres; the axes are the links' principal axes, with signs that
never jump (D. Rollinson, H. Choset, Virtual Chassis for Snake Robots, IROS 2011).
"""

import numpy as np

from snakewalk.config.arrays import Floats
from snakewalk.controller.kinematics.frame import Frame

_EQUAL_SPREADS = 0.02
"""Spreads that differ by less than this share of the body's are taken for equal: no axis there."""


def virtual_chassis(link_m: Floats, up: Floats, last: Frame | None = None) -> Frame:
    """Return the principal axes of the body.

    Args:
        link_m: (L, 3) centres of the links, head first.
        up: (3,) the head link's up axis. It decides the signs at the start and the axis of a
            straight body.
        last: previous chassis, from which the signs are continued.

    """
    centre = link_m.mean(axis=0)
    _, spread, axes = np.linalg.svd(link_m - centre)
    forward = axes[0]
    thin = axes[2]
    guide = link_m[0] - link_m[-1] if last is None else last.rotation[:, 0]
    forward = forward if forward @ guide >= 0.0 else -forward
    guide = up if last is None else last.rotation[:, 2]
    if spread[1] - spread[2] < _EQUAL_SPREADS * spread[0]:
        thin = guide - (guide @ forward) * forward
        thin = thin / np.linalg.norm(thin)
    thin = thin if thin @ guide >= 0.0 else -thin
    axes = np.stack([forward, np.cross(thin, forward), thin], axis=1)
    return Frame(rotation=axes, origin_m=centre)
