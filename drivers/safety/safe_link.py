"""The safe link: a joint link that vets every command and always switches torque off."""

import math
import signal
import threading
from collections.abc import Callable
from contextlib import suppress
from dataclasses import replace
from types import FrameType

import numpy as np

from snakewalk.drivers.clock import Clock
from snakewalk.drivers.errors import DriverError, SafetyTrippedError
from snakewalk.drivers.link import CheckingLink, ExplainingLink, JointLink, SoftLink
from snakewalk.drivers.safety.chain_load import ChainLoad
from snakewalk.drivers.safety.following_error import FollowingError
from snakewalk.drivers.safety.limits import SafetyLimits
from snakewalk.drivers.safety.load_limits import LoadLimits
from snakewalk.drivers.safety.measured_step import MeasuredSteps
from snakewalk.drivers.safety.recovery import Recovery
from snakewalk.drivers.safety.stop_output import StopOutput
from snakewalk.drivers.safety.trip_hold import INTERRUPTED, TripHold
from snakewalk.drivers.safety.vet import (
    SafetyMemory,
    Verdict,
    check_state,
    overloaded_joint,
    stale_fault,
    vet,
    without_alarm,
)
from snakewalk.drivers.types import JointCommand, JointState

SLOW_SHARE = 0.35
"""Share of ``stale_limit_s`` from which the age of the first state is reported (ours)."""
RESTART_S = 2.0
"""Time after a servo's reboot in which the goals' rate grows to the limit again (ours)."""
TORQUE_IS_OFF = "torque is off"
"""Note on an error that ended the context, after every servo has confirmed it."""
_DOUBTS = 10
"""Impossible angles after which they are reported a second and last time (ours)."""
_LAST_DOUBT = f" ({_DOUBTS} times so far; later ones are not reported); stop the run and check it"
_OFF_TRIES = 3
"""Reads after a trip that repeat an unconfirmed torque off (ours)."""
_SIGNALS = (signal.SIGTERM, signal.SIGINT, signal.SIGHUP, signal.SIGQUIT, signal.SIGTSTP)
"""SIGQUIT is Ctrl-\\. SIGTSTP is Ctrl-Z: a program that is stopped cannot switch torque off, and
the watchdogs would leave the servos holding with torque on."""


class SafeLink:
    """A ``JointLink`` around another; as a context manager it switches torque off at exit.

    It latches on a veto, on an error of the link below, on ``request_stop``, or when
    ``stop_requested`` (called at each read and write) returns a reason. Then torque goes off,
    ``tripped`` contains the reason, and ``write`` raises. ``read`` still works, and repeats an
    unconfirmed torque off a few times. Only ``reset`` by an operator and a new ``enable`` permit
    motion. Inside the context SIGTERM, SIGINT, SIGHUP (unless ignored), SIGQUIT and SIGTSTP leave
    the program through the exit, and its exception gets a note about the torque.
    With a ``recovery`` the chain holds when the line or a servo is lost, and continues if the
    policy permits it. With a ``hold``, a joint that does not follow and ``request_stop(...,
    may_hold=True)`` (the first Ctrl-C) hold with low currents before torque goes off;
    ``is_holding`` is then true. A ``stop_output`` is activated if torque off is not confirmed.
    """

    def __init__(
        self,
        link: JointLink,
        limits: SafetyLimits,
        clock: Clock,
        recovery: Recovery | None = None,
        stop_requested: Callable[[], str | None] = lambda: None,
        on_event: Callable[[str], None] = lambda line: None,
        hold: TripHold | None = None,
        stop_output: StopOutput | None = None,
    ) -> None:
        self.tripped: str | None = None
        """Reason why the link has latched; None while commands pass."""
        self.last_verdict: Verdict | None = None
        """Verdict on the last command."""
        self.recoveries = 0
        """Interruptions and overloads that were recovered from."""
        self._tripped_by: str | None = None
        self._link = link
        self._check_servos: Callable[[], None] = lambda: None
        if isinstance(link, CheckingLink):
            # after the goals: the time from a state to its goals is then constant
            self._check_servos = link.check_servos
        self._recovery = recovery
        self._limits = limits
        self._limits_at_start = replace(limits, voltage_time_s=0.0)
        self._clock = clock
        self._state: JointState | None = None
        self._following = FollowingError(limits)
        self._steps = MeasuredSteps(limits)
        self._loads = LoadLimits(limits)
        self._doubt: str | None = None
        self._doubts = 0
        self._is_held_off = False
        self._on_event = on_event
        self._memory: SafetyMemory | None = None
        self._stop_requested: str | None = None
        self._stop_may_hold = False
        self._hold = hold
        self._hold_until_s = -math.inf
        self._stop_output = stop_output
        self._output_is_active = False
        self._asked_to_stop = stop_requested
        self._touched = False
        self.is_off = False
        """Whether every servo has confirmed its torque off since ``enable``."""
        self._off_tries = 0
        self._restarted_at_s = -math.inf
        self._handlers: dict[signal.Signals, object] = {}

    def __enter__(self) -> "SafeLink":
        if threading.current_thread() is threading.main_thread():
            for number in _SIGNALS:
                # background programs of a shell ignore SIGINT, but must stop too
                ignored = number == signal.SIGHUP and signal.getsignal(number) is signal.SIG_IGN
                if not ignored:
                    softly = number == signal.SIGINT and self._hold is not None
                    handler = self._interrupt if softly else _unwind
                    self._handlers[number] = signal.signal(number, handler)
        return self

    def __exit__(self, kind: object, error: BaseException | None, trace: object) -> None:
        for number in self._handlers:
            signal.signal(number, signal.SIG_IGN)  # torque off must not be interrupted
        try:
            if self._touched:
                self.disable()
                if error is not None and not isinstance(error, DriverError):
                    error.add_note(TORQUE_IS_OFF)
        except DriverError as fault:
            if error is None:
                if self._tripped_by is not None:
                    fault.add_note(f"tripped by: {self._tripped_by}")
                raise
            error.add_note(f"torque off failed: {fault}")
        finally:
            for number, handler in self._handlers.items():
                signal.signal(number, handler)  # type: ignore[arg-type]
            self._handlers.clear()

    @property
    def joint_count(self) -> int:
        """Number of joints J."""
        return self._link.joint_count

    @property
    def was_enabled(self) -> bool:
        """Whether ``enable`` was called, so torque may have been on."""
        return self._touched

    @property
    def load(self) -> ChainLoad | None:
        """Estimates of current, charge and windings; None without motor records."""
        return self._loads.load

    @property
    def is_holding(self) -> bool:
        """Whether a trip holds with low currents; torque goes off when it ends."""
        return self._hold_until_s > -math.inf

    def enable(self) -> JointState:
        """Check and set up the servos, torque on.

        Raises:
            SafetyTrippedError: latched, or the state found is a reason to latch.
            DriverError: errors of the link below.

        """
        self._refuse_to_start()
        self._touched = True
        self.is_off = False
        state = self._link.enable()
        self._begin(state)
        self._refuse_if_tripped()
        self._fit_stale_limit(float(np.max(state.age_s)))
        return state

    def _fit_stale_limit(self, age_s: float) -> None:
        """Report slow replies; a limit that nobody has set follows them."""
        limit_s = self._limits.stale_limit_s
        if age_s <= SLOW_SHARE * limit_s:
            return
        needed_s = round(3.0 * age_s, 2)
        effect = f"is {limit_s:g}; set it to {needed_s:g}, or the run may end"
        if limit_s <= needed_s <= self._limits.stale_limit_max_s:
            self._limits = replace(self._limits, stale_limit_s=needed_s)
            effect = f"is {needed_s:g} in this run"
        self._on_event(
            f"replies need up to {age_s:.3f} s, some cycles two of them: safety.stale_limit_s "
            f"{effect}"
        )

    def disable(self) -> None:
        """Torque off; safe to call at any time, repeatedly.

        The stop output is activated if torque off is not confirmed.

        Raises:
            DriverError: torque off is not confirmed.

        """
        self._memory = None
        self._hold_until_s = -math.inf
        try:
            self._link.disable()
        except DriverError as fault:
            self._activate_output(fault)
            raise
        self.is_off = True
        self._off_tries = 0

    def read(self) -> JointState:
        """Read all joints; returns the state even if it latches because of it.

        Raises:
            SafetyTrippedError: the link below failed and was not recovered.

        """
        if self._off_tries > 0:
            self._switch_off_again()
        if self.is_holding:
            return self._read_held()
        try:
            state = self._link.read()
        except DriverError as fault:
            return self._recover(str(fault), fault)
        if self._memory is None:
            self._state = state
            return state
        doubt = None
        if self._state is not None:
            state, doubt = self._steps.update(state, self._state)
            self._note_doubt(doubt)
        if doubt is not None or (self._recovery is not None and self.tripped is None):
            stale = stale_fault(state, self._limits, self._clock.now_s())
            if stale is not None:
                self._state = state
                if doubt is None:
                    return self._recover(stale, None)
                self._trip(self._explain(self._steps.joint) or doubt)  # may be exchanged servos
                return state
        self._state = state
        joint = self._overloaded_joint(state, self._memory)
        if joint is not None:
            name = self._limits.joint_names[joint]
            return self._recover(f"{name}: alarm: overload", None, joint)
        self._check(state, self._memory)
        return state

    def _note_doubt(self, doubt: str | None) -> None:
        """Report the first doubt and the last that is reported."""
        if doubt is not None and self._doubt is None:
            self._doubts += 1
            if self._doubts in (1, _DOUBTS):
                last = "" if self._doubts == 1 else _LAST_DOUBT
                self._on_event(f"not believed: {doubt}{last}")
        self._doubt = doubt

    def write(self, command: JointCommand) -> None:
        """Vet a command against the newest state and send the result.

        After a recovery in this call nothing is sent: the joints hold.

        Raises:
            SafetyTrippedError: latched, before or by this command.

        """
        self._refuse_if_tripped()
        if self._memory is None or self._state is None:
            raise SafetyTrippedError("torque is off: enable first")
        stop = self._stop()
        if stop is not None:
            self._trip(stop, may_hold=self._stops_softly())
            self._refuse_if_tripped()
        if self._recovery is not None:
            # program or machine paused since the read
            stale = stale_fault(self._state, self._limits, self._clock.now_s())
            if stale is not None:
                self._recover(stale, None)
                return
        now_s = self._clock.now_s()
        verdict = vet(command, self._state, self._memory, self._limits_at(now_s), now_s)
        self.last_verdict = verdict
        self._memory = verdict.memory
        if verdict.veto is not None:
            self._trip(verdict.veto)
            self._refuse_if_tripped()
        try:
            self._link.write(JointCommand(command.time_s, verdict.goal_rad))
            # after a pause the next step counts from here
            sent_s = self._clock.now_s()
            if sent_s != now_s:
                self._memory = verdict.memory._replace(time_s=sent_s)
            self._check_servos()
        except DriverError as fault:
            self._recover(str(fault), fault)

    def request_stop(self, reason: str, *, may_hold: bool = False) -> None:
        """Latch at the next read or write; callable from another thread (a stop button).

        With ``may_hold`` the body may hold first; a stop without it has priority.
        """
        if may_hold and self._stop_requested is not None:
            return
        self._stop_may_hold = may_hold
        self._stop_requested = reason

    def reset(self, operator: str) -> None:
        """Unlatch, by a person who has checked the robot; torque stays off until ``enable``.

        Raises:
            ValueError: the name is empty.

        """
        if not operator.strip():
            raise ValueError("a reset needs the name of the operator")
        if self.is_holding:
            self.disable()
        self.tripped = self._tripped_by = None
        self._stop_requested = None

    def _overloaded_joint(self, state: JointState, memory: SafetyMemory) -> int | None:
        """The joint to reboot: an overload has shut it down, and all else is well."""
        if self._recovery is None or self.tripped is not None:
            return None
        joint = overloaded_joint(state) if self._recovery.overload_reboots > 0 else None
        if joint is None:
            return None
        fault, _ = check_state(
            without_alarm(state, joint), memory, self._limits, self._clock.now_s()
        )
        fault = self._stop() or fault or self._following.update(state, memory.goal_rad)
        return joint if fault is None else None

    def _limits_at(self, now_s: float) -> SafetyLimits:
        """The limits; after a reboot the goals' rate grows linearly from zero."""
        share = (now_s - self._restarted_at_s) / RESTART_S
        if share >= 1.0:
            return self._limits
        return replace(self._limits, goal_rate_rad_s=share * self._limits.goal_rate_rad_s)

    def _recover(
        self, reason: str, fault: DriverError | None, overloaded: int | None = None
    ) -> JointState:
        state = None
        if self._recovery is not None and self._memory is not None and self._state is not None:
            believed_rad = self._state.position_rad
            try:
                if overloaded is None:
                    state = self._recovery.recover(reason, believed_rad, self._stop)
                else:
                    state = self._recovery.restart(overloaded, reason, believed_rad, self._stop)
                    self._restarted_at_s = self._clock.now_s()
            except DriverError as again:
                fault = again
                reason = f"{reason}; while going on: {again}"
            refusal = self._recovery.refusal
            if state is None and refusal is not None and refusal not in reason:
                reason = f"{reason}; not continued: {refusal}"
        if state is None:
            self._trip(reason)
            raise SafetyTrippedError(str(self.tripped)) from fault
        self.recoveries += 1
        self._begin(state)
        return state

    def _begin(self, state: JointState) -> None:
        """Check the first state after a start or a recovery."""
        self._state, self._memory = state, SafetyMemory.at_rest(state)
        self._following.reset()
        self._steps.reset()
        self._check(state, self._memory, self._limits_at_start)

    def _following_fault(self, state: JointState, memory: SafetyMemory) -> str | None:
        fault = self._following.update(state, memory.goal_rad)
        self._is_held_off = fault is not None and not self._following.is_idle
        if fault is None:
            return None
        reason = self._explain(self._following.joint)
        self._is_held_off &= reason is None
        return reason or fault

    def _explain(self, joint: int) -> str | None:
        """Cause that the link finds in a joint's servo, or None."""
        reason = self._link.explain(joint) if isinstance(self._link, ExplainingLink) else None
        return None if reason is None else f"{self._limits.joint_names[joint]}: {reason}"

    def _check(
        self, state: JointState, memory: SafetyMemory, limits: SafetyLimits | None = None
    ) -> None:
        now_s = self._clock.now_s()
        fault, self._memory = check_state(state, memory, limits or self._limits, now_s)
        fault = fault or self._loads.update(state)
        stop = self._stop()
        is_sound = fault is None
        fault = stop or fault or self._following_fault(state, memory)
        if fault is not None:
            softly = self._stops_softly() if stop is not None else self._is_held_off
            self._trip(fault, may_hold=is_sound and softly)

    def _trip(self, reason: str, *, may_hold: bool = False) -> None:
        """Latch; the first reason stays. Torque goes off, or later after a hold."""
        is_first = self.tripped is None
        if self.tripped is None:
            self.tripped = self._tripped_by = reason
        if is_first and may_hold and self._begin_hold():
            return
        self._switch_off()
        cause = self._silence_cause() if is_first else None
        if cause is not None and self.tripped is not None:
            self.tripped = f"{reason}: {cause}{self.tripped[len(reason) :]}"

    def _silence_cause(self) -> str | None:
        """Cause that the link finds for joints whose replies are missing for too long, or None."""
        state, link = self._state, self._link
        is_other_cause = self._doubt is not None or self._stop() is not None
        if state is None or is_other_cause or not isinstance(link, ExplainingLink):
            return None
        age_s = state.age_s + self._clock.now_s() - state.time_s
        is_silent = ~state.valid & (age_s > self._limits.stale_limit_s)
        return link.explain_silence(np.flatnonzero(is_silent).tolist()) if is_silent.any() else None

    def _switch_off(self) -> None:
        try:
            self.disable()
        except DriverError as fault:
            self.tripped = f"{self.tripped} (torque off failed: {fault})"
            self._off_tries = _OFF_TRIES

    def _activate_output(self, fault: DriverError) -> None:
        output = self._stop_output
        if output is None or self._output_is_active or not self._touched:
            return
        try:
            output.activate()
        except OSError as error:
            line = f"stop output {output.name}: {error}; switch the servo power off"
        else:
            self._output_is_active = True
            line = f"stop output {output.name}: activated, because torque off is not confirmed"
        fault.add_note(line)
        self._on_event(line)

    def _stops_softly(self) -> bool:
        """Whether the requested stop may hold: an operator's, not a stop button's."""
        return self._stop_may_hold and self._asked_to_stop() is None

    def _begin_hold(self) -> bool:
        """Hold with low currents, if possible and the newest state is sound."""
        hold = self._hold
        state = self._state
        memory = self._memory
        now_s = self._clock.now_s()
        if hold is None or state is None or memory is None or not isinstance(self._link, SoftLink):
            return False
        if self._doubt is not None:
            return False
        if check_state(state, memory, self._limits, now_s)[0] is not None:
            return False
        try:
            self._link.hold_softly(hold.current_a)
        except DriverError as fault:
            self._on_event(f"cannot hold: {fault}")
            return False
        self._stop_requested = None
        self._stop_may_hold = False  # another stop ends the hold
        self._memory = SafetyMemory.at_rest(state)
        self._hold_until_s = self._clock.now_s() + hold.seconds
        self._on_event(f"holds with low currents for {hold.seconds:g} s, then torque goes off")
        return True

    def _read_held(self) -> JointState:
        """Read while holding; torque off at its end, or at any reason to stop."""
        try:
            state = self._link.read()
            self._check_servos()  # no goals follow, after which the check is made otherwise
        except DriverError as fault:
            self._end_hold(str(fault))
            raise SafetyTrippedError(str(self.tripped)) from fault
        now_s = self._clock.now_s()
        assert self._state is not None
        assert self._memory is not None
        state, doubt = self._steps.update(state, self._state)
        self._state = state
        unsound, self._memory = check_state(state, self._memory, self._limits, now_s)
        reason = self._stop() or doubt or unsound or self._loads.update(state)
        if reason is not None or now_s >= self._hold_until_s:
            self._end_hold(reason)
        return state

    def _end_hold(self, reason: str | None) -> None:
        """Torque off; ``reason`` is that of an early end."""
        if reason is not None and self.tripped is not None:
            self.tripped += f" (the hold ended early: {reason})"
        self._switch_off()

    def _interrupt(self, number: int, frame: FrameType | None) -> None:
        """Hold after the first Ctrl-C; the second leaves the program."""
        if self._memory is None or self.tripped is not None or self._stop_requested is not None:
            _unwind(number, frame)
        self.request_stop(INTERRUPTED, may_hold=True)

    def _switch_off_again(self) -> None:
        self._off_tries -= 1
        with suppress(DriverError):  # the trip has reported it
            self.disable()
            self._on_event("torque off is confirmed now")

    def _stop(self) -> str | None:
        return self._stop_requested or self._asked_to_stop()

    def _refuse_to_start(self) -> None:
        """Latch before torque is on if a stop was requested; torque off is sent anyway."""
        stop = None if self.tripped is not None else self._stop()
        if stop is not None:
            self._trip(stop)
        self._refuse_if_tripped()

    def _refuse_if_tripped(self) -> None:
        if self.tripped is not None:
            raise SafetyTrippedError(self.tripped)


def _unwind(number: int, frame: FrameType | None) -> None:
    """Turn a signal into an exception, so that every context ends."""
    if number == signal.SIGINT:
        raise KeyboardInterrupt
    raise SystemExit(128 + number)
