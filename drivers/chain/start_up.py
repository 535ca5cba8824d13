"""Start-up: the checks and settings that turn unknown servos into a chain that holds its pose.

The order avoids what users of such buses report: goals not synced before torque-on, return delays
of 500 us a servo, alarms from before, turn counts lost at a reboot.
"""

from collections.abc import Callable, Collection, Iterable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from snakewalk.config.robot import RobotConfig
from snakewalk.drivers.bus.chain_bus import ChainBus
from snakewalk.drivers.chain.joint_codec import JointUnits
from snakewalk.drivers.errors import BusError, ChainError, ChainFault, FaultCause, ServoError
from snakewalk.drivers.protocol.control_table import model_numbers
from snakewalk.drivers.protocol.registers import (
    CURRENT_POSITION_MODE,
    NO_SECONDARY_ID,
    POSITION_MODE,
    PWM_FULL,
    RETURN_DELAY_UNIT_S,
    REVERSE,
    SHUTDOWN_ALARMS,
    TIME_PROFILE,
    TORQUE_ON_BY_GOAL,
    VOLTAGE_UNIT_V,
    alarm_names,
)
from snakewalk.drivers.types import LIMIT_SLACK_RAD

RAM_SETTINGS = ("Position P Gain", "Goal PWM", "Goal Current")
"""Settings that a reboot or another program would undo, and that are compared while it runs."""
SHAPING_SETTINGS = (
    *("Position I Gain", "Position D Gain", "Feedforward 1st Gain", "Feedforward 2nd Gain"),
    *("Profile Acceleration", "Profile Velocity"),
)
"""Those that another program would change, and a reboot would not."""
IDENTITY = "Velocity I Gain"
"""Holds which joint a servo is, while it runs: no register of position control, in RAM, and reset
by a change of mode. A servo that is given another ID keeps it, one that reboots does not."""
ALL_REPLY = 2
"""Status Return Level(68)."""
FAST_READ_FIRMWARE = 45
"""First firmware with fast sync read (e-manual, DYNAMIXEL Protocol 2.0, Fast Sync Read)."""


@dataclass(frozen=True, slots=True)
class ServoReport:
    """Registers of one servo before anything is changed."""

    servo_id: int
    model: str
    """Name of its model number; the number where the SDK has no name."""
    firmware: int
    hardware_error: int
    return_delay_s: float
    operating_mode: int
    torque_on: bool
    temperature_c: float
    voltage_v: float


@dataclass(frozen=True, slots=True)
class Inspection:
    """The chain as found, and every fault that forbids a start."""

    servos: tuple[ServoReport, ...]
    faults: tuple[ChainFault, ...]

    @property
    def fast_reads(self) -> bool:
        """Whether every firmware knows fast sync read."""
        return all(servo.firmware >= FAST_READ_FIRMWARE for servo in self.servos)


def inspect(
    bus: ChainBus, robot: RobotConfig, servo_ids: Collection[int] | None = None
) -> Inspection:
    """Read identity and state of every servo of the robot, or of some; changes nothing."""
    asked = robot.servo_ids if servo_ids is None else servo_ids
    found = bus.find(asked)
    faults: list[ChainFault] = []
    for part in bus.parts:
        on_it = [i for i in robot.servo_ids if bus.port_of(i) is part.port]
        missing = [str(i) for i in on_it if i in asked and i not in found]
        if missing:
            text = (
                f"{part.port.name}: no answer from servo {', '.join(missing)} of "
                f"{_ids_in_words(on_it)} at {part.port.getBaudRate()} baud: "
                "power, cable, id or baud rate"
            )
            faults.append(ChainFault(FaultCause.NO_ANSWER, text))
    servos = []
    for servo_id, servo in found.items():
        joint = robot.joint_name(robot.servo_ids.index(servo_id))
        name = model_numbers().get(servo.model_number, f"number {servo.model_number}")
        table = bus.table_of(servo_id)
        if servo.model_number != table.model_number:
            text = f"{joint}: is a {name}, not a {table.model}"
            faults.append(ChainFault(FaultCause.OTHER_MODEL, text))
            continue
        report = read_report(bus, servo_id, name)
        servos.append(report)
        if report.hardware_error:
            text = (
                f"{joint}: alarm: {alarm_names(report.hardware_error)}; "
                "remove the cause and reboot it"
            )
            faults.append(ChainFault(FaultCause.ALARM, text))
    return Inspection(tuple(servos), tuple(faults))


def read_report(bus: ChainBus, servo_id: int, name: str) -> ServoReport:
    """Read what a servo tells of itself; changes nothing.

    Raises:
        BusError: it does not answer, or refuses.

    """
    return ServoReport(
        servo_id=servo_id,
        model=name,
        firmware=bus.read(servo_id, "Firmware Version"),
        hardware_error=bus.read(servo_id, "Hardware Error Status"),
        return_delay_s=bus.read(servo_id, "Return Delay Time") * RETURN_DELAY_UNIT_S,
        operating_mode=bus.read(servo_id, "Operating Mode"),
        torque_on=bool(bus.read(servo_id, "Torque Enable")),
        temperature_c=float(bus.read(servo_id, "Present Temperature")),
        voltage_v=bus.read(servo_id, "Present Input Voltage") * VOLTAGE_UNIT_V,
    )


@dataclass(frozen=True, slots=True)
class ChainSetting:
    """A register that shapes the motion or the safety of a chain, and what it must hold."""

    register: str
    value: int
    bits: int = -1
    """Mask of the bits that matter; the others stay as they are."""
    usual: bool = True
    """Whether other values are what a factory or another robot leaves; else a change is told."""


def chain_settings(
    robot: RobotConfig, units: JointUnits, joint: int, goal_pwm: int
) -> tuple[ChainSetting, ...]:
    """Settings of one joint's servo, in the order in which they are written.

    Args:
        robot: limits and gains.
        units: of its joints.
        joint: index of the joint.
        goal_pwm: the servo's PWM Limit(36): a Goal PWM(100) that another program left below it
            would weaken the joint.

    """
    low, high = units.limits_raw[joint]
    pitch = robot.all_axes[joint] == "p"
    limits_current = pitch and bool(units.measures_current[joint])
    if pitch and not limits_current:  # such a model is as soft as its output is small
        goal_pwm = units.pwm_raw(joint, robot.current_limits_a[joint], goal_pwm)
    return (
        ChainSetting("Return Delay Time", 0),
        # before the rest: a new mode resets the gains
        ChainSetting("Operating Mode", CURRENT_POSITION_MODE if limits_current else POSITION_MODE),
        # Torque that a goal or a power-up switches on is torque without a watchdog
        ChainSetting("Drive Mode", 0, TIME_PROFILE | TORQUE_ON_BY_GOAL, usual=False),
        ChainSetting("Startup Configuration", 0, usual=False),
        ChainSetting("Shutdown", SHUTDOWN_ALARMS, SHUTDOWN_ALARMS, usual=False),
        ChainSetting("Min Position Limit", int(low)),
        ChainSetting("Max Position Limit", int(high)),
        ChainSetting("Position P Gain", robot.position_p_gains[joint]),
        ChainSetting("Position I Gain", robot.position_i_gains[joint]),
        ChainSetting("Position D Gain", robot.position_d_gains[joint]),
        ChainSetting("Feedforward 1st Gain", 0, usual=False),
        ChainSetting("Feedforward 2nd Gain", 0, usual=False),
        ChainSetting("Profile Acceleration", 0),
        ChainSetting("Profile Velocity", 0),
        ChainSetting("Goal PWM", goal_pwm, usual=False),
    )


def configure(
    bus: ChainBus,
    robot: RobotConfig,
    units: JointUnits,
    joints: Iterable[int] | None = None,
    on_event: Callable[[str], None] = lambda line: None,
) -> dict[int, dict[str, int]]:
    """Torque off, then every setting that the chain relies on, each read back.

    Args:
        bus: where the servos are.
        robot: the settings.
        units: of its joints.
        joints: only these; None is all.
        on_event: gets a line for each setting that another program has left behind, and for what
            is unusual and stays.

    Returns:
        Values of the RAM registers that a reboot or another program would change, by joint.

    Raises:
        ChainError: a setting of the robot is beyond what a servo allows.
        BusError: a servo does not do what an instruction asks.

    """
    which = tuple(range(robot.joint_count) if joints is None else joints)
    for joint in which:
        servo_id = robot.servo_ids[joint]
        bus.write_verified(servo_id, "Torque Enable", 0)  # the EEPROM is locked while it is on
        # in its error state goals are refused; if cleared with torque on, an old goal would count
        bus.write(servo_id, "Bus Watchdog", 0)
    none = ChainSetting("Secondary(Shadow) ID", NO_SECONDARY_ID, usual=False)
    for joint in which:  # all, before anything that one of them could take for its own
        _apply(bus, robot, joint, none, on_event)
    return {joint: _configure_joint(bus, robot, units, joint, on_event) for joint in which}


def _configure_joint(
    bus: ChainBus,
    robot: RobotConfig,
    units: JointUnits,
    joint: int,
    on_event: Callable[[str], None],
) -> dict[str, int]:
    servo_id, name = robot.servo_ids[joint], robot.joint_name(joint)
    pwm_limit = bus.read(servo_id, "PWM Limit")
    if pwm_limit == 0:
        raise ChainError(f"{name}: PWM Limit is 0: it cannot move; set it to {PWM_FULL}")
    values = {}
    for setting in chain_settings(robot, units, joint, pwm_limit):
        if setting.register in bus.table_of(servo_id):
            values[setting.register] = _apply(bus, robot, joint, setting, on_event)
    if robot.all_axes[joint] == "p" and units.measures_current[joint]:
        values["Goal Current"] = _limit_current(bus, robot, joint, units)
    if pwm_limit < PWM_FULL:
        on_event(f"{name}: PWM Limit is {pwm_limit} of {PWM_FULL}: weak and slow")
    if bus.read(servo_id, "Drive Mode") & REVERSE:
        on_event(f"{name}: Drive Mode is reverse: it turns the other way round")
    offset = bus.read(servo_id, "Homing Offset")
    if offset:
        angle = offset * abs(units.rad_per_position[joint])
        on_event(f"{name}: Homing Offset is {offset}: its zero is moved by {angle:+.2f} rad")
    values[IDENTITY] = _apply(bus, robot, joint, ChainSetting(IDENTITY, identity(joint)), on_event)
    kept = (*RAM_SETTINGS, *SHAPING_SETTINGS, IDENTITY)
    return {register: values[register] for register in kept if register in values}


def identity(joint: int) -> int:
    """Value of ``IDENTITY`` in the servo of a joint."""
    return 1 + joint


def identity_fault(robot: RobotConfig, joint: int, value: int) -> str | None:
    """What the register says of a joint's servo that is another joint's; None if it is not."""
    if value == identity(joint) or not 1 <= value <= robot.joint_count:
        return None
    return (
        f"{robot.joint_name(joint)}: its servo was {robot.joint_name(value - 1)}: exchanged IDs; "
        "put them right: snakewalk bus set"
    )


def _apply(
    bus: ChainBus,
    robot: RobotConfig,
    joint: int,
    setting: ChainSetting,
    on_event: Callable[[str], None],
) -> int:
    """Write a setting where it differs, and read it back; returns the register's value."""
    servo_id, register = robot.servo_ids[joint], setting.register
    try:
        before = bus.read(servo_id, register)
    except ServoError:
        if register == "Startup Configuration":
            return 0  # a firmware before 45 has none
        raise
    value = before & ~setting.bits | setting.value & setting.bits
    if value != before:
        bus.write(servo_id, register, value)
        got = bus.read(servo_id, register)
        if got != value:
            raise BusError(
                f"{robot.joint_name(joint)}: {register}: wrote {value}, reads back {got}"
            )
        if not setting.usual:
            on_event(f"{robot.joint_name(joint)}: {register} was {before}, is {value} now")
    return value


def _limit_current(bus: ChainBus, robot: RobotConfig, joint: int, units: JointUnits) -> int:
    servo_id, current_a = robot.servo_ids[joint], robot.current_limits_a[joint]
    limit = bus.read(servo_id, "Current Limit")
    goal = max(1, units.current_raw(joint, current_a))
    if goal > limit:
        own = bool(robot.joints) and robot.joints[joint].current_limit_a is not None
        raise ChainError(
            f"{robot.joint_name(joint)}: {'' if own else 'pitch_'}current_limit_a = {current_a:g}: "
            f"the servo's Current Limit is {limit * abs(units.a_per_current[joint]):.2f} A"
        )
    bus.write_verified(servo_id, "Goal Current", goal)
    return goal


def let_reply(bus: ChainBus, robot: RobotConfig) -> None:
    """Let servos reply to every instruction, whose Status Return Level(68) forbids it.

    At level 0 a servo replies to pings only, at level 1 to pings and reads: what it must be told
    is sent without waiting for a reply, and only to servos of the robot's model.
    """
    found = bus.find(robot.servo_ids)
    right = [i for i, s in found.items() if s.model_number == bus.table_of(i).model_number]
    if right:
        bus.sync_write(right, "Status Return Level", ALL_REPLY)


def _ids_in_words(ids: Sequence[int]) -> str:
    if list(ids) == list(range(ids[0], ids[-1] + 1)):
        return f"{ids[0]} to {ids[-1]}"
    return ", ".join(map(str, ids))


def check_pose(robot: RobotConfig, position_rad: NDArray[np.float64]) -> None:
    """Refuse to start from a pose that the robot cannot have.

    Raises:
        ChainError: a joint stands well beyond its limit.

    """
    faults = pose_faults(robot, position_rad)
    if faults:
        raise ChainError(faults)


def pose_faults(robot: RobotConfig, position_rad: NDArray[np.float64]) -> list[str]:
    """Joints that stand well beyond their limits, one line each."""
    return [
        f"{robot.joint_name(joint)}: stands at {angle:.2f} rad, beyond its "
        f"limit of {limit:g}: bend it back by hand; if it is straight, its turn count or zero "
        "position is wrong: reboot it, check Homing Offset"
        for joint, (angle, limit) in enumerate(zip(position_rad, robot.limit_rad, strict=True))
        if not abs(angle) <= limit + LIMIT_SLACK_RAD
    ]
