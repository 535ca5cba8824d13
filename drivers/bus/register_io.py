"""Reads and writes of one register of one servo, with a strict codec instead of the SDK's."""

from snakewalk.drivers.bus.budget import STATUS_BYTES
from snakewalk.drivers.bus.line_reservation import LineReservation
from snakewalk.drivers.bus.pending_replies import PendingReplies
from snakewalk.drivers.errors import BusError, NoAnswerError, ServoError
from snakewalk.drivers.port.byte_port import BytePort
from snakewalk.drivers.protocol.control_table import Register
from snakewalk.drivers.protocol.packet import (
    ALERT,
    BITS_PER_BYTE,
    Instruction,
    InstructionPacket,
    ResultError,
    StatusPacket,
    encode_instruction,
)
from snakewalk.drivers.protocol.parser import PacketParser

_REPLY_S = 0.034
"""Time for servo and adapter besides the wire; the SDK's packet time-out has the same."""


def read_register(
    port: BytePort,
    servo_id: int,
    register: Register,
    latency_s: float,
    pending: PendingReplies,
    line: LineReservation,
) -> bytes:
    """Bytes of a register.

    While a reply of its length is pending, it requests more bytes.

    Raises:
        NoAnswerError: no reply.
        ServoError: the servo refused.
        BusError: the reply has a wrong length.

    """
    what = f"read {register.name}"
    length = register.size
    if not pending.empty:
        length = pending.free_length([servo_id], length, fast=False)
    span = register.address.to_bytes(2, "little") + length.to_bytes(2, "little")
    packet = InstructionPacket(servo_id, Instruction.READ, span)
    try:
        status = _exchange(port, packet, what, length, latency_s, pending, line)
    except NoAnswerError:
        pending.add([servo_id], length, fast=False)
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
    pending: PendingReplies,
    line: LineReservation,
) -> None:
    """Write ``data`` to a register.

    Raises:
        NoAnswerError: no reply.
        ServoError: the servo refused.

    """
    params = register.address.to_bytes(2, "little") + data
    packet = InstructionPacket(servo_id, Instruction.WRITE, params)
    _exchange(port, packet, f"write {register.name}", 0, latency_s, pending, line)


def check_accepted(servo_id: int, what: str, error: int) -> None:
    """Raise ``ServoError`` if the error byte has more than an alert."""
    code = error & ~ALERT
    if code:
        is_known = code in ResultError._value2member_map_
        name = ResultError(code).name.lower().replace("_", " ") if is_known else f"error {code}"
        raise ServoError(f"servo {servo_id}: {what}: refused: {name}", error)


def _exchange(
    port: BytePort,
    packet: InstructionPacket,
    what: str,
    data_bytes: int,
    latency_s: float,
    pending: PendingReplies,
    line: LineReservation,
) -> StatusPacket:
    reader = PacketParser()
    copies = False
    raw = encode_instruction(packet)
    expected = STATUS_BYTES + data_bytes
    byte_s = BITS_PER_BYTE / port.getBaudRate()
    port.clearPort()
    free_s = line.reserve(len(raw) * byte_s)
    port.write(raw)
    deadline_s = free_s + expected * byte_s + _REPLY_S + latency_s
    missing = expected
    while data := port.read_until(missing, deadline_s):
        for reply in reader.feed(data):
            if (
                isinstance(reply, StatusPacket)
                and reply.servo_id == packet.servo_id
                and not _is_foreign_reply(reply, data_bytes, pending)
            ):
                if line.has_second_reply(free_s, len(raw) * byte_s, expected * byte_s):
                    copies = True
                    continue
                if copies:
                    line.note_copies(answered=True)
                check_accepted(packet.servo_id, what, reply.error)
                return reply
        missing = max(1, expected - reader.pending)  # stuffing or noise made it longer
    if copies:
        line.note_copies(answered=False)
    baud_text = f"at {port.getBaudRate()} baud"
    reason = f"no answer {baud_text}"
    if reader.dropped_bytes or reader.pending:
        reason = f"damaged bytes {baud_text}: noise on the line, or two servos with this ID"
    raise NoAnswerError(f"servo {packet.servo_id}: {what}: {reason}")


def _is_foreign_reply(reply: StatusPacket, data_bytes: int, pending: PendingReplies) -> bool:
    length = len(reply.params)
    if length == data_bytes or reply.result:
        return False
    return length == 0 or data_bytes == 0 or pending.is_pending(reply.servo_id, length, fast=False)
