"""What another program, a factory or a reboot leaves in a servo: set, refused or told at the start,
and noticed in a run."""

from collections.abc import Callable

import numpy as np
import pytest

from snakewalk.config.robot import RobotConfig, ServoConfig
from snakewalk.config.run import SafetyConfig
from snakewalk.drivers.bus.dynamixel_bus import DynamixelBus
from snakewalk.drivers.chain.servo_chain import ServoChain
from snakewalk.drivers.chain.start_up import SHAPING_SETTINGS
from snakewalk.drivers.errors import ChainError, SafetyTrippedError
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
    servo=ServoConfig(position_p_gain=640, pitch_p_gain=500, pitch_current_limit_a=0.2),
)
PERIOD_S = 0.02


class Rig:
    """A chain on a bench behind a safe link, whose registers another program may change."""

    def __init__(self, policy: Policy = "stop", watchdog_s: float = 0.2) -> None:
        self.line = SimLine(ServoBank(ROBOT.servo_ids), BenchPlant(4, start_rad=0.1))
        self.chain = ServoChain(DynamixelBus(self.line), ROBOT, watchdog_s=watchdog_s)
        self.events: list[str] = []
        self.chain.on_event = self.events.append
        recovery = Recovery(self.chain, policy=policy, on_event=self.events.append)
        limits = SafetyLimits.from_config(ROBOT, SafetyConfig())
        self.link = SafeLink(self.chain, limits, self.line.clock, recovery)

    def alter(self, register: str, servo: int, value: int) -> None:
        """As another program on the bus would."""
        self.line.settle()
        self.line.bank[register][servo] = value
        self.line.firmware.apply_registers()

    def reboot(self, servo: int) -> None:
        self.line.settle()
        self.line.firmware.reboot(servo)

    def cycles(self, count: int) -> None:
        clock = self.line.clock
        for _ in range(count):
            next_s = clock.now_s() + PERIOD_S
            self.link.read()
            self.link.write(JointCommand(clock.now_s(), np.full(4, 0.1)))
            clock.sleep_until_s(next_s)

    def registers(self, name: str) -> list[int]:
        self.line.settle()
        return list(self.line.bank[name].tolist())


@pytest.mark.fast_cases(6)
@pytest.mark.parametrize(
    ("register", "left", "then", "told"),
    [
        ("Goal PWM", 0, 885, True),
        ("Secondary(Shadow) ID", 3, 255, True),
        ("Startup Configuration", 3, 0, True),
        ("Drive Mode", 8, 0, True),
        ("Drive Mode", 5, 1, True),
        ("Shutdown", 1, 0x35, True),
        ("Position I Gain", 900, 0, False),
        ("Position D Gain", 900, 0, False),
        ("Feedforward 1st Gain", 50, 0, True),
        ("Feedforward 2nd Gain", 50, 0, True),
        ("Status Return Level", 1, 2, False),
        ("Status Return Level", 0, 2, False),
    ],
)
def test_what_another_program_left_is_set_and_told(
    register: str, left: int, then: int, told: bool
) -> None:
    rig = Rig()
    rig.alter(register, 2, left)
    rig.link.enable()
    assert rig.registers(register)[2] == then
    expected = f"joint yaw_03 (ID 3): {register} was {left}, is {then} now"
    assert (expected in rig.events) == told


def test_a_secondary_id_is_cleared_before_a_joint_can_take_the_settings_of_another() -> None:
    """A servo that obeys the goals of another joint was valid, and 0.75 rad off."""
    rig = Rig()
    rig.alter("Secondary(Shadow) ID", 3, 1)
    rig.link.enable()
    clock = rig.line.clock
    for k in range(40):
        rig.link.read()
        goal = np.array([0.1 + 0.01 * k, 0.1, 0.1, 0.1])
        rig.link.write(JointCommand(clock.now_s(), goal))
        clock.advance(PERIOD_S)
    assert rig.line.firmware.plant.position_rad[3] == pytest.approx(0.1, abs=0.01)
    assert rig.registers("Operating Mode") == [3, 5, 3, 5]


@pytest.mark.parametrize(
    ("register", "value", "line"),
    [
        (
            "Homing Offset",
            200,
            "joint yaw_03 (ID 3): Homing Offset is 200: its zero is moved by +0.31",
        ),
        ("Drive Mode", 1, "joint yaw_03 (ID 3): Drive Mode is reverse"),
        ("PWM Limit", 300, "joint yaw_03 (ID 3): PWM Limit is 300 of 885"),
    ],
)
def test_what_may_be_meant_stays_and_is_told(register: str, value: int, line: str) -> None:
    rig = Rig()
    rig.alter(register, 2, value)
    rig.link.enable()
    assert rig.registers(register)[2] == value
    assert any(event.startswith(line) for event in rig.events)


def test_a_servo_that_cannot_move_is_refused() -> None:
    rig = Rig()
    rig.alter("PWM Limit", 2, 0)
    with pytest.raises(ChainError, match=r"joint yaw_03 \(ID 3\): PWM Limit is 0: it cannot move"):
        rig.link.enable()
    assert rig.registers("Torque Enable") == [0] * 4


def test_usual_servos_are_not_worth_a_line() -> None:
    rig = Rig()
    rig.link.enable()
    assert rig.events == []


@pytest.mark.parametrize(("asked_s", "ticks"), [(0.05, 3), (0.06, 3), (0.061, 4), (0.2, 10)])
def test_the_watchdog_is_armed_with_at_least_the_time_that_was_asked(
    asked_s: float, ticks: int
) -> None:
    rig = Rig(watchdog_s=asked_s)
    rig.link.enable()
    assert rig.registers("Bus Watchdog") == [ticks] * 4


def _boots_with_torque(rig: Rig) -> None:
    rig.alter("Startup Configuration", 1, 1)
    rig.reboot(1)


def _boots_with_torque_on_its_next_goal(rig: Rig) -> None:
    rig.alter("Drive Mode", 1, 8)
    rig.reboot(1)


def _loses_its_watchdog(rig: Rig) -> None:
    rig.alter("Bus Watchdog", 1, 0)


def _gets_a_longer_watchdog(rig: Rig) -> None:
    rig.alter("Bus Watchdog", 1, 127)


def _is_weakened(rig: Rig) -> None:
    rig.alter("Goal PWM", 1, 0)


def _loses_its_current_limit(rig: Rig) -> None:
    rig.alter("Goal Current", 1, 1193)


def _loses_its_gain(rig: Rig) -> None:
    rig.alter("Position P Gain", 1, 900)


def _changes(register: str) -> Callable[[Rig], None]:
    def change(rig: Rig) -> None:
        rig.alter(register, 1, 5)

    change.__name__ = register
    return change


CHANGES = (
    *(_boots_with_torque, _boots_with_torque_on_its_next_goal, _loses_its_watchdog),
    *(_gets_a_longer_watchdog, _is_weakened, _loses_its_current_limit, _loses_its_gain),
    *map(_changes, SHAPING_SETTINGS),
)


@pytest.mark.fast_cases(6)
@pytest.mark.parametrize("change", CHANGES)
def test_a_servo_that_is_not_as_it_was_set_stops_the_run(change: Callable[[Rig], None]) -> None:
    """A servo that rebooted with torque on had no watchdog, no current limit, and no trip."""
    rig = Rig()
    rig.link.enable()
    rig.cycles(20)
    change(rig)
    has_booted = change in (_boots_with_torque, _boots_with_torque_on_its_next_goal)
    cause = "it has rebooted" if has_booted else "another program writes to it"
    with pytest.raises(SafetyTrippedError, match=rf"joint pitch_02 \(ID 2\): .*: {cause}"):
        rig.cycles(49)
    assert rig.registers("Torque Enable") == [0] * 4


@pytest.mark.fast_cases(6)
@pytest.mark.parametrize(
    "change", [c for c in CHANGES if c is not _boots_with_torque_on_its_next_goal]
)
def test_going_on_sets_it_up_again(change: Callable[[Rig], None]) -> None:
    rig = Rig("resume")
    rig.link.enable()
    rig.cycles(20)
    change(rig)
    rig.cycles(49)
    assert rig.link.recoveries == 1
    for register, value in (
        *(("Bus Watchdog", 10), ("Goal PWM", 885), ("Torque Enable", 1)),
        *(("Position P Gain", 500), ("Goal Current", round(0.2 / 2.69e-3))),
        *(("Startup Configuration", 0), ("Drive Mode", 0)),
    ):
        assert rig.registers(register)[1] == value, register


FINGERPRINT_CHANGES = [
    ("Homing Offset", 100, "its zero has moved by +0.15 rad"),
    ("Homing Offset", 300, "its zero has moved by +0.46 rad"),
    ("Drive Mode", 1, "its direction is reversed"),
    ("Drive Mode", 8, "Drive Mode is 8, was 0"),
    ("Shutdown", 0, "Shutdown is 0, was 52"),
    ("Min Position Limit", 2000, "Min Position Limit is 2000"),
    ("PWM Limit", 300, "PWM Limit is 300, was 885"),
    ("Current Limit", 100, "Current Limit is 100, was 1193"),
    ("Velocity Limit", 900, "Velocity Limit is 900, was 200"),
    ("Temperature Limit", 100, "Temperature Limit is 100, was 80"),
    ("Min Voltage Limit", 96, "Min Voltage Limit is 96, was 95"),
    ("Max Voltage Limit", 155, "Max Voltage Limit is 155, was 160"),
]


@pytest.mark.fast_cases(6)
@pytest.mark.parametrize(("register", "value", "said"), FINGERPRINT_CHANGES)
def test_a_setting_of_the_eeprom_that_changes_in_motion_stops_the_run(
    register: str, value: int, said: str
) -> None:
    """A zero or a direction that changed was silent, or a joint that does not follow."""
    rig = Rig()
    rig.link.enable()
    rig.cycles(20)
    rig.line.bank[register][1] = value  # the servo itself goes on as before
    with pytest.raises(
        SafetyTrippedError, match=r"joint pitch_02 \(ID 2\): .*another program write"
    ):
        rig.cycles(49)
    assert said in str(rig.link.tripped)


@pytest.mark.slow_cases(3, "11 cases of 0.2 s of CPU")
@pytest.mark.fast_cases(1)
@pytest.mark.parametrize(("register", "value", "said"), FINGERPRINT_CHANGES)
def test_a_setting_of_the_eeprom_that_changes_in_a_pause_is_not_gone_on_with(
    register: str, value: int, said: str
) -> None:
    """It said "verified: the same servos", and the joint was mirrored, or 0.15 rad off."""
    rig = Rig("resume")
    rig.link.enable()
    rig.cycles(20)
    rig.reboot(1)
    rig.alter(register, 1, value)
    with pytest.raises(SafetyTrippedError):
        rig.cycles(49)
    assert rig.events[-1].startswith("given up: ")
    assert said in rig.events[-1]
    assert rig.link.recoveries == 0


@pytest.mark.fast_cases(1)
@pytest.mark.parametrize("policy", ["stop", "resume"])
def test_ids_exchanged_in_motion_stop_the_run_for_good(policy: Policy) -> None:
    """Each servo follows the goals of its new ID: nothing that is measured is wrong."""
    rig = Rig(policy)
    rig.link.enable()
    rig.cycles(20)
    rig.alter("ID", 0, 3)
    rig.alter("ID", 2, 1)
    rig.line.refresh_ids()
    with pytest.raises(
        SafetyTrippedError, match=r"joint yaw_01 \(ID 1\): its servo was joint yaw_03 \(ID 3\)"
    ):
        rig.cycles(17)
    assert rig.registers("Torque Enable") == [0] * 4
    assert rig.link.recoveries == 0
