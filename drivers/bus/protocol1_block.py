"""Group reads and writes of one register on a bus of Protocol 1.0 servos.

An AX-12A has neither sync read nor bulk read, so each servo gets a READ. Goals are one SYNC WRITE.
"""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from snakewalk.config.servo_model import RegisterRow
from snakewalk.drivers.bus.control_cycle import CycleCounters
from snakewalk.drivers.bus.group_read import GroupReadReply
from snakewalk.drivers.port.byte_port import BytePort
from snakewalk.drivers.protocol.packet import BITS_PER_BYTE
from snakewalk.drivers.protocol.protocol1 import (
    BROADCAST_ID,
    Error1,
    Instruction1,
    Packet1,
    Reader1,
    frame,
)

_REFUSED = Error1.RANGE | Error1.CHECKSUM | Error1.INSTRUCTION
"""Errors of a reply that contains no value."""
_STATUS_BYTES = 6
"""Length of a reply without parameters."""
_QUIET_S = 2e-3
"""Silence after which no reply to an older request is under way (ours)."""


class Protocol1Block:
    """One register of servos of Protocol 1.0; a ``GroupCycle``."""

    fast = False
    given_up_on: Sequence[str] = ()

    def __init__(
        self,
        port: BytePort,
        servo_ids: Sequence[int],
        register: RegisterRow,
        *,
        latency_s: float = 0.003,
    ) -> None:
        """Prepare; nothing is sent."""
        self.counters = CycleCounters()
        self._port, self._ids, self._register = port, tuple(servo_ids), register
        address = register.address
        size = register.size
        self._requests = [
            frame(servo_id, Instruction1.READ, bytes((address, size))) for servo_id in self._ids
        ]
        self._latency_s = latency_s
        self._sent_at_s = port.clock.now_s()
        self._is_quiet = True

    @property
    def since_sent_s(self) -> float:
        """Largest possible age of the values of a read, s."""
        return self._port.clock.now_s() - self._sent_at_s

    def write_goals(self, goals: NDArray[np.int32]) -> None:
        """Send values (N,) of the register to all servos."""
        size = self._register.size
        entries = b"".join(
            bytes((servo_id,)) + int(goal).to_bytes(size, "little")
            for servo_id, goal in zip(self._ids, goals, strict=True)
        )
        params = bytes((self._register.address, size)) + entries
        self._port.write(frame(BROADCAST_ID, Instruction1.SYNC_WRITE, params))

    def read(self) -> GroupReadReply:
        """Read the register of each servo.

        Raises:
            PortError: the port is gone.

        """
        self._sent_at_s = self._port.clock.now_s()
        count = len(self._ids)
        size = self._register.size
        data = np.zeros((count, size), np.uint8)
        error = np.zeros(count, np.uint8)
        valid = np.zeros(count, np.bool_)
        answered = np.zeros(count, np.bool_)
        for k in range(count):
            packet = self._ask(k)
            if packet is None:
                continue
            answered[k], error[k] = True, packet.instruction
            if not packet.instruction & _REFUSED and len(packet.params) == size:
                data[k], valid[k] = np.frombuffer(packet.params, np.uint8), True
        flawless = bool(valid.all()) and not error.any()
        return GroupReadReply(
            data, valid, error, answered, clean=True, whole=flawless, flawless=flawless
        )

    def _ask(self, k: int) -> Packet1 | None:
        """Read one servo; return its intact reply, or None.

        After a missing reply it first discards bytes until the line is quiet.
        """
        port = self._port
        if not self._is_quiet:
            port.drain_until_quiet(_QUIET_S)
        port.clearPort()
        port.write(self._requests[k])
        reply_bytes = _STATUS_BYTES + self._register.size
        wire_s = (len(self._requests[k]) + reply_bytes) * BITS_PER_BYTE / port.getBaudRate()
        raw = port.read_until(reply_bytes, port.clock.now_s() + wire_s + self._latency_s)
        packets = [packet for packet in Reader1().feed(raw) if packet.intact]
        replies = [packet for packet in packets if packet.servo_id == self._ids[k]]
        self._is_quiet = len(replies) == 1
        return replies[0] if len(replies) == 1 else None
