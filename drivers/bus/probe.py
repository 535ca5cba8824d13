"""Pings that receive until the line is quiet: which servos share an ID, whose replies are damaged.

Servos with the same ID reply at the same time. Their bytes collide, or both replies arrive where
return delays or clocks differ; one strict ping would show neither.
"""

from dataclasses import dataclass

from snakewalk.drivers.bus.budget import STATUS_BYTES
from snakewalk.drivers.port.byte_port import BytePort
from snakewalk.drivers.protocol.packet import (
    BITS_PER_BYTE,
    Instruction,
    InstructionPacket,
    StatusPacket,
    encode_instruction,
)
from snakewalk.drivers.protocol.parser import PacketParser

_REPLY_BYTES = STATUS_BYTES + 3
_SETTLE_S = 2e-3
"""Longer than the longest return delay (0.508 ms)."""


@dataclass(frozen=True, slots=True)
class Probe:
    """Result of pinging one ID several times."""

    servo_id: int
    pings: int
    answered: int
    """Pings with at least one good reply."""
    doubled: int
    """Good replies beyond one a ping: two servos; a late reply makes up for a missing one."""
    damaged: int
    """Pings after which bytes arrived that are no packet: two servos, or a bad line."""


def probe(port: BytePort, servo_id: int, pings: int, latency_s: float) -> Probe:
    """Ping ``servo_id`` ``pings`` times, each time until the line has fallen quiet.

    Raises:
        PortError: the port is gone.

    """
    packet = encode_instruction(InstructionPacket(servo_id, Instruction.PING))
    answered = total = damaged = 0
    wait_s = (len(packet) + 2 * _REPLY_BYTES) * BITS_PER_BYTE / port.getBaudRate()
    for _ in range(pings):
        port.clearPort()
        port.write(packet)
        deadline_s = port.clock.now_s() + wait_s + _SETTLE_S + latency_s
        reader = PacketParser()
        replies = 0
        while data := port.read_until(_REPLY_BYTES, deadline_s):
            for reply in reader.feed(data):
                replies += isinstance(reply, StatusPacket) and reply.servo_id == servo_id
        answered += replies > 0
        total += replies
        damaged += reader.dropped_bytes + reader.pending > 0
    return Probe(servo_id, pings, answered, max(0, total - pings), damaged)
