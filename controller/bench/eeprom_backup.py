"""Persistent settings of servos as a file: read, compared and restored.

ID, baud rate and protocol stay: they are needed to find a servo, and a replacement has its ID
already.
"""

import json
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path

from pydantic import Field

from snakewalk.config.archive import read_json_object
from snakewalk.config.base import Strict
from snakewalk.config.loader import checked
from snakewalk.controller.bench.port_lines import PortLines
from snakewalk.controller.bench.servo_settings import SettingChange, open_servo
from snakewalk.controller.console.result_files import write_result
from snakewalk.drivers.bus.dynamixel_bus import DynamixelBus
from snakewalk.drivers.bus.feetech_scan import find_feetech
from snakewalk.drivers.chain.chain_settings import JOINT_NUMBER
from snakewalk.drivers.errors import ChainError, ServoError
from snakewalk.drivers.port.byte_port import BytePort

_IDENTITY = (
    "Model Number",
    "Model Information",
    "Firmware Version",
    "ID",
    "Baud Rate",
    "Protocol Type",
)

_JOINTS = range(1, 100)
"""Numbers of joints that a run writes (ours); a factory's value is larger."""


class ServoBackup(Strict):
    """One servo."""

    id: int = Field(ge=0, le=252, description="ID of the servo")
    model: str = Field(description="model of the servo")
    registers: dict[str, int] = Field(
        description="raw value of each register that survives a power cycle, by its name"
    )
    """Raw values of the EEPROM, by the names of the e-manual."""


class BackupFile(Strict):
    """All servos of a bus."""

    servos: tuple[ServoBackup, ...] = Field(min_length=1, description="servos of the bus")


def back_up(
    port: BytePort, latency_s: float, on_progress: Callable[[str], None] = lambda step: None
) -> BackupFile:
    """Read every servo on the bus; writes nothing.

    Raises:
        ChainError: nobody is there, or a Feetech servo holds settings of a run.
        ControlTableError: a servo is of a model that is not known.
        BusError: a servo stops answering.

    """
    servo_ids = list(DynamixelBus(port, latency_s=latency_s).scan())
    if not servo_ids:
        rates = [port.getBaudRate()]
        servo_ids = [servo.servo_id for servo in find_feetech(port, rates, latency_s=latency_s)]
    if not servo_ids:
        raise ChainError(f"{port.name}: no servo answers at {port.getBaudRate()} baud")
    servos = []
    for servo_id in servo_ids:
        on_progress(f"ID {servo_id}")
        bus = open_servo(port, servo_id, latency_s)
        servos.append(
            ServoBackup(id=servo_id, model=bus.table.model, registers=_eeprom(bus, servo_id))
        )
    return BackupFile(servos=tuple(servos))


def back_up_all(lines: PortLines, on_progress: Callable[[str], None]) -> BackupFile:
    """Read every servo on every line; raises as ``back_up``.

    Raises:
        ChainError: (too) servos on two ports share an ID.

    """
    backups: dict[int, tuple[str, ServoBackup]] = {}
    for line, _ in lines.lines:
        for servo in back_up(line, line.latency_s, on_progress).servos:
            if servo.id in backups:
                raise ChainError(
                    f"ID {servo.id} answers on {backups[servo.id][0]} and on {line.name}: one of "
                    "them needs another (snakewalk bus set)"
                )
            backups[servo.id] = line.name, servo
    return BackupFile(servos=tuple(backups[servo_id][1] for servo_id in sorted(backups)))


def backup_text(backup: BackupFile) -> str:
    """Text of the file."""
    return json.dumps(backup.model_dump(), indent=1) + "\n"


def load_backup(path: Path) -> BackupFile:
    """Read a file of ``backup_text``.

    Raises:
        InputError: it cannot be read, or is another kind of file.

    """
    data = read_json_object(path, "a backup of servos, a JSON object")
    return checked(BackupFile, data, str(path))


def plan_restore(bus: DynamixelBus, backup: ServoBackup) -> tuple[SettingChange, ...]:
    """Registers that differ from the backup, in the order of their addresses; reads only.

    Read-only registers of the backup are left out: another firmware has other values there.

    Raises:
        ChainError: the servo is of another model, or it lacks a register or rejects a value of the
            backup; all faults at once.
        BusError: the servo does not answer.

    """
    if bus.table.model != backup.model:
        raise ChainError(
            f"ID {backup.id}: is a {bus.table.model}, the backup's is a {backup.model}"
        )
    now = _eeprom(bus, backup.id)
    rows = bus.table.facts.registers
    values = backup.registers.items()
    stored = {n: v for n, v in values if n in now or n not in rows or rows[n].range}
    strange = sorted(set(stored) - set(now))
    faults = [f"has no {', '.join(strange)} to restore"] if strange else []
    then = {**now, **stored}
    for name in now:
        span = rows[name].range
        if span is not None and not span[0] <= then[name] <= span[1]:
            faults.append(f"{name}: {then[name]} is not within {span[0]} to {span[1]}")
    low, high = (then.get(f"{end} Position Limit", 0) for end in ("Min", "Max"))
    if low > high:
        faults.append(f"Min Position Limit {low} is above Max Position Limit {high}")
    if faults:
        raise ChainError([f"ID {backup.id}: {fault}" for fault in faults])
    changes = [
        SettingChange(name, now[name], then[name], "") for name in now if now[name] != then[name]
    ]
    if changes and bus.read(backup.id, "Torque Enable"):
        changes.insert(0, SettingChange("Torque Enable", 1, 0, "the EEPROM is locked while on"))
    return tuple(changes)


def plan_all(
    buses: Mapping[int, DynamixelBus], servos: Mapping[int, ServoBackup]
) -> dict[int, tuple[SettingChange, ...]]:
    """Plans by ID of the servos that differ; raises as ``plan_restore``, with the faults of all."""
    plans = {}
    faults: list[str] = []
    for servo_id, bus in buses.items():
        try:
            plans[servo_id] = plan_restore(bus, servos[servo_id])
        except ChainError as error:
            faults += error.faults
    if faults:
        raise ChainError(faults)
    return {servo_id: changes for servo_id, changes in plans.items() if changes}


class RestoreJournal:
    """Former values of the servos of an unfinished restore, itself a backup."""

    def __init__(self, backup: Path) -> None:
        name = backup.name.removesuffix(".json").removesuffix(".undo")
        self.path = backup.with_name(f"{name}.undo.json")

    def note(self, plans: Mapping[int, Sequence[SettingChange]], models: Mapping[int, str]) -> None:
        """Store the values that ``plans`` change, on disk, unless an earlier try stored them.

        Raises:
            OSError: it cannot be written.

        """
        old = {s.id: s for s in load_backup(self.path).servos} if self.path.exists() else {}
        servos = {}
        for servo_id, changes in plans.items():
            before = {c.register: c.before for c in changes if c.register != "Torque Enable"}
            before |= old[servo_id].registers if servo_id in old else {}
            servos[servo_id] = ServoBackup(id=servo_id, model=models[servo_id], registers=before)
        text = backup_text(BackupFile(servos=tuple({**old, **servos}.values())))
        write_result(self.path, text)

    def remove(self) -> None:
        """Forget the former values: every servo has those of the backup."""
        self.path.unlink(missing_ok=True)


def _eeprom(bus: DynamixelBus, servo_id: int) -> dict[str, int]:
    """Raw values that a person or a program may have set, by address.

    Raises:
        ChainError: a Feetech servo has been in a run since it was switched on.

    """
    registers = sorted(
        (bus.table[name] for name in bus.table), key=lambda sorted_register: sorted_register.address
    )
    facts = bus.table.facts
    rows = facts.registers
    states_ranges = any(row.range is not None for row in rows.values())
    values = {}
    for register in registers:
        if register.address >= facts.ram_from or register.name in _IDENTITY:
            continue
        if rows[register.name].range is not None or not states_ranges:
            try:
                values[register.name] = bus.read(servo_id, register.name)
            except ServoError:
                continue  # the firmware is older than the table
    if values.get(JOINT_NUMBER) in _JOINTS:
        raise ChainError(
            f"ID {servo_id}: holds settings of a run that its EEPROM does not ({JOINT_NUMBER} is "
            "the number of a joint); switch the servo power off and on"
        )
    return values
