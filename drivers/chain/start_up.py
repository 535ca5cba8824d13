"""Start-up: the checks and settings that turn unknown servos into a chain that holds its pose.

The order avoids what users of such buses report: goals not synced before torque-on, return delays
of 500 us a servo, alarms from before, turn counts lost at a reboot.
"""

import math
from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from snakewalk.config.robot import RobotConfig
from snakewalk.drivers.bus.dynamixel_bus import DynamixelBus
from snakewalk.drivers.errors import ChainError, ChainFault, FaultCause
from snakewalk.drivers.protocol.control_table import model_numbers
from snakewalk.drivers.protocol.registers import (
    CURRENT_POSITION_MODE,
    POSITION_MODE,
    RETURN_DELAY_UNIT_S,
    VOLTAGE_UNIT_V,
    ServoUnits,
    alarm_names,
)
from snakewalk.drivers.types import LIMIT_SLACK_RAD

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


def inspect(bus: DynamixelBus, robot: RobotConfig) -> Inspection:
    """Read identity and state of every servo of the robot; changes nothing."""
    found = bus.find(robot.servo_ids)
    faults: list[ChainFault] = []
    missing = [str(servo_id) for servo_id in robot.servo_ids if servo_id not in found]
    if missing:
        text = (
            f"{bus.port.name}: no answer from servo {', '.join(missing)} of "
            f"{robot.servo_ids[0]} to {robot.servo_ids[-1]} at {bus.port.getBaudRate()} baud: "
            "power, cable, id or baud rate"
        )
        faults.append(ChainFault(FaultCause.NO_ANSWER, text))
    servos = []
    for servo_id, servo in found.items():
        name = model_numbers().get(servo.model_number, f"number {servo.model_number}")
        if servo.model_number != bus.table.model_number:
            text = f"servo {servo_id}: is a {name}, not a {bus.table.model}"
            faults.append(ChainFault(FaultCause.OTHER_MODEL, text))
            continue
        report = _report(bus, servo_id, name)
        servos.append(report)
        if report.hardware_error:
            text = (
                f"servo {servo_id}: alarm: {alarm_names(report.hardware_error)}; "
                "remove the cause and reboot it"
            )
            faults.append(ChainFault(FaultCause.ALARM, text))
    return Inspection(tuple(servos), tuple(faults))


def _report(bus: DynamixelBus, servo_id: int, name: str) -> ServoReport:
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


def configure(
    bus: DynamixelBus, robot: RobotConfig, units: ServoUnits, joints: Iterable[int] | None = None
) -> None:
    """Torque off, then every setting that the chain relies on, each read back.

    Args:
        bus: where the servos are.
        robot: the settings.
        units: of their model.
        joints: only these; None is all.

    Raises:
        ChainError: a setting of the robot is beyond what a servo allows.
        BusError: a servo does not do what an instruction asks.

    """
    limits = goal_limits_raw(robot, units)
    for joint in range(robot.joint_count) if joints is None else joints:
        servo_id = robot.servo_ids[joint]
        bus.write_verified(servo_id, "Torque Enable", 0)  # the EEPROM is locked while it is on
        # in its error state goals are refused; if cleared with torque on, an old goal would count
        bus.write(servo_id, "Bus Watchdog", 0)
        bus.write_verified(servo_id, "Status Return Level", 2)
        bus.write_verified(servo_id, "Return Delay Time", 0)
        pitch = robot.joint_axes[joint] == "p"
        mode = CURRENT_POSITION_MODE if pitch else POSITION_MODE
        bus.write_verified(servo_id, "Operating Mode", mode)  # before the rest: it resets gains
        bus.write_verified(servo_id, "Min Position Limit", int(limits[joint, 0]))
        bus.write_verified(servo_id, "Max Position Limit", int(limits[joint, 1]))
        gain = robot.servo.pitch_p_gain if pitch else robot.servo.position_p_gain
        bus.write_verified(servo_id, "Position P Gain", gain)
        bus.write_verified(servo_id, "Profile Acceleration", 0)
        bus.write_verified(servo_id, "Profile Velocity", 0)
        if pitch:
            _limit_current(bus, servo_id, robot.servo.pitch_current_limit_a, units)


def _limit_current(bus: DynamixelBus, servo_id: int, current_a: float, units: ServoUnits) -> None:
    limit = bus.read(servo_id, "Current Limit")
    goal = max(1, units.current_raw(current_a))
    if goal > limit:
        raise ChainError(
            f"servo {servo_id}: pitch_current_limit_a = {current_a:g}: the servo's Current Limit "
            f"is {limit * units.a_per_current:.2f} A"
        )
    bus.write_verified(servo_id, "Goal Current", goal)


def goal_limits_raw(robot: RobotConfig, units: ServoUnits) -> NDArray[np.int32]:
    """(J, 2) least and greatest raw goal of each joint; in position mode the servo checks them."""
    half = [math.floor(limit / units.rad_per_position) for limit in robot.limit_rad]
    return np.array([(units.zero_position - h, units.zero_position + h) for h in half], np.int32)


def check_pose(robot: RobotConfig, position_rad: NDArray[np.float64]) -> None:
    """Refuse to start from a pose that the robot cannot have.

    Raises:
        ChainError: a joint stands well beyond its limit.

    """
    faults = [
        f"{robot.joint_name(joint)}: stands at {angle:.2f} rad, beyond its "
        f"limit of {limit:g}: bend it back by hand; if it is straight, its turn count or zero "
        "position is wrong: reboot it, check Homing Offset"
        for joint, (angle, limit) in enumerate(zip(position_rad, robot.limit_rad, strict=True))
        if not abs(angle) <= limit + LIMIT_SLACK_RAD
    ]
    if faults:
        raise ChainError(faults)
