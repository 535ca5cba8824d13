"""Vetting: a pure function that decides which command passes, below every source of motion.

It clamps small excesses: joint limits, rate, and lead (goal minus measured, which makes the
torque). It vetoes states that no healthy run has: values that are not numbers, a joint forced
beyond its limit, an alarm, lasting over-current, and heat. A supply that is too high or too low for
a while and a stale state are vetoed as well.
"""

import math
from functools import cache
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from snakewalk.config.arrays import Bools, Bytes, Floats
from snakewalk.drivers.compiling import compiled, readonly_array
from snakewalk.drivers.protocol.packet import ALERT
from snakewalk.drivers.protocol.registers import Alarm, alarm_names
from snakewalk.drivers.safety.limits import SafetyLimits
from snakewalk.drivers.types import JointCommand, JointState

STANDING_RAD_S = 0.1
"""Speed below which a joint is at rest (ours): four units of an XM430's velocity."""
_FLOATS = readonly_array()
_BYTES = readonly_array("uint8")


class CheckedState(NamedTuple):
    """A state that kept the limits: against the same limits it can only age."""

    state: JointState
    limits: SafetyLimits
    age_max_s: float
    """Largest age of a value in the state."""


class SafetyMemory(NamedTuple):
    """Results of the last check for the next one."""

    time_s: float
    """Time at which ``goal_rad`` was sent."""
    goal_rad: Floats
    """(J,) last goals that passed; at the start the measured angles."""
    over_current_since_s: Floats
    """(J,) time of the first reading above the limit; NaN below it."""
    under_voltage_since_s: Floats
    """(J,) time of the first reading of a supply below its limit; NaN above it."""
    checked_state: CheckedState | None = None
    """The state that was checked last, if it kept the limits."""

    @staticmethod
    def at_rest(state: JointState) -> "SafetyMemory":
        """Memory of joints that hold the pose in ``state``."""
        position_rad = np.array(state.position_rad, float)
        return SafetyMemory(
            state.time_s, position_rad, _unlimited(len(position_rad)), _unlimited(len(position_rad))
        )


class Verdict(NamedTuple):
    """Result of vetting one command."""

    goal_rad: Floats
    """(J,) goals that may be sent; on a veto the last ones again."""
    veto: str | None
    """Reason of a latched stop, one line; None: the command passes."""
    clamped: Bools
    """(J,) goals that were changed."""
    memory: SafetyMemory
    """Memory for the next call (its argument ``last``)."""


def vet(
    command: JointCommand,
    state: JointState,
    last: SafetyMemory,
    limits: SafetyLimits,
    now_s: float,
) -> Verdict:
    """Vet a command against the newest state.

    The joint limit has priority over the rate, and the rate over the lead: a goal that follows a
    measured angle would also follow a wrong reading.
    """
    veto, checked = check_state(state, last, limits, now_s)
    if veto is not None:
        return _refusal(veto, checked)
    requested = np.asarray(command.goal_rad, float)
    joints = len(limits.limit_rad)
    if requested.shape != limits.limit_rad.shape:
        return _refusal(f"command of shape {requested.shape} for {joints} joints", checked)
    # after a pause the allowance is at most that of one stale limit
    dt_s = min(max(now_s - last.time_s, 0.0), limits.stale_limit_s)
    step = limits.goal_rate_rad_s * dt_s
    lead = limits.goal_lead_rad
    goal = np.empty(joints)
    clamped = np.empty(joints, np.bool_)
    measured = np.asarray(state.position_rad, float)
    bad = _clamp(requested, last.goal_rad, measured, limits.limit_rad, step, lead, goal, clamped)
    if bad >= 0:
        veto = f"{limits.joint_names[bad]}: commanded {requested[bad]}: not a number"
        return _refusal(veto, checked)
    goal.setflags(write=False)
    over_s, under_s = checked.over_current_since_s, checked.under_voltage_since_s
    memory = SafetyMemory(now_s, goal, over_s, under_s, checked.checked_state)
    return Verdict(goal, None, clamped, memory)


def _refusal(veto: str, checked: SafetyMemory) -> Verdict:
    return Verdict(checked.goal_rad, veto, np.zeros(len(checked.goal_rad), np.bool_), checked)


def check_state(
    state: JointState, last: SafetyMemory, limits: SafetyLimits, now_s: float
) -> tuple[str | None, SafetyMemory]:
    """First reason to stop in the state, or None, and the new memory.

    A repeated check of a state gives the same result, except for its age.
    """
    checked = last.checked_state
    aged_s = now_s - state.time_s
    if checked is not None and checked.state is state and checked.limits is limits:
        if checked.age_max_s + aged_s <= limits.stale_limit_s:
            return None, last
        return stale_fault(state, limits, now_s), last
    over_s, under_s = last.over_current_since_s, last.under_voltage_since_s
    age_max_s = _age_max_s(state, last, limits)
    if not age_max_s + aged_s <= limits.stale_limit_s:  # too old, or the quick check failed (NaN)
        over_s = over_current_since_s(state, last, limits)
        under_s = under_voltage_since_s(state, last, limits)
        fault = state_fault(state, over_s, under_s, limits, now_s)
        if fault is not None:
            return fault, SafetyMemory(last.time_s, last.goal_rad, over_s, under_s)
        age_max_s = float(np.maximum.reduce(state.age_s))
    checked = CheckedState(state, limits, age_max_s)
    return None, SafetyMemory(last.time_s, last.goal_rad, over_s, under_s, checked)


def over_current_since_s(state: JointState, last: SafetyMemory, limits: SafetyLimits) -> Floats:
    """(J,) time since which each current exceeds the limit; an unread joint keeps its time."""
    since = last.over_current_since_s
    over = np.abs(state.current_a) > limits.current_limit_a
    if not over.any() and not np.isfinite(since).any():
        return _unlimited(len(since))
    return np.where(state.valid, _started_s(over, since, state.time_s), since)


def under_voltage_since_s(state: JointState, last: SafetyMemory, limits: SafetyLimits) -> Floats:
    """(J,) time of the first reading of each supply that is too low; else NaN."""
    since = last.under_voltage_since_s
    low = state.voltage_v < limits.voltage_min_v
    if not low.any():
        return _unlimited(len(since))
    return _started_s(low, since, state.time_s - state.slow_age_s)


def _started_s(is_beyond: Bools, since_s: Floats, now_s: Floats | float) -> Floats:
    """(J,) time since which each joint is beyond its limit; NaN within it."""
    return np.where(is_beyond, np.where(np.isnan(since_s), now_s, since_s), np.nan)


def stale_fault(state: JointState, limits: SafetyLimits, now_s: float) -> str | None:
    """The first joint that was not read for too long, as one line, or None."""
    since_s = now_s - state.time_s
    # rounding keeps the order, so the greatest age represents all; not so for a NaN
    if _oldest_s(state.age_s) + since_s <= limits.stale_limit_s:
        return None
    age_s = state.age_s + since_s
    joint = int(np.argmin(age_s <= limits.stale_limit_s))
    fault = f"{limits.joint_names[joint]}: not read for {age_s[joint]:.3f} s"
    return f"{fault}: {_stale_cause(state, joint, since_s, limits)}"


def _stale_cause(state: JointState, joint: int, since_s: float, limits: SafetyLimits) -> str:
    """Cause of a joint's age, ``since_s`` after its state."""
    if since_s > 0.5 * limits.stale_limit_s:
        return f"this program did not run for {since_s:.3f} s; close other programs"
    if state.valid[joint]:
        return "its reply was slow: the latency of adapter or network, or a busy computer"
    return "no valid reply" if state.valid.any() else "no servo replies"


def state_fault(
    state: JointState,
    over_since_s: Floats,
    under_since_s: Floats,
    limits: SafetyLimits,
    now_s: float,
) -> str | None:
    """First reason to stop in the state, or None.

    Temperature and voltage that were never read (NaN) are accepted: a link may lack them.
    """
    stale = stale_fault(state, limits, now_s)
    if stale is not None:
        return stale
    is_over = state.time_s - over_since_s >= limits.current_time_s
    under_s = state.time_s - state.slow_age_s - under_since_s
    alarm = (state.hardware_error != 0) | ((state.error & ALERT) != 0)
    numbers = np.stack([state.position_rad, state.velocity_rad_s, state.current_a])
    # not (a <= b) also stops at a NaN; a > b would not
    checks: tuple[tuple[Any, NDArray[Any], str], ...] = (
        (~np.isfinite(numbers).all(axis=0), numbers.sum(axis=0), "measured {}: not a number"),
        (alarm, state.hardware_error, "alarm"),
        (
            ~(np.abs(state.position_rad) <= limits.limit_rad + limits.limit_slack_rad),
            state.position_rad,
            "measured {:.3f} rad: forced beyond its limit",
        ),
        (
            is_over & (np.abs(state.velocity_rad_s) < STANDING_RAD_S),
            state.current_a,
            "{:.2f} A for too long at rest: it is blocked",
        ),
        (is_over, state.current_a, "{:.2f} A for too long in motion: it is overloaded"),
        (
            ~np.isnan(state.temperature_c) & ~(state.slow_age_s <= limits.slow_stale_limit_s),
            state.slow_age_s,
            "temperature and voltage not read for {:.2f} s",
        ),
        (
            state.temperature_c > limits.temperature_limit_c,
            state.temperature_c,
            "{:.0f} C: too hot",
        ),
        (
            under_s >= limits.voltage_time_s,
            state.voltage_v,
            f"{{:.1f}} V: supply too low, under {limits.voltage_min_v:.4g} V: servo.supply_min_v "
            "of the robot, or safety.voltage_min_v of the run",
        ),
        (
            state.voltage_v > limits.voltage_max_v,
            state.voltage_v,
            f"{{:.1f}} V: supply too high, over {limits.voltage_max_v:.4g} V: servo.supply_max_v "
            "of the robot, or safety.voltage_max_v of the run",
        ),
    )
    for bad, values, what in checks:
        if bad.any():
            joint = int(np.argmax(bad))
            fault = f"{limits.joint_names[joint]}: " + what.format(values[joint])
            names = alarm_names(int(values[joint])) if what == "alarm" else ""
            if what == "alarm" and not names:
                names = "the alert bit is set, but no alarm was read from Hardware Error Status"
            return f"{fault}: {names}" if names else fault
    return None


def overloaded_joint(state: JointState) -> int | None:
    """The joint whose servo an overload has shut down; None if there is another alarm."""
    alarm = (state.hardware_error != 0) | ((state.error & ALERT) != 0)
    joints = np.flatnonzero(alarm)
    if len(joints) != 1 or state.hardware_error[joints[0]] != Alarm.OVERLOAD:
        return None
    return int(joints[0])


def without_alarm(state: JointState, joint: int) -> JointState:
    """The state without this joint's alarm, so that other faults show."""
    hardware_error = state.hardware_error.copy()
    error = state.error.copy()
    hardware_error[joint] = 0
    error[joint] &= 0xFF ^ ALERT
    return state._replace(hardware_error=hardware_error, error=error)


def _age_max_s(state: JointState, last: SafetyMemory, limits: SafetyLimits) -> float:
    """Greatest age of a state that passes the quick check, else NaN.

    The quick check costs a tenth of ``state_fault`` and is stricter.
    """
    unlimited_s = _unlimited(len(last.over_current_since_s))
    if (
        last.over_current_since_s is not unlimited_s
        or last.under_voltage_since_s is not unlimited_s
    ):
        return math.nan
    try:
        return _quick_check(
            state.position_rad,
            state.velocity_rad_s,
            state.current_a,
            state.temperature_c,
            state.voltage_v,
            state.age_s,
            state.slow_age_s,
            state.error,
            state.hardware_error,
            limits.limit_rad,
            limits.limit_slack_rad,
            limits.current_limit_a,
            limits.temperature_limit_c,
            limits.voltage_min_v,
            limits.voltage_max_v,
            limits.slow_stale_limit_s,
        )
    except TypeError:  # a link with other number types: state_fault accepts any
        return math.nan


@compiled(
    f"float64({', '.join([_FLOATS] * 7)}, {_BYTES}, {_BYTES}, {_FLOATS},"
    " float64, float64, float64, float64, float64, float64)",
    makes_arrays=False,
)
def _quick_check(
    position_rad: Floats,
    velocity_rad_s: Floats,
    current_a: Floats,
    temperature_c: Floats,
    voltage_v: Floats,
    age_s: Floats,
    slow_age_s: Floats,
    error: Bytes,
    hardware_error: Bytes,
    limit_rad: Floats,
    slack_rad: float,
    current_max_a: float,
    temperature_max_c: float,
    voltage_min_v: float,
    voltage_max_v: float,
    slow_age_max_s: float,
) -> float:
    """Greatest age if all values are numbers within their limits and without an error; else NaN."""
    age_max_s = -np.inf
    for k in range(len(position_rad)):
        # a comparison with NaN is false, so an unread value is not inside
        inside = (
            abs(position_rad[k]) <= limit_rad[k] + slack_rad
            and abs(velocity_rad_s[k]) < np.inf
            and abs(current_a[k]) <= current_max_a
            and temperature_c[k] <= temperature_max_c
            and voltage_min_v <= voltage_v[k] <= voltage_max_v
            and age_s[k] < np.inf
            and slow_age_s[k] <= slow_age_max_s
        )
        if not inside or error[k] or hardware_error[k]:
            return np.nan
        age_max_s = max(age_max_s, age_s[k])
    return age_max_s


@compiled(f"float64({_FLOATS})", makes_arrays=False)
def _oldest_s(age_s: Floats) -> float:
    """Greatest age; NaN if one is NaN."""
    oldest_s = -np.inf
    for k in range(len(age_s)):
        if not age_s[k] <= oldest_s:
            oldest_s = age_s[k]
            if np.isnan(oldest_s):
                break
    return oldest_s


@compiled(
    f"int64({_FLOATS}, {_FLOATS}, {_FLOATS}, {_FLOATS}, float64, float64,"
    " float64[::1], boolean[::1])",
    makes_arrays=False,
)
def _clamp(
    requested_rad: Floats,
    last_rad: Floats,
    position_rad: Floats,
    limit_rad: Floats,
    step_rad: float,
    lead_rad: float,
    goal_rad: Floats,
    clamped: Bools,
) -> int:
    """Clamp goals to lead, rate and limit, in this order; mark changed ones.

    Returns:
        The first joint whose goal is not a number, or -1.

    """
    for k in range(len(requested_rad)):
        if not np.isfinite(requested_rad[k]):
            return k
        low, high = position_rad[k] - lead_rad, position_rad[k] + lead_rad
        goal = min(max(requested_rad[k], low), high)
        goal = min(max(goal, last_rad[k] - step_rad), last_rad[k] + step_rad)
        goal = min(max(goal, -limit_rad[k]), limit_rad[k])
        goal_rad[k], clamped[k] = goal, goal != requested_rad[k]
    return -1


@cache
def _unlimited(joints: int) -> Floats:
    """(J,) NaN, read-only: no value exceeds its limit. One array per J, compared by identity."""
    since_s = np.full(joints, np.nan)
    since_s.setflags(write=False)
    return since_s
