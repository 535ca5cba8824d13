"""Velocity of a planar body from one measured shape to the next, on a level floor."""

import numpy as np

from snakewalk.config.arrays import Floats
from snakewalk.config.world import FrictionConfig
from snakewalk.controller.kinematics.links import BodyView
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
    link_table,
)
from snakewalk.controller.mechanics.rigid_motion import balance
from snakewalk.drivers.compiling import compiled, readonly_array


class BodySlide:
    """``rigid_velocity`` of a body on a level floor from one shape to the next, without copies."""

    def __init__(self, normal: Floats, friction: FrictionConfig) -> None:
        """Begin at rest.

        Args:
            normal: (L,) load of each link on the ground, in weights of a link.
            friction: of the ground.

        """
        self._normal = normal
        self._friction = friction
        self._table = link_table(len(normal))
        self._velocity, self._linear = np.zeros(3), np.zeros(3)
        self._inertia = np.zeros((3, 3))
        self._work = np.empty((9, 3))

    def set_shapes(self, before: BodyView, after: BodyView, step_s: float) -> float:
        """Set two shapes in one frame, ``step_s`` apart; return the fastest link's speed.

        The speed is the larger component in the plane, m/s.
        """
        headings_rad = before.headings_rad
        return float(
            _fill_slide(
                before.link_m,
                np.cos(headings_rad),
                np.sin(headings_rad),
                after.link_m,
                step_s,
                self._normal,
                self._table,
            )
        )

    def velocity(self) -> Floats:
        """Return (3,) the velocity as ``rigid_velocity``; the array is reused."""
        friction = self._friction
        balance(
            self._table,
            OTHERS,
            len(self._normal),
            friction.grip,
            self._linear,
            self._inertia,
            self._velocity,
            self._work,
        )
        return self._velocity


@compiled(
    f"float64({readonly_array(dimensions=2)}, {readonly_array()}, {readonly_array()},"
    f" {readonly_array(dimensions=2)}, float64, {readonly_array()}, float64[::1])",
    divides_by_zero=True,
    makes_arrays=False,
)
def _fill_slide(
    before_m: Floats,
    cosine: Floats,
    sine: Floats,
    after_m: Floats,
    step_s: float,
    normal: Floats,
    table: Floats,
) -> float:
    """Fill a ``link_table``; return the largest component of a link's velocity.

    Args:
        before_m: (L, 3) centres of the links.
        cosine: (L,) of their headings.
        sine: (L,) of their headings.
        after_m: (L, 3) centres after the step.
        step_s: duration.
        normal: (L,) loads.
        table: from ``link_table``.

    """
    fastest = 0.0
    for k in range(len(before_m)):
        base = k // LANES * OTHERS + k % LANES
        u = (after_m[k, 0] - before_m[k, 0]) / step_s
        v = (after_m[k, 1] - before_m[k, 1]) / step_s
        table[base + POINT_X], table[base + POINT_Y] = before_m[k, 0], before_m[k, 1]
        table[base + FORWARD_X], table[base + FORWARD_Y] = cosine[k], sine[k]
        table[base + SHAPE_X], table[base + SHAPE_Y] = u, v
        table[base + NORMAL] = normal[k]
        fastest = max(fastest, abs(u), abs(v))
    return fastest
