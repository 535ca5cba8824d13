"""Fingerprint file: the fingerprints of a robot's servos, next to the robot's file.

``my-robot.toml`` has ``my-robot.servos.toml``. Each start on a port compares the servos with it.
"""

import os
import tomllib
from collections.abc import Mapping
from pathlib import Path

from snakewalk.config.archive import MOST_STORAGE_BYTES, read_text
from snakewalk.config.errors import ConfigError
from snakewalk.config.robot import RobotConfig
from snakewalk.drivers.chain.fingerprint import (
    COMPARED,
    Fingerprint,
    fingerprint_registers,
    register_change,
)
from snakewalk.drivers.errors import ChainError
from snakewalk.drivers.protocol.registers import REVERSE

_HEAD = """\
# Settings of the servos as they were found at the last start on a port (snakewalk).
# A start is refused if a zero, a direction or a limit that protects the servo differs.
# Accept a change: snakewalk doctor --accept --robot {robot}
"""


def fingerprint_path(robot_file: Path) -> Path:
    """Path of the fingerprint file of a robot's file."""
    return robot_file.with_name(f"{robot_file.stem}.servos.toml")


def user_file(name_or_path: str) -> Path | None:
    """File of a robot that is not shipped, if it exists."""
    path = Path(name_or_path)
    return path if name_or_path.endswith(".toml") and path.is_file() else None


class FingerprintFile:
    """Reads, compares and writes the file of one robot."""

    def __init__(self, robot_file: Path) -> None:
        self._robot_file = robot_file
        self.path = fingerprint_path(robot_file)

    def read(self) -> dict[int, dict[str, int]] | None:
        """Fingerprints by servo ID; None without a file.

        Raises:
            ConfigError: the file is broken.

        """
        try:
            text = read_text(self.path, MOST_STORAGE_BYTES)
        except FileNotFoundError:
            return None
        except (OSError, UnicodeDecodeError) as error:
            raise ConfigError(f"{self.path}: cannot be read: {error}") from None
        try:
            return _parse(text)
        except (tomllib.TOMLDecodeError, ValueError) as error:
            raise ConfigError(
                f"{self.path}: is not a fingerprint file: {error}; delete it, and the next "
                "start creates it"
            ) from None

    def write(self, fingerprints: Mapping[int, Fingerprint]) -> None:
        """Replace the file; ``fingerprints`` are by servo ID.

        Raises:
            OSError: it cannot be written.

        """
        lines = [_HEAD.format(robot=self._robot_file)]
        for servo_id, values in sorted(fingerprints.items()):
            lines.append(f"[{servo_id}]")
            lines += [f'"{name}" = {value}' for name, value in values.items()]
            lines.append("")
        part = self.path.with_name(f"{self.path.name}.part")
        part.write_text("\n".join(lines), encoding="utf-8")
        os.replace(part, self.path)

    def check(self, robot: RobotConfig, fingerprints: Mapping[int, Fingerprint]) -> list[str]:
        """Compare servos with the file; create it if it is missing.

        Registers that the chain sets itself are stored, not compared.

        Returns:
            Lines to report.

        Raises:
            ChainError: a servo differs, one line per register.
            ConfigError: the file is broken.

        """
        stored_fingerprints = self.read()
        if stored_fingerprints is not None:
            faults = changes(robot, stored_fingerprints, fingerprints)
            if faults:
                hint = f"snakewalk doctor --accept --robot {self._robot_file} accepts it"
                raise ChainError(
                    [f"{self.path}: {line}; if it is intended, {hint}" for line in faults]
                )
        new = {
            **(stored_fingerprints or {}),
            **{i: dict(fingerprint) for i, fingerprint in fingerprints.items()},
        }
        if new == stored_fingerprints:
            return []
        try:
            self.write(new)
        except OSError as error:
            return [f"{self.path}: cannot be written: {error}; no later start is compared"]
        if stored_fingerprints is None:
            return [f"{self.path}: created with the settings of {len(new)} servos"]
        missing = missing_registers(stored_fingerprints, fingerprints)
        if missing:
            return [f"{self.path}: had no {', '.join(missing)}; completed with the present values"]
        return [f"{self.path}: updated: servos were added, or limits follow the robot's file"]


def changes(
    robot: RobotConfig,
    before: Mapping[int, Fingerprint],
    now: Mapping[int, Fingerprint],
) -> list[str]:
    """Lines, by joint, on the differing registers that the chain does not set."""
    lines = []
    for joint, servo_id in enumerate(robot.servo_ids):
        old, new = before.get(servo_id, {}), now.get(servo_id, {})
        facts = robot.servo_records[joint]
        for name in fingerprint_registers(facts):
            if name not in old or name not in new:
                continue
            mask = -1 if facts.mark_of(name) in COMPARED else 0
            if name == "Drive Mode":
                mask = REVERSE
            if (old[name] ^ new[name]) & mask:
                change = register_change(name, old[name], new[name], facts.rad_per_position)
                lines.append(f"{robot.joint_label(joint)}: {change}")
    return lines


def missing_registers(
    expected: Mapping[int, Fingerprint], reported: Mapping[int, Fingerprint]
) -> list[str]:
    """Registers that the file lacks for its servos."""
    missing = [
        name
        for servo_id, values in reported.items()
        if servo_id in expected
        for name in values
        if name not in expected[servo_id]
    ]
    return list(dict.fromkeys(missing))


def _parse(text: str) -> dict[int, dict[str, int]]:
    fingerprints: dict[int, dict[str, int]] = {}
    for key, table in tomllib.loads(text).items():
        if not (key.isdigit() and isinstance(table, dict)):
            raise ValueError(f"{key}: a table for each servo ID is expected")
        for name, value in table.items():
            if type(value) is not int:
                raise ValueError(f"{key}: {name}: a register with a number is expected")
        fingerprints[int(key)] = dict(table)
    return fingerprints
