"""A ``sim.line.wire`` with servos of Protocol 2.0 on it.

The regular control cycle on a simulated line: a group read without queues and parsers.

It gives the bytes of the wire, which handles all special cases (faults, taps, stuffing, two packets
under way).
"""

from collections.abc import Callable, Collection, Sequence
from typing import Protocol

import numpy as np

from snakewalk.config.arrays import Bytes, Indices, Int32s, SignedInts
from snakewalk.drivers.bus.group_read import GroupReadReply, GroupReadRequest
from snakewalk.drivers.bus.group_write import GroupWrite
from snakewalk.drivers.bus.line_reservation import LineReservation
from snakewalk.drivers.clock import Clock
from snakewalk.drivers.protocol.frames import IRREGULAR
from snakewalk.drivers.protocol.packet import (
    BITS_PER_BYTE,
    BROADCAST_ID,
    HEADER,
    Instruction,
    InstructionPacket,
)
from snakewalk.drivers.protocol.parser import PacketParser
from snakewalk.sim.imu import Imu
from snakewalk.sim.line.bus_contention import Reply
from snakewalk.sim.line.clock import SimClock
from snakewalk.sim.line.group_fast_path import GroupFastPath
from snakewalk.sim.line.id_directory import IdDirectory
from snakewalk.sim.line.instruction_handler import InstructionHandler
from snakewalk.sim.line.wire import Wire
from snakewalk.sim.plant import Mounting, Plant
from snakewalk.sim.servo.bank import ServoBank
from snakewalk.sim.servo.firmware import Firmware
from snakewalk.sim.servo.motor import MotorModel
from snakewalk.sim.servo.protection import SupplyAndAmbient


class ReadableLine(Protocol):
    """A line with begin and end of a group read; see ``sim.line.sim_line``."""

    @property
    def clock(self) -> Clock:
        """As of a ``BytePort``."""
        ...

    def begin(self, packet: bytes) -> bool:
        """Send a packet on an idle line."""
        ...

    def finish(self, request: GroupReadRequest, data: Bytes, error: Bytes, limit_s: float) -> int:
        """Receive the reply."""
        ...

    def getBaudRate(self) -> int:  # noqa: N802  the SDK's name
        """Method of ``SdkPort``."""
        ...


class LineFastPath:
    """``drivers.bus.fast_path.FastPath`` of a simulated line."""

    def __init__(
        self,
        wire: ReadableLine,
        goals: GroupWrite,
        request: GroupReadRequest,
        line: LineReservation,
        *,
        latency_s: float,
    ) -> None:
        self._wire = wire
        self._goals = goals
        self._request = request
        self._line = line
        self._latency_s = latency_s
        self._shape = len(request.ids), request.length
        self._error = np.zeros(len(request.ids), np.uint8)
        self._limit_s = 0.0

    @property
    def remaining_s(self) -> float:
        """Remaining time of the last request's reply."""
        return self._limit_s - self._wire.clock.now_s()

    def write(self, goals: Int32s) -> int:
        """Send goals (N,); return the number of bytes sent, 0 if the port must send them."""
        packet = self._goals.encode(goals)
        if not self._wire.begin(packet):
            return 0
        self._line.reserve(len(packet) * BITS_PER_BYTE / self._wire.getBaudRate())
        return len(packet)

    def begin(self, goals: Int32s | None) -> bool:
        """Send the request; False without sending after ``goals`` or on a busy line."""
        request = self._request
        wire = self._wire
        if goals is not None or not wire.begin(request.packet):
            return False
        byte_s = BITS_PER_BYTE / wire.getBaudRate()
        free_s = self._line.reserve(len(request.packet) * byte_s)
        self._limit_s = free_s + request.reply_bytes * byte_s + self._latency_s
        return True

    def finish(self) -> GroupReadReply | bytes:
        """Receive the reply to the request of ``begin``; empty if ``read_until`` must read it."""
        data = np.empty(self._shape, np.uint8)
        outcome = self._wire.finish(self._request, data, self._error, self._limit_s)
        return b"" if outcome == IRREGULAR else self._request.regular(outcome, data, self._error)


Tamper = Callable[[bytes], Sequence[bytes]]
"""Changes one reply on the wire: returns the packets that arrive instead, in order."""
_ID_AT, _CODE_AT = 4, 7
_CALLS = [Wire.write, Wire.read_until, Wire.clearPort]
"""Calls that a fast path replaces."""


class SimLine(Wire):
    """Servos of ``bank`` on the shafts of ``plant`` behind a serial line at the bank's baud rate.

    Reading and writing a closed port raise ``PortError``.
    """

    def __init__(
        self,
        bank: ServoBank,
        plant: Plant,
        clock: SimClock | None = None,
        *,
        supply_and_ambient: SupplyAndAmbient | None = None,
        mounting: Mounting | None = None,
        motors: Sequence[MotorModel] | None = None,
        usb_latency_s: float = 0.0,
        imu: Imu | None = None,
    ) -> None:
        super().__init__(clock if clock is not None else SimClock(plant.time_s), usb_latency_s)
        self.firmware = Firmware(bank, plant, supply_and_ambient, mounting, motors)
        self.bank = bank
        self.tamper: Tamper | None = None
        self._handler = InstructionHandler(self.firmware, bank.baud, imu)
        self._group = GroupFastPath(self._handler)
        self._reader = PacketParser()
        self._asked = b""
        self.setBaudRate(bank.baud)

    @property
    def directory(self) -> IdDirectory:
        """Servos by ID."""
        return self._handler.directory

    # for a fault file

    has_alert_bit = True

    @property
    def servos(self) -> Firmware:
        """The servos on the line, by row."""
        return self.firmware

    def ids(self) -> list[int]:
        """The ID of each row."""
        return [int(servo_id) for servo_id in self.bank["ID"]]

    def senders(self, reply: bytes) -> Collection[int]:
        """IDs of the servos that sent a reply: one, or all of a fast read."""
        if reply[_ID_AT] != BROADCAST_ID:
            return (reply[_ID_AT],)
        fast_bulk = self._asked[_CODE_AT] == Instruction.FAST_BULK_READ
        return self._asked[8:-2:5] if fast_bulk else self._asked[12:-2]

    def rename(self, row: int, servo_id: int) -> None:
        """Give a servo another ID."""
        self.bank["ID"][row] = servo_id

    def register_type(self, row: int, name: str) -> np.dtype[np.integer] | None:
        """Type of a register's numbers; None if a servo lacks it."""
        bank = self.bank
        return bank[name].dtype if name in bank and bank.has(row, name) else None

    def write_register(self, rows: Indices, name: str, value: int) -> None:
        """Set a register of servos, like another program."""
        self.bank[name][rows] = value

    def mute(self, rows: Indices, on: bool) -> None:
        """Suppress or restore the replies of servos; they still obey."""
        self.directory.mute[rows] = on

    def deafen(self, rows: Indices, on: bool) -> None:
        """Let servos ignore sync writes, or accept them again."""
        self.directory.deaf[rows] = on

    def set_alert(self, rows: Indices, on: bool) -> None:
        """Set or clear a false alert bit in the replies of servos."""
        self.bank.false_alert[rows] = on

    def refresh_ids(self) -> None:
        """Look the IDs up again after a change of IDs, power or muting."""
        self._handler.refresh_ids()

    def shown(self, register: str) -> SignedInts:
        """(S,) values of a register as a read would return them; a copy."""
        self.firmware.refresh()
        return self.bank[register].copy()

    # for a control cycle

    @property
    def is_plain(self) -> bool:
        """As in ``Wire``, and ``tamper`` is not set."""
        return self.tamper is None and super().is_plain

    def fast_path(
        self,
        goals: GroupWrite,
        request: GroupReadRequest,
        line: LineReservation,
        *,
        latency_s: float,
    ) -> LineFastPath | None:
        """``drivers.bus.fast_path.FastPathPort``; None if a test has replaced the port's calls."""
        calls = self.write, self.read_until, self.clearPort
        if [getattr(call, "__func__", None) for call in calls] != _CALLS:
            return None
        return LineFastPath(self, goals, request, line, latency_s=latency_s)

    def finish(self, request: GroupReadRequest, data: Bytes, error: Bytes, limit_s: float) -> int:
        """Receive the reply to the request of ``begin``; the clock moves to its end.

        Fills ``data`` (N, length) and ``error`` (N,), unless the reply is irregular. Waits until
        ``limit_s``.

        Returns:
            Result of ``drivers.protocol.frames``; ``IRREGULAR`` if ``read_until`` must read the
            bytes.

        """
        sent = self._sent
        read = self._group.read_of(request.packet)
        if len(sent) != 1 or sent[0][1] is not request.packet or read is None or not self.is_plain:
            return IRREGULAR
        end_s = sent[0][0]
        wire_s = request.reply_bytes * self._byte_s
        due_s = end_s + read.delay_s + self.usb_latency_s + wire_s
        if due_s > limit_s:
            return IRREGULAR
        sent.popleft()
        self._arrive(end_s, len(request.packet))
        outcome = IRREGULAR
        if self._group.read_of(request.packet) is read:  # the servos have not changed
            self._group.measure(read, end_s)
            outcome = read.decoded(self.bank.table, request, data, error)
        if outcome == IRREGULAR:
            self._send_replies(end_s, self._execute(request.packet, end_s))
            return IRREGULAR
        self.busy_s += wire_s
        self._quiet_s = due_s - self.usb_latency_s
        self.clock.sleep_until_s(due_s)
        return outcome

    # the wire

    def _advance(self, until_s: float) -> None:
        self.firmware.advance(until_s)

    def _reset_parser(self) -> None:
        self._reader.reset()

    def _on_baud_change(self, baud: int) -> None:
        self._handler.baud = baud
        self._handler.refresh_ids()

    def _execute(self, data: bytes, end_s: float) -> list[Reply]:
        self._asked = data
        if self._script is None:
            bytewise = self.tamper is not None or bool(self.taps)
            quick = self._group.execute(data, end_s, gapless=not bytewise)
            return self._replies_one_by_one(data, end_s) if quick is None else quick
        replies: list[Reply] = []
        for piece in self._instruction_with_faults(data, end_s):
            quick = self._group.execute(piece, end_s, gapless=False)
            replies += self._replies_one_by_one(piece, end_s) if quick is None else quick
        return replies

    def _replies_one_by_one(self, data: bytes, end_s: float) -> list[Reply]:
        return [
            reply
            for packet in self._reader.feed(data)
            if isinstance(packet, InstructionPacket)
            for reply in self._handler.execute(packet, end_s)
        ]

    def _reply_with_faults(self, data: bytes, now_s: float) -> Sequence[tuple[float, bytes]]:
        if self.tamper is not None:
            return [(0.0, packet) for packet in self.tamper(data)]
        return ((0.0, data),) if self._script is None else super()._reply_with_faults(data, now_s)

    def _split(self, data: bytes) -> Sequence[bytes]:
        if len(data) >= 7 and data[5] | data[6] << 8 == len(data) - 7:
            return (data,)
        frames = []
        start = 0
        while data.startswith(HEADER, start) and start + 7 <= len(data):
            end = start + 7 + int.from_bytes(data[start + 5 : start + 7], "little")
            if end >= len(data):
                break
            frames.append(data[start:end])
            start = end
        frames.append(data[start:])
        return frames
