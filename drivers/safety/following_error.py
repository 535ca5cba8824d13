"""Following error: a joint that does not reach its goal, though its servo could.

A moving joint lags by the error that its P gain needs for speed and load, at most the error at
which the output is full. A larger lasting error means that the joint is blocked, has no power,
obeys another program, or is another joint. The ground may hold off a current-limited joint for
long, but then its servo pushes with all of its permitted current.
At small errors the current is evidence too: a working motor draws current if its joint is off the
goal and slow. Without current, the output stage is dead. A velocity sensor may be dead, so constant
positions also count as slow.
A constant current reading may hide a dead output stage. The current at rest is proportional to the
output, which follows the error. If the joint is at rest and its error changes while its current
does not, output stage or sensor is dead. A constant error shows nothing: an obstacle also causes a
constant current. A current at the joint's own limit, towards the goal, shows a motor that pushes.
"""

import math
from collections import deque

import numpy as np

from snakewalk.config.arrays import Bools, Floats
from snakewalk.drivers.compiling import compiled, readonly_array
from snakewalk.drivers.safety.limits import SafetyLimits
from snakewalk.drivers.types import JointState

IDLE_TIME_S = 0.3
"""Total time for which a joint may draw no current although it should (ours)."""
IDLE_SHARE = 0.1
"""Share of the expected current below which a motor draws none (ours)."""
SENSED_A = 0.02
"""Current that shows a working sensor and motor (ours): three units of an STS3215."""
GROWN = 1.5
"""Growth of the error since then that shows a dead output stage (ours). If only the sensor dies,
the error stays the same."""
IDLE_OUTPUT = 0.25
"""Share of full output from which on a slow motor without current is at fault (ours). There a
healthy motor on 3/4 of its nominal voltage still draws a third of its current at rest."""
EVIDENT_OUTPUT = 0.1
"""Share of full output from which on a current shows that the output stage works (ours)."""
SLOW_RAD_S = 0.3
"""Speed towards the goal below which the back-EMF may be neglected (ours): a tenth of the no-load
speed of the slowest model."""
LONGEST_STEP_S = 0.1
"""A pause between two states counts as this much, s (ours)."""
STANDING_RAD = 0.005
"""A joint stands while its position differs by at most this (ours): three units of a DYNAMIXEL."""
CHANGED_OUTPUT = 0.2
"""Change of the expected current, as a share of the current at full output, during which a joint
that stands has to draw another current (ours). The current in a supply line grows with the square
of the output: a sensor there shows at least a fifth of the change."""
CHANGED_LIMIT = 0.6
"""Least change of the expected current, as a share of a lower limit of the current, during which a
standing joint has to draw another current (ours): the limit varies with the supply."""
AT_LIMIT = 0.15
"""A current this close to a joint's own limit, as a share of it, is at the limit (ours). Towards
the goal it shows that the motor pushes: a soft joint is held off its goal by the ground."""
PROMPT_S = 0.012
"""Age of a state up to which the goals before it had reached their servos (ours)."""
RESPONSE_S = 0.02
"""Time in which a joint begins to follow a goal (ours)."""
_FLOATS = readonly_array()


class FollowingError:
    """Time for which each joint does not follow; ``update`` with every state."""

    def __init__(self, limits: SafetyLimits) -> None:
        self._limits = limits
        joints = len(limits.limit_rad)
        output = np.zeros((3, joints)) if limits.output is None else limits.output
        self._rules = np.vstack([limits.following_limit_rad, limits.following_effort_a, output])
        self._memory = np.zeros((4, joints))
        self._since_s, self._idle_s, _, self._driven_rad = self._memory
        self._steady = np.zeros((5, joints))
        self._goals: deque[tuple[float, Floats]] = deque(maxlen=16)
        self.joint = -1
        """Joint of the newest reason to stop."""
        self.is_idle = False
        """Whether the reason is a motor that does not push."""
        self.reset()

    def reset(self) -> None:
        """Forget the past: the joints rest at their goals."""
        self._memory[:] = np.nan
        self._idle_s[:] = 0.0
        self._steady[:] = np.nan
        self._goals.clear()
        self._time_s = math.inf

    def update(self, state: JointState, goal_rad: Floats) -> str | None:
        """Evaluate a state and the goals (J,) sent before it; return a reason to stop, or None."""
        last_s, self._time_s = self._time_s, state.time_s
        goal_rad = self._nearest_goals(state, goal_rad)
        measured = (
            goal_rad,
            state.position_rad,
            state.current_a,
            state.valid,
            state.time_s,
            last_s,
            self._rules,
        )
        joint = _judge(*measured, self._memory, state.velocity_rad_s)
        steady = _steady_joint(*measured, self._steady)
        self.is_idle = joint >= 0 and bool(self._idle_s[joint] >= IDLE_TIME_S)
        if self.is_idle:
            self.joint = joint
            return self._idle_fault(state, goal_rad, joint)
        if steady >= 0:
            self.joint = steady
            self.is_idle = True
            return self._steady_fault(state, goal_rad, steady)
        if joint < 0:
            return None
        self.joint = joint
        for_s = state.time_s - self._since_s[joint]
        if not for_s >= self._limits.following_time_s:
            return None
        error_rad = goal_rad[joint] - state.position_rad[joint]
        return (
            f"{self._limits.joint_names[joint]}: {abs(error_rad):.2f} rad from its goal for "
            f"{for_s:.2f} s with {state.current_a[joint]:.2f} A: it does not follow: it is "
            "blocked, or its gears slip"
        )

    def _nearest_goals(self, state: JointState, goal_rad: Floats) -> Floats:
        """Goals (J,) to compare with a state: the newest, unless replies are slow.

        A slow adapter may hand on a goal together with the next request, and the servo has not
        moved when it is read. So of all goals that may be this new, the nearest counts.
        """
        self._goals.append((state.time_s, goal_rad))
        age_s = float(np.maximum.reduce(state.age_s))
        if not age_s > PROMPT_S:
            return goal_rad
        from_s = state.time_s - 2.0 * age_s - RESPONSE_S
        recent: list[Floats] = []
        for time_s, goals in reversed(self._goals):
            recent.append(goals)
            if time_s < from_s:
                break
        return np.clip(state.position_rad, np.min(recent, axis=0), np.max(recent, axis=0))

    def _limp_cause(self, state: JointState, joint: int, error_rad: float) -> str:
        dead = "current"
        speed_rad_s = state.velocity_rad_s[joint]
        if abs(speed_rad_s) < SLOW_RAD_S and error_rad > GROWN * self._driven_rad[joint]:
            return "its motor does not push: dead output stage"
        if abs(speed_rad_s) >= SLOW_RAD_S:
            dead = f"position sensor, as it reports {speed_rad_s:.1f} rad/s; or a dead current"
        return (
            "its motor does not push: dead output stage or loose motor wire, if the joint is limp; "
            f"else a dead {dead} sensor"
        )

    def _idle_fault(self, state: JointState, goal_rad: Floats, joint: int) -> str:
        error_rad = abs(float(goal_rad[joint] - state.position_rad[joint]))
        _, _, per_rad, stall_a, limit_a = self._rules[:, joint]
        expected_a = min(min(error_rad * per_rad, 1.0) * stall_a, limit_a)
        return (
            f"{self._limits.joint_names[joint]}: {error_rad:.2f} rad from its goal with "
            f"{state.current_a[joint]:.2f} A, expected about {expected_a:.2f} A: "
            f"{self._limp_cause(state, joint, error_rad)}"
        )

    def _steady_fault(self, state: JointState, goal_rad: Floats, joint: int) -> str:
        since_s, _, _, low_a, high_a = self._steady[:, joint]
        error_rad = abs(float(goal_rad[joint] - state.position_rad[joint]))
        current_a = state.current_a[joint]
        cause = self._limp_cause(state, joint, error_rad)
        if abs(current_a) > IDLE_SHARE * max(abs(low_a), abs(high_a)):
            cause = "dead current sensor, and its motor does not push"
        return (
            f"{self._limits.joint_names[joint]}: {error_rad:.2f} rad from its goal; its current "
            f"stays at {current_a:.2f} A for {state.time_s - since_s:.2f} s, expected "
            f"{low_a:.2f} to {high_a:.2f} A: {cause}"
        )


@compiled(
    f"int64({', '.join([_FLOATS] * 3)}, {readonly_array('boolean')}, float64, float64,"
    f" float64[:, ::1], float64[:, ::1], {_FLOATS})",
    makes_arrays=False,
)
def _judge(  # noqa: C901  a compiled loop
    goal_rad: Floats,
    position_rad: Floats,
    current_a: Floats,
    valid: Bools,
    time_s: float,
    last_s: float,
    rules: Floats,
    memory: Floats,
    velocity_rad_s: Floats,
) -> int:
    """Note how long each joint does not follow, and how long each motor draws no current.

    An unread joint keeps its times. An inconclusive error or speed keeps the time without current;
    a current ends it.

    Args:
        goal_rad: (J,) goals sent before the state.
        position_rad: (J,)
        current_a: (J,)
        valid: (J,) whether the joint was read.
        time_s: time of the state.
        last_s: time of the previous state; first infinite.
        rules: (5, J) limit of the error, rad; current towards the goal that excuses it, A; and
            ``SafetyLimits.output``.
        memory: (4, J) time since which a joint does not follow, or NaN; time without current, s;
            previous position, or NaN; error at the last current.
        velocity_rad_s: (J,)

    Returns:
        The first joint whose motor has drawn no current for ``IDLE_TIME_S``, else the joint that
        has not followed for longest, else -1.

    """
    since_s = time_s - last_s
    step_s = min(max(since_s, 0.0), LONGEST_STEP_S)
    longest = -1
    idle = -1
    for k in range(len(goal_rad)):
        if valid[k]:
            error = goal_rad[k] - position_rad[k]
            sign = 1.0 if error > 0.0 else -1.0
            driving_current_a = sign * current_a[k]
            size = abs(error)
            if size > rules[0, k] and driving_current_a < rules[1, k]:
                if np.isnan(memory[0, k]):
                    memory[0, k] = time_s
            else:
                memory[0, k] = np.nan
            share = min(size * rules[2, k], 1.0)
            if share >= EVIDENT_OUTPUT:
                expected_a = min(share * rules[3, k], rules[4, k])
                if driving_current_a >= IDLE_SHARE * expected_a:
                    memory[1, k] = 0.0
                elif share >= IDLE_OUTPUT:
                    # the velocity sensor may be dead, so positions count too
                    moved_rad = sign * (position_rad[k] - memory[2, k])
                    is_slow = sign * velocity_rad_s[k] < SLOW_RAD_S
                    if is_slow or moved_rad < SLOW_RAD_S * since_s:
                        memory[1, k] += step_s
            memory[2, k] = position_rad[k]
            if abs(current_a[k]) >= SENSED_A:
                memory[3, k] = size
            if idle < 0 and memory[1, k] >= IDLE_TIME_S:
                idle = k
        if not np.isnan(memory[0, k]) and (longest < 0 or memory[0, k] < memory[0, longest]):
            longest = k
    return idle if idle >= 0 else longest


@compiled(
    f"int64({', '.join([_FLOATS] * 3)}, {readonly_array('boolean')}, float64, float64,"
    " float64[:, ::1], float64[:, ::1])",
    makes_arrays=False,
)
def _steady_joint(
    goal_rad: Floats,
    position_rad: Floats,
    current_a: Floats,
    valid: Bools,
    time_s: float,
    last_s: float,
    rules: Floats,
    steady: Floats,
) -> int:
    """Note how long each joint rests with a constant current, and the expected currents.

    An unread joint keeps its notes; a pause clears them. Arguments are those of ``_judge``, and
    ``steady`` (5, J): time since which position and current are constant, or NaN; that position;
    that current; least and greatest expected current since then, A.

    Returns:
        The first joint whose current did not change though its error did, else -1.

    """
    is_paused = time_s - last_s > LONGEST_STEP_S
    joint_index = -1
    for k in range(len(goal_rad)):
        full_a, limit_a = rules[3, k], rules[4, k]
        change_a = min(CHANGED_OUTPUT * full_a, CHANGED_LIMIT * limit_a)
        if is_paused:
            steady[0, k] = np.nan
        if not valid[k] or rules[2, k] <= 0.0:
            continue
        error = goal_rad[k] - position_rad[k]
        share = min(abs(error) * rules[2, k], 1.0)
        expected_a = min(share * full_a, limit_a)
        if error < 0.0:
            expected_a = -expected_a
        is_same = (
            abs(position_rad[k] - steady[1, k]) <= STANDING_RAD
            and abs(current_a[k] - steady[2, k]) <= 0.5 * IDLE_SHARE * change_a
        )
        if np.isnan(steady[0, k]) or not is_same:
            steady[0, k], steady[1, k], steady[2, k] = time_s, position_rad[k], current_a[k]
            steady[3, k] = steady[4, k] = expected_a
            continue
        steady[3, k] = min(steady[3, k], expected_a)
        steady[4, k] = max(steady[4, k], expected_a)
        pushing_a = current_a[k] if error > 0.0 else -current_a[k]
        if (1.0 - AT_LIMIT) * limit_a <= pushing_a <= (1.0 + AT_LIMIT) * limit_a:
            continue  # it pushes with all that it may, and friction holds it there
        if (
            joint_index < 0
            and share >= IDLE_OUTPUT
            and time_s - steady[0, k] >= IDLE_TIME_S
            and steady[4, k] - steady[3, k] >= change_a
        ):
            joint_index = k
    return joint_index
