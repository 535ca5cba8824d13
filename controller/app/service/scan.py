"""Servos on a bus at every baud rate, and the choice of the serial port."""

import os
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass

from serial.tools import list_ports

from snakewalk.drivers.bus.dynamixel_bus import DynamixelBus
from snakewalk.drivers.errors import PortError
from snakewalk.drivers.port.byte_port import BytePort
from snakewalk.drivers.protocol.control_table import model_numbers
from snakewalk.drivers.protocol.registers import BAUDS, FACTORY_BAUD

_LIKELY = (1_000_000, FACTORY_BAUD)


@dataclass(frozen=True, slots=True)
class ScanResult:
    """One servo that answered a broadcast ping."""

    servo_id: int
    model: str
    firmware: int | None
    baud: int

    def to_dict(self) -> dict[str, object]:
        """For JSON."""
        return asdict(self)


def pick_port(port: str | None) -> str:
    """The port that was asked for, or the only one there is.

    Raises:
        PortError: none was asked for, and there is none, or more than one.

    """
    if port is not None:
        return port
    there = sorted(found.device for found in list_ports.comports() if found.vid is not None)
    if len(there) == 1:
        return there[0]
    shown = f"which one? there are {', '.join(there)}" if there else "no USB serial adapter found"
    raise PortError(f"--port: {shown}")


def has_baud(device: str) -> bool:
    """Whether the baud rate means anything: not on a pseudo-terminal."""
    return not os.path.realpath(device).startswith("/dev/pts/")


def scan(
    port: BytePort,
    bauds: Sequence[int] = (),
    on_progress: Callable[[str], None] = lambda step: None,
) -> list[ScanResult]:
    """Ask at each baud rate, the likely ones first; leaves the port at the one it had.

    Raises:
        PortError: the port vanished.

    """
    before = port.getBaudRate()
    if not has_baud(port.name):
        bauds = (before,)
    results: list[ScanResult] = []
    try:
        for baud in bauds or sorted(BAUDS, key=lambda rate: (rate not in _LIKELY, rate)):
            on_progress(f"{baud} baud")
            if port.setBaudRate(baud):
                results += _at(port, baud)
    finally:
        port.setBaudRate(before)
    return sorted(results, key=lambda servo: (servo.servo_id, servo.baud))


def _at(port: BytePort, baud: int) -> list[ScanResult]:
    names = model_numbers()
    return [
        ScanResult(
            f.servo_id, names.get(f.model_number, f"number {f.model_number}"), f.firmware, baud
        )
        for f in DynamixelBus(port).scan().values()
    ]
