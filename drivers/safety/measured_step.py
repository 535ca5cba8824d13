"""Measured steps: a joint cannot jump from one reading to the next.

A reply with a correct checksum may be another servo's (two with one ID, exchanged IDs) or invented.
A joint that is measured farther from its last credible angle than any servo turns in that time
counts as not read: it keeps its old values, which age. If it stays away, the state becomes stale
and the run stops.
"""

import math

import numpy as np

from snakewalk.config.arrays import Bools, Floats
from snakewalk.drivers.compiling import compiled, readonly_array
from snakewalk.drivers.safety.limits import SafetyLimits
from snakewalk.drivers.types import JointState

_FLOATS = readonly_array()


class MeasuredSteps:
    """Selects credible angles; ``update`` with every state."""

    def __init__(self, limits: SafetyLimits) -> None:
        self._limits = limits
        self.joint = -1
        """Joint of the newest doubt."""
        self._doubted_rad: Floats | None = None
        """(J,) readings that are doubted; NaN where the last reading was accepted."""

    def reset(self) -> None:
        """Forget the doubted values: the joints were read again."""
        self._doubted_rad = None

    def update(self, state: JointState, believed: JointState) -> tuple[JointState, str | None]:
        """The credible part of a state, and a line about the rest.

        A joint that is read again at a doubted angle stays in doubt, whatever the time: nothing was
        read in between.

        Returns:
            The state, with old values and ages for unread and doubted joints; and a description of
            the doubted values, or None.

        """
        limits = self._limits
        doubted_rad = self._doubted_rad
        if doubted_rad is None and _is_all_believable(
            state.position_rad,
            state.age_s,
            state.valid,
            state.time_s,
            believed.position_rad,
            believed.age_s,
            believed.time_s,
            limits.step_slack_rad,
            limits.step_rate_rad_s,
        ):
            return state, None
        position_rad, slack_rad = state.position_rad, limits.step_slack_rad
        step_rad = np.abs(position_rad - believed.position_rad)
        measured_s = believed.time_s - believed.age_s
        between_s = np.maximum(state.time_s - state.age_s - measured_s, 0.0)
        # the vetting rejects values that are not numbers
        doubted = step_rad > slack_rad + limits.step_rate_rad_s * between_s
        if doubted_rad is not None:
            doubted |= (np.abs(position_rad - doubted_rad) <= slack_rad) & (step_rad > slack_rad)
        doubted &= state.valid
        self._remember(doubted, state)
        if not doubted.any():
            is_held = ~state.valid & (position_rad != believed.position_rad)
            return (_held_state(state, believed, is_held) if is_held.any() else state), None
        joint = self.joint = int(np.argmax(np.where(doubted, step_rad, 0.0)))
        cause = "two servos with one ID, exchanged IDs, a changed zero, or a dead position sensor"
        turns = np.round(step_rad[joint] / math.tau)
        if turns and abs(step_rad[joint] - turns * math.tau) <= slack_rad:
            cause = "it is off by whole turns: a lost turn count"
        doubt = (
            f"{limits.joint_names[joint]}: measured {position_rad[joint]:.2f} rad after "
            f"{believed.position_rad[joint]:.2f} rad: no servo turns so fast: {cause}"
        )
        return _held_state(state, believed, doubted | ~state.valid), doubt

    def _remember(self, doubted: Bools, state: JointState) -> None:
        before = np.nan if self._doubted_rad is None else self._doubted_rad
        kept = np.where(state.valid, np.nan, before)
        now_rad = np.where(doubted, state.position_rad, kept)
        self._doubted_rad = now_rad if np.isfinite(now_rad).any() else None


@compiled(
    f"boolean({_FLOATS}, {_FLOATS}, {readonly_array('boolean')}, float64, {_FLOATS}, {_FLOATS},"
    " float64, float64, float64)",
    makes_arrays=False,
)
def _is_all_believable(
    position_rad: Floats,
    age_s: Floats,
    valid: Bools,
    time_s: float,
    believed_rad: Floats,
    believed_age_s: Floats,
    believed_time_s: float,
    slack_rad: float,
    rate_rad_s: float,
) -> bool:
    """Fast check of the regular case: every joint was read at a reachable angle."""
    for k in range(len(position_rad)):
        between_s = max(0.0, (time_s - age_s[k]) - (believed_time_s - believed_age_s[k]))
        step_rad = abs(position_rad[k] - believed_rad[k])
        if not valid[k] or step_rad > slack_rad + rate_rad_s * between_s:
            return False
    return True


def _held_state(state: JointState, believed: JointState, is_held: np.ndarray) -> JointState:
    """State with the credible values of the joints in ``is_held`` (J,)."""
    age_s = believed.age_s + (state.time_s - believed.time_s)
    believed = believed._replace(age_s=age_s)
    arrays = {
        name: np.where(is_held, getattr(believed, name), getattr(state, name))
        for name in ("position_rad", "velocity_rad_s", "current_a", "age_s")
    }
    arrays["valid"] = state.valid & ~is_held
    for array in arrays.values():
        array.setflags(write=False)
    return state._replace(**arrays)
