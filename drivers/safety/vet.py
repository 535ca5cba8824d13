"""What may pass to the servos: a pure function, below every source of motion.

Small excesses are clamped: joint limits, rate, and lead (goal minus measured, which is what makes
torque). What no healthy run shows is vetoed: numbers that are none, a joint forced beyond its
limit, an alarm, lasting over-current, heat, supply voltage, a state that is too old.
"""

import math
from dataclasses import dataclass
from functools import cache
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from snakewalk.config.arrays import Bools, Bytes, Floats
from snakewalk.config.robot import RobotConfig
from snakewalk.config.run import SafetyConfig
from snakewalk.drivers.compiling import compiled, seen
from snakewalk.drivers.protocol.packet import ALERT
from snakewalk.drivers.protocol.registers import alarm_names
from snakewalk.drivers.types import JointCommand, JointState

_FLOATS, _BYTES = seen(), seen("uint8")


@dataclass(frozen=True, slots=True)
class SafetyLimits:
    """Limits of one robot; a value at its limit is inside."""

    limit_rad: Floats
    """(J,) half range of the goals."""
    limit_slack_rad: float
    """How far beyond it a joint may be *measured*: bent by force, or by overshoot."""
    goal_rate_rad_s: float
    goal_lead_rad: float
    """Goal minus measured."""
    current_limit_a: float
    current_time_s: float
    """How long the current may be exceeded."""
    temperature_limit_c: float
    voltage_min_v: float
    voltage_max_v: float
    stale_limit_s: float

    @staticmethod
    def from_config(robot: RobotConfig, safety: SafetyConfig) -> "SafetyLimits":
        """Limits as the run's files say."""
        return SafetyLimits(
            limit_rad=np.array(robot.limit_rad),
            limit_slack_rad=0.2,
            goal_rate_rad_s=safety.goal_rate_rad_s,
            goal_lead_rad=safety.goal_lead_rad,
            current_limit_a=safety.current_limit_a,
            current_time_s=safety.current_time_s,
            temperature_limit_c=safety.temperature_limit_c,
            voltage_min_v=safety.voltage_min_v,
            voltage_max_v=safety.voltage_max_v,
            stale_limit_s=safety.stale_limit_s,
        )


class Sound(NamedTuple):
    """A state that kept limits: the same two again can only have aged."""

    state: JointState
    limits: SafetyLimits
    oldest_s: float
    """Greatest age in it."""


class SafetyMemory(NamedTuple):
    """What the next judgement needs of the last one."""

    time_s: float
    """When ``goal_rad`` was sent."""
    goal_rad: Floats
    """(J,) last goals that passed; at the start the measured angles."""
    over_current_since_s: Floats
    """(J,) time of the first reading above the limit; NaN below it."""
    sound: Sound | None = None
    """What was judged last, if it was well."""

    @staticmethod
    def at_rest(state: JointState) -> "SafetyMemory":
        """Memory of joints that hold the pose in ``state``."""
        held = np.array(state.position_rad, float)
        return SafetyMemory(state.time_s, held, _never(len(held)))


class Verdict(NamedTuple):
    """What becomes of one command."""

    goal_rad: Floats
    """(J,) goals that may be sent; the last ones again where there is a veto."""
    veto: str | None
    """Why nothing may pass any more, one line; None: pass."""
    clamped: Bools
    """(J,) goals that were changed."""
    memory: SafetyMemory
    """``last`` of the next call."""


def vet(
    command: JointCommand,
    state: JointState,
    last: SafetyMemory,
    limits: SafetyLimits,
    now_s: float,
) -> Verdict:
    """Judge a command against the newest state.

    Where clamps disagree the joint limit wins over the lead, and the lead over the rate: a smaller
    lead is a smaller torque.
    """
    veto, seen = judge(state, last, limits, now_s)
    veto = veto or _command_fault(command, limits)
    if veto is not None:
        return Verdict(last.goal_rad, veto, np.zeros(len(last.goal_rad), np.bool_), seen)
    # After a pause the allowance does not pile up: never more than that of one stale limit
    dt_s = min(max(now_s - last.time_s, 0.0), limits.stale_limit_s)
    step, lead = limits.goal_rate_rad_s * dt_s, limits.goal_lead_rad
    goal, clamped = np.empty(len(last.goal_rad)), np.empty(len(last.goal_rad), np.bool_)
    wanted, measured = np.asarray(command.goal_rad, float), np.asarray(state.position_rad, float)
    _clamp(wanted, last.goal_rad, measured, limits.limit_rad, step, lead, goal, clamped)
    goal.setflags(write=False)
    memory = SafetyMemory(now_s, goal, seen.over_current_since_s, seen.sound)
    return Verdict(goal, None, clamped, memory)


def judge(
    state: JointState, last: SafetyMemory, limits: SafetyLimits, now_s: float
) -> tuple[str | None, SafetyMemory]:
    """First reason to stop that the state gives, None if there is none; and what to remember.

    What a state was found to be does not change when it is asked again, but for its age.
    """
    sound, aged_s = last.sound, now_s - state.time_s
    if sound is not None and sound.state is state and sound.limits is limits:
        if sound.oldest_s + aged_s <= limits.stale_limit_s:
            return None, last
        return stale_fault(state, limits, now_s), last
    since_s, oldest_s = last.over_current_since_s, _oldest_s(state, last, limits)
    if not oldest_s + aged_s <= limits.stale_limit_s:  # too old, or not plainly well (NaN)
        since_s = over_current_since_s(state, last, limits)
        fault = state_fault(state, since_s, limits, now_s)
        if fault is not None:
            return fault, SafetyMemory(last.time_s, last.goal_rad, since_s)
        oldest_s = float(np.maximum.reduce(state.age_s))
    sound = Sound(state, limits, oldest_s)
    return None, SafetyMemory(last.time_s, last.goal_rad, since_s, sound)


def over_current_since_s(state: JointState, last: SafetyMemory, limits: SafetyLimits) -> Floats:
    """(J,) since when each current is above the limit; a joint not read keeps its time."""
    since = last.over_current_since_s
    over = np.abs(state.current_a) > limits.current_limit_a
    if not over.any() and not np.isfinite(since).any():
        return _never(len(since))
    started = np.where(np.isnan(since), state.time_s, since)
    return np.where(state.valid, np.where(over, started, np.nan), since)


def stale_fault(state: JointState, limits: SafetyLimits, now_s: float) -> str | None:
    """First joint that was not read for too long; None if there is none."""
    since_s = now_s - state.time_s
    # the oldest stands for all, as rounding keeps their order; of a NaN this is not true
    if np.maximum.reduce(state.age_s) + since_s <= limits.stale_limit_s:
        return None
    age_s = state.age_s + since_s
    joint = int(np.argmin(age_s <= limits.stale_limit_s))
    return f"joint {joint}: not read for {age_s[joint]:.3f} s"


def state_fault(
    state: JointState, over_since_s: Floats, limits: SafetyLimits, now_s: float
) -> str | None:
    """First reason to stop that the state gives; None if all is well.

    Temperature and voltage that were not read yet (NaN) are no reason.
    """
    stale = stale_fault(state, limits, now_s)
    if stale is not None:
        return stale
    over_s = state.time_s - over_since_s
    alarm = (state.hardware_error != 0) | ((state.error & ALERT) != 0)
    numbers = np.stack([state.position_rad, state.velocity_rad_s, state.current_a])
    # not (a <= b) also stops at a NaN, where a > b would let it pass
    checks: tuple[tuple[Any, NDArray[Any], str], ...] = (
        (~np.isfinite(numbers).all(axis=0), numbers.sum(axis=0), "measured {}: not a number"),
        (alarm, state.hardware_error, "alarm"),
        (
            ~(np.abs(state.position_rad) <= limits.limit_rad + limits.limit_slack_rad),
            state.position_rad,
            "measured {:.3f} rad: forced beyond its limit",
        ),
        (over_s >= limits.current_time_s, state.current_a, "{:.2f} A for too long"),
        (
            state.temperature_c > limits.temperature_limit_c,
            state.temperature_c,
            "{:.0f} C: too hot",
        ),
        (state.voltage_v < limits.voltage_min_v, state.voltage_v, "{:.1f} V: supply too low"),
        (state.voltage_v > limits.voltage_max_v, state.voltage_v, "{:.1f} V: supply too high"),
    )
    for bad, values, what in checks:
        if bad.any():
            joint = int(np.argmax(bad))
            said = f"joint {joint}: " + what.format(values[joint])
            names = alarm_names(int(values[joint])) if what == "alarm" else ""
            return f"{said}: {names}" if names else said
    return None


def _oldest_s(state: JointState, last: SafetyMemory, limits: SafetyLimits) -> float:
    """Greatest age of a state in which no check can find anything; NaN if that is not plain.

    It costs a tenth of the checks, and is stricter: what is not plain is left to them.
    """
    if last.over_current_since_s is not _never(len(last.over_current_since_s)):
        return math.nan
    try:
        return _oldest_of(
            *(state.position_rad, state.velocity_rad_s, state.current_a),
            *(state.temperature_c, state.voltage_v, state.age_s),
            *(state.error, state.hardware_error),
            limits.limit_rad,
            *(limits.limit_slack_rad, limits.current_limit_a, limits.temperature_limit_c),
            *(limits.voltage_min_v, limits.voltage_max_v),
        )
    except TypeError:  # a link with another kind of numbers: the checks themselves take any
        return math.nan


@compiled(
    f"float64({_FLOATS}, {_FLOATS}, {_FLOATS}, {_FLOATS}, {_FLOATS}, {_FLOATS}, {_BYTES}, {_BYTES},"
    f" {_FLOATS}, float64, float64, float64, float64, float64)"
)
def _oldest_of(
    position_rad: Floats,
    velocity_rad_s: Floats,
    current_a: Floats,
    temperature_c: Floats,
    voltage_v: Floats,
    age_s: Floats,
    error: Bytes,
    hardware_error: Bytes,
    limit_rad: Floats,
    slack_rad: float,
    most_a: float,
    hottest_c: float,
    least_v: float,
    most_v: float,
) -> float:
    """Greatest age, if every value is a number inside its limits and no error shows; else NaN."""
    oldest_s = -np.inf
    for k in range(len(position_rad)):
        # a comparison with a NaN is false: what was not read is not inside
        inside = (
            abs(position_rad[k]) <= limit_rad[k] + slack_rad
            and abs(velocity_rad_s[k]) < np.inf
            and abs(current_a[k]) <= most_a
            and temperature_c[k] <= hottest_c
            and least_v <= voltage_v[k] <= most_v
            and age_s[k] < np.inf
        )
        if not inside or error[k] or hardware_error[k]:
            return np.nan
        oldest_s = max(oldest_s, age_s[k])
    return oldest_s


@compiled(
    f"void({_FLOATS}, {_FLOATS}, {_FLOATS}, {_FLOATS}, float64, float64,"
    " float64[::1], boolean[::1])"
)
def _clamp(
    wanted_rad: Floats,
    last_rad: Floats,
    position_rad: Floats,
    limit_rad: Floats,
    step_rad: float,
    lead_rad: float,
    goal_rad: Floats,
    clamped: Bools,
) -> None:
    """Goals within rate, lead and limit, in this order, and which of them were changed."""
    for k in range(len(wanted_rad)):
        goal = min(max(wanted_rad[k], last_rad[k] - step_rad), last_rad[k] + step_rad)
        goal = min(max(goal, position_rad[k] - lead_rad), position_rad[k] + lead_rad)
        goal = min(max(goal, -limit_rad[k]), limit_rad[k])
        goal_rad[k], clamped[k] = goal, goal != wanted_rad[k]


@cache
def _never(joints: int) -> Floats:
    """(J,) NaN, read-only: that no current is above its limit, told by identity."""
    since_s = np.full(joints, np.nan)
    since_s.setflags(write=False)
    return since_s


def _command_fault(command: JointCommand, limits: SafetyLimits) -> str | None:
    goal = np.asarray(command.goal_rad)
    if goal.shape != limits.limit_rad.shape:
        return f"command of shape {goal.shape} for {len(limits.limit_rad)} joints"
    if not math.isfinite(goal.dot(goal)):
        bad = ~np.isfinite(goal)
        if not bad.any():
            return None
        joint = int(np.argmax(bad))
        return f"joint {joint}: commanded {goal[joint]}: not a number"
    return None
