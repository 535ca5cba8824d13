"""A line or a servo that goes away in the middle of a run: hold, verify, and go on or not."""

import re
from collections.abc import Callable
from contextlib import nullcontext

import numpy as np
import pytest

from snakewalk.config.robot import RobotConfig, ServoConfig
from snakewalk.config.run import SafetyConfig
from snakewalk.drivers.bus.dynamixel_bus import DynamixelBus
from snakewalk.drivers.chain.liveness import SLOW_EVERY
from snakewalk.drivers.chain.servo_chain import ServoChain
from snakewalk.drivers.errors import ChainError, PortError, SafetyTrippedError
from snakewalk.drivers.protocol.packet import Instruction
from snakewalk.drivers.protocol.parser import PacketParser
from snakewalk.drivers.protocol.registers import Alarm
from snakewalk.drivers.safety.limits import SafetyLimits
from snakewalk.drivers.safety.recovery import Policy, Recovery
from snakewalk.drivers.safety.safe_link import SafeLink
from snakewalk.drivers.types import JointCommand
from snakewalk.sim.line.sim_line import SimLine
from snakewalk.sim.servo.bank import ServoBank
from snakewalk.sim.servo.bench import BenchPlant

ROBOT = RobotConfig(
    name="four",
    joint_axes="ypyp",
    servo=ServoConfig(pitch_p_gain=800, pitch_current_limit_a=0.6),
)
PERIOD_S = 0.02
WATCHDOG_S = 0.2


class LooseLine(SimLine):
    """A line whose plug can be pulled until a time."""

    back_s = 0.0

    def pull(self, seconds: float) -> None:
        self.back_s = self.clock.now_s() + seconds
        self.closePort()

    def openPort(self) -> bool:
        if self.clock.now_s() < self.back_s:
            raise PortError("plug: no such port")
        return super().openPort()


class Rig:
    """A chain that is asked to swing, and everything that can be known about it."""

    def __init__(
        self,
        policy: Policy,
        confirm: Callable[[str], bool] | None = None,
        overload_reboots: int = 0,
        safety: SafetyConfig | None = None,
    ) -> None:
        self.line = LooseLine(ServoBank(ROBOT.servo_ids), BenchPlant(4, start_rad=0.1))
        self.chain = ServoChain(DynamixelBus(self.line), ROBOT, watchdog_s=WATCHDOG_S)
        self.events: list[str] = []
        recovery = Recovery(
            self.chain,
            policy=policy,
            confirm=confirm,
            overload_reboots=overload_reboots,
            on_event=self.events.append,
        )
        limits = SafetyLimits.from_config(ROBOT, safety or SafetyConfig())
        self.link = SafeLink(self.chain, limits, self.line.clock, recovery)
        self.link.enable()
        self.goal = 0.1

    @property
    def position(self) -> np.ndarray:
        self.line.settle()
        return self.line.firmware.plant.position_rad.copy()

    def settled(self, seconds: float = 1.0) -> np.ndarray:
        """Let time pass without a word."""
        self.line.clock.advance(seconds)
        return self.position

    def cycles(self, count: int, speed_rad_s: float = 0.5) -> None:
        clock = self.line.clock
        for _ in range(count):
            next_s = clock.now_s() + PERIOD_S
            self.goal += speed_rad_s * PERIOD_S
            self.link.read()
            self.link.write(JointCommand(clock.now_s(), np.full(4, self.goal)))
            clock.sleep_until_s(next_s)

    def torque(self) -> list[int]:
        return self.line.bank["Torque Enable"].tolist()

    def limp(self, register: str, servo: int, value: int) -> None:
        """Reboot a servo and change a register."""
        self.line.firmware.reboot(servo)
        self.alter(register, servo, value)

    def turn(self, servo: int) -> None:
        """Reboot a servo and turn its shaft once around by hand."""
        self.line.firmware.reboot(servo)
        self.line.firmware.plant.position_rad[servo] += 2.0 * np.pi

    def detect(self, alarm: int, *servos: int) -> None:
        """Alarms, as in Hardware Error Status(70); Shutdown(63) says which switch off."""
        self.line.settle()
        self.line.firmware.protection.detect(np.array(servos), alarm)
        self.line.firmware.apply_registers()

    def count_reboots(self) -> list[int]:
        """IDs that are rebooted from now on, a list that grows."""
        ids: list[int] = []

        def overhear(time_s: float, from_host: bool, data: bytes) -> None:
            packets = PacketParser().feed(data) if from_host else ()
            ids.extend(
                p.servo_id for p in packets if getattr(p, "instruction", 0) == Instruction.REBOOT
            )

        self.line.taps.append(overhear)
        return ids

    def alter(self, register: str, servo: int, value: int) -> None:
        self.line.bank[register][servo] = value
        self.line.setBaudRate(self.line.getBaudRate())
        self.line.firmware.apply_registers()


@pytest.fixture
def rig() -> Rig:
    made = Rig("resume")
    made.cycles(30)
    return made


def test_a_vanished_port_that_returns(rig: Rig) -> None:
    before = rig.position
    rig.line.pull(1.5)
    rig.link.read()  # blocks, in simulated time, until the plug is back
    held = rig.position
    assert rig.line.clock.now_s() > rig.line.back_s
    assert np.abs(held - before).max() < 0.15  # ran on for one watchdog time at most
    assert rig.torque() == [1] * 4
    assert rig.link.recoveries == 1
    assert rig.events[-1] == "the run continues from the present position"
    assert "moved by at most" in rig.events[1]
    goal = rig.goal
    rig.cycles(40)
    assert rig.position == pytest.approx(np.full(4, goal + 0.4), abs=0.1)  # the goal is not lost


def test_it_does_not_move_while_it_comes_back(rig: Rig) -> None:
    rig.cycles(20, speed_rad_s=3.0)  # far ahead of the shafts: an old goal would pull
    rig.line.pull(1.0)
    with pytest.raises(PortError):
        rig.chain.read()
    held = rig.settled(1.0)
    rig.link.read()
    assert np.abs(rig.position - held).max() < 0.01
    for _ in range(10):
        rig.chain.read()
        rig.line.clock.advance(PERIOD_S)
    assert np.abs(rig.position - held).max() < 0.01


def test_the_first_command_afterwards_starts_where_it_stands(rig: Rig) -> None:
    rig.cycles(20, speed_rad_s=3.0)
    rig.line.pull(1.0)
    rig.link.read()
    held = rig.position
    rig.line.clock.advance(PERIOD_S)
    rig.link.write(JointCommand(rig.line.clock.now_s(), np.full(4, 1.0)))
    rig.line.drain_until_quiet(1e-3)
    goals = (rig.line.bank["Goal Position"] - 2048) * 2 * np.pi / 4096
    assert np.abs(goals - held).max() < 4.0 * 0.04  # rate-limited from here, not from the old goal


def test_a_servo_that_reboots_is_noticed_and_set_up_again(rig: Rig) -> None:
    rig.line.firmware.reboot(1)
    assert rig.torque() == [1, 0, 1, 1]
    rig.line.bank["Goal Current"][1] = 1193  # as after power-on
    rig.cycles(16)
    assert rig.link.recoveries == 1
    assert rig.events[0] == (
        "interrupted: joint pitch_02 (ID 2): torque is off; Velocity I Gain is 1920, was 2; Bus "
        "Watchdog is 0, was 10: it has rebooted: check its supply and plugs; the servos hold"
    )
    assert rig.events[1].endswith("to be set up again: joint pitch_02 (ID 2)")
    assert rig.torque() == [1] * 4
    assert rig.line.bank["Goal Current"][1] == round(0.6 / 2.69e-3)
    assert rig.line.bank["Bus Watchdog"].tolist() == [10] * 4


def test_a_servo_that_is_away_for_a_while(rig: Rig) -> None:
    away = iter([True] * 9)

    def boot(_: bytes) -> list[bytes]:
        if next(away, False):
            return []
        rig.line.tamper = None
        rig.line.firmware.reboot(3)
        return []

    rig.line.tamper = boot
    rig.cycles(30)
    assert rig.link.recoveries >= 1
    assert rig.link.tripped is None
    assert rig.torque() == [1] * 4


def test_a_tripped_watchdog_is_noticed_though_the_host_talks(rig: Rig) -> None:
    rig.line.settle()
    rig.line.bank["Bus Watchdog"][2] = 0xFF
    rig.line.firmware.apply_registers()
    rig.cycles(16)
    assert "joint yaw_03 (ID 3): its bus watchdog has stopped it" in rig.events[0]
    assert rig.line.bank["Bus Watchdog"].tolist() == [10] * 4


def test_policy_stop_switches_torque_off_when_the_port_is_back() -> None:
    rig = Rig("stop")
    rig.cycles(10)
    rig.line.pull(0.0)  # gone and back at once, under an open handle
    with pytest.raises(SafetyTrippedError, match="the port is closed"):
        rig.cycles(1)
    rig.line.drain_until_quiet(1e-3)
    assert rig.torque() == [0] * 4
    assert rig.events == []


@pytest.mark.parametrize("yes", [True, False])
def test_policy_confirm_asks_with_what_was_found(yes: bool) -> None:
    asked: list[str] = []
    rig = Rig("confirm", confirm=lambda found: asked.append(found) or yes)
    rig.cycles(10)
    rig.line.pull(0.5)
    if yes:
        rig.cycles(5)
    else:
        with pytest.raises(SafetyTrippedError):
            rig.cycles(5)
    assert len(asked) == 1
    assert asked[0].startswith("the same servos, moved by at most 0.0")
    assert rig.torque() == [int(yes)] * 4


def test_without_an_operator_confirm_means_no() -> None:
    rig = Rig("confirm")
    rig.line.pull(0.5)
    with pytest.raises(SafetyTrippedError):
        rig.cycles(1)
    assert rig.torque() == [0] * 4


@pytest.mark.slow_cases(2, "7 cases of 0.3 s of CPU")
@pytest.mark.fast_cases(1)
@pytest.mark.parametrize(
    ("change", "said"),
    [
        (lambda r: r.alter("Model Number", 1, 1030), "joint pitch_02 (ID 2): is a XM430-W210"),
        (
            lambda r: r.alter("Firmware Version", 2, 47),
            "joint yaw_03 (ID 3): firmware 47, was 48: another",
        ),
        (
            lambda r: r.alter("Hardware Error Status", 0, 4),
            "joint yaw_01 (ID 1): alarm: overheating",
        ),
        (lambda r: r.alter("ID", 3, 44), "no answer from servo 4"),
        (lambda r: r.limp("Homing Offset", 0, 400), "joint yaw_01 (ID 1): moved by +0.6"),
        (lambda r: r.limp("Drive Mode", 0, 1), "joint yaw_01 (ID 1): Drive Mode is 1, was 0"),
        (lambda r: r.limp("Homing Offset", 0, 100), "joint yaw_01 (ID 1): Homing Offset is 100"),
        (lambda r: r.limp("Homing Offset", 1, 4096), "joint pitch_02 (ID 2): off by +1 turns"),
    ],
)
def test_what_is_not_as_it_was_does_not_go_on(
    rig: Rig, change: Callable[[Rig], None], said: str
) -> None:
    rig.line.pull(0.3)
    change(rig)
    before = rig.position
    with pytest.raises(SafetyTrippedError, match=r"closed; not continued: .*" + re.escape(said)):
        rig.cycles(1)
    assert said in rig.events[-1]
    assert rig.events[-1].startswith("given up: ")
    assert rig.link.recoveries == 0
    assert np.abs(rig.position - before).max() < 0.3  # only its own motion before the watchdog
    assert not any(rig.torque()[k] for k in range(4) if rig.line.bank["ID"][k] < 5)


def test_a_port_that_stays_away_is_given_up(rig: Rig) -> None:
    start_s = rig.line.clock.now_s()
    rig.line.pull(1e6)
    with pytest.raises(SafetyTrippedError, match=r"torque off failed: plug: no such port"):
        rig.link.read()
    assert rig.events[-1] == "given up: plug: no such port"  # not "is closed"
    assert rig.line.clock.now_s() - start_s == pytest.approx(12.0, abs=0.3)
    rig.line.settle()
    assert (rig.line.bank["Bus Watchdog"] == 0xFF).all()  # they stopped by themselves


def exchange_robots(rig: Rig) -> None:
    """Plug the port into another robot of the same kind, as a run has left it."""
    rig.line.settle()
    firmware, bank = rig.line.firmware, rig.line.bank
    bank["Torque Enable"][:] = 0
    bank["Bus Watchdog"][:] = 0
    firmware.plant.position_rad[:] += 0.2
    firmware.apply_registers()
    rig.line.pull(0.5)


def test_another_robot_with_the_same_ids_does_not_go_on_where_nobody_can_be_asked(rig: Rig) -> None:
    """It was taken for the same servos: a port that disappears does not switch torque off."""
    exchange_robots(rig)
    with pytest.raises(SafetyTrippedError, match="another robot with the same IDs"):
        rig.cycles(2)
    assert rig.torque() == [0] * 4
    assert not any("the same servos" in line for line in rig.events)


@pytest.mark.parametrize("answer", [True, False])
def test_the_operator_says_whether_it_is_the_same_robot(*, answer: bool) -> None:
    asked: list[str] = []

    def confirm(found: str) -> bool:
        asked.append(found)
        return answer

    rig = Rig("resume", confirm)
    rig.cycles(30)
    exchange_robots(rig)
    with nullcontext() if answer else pytest.raises(SafetyTrippedError):
        rig.cycles(2)
    assert len(asked) == 1
    assert "another robot with the same IDs" in asked[0]
    assert rig.torque() == [int(answer)] * 4


def test_a_supply_that_was_off_for_all_servos_is_asked_about(rig: Rig) -> None:
    for servo in range(4):
        rig.line.firmware.reboot(servo)
    with pytest.raises(SafetyTrippedError, match="their supply was off"):
        rig.cycles(20)


def test_servos_whose_settings_and_angles_differ_are_gone_on_with(rig: Rig) -> None:
    for servo in range(2):  # a yaw and a pitch joint have other limits in their EEPROM
        rig.line.firmware.reboot(servo)
    rig.cycles(20)
    assert rig.link.recoveries == 1


def test_two_alike_servos_at_one_angle_may_be_exchanged(rig: Rig) -> None:
    """They came back with exchanged IDs, and the chain was verified as the same servos."""
    rig.line.firmware.reboot(0)
    rig.line.firmware.reboot(2)
    with pytest.raises(SafetyTrippedError, match=r"yaw_01 .*, joint yaw_03 .*neither angle nor"):
        rig.cycles(20)
    assert rig.link.recoveries == 0


@pytest.mark.parametrize(
    ("servos", "apart_rad", "moved_rad", "unproven"),
    [
        ((0,), 0.0, 0.02, ()),
        ((0,), 0.0, 0.26, ("joint yaw_01 (ID 1)",)),  # a horn that was put back elsewhere
        ((0, 2), 0.5, 0.02, ()),
        ((0, 2), 0.15, 0.02, ("joint yaw_01 (ID 1)", "joint yaw_03 (ID 3)")),
    ],
)
def test_each_joint_that_lost_its_number_needs_another_witness(
    rig: Rig, servos: tuple[int, ...], apart_rad: float, moved_rad: float, unproven: tuple[str, ...]
) -> None:
    for servo in servos:
        rig.line.firmware.reboot(servo)
    rig.line.firmware.plant.position_rad[2] += apart_rad
    believed_rad = rig.position
    believed_rad[0] -= moved_rad
    checked = rig.chain.recheck(believed_rad)
    assert (checked.faults, checked.unproven, checked.doubt is None) == ((), unproven, not unproven)


def test_a_stop_button_ends_the_waiting(rig: Rig) -> None:
    rig.line.pull(1e6)
    rig.link.request_stop("stop button")
    start_s = rig.line.clock.now_s()
    with pytest.raises(SafetyTrippedError):
        rig.link.read()
    assert rig.events[-1] == "given up: stop button"
    assert (
        rig.line.clock.now_s() - start_s < 2.5
    )  # not the ten of the recovery; torque off waits two for the port


def test_it_is_mended_three_times_and_no_more(rig: Rig) -> None:
    for _ in range(3):
        rig.line.pull(0.1)
        rig.cycles(5)
    rig.line.pull(0.1)
    with pytest.raises(SafetyTrippedError):
        rig.cycles(5)
    assert rig.link.recoveries == 3


def test_an_alarm_is_never_mended(rig: Rig) -> None:
    rig.alter("Hardware Error Status", 1, 0x20)
    with pytest.raises(SafetyTrippedError, match="overload"):
        rig.cycles(3)
    assert rig.events == []
    assert rig.torque() == [0] * 4


def test_a_break_while_going_on_switches_torque_off(
    rig: Rig, monkeypatch: pytest.MonkeyPatch
) -> None:
    def lame(found: object) -> None:
        raise ChainError("servo 2: smoke")

    monkeypatch.setattr(rig.chain, "resume", lame)
    rig.line.pull(0.1)
    with pytest.raises(SafetyTrippedError, match="while going on: servo 2: smoke"):
        rig.cycles(1)
    assert rig.torque() == [0] * 4


def test_a_pause_between_read_and_write_is_an_interruption_like_any_other(rig: Rig) -> None:
    """The state was too old for the vetting, and the run ended though it might go on."""
    rig.link.read()
    rig.line.clock.advance(0.4)
    rig.link.write(JointCommand(rig.line.clock.now_s(), np.full(4, rig.goal)))
    assert rig.link.recoveries == 1
    assert rig.link.tripped is None
    rig.cycles(20)
    assert rig.torque() == [1] * 4


@pytest.fixture
def patient() -> Rig:
    """A chain that may reboot an overloaded servo twice; interruptions end its runs."""
    made = Rig("stop", overload_reboots=2)
    made.cycles(30)
    return made


def test_an_overloaded_servo_is_rebooted_set_up_again_and_goes_on_slowly(patient: Rig) -> None:
    rebooted = patient.count_reboots()
    bank = patient.line.bank
    names = ("Position P Gain", "Position D Gain", "Goal Current", "Goal PWM", "Bus Watchdog")
    before = {name: bank[name].tolist() for name in names}
    patient.detect(Alarm.OVERLOAD, 1)
    assert patient.torque() == [1, 0, 1, 1]
    held = patient.position
    patient.link.read()
    assert rebooted == [2]
    assert patient.link.tripped is None
    assert patient.link.recoveries == 1
    assert patient.torque() == [1] * 4
    assert not bank["Hardware Error Status"].any()
    assert {name: bank[name].tolist() for name in names} == before
    assert np.abs(patient.position - held).max() < 0.02
    first, *_, last = patient.events
    assert first == (
        "joint pitch_02 (ID 2): alarm: overload: its servo is rebooted, the others hold; "
        "1 more after this one"
    )
    assert "to be set up again: joint pitch_02 (ID 2)" in patient.events[1]
    assert last == "the run continues from the present position"
    # it is asked for 0.8 rad more at once, and begins at nothing
    patient.goal = float(held[0]) + 0.8
    goals = []
    for _ in range(120):
        patient.cycles(1, speed_rad_s=0.0)
        verdict = patient.link.last_verdict
        assert verdict is not None
        goals.append(verdict.goal_rad[1])
    steps = np.diff(goals)
    assert steps[0] < 4.0 * PERIOD_S * 0.1
    assert (steps[:20] <= 4.0 * PERIOD_S * (np.arange(20) + 4) * PERIOD_S / 2.0).all()
    assert patient.position == pytest.approx(np.full(4, patient.goal), abs=0.1)


def test_after_a_while_the_goals_are_as_fast_as_ever(patient: Rig) -> None:
    patient.detect(Alarm.OVERLOAD, 1)
    patient.cycles(110, speed_rad_s=0.0)
    here = float(patient.position[0])
    patient.goal = here + 0.5
    patient.cycles(1, speed_rad_s=0.0)
    verdict = patient.link.last_verdict
    assert verdict is not None
    patient.cycles(1, speed_rad_s=0.0)
    again = patient.link.last_verdict
    assert again is not None
    assert again.goal_rad[0] - verdict.goal_rad[0] == pytest.approx(4.0 * PERIOD_S, rel=0.05)


def test_an_overload_between_the_reading_and_the_check_of_torque_is_one() -> None:
    """Else every sixteenth overload was told as ``torque is off``."""
    rig = Rig("stop", overload_reboots=1)
    while rig.chain._reads % SLOW_EVERY != SLOW_EVERY // 3:
        rig.cycles(1)
    read, once = rig.chain._cycle.read, [True]

    def read_then_overload() -> object:
        reply = read()
        if once:
            once.clear()
            rig.detect(Alarm.OVERLOAD, 2)
        return reply

    rig.chain._cycle.read = read_then_overload  # type: ignore[method-assign, assignment]
    rig.cycles(3)
    assert rig.link.recoveries == 1
    assert rig.torque() == [1] * 4


def test_a_shaft_that_is_held_overloads_as_often_as_it_may() -> None:
    # else the current, 2.29 A, ends it before the servo does
    patient = Rig("stop", overload_reboots=2, safety=SafetyConfig(current_time_s=5.0))
    patient.cycles(30)
    rebooted = patient.count_reboots()
    patient.line.firmware.block_shafts(np.array([2]))
    here = float(patient.position[2])
    patient.goal = here + 0.33  # full output, and less than does not follow
    with pytest.raises(SafetyTrippedError, match=r"joint yaw_03 \(ID 3\): alarm: overload"):
        patient.cycles(1000, speed_rad_s=0.0)
    assert rebooted == [3, 3]
    assert patient.link.recoveries == 2
    assert patient.torque() == [0] * 4


@pytest.mark.fast_cases(2)
@pytest.mark.parametrize(
    ("alarm", "servos", "said"),
    [
        (Alarm.OVERHEATING, (1,), "joint pitch_02 (ID 2): alarm: overheating"),
        (Alarm.ELECTRICAL_SHOCK, (1,), "joint pitch_02 (ID 2): alarm: electrical shock"),
        (Alarm.OVERLOAD | Alarm.OVERHEATING, (1,), "alarm: overheating, overload"),
        (Alarm.OVERLOAD | Alarm.INPUT_VOLTAGE, (1,), "alarm: input voltage, overload"),
        (Alarm.OVERLOAD, (1, 3), "joint pitch_02 (ID 2): alarm: overload"),
    ],
)
def test_no_other_alarm_is_rebooted_away(
    patient: Rig, alarm: Alarm, servos: tuple[int, ...], said: str
) -> None:
    rebooted = patient.count_reboots()
    patient.detect(alarm, *servos)
    with pytest.raises(SafetyTrippedError, match=re.escape(said)):
        patient.cycles(1)
    assert (rebooted, patient.events, patient.torque()) == ([], [], [0] * 4)


def test_what_else_is_wrong_ends_it_though_there_is_an_overload(patient: Rig) -> None:
    rebooted = patient.count_reboots()
    patient.detect(Alarm.OVERLOAD, 1)
    patient.link.request_stop("stop button")
    with pytest.raises(SafetyTrippedError, match="stop button"):
        patient.cycles(1)
    assert (rebooted, patient.torque()) == ([], [0] * 4)


def test_an_alarm_after_the_reboot_is_not_waited_for(patient: Rig) -> None:
    reboot = patient.line.firmware.reboot

    def and_then_it_is_hot(row: int, *more: object) -> None:
        reboot(row)
        patient.detect(Alarm.OVERHEATING, row)

    patient.line.firmware.reboot = and_then_it_is_hot  # type: ignore[method-assign, assignment]
    patient.detect(Alarm.OVERLOAD, 1)
    start_s = patient.line.clock.now_s()
    with pytest.raises(SafetyTrippedError, match="alarm: overload"):
        patient.cycles(1)
    assert patient.events[-1].startswith("given up: joint pitch_02 (ID 2): alarm: overheating")
    assert patient.line.clock.now_s() - start_s < 1.0
    assert patient.torque() == [0] * 4


def test_a_limp_joint_that_has_fallen_stays_down(patient: Rig) -> None:
    reboot = patient.line.firmware.reboot

    def and_fall(row: int, *more: object) -> None:
        reboot(row)
        patient.line.firmware.plant.position_rad[row] -= 0.5

    patient.line.firmware.reboot = and_fall  # type: ignore[method-assign, assignment]
    patient.detect(Alarm.OVERLOAD, 1)
    with pytest.raises(SafetyTrippedError):
        patient.cycles(1)
    assert "joint pitch_02 (ID 2): moved by -0.5" in patient.events[-1]
    assert patient.torque() == [0] * 4


@pytest.mark.parametrize("answer", [True, False])
def test_an_operator_is_asked_about_an_overload_too(answer: bool) -> None:
    asked: list[str] = []

    def confirm(found: str) -> bool:
        asked.append(found)
        return answer

    rig = Rig("confirm", confirm, overload_reboots=1)
    rig.cycles(5)
    rig.detect(Alarm.OVERLOAD, 0)
    with nullcontext() if answer else pytest.raises(SafetyTrippedError):
        rig.cycles(3)
    assert len(asked) == 1
    assert "to be set up again: joint yaw_01 (ID 1)" in asked[0]
    assert rig.torque() == [int(answer)] * 4


def test_a_stop_while_the_operator_thinks_counts() -> None:
    """Torque came on again, for the time of one check, before it went off."""
    rig = Rig("confirm", lambda found: rig.link.request_stop("stop button") or True)
    rig.cycles(5)
    watched: list[int] = []

    def overhear(time_s: float, from_host: bool, data: bytes) -> None:
        watched.append(sum(rig.torque()))

    rig.line.firmware.reboot(1)
    rig.line.taps.append(overhear)
    with pytest.raises(SafetyTrippedError):
        rig.cycles(20)
    assert rig.events[-1] == "given up: stop button"
    assert max(watched) == 3
    assert rig.torque() == [0] * 4
