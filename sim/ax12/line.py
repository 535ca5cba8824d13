"""Servos of Protocol 1.0 on the wire."""

from collections.abc import Collection, Sequence
from itertools import groupby

import numpy as np
from numpy.typing import NDArray

from snakewalk.config.arrays import Indices
from snakewalk.drivers.protocol.packet import BITS_PER_BYTE
from snakewalk.drivers.protocol.protocol1 import (
    BROADCAST_ID,
    HEADER,
    Error1,
    Instruction1,
    Packet1,
    Reader1,
    frame,
)
from snakewalk.drivers.protocol.registers import RETURN_DELAY_UNIT_S
from snakewalk.sim.ax12.ax12 import Ax12Servos
from snakewalk.sim.line.bus_contention import Reply, bus_contention
from snakewalk.sim.line.clock import SimClock
from snakewalk.sim.line.wire import Wire

BAUD_CLOCK = 2_000_000
"""Baud Rate(4): 2 000 000 / (value + 1), e-manual."""
BAUD_TOLERANCE = 0.03
"""A servo still receives at a rate that is off by 3 % (e-manual)."""
REPLY_LEVELS: dict[int, int] = {Instruction1.PING: 0, Instruction1.READ: 1}
"""Least Status Return Level(16) at which servos reply to an instruction; 2 for all others."""
_ID_AT = 2


class Ax12Line(Wire):
    """``servos`` behind a serial line of ``baud``."""

    def __init__(
        self,
        servos: Ax12Servos,
        clock: SimClock | None = None,
        baud: int = 1_000_000,
    ) -> None:
        super().__init__(clock if clock is not None else SimClock(servos.plant.time_s))
        self.servos = servos
        self._reader = Reader1()
        self._muted, self._deaf = np.zeros((2, len(servos)), bool)
        self.setBaudRate(baud)

    # for a fault file

    has_alert_bit = False

    def ids(self) -> list[int]:
        """The ID of each row."""
        return [int(servo_id) for servo_id in self.servos["ID"]]

    def senders(self, reply: bytes) -> Collection[int]:
        """ID of the servo that sent a reply."""
        return (reply[_ID_AT],)

    def rename(self, row: int, servo_id: int) -> None:
        """Give a servo another ID."""
        self.servos["ID"][row] = servo_id

    def register_type(self, row: int, name: str) -> np.dtype[np.integer] | None:
        """Type of a register's numbers; None if a servo lacks it."""
        try:
            return self.servos[name].dtype
        except KeyError:
            return None

    def write_register(self, rows: Indices, name: str, value: int) -> None:
        """Set a register of servos, like another program."""
        self.servos[name][rows] = value

    def mute(self, rows: Indices, on: bool) -> None:
        """Suppress or restore the replies of servos; they still obey."""
        self._muted[rows] = on

    def deafen(self, rows: Indices, on: bool) -> None:
        """Let servos ignore sync writes, or accept them again."""
        self._deaf[rows] = on

    def set_alert(self, rows: Indices, on: bool) -> None:
        """Do nothing: replies of Protocol 1.0 have no alert bit."""

    def refresh_ids(self) -> None:
        """Do nothing: every packet looks the IDs up."""

    def shown(self, register: str) -> NDArray[np.unsignedinteger]:
        """(S,) values of a register as a read would return them; a copy."""
        self.servos.refresh()
        return self.servos[register].copy()

    # the wire

    def _advance(self, until_s: float) -> None:
        self.servos.advance(until_s)

    def _reset_parser(self) -> None:
        self._reader.reset()

    def _on_baud_change(self, baud: int) -> None:
        del baud  # every packet looks it up

    def _split(self, data: bytes) -> Sequence[bytes]:
        frames = []
        start = 0
        while data.startswith(HEADER, start) and start + 4 <= len(data):
            end = start + 4 + data[start + 3]
            if end >= len(data):
                break
            frames.append(data[start:end])
            start = end
        return [*frames, data[start:]]

    def _execute(self, data: bytes, end_s: float) -> list[Reply]:
        return [
            answer
            for piece in self._instruction_with_faults(data, end_s)
            for packet in self._reader.feed(piece)
            for answer in self._execute_packet(packet)
        ]

    def _addressed_rows(self, servo_id: int) -> list[int]:
        servos = self.servos
        rate = self.getBaudRate()
        return [
            row
            for row in range(len(servos))
            if servos.powered[row]
            and servo_id in (BROADCAST_ID, servos["ID"][row])
            and abs(BAUD_CLOCK / (int(servos["Baud Rate"][row]) + 1) / rate - 1.0) <= BAUD_TOLERANCE
        ]

    def _execute_packet(self, packet: Packet1) -> list[Reply]:
        code = packet.instruction
        params = packet.params
        if code == Instruction1.SYNC_WRITE:
            return self._sync_write(packet)
        replies = []
        for row in self._addressed_rows(packet.servo_id):
            servo_id = int(self.servos["ID"][row])
            delay_s = self._delay_s(row)
            replies_to = self._replies_to(row, code)
            error = Error1.CHECKSUM.value
            data = b""
            if packet.intact:
                error, data = self._execute_one(row, code, params)
            if packet.servo_id == BROADCAST_ID and code != Instruction1.PING:
                continue
            if replies_to and not self._muted[row]:
                shown = error | int(self.servos.protection.shown[row])
                replies.append((servo_id, Reply(delay_s, frame(servo_id, shown, data))))
        replies.sort(key=lambda reply: reply[0])  # IDs reply in turn to a broadcast ping
        return [
            self._respond([reply for _, reply in group])
            for _, group in groupby(replies, lambda reply: reply[0])
        ]

    def _delay_s(self, row: int) -> float:
        return int(self.servos["Return Delay Time"][row]) * RETURN_DELAY_UNIT_S

    def _replies_to(self, row: int, code: int) -> bool:
        """Whether a servo's settings let it reply to an instruction."""
        return int(self.servos["Status Return Level"][row]) >= REPLY_LEVELS.get(code, 2)

    def _obeying(self, servo_id: int) -> list[int]:
        return self._addressed_rows(servo_id)

    def _respond(self, replies: list[Reply]) -> Reply:
        """Bytes on the wire of servos with one ID."""
        reply, garbled = bus_contention(replies, BITS_PER_BYTE / self.getBaudRate())
        self.collisions += garbled
        return reply

    def _execute_one(self, row: int, code: int, params: bytes) -> tuple[int, bytes]:
        servos = self.servos
        if code == Instruction1.PING and not params:
            return 0, b""
        if code == Instruction1.READ and len(params) == 2:
            address, length = params
            if not 0 < length <= servos.table.shape[1] - address:
                return Error1.RANGE, b""
            servos.refresh()
            return 0, servos.table[row, address : address + length].tobytes()
        if code == Instruction1.WRITE and len(params) >= 2:
            return servos.write(row, params[0], params[1:]), b""
        if code == Instruction1.REG_WRITE and len(params) >= 2:
            return servos.register_write(row, params[0], params[1:]), b""
        if code == Instruction1.ACTION and not params:
            return servos.action(row), b""
        if code == Instruction1.FACTORY_RESET and not params:
            servos.reset(row)
            return 0, b""
        return Error1.INSTRUCTION, b""

    def _sync_write(self, packet: Packet1) -> list[Reply]:
        params = packet.params
        if packet.intact and packet.servo_id == BROADCAST_ID and len(params) >= 2:
            address = params[0]
            size = params[1]
            for start in range(2, len(params) - size, size + 1):
                for row in self._obeying(params[start]):
                    if self._deaf[row]:
                        continue
                    self.servos.write(row, address, params[start + 1 : start + 1 + size])
        return []
