"""Traction of shapes: predicted gain eta_q, forward speed of the links over pulse speed."""

import numpy as np
from numpy.typing import ArrayLike

from snakewalk.config.arrays import Floats
from snakewalk.config.world import FrictionConfig
from snakewalk.controller.mechanics.link_table import (
    FORWARD_X,
    FORWARD_Y,
    LANES,
    NORMAL,
    OTHERS,
    POINT_X,
    POINT_Y,
    SHAPE_X,
    SHAPE_Y,
)
from snakewalk.controller.mechanics.rigid_motion import NoBalanceError, balance

_LINKS = 20


def quasi_static_gain(skeleton_rad: Floats, friction: FrictionConfig) -> Floats:
    """Gain (S,) of each shape (S, N) at the moment at which the body has it.

    The angles move tailwards along the body at pulse speed u. Balanced friction on 20 links
    moves the body forward at ``eta_q u``: 1 without slip, below 0 backwards.
    """
    shapes = np.atleast_2d(skeleton_rad)
    points = shapes.shape[-1]
    position = np.clip((np.arange(_LINKS) + 0.5) * points / _LINKS - 0.5, 0.0, points - 1.0)
    left = np.minimum(position.astype(int), points - 2)
    right_share = position - left

    def at_links(values: Floats) -> Floats:
        near = np.take(values, left, axis=1)  # in C order, on which the bits of sums depend
        return np.asarray((np.take(values, left + 1, axis=1) - near) * right_share + near)

    heading = at_links(shapes)
    # a segment of pulse moves the pattern a segment tailwards: d theta_i = theta_(i-1) - theta_i
    turning = -at_links(np.gradient(shapes, axis=1))
    along = np.stack([np.cos(heading), np.sin(heading)], axis=-1)
    across = np.stack([-np.sin(heading), np.cos(heading)], axis=-1) * turning[..., None]
    size = points / _LINKS  # link length in segments, the unit of length here
    place = -size * (np.cumsum(along, axis=1) - 0.5 * along)
    change = -size * (np.cumsum(across, axis=1) - 0.5 * across)
    velocity = rigid_velocities(place / points, heading, change / points, friction)[:, None]
    lever = np.stack([-place[..., 1], place[..., 0]], axis=-1) / points
    moved = change / points + velocity[..., :2] + velocity[..., 2:] * lever
    return np.asarray(np.einsum("sij,sij->si", moved, along).mean(axis=-1) * points)


def rigid_velocities(
    points_m: Floats, headings_rad: Floats, shape_m_s: Floats, friction: FrictionConfig
) -> Floats:
    """Return ``rigid_velocity`` (S, 3) of many bodies on level ground.

    Args:
        points_m: (S, L, 2) link centres in the body frames.
        headings_rad: (S, L) link headings in the body frames.
        shape_m_s: (S, L, 2) velocities of the links relative to the body frames.
        friction: of the ground; every link carries the same weight.

    Raises:
        NoBalanceError: the iteration does not converge.

    """
    bodies, links = headings_rad.shape
    groups = -(-links // LANES)
    tables = np.zeros((bodies, groups, OTHERS))
    columns: tuple[tuple[int, ArrayLike], ...] = (
        (POINT_X, points_m[..., 0]),
        (POINT_Y, points_m[..., 1]),
        (FORWARD_X, np.cos(headings_rad)),
        (FORWARD_Y, np.sin(headings_rad)),
        (SHAPE_X, shape_m_s[..., 0]),
        (SHAPE_Y, shape_m_s[..., 1]),
        (NORMAL, 1.0),
    )
    for row, values in columns:
        padded = np.zeros((bodies, groups * LANES))
        padded[:, :links] = values
        tables[..., row : row + LANES] = padded.reshape(bodies, groups, LANES)
    velocities = np.zeros((bodies, 3))
    linear = np.zeros(3)
    quadratic = np.zeros((3, 3))
    for table, velocity in zip(tables.reshape(bodies, -1), velocities, strict=True):
        is_balanced = balance(
            table,
            OTHERS,
            links,
            friction.grip,
            linear,
            quadratic,
            velocity,
            np.empty((9, 3)),
        )
        if not is_balanced:
            raise NoBalanceError
    return velocities
