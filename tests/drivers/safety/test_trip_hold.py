"""A trip that allows it holds with low currents for its time; any other switches torque off."""

import signal
from collections.abc import Iterator
from contextlib import suppress

import numpy as np
import pytest

from snakewalk.config.faults import FaultPlan
from snakewalk.config.robot import RobotConfig
from snakewalk.config.run import SafetyConfig
from snakewalk.drivers.bus.dynamixel_bus import DynamixelBus
from snakewalk.drivers.chain.servo_chain import ServoChain
from snakewalk.drivers.errors import DriverError, SafetyTrippedError
from snakewalk.drivers.safety.limits import SafetyLimits
from snakewalk.drivers.safety.safe_link import SafeLink
from snakewalk.drivers.safety.trip_hold import HOLD_SHARE, INTERRUPTED, TripHold
from snakewalk.drivers.types import JointCommand
from snakewalk.sim.faults.fault_player import FaultPlayer
from snakewalk.sim.line.sim_line import SimLine
from snakewalk.sim.servo.bank import ServoBank
from snakewalk.sim.servo.bench import BenchPlant

ROBOT = RobotConfig(name="some", joint_axes="ypyp")
J = ROBOT.joint_count
HOLD_S = 1.0
PERIOD_S = 0.02
SAFETY = SafetyConfig(on_trip="hold", hold_s=HOLD_S, hold_current_a=0.3)


class Rig:
    """A chain that swings, with a hold."""

    def __init__(self, safety: SafetyConfig = SAFETY) -> None:
        self.plant = BenchPlant(J)
        self.line = SimLine(ServoBank(ROBOT.servo_ids), self.plant)
        bus = DynamixelBus(self.line, ROBOT.models_by_id)
        self.chain = ServoChain(bus, ROBOT, can_hold=safety.on_trip == "hold")
        self.events: list[str] = []
        self.button: str | None = None
        self.link = SafeLink(
            self.chain,
            SafetyLimits.from_config(ROBOT, safety),
            self.line.clock,
            stop_requested=lambda: self.button,
            on_event=self.events.append,
            hold=TripHold.from_config(ROBOT, safety),
        )
        self.link.enable()
        self.swing(20)

    def swing(self, cycles: int, amplitude_rad: float = 0.1) -> None:
        """Swing until the link trips."""
        for k in range(cycles):
            self.line.clock.advance(PERIOD_S)
            self.link.read()
            if self.link.tripped is not None:
                return
            goal = np.full(J, amplitude_rad * np.sin(0.1 * k))
            self.link.write(JointCommand(self.line.clock.now_s(), goal))

    def hold_out(self, longest_s: float = 3.0 * HOLD_S) -> float:
        """Read until the hold has ended; how long it took."""
        clock = self.line.clock
        start_s = clock.now_s()
        while self.link.is_holding and clock.now_s() < start_s + longest_s:
            clock.advance(PERIOD_S)
            self.link.read()
        return clock.now_s() - start_s

    def torque(self) -> list[int]:
        self.line.settle()
        return self.line.bank["Torque Enable"].tolist()

    def currents(self) -> list[int]:
        return self.line.bank["Goal Current"].tolist()


@pytest.fixture
def rig() -> Iterator[Rig]:
    rig = Rig()
    yield rig
    rig.link.disable()


def test_an_operators_stop_holds_with_low_currents_then_switches_off(rig: Rig) -> None:
    own = rig.currents()
    rig.link.request_stop("operator", may_hold=True)
    here = rig.plant.position_rad.copy()
    rig.swing(1)
    assert (rig.link.tripped, rig.link.is_holding) == ("operator", True)
    assert rig.torque() == [1] * J
    low = round(0.3 / 2.69e-3)
    assert rig.currents() == [min(low, each) for each in own]
    assert own[0] > low > own[1]  # a pitch joint keeps its own, lower limit
    assert rig.hold_out() == pytest.approx(HOLD_S, abs=2 * PERIOD_S)
    assert np.abs(rig.plant.position_rad - here).max() < 0.1
    assert rig.torque() == [0] * J
    assert rig.link.tripped == "operator"


def test_the_watchdogs_stay_armed_while_it_holds(rig: Rig) -> None:
    rig.link.request_stop("operator", may_hold=True)
    rig.swing(1)
    assert (rig.line.bank["Bus Watchdog"] == 10).all()
    rig.line.clock.advance(0.3)  # the host is gone
    rig.line.settle()
    assert (rig.line.bank["Bus Watchdog"] == 255).all()


def test_no_command_passes_while_it_holds(rig: Rig) -> None:
    rig.link.request_stop("operator", may_hold=True)
    rig.swing(1)
    goals = rig.line.bank["Goal Position"].copy()
    with pytest.raises(SafetyTrippedError, match="operator"):
        rig.link.write(JointCommand(rig.line.clock.now_s(), np.full(J, 0.5)))
    with pytest.raises(SafetyTrippedError, match="operator"):
        rig.link.enable()
    assert (rig.line.bank["Goal Position"] == goals).all()


def far(rig: Rig, joint: int) -> None:
    """Send a joint far away until the link trips."""
    for _ in range(100):
        rig.line.clock.advance(PERIOD_S)
        rig.link.read()
        if rig.link.tripped is not None:
            return
        goal = 0.75 * (np.arange(J) == joint)
        rig.link.write(JointCommand(rig.line.clock.now_s(), goal))


def test_a_joint_that_does_not_follow_holds() -> None:
    rig = Rig(SAFETY.model_copy(update={"current_limit_a": 3.0}))
    rig.line.firmware.block_shafts(np.array([0]))
    far(rig, 0)
    assert "it does not follow" in str(rig.link.tripped)
    assert rig.link.is_holding
    rig.hold_out()
    assert rig.torque() == [0] * J


@pytest.mark.parametrize("why", ["no output", "second master"])
def test_a_joint_whose_servo_is_at_fault_does_not_hold(why: str) -> None:
    following_s = 0.5 if why == "no output" else 0.1
    safety = {"current_limit_a": 3.0, "following_time_s": following_s}
    rig = Rig(SAFETY.model_copy(update=safety))
    if why == "no output":
        rig.line.firmware.cut_output(np.array([0]), True)
        words = "its motor does not push"
    else:
        fault = {"kind": "write", "ids": [1], "register": "Goal Position", "value": 2048}
        plan = {"fault": [{**fault, "every_s": 0.003}]}
        FaultPlayer(rig.line, FaultPlan.model_validate(plan))
        words = "Goal Position is 2048"
    far(rig, 0)
    assert words in str(rig.link.tripped)
    assert not rig.link.is_holding
    assert rig.torque() == [0] * J


@pytest.mark.parametrize("how", ["read", "write"])
def test_a_stop_button_never_holds(rig: Rig, how: str) -> None:
    rig.link.request_stop("operator", may_hold=True)
    rig.button = "button"
    if how == "read":
        rig.link.read()
    else:
        with pytest.raises(SafetyTrippedError):
            rig.link.write(JointCommand(rig.line.clock.now_s(), np.zeros(J)))
    assert not rig.link.is_holding
    assert rig.torque() == [0] * J


@pytest.mark.parametrize("hard_first", [False, True])
def test_a_stop_without_a_hold_counts_more(rig: Rig, *, hard_first: bool) -> None:
    for may_hold in (False, True) if hard_first else (True, False):
        rig.link.request_stop(f"hold {may_hold}", may_hold=may_hold)
    rig.swing(1)
    assert (rig.link.tripped, rig.link.is_holding) == ("hold False", False)
    assert rig.torque() == [0] * J


def test_a_number_that_is_none_never_holds(rig: Rig) -> None:
    with pytest.raises(SafetyTrippedError, match="not a number"):
        rig.link.write(JointCommand(rig.line.clock.now_s(), np.full(J, np.nan)))
    assert not rig.link.is_holding
    assert rig.torque() == [0] * J


FAULTS = ("alarm", "heat", "supply", "bus", "port", "button", "operator", "torque", "second master")


def _break(rig: Rig, fault: str) -> None:
    rows = np.array([1])
    match fault:
        case "alarm":
            rig.line.firmware.protection.detect(rows, 0x20)
        case "heat":
            rig.line.firmware.protection.heat(rows, 75.0)
        case "supply":
            rig.line.firmware.protection.supply(9.7)
        case "bus":
            rig.line.mute(rows, True)
            rig.line.refresh_ids()
        case "port":
            rig.line.disconnect()
            rig.line.clock.advance(0.01)
            rig.line.reconnect()
        case "button":
            rig.button = "button"
        case "operator":
            rig.link.request_stop("again", may_hold=True)
        case "torque":
            rig.line.bank["Torque Enable"][1] = 0
        case _:
            rig.line.bank["Goal Position"][1] = 2100
    rig.line.firmware.apply_registers()


@pytest.mark.fast_cases(4)
@pytest.mark.parametrize("fault", FAULTS)
def test_a_fault_ends_the_hold_at_once(rig: Rig, fault: str) -> None:
    rig.link.request_stop("first", may_hold=True)
    rig.swing(1)
    assert rig.link.is_holding
    _break(rig, fault)
    if fault == "second master":  # nothing is written any more: it counts once
        assert rig.hold_out() >= HOLD_S
        return
    until_s = rig.line.clock.now_s() + HOLD_S
    with suppress(DriverError):
        rig.hold_out()
    assert not rig.link.is_holding
    assert rig.line.clock.now_s() < until_s + (1.1 if fault == "bus" else 0.0)  # it asks for 1 s
    rig.line.mute(np.arange(J), False)
    rig.line.refresh_ids()
    rig.link.disable()
    assert rig.torque() == [0] * J
    assert str(rig.link.tripped).startswith("first (the hold ended early: ")


@pytest.mark.parametrize("fault", ["alarm", "heat", "supply", "torque"])
def test_a_state_that_is_not_sound_never_holds(rig: Rig, fault: str) -> None:
    """An operator's stop in the same cycle does not make it sound."""
    _break(rig, fault)
    rig.line.clock.advance(0.35)
    rig.chain._reads = 16  # voltages and temperatures are read in this cycle
    rig.link.request_stop("operator", may_hold=True)
    with suppress(SafetyTrippedError):
        rig.link.read()
    assert not rig.link.is_holding
    assert rig.torque() == [0] * J


def test_a_hold_that_a_servo_does_not_confirm_is_none(rig: Rig) -> None:
    rig.line.deafen(np.array([2]), True)
    rig.line.refresh_ids()
    rig.link.request_stop("operator", may_hold=True)
    rig.swing(1)
    assert not rig.link.is_holding
    assert any("cannot hold: joint yaw_03 (ID 3)" in each for each in rig.events)


def test_a_chain_that_was_not_set_up_for_it_does_not_hold() -> None:
    rig = Rig()
    rig.link.disable()
    bus = DynamixelBus(rig.line, ROBOT.models_by_id)
    chain = ServoChain(bus, ROBOT)
    limits = SafetyLimits.from_config(ROBOT, SAFETY)
    hold = TripHold.from_config(ROBOT, SAFETY)
    link = SafeLink(chain, limits, rig.line.clock, hold=hold)
    link.enable()
    link.request_stop("operator", may_hold=True)
    link.read()
    assert not link.is_holding
    assert rig.torque() == [0] * J


def test_without_a_hold_a_trip_switches_torque_off_and_yaw_joints_have_no_current_limit() -> None:
    rig = Rig(SafetyConfig())
    assert rig.line.bank["Operating Mode"].tolist() == [3, 5, 3, 5]
    rig.link.request_stop("operator", may_hold=True)
    rig.swing(1)
    assert not rig.link.is_holding
    assert rig.torque() == [0] * J


def test_the_end_of_the_context_ends_the_hold(rig: Rig) -> None:
    with rig.link:
        rig.link.request_stop("operator", may_hold=True)
        rig.swing(1)
        assert rig.link.is_holding
    assert rig.torque() == [0] * J
    assert not rig.link.is_holding


def test_a_reset_ends_the_hold(rig: Rig) -> None:
    rig.link.request_stop("operator", may_hold=True)
    rig.swing(1)
    rig.link.reset("somebody")
    assert (rig.link.is_holding, rig.torque()) == (False, [0] * J)


def test_the_first_interrupt_holds_and_the_second_unwinds(rig: Rig) -> None:
    def interrupt_twice() -> None:
        with rig.link:
            signal.raise_signal(signal.SIGINT)
            rig.swing(1)
            assert (rig.link.tripped, rig.link.is_holding) == (INTERRUPTED, True)
            signal.raise_signal(signal.SIGINT)

    with pytest.raises(KeyboardInterrupt):
        interrupt_twice()
    assert rig.torque() == [0] * J


def test_an_interrupt_unwinds_if_torque_is_off(rig: Rig) -> None:
    def interrupt() -> None:
        with rig.link:
            rig.link.disable()
            signal.raise_signal(signal.SIGINT)

    with pytest.raises(KeyboardInterrupt):
        interrupt()


def test_the_currents_are_the_runs_or_a_share_of_the_stall_current() -> None:
    assert TripHold.from_config(ROBOT, SafetyConfig()) is None
    given = TripHold.from_config(ROBOT, SAFETY)
    assert given is not None
    assert given.current_a.tolist() == [0.3] * J
    share = TripHold.from_config(ROBOT, SafetyConfig(on_trip="hold"))
    assert share is not None
    assert share.current_a == pytest.approx(np.full(J, HOLD_SHARE * 2.3))
    assert share.seconds == 5.0
