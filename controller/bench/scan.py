"""Servos on a bus at every baud rate, and the choice of the serial port."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass

from serial.tools import list_ports

from snakewalk.config.robot import ImuConfig
from snakewalk.drivers.bus.dynamixel_bus import DynamixelBus
from snakewalk.drivers.bus.feetech_scan import feetech_bauds, find_feetech
from snakewalk.drivers.bus.probe import broadcast_ping
from snakewalk.drivers.chain.imu_reader import ImuReader
from snakewalk.drivers.errors import BusError, ControlTableError, PortError
from snakewalk.drivers.port.byte_port import BytePort
from snakewalk.drivers.port.port_map import is_port_map
from snakewalk.drivers.protocol.control_table import model_numbers
from snakewalk.drivers.protocol.imu_table import imu_model
from snakewalk.drivers.protocol.packet import StatusPacket
from snakewalk.drivers.protocol.registers import BAUDS, FACTORY_BAUD, SECONDARY_ID_LIMIT

_LOOKS = 3
_LIKELY = (1_000_000, FACTORY_BAUD)
_SILENT_PINGS = {"sound": 1, "noisy": 2, "lossy": 5}
"""Number of broadcast pings in a row without a new servo before a line is left (ours)."""
_MOST_NAMED_RATES = 3
"""Largest number of baud rates that are named for noise."""
_MOST_BROADCASTS = 12
"""Broadcast pings at one rate, at most (ours)."""
_REPEATED_SCANS = 2
"""How often silent rates that are likely are asked again on a bad line, or where nobody answers;
the noisy ones where nobody answers (ours)."""
_TRIES = 6
"""Tries of a ping or a read on a bad line (ours)."""


@dataclass(frozen=True, slots=True)
class ScanResult:
    """One servo that answered a ping."""

    servo_id: int
    model: str
    firmware: int | None
    baud: int
    secondary_id: int | None = None
    """Second ID whose writes the servo obeys without a reply, or None."""

    def to_dict(self) -> dict[str, object]:
        """For JSON."""
        return asdict(self)


def pick_port(port: str | None) -> str:
    """The requested port, or the only one.

    Raises:
        PortError: no port was named and none or several exist; or several were named.

    """
    if port is not None:
        if is_port_map(port):
            raise PortError(f"--port {port}: one port at a time: its servos are found out on one")
        return port
    there = sorted(comport.device for comport in list_ports.comports() if comport.vid is not None)
    if len(there) == 1:
        return there[0]
    shown = f"which one? there are {', '.join(there)}" if there else "no USB serial adapter found"
    raise PortError(f"--port: {shown}")


def known_bauds() -> set[int]:
    """Return the baud rates of all servo models."""
    return {*BAUDS, *feetech_bauds()}


def check_bauds(bauds: Sequence[int]) -> None:
    """Refuse baud rates that servos do not have.

    Raises:
        ControlTableError: a line for each.

    """
    all_bauds = sorted(known_bauds())
    shown = ", ".join(map(str, all_bauds))
    unknown = [f"--baud {rate}: servos have {shown}" for rate in bauds if rate not in all_bauds]
    if unknown:
        raise ControlTableError(unknown)


@dataclass(frozen=True, slots=True)
class ScanReport:
    """The servos that reply on a line, and the quality of the line."""

    servos: tuple[ScanResult, ...]
    """Found servos by ID."""
    noise_bytes: Mapping[int, int]
    """Baud rate to the bytes that belong to no packet, where there were any."""
    lossy: bool
    """Whether a servo that replied once did not reply each time."""

    @property
    def bad_line(self) -> str | None:
        """Fault of the line in words; None if no fault was seen."""
        if self.noise_bytes:
            shown = ", ".join(f"{count} at {baud} baud" for baud, count in self.noise_bytes.items())
            if len(self.noise_bytes) > _MOST_NAMED_RATES:
                shown = f"{sum(self.noise_bytes.values())} at {len(self.noise_bytes)} baud rates"
            fault_text = (
                f"bytes came damaged ({shown}): noise on the line, or two servos with one ID"
            )
        elif self.lossy:
            fault_text = "not every servo answered each time: packets get lost"
        else:
            return None
        return f"{fault_text}; there may be more servos than these"


def scan(
    port: BytePort,
    bauds: Sequence[int] = (),
    on_progress: Callable[[str], None] = lambda step: None,
    *,
    patient: bool = True,
) -> ScanReport:
    """Ask at each baud rate, the likely ones first; leaves the port at the one it had.

    Where no servo of Protocol 2.0 replies, Feetech servos are asked in their protocol.

    If a servo replies, or bytes are damaged, all are asked again until no new servo replies: a bad
    line loses requests and replies. Where nobody does, likely rates are asked again, if
    ``patient``.

    Raises:
        PortError: the port vanished.

    """
    before = port.getBaudRate()
    asked = tuple(bauds or sorted(BAUDS, key=lambda rate: (rate not in _LIKELY, rate)))
    replies: dict[int, dict[int, StatusPacket]] = {}
    noise: dict[int, int] = {}
    lossy = False
    try:
        for baud in asked:
            on_progress(f"{baud} baud")
            if port.setBaudRate(baud):
                replies[baud], lost = _answers(port, noise, patient=patient)
                lossy |= lost
        bad = lossy or bool(noise)
        silent = not any(replies.values())
        likely = {*_LIKELY, before, *(noise if silent else ())}
        again = [baud for baud in asked if baud in likely]
        for baud in again * _REPEATED_SCANS if patient and (bad or silent) else ():
            if not replies.get(baud) and port.setBaudRate(baud):
                on_progress(f"{baud} baud again")
                replies[baud], lost = _answers(port, noise, patient=patient)
                lossy |= lost or bool(replies[baud])  # it was silent before
        _drop_repeated_replies(port, replies, before, on_progress)
        results = []
        for baud, servos in replies.items():
            if servos and port.setBaudRate(baud):
                tries = _TRIES if bad else None
                results += [_result(port, baud, reply, tries) for reply in servos.values()]
        if not results and not noise:  # no servo of Protocol 2.0, and no bad line
            feetech_servos = find_feetech(port, bauds or feetech_bauds(), on_progress)
            results = [ScanResult(s.servo_id, s.model, s.firmware, s.baud) for s in feetech_servos]
    finally:
        port.setBaudRate(before)
    results.sort(key=lambda servo: (servo.servo_id, servo.baud))
    return ScanReport(tuple(results), noise, lossy)


def _answers(
    port: BytePort, noise: dict[int, int], *, patient: bool
) -> tuple[dict[int, StatusPacket], bool]:
    """Servos that reply at the port's baud rate, and whether packets got lost.

    Adds to ``noise`` what came damaged.
    """
    baud = port.getBaudRate()
    replies: dict[int, StatusPacket] = {}
    state = "sound"
    same_count = 0
    for turn in range(_MOST_BROADCASTS):
        answer = broadcast_ping(port)
        new = [reply for reply in answer.replies if reply.servo_id not in replies]
        replies |= {reply.servo_id: reply for reply in new}
        same_count = 0 if new else same_count + 1
        if answer.noise_bytes:
            noise[baud] = noise.get(baud, 0) + answer.noise_bytes
            state = "noisy" if state == "sound" and replies else state
        if turn and (new or len(answer.replies) < len(replies)):
            state = "lossy"
        if same_count >= _SILENT_PINGS[state] and turn:
            break
        if not replies and not (patient and baud in _LIKELY):
            break
    return replies, state == "lossy"


def _drop_repeated_replies(
    port: BytePort,
    replies: Mapping[int, dict[int, StatusPacket]],
    before: int,
    on_progress: Callable[[str], None],
) -> None:
    """Remove repetitions of a servo that replies at every rate, as on a line without a baud rate.

    Some pseudo-terminals and serial servers ignore the baud rate. Then the servo is reported at
    ``before``, or at the first rate if that was not asked. On a bad line not every request is
    answered: a servo that is found at two rates is pinged at all others. Two servos with one ID, at
    two rates, are reported at both.
    """
    for servo_id in sorted({reported_id for ids in replies.values() for reported_id in ids}):
        bauds = [baud for baud, ids in replies.items() if servo_id in ids]
        if len(bauds) < 2:
            continue
        on_progress(f"servo {servo_id} answers at {len(bauds)} baud rates")
        others = [baud for baud in BAUDS if baud not in bauds]
        answering = sum(_pings_back(port, servo_id, baud) for baud in others)
        if len(bauds) + answering > len(BAUDS) / 2:
            kept = before if before in replies else bauds[0]
            reply = replies[bauds[0]][servo_id]
            for baud in bauds:
                del replies[baud][servo_id]
            replies[kept][servo_id] = reply


def _pings_back(port: BytePort, servo_id: int, baud: int) -> bool:
    if not port.setBaudRate(baud):
        return False
    return bool(DynamixelBus(port, tries=_TRIES).find([servo_id]))


def _result(port: BytePort, baud: int, reply: StatusPacket, tries: int | None) -> ScanResult:
    number = int.from_bytes(reply.params[:2], "little")
    firmware = reply.params[2]
    model = model_numbers().get(number) or _other_device(port, reply.servo_id, number)
    shadow = _secondary_id(port, reply.servo_id, model, tries)
    return ScanResult(reply.servo_id, model, firmware, baud, shadow)


def _other_device(port: BytePort, device_id: int, number: int) -> str:
    published = imu_model(number)
    if published is not None:
        return published
    # a device with an unpublished number is recognised by its registers
    guess = ImuConfig(model="imu_to_dxl", id=device_id)
    reader = ImuReader(DynamixelBus(port), guess)
    shown = any(reader.read(lambda line: None) is not None for _ in range(_LOOKS))
    return f"{'imu_to_dxl?, ' if shown else ''}number {number}"


def _secondary_id(port: BytePort, servo_id: int, model: str, tries: int | None) -> int | None:
    """Secondary(Shadow) ID(12) of a servo; None if it has none, or does not say."""
    try:
        bus = DynamixelBus(port, model) if tries is None else DynamixelBus(port, model, tries=tries)
        shadow = bus.read(servo_id, "Secondary(Shadow) ID")
    except (BusError, ControlTableError):
        return None
    return shadow if shadow <= SECONDARY_ID_LIMIT else None
