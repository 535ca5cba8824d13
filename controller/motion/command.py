"""Commands of another program to the joints of a robot."""

from collections.abc import Sequence
from typing import NamedTuple

from snakewalk.config.arrays import Floats
from snakewalk.controller.gaits.gait import Gait

LATE_S = 1.0
"""An operator's command that is older is dropped (ours): its user no longer expects it."""
TIMEOUT_S = 1.0
"""Time for which joints go on towards goals that nobody renews (ours)."""
POINTS_MAX = 500
"""Largest number of points of a trajectory, which is splined and checked within a cycle."""
JOINTS_MAX = 256
"""Joints that a command may name (ours): a robot has at most 200."""
LINE_BYTES = 1 << 20
"""Longest command on its way to the run: a trajectory of 500 points for 64 joints (ours)."""


class JointGoals(NamedTuple):
    """Move to these angles as fast as the limits allow; other joints keep their goals."""

    joints: Sequence[str]
    position_rad: Sequence[float]


class JointTrajectory(NamedTuple):
    """Pass these points at these times; other joints stop."""

    joints: Sequence[str]
    time_s: Floats
    """(N,) from the start, growing."""
    position_rad: Floats
    """(N, K) for the K joints named."""
    velocity_rad_s: Floats | None = None
    """(N, K) velocities of the joints at the points, rad/s."""
    acceleration_rad_s2: Floats | None = None
    """(N, K), with velocities only."""


class StartGait(NamedTuple):
    """Move by this gait until another command."""

    gait: Gait


class Velocity(NamedTuple):
    """Move along the body and turn; without renewal the body comes to rest."""

    forward_m_s: float
    turn_rad_s: float
    """Positive to the left."""


class GoTo(NamedTuple):
    """Go to a point of the ground; drop the remaining waypoints."""

    x_m: float
    y_m: float


class HoldStill(NamedTuple):
    """Come to rest at the present angles."""


class Refused(NamedTuple):
    """A command that could not be read."""

    why: str


Command = JointGoals | JointTrajectory | StartGait | Velocity | GoTo | HoldStill | Refused
