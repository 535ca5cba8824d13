"""The latch, the exits and the signals of the safe link, over a link that records."""

import os
import signal

import numpy as np
import pytest

from snakewalk.drivers.errors import BusError, SafetyTrippedError
from snakewalk.drivers.safety.safe_link import SafeLink
from snakewalk.drivers.types import JointCommand, JointState
from snakewalk.sim.line.clock import SimClock
from tests.drivers.safety.test_safety_vet import LIMITS, J, one, state


class Joints:
    """A link whose joints follow at once."""

    joint_count = J

    def __init__(self, clock: SimClock) -> None:
        self.clock = clock
        self.torque = False
        self.goals: list[np.ndarray] = []
        self.changes: dict[str, object] = {}
        self.write_fault: Exception | None = None
        self.disable_fault: Exception | None = None

    def enable(self) -> JointState:
        self.torque = True
        return self.read()

    def disable(self) -> None:
        self.torque = False
        if self.disable_fault:
            raise self.disable_fault

    def read(self) -> JointState:
        here = self.goals[-1] if self.goals else np.zeros(J)
        return state(**{"time_s": self.clock.now_s(), "position_rad": here, **self.changes})

    def write(self, command: JointCommand) -> None:
        if self.write_fault:
            raise self.write_fault
        assert self.torque
        self.goals.append(command.goal_rad)


@pytest.fixture
def clock() -> SimClock:
    return SimClock(1.0)


@pytest.fixture
def joints(clock: SimClock) -> Joints:
    return Joints(clock)


@pytest.fixture
def link(joints: Joints, clock: SimClock) -> SafeLink:
    return SafeLink(joints, LIMITS, clock)


def step(link: SafeLink, clock: SimClock, goal: float) -> None:
    clock.advance(0.02)
    link.read()
    link.write(JointCommand(clock.now_s(), np.full(J, goal)))


def test_commands_are_vetted_on_their_way(link: SafeLink, joints: Joints, clock: SimClock) -> None:
    link.enable()
    step(link, clock, 1.0)
    step(link, clock, 1.0)
    assert [goal[0] for goal in joints.goals] == pytest.approx([0.08, 0.16])
    assert link.last_verdict is not None
    assert link.last_verdict.clamped.all()
    assert link.tripped is None


def test_a_veto_latches_until_an_operator_resets(
    link: SafeLink, joints: Joints, clock: SimClock
) -> None:
    link.enable()
    step(link, clock, 0.01)
    with pytest.raises(SafetyTrippedError, match=r"joint yaw_01 \(ID 7\): commanded nan"):
        step(link, clock, np.nan)
    assert not joints.torque
    for _ in range(3):
        with pytest.raises(SafetyTrippedError, match="commanded nan"):
            step(link, clock, 0.0)
    assert link.read().valid.all()  # the log goes on
    with pytest.raises(SafetyTrippedError):
        link.enable()
    with pytest.raises(ValueError, match="operator"):
        link.reset(" ")
    link.reset("Ada")
    with pytest.raises(SafetyTrippedError, match="enable first"):
        step(link, clock, 0.0)
    link.enable()
    step(link, clock, 0.0)
    assert joints.torque
    assert len(joints.goals) == 2


def test_a_bad_state_latches_at_the_read(link: SafeLink, joints: Joints) -> None:
    link.enable()
    joints.changes = {"temperature_c": one(71.0, 1, 40.0)}
    assert link.read().temperature_c[1] == 71.0
    assert link.tripped == "joint yaw_02 (ID 8): 71 C: too hot"
    assert not joints.torque


def test_over_current_is_timed_across_reads(
    link: SafeLink, joints: Joints, clock: SimClock
) -> None:
    link.enable()
    joints.changes = {"current_a": one(2.5, 2)}
    started = clock.now_s()
    while link.tripped is None:
        clock.advance(0.02)
        link.read()
    assert clock.now_s() - started == pytest.approx(0.52, abs=0.03)


def test_a_state_found_bad_at_the_start_lets_nothing_move(link: SafeLink, joints: Joints) -> None:
    joints.changes = {"voltage_v": one(9.0, 0, 12.0)}
    with pytest.raises(SafetyTrippedError, match=r"9\.0 V: supply too low"):
        link.enable()
    assert not joints.torque


def test_a_loop_that_does_not_read_is_stopped(
    link: SafeLink, joints: Joints, clock: SimClock
) -> None:
    link.enable()

    def write_on() -> None:
        for _ in range(20):
            clock.advance(2.0**-6)
            link.write(JointCommand(clock.now_s(), np.zeros(J)))

    with pytest.raises(SafetyTrippedError, match="not read for"):
        write_on()
    assert len(joints.goals) == 6  # of 1/64 s: the seventh is beyond the stale limit of 0.1 s


def test_an_error_below_latches(link: SafeLink, joints: Joints, clock: SimClock) -> None:
    link.enable()
    joints.write_fault = BusError("the bus watchdog has stopped the servos")
    with pytest.raises(SafetyTrippedError, match="watchdog"):
        step(link, clock, 0.0)
    assert not joints.torque


def test_a_stop_button_works_at_the_next_call(
    link: SafeLink, joints: Joints, clock: SimClock
) -> None:
    link.enable()
    link.request_stop("stop button")
    with pytest.raises(SafetyTrippedError, match="stop button"):
        step(link, clock, 0.0)
    assert not joints.torque
    link.reset("Ada")
    link.enable()
    step(link, clock, 0.0)


def test_torque_is_off_after_an_exception(link: SafeLink, joints: Joints) -> None:
    def crash() -> None:
        with link:
            link.enable()
            raise RuntimeError("planner crashed")

    with pytest.raises(RuntimeError, match="planner crashed"):
        crash()
    assert not joints.torque


def test_a_torque_off_that_fails_does_not_hide_the_first_fault(
    link: SafeLink, joints: Joints
) -> None:
    joints.disable_fault = BusError("servo 3: torque off is not confirmed")

    def crash(error: Exception | None) -> None:
        with link:
            link.enable()
            if error:
                raise error

    with pytest.raises(RuntimeError) as info:
        crash(RuntimeError("first"))
    assert info.value.__notes__ == ["torque off failed: servo 3: torque off is not confirmed"]
    with pytest.raises(BusError, match="not confirmed"):
        crash(None)


def test_a_torque_off_that_fails_after_a_trip_says_what_had_tripped(
    link: SafeLink, joints: Joints
) -> None:
    joints.disable_fault = BusError("servo 3: torque off is not confirmed")

    def tripped() -> None:
        with link:
            link.enable()
            link.request_stop("a hand")
            link.read()

    with pytest.raises(BusError, match="not confirmed") as info:
        tripped()
    assert info.value.__notes__ == ["tripped by: a hand"]


def test_a_torque_off_that_a_trip_could_not_confirm_is_asked_for_again(
    joints: Joints, clock: SimClock
) -> None:
    """Another program may have disarmed the watchdogs: nothing else would end the torque."""
    events: list[str] = []
    link = SafeLink(joints, LIMITS, clock, on_event=events.append)
    link.enable()
    joints.disable_fault = BusError("servo 3: torque off is not confirmed")
    link.request_stop("stop button")
    link.read()
    tripped = link.tripped
    assert tripped == "stop button (torque off failed: servo 3: torque off is not confirmed)"
    link.read()
    assert events == []
    joints.disable_fault, joints.torque = None, True
    link.read()
    assert not joints.torque
    assert events == ["torque off is confirmed now"]
    joints.torque = True
    link.read()
    assert joints.torque  # confirmed: not asked for any more
    assert link.tripped == tripped


def test_a_torque_off_that_nobody_confirms_does_not_hold_up_the_log_for_ever(
    link: SafeLink, joints: Joints
) -> None:
    link.enable()
    joints.disable_fault = BusError("servo 3: torque off is not confirmed")
    link.request_stop("stop button")
    asked = []
    for _ in range(6):
        joints.torque = True
        link.read()
        asked.append(not joints.torque)
    assert asked == [True, True, True, True, False, False]


@pytest.mark.parametrize(
    ("number", "raised"),
    [
        (signal.SIGTERM, SystemExit),
        (signal.SIGHUP, SystemExit),
        (signal.SIGINT, KeyboardInterrupt),
    ],
)
def test_signals_unwind_through_torque_off(
    link: SafeLink, joints: Joints, number: signal.Signals, raised: type[BaseException]
) -> None:
    before = signal.getsignal(number)

    def killed() -> None:
        with link:
            link.enable()
            os.kill(os.getpid(), number)
            joints.goals.append(np.full(J, 9.0))  # never reached

    with pytest.raises(raised):
        killed()
    assert not joints.torque
    assert joints.goals == []
    assert signal.getsignal(number) is before


def test_a_signal_that_is_ignored_stays_ignored(link: SafeLink) -> None:
    """``nohup`` begins a program so: its run goes on when the terminal is gone."""
    before = signal.signal(signal.SIGHUP, signal.SIG_IGN)
    try:
        with link:
            signal.raise_signal(signal.SIGHUP)
        assert signal.getsignal(signal.SIGHUP) is signal.SIG_IGN
    finally:
        signal.signal(signal.SIGHUP, before)


def test_a_second_signal_does_not_interrupt_torque_off(joints: Joints, clock: SimClock) -> None:
    class Impatient(Joints):
        def disable(self) -> None:
            os.kill(os.getpid(), signal.SIGTERM)
            os.kill(os.getpid(), signal.SIGINT)
            super().disable()

    impatient = Impatient(clock)
    with SafeLink(impatient, LIMITS, clock) as link:
        link.enable()
    assert not impatient.torque


def test_a_link_that_was_never_enabled_sends_nothing(link: SafeLink, joints: Joints) -> None:
    joints.torque = True  # somebody else's
    with link:
        link.read()
    assert joints.torque
