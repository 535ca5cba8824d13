"""Fingerprints on the bench: read from servos, compared with the robot's file, accepted."""

from collections.abc import Iterable, Mapping
from pathlib import Path

from snakewalk.config.errors import InputError
from snakewalk.config.robot import RobotConfig
from snakewalk.controller.bench.port_lines import PortLines
from snakewalk.controller.bench.servo_settings import SettingChange
from snakewalk.controller.console.finding import Finding
from snakewalk.drivers.bus.dynamixel_bus import DynamixelBus
from snakewalk.drivers.bus.feetech_bus import servo_bus
from snakewalk.drivers.chain.fingerprint import Fingerprint, fingerprint_of, fingerprint_registers
from snakewalk.drivers.chain.fingerprint_file import (
    FingerprintFile,
    changes,
    missing_registers,
    user_file,
)
from snakewalk.drivers.errors import BusError


def fingerprint_file(robot: str, option: str) -> FingerprintFile:
    """Fingerprint file of a robot.

    Args:
        robot: its file.
        option: named in the message.

    Raises:
        InputError: the robot is shipped, or has no file.

    """
    path = user_file(robot)
    if path is None:
        raise InputError(
            f"{option}: {robot} has no fingerprint file; name a robot's file of your own: "
            "--robot my-robot.toml"
        )
    return FingerprintFile(path)


def read_fingerprints(bus: DynamixelBus, servo_ids: Iterable[int]) -> dict[int, Fingerprint]:
    """Fingerprints of the servos that reply, by ID.

    Raises:
        PortError: the port is gone.

    """
    fingerprints: dict[int, Fingerprint] = {}
    for servo_id in servo_ids:
        facts = bus.table_of(servo_id).facts
        try:
            registers = bus.read_each(servo_id, fingerprint_registers(facts))
        except BusError:
            continue
        fingerprints[servo_id] = fingerprint_of(registers, facts)
    return fingerprints


def read_all(lines: PortLines, robot: RobotConfig) -> dict[int, Fingerprint]:
    """Fingerprints of a robot's servos on all its ports; raises as ``read_fingerprints``."""
    fingerprints: dict[int, Fingerprint] = {}
    for line, ids in lines.lines:
        bus = servo_bus(line, robot.models_on(ids), latency_s=line.latency_s)
        there = [i for i in robot.servo_ids if ids is None or i in ids]
        fingerprints |= read_fingerprints(bus, there)
    return fingerprints


def fingerprint_finding(
    file: FingerprintFile, robot: RobotConfig, fingerprints: Mapping[int, Fingerprint]
) -> Finding | None:
    """Result of the comparison with the file; None without a file.

    Raises:
        ConfigError: the file is broken.

    """
    accepted = file.read()
    if accepted is None:
        return None
    lines = changes(robot, accepted, fingerprints)
    missing = missing_registers(accepted, fingerprints)
    if not lines and missing:
        text = f"{file.path} has no {', '.join(missing)}: not compared"
        return Finding("fingerprint", "warn", text, "the next run on the port completes the file")
    if not lines:
        return Finding("fingerprint", "ok", f"the servos are as in {file.path}")
    remedy = "if it is intended: snakewalk doctor --accept --robot FILE"
    return Finding("fingerprint", "fail", "; ".join(lines), remedy)


def differences(
    robot: RobotConfig, accepted: Mapping[int, Fingerprint], fingerprints: Mapping[int, Fingerprint]
) -> list[str]:
    """Old and new value of every register that differs, one line each, by joint."""
    return [
        f"{robot.joint_label(joint)}: {name}: {accepted.get(servo_id, {}).get(name, 'unknown')} -> "
        f"{value}"
        for joint, servo_id in enumerate(robot.servo_ids)
        for name, value in fingerprints.get(servo_id, {}).items()
        if accepted.get(servo_id, {}).get(name) != value
    ]


def note_changes(
    file: FingerprintFile, servo_id: int, setting_changes: Iterable[SettingChange]
) -> bool:
    """Store changes of one servo's settings; False if the file does not have the servo.

    Raises:
        ConfigError: the file is broken.
        OSError: it cannot be written.

    """
    accepted = file.read() or {}
    values = accepted.pop(servo_id, None)
    if values is None:
        return False
    by_register = {change.register: change.after for change in setting_changes}
    values |= {
        name: register_value for name, register_value in by_register.items() if name in values
    }
    file.write({**accepted, by_register.get("ID", servo_id): values})
    return True


def write_fingerprints(robot_file: Path, fingerprints: Mapping[int, Fingerprint]) -> Path:
    """Write the fingerprint file of a robot's file; returns its path."""
    file = FingerprintFile(robot_file)
    file.write(fingerprints)
    return file.path
