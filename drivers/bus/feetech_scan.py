"""Scan for Feetech servos: pings of their own protocol, and model numbers."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Literal

from snakewalk.config.servo_catalogue import servo_model, shipped_models
from snakewalk.drivers.bus.feetech_bus import FeetechBus
from snakewalk.drivers.errors import BusError
from snakewalk.drivers.port.byte_port import BytePort
from snakewalk.drivers.protocol.control_table import Register, model_numbers
from snakewalk.drivers.protocol.feetech import FeetechInstruction
from snakewalk.drivers.protocol.packet import BITS_PER_BYTE
from snakewalk.drivers.protocol.protocol1 import BROADCAST_ID, frame

_HEAD = Register("Firmware Version to Model Number", 0, 5, signed=False)
_REFERENCE_MODEL = "STS3215"
"""Model whose first registers all Feetech models share."""
VARIANT_LIMIT = "Max Voltage Limit"
"""Register whose factory value differs between models with one number: 8 V of an STS3215, 14 V of
an STS3215-C018."""
_TURN_S = 0.3e-3
"""Time after which the next servo replies to a broadcast ping (ours)."""
_SETTLE_S = 0.03
_TRIES = 3
"""Tries of a read from a servo that replied to a ping (ours)."""
_ORDERS: dict[int, Literal["little", "big"]] = {0: "little", 1: "big"}
"""Orders of the bytes of a value, by the content of register 2."""


@dataclass(frozen=True, slots=True)
class FeetechServo:
    """A servo that answered a ping."""

    servo_id: int
    model: str
    firmware: int
    baud: int


def feetech_bauds() -> tuple[int, ...]:
    """Baud rates of the shipped models, the factory's first."""
    models = map(servo_model, shipped_models())
    rates = [baud for facts in models if facts.is_feetech for baud in facts.bauds]
    return tuple(dict.fromkeys(rates))


def find_feetech(
    port: BytePort,
    bauds: Sequence[int],
    on_progress: Callable[[str], None] = lambda step: None,
    *,
    latency_s: float = 0.004,
) -> list[FeetechServo]:
    """Servos at each baud rate, by ID; the port keeps its rate.

    Single IDs are pinged only at rates at which a broadcast ping gets a reply.

    Raises:
        PortError: the port is gone.

    """
    before = port.getBaudRate()
    servo_by_id: dict[int, FeetechServo] = {}
    try:
        for baud in bauds:
            on_progress(f"Feetech servos at {baud} baud")
            if not port.setBaudRate(baud) or not _any_byte_follows(port):
                continue
            on_progress(f"Feetech servos at {baud} baud, ID by ID")
            bus = FeetechBus(port, _REFERENCE_MODEL, latency_s=latency_s, tries=1)
            for servo_id in bus.answering():
                servo = identify(bus, servo_id, baud)
                if servo is not None:
                    servo_by_id.setdefault(servo_id, servo)
    finally:
        port.setBaudRate(before)
    return [servo_by_id[servo_id] for servo_id in sorted(servo_by_id)]


def _any_byte_follows(port: BytePort) -> bool:
    """Whether a broadcast ping is followed by any byte, an echo of the adapter included."""
    packet = frame(BROADCAST_ID, FeetechInstruction.PING)
    port.clearPort()
    port.write(packet)
    wire_s = 2 * len(packet) * BITS_PER_BYTE / port.getBaudRate()
    raw = port.read_until(1, port.clock.now_s() + wire_s + _SETTLE_S)
    port.drain_until_quiet(_SETTLE_S)
    return raw != b""


def identify_at(port: BytePort, servo_id: int, latency_s: float) -> FeetechServo | None:
    """Model of a servo at the rate of the port; None for a DYNAMIXEL servo, and without a reply."""
    bus = FeetechBus(port, _REFERENCE_MODEL, latency_s=latency_s, tries=_TRIES)
    return identify(bus, servo_id, port.getBaudRate())


def identify(bus: FeetechBus, servo_id: int, baud: int) -> FeetechServo | None:
    """Model of a servo; None for a DYNAMIXEL servo of Protocol 1.0, whose ID is register 3."""
    try:
        head = bus.read_bytes(servo_id, _HEAD)
        order = _ORDERS.get(head[2])
        if order is None or (head[3] == servo_id and head[0] | head[1] << 8 in model_numbers(1)):
            return None
        number = int.from_bytes(head[3:], order)
        name = model_numbers("feetech").get(number, f"Feetech, number {number}")
        shared = shipped_variants(name)
        if shared:
            limit = bus.read(servo_id, VARIANT_LIMIT)
            rows = {model: servo_model(model).registers[VARIANT_LIMIT] for model in shared}
            name = min(rows, key=lambda model: abs(rows[model].initial - limit))
    except BusError:
        return None
    return FeetechServo(servo_id, name, head[0], baud)


def shipped_variants(name: str) -> list[str]:
    """Shipped Feetech models that share the number of this one; none if it is alone."""
    feetech = [facts for facts in map(servo_model, shipped_models()) if facts.is_feetech]
    numbers = {facts.model: facts.model_number for facts in feetech}
    shared = [model for model, number in numbers.items() if number == numbers.get(name)]
    return shared if len(shared) > 1 else []
