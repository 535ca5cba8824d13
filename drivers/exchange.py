"""One instruction to one servo and its status packet, strictly: the way around the SDK."""

from drivers.budget import BITS_PER_BYTE, STATUS_BYTES
from drivers.control_table import Register
from drivers.errors import BusError, NoAnswerError, ServoError
from drivers.port import BytePort
from drivers.protocol.packet import (
    ALERT,
    Instruction,
    InstructionPacket,
    ResultError,
    StatusPacket,
    encode_instruction,
)
from drivers.protocol.parser import PacketReader

_ANSWER_S = 0.034
"""What the SDK, too, grants a servo for thinking and the adapter for passing on."""


def read_register(port: BytePort, servo_id: int, register: Register, latency_s: float) -> bytes:
    """Bytes of a register.

    Raises:
        NoAnswerError: nobody answered.
        ServoError: the servo refused.
        BusError: the answer has another length.

    """
    what = f"read {register.name}"
    span = register.address.to_bytes(2, "little") + register.size.to_bytes(2, "little")
    packet = InstructionPacket(servo_id, Instruction.READ, span)
    status = _exchange(port, packet, what, register.size, latency_s)
    if len(status.params) != register.size:
        raise BusError(
            f"servo {servo_id}: {what}: {len(status.params)} bytes came, not {register.size}"
        )
    return status.params


def write_register(
    port: BytePort, servo_id: int, register: Register, data: bytes, latency_s: float
) -> None:
    """Write ``data`` to a register.

    Raises:
        NoAnswerError: nobody answered.
        ServoError: the servo refused.

    """
    params = register.address.to_bytes(2, "little") + data
    packet = InstructionPacket(servo_id, Instruction.WRITE, params)
    _exchange(port, packet, f"write {register.name}", 0, latency_s)


def check_accepted(servo_id: int, what: str, error: int) -> None:
    """Raise ``ServoError`` if the error byte says more than an alert."""
    code = error & ~ALERT
    if code:
        known = code in ResultError._value2member_map_
        name = ResultError(code).name.lower().replace("_", " ") if known else f"error {code}"
        raise ServoError(f"servo {servo_id}: {what}: refused: {name}", error)


def _exchange(
    port: BytePort, packet: InstructionPacket, what: str, data_bytes: int, latency_s: float
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
            if isinstance(answer, StatusPacket) and answer.servo_id == packet.servo_id:
                check_accepted(packet.servo_id, what, answer.error)
                return answer
        missing = max(1, expected - reader.pending)  # stuffing or noise made it longer
    raise NoAnswerError(f"servo {packet.servo_id}: {what}: no answer at {port.getBaudRate()} baud")
