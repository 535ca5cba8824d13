"""Servos on a bus at every baud rate, and the choice of the serial port."""

from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass

from serial.tools import list_ports

from snakewalk.config.robot import ImuConfig
from snakewalk.drivers.bus.dynamixel_bus import DynamixelBus, PingReply
from snakewalk.drivers.chain.imu_reader import ImuReader
from snakewalk.drivers.errors import BusError, ControlTableError, PortError
from snakewalk.drivers.port.byte_port import BytePort
from snakewalk.drivers.port.port_map import is_port_map
from snakewalk.drivers.protocol.control_table import model_numbers
from snakewalk.drivers.protocol.imu_table import imu_model
from snakewalk.drivers.protocol.registers import BAUDS, FACTORY_BAUD, SECONDARY_ID_LIMIT

_LOOKS = 3
_LIKELY = (1_000_000, FACTORY_BAUD)


@dataclass(frozen=True, slots=True)
class ScanResult:
    """One servo that answered a broadcast ping."""

    servo_id: int
    model: str
    firmware: int | None
    baud: int
    secondary_id: int | None = None
    """Another ID whose writes it obeys as well, silently; None: none."""

    def to_dict(self) -> dict[str, object]:
        """For JSON."""
        return asdict(self)


def pick_port(port: str | None) -> str:
    """The port that was asked for, or the only one there is.

    Raises:
        PortError: none was asked for, and there is none, or more than one; several were.

    """
    if port is not None:
        if is_port_map(port):
            raise PortError(f"--port {port}: one port at a time: its servos are found out on one")
        return port
    there = sorted(found.device for found in list_ports.comports() if found.vid is not None)
    if len(there) == 1:
        return there[0]
    shown = f"which one? there are {', '.join(there)}" if there else "no USB serial adapter found"
    raise PortError(f"--port: {shown}")


def check_bauds(bauds: Sequence[int]) -> None:
    """Refuse baud rates that servos do not have.

    Raises:
        ControlTableError: a line for each.

    """
    shown = ", ".join(map(str, BAUDS))
    unknown = [f"--baud {rate}: servos have {shown}" for rate in bauds if rate not in BAUDS]
    if unknown:
        raise ControlTableError(unknown)


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
    asked = tuple(bauds or sorted(BAUDS, key=lambda rate: (rate not in _LIKELY, rate)))
    results: list[ScanResult] = []
    try:
        for baud in asked:
            on_progress(f"{baud} baud")
            if port.setBaudRate(baud):
                results += _at(port, baud)
    finally:
        port.setBaudRate(before)
    if len(asked) > 1:
        results = _told_once(results, before, len(asked))
    return sorted(results, key=lambda servo: (servo.servo_id, servo.baud))


def _told_once(results: Sequence[ScanResult], baud: int, rates: int) -> list[ScanResult]:
    """Results without the repetitions of a line that has no baud rate.

    Behind some pseudo-terminals a servo answers at every rate; it is told at ``baud`` then.
    """
    answers = Counter(servo.servo_id for servo in results)
    return [s for s in results if answers[s.servo_id] < rates or s.baud == baud]


def _at(port: BytePort, baud: int) -> list[ScanResult]:
    names = model_numbers()
    results = []
    for servo in DynamixelBus(port).scan().values():
        model = names.get(servo.model_number) or _other(port, servo)
        shadow = _secondary_id(port, servo.servo_id, model)
        results.append(ScanResult(servo.servo_id, model, servo.firmware, baud, shadow))
    return results


def _other(port: BytePort, device: PingReply) -> str:
    """Name of a device that the SDK does not know."""
    published = imu_model(device.model_number)
    if published is not None:
        return published
    # whose number is not published: known by what only it shows
    guess = ImuConfig(model="imu_to_dxl", id=device.servo_id)
    reader = ImuReader(DynamixelBus(port), guess)
    shown = any(reader.read(lambda line: None) is not None for _ in range(_LOOKS))
    return f"{'imu_to_dxl?, ' if shown else ''}number {device.model_number}"


def _secondary_id(port: BytePort, servo_id: int, model: str) -> int | None:
    """Secondary(Shadow) ID(12) of a servo; None if it has none, or does not say."""
    try:
        shadow = DynamixelBus(port, model).read(servo_id, "Secondary(Shadow) ID")
    except (BusError, ControlTableError):
        return None
    return shadow if shadow <= SECONDARY_ID_LIMIT else None
