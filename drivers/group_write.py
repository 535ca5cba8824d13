"""Sync write of one register to many servos: a template in which only values and CRC change."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from drivers.protocol.crc import crc16_long
from drivers.protocol.packet import (
    BROADCAST_ID,
    Instruction,
    InstructionPacket,
    encode_instruction,
)

_PARAMS_AT = 8
_VALUES_AT = 12


class GroupWrite:
    """Sync write of 4-byte registers at ``address`` to ``ids``, in their order."""

    def __init__(self, ids: Sequence[int], address: int) -> None:
        head = address.to_bytes(2, "little") + (4).to_bytes(2, "little")
        entries = b"".join(bytes([servo_id]) + bytes(4) for servo_id in ids)
        packet = InstructionPacket(BROADCAST_ID, Instruction.SYNC_WRITE, head + entries)
        self._frame = np.frombuffer(encode_instruction(packet), np.uint8).copy()
        shares = self._frame[_VALUES_AT:-2].reshape(len(ids), 5)
        self._values = shares[:, 1:].view("<i4")[:, 0]

    def encode(self, values: NDArray[np.int32]) -> bytes:
        """Packet that writes ``values`` (N,); stuffed where the values need it."""
        self._values[:] = values
        crc = crc16_long(self._frame[:-2])
        self._frame[-2:] = crc & 0xFF, crc >> 8
        raw = self._frame.tobytes()
        if raw.find(b"\xff\xff\xfd", _PARAMS_AT, -2) < 0:
            return raw
        params = raw[_PARAMS_AT:-2]
        return encode_instruction(InstructionPacket(BROADCAST_ID, Instruction.SYNC_WRITE, params))
