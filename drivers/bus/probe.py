"""Pings that are listened to until the line is quiet: who shares an ID, whose answers are damaged.

Servos with the same ID answer at the same time. Their bytes run into each other, or, where return
delays or clocks differ, both arrive; one strict ping would show neither.
"""

from dataclasses import dataclass

from snakewalk.drivers.bus.budget import BITS_PER_BYTE, STATUS_BYTES
from snakewalk.drivers.port.byte_port import BytePort
from snakewalk.drivers.protocol.packet import (
    Instruction,
    InstructionPacket,
    StatusPacket,
    encode_instruction,
)
from snakewalk.drivers.protocol.parser import PacketReader

_ANSWER_BYTES = STATUS_BYTES + 3
_SETTLE_S = 2e-3
"""Longest return delay (0.5 ms) and then some."""


@dataclass(frozen=True, slots=True)
class Probe:
    """What came of pinging one ID several times."""

    servo_id: int
    asked: int
    answered: int
    """Pings with at least one good answer."""
    doubled: int
    """Good answers beyond one a ping: two servos; a late one makes up for a missing one."""
    damaged: int
    """Pings after which bytes came that are no packet: two servos, or a bad line."""


def probe(port: BytePort, servo_id: int, asked: int, latency_s: float) -> Probe:
    """Ping ``servo_id`` ``asked`` times, each time until the line has fallen quiet.

    Raises:
        PortError: the port is gone.

    """
    packet = encode_instruction(InstructionPacket(servo_id, Instruction.PING))
    answered = total = damaged = 0
    wait_s = (len(packet) + 2 * _ANSWER_BYTES) * BITS_PER_BYTE / port.getBaudRate()
    for _ in range(asked):
        port.clearPort()
        port.write(packet)
        deadline_s = port.clock.now_s() + wait_s + _SETTLE_S + latency_s
        reader = PacketReader()
        answers = 0
        while data := port.read_until(_ANSWER_BYTES, deadline_s):
            for answer in reader.feed(data):
                answers += isinstance(answer, StatusPacket) and answer.servo_id == servo_id
        answered += answers > 0
        total += answers
        damaged += reader.dropped_bytes + reader.pending > 0
    return Probe(servo_id, asked, answered, max(0, total - asked), damaged)
