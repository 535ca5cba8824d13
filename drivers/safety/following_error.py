"""Following error: a joint that does not go where its goal is, though its servo could.

A joint lags behind its goal as long as it moves, by what its P gain needs for the speed and load;
that is honest, and bounded by the error at which the output is full. Beyond it, for a time, the
joint is blocked, has no power, obeys another program, or is not the joint it is taken for. A
current-limited joint may be held off its goal by the ground for as long as the ground is there; but
then its servo pushes with all the current it is allowed.
"""

import numpy as np

from snakewalk.config.arrays import Bools, Floats
from snakewalk.drivers.compiling import compiled, readonly_array
from snakewalk.drivers.safety.limits import SafetyLimits
from snakewalk.drivers.types import JointState

_FLOATS = readonly_array()


class FollowingError:
    """Since when each joint does not follow; ``update`` with every state."""

    def __init__(self, limits: SafetyLimits) -> None:
        self._limits = limits
        self._since_s = np.full(len(limits.limit_rad), np.nan)

    def reset(self) -> None:
        """Forget what was: the joints rest at their goals."""
        self._since_s[:] = np.nan

    def update(self, state: JointState, goal_rad: Floats) -> str | None:
        """Take in a state and the goals (J,) that were sent before it; why to stop, or None."""
        limits = self._limits
        joint = _longest(
            *(goal_rad, state.position_rad, state.current_a, state.valid, state.time_s),
            *(limits.following_limit_rad, limits.following_effort_a, self._since_s),
        )
        if joint < 0:
            return None
        for_s = state.time_s - self._since_s[joint]
        if not for_s >= limits.following_time_s:
            return None
        error_rad = goal_rad[joint] - state.position_rad[joint]
        return (
            f"{limits.joint_names[joint]}: {abs(error_rad):.2f} rad from its goal for {for_s:.2f} "
            f"s with {state.current_a[joint]:.2f} A: it does not follow: is it blocked, weakened "
            "by another program, or another joint's servo?"
        )


@compiled(
    f"int64({_FLOATS}, {_FLOATS}, {_FLOATS}, {readonly_array('boolean')}, float64, {_FLOATS},"
    f" {_FLOATS}, float64[::1])",
    makes_arrays=False,
)
def _longest(
    goal_rad: Floats,
    position_rad: Floats,
    current_a: Floats,
    valid: Bools,
    time_s: float,
    limit_rad: Floats,
    effort_a: Floats,
    since_s: Floats,
) -> int:
    """Note since when each joint does not follow; the joint that has not for longest, or -1.

    A joint that was not read keeps its time.
    """
    longest = -1
    for k in range(len(goal_rad)):
        error = goal_rad[k] - position_rad[k]
        if valid[k]:
            towards_a = current_a[k] if error > 0.0 else -current_a[k]
            if abs(error) > limit_rad[k] and towards_a < effort_a[k]:
                if np.isnan(since_s[k]):
                    since_s[k] = time_s
            else:
                since_s[k] = np.nan
        if not np.isnan(since_s[k]) and (longest < 0 or since_s[k] < since_s[longest]):
            longest = k
    return longest
