"""One instruction to one servo and its status packet, strictly: the way around the SDK."""

from snakewalk.drivers.bus.budget import BITS_PER_BYTE, STATUS_BYTES
from snakewalk.drivers.bus.pending_replies import Debts
from snakewalk.drivers.errors import BusError, NoAnswerError, ServoError
from snakewalk.drivers.port.byte_port import BytePort
from snakewalk.drivers.protocol.control_table import Register
from snakewalk.drivers.protocol.packet import (
    ALERT,
    Instruction,
    InstructionPacket,
    ResultError,
    StatusPacket,
    encode_instruction,
)
from snakewalk.drivers.protocol.parser import PacketReader

_ANSWER_S = 0.034
"""What the SDK, too, grants a servo for thinking and the adapter for passing on."""


def read_register(
    port: BytePort, servo_id: int, register: Register, latency_s: float, debts: Debts | None = None
) -> bytes:
    """Bytes of a register.

    Asks for more bytes than the register has while an answer of its length is open.

    Raises:
        NoAnswerError: nobody answered.
        ServoError: the servo refused.
        BusError: the answer has another length.

    """
    what = f"read {register.name}"
    debts = debts if debts is not None else Debts(port.clock)
    length = register.size
    if not debts.none:
        length = debts.free_length([servo_id], length, fast=False)
    span = register.address.to_bytes(2, "little") + length.to_bytes(2, "little")
    packet = InstructionPacket(servo_id, Instruction.READ, span)
    try:
        status = _exchange(port, packet, what, length, latency_s, debts)
    except NoAnswerError:
        debts.owe([servo_id], length, fast=False)
        raise
    if len(status.params) != length:
        raise BusError(f"servo {servo_id}: {what}: {len(status.params)} bytes came, not {length}")
    return status.params[: register.size]


def write_register(
    port: BytePort,
    servo_id: int,
    register: Register,
    data: bytes,
    latency_s: float,
    debts: Debts | None = None,
) -> None:
    """Write ``data`` to a register.

    Raises:
        NoAnswerError: nobody answered.
        ServoError: the servo refused.

    """
    debts = debts if debts is not None else Debts(port.clock)
    params = register.address.to_bytes(2, "little") + data
    packet = InstructionPacket(servo_id, Instruction.WRITE, params)
    _exchange(port, packet, f"write {register.name}", 0, latency_s, debts)


def check_accepted(servo_id: int, what: str, error: int) -> None:
    """Raise ``ServoError`` if the error byte says more than an alert."""
    code = error & ~ALERT
    if code:
        known = code in ResultError._value2member_map_
        name = ResultError(code).name.lower().replace("_", " ") if known else f"error {code}"
        raise ServoError(f"servo {servo_id}: {what}: refused: {name}", error)


def _exchange(
    port: BytePort,
    packet: InstructionPacket,
    what: str,
    data_bytes: int,
    latency_s: float,
    debts: Debts,
) -> StatusPacket:
    reader = PacketReader()
    raw, expected = encode_instruction(packet), STATUS_BYTES + data_bytes
    port.clearPort()
    port.write(raw)
    wire_s = (len(raw) + expected) * BITS_PER_BYTE / port.getBaudRate()
    deadline_s = port.clock.now_s() + wire_s + _ANSWER_S + latency_s
    missing = expected
    while data := port.read_until(missing, deadline_s):
        for answer in reader.feed(data):
            if (
                isinstance(answer, StatusPacket)
                and answer.servo_id == packet.servo_id
                and not _old(answer, data_bytes, debts)
            ):
                check_accepted(packet.servo_id, what, answer.error)
                return answer
        missing = max(1, expected - reader.pending)  # stuffing or noise made it longer
    raise NoAnswerError(f"servo {packet.servo_id}: {what}: no answer at {port.getBaudRate()} baud")


def _old(answer: StatusPacket, data_bytes: int, debts: Debts) -> bool:
    """Whether an answer is known to be that to another question."""
    length = len(answer.params)
    if length == data_bytes or answer.result:
        return False
    return length == 0 or data_bytes == 0 or debts.open(answer.servo_id, length, fast=False)
