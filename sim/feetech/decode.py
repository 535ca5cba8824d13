"""Decoder of Feetech's protocol into words, packet by packet, with the registers of one model."""

from collections.abc import Mapping
from enum import IntEnum, IntFlag
from typing import ClassVar

from snakewalk.config.servo_model import RegisterRow, ServoModel
from snakewalk.drivers.protocol.control_table import Model
from snakewalk.drivers.protocol.feetech import FeetechAlarm, FeetechInstruction, decode_word
from snakewalk.drivers.protocol.protocol1 import Packet1
from snakewalk.sim.ax12.decode import REPLY_MAX_S, Decoder1
from snakewalk.sim.sniff.decode import DecodedPacket, Decoder

AnyDecoder = Decoder | Decoder1
_SPAN_BYTES = 2
"""Address and length at the start of a sync instruction."""


class FeetechDecoder(Decoder1):
    """Bytes of a bus in, lines out; all servos have the registers of one model."""

    instructions: ClassVar[type[IntEnum]] = FeetechInstruction
    errors: ClassVar[type[IntEnum] | type[IntFlag]] = FeetechAlarm

    def __init__(self, facts: ServoModel) -> None:
        super().__init__(facts)
        self._facts = facts
        self._turns: list[int] = []
        """IDs that a sync read asked and that have not replied."""

    def _answers(self, packet: Packet1, time_s: float) -> bool:
        asked = self._asked
        if asked is None or asked.instruction != FeetechInstruction.SYNC_READ:
            return super()._answers(packet, time_s)
        return (
            time_s <= self._asked_s + REPLY_MAX_S
            and packet.servo_id in self._turns
            and len(packet.params) == asked.params[1]
        )

    def _question(self, time_s: float, packet: Packet1, raw: str) -> DecodedPacket:
        line = super()._question(time_s, packet, raw)
        self._turns = []
        if packet.instruction != FeetechInstruction.SYNC_READ or len(packet.params) <= _SPAN_BYTES:
            return line
        address, length = packet.params[:_SPAN_BYTES]
        self._turns = list(packet.params[_SPAN_BYTES:])
        names = ", ".join(self._values(address, bytes(length)))
        values: dict[str, object] = {str(turn): names for turn in self._turns}
        return DecodedPacket(time_s, line.kind, line.servo_id, line.name, values, raw)

    def _answer(self, time_s: float, packet: Packet1, raw: str) -> DecodedPacket:
        asked = self._asked
        if asked is None or asked.instruction != FeetechInstruction.SYNC_READ:
            return super()._answer(time_s, packet, raw)
        self._turns.remove(packet.servo_id)
        return self._reply(time_s, packet, self._values(asked.params[0], packet.params), raw)

    def _decode(self, cell: RegisterRow, data: bytes) -> int:
        return decode_word(data, cell, self._facts)


def decoder_for(facts: ServoModel, models: Mapping[int, Model] | None = None) -> AnyDecoder:
    """Return the decoder of the protocol that a model speaks.

    ``models`` are those of the servos of Protocol 2.0, by ID.
    """
    if facts.is_feetech:
        return FeetechDecoder(facts)
    return Decoder1(facts) if facts.protocol == 1 else Decoder(facts, models)
