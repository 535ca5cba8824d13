"""The virtual chassis: a frame that goes with the whole body.

A link of a snake swings to and fro; the virtual chassis (D. Rollinson, H. Choset, Virtual Chassis
for Snake Robots, IROS 2011) does not: its origin is the centre of mass, its axes are the principal
axes of the links, with signs that follow the body and never jump.
"""

import numpy as np

from snakewalk.config.arrays import Floats
from snakewalk.controller.kinematics.frame import Frame

_FLAT = 0.02
"""Spreads that differ by less than this share of the body's are taken for equal: no axis there."""


def virtual_chassis(link_m: Floats, up: Floats, last: Frame | None = None) -> Frame:
    """Principal axes of the body.

    Args:
        link_m: (L, 3) centres of the links, head first.
        up: (3,) a direction that goes with the body, the head link's up axis; it decides where
            the links do not: signs at the start, and a body that is straight.
        last: the chassis a moment ago, from which the signs are carried on.

    """
    centre = link_m.mean(axis=0)
    _, spread, axes = np.linalg.svd(link_m - centre)
    forward, thin = axes[0], axes[2]
    guide = link_m[0] - link_m[-1] if last is None else last.rotation[:, 0]
    forward = forward if forward @ guide >= 0.0 else -forward
    guide = up if last is None else last.rotation[:, 2]
    if spread[1] - spread[2] < _FLAT * spread[0]:
        thin = guide - (guide @ forward) * forward
        thin = thin / np.linalg.norm(thin)
    thin = thin if thin @ guide >= 0.0 else -thin
    axes = np.stack([forward, np.cross(thin, forward), thin], axis=1)
    return Frame(rotation=axes, origin_m=centre)
