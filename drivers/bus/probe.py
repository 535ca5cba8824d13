"""Requests that receive until the line is quiet: they reveal equal IDs and other masters."""

from dataclasses import dataclass

from snakewalk.drivers.bus.budget import STATUS_BYTES
from snakewalk.drivers.port.byte_port import BytePort
from snakewalk.drivers.protocol.feetech import FeetechParser
from snakewalk.drivers.protocol.packet import (
    BITS_PER_BYTE,
    BROADCAST_ID,
    MAX_ID,
    Instruction,
    InstructionPacket,
    StatusPacket,
    encode_instruction,
)
from snakewalk.drivers.protocol.parser import PacketParser

_PING_BYTES = 3
SETTLE_S = 2e-3
"""Silence after a request, longer than the longest return delay (0.508 ms)."""
_REPLY_REMAINDER_S = 0.05
"""Longest delay of the rest of a reply (ours): a busy computer hands over a part of it first."""
_LATEST_S = 0.05
"""Time for which the first missing reply of a servo is awaited (ours)."""
_OVERHEARD_BYTES = 1 << 16
"""Number of overheard bytes that suffice to identify their sender."""
_TURN_S = 3e-3
"""Servos reply to a broadcast ping one behind the other, by their IDs; the SDK waits this long for
each."""
_ADAPTER_S = 0.016
"""Additional wait of the SDK: the latency timer of an adapter."""


@dataclass(frozen=True, slots=True)
class Probe:
    """Result of asking one ID several times."""

    servo_id: int
    requests: int
    answered: int
    """Requests with at least one good reply."""
    doubled: int
    """Good replies beyond one a request: two servos; a late reply makes up for a missing one."""
    damaged: int
    """Requests after which damaged bytes arrived: two servos, or a bad line."""
    late_s: tuple[float, ...]
    """Delay of each complete reply beyond the time on the wire and the return delay."""


def probe_with(
    port: BytePort,
    servo_id: int,
    requests: int,
    packet: bytes,
    reply_bytes: int,
    wait_s: float,
    new_parser: type[PacketParser | FeetechParser],
) -> Probe:
    """Send a request of any protocol several times, each time until the line is quiet.

    ``wait_s`` is the time for servo, adapter and driver besides the wire.

    Raises:
        PortError: the port is gone.

    """
    byte_s = BITS_PER_BYTE / port.getBaudRate()
    answered = total = damaged = 0
    late_s: list[float] = []
    is_patient = may_be_late = True
    for _ in range(requests):
        port.clearPort()
        sent_s = port.clock.now_s()
        port.write(packet)
        deadline_s = sent_s + (len(packet) + 2 * reply_bytes) * byte_s + wait_s
        reader = new_parser()
        replies = 0
        waited = False
        while True:
            data = port.read_until(reply_bytes, deadline_s)
            if not data and reader.pending and is_patient and not waited:
                waited = True  # only a part of the reply has arrived
                rest = max(1, reply_bytes - reader.pending)
                data = port.read_until(rest, port.clock.now_s() + _REPLY_REMAINDER_S)
                is_patient = bool(data)  # else replies are cut off, not late
            if not data and not replies and may_be_late and not reader.pending:
                may_be_late = False
                data = port.read_until(reply_bytes, sent_s + _LATEST_S)
                if data:  # the others may be as late
                    wait_s = _LATEST_S
            if not data:
                break
            for reply in reader.feed(data):
                replies += isinstance(reply, StatusPacket) and reply.servo_id == servo_id
            if replies == 1 and len(late_s) == answered:
                least_s = (len(packet) + reply_bytes) * byte_s
                late_s.append(port.clock.now_s() - sent_s - least_s)
        answered += replies > 0
        total += replies
        damaged += reader.dropped_bytes + reader.pending > 0
    doubled = max(0, total - requests)
    return Probe(servo_id, requests, answered, doubled, damaged, tuple(late_s))


@dataclass(frozen=True, slots=True)
class Overheard:
    """Unrequested bytes."""

    instructions: int
    """Number of instruction packets; only another master sends them."""
    replies: int
    """Number of status packets: replies to another master."""
    noise_bytes: int


def overhear(port: BytePort, seconds: float) -> Overheard:
    """Send nothing for some time, and count unrequested packets and bytes.

    Raises:
        PortError: the port is gone.

    """
    data = port.read_until(_OVERHEARD_BYTES, port.clock.now_s() + seconds)
    reader = PacketParser()
    packets = reader.feed(data)
    replies = sum(isinstance(packet, StatusPacket) for packet in packets)
    noise_bytes = reader.dropped_bytes + reader.pending
    return Overheard(len(packets) - replies, replies, noise_bytes)


@dataclass(frozen=True, slots=True)
class BroadcastReply:
    """Replies to a broadcast ping."""

    replies: tuple[StatusPacket, ...]
    """Good replies to a ping, one of each ID, in the order of the IDs."""
    noise_bytes: int
    """Bytes that belong to no packet: noise, or servos with one ID over each other."""


def broadcast_ping(port: BytePort) -> BroadcastReply:
    """Ping all servos at the port's baud rate; lasts almost a second, 4.5 s at 9600 baud.

    Raises:
        PortError: the port is gone.

    """
    raw = encode_instruction(InstructionPacket(BROADCAST_ID, Instruction.PING, b""))
    most_bytes = len(raw) + (STATUS_BYTES + _PING_BYTES) * (MAX_ID + 1)
    wire_s = most_bytes * BITS_PER_BYTE / port.getBaudRate()
    port.clearPort()
    port.write(raw)
    deadline_s = port.clock.now_s() + wire_s + _TURN_S * MAX_ID + _ADAPTER_S
    reader = PacketParser()
    packets = reader.feed(port.read_until(_OVERHEARD_BYTES, deadline_s))
    replies = {
        packet.servo_id: packet
        for packet in packets
        if isinstance(packet, StatusPacket) and len(packet.params) == _PING_BYTES
    }
    in_order = tuple(replies[servo_id] for servo_id in sorted(replies))
    return BroadcastReply(in_order, reader.dropped_bytes + reader.pending)
