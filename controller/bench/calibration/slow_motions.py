"""Slow motions of one servo of an unknown chain; torque is off between them.

A busy machine loses and delays replies. So a cycle repeats its read, the state may be older than in
a run, and a motion that the line ended is repeated.
"""

import math
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import replace
from functools import partial

import numpy as np

from snakewalk.config.arrays import Floats
from snakewalk.config.errors import InputError
from snakewalk.config.robot import RobotConfig
from snakewalk.config.run import SafetyConfig
from snakewalk.controller.kinematics.smoothstep import cubic
from snakewalk.controller.runtime.loop import ticks
from snakewalk.drivers.bus.feetech_bus import servo_bus
from snakewalk.drivers.chain.servo_chain import ServoChain
from snakewalk.drivers.errors import (
    BusError,
    ChainError,
    FaultCause,
    PortError,
    SafetyTrippedError,
)
from snakewalk.drivers.port.byte_port import BytePort
from snakewalk.drivers.protocol.registers import Alarm
from snakewalk.drivers.safety.limits import SafetyLimits
from snakewalk.drivers.safety.safe_link import SafeLink
from snakewalk.drivers.safety.vet import stale_fault
from snakewalk.drivers.types import JointCommand, JointState

WIGGLE_RAD = 0.25
"""Amplitude with which a joint is wiggled (ours)."""
WIGGLE_S = 0.8
"""Duration of a motion out, and of its return (ours)."""
MOVED_SHARE = 0.5
"""Least share of a wiggle: a joint that moves less is held or has no power (ours)."""
SWEEP_RAD_S = 1.0
"""Speed of the sweep (ours)."""
_WEAK_SHARE = 0.3
"""Speed of the sweep of a servo with limited output, as a share of its speed without load
(ours)."""
STOP_LAG_RAD = 0.1
"""Distance behind its goal of a pushing joint that has met its stop (ours)."""
STOP_EFFORT = 0.8
"""... with this share of its goal current, for ... (ours)."""
STOP_S = 0.2
"""Time for which a joint pushes until it has met its stop, s (ours)."""
REST_S = 0.3
"""Longest time for a joint to come to rest before the next moves, s (ours)."""
RANGE_RAD = 3.1
"""Range of a servo: one turn."""
BUS_TRIES = 6
"""Tries of a transaction: more than in a run, since no deadline waits for it (ours)."""
_STALE_S = 0.4
"""Age of a state that ends a motion: weak and slow motions may be seen later than a run (ours)."""
_WATCHDOG_S = 1.5
"""Longer than a busy host stands still (ours): a servo that its watchdog has stopped rejects goals,
which looks as if it were blocked."""
_READS = 3
"""Reads in a cycle until all servos have replied (ours)."""
_POSE_READS = 40
"""Reads until the pose of all servos is complete (ours)."""
_MOTION_TRIES = 10
"""Tries of a motion that the line ends (ours)."""
_LOST_CYCLES = 5
"""Cycles that were skipped or had no reply: a small motion then does not show a blocked servo
(ours)."""
_CYCLE_S = 0.02
Push = Callable[[int, int, float, Callable[[float | None], None]], None]
"""Pushes a joint: row, side, reach in rad, and a function that gets the distance to its stop."""
_HANG_UP = "hang the robot up, so that its joints carry no weight"


class LineLostError(BusError):
    """Replies were missing for too long, so that a motion ended; torque is off."""


class CalibrationBench:
    """Moves one servo at a time of a chain of which only IDs and models are known."""

    def __init__(
        self,
        port: BytePort,
        robot: RobotConfig,
        latency_s: float,
        stop_requested: Callable[[], str | None],
        on_progress: Callable[[str], None],
    ) -> None:
        self._robot = robot
        self._stop_requested = stop_requested
        self._on_progress = on_progress
        self._clock = port.clock
        bus = servo_bus(port, robot.models_by_id, latency_s=latency_s, tries=BUS_TRIES)
        self._chain = ServoChain(bus, robot, watchdog_s=_WATCHDOG_S)
        limits = SafetyLimits.from_config(robot, SafetyConfig())
        self._limits = replace(limits, stale_limit_s=_STALE_S)
        self._state: JointState | None = None
        self._speed_rad_s = [_sweep_rad_s(robot, row) for row in range(robot.joint_count)]

    def name_joints(self, labels: Sequence[str]) -> None:
        """Call the servos by these labels in messages, in the order of their IDs."""
        self._limits = replace(self._limits, joint_names=tuple(labels))

    def retried(self, motion: Callable[[], None], progress: Callable[[], int] = lambda: 0) -> None:
        """Run a motion, and again if the line ended it; progress restores the number of tries.

        Raises:
            LineLostError: the line ended it too often.
            DriverError: another reason ended it.

        """
        tries = _MOTION_TRIES
        before = progress()
        while True:
            try:
                motion()
                return
            except PortError:
                raise
            except BusError as error:
                if progress() != before:
                    tries = _MOTION_TRIES
                    before = progress()
                tries -= 1
                if tries <= 0:
                    raise
                self._on_progress(f"{error}: the line lost replies; the motion is repeated")

    def where_rad(self) -> Floats:
        """Where the servos are; their torque is off, and stays off.

        Raises:
            BusError: a servo does not reply.

        """
        position_rad = np.full(len(self._robot.servo_ids), np.nan)
        for _ in range(_POSE_READS):
            state = SafeLink(self._chain, self._limits, self._clock).read()
            position_rad = np.where(state.valid, state.position_rad, position_rad)
            if np.isfinite(position_rad).all():
                return position_rad
        silent = np.array(self._robot.servo_ids)[np.isnan(position_rad)].tolist()
        raise BusError(f"no reply from ID {', '.join(map(str, silent))}; check power and cable")

    def wiggle(self, row: int) -> None:
        """Turn one servo a little in its positive direction and back.

        Raises:
            InputError: it does not move.
            LineLostError: its replies were missing in every try.
            DriverError: safety has latched.

        """
        self.retried(lambda: self._wiggle(row))

    def _wiggle(self, row: int) -> None:
        with self._link() as (link, held_rad):
            most = 0.0
            valid_reads = 0
            for time_s, state in self._cycles(link, 2.0 * WIGGLE_S):
                valid_reads += bool(state.valid[row])
                most = max(most, float(state.position_rad[row] - held_rad[row]))
                share = cubic(max(0.0, min(time_s, 2.0 * WIGGLE_S - time_s)) / WIGGLE_S)
                self._write(link, held_rad, row, held_rad[row] + WIGGLE_RAD * share)
        if most < MOVED_SHARE * WIGGLE_RAD:
            servo = f"ID {self._robot.servo_ids[row]}"
            lost = round(2.0 * WIGGLE_S / _CYCLE_S) - valid_reads
            if lost >= _LOST_CYCLES:  # the servo may not have received its goals, either
                raise LineLostError(f"{servo}: {lost} cycles of its motion are missing")
            raise InputError(
                f"{servo}: moved by {most:.2f} of {WIGGLE_RAD:g} rad: is "
                f"it held, or too weak for its load? {_HANG_UP}, or raise --current"
            )

    @contextmanager
    def straight(self, straight_rad: Floats) -> Iterator[Push]:
        """Hold the body straight; gives a function that pushes one joint: see ``_push``."""
        with self._link() as (link, held_rad):
            for row, zero_rad in enumerate(straight_rad):
                self._go(link, held_rad, row, float(held_rad[row]), float(zero_rad))
            yield partial(self._push, link, held_rad)

    def _push(
        self,
        link: SafeLink,
        held_rad: Floats,
        row: int,
        side: int,
        reach_rad: float,
        record_stop: Callable[[float | None], None],
    ) -> None:
        """Bend one joint one way and back.

        At a stop the servo pushes with its full permitted current and does not follow.

        Args:
            link: holds the others.
            held_rad: (J,) where they are, rad.
            row: of the servo.
            side: 1 or -1.
            reach_rad: how far to look for a stop.
            record_stop: gets the distance to the stop, rad, or None, before the joint goes back.

        """
        zero_rad = float(held_rad[row])
        reach_rad = min(reach_rad, RANGE_RAD - abs(zero_rad))
        stop = None
        pushing_s = 0.0
        last_s = 0.0
        goal = zero_rad
        least_a = STOP_EFFORT * self._robot.current_limits_a[row]
        for time_s, state in self._cycles(link, reach_rad / self._speed_rad_s[row] + STOP_S):
            far = side * (goal - float(state.position_rad[row]))
            pushes = far > STOP_LAG_RAD and side * float(state.current_a[row]) >= least_a
            pushing_s = pushing_s + time_s - last_s if pushes else 0.0
            last_s = time_s
            if pushing_s >= STOP_S:
                stop = side * (float(state.position_rad[row]) - zero_rad)
                break
            if not pushes:
                ahead = side * (goal - zero_rad) + self._speed_rad_s[row] * _CYCLE_S
                goal = zero_rad + side * min(ahead, reach_rad)
            self._write(link, held_rad, row, goal)
        record_stop(stop)
        self._go(link, held_rad, row, goal, zero_rad)

    def _go(self, link: SafeLink, held_rad: Floats, row: int, start: float, end: float) -> None:
        """Move one servo evenly, and let it come to rest."""
        last_s = abs(end - start) / self._speed_rad_s[row]
        for time_s, _ in self._cycles(link, last_s + REST_S):
            share = min(time_s / last_s, 1.0) if last_s > 0.0 else 1.0
            self._write(link, held_rad, row, start + share * (end - start))
        held_rad[row] = end

    @contextmanager
    def _link(self) -> Iterator[tuple[SafeLink, Floats]]:
        stop = self._stop_requested
        with SafeLink(self._chain, self._limits, self._clock, stop_requested=stop) as link:
            try:
                held_rad = np.array(link.enable().position_rad)
            except ChainError as error:
                raise self._start_error(error) from error
            yield link, held_rad

    def _start_error(self, error: ChainError) -> Exception:
        """Error of a start: silence may be repeated, an alarm has advice."""
        faults = () if self._chain.inspection is None else self._chain.inspection.faults
        causes = {fault.cause for fault in faults}
        if causes == {FaultCause.NO_ANSWER}:
            return LineLostError(str(error))
        if FaultCause.ALARM in causes:
            return ChainError(f"{error}; {_HANG_UP}, then: snakewalk bus reboot --id ID")
        return error

    def _cycles(self, link: SafeLink, seconds: float) -> Iterator[tuple[float, JointState]]:
        """Time since the first cycle and the state, at 50 Hz.

        Raises:
            LineLostError: replies were missing for too long.
            SafetyTrippedError: safety has latched for another reason.

        """
        start_s = self._clock.now_s()
        for tick in ticks(self._clock, _CYCLE_S, start_s + seconds):
            state = self._read(link)
            for _ in range(_READS - 1):
                if state.valid.all() or link.tripped is not None:
                    break
                state = self._read(link)
            if link.tripped is not None:
                raise self._trip_error(link.tripped, state)
            self._state = state
            yield tick.deadline_s - start_s, state

    def _read(self, link: SafeLink) -> JointState:
        try:
            return link.read()
        except SafetyTrippedError as error:
            if isinstance(error.__cause__, BusError):  # the servos did not do what was asked
                raise LineLostError(str(error)) from error
            raise

    def _trip_error(self, reason: str, state: JointState) -> Exception:
        overloaded = np.flatnonzero(state.hardware_error & Alarm.OVERLOAD)
        if len(overloaded):
            ids = ", ".join(str(self._robot.servo_ids[row]) for row in overloaded)
            return SafetyTrippedError(
                f"{reason}; {_HANG_UP}, then: snakewalk bus reboot --id {ids}, and continue with "
                "--resume"
            )
        if (state.age_s > _STALE_S).any():
            return LineLostError(reason)
        return SafetyTrippedError(reason)

    def _write(self, link: SafeLink, held_rad: Floats, row: int, goal_rad: float) -> None:
        goals = held_rad.copy()
        goals[row] = goal_rad
        stale = None
        if self._state is not None:
            stale = stale_fault(self._state, self._limits, self._clock.now_s())
        try:
            link.write(JointCommand(self._clock.now_s(), goals))
        except SafetyTrippedError as error:
            if stale is not None or isinstance(error.__cause__, BusError):
                raise LineLostError(str(error)) from error
            raise


def _sweep_rad_s(robot: RobotConfig, row: int) -> float:
    """Speed of the sweep of a servo: one with a limited output is slow."""
    facts = robot.servo_records[row]
    if "Goal Current" in facts.registers or facts.motor is None:
        return SWEEP_RAD_S
    share = min(1.0, robot.current_limits_a[row] / facts.motor.stall_current_a)
    free_rad_s = facts.motor.no_load_rpm * math.tau / 60.0
    return min(SWEEP_RAD_S, _WEAK_SHARE * share * free_rad_s)
