"""Start-up: checks and settings of servos before torque.

It handles goals that differ from positions, return delays of 500 us, old alarms and lost turn
counts.
"""

import math
from collections import defaultdict
from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass

from snakewalk.config.arrays import Floats
from snakewalk.config.robot import RobotConfig
from snakewalk.config.servo_model import ServoModel
from snakewalk.drivers.bus.chain_bus import ChainBus
from snakewalk.drivers.bus.dynamixel_bus import PingReply
from snakewalk.drivers.chain.chain_settings import (
    FEETECH_SETTINGS,
    JOINT_NUMBER,
    STARTUP,
    ChainSetting,
    chain_settings,
)
from snakewalk.drivers.chain.fingerprint import (
    Fingerprint,
    fingerprint_of,
    fingerprint_registers,
    fixed_faults,
    present,
)
from snakewalk.drivers.chain.joint_codec import JointUnits
from snakewalk.drivers.errors import BusError, ChainError, ChainFault, FaultCause
from snakewalk.drivers.protocol import feetech
from snakewalk.drivers.protocol.control_table import model_numbers
from snakewalk.drivers.protocol.registers import (
    CURRENT_POSITION_MODE,
    NO_SECONDARY_ID,
    POSITION_MODE,
    RETURN_DELAY_UNIT_S,
    REVERSE,
    VOLTAGE_UNIT_V,
    WATCHDOG,
    alarm_names,
)
from snakewalk.drivers.types import LIMIT_SLACK_RAD

RAM_SETTINGS = ("Position P Gain", "Goal PWM", "Goal Current")
"""RAM settings that a reboot or another program would undo; a run compares them."""
SHAPING_SETTINGS = (
    "Position I Gain",
    "Position D Gain",
    "Feedforward 1st Gain",
    "Feedforward 2nd Gain",
    "Profile Acceleration",
    "Profile Velocity",
)
"""Settings that another program would change, and a reboot would not."""
IDENTITY = JOINT_NUMBER
_REPORTED_REGISTERS = (
    "Firmware Version",
    "Hardware Error Status",
    "Return Delay Time",
    "Operating Mode",
    "Torque Enable",
    "Present Temperature",
    "Present Input Voltage",
    "Present Velocity",
)
_COMPARED_REGISTERS = (*RAM_SETTINGS, *SHAPING_SETTINGS, IDENTITY, "Present Position")
"""Registers read as well, for comparisons of a servo with its earlier state."""
_SETTINGS = (
    "Torque Enable",
    "Bus Watchdog",
    "Secondary(Shadow) ID",
    "Return Delay Time",
    "Operating Mode",
    "Drive Mode",
    STARTUP,
    "Shutdown",
    "Goal Current",
    "Goal PWM",
    "Position P Gain",
    *SHAPING_SETTINGS,
    IDENTITY,
)
"""Registers that ``configure`` checks besides those of the fingerprint."""
_TURNING_RAD_S = 0.2
"""Velocity of a servo that does not hold its position (ours)."""
_MOST_LISTED = 3
"""Largest number of servos of another model that are reported in a line each (ours)."""
ALL_REPLY = 2
"""Value of Status Return Level(68) at which a servo replies to every instruction."""


@dataclass(frozen=True, slots=True)
class ServoReport:
    """Registers of one servo before any change."""

    servo_id: int
    model: str
    """Name of its model number; the number itself if no file has it."""
    firmware: int
    hardware_error: int
    return_delay_s: float
    operating_mode: int
    torque_on: bool
    temperature_c: float
    voltage_v: float
    registers: Mapping[str, int]
    """Present position, and the RAM registers that a chain sets, if the model has them."""
    fast_reads: bool
    """Whether its firmware has fast sync read."""


@dataclass(frozen=True, slots=True)
class Inspection:
    """State of the chain before a start, and every fault that forbids the start."""

    servos: tuple[ServoReport, ...]
    faults: tuple[ChainFault, ...]

    @property
    def fast_reads(self) -> bool:
        """Whether every firmware has fast sync read."""
        return all(servo.fast_reads for servo in self.servos)


def inspect(
    bus: ChainBus,
    robot: RobotConfig,
    servo_ids: Collection[int] | None = None,
    replies: Mapping[int, PingReply] | None = None,
) -> Inspection:
    """Read identity and state of the robot's servos; changes nothing.

    ``servo_ids`` None: all. ``replies`` are those to recent pings; None: ping.

    Raises:
        BusError: a servo that replied to its ping does not reply later, or refuses.

    """
    asked = robot.servo_ids if servo_ids is None else servo_ids
    replies_by_id = bus.find(asked) if replies is None else replies
    faults: list[ChainFault] = []
    for part in bus.parts:
        members = [i for i in robot.servo_ids if bus.port_of(i) is part.port]
        missing = [str(i) for i in members if i in asked and i not in replies_by_id]
        if missing:
            port = part.port.name
            baud = part.port.getBaudRate()
            ids_text = _ids_in_words(members)
            text = (
                f"{port}: no answer from servo {', '.join(missing)} of {ids_text} at {baud} baud: "
            )
            text += "power, cable, id or baud rate"
            if len(missing) == len(members) > 1:
                text = (
                    f"{port}: no answer from any of the servos {ids_text} at {baud} baud: power, "
                    f"cable, baud rate or another make; snakewalk bus scan --port {port} lists the "
                    "servos that reply"
                )
            faults.append(ChainFault(FaultCause.NO_ANSWER, text))
    servos = []
    others = defaultdict[tuple[str, str], list[int]](list)
    for servo_id, servo in replies_by_id.items():
        joint = robot.joint_label(robot.servo_ids.index(servo_id))
        table = bus.table_of(servo_id)
        if servo.model_number != table.model_number:
            name = _replying_model(servo.model_number, table.facts)
            others[name, table.model].append(servo_id)
            continue
        report = read_report(bus, servo_id, table.model)
        servos.append(report)
        if report.hardware_error:
            text = (
                f"{joint}: alarm: {alarm_names(report.hardware_error)}; "
                "remove the cause and reboot it"
            )
            faults.append(ChainFault(FaultCause.ALARM, text))
        faults += [
            ChainFault(FaultCause.OTHER_SETTINGS, f"{joint}: {text}; {remedy}")
            for text, remedy in fixed_faults(servo_id, report.registers, table.facts)
        ]
    for (name, model), ids in others.items():
        if len(ids) <= _MOST_LISTED:
            labels = (robot.joint_label(robot.servo_ids.index(joint_id)) for joint_id in ids)
            texts = [f"{label}: is a {name}, not a {model}" for label in labels]
        else:
            texts = [f"servos {_ids_in_words(ids)}: are {name}, not {model}"]
        faults += [ChainFault(FaultCause.OTHER_MODEL, text) for text in texts]
    return Inspection(tuple(servos), tuple(faults))


def _replying_model(number: int, expected: ServoModel) -> str:
    """Return the name of another model; Feetech's series have different orders of bytes."""
    names = model_numbers(expected.protocol)
    if expected.is_feetech and number not in names:
        number = int.from_bytes(number.to_bytes(2, "little"), "big")
    return names.get(number, f"number {number}")


def taken_over(servos: Iterable[ServoReport], robot: RobotConfig, units: JointUnits) -> list[str]:
    """Lines on servos that another program drives: those in another mode, or in motion."""
    lines = []
    for servo in servos:
        joint = robot.servo_ids.index(servo.servo_id)
        is_feetech = robot.servo_records[joint].is_feetech
        usual = (feetech.POSITION_MODE,) if is_feetech else (POSITION_MODE, CURRENT_POSITION_MODE)
        mode = servo.operating_mode
        speed = servo.registers["Present Velocity"] * units.rad_s_per_velocity[joint]
        if servo.torque_on and (mode not in usual or abs(speed) > _TURNING_RAD_S):
            lines.append(
                f"{robot.joint_label(joint)}: another program drives it at "
                f"{speed:+.2f} rad/s, Operating Mode {mode}; this run sets it up"
            )
    return lines


def read_report(bus: ChainBus, servo_id: int, name: str) -> ServoReport:
    """Read the registers of a report; changes nothing.

    Raises:
        BusError: it does not reply, or refuses.

    """
    table = bus.table_of(servo_id)
    feetech_names = FEETECH_SETTINGS if table.facts.is_feetech else ()
    names = present((*_REPORTED_REGISTERS, *_COMPARED_REGISTERS, *feetech_names), table.facts)
    names += fingerprint_registers(table.facts)
    values = bus.read_each(servo_id, names)
    return ServoReport(
        servo_id=servo_id,
        model=name,
        firmware=values["Firmware Version"],
        hardware_error=values["Hardware Error Status"],
        return_delay_s=values.get("Return Delay Time", 0) * RETURN_DELAY_UNIT_S,
        operating_mode=values.get("Operating Mode", feetech.POSITION_MODE),
        torque_on=bool(values["Torque Enable"]),
        temperature_c=float(values["Present Temperature"]),
        voltage_v=values["Present Input Voltage"] * VOLTAGE_UNIT_V,
        registers=values,
        fast_reads=table.facts.has_fast_reads(values["Firmware Version"]),
    )


@dataclass(frozen=True, slots=True)
class ServoSettings:
    """Registers of one servo after its set-up."""

    ram: Mapping[str, int]
    """Registers that a reboot or another program would change."""
    fingerprint: Fingerprint
    """Values of the fingerprint registers in its EEPROM."""


def configure(
    bus: ChainBus,
    robot: RobotConfig,
    units: JointUnits,
    joints: Iterable[int] | None = None,
    on_event: Callable[[str], None] = lambda line: None,
) -> dict[int, ServoSettings]:
    """Torque off, then every setting that the chain relies on, each read back.

    ``joints`` None: all. ``on_event`` gets a line for each changed setting of another program, and
    for each unusual setting that stays.

    Returns:
        The settings of each joint's servo.

    Raises:
        ChainError: a setting of the robot exceeds a servo's range.
        BusError: a servo does not follow an instruction.

    """
    which = tuple(range(robot.joint_count) if joints is None else joints)
    if not which:
        return {}
    ids = [robot.servo_ids[joint] for joint in which]
    bus.sync_write(ids, "Torque Enable", 0)  # the EEPROM is locked while it is on
    settings_by_joint: dict[int, dict[str, int]] = {}
    for joint, servo_id in zip(which, ids, strict=True):
        settings_by_joint[joint] = _read_settings(bus, servo_id)
        if settings_by_joint[joint]["Torque Enable"]:  # the packet was lost
            bus.write_verified(servo_id, "Torque Enable", 0)
        # in its error state it rejects goals; clearing it with torque on would apply an old goal
        if settings_by_joint[joint].get(WATCHDOG):
            bus.write(servo_id, WATCHDOG, 0)
    none = ChainSetting("Secondary(Shadow) ID", NO_SECONDARY_ID, usual=False)
    for joint in which:  # all, before a packet that one of them might treat as its own
        settings_by_joint[joint] = _apply(
            bus, robot, joint, (none,), settings_by_joint[joint], on_event
        )
    return {
        joint: _configure_joint(bus, robot, units, joint, settings_by_joint[joint], on_event)
        for joint in which
    }


def _configure_joint(
    bus: ChainBus,
    robot: RobotConfig,
    units: JointUnits,
    joint: int,
    read_values: dict[str, int],
    on_event: Callable[[str], None],
) -> ServoSettings:
    name = robot.joint_label(joint)
    pwm_limit = read_values["PWM Limit"]
    full = int(units.full_pwm[joint])
    if pwm_limit == 0:
        raise ChainError(f"{name}: PWM Limit is 0: it cannot move; set it to {full}")
    settings = list(chain_settings(robot, units, joint, pwm_limit))
    # an HLS servo with Goal Current 0 has no torque in position mode
    if units.current_mode[joint] or (
        robot.servo_records[joint].is_feetech and "Goal Current" in read_values
    ):
        settings.append(_current_setting(robot, units, joint, read_values["Current Limit"]))
    settings.append(ChainSetting(IDENTITY, identity(joint)))
    values = _apply(bus, robot, joint, settings, read_values, on_event)
    if pwm_limit < full:
        on_event(f"{name}: PWM Limit is {pwm_limit} of {full}: weak and slow")
    if values.get("Drive Mode", 0) & REVERSE:
        on_event(f"{name}: Drive Mode is reverse: its direction is reversed")
    before = read_values.get(IDENTITY, 0)
    if identity_fault(robot, joint, before) is not None:
        on_event(
            f"{name}: its servo was {robot.joint_label(before - 1)} in the run before: have IDs "
            "been exchanged since?"
        )
    offset = values.get("Homing Offset", 0)
    if offset:
        angle = offset * abs(units.rad_per_position[joint])
        on_event(f"{name}: Homing Offset is {offset}: its zero is moved by {angle:+.2f} rad")
    set_here = {setting.register for setting in settings}
    kept = (*RAM_SETTINGS, *SHAPING_SETTINGS, *FEETECH_SETTINGS, IDENTITY)
    ram = {
        register_name: values[register_name]
        for register_name in kept
        if register_name in set_here and register_name in values
    }
    return ServoSettings(ram, fingerprint_of(values, robot.servo_records[joint]))


def identity(joint: int) -> int:
    """Value of ``IDENTITY`` in the servo of a joint."""
    return 1 + joint


def identity_fault(robot: RobotConfig, joint: int, value: int) -> str | None:
    """Fault of a joint's servo whose register names another joint, or None."""
    if value == identity(joint) or not 1 <= value <= robot.joint_count:
        return None
    return (
        f"its servo was {robot.joint_label(value - 1)}: exchanged IDs; correct them: snakewalk "
        "bus set"
    )


def _read_settings(bus: ChainBus, servo_id: int) -> dict[str, int]:
    """Values of the registers of ``configure`` that the model has."""
    facts = bus.table_of(servo_id).facts
    names = (*_SETTINGS, *FEETECH_SETTINGS) if facts.is_feetech else _SETTINGS
    return bus.read_each(
        servo_id, [*present(names, facts), *fingerprint_registers(facts)], (STARTUP,)
    )


def _apply(
    bus: ChainBus,
    robot: RobotConfig,
    joint: int,
    settings: Iterable[ChainSetting],
    read_values: dict[str, int],
    on_event: Callable[[str], None],
) -> dict[str, int]:
    """Write each setting that differs, then read all of them back.

    Returns:
        Present values of the registers.

    Raises:
        BusError: a register differs; or the servo does not reply, or refuses.

    """
    servo_id = robot.servo_ids[joint]
    name = robot.joint_label(joint)
    present_settings = [setting for setting in settings if setting.register in read_values]
    now = read_values
    for setting in present_settings:
        value = setting.value_in(now)
        if value == now[setting.register]:
            continue
        bus.write(servo_id, setting.register, value)
        # a new mode resets the gains
        is_mode = setting.register == "Operating Mode"
        now = _read_settings(bus, servo_id) if is_mode else {**now, setting.register: value}
    if now is read_values:
        return read_values
    now = _read_settings(bus, servo_id)
    for setting in present_settings:
        register = setting.register
        accepted = now[setting.register]
        value = setting.value_in(now)
        if accepted != value:
            raise BusError(f"{name}: {register}: wrote {value}, reads back {accepted}")
        if accepted != read_values[register] and not setting.usual:
            on_event(f"{name}: {register} was {read_values[register]}, is {accepted} now")
    return now


def _current_setting(
    robot: RobotConfig, units: JointUnits, joint: int, limit_raw: int
) -> ChainSetting:
    """Goal Current of a joint; the servo's Current Limit if the robot has no limit.

    Raises:
        ChainError: it is above the servo's Current Limit.

    """
    current_a = robot.current_limits_a[joint]
    if not math.isfinite(current_a):
        return ChainSetting("Goal Current", limit_raw)
    goal = max(1, units.current_raw(joint, current_a))
    if goal > limit_raw:
        is_joint_limit = bool(robot.joints) and robot.joints[joint].current_limit_a is not None
        raise ChainError(
            f"{robot.joint_label(joint)}: {'' if is_joint_limit else 'pitch_'}current_limit_a = "
            f"{current_a:g}: the servo's Current Limit is "
            f"{limit_raw * abs(units.a_per_current[joint]):.2f} A"
        )
    return ChainSetting("Goal Current", goal)


def enable_replies(bus: ChainBus, robot: RobotConfig) -> dict[int, PingReply]:
    """Let servos reply to every instruction (Status Return Level(68)); return ping replies.

    At level 0 a servo replies to pings only, at level 1 to pings and reads; a Feetech servo replies
    to all at level 1. Only servos of the robot's model are written to.
    """
    replies = bus.find(robot.servo_ids)
    by_level: dict[int, list[int]] = {}
    for servo_id, reply in replies.items():
        table = bus.table_of(servo_id)
        if reply.model_number == table.model_number:
            by_level.setdefault(1 if table.facts.is_feetech else ALL_REPLY, []).append(servo_id)
    for level, ids in by_level.items():
        bus.sync_write(ids, "Status Return Level", level)
    return replies


def _ids_in_words(ids: Sequence[int]) -> str:
    if list(ids) == list(range(ids[0], ids[-1] + 1)):
        return f"{ids[0]} to {ids[-1]}"
    return ", ".join(map(str, ids))


def check_pose(robot: RobotConfig, position_rad: Floats) -> None:
    """Reject an impossible start pose.

    Raises:
        ChainError: a joint is well beyond its limit.

    """
    faults = pose_faults(robot, position_rad)
    if faults:
        raise ChainError(faults)


def pose_faults(robot: RobotConfig, position_rad: Floats) -> list[str]:
    """Joints well beyond their limits, one line each."""
    return [
        f"{robot.joint_label(joint)}: stands at {angle:.2f} rad, beyond its "
        f"limit of {limit:g}: bend it back by hand; if it is straight, its turn count or zero "
        "position is wrong: reboot it, check Homing Offset"
        for joint, (angle, limit) in enumerate(zip(position_rad, robot.limit_rad, strict=True))
        if not abs(angle) <= limit + LIMIT_SLACK_RAD
    ]
