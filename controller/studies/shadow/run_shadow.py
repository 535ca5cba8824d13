"""Shadow of a run: a row for each cycle, an alarm, and the cause at the end."""

from collections import deque
from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

from snakewalk.config.arrays import Floats
from snakewalk.config.heightfield import HeightField
from snakewalk.config.robot import RobotConfig
from snakewalk.config.run import RunConfig
from snakewalk.config.world import WorldConfig
from snakewalk.controller.console.command import plugin
from snakewalk.controller.run.prepared_run import pose_with
from snakewalk.controller.runlog.record import InitialPose
from snakewalk.controller.runlog.topics import ShadowTable
from snakewalk.controller.runlog.writer import RunLog
from snakewalk.controller.studies.shadow.diagnosis import (
    LEAST_S,
    MOST_S,
    check_level,
    diagnose,
    is_gap,
    last_part,
)
from snakewalk.controller.studies.shadow.shadow import Shadow, measured_s
from snakewalk.drivers.types import JointState

ALARM_A = 0.03
"""Mean difference of a current from which the alarm names a joint (ours)."""
ALARM_RAD = 0.02
"""Mean difference of an angle from which the alarm names a joint (ours)."""
_MEMORY_S = 2.0
"""Time constant of the alarm's average (ours)."""
_SMOOTH_S = 0.1
"""Time constant that smooths steps of encoder and current (ours)."""
_LONGEST_DELAY = 0.5
"""Greatest time between the shadow's reading and its goals, over its watchdog's (ours)."""
_CLOCK_DIGITS = 9
"""Digits of a time in seconds without rounding errors of clocks."""


@dataclass
class ShadowAlarm:
    """Compares a chain with its shadow from cycle to cycle, and says once of a joint what differs.

    A difference is smoothed over a tenth of a second, and its square over two seconds.

    Between two goals the current of a moving joint falls by its stiffness times its speed, so a
    goal that arrives late changes the current at the next read. The run does not know how late its
    goals arrive, but it measures how late replies do. The limit grows by the effect of that time.
    """

    robot: RobotConfig
    cycle_hz: float
    named: set[int] = field(default_factory=set)
    """Joints that have been named."""

    def __post_init__(self) -> None:
        """Begin without a difference."""
        joints = self.robot.joint_count
        self._smooth = np.zeros((2, joints))
        self._square = np.zeros((2, joints))
        self._unsure = np.zeros((2, joints))
        self._least_age_s = np.inf
        self._cycles = 0
        gains = np.array(self.robot.position_p_gains)
        records = self.robot.servo_records
        full_rad = np.array([facts.full_output_rad for facts in records]) / np.maximum(gains, 1)
        stall_a = np.array([facts.stall_current_a or 0.0 for facts in records])
        self._slope = np.stack([stall_a / full_rad, np.ones(joints)])

    def limits(self) -> Floats:
        """Return the limits (2, J) of the differences, in A and rad."""
        return np.array([[ALARM_A], [ALARM_RAD]]) + np.sqrt(self._unsure)

    def update(self, state: JointState, shadow: JointState) -> tuple[str, ...]:
        """Process a cycle; returns a sentence for each joint that begins to differ."""
        now = np.stack(
            [state.current_a - shadow.current_a, state.position_rad - shadow.position_rad]
        )
        quick = 1.0 / (self.cycle_hz * _SMOOTH_S)
        slow = 1.0 / (self.cycle_hz * _MEMORY_S)
        self._smooth += min(quick, 1.0) * np.where(state.valid, now - self._smooth, 0.0)
        self._square += min(slow, 1.0) * (self._smooth**2 - self._square)
        effect = self._slope * shadow.velocity_rad_s * self._reply_delay_s(state)
        self._unsure += min(slow, 1.0) * (effect**2 - self._unsure)
        self._cycles += 1
        if self._cycles < self.cycle_hz * _MEMORY_S:
            return ()
        difference_a, apart_rad = np.sqrt(self._square)
        over = (np.sqrt(self._square) / self.limits()).max(axis=0)
        joints_over = [
            int(j) for j in np.argsort(-over) if over[j] > 1.0 and int(j) not in self.named
        ]
        self.named.update(joints_over)
        return tuple(
            f"{self.robot.joint_label(j)} differs from its shadow: its current by "
            f"{difference_a[j]:.3f} A, its angle by {apart_rad[j]:.3f} rad (over the last seconds)"
            for j in joints_over
        )

    def _reply_delay_s(self, state: JointState) -> float:
        """Return how much later than the earliest reply this one came."""
        age_s = state.age_s[state.valid]
        if not len(age_s):
            return 0.0
        self._least_age_s = min(self._least_age_s, float(age_s.min()))
        return float(age_s.min()) - self._least_age_s


@plugin("observer", "shadow")
class RunShadow:
    """The shadow of a run: logs each cycle, raises the alarm, and names the cause at the end.

    Its simulator is built with it, before the robot has torque: building is slower than the servos'
    bus watchdog allows.

    Args:
        run: the run.
        robot: its chain.
        world: the ground that it is believed to be on.
        ground: the world's height field, where it has one.
        initial_pose: where a simulated robot starts; None on servos, whose shadow starts at the
            angles that are measured first.
        log: gets a row for each cycle, and the alarm.
        on_event: gets the alarm.

    Raises:
        InputError: the simulator is not installed, or the body cannot be put there.

    """

    def __init__(
        self,
        run: RunConfig,
        robot: RobotConfig,
        world: WorldConfig,
        ground: HeightField | None,
        initial_pose: InitialPose | None,
        log: RunLog,
        on_event: Callable[[str, str], None],
    ) -> None:
        self._of = (run, robot, world)
        self._log = log
        self._on_event = on_event
        rows = round(MOST_S * run.cycle_hz) + 1
        self._rows: deque[tuple[float, Floats, Floats, Floats]] = deque(maxlen=rows)
        self._alarm = ShadowAlarm(robot, run.cycle_hz)
        self._measured_start = initial_pose is None
        start = initial_pose or self._pose(np.zeros(robot.joint_count))
        self._shadow = Shadow(run, robot, world, ground, start)
        self._longest_s = _LONGEST_DELAY * run.safety.watchdog_s
        self._first_s: float | None = None
        self._last_s = 0.0

    @staticmethod
    def check(world: WorldConfig) -> None:
        """Reject ground on which a shadow is meaningless.

        Raises:
            InputError: the ground is not a level, open floor.

        """
        check_level(world)

    def begin(self, state: JointState) -> None:
        """Put the shadow at the joints' angles; quick, because torque is on."""
        if self._measured_start:
            self._shadow.restart(self._pose(state.position_rad))

    def step(self, deadline_s: float, sent_s: float, sent_rad: Floats, state: JointState) -> None:
        """Follow one cycle: its sent goals, and the previous state.

        The shadow is read and gets its goals at the robot's times, late on a busy computer.
        """
        read_s = measured_s(state)
        if self._first_s is None:
            self._first_s = read_s
        elif is_gap(read_s - self._last_s, self._of[0]):
            self._shadow.restart(self._pose(state.position_rad))
            self._first_s = read_s
        self._last_s = read_s
        shadow = self._shadow.step(
            round(read_s - self._first_s, _CLOCK_DIGITS),
            sent_rad,
            sent_after_s=min(round(sent_s - read_s, _CLOCK_DIGITS), self._longest_s),
        )
        self._rows.append((deadline_s, sent_rad, state.current_a, state.position_rad))
        self._log.add(
            ShadowTable,
            deadline_s,
            position_rad=shadow.position_rad,
            current_a=shadow.current_a,
        )
        for text in self._alarm.update(state, shadow):
            self._log.event(deadline_s, "shadow", text, "warning")
            self._on_event("shadow", text)

    def end(self, time_s: float) -> None:
        """Report the explanation of the difference, after torque off: it needs many seconds."""
        run, robot, world = self._of
        if not self._rows:
            return
        due_s, sent_rad, current_a, measured_rad = (
            np.array(column) for column in zip(*self._rows, strict=True)
        )
        goals, measured = last_part(run, robot, world, due_s, sent_rad, current_a, measured_rad)
        if len(goals.since_start_s) < LEAST_S * run.cycle_hz:
            return
        diagnosis = diagnose(goals, measured)
        self._log.event(
            time_s, "shadow", diagnosis.text(robot), "warning" if diagnosis.named else "info"
        )
        self._on_event("shadow", diagnosis.text(robot))

    def _pose(self, joint_rad: Floats) -> InitialPose:
        """Return the pose with joints at angles (J,), heading along the run's start."""
        run, robot, _ = self._of
        return pose_with(robot, run.start_heading_rad or 0.0, joint_rad)
