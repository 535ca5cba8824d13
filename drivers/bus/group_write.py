"""Sync write of one register to many servos: a template in which only values and CRC change."""

from collections.abc import Sequence

import numpy as np

from snakewalk.config.arrays import Bytes, Int32s
from snakewalk.drivers.protocol.frames import PARAMS_AT, fill
from snakewalk.drivers.protocol.packet import (
    BROADCAST_ID,
    Instruction,
    InstructionPacket,
    encode_instruction,
)


class GroupWrite:
    """Sync write of 4-byte registers at ``address`` to ``ids``."""

    def __init__(self, ids: Sequence[int], address: int) -> None:
        head = address.to_bytes(2, "little") + (4).to_bytes(2, "little")
        entries = b"".join(bytes([servo_id]) + bytes(4) for servo_id in ids)
        packet = InstructionPacket(BROADCAST_ID, Instruction.SYNC_WRITE, head + entries)
        self._frame = np.frombuffer(encode_instruction(packet), np.uint8).copy()
        self._values = np.zeros(len(ids), np.int32)
        self.size = len(self._frame)
        """Bytes of the write packet without stuffing."""

    def template(self) -> Bytes:
        """New packet to fill."""
        return self._frame.copy()

    def encode(self, values: Int32s) -> bytes:
        """Packet that writes ``values`` (N,), stuffed if necessary."""
        self._values[:] = values
        sendable = fill(self._frame, self._values)
        raw = self._frame.tobytes()
        if sendable:
            return raw
        params = raw[PARAMS_AT:-2]
        return encode_instruction(InstructionPacket(BROADCAST_ID, Instruction.SYNC_WRITE, params))
