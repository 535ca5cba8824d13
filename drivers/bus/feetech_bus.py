"""The bus of Feetech servos: ``DynamixelBus`` with Feetech's packets.

The bus converts byte order, signs and alarms to the table's values. A servo loses EEPROM registers
at power-off that were written while Lock was 1; ``write_kept`` unlocks for one write.
"""

from collections.abc import Iterable, Mapping, Sequence

import numpy as np

from snakewalk.config.servo_model import ServoModel
from snakewalk.drivers.bus.control_cycle import ControlCycle
from snakewalk.drivers.bus.dynamixel_bus import DynamixelBus, PingReply
from snakewalk.drivers.bus.feetech_cycle import (
    Convert,
    FeetechCycle,
    FeetechSingleReads,
    FeetechWrite,
    state_convert,
    supply_convert,
)
from snakewalk.drivers.errors import BusError, ControlTableError, NoAnswerError
from snakewalk.drivers.port.byte_port import BytePort
from snakewalk.drivers.protocol.control_table import Model, Register
from snakewalk.drivers.protocol.feetech import (
    MAX_ID,
    STATUS_BYTES,
    BlockFormat,
    FeetechInstruction,
    FeetechParser,
    encode_word,
)
from snakewalk.drivers.protocol.packet import ALERT, BITS_PER_BYTE, StatusPacket
from snakewalk.drivers.protocol.protocol1 import frame
from snakewalk.drivers.protocol.registers import bauds_of

_REPLY_S = 0.005
"""Time for servo and adapter besides the wire and ``latency_s`` (ours); the longest return delay is
0.508 ms."""


class FeetechBus(DynamixelBus):
    """Feetech servos of one byte order on one byte port."""

    differing = "Present Position", "Present Temperature"
    _parser = FeetechParser
    _status_bytes = STATUS_BYTES
    _ping_bytes = 0
    _settle_s = _REPLY_S

    def __init__(
        self,
        port: BytePort,
        model: Model | Mapping[int, Model] = "STS3215",
        *,
        latency_s: float = 0.004,
        tries: int = 3,
    ) -> None:
        """Prepare; nothing is sent.

        Raises:
            ControlTableError: a model is unknown, or not from Feetech.

        """
        super().__init__(port, model, latency_s=latency_s, tries=tries)
        for table in (self.table, *self._tables.values()):
            if not table.facts.is_feetech:
                raise ControlTableError(
                    f"{table.model}: does not speak Feetech's protocol; on one port all servos "
                    "speak one protocol"
                )

    def ping(self, servo_id: int) -> PingReply:
        """Ping one servo and read its model number.

        Raises:
            NoAnswerError: no reply.

        """
        status = self._retry(lambda: self._exchange(servo_id, FeetechInstruction.PING, b"", 0))
        number = self.read(servo_id, "Model Number")
        return PingReply(servo_id, number, None, bool(status.error & ALERT))

    def answering(self) -> list[int]:
        """IDs that reply to one ping at the port's baud rate; lasts 3 seconds."""
        answering_ids = []
        for servo_id in range(MAX_ID + 1):
            try:
                self._exchange(servo_id, FeetechInstruction.PING, b"", 0)
            except NoAnswerError:
                continue
            answering_ids.append(servo_id)
        return answering_ids

    def scan(self) -> dict[int, PingReply]:
        """All servos at the port's baud rate."""
        return self.find(self.answering())

    def read_bytes(self, servo_id: int, register: Register) -> bytes:
        """Bytes of a register as on the wire.

        Raises:
            NoAnswerError: no reply.

        """
        span = bytes((register.address, register.size))
        return self._retry(
            lambda: self._exchange(servo_id, FeetechInstruction.READ, span, register.size)
        ).params

    def _probe_packet(self, servo_id: int, span: tuple[int, int] | None) -> bytes:
        if span is None:
            return frame(servo_id, FeetechInstruction.PING)
        return frame(servo_id, FeetechInstruction.READ, bytes(span))

    def write(self, servo_id: int, name: str, value: int, tries: int | None = None) -> None:
        """Write a register; an EEPROM register lasts until power-off while Lock is 1.

        Raises:
            ControlTableError: no such register, or the value does not fit.
            NoAnswerError: no reply.

        """
        table = self.table_of(servo_id)
        row = table.facts.registers[table.register(name).name]
        params = bytes((row.address,)) + encode_word(value, row, table.facts, name)
        self._retry(lambda: self._exchange(servo_id, FeetechInstruction.WRITE, params, 0), tries)

    def write_kept(self, servo_id: int, name: str, value: int) -> None:
        """Write an EEPROM register so that it persists: unlock, write, lock.

        The port follows a new baud rate.

        Raises:
            ControlTableError: no such register, or the value does not fit.
            BusError: the servo does not reply.

        """
        self.write(servo_id, "Lock", 0)
        self.write(servo_id, name, value)
        if name == "Baud Rate":
            self.port.setBaudRate(bauds_of(self.table_of(servo_id).facts)[value])
        if name == "ID" and value != servo_id:
            self._tables[value] = self.table_of(servo_id)
            servo_id = value
        self.write(servo_id, "Lock", 1)

    def sync_write(self, servo_ids: Sequence[int], name: str, value: int) -> None:
        """Write one value to all servos, without confirmation.

        Raises:
            ControlTableError: no such register, or the value does not fit.

        """
        self._shared_register(servo_ids, name)
        if servo_ids:
            facts = self.table_of(servo_ids[0]).facts
            packet = FeetechWrite(servo_ids, name, facts)
            self._send(packet.encode(np.full(len(servo_ids), value, np.int32)))

    def reboot(self, servo_id: int) -> None:
        """Restart a servo: it loses torque, RAM, and values written under Lock."""
        self._retry(lambda: self._exchange(servo_id, FeetechInstruction.RESTART, b"", 0))

    def cycle(self, servo_ids: Sequence[int], *, fast: bool = True) -> ControlCycle:
        """Control cycle: writes Goal Position, reads the state in the layout of Protocol 2.0."""
        del fast
        table = self._facts_of(servo_ids)
        return self._cycle(servo_ids, *state_convert(table, self.table.state_names[0]))

    def slow_cycle(self, servo_ids: Sequence[int], *, fast: bool = True) -> ControlCycle:
        """Group read of voltage and temperature, in the layout of Protocol 2.0."""
        del fast
        return self._cycle(servo_ids, *supply_convert(self._facts_of(servo_ids)))

    def block(
        self, servo_ids: Sequence[int], first: str, last: str, *, fast: bool = True
    ) -> ControlCycle:
        """Group read of the registers from ``first`` to ``last``, converted.

        Raises:
            ControlTableError: the model lacks a register.

        """
        del fast
        start, end = self._shared_register(servo_ids, first), self._shared_register(servo_ids, last)
        length = end.address + end.size - start.address
        facts = self._facts_of(servo_ids)
        convert = BlockFormat(facts, start.address, length).convert
        return self._cycle(servo_ids, (start.address, length), convert)

    def device_block(self, device_id: int, address: int, length: int) -> ControlCycle:
        """Raise an error: this bus has no devices of Protocol 2.0.

        Raises:
            ControlTableError: always.

        """
        raise ControlTableError(
            f"device {device_id}: an IMU of Protocol 2.0 cannot be on a bus of Feetech servos; "
            "connect it to a port of its own"
        )

    def _cycle(self, ids: Sequence[int], span: tuple[int, int], convert: Convert) -> ControlCycle:
        facts = self._facts_of(ids)
        kind = FeetechCycle if facts.sync_read or len(ids) == 1 else FeetechSingleReads
        return kind(
            self.port,
            ids,
            facts,
            span,
            convert,
            latency_s=self.latency_s,
            pending=self._pending,
            line=self._line,
        )

    def _facts_of(self, servo_ids: Iterable[int]) -> ServoModel:
        """Model of some servos, which must have the same byte order and group reads."""
        facts = [self.table_of(servo_id).facts for servo_id in servo_ids]
        if len({(fact.byte_order, fact.sync_read) for fact in facts}) > 1:
            names = ", ".join(dict.fromkeys(fact.model for fact in facts))
            raise ControlTableError(f"{names}: their words differ; use one series on a port")
        return facts[0] if facts else self.table.facts

    def _read(self, servo_id: int, register: Register) -> bytes:
        facts = self.table_of(servo_id).facts
        raw = np.frombuffer(self.read_bytes(servo_id, register), np.uint8)[None]
        return BlockFormat(facts, register.address, register.size).convert(raw).tobytes()

    def _send(self, packet: bytes) -> float:
        free_s = self._line.reserve(len(packet) * BITS_PER_BYTE / self.port.getBaudRate())
        self.port.write(packet)
        return free_s

    def _exchange(self, servo_id: int, code: int, params: bytes, length: int) -> StatusPacket:
        """Reply of ``length`` bytes of one servo to one instruction.

        Raises:
            NoAnswerError: no reply.
            BusError: a reply has another length.

        """
        port = self.port
        packet = frame(servo_id, code, params)
        wire_s = (STATUS_BYTES + length) * BITS_PER_BYTE / port.getBaudRate()
        port.clearPort()
        deadline_s = self._send(packet) + wire_s + _REPLY_S + self.latency_s
        reader = FeetechParser()
        missing = STATUS_BYTES + length
        other = None
        while data := port.read_until(missing, deadline_s):
            for status in reader.feed(data):
                if status.servo_id != servo_id:
                    continue
                if len(status.params) == length:
                    return status
                other = len(status.params)
            missing = max(1, STATUS_BYTES + length - reader.pending)
        what = FeetechInstruction(code).name.lower().replace("_", " ")
        baud_text = f"at {port.getBaudRate()} baud"
        if other is not None and not self._pending.is_pending(servo_id, other, fast=False):
            raise BusError(f"servo {servo_id}: {what}: {other} bytes came, not {length}")
        reason = f"no answer {baud_text}"
        if reader.dropped_bytes or reader.pending:
            reason = f"damaged bytes {baud_text}: noise on the line, or two servos with this ID"
        raise NoAnswerError(f"servo {servo_id}: {what}: {reason}")


def servo_bus(
    port: BytePort,
    model: Model | Mapping[int, Model],
    *,
    latency_s: float = 0.004,
    tries: int = 3,
) -> DynamixelBus:
    """Bus of a port for the protocol of its servos; arguments as ``DynamixelBus``.

    Raises:
        ControlTableError: a model is unknown, or the port has servos of two protocols.

    """
    bus = DynamixelBus(port, model, latency_s=latency_s, tries=tries)
    if bus.table.facts.is_feetech:
        return FeetechBus(port, model, latency_s=latency_s, tries=tries)
    return bus
