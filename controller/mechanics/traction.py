"""Traction of shapes: predicted gain eta_q, forward speed of the links over pulse speed."""

import numpy as np

from snakewalk.config.arrays import Floats
from snakewalk.config.world import FrictionConfig
from snakewalk.controller.mechanics.rigid_motion import rigid_velocity

_LINKS = 20


def quasi_static_gain(
    skeleton_rad: Floats, friction: FrictionConfig, links: int = _LINKS
) -> Floats:
    """Gain (S,) of each shape (S, N) at the moment at which the body shows it.

    The angles move tailwards along the body at pulse speed u. The rigid velocity that balances the
    friction of ``links`` links carries the body forward at ``eta_q u``. 1 is a body that never
    slips, below 0 it goes backwards.
    """
    shapes = np.atleast_2d(skeleton_rad)
    return np.array([_gain(shape, friction, links) for shape in shapes])


def _gain(angles: Floats, friction: FrictionConfig, links: int) -> float:
    points = len(angles)
    at = (np.arange(links) + 0.5) * points / links - 0.5
    heading = np.interp(at, np.arange(points), angles)
    # a segment of pulse moves the pattern a segment tailwards: d theta_i = theta_(i-1) - theta_i
    turning = -np.interp(at, np.arange(points), np.gradient(angles))
    along = np.stack([np.cos(heading), np.sin(heading)], axis=1)
    across = np.stack([-np.sin(heading), np.cos(heading)], axis=1) * turning[:, None]
    size = points / links  # link length in segments: the unit of length here
    place = -size * (np.cumsum(along, axis=0) - 0.5 * along)
    change = -size * (np.cumsum(across, axis=0) - 0.5 * across)
    velocity = rigid_velocity(place / points, heading, change / points, friction)
    lever = np.stack([-place[:, 1], place[:, 0]], axis=1) / points
    moved = change / points + velocity[:2] + velocity[2] * lever
    return float(np.einsum("ij,ij->i", moved, along).mean() * points)
