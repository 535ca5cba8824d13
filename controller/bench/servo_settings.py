"""Settings of one servo that outlive its power: planned, shown, and only then written.

They live in the EEPROM, which is locked while torque is on; each is read back.
"""

from dataclasses import asdict, dataclass

import numpy as np

from snakewalk.config.errors import InputError
from snakewalk.drivers.bus.dynamixel_bus import DynamixelBus
from snakewalk.drivers.bus.feetech_bus import FeetechBus
from snakewalk.drivers.bus.feetech_scan import identify
from snakewalk.drivers.errors import BusError, ControlTableError, NoAnswerError
from snakewalk.drivers.port.byte_port import BytePort
from snakewalk.drivers.protocol.control_table import model_of
from snakewalk.drivers.protocol.packet import MAX_ID
from snakewalk.drivers.protocol.registers import (
    VOLTAGE_UNIT_V,
    ServoUnits,
    alarm_names,
    baud_code,
    bauds_of,
)

RESTART_S = 3.0
_ASK_AGAIN_S = 0.1
"""Longest time until a servo replies after a reboot, and between the tries (ours)."""
_LIMITS = {
    "min_position_rad": "Min Position Limit",
    "max_position_rad": "Max Position Limit",
    "current_limit_a": "Current Limit",
    "temperature_limit_c": "Temperature Limit",
    "voltage_min_v": "Min Voltage Limit",
    "voltage_max_v": "Max Voltage Limit",
    "return_delay_us": "Return Delay Time",
}


@dataclass(frozen=True, slots=True)
class SettingsRequest:
    """New values of a servo's settings; None leaves a setting as it is."""

    new_id: int | None = None
    new_baud: int | None = None
    min_position_rad: float | None = None
    max_position_rad: float | None = None
    current_limit_a: float | None = None
    temperature_limit_c: float | None = None
    voltage_min_v: float | None = None
    voltage_max_v: float | None = None
    return_delay_us: float | None = None
    registers: tuple[str, ...] = ()
    """Other registers, ``NAME=VALUE``."""


@dataclass(frozen=True, slots=True)
class SettingChange:
    """One register: its raw values now and then, and what the new one means."""

    register: str
    before: int
    after: int
    meaning: str


@dataclass(frozen=True, slots=True)
class SettingsResult:
    """Changes on a servo, made or planned."""

    servo: int
    """ID by which the servo was addressed."""
    changes: tuple[SettingChange, ...]
    written: bool
    """Whether the changes were written and read back."""

    def to_dict(self) -> dict[str, object]:
        """For JSON."""
        return asdict(self)


def open_servo(port: BytePort, servo_id: int, latency_s: float) -> DynamixelBus:
    """Bus with the control table of the servo that answers to ``servo_id``.

    Raises:
        InputError: the ID is out of range.
        NoAnswerError: nobody answers.
        ControlTableError: the servo's model is not known.

    """
    if not 0 <= servo_id <= MAX_ID:
        raise InputError(f"--id {servo_id}: a bus has IDs 0 to {MAX_ID}")
    try:
        ping = DynamixelBus(port, latency_s=latency_s).ping(servo_id)
    except NoAnswerError:
        feetech = identify(FeetechBus(port, latency_s=latency_s), servo_id, port.getBaudRate())
        if feetech is None:
            raise
        return FeetechBus(port, feetech.model, latency_s=latency_s)
    return DynamixelBus(port, model_of(ping.model_number), latency_s=latency_s)


def plan(bus: DynamixelBus, servo_id: int, request: SettingsRequest) -> tuple[SettingChange, ...]:
    """Registers that would change, in the order of writing; reads only.

    Raises:
        InputError: values that the servo or the bus cannot have, all of them at once.
        BusError: the servo does not answer.

    """
    faults: list[str] = []
    values = _raw(bus, request, faults)
    if request.new_id is not None and request.new_id != servo_id and 0 <= request.new_id <= MAX_ID:
        taken = bus.find([request.new_id])
        if taken:
            faults.append(f"--new-id {request.new_id}: there is a servo with this ID already")
    if faults:
        raise InputError(faults)
    now = {name: bus.read(servo_id, name) for name in values}
    changes = [
        SettingChange(name, now[name], value, meaning)
        for name, (value, meaning) in values.items()
        if now[name] != value
    ]
    low = values.get("Min Position Limit", (bus.read(servo_id, "Min Position Limit"), ""))[0]
    high = values.get("Max Position Limit", (bus.read(servo_id, "Max Position Limit"), ""))[0]
    if low >= high:
        raise InputError(f"position limits {low} to {high} (raw): the lower is not below the upper")
    if changes and bus.read(servo_id, "Torque Enable"):
        changes.insert(
            0, SettingChange("Torque Enable", 1, 0, "off: the EEPROM is locked while it is on")
        )
    return tuple(changes)


def apply(bus: DynamixelBus, servo_id: int, changes: tuple[SettingChange, ...]) -> None:
    """Write and read back; ID and baud rate last, since after them the servo is elsewhere.

    Raises:
        BusError: a value was refused, or does not read back.

    """
    for change in changes:
        if change.register in ("ID", "Baud Rate"):
            bus.write_kept(servo_id, change.register, change.after)
            if change.register == "ID":
                servo_id = change.after
            else:
                bus.port.setBaudRate(bauds_of(bus.table.facts)[change.after])
            if bus.read(servo_id, change.register) != change.after:
                raise BusError(f"servo {servo_id}: {change.register}: does not read back")
        else:
            bus.write_verified(servo_id, change.register, change.after, kept=True)


def restart(bus: DynamixelBus, servo_id: int) -> tuple[str, str]:
    """Reboot a servo and wait until it answers; its alarms before and after, in words.

    Raises:
        BusError: it does not answer, or not again.

    """
    before = bus.read(servo_id, "Hardware Error Status")
    bus.reboot(servo_id)
    clock = bus.port.clock
    give_up_s = clock.now_s() + RESTART_S
    while True:
        clock.sleep_until_s(clock.now_s() + _ASK_AGAIN_S)
        try:
            after = bus.read(servo_id, "Hardware Error Status")
        except NoAnswerError:
            if clock.now_s() >= give_up_s:
                raise
        else:
            return alarm_names(before), alarm_names(after)


def _raw(
    bus: DynamixelBus, request: SettingsRequest, faults: list[str]
) -> dict[str, tuple[int, str]]:
    """Value and meaning by register; limits first, then ID, then baud rate."""
    values: dict[str, tuple[int, str]] = {}
    for field, register in _LIMITS.items():
        value = getattr(request, field)
        if value is None:
            continue
        option = "--" + field.rsplit("_", 1)[0].replace("_", "-")
        try:
            values[register] = (_limit(bus, register, float(value)), _with_unit(field, value))
            bus.table[register].encode(values[register][0])
        except (InputError, ValueError, OverflowError) as error:
            faults.append(f"{option} {value:g}: {error}")
    for text in request.registers:
        name, _, value = text.partition("=")
        try:
            values[name.strip()] = (_register(bus, name.strip(), value), "")
        except (InputError, ControlTableError) as error:
            faults.append(f"--register {text}: {error}")
    if request.new_id is not None:
        values["ID"] = (request.new_id, f"answers to {request.new_id}")
        if not 0 <= request.new_id <= MAX_ID:
            faults.append(f"--new-id {request.new_id}: a bus has IDs 0 to {MAX_ID}")
    if request.new_baud is not None:
        try:
            code = baud_code(bus.table.facts, request.new_baud)
            values["Baud Rate"] = (code, f"{request.new_baud} bit/s")
        except InputError as error:
            faults.append(f"--new-baud {error}")
    return values


def _register(bus: DynamixelBus, name: str, text: str) -> int:
    """Value of a setting that its option gives as text."""
    address = bus.table.register(name).address
    facts = bus.table.facts
    row = facts.registers[name]
    if row.range is None or address >= facts.ram_from:
        raise InputError("is not a setting: it is read-only, or lost at power-off")
    if row.mark == "ignored: address":
        raise InputError("use --new-id or --new-baud")
    low, high = row.range
    try:
        value = int(text)
    except ValueError:
        value = high + 1
    if not low <= value <= high:
        raise InputError(f"must be a whole number from {low} to {high}")
    return value


def _limit(bus: DynamixelBus, register: str, value: float) -> int:
    if not np.isfinite(value):
        raise InputError("must be a finite number")
    if register.endswith("Position Limit"):
        units = bus.table
        raw = round(value / units.rad_per_position) + units.zero_position
        half = round(np.pi / units.rad_per_position)
        if not -half <= raw - units.zero_position < half:
            raise InputError("beyond half a turn from straight")
        return raw
    if value < 0.0:
        raise InputError("is negative")
    if register == "Current Limit":
        return ServoUnits.of(bus.table.facts).current_raw(value)
    if register.endswith("Voltage Limit"):
        return round(value / VOLTAGE_UNIT_V)
    return round(value / 2.0) if register == "Return Delay Time" else round(value)


def _with_unit(field: str, value: float) -> str:
    unit = {"rad": "rad", "a": "A", "c": "C", "v": "V", "us": "us"}[field.rsplit("_", 1)[1]]
    return f"{value:g} {unit}"
