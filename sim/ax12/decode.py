"""Decoder of Protocol 1.0 into text, packet by packet, with the registers of one model.

Status and instruction packets look alike. A packet with the ID of the last instruction and the
length of its reply is decoded as the reply.
"""

from collections.abc import Iterator
from enum import IntEnum, IntFlag
from typing import ClassVar

from snakewalk.config.servo_catalogue import servo_model
from snakewalk.config.servo_model import RegisterRow, ServoModel
from snakewalk.drivers.protocol.protocol1 import (
    BROADCAST_ID,
    Error1,
    Instruction1,
    Packet1,
    Reader1,
    frame,
)
from snakewalk.sim.ax12.table import MODEL
from snakewalk.sim.sniff.decode import DecodedPacket

GAP_S = 5e-3
"""Silence after which a servo gives up a partial packet."""
REPLY_MAX_S = 0.1
"""Longest time between a request and its reply."""


class Decoder1:
    """Converts bytes of a bus to decoded packets."""

    instructions: ClassVar[type[IntEnum]] = Instruction1
    errors: ClassVar[type[IntEnum] | type[IntFlag]] = Error1
    """Bits of a reply's error byte."""

    def __init__(self, facts: ServoModel | None = None) -> None:
        """Decode with the registers of a model; default: AX-12A."""
        self._registers = (servo_model(MODEL) if facts is None else facts).registers
        self._reader = Reader1()
        self._asked: Packet1 | None = None
        self._asked_s = self._last_s = 0.0

    def feed(self, time_s: float, data: bytes) -> Iterator[DecodedPacket]:
        """Packets that ``data`` completes."""
        if time_s > self._last_s + GAP_S:
            self._reader.reset()
        self._last_s = time_s
        for packet in self._reader.feed(data):
            raw = frame(packet.servo_id, packet.instruction, packet.params).hex(" ")
            if not packet.intact:
                yield DecodedPacket(time_s, "noise", -1, "wrong checksum", {}, data.hex(" "))
            elif self._answers(packet, time_s):
                yield self._answer(time_s, packet, raw)
            else:
                yield self._question(time_s, packet, raw)

    def _answers(self, packet: Packet1, time_s: float) -> bool:
        asked = self._asked
        if asked is None or time_s > self._asked_s + REPLY_MAX_S:
            return False
        if asked.servo_id == BROADCAST_ID:
            pinged = asked.instruction == Instruction1.PING and packet.servo_id != BROADCAST_ID
            return pinged and not packet.params
        if asked.servo_id != packet.servo_id:
            return False
        read = asked.instruction == Instruction1.READ and len(asked.params) == 2
        return not packet.params or (read and len(packet.params) == asked.params[1])

    def _question(self, time_s: float, packet: Packet1, raw: str) -> DecodedPacket:
        self._asked = packet
        self._asked_s = time_s
        code = packet.instruction
        params = packet.params
        is_known = code in self.instructions.__members__.values()
        name = (
            self.instructions(code).name.lower().replace("_", " ") if is_known else f"0x{code:02X}"
        )
        values: dict[str, object] = {}
        if code == Instruction1.READ and len(params) == 2:
            values = dict.fromkeys(self._values(params[0], bytes(params[1])), "?")
        elif code in (Instruction1.WRITE, Instruction1.REG_WRITE) and len(params) > 1:
            values = self._values(params[0], params[1:])
        elif code == Instruction1.SYNC_WRITE and len(params) > 1:
            address = params[0]
            size = params[1]
            for start in range(2, len(params) - size, size + 1):
                part = self._values(address, params[start + 1 : start + 1 + size])
                values |= {f"{params[start]}: {key}": value for key, value in part.items()}
        return DecodedPacket(time_s, "question", packet.servo_id, name, values, raw)

    def _answer(self, time_s: float, packet: Packet1, raw: str) -> DecodedPacket:
        asked = self._asked
        values = {}
        if asked is not None and asked.servo_id != BROADCAST_ID:
            self._asked = None
            if packet.params:
                values = self._values(asked.params[0], packet.params)
        return self._reply(time_s, packet, values, raw)

    def _reply(
        self, time_s: float, packet: Packet1, values: dict[str, object], raw: str
    ) -> DecodedPacket:
        alarms = [
            str(alarm.name).lower().replace("_", " ")
            for alarm in self.errors
            if packet.instruction & alarm
        ]
        return DecodedPacket(
            time_s, "answer", packet.servo_id, ", ".join(alarms) or "ok", values, raw
        )

    def _decode(self, cell: RegisterRow, data: bytes) -> int:
        """Value of a register whose bytes begin ``data``; servos of another make override it."""
        return int.from_bytes(data[: cell.size], "little")

    def _values(self, address: int, data: bytes) -> dict[str, object]:
        end = address + len(data)
        texts: dict[str, object] = {
            name: self._decode(cell, data[cell.address - address :])
            for name, cell in self._registers.items()
            if address <= cell.address and cell.address + cell.size <= end
        }
        return texts or {f"{address}+{len(data)}": data.hex(" ")}
