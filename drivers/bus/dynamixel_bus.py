"""The DYNAMIXEL bus: pings, registers, reboots, and the group codecs of a chain.

dynamixel-sdk pings and reboots. To avoid its defects (docs/reference/sdk-defects.md),
``register_io`` reads and writes registers, ``probe`` pings all servos, and an exception in a port
leaves the port free.
"""

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import TypeVar

import dynamixel_sdk as sdk

from snakewalk.drivers.bus.budget import STATUS_BYTES
from snakewalk.drivers.bus.control_cycle import ControlCycle
from snakewalk.drivers.bus.line_reservation import LineReservation
from snakewalk.drivers.bus.pending_replies import PendingReplies
from snakewalk.drivers.bus.probe import SETTLE_S, Probe, broadcast_ping, probe_with
from snakewalk.drivers.bus.register_io import check_accepted, read_register, write_register
from snakewalk.drivers.errors import BusError, ControlTableError, NoAnswerError, ServoError
from snakewalk.drivers.port.byte_port import BytePort, reopen
from snakewalk.drivers.protocol.control_table import (
    ControlTable,
    Model,
    Register,
    load_control_table,
)
from snakewalk.drivers.protocol.feetech import FeetechParser
from snakewalk.drivers.protocol.packet import (
    ALERT,
    BITS_PER_BYTE,
    BROADCAST_ID,
    Instruction,
    InstructionPacket,
    encode_instruction,
)
from snakewalk.drivers.protocol.parser import PacketParser

T = TypeVar("T")
PROBES = 5
_PING_BYTES = 3
"""Bytes of a reply to a ping with data: model number and firmware."""
_GAP_BYTES = 64
"""Largest number of bytes between two registers that are read as one block (ours): at 1 Mbaud they
need less time than a separate packet."""


@dataclass(frozen=True, slots=True)
class PingReply:
    """Reply of one servo to a ping."""

    servo_id: int
    model_number: int
    firmware: int | None
    """Version of the firmware; None if the SDK does not return it."""
    alert: bool
    """Whether the servo reports a hardware error (register 70)."""


class DynamixelBus:
    """Servos on one byte port."""

    differing = "Realtime Tick", "Present Temperature"
    """Block of registers in which two servos with one ID differ, so that their replies collide.
    Their replies to a ping may be equal."""
    _parser: type[PacketParser | FeetechParser] = PacketParser
    _status_bytes = STATUS_BYTES
    _ping_bytes = _PING_BYTES
    _settle_s = SETTLE_S

    def __init__(
        self,
        port: BytePort,
        model: Model | Mapping[int, Model] = "XM430-W350",
        *,
        latency_s: float = 0.004,
        tries: int = 3,
    ) -> None:
        """Prepare; nothing is sent.

        Args:
            port: the line.
            model: of all servos, or by ID; unlisted servos have the first. A name, a file or a
                record.
            latency_s: largest delay of adapter and driver.
            tries: largest number of attempts of a transaction.

        Raises:
            ControlTableError: a model is unknown.

        """
        self.port = port
        models = dict(model) if isinstance(model, Mapping) else {}
        self._tables = {servo_id: load_control_table(name) for servo_id, name in models.items()}
        first = next(iter(models.values())) if isinstance(model, Mapping) else model
        self.table: ControlTable = load_control_table(first)
        """Control table of the model, or of the first one."""
        self.latency_s = latency_s
        """Longest time for which adapter and driver hold bytes back (FTDI: its latency timer)."""
        self._tries = max(1, tries)
        self._pending = PendingReplies(port.clock)
        self._line = LineReservation(port.clock, paced=port.paced)
        self._sdk = sdk.PacketHandler(2.0)

    @property
    def parts(self) -> "tuple[DynamixelBus, ...]":
        """The bus itself; a ``SegmentedBus`` has one per port."""
        return (self,)

    def part_of(self, servo_id: int) -> "DynamixelBus":
        """The bus itself."""
        return self

    def port_of(self, servo_id: int) -> BytePort:
        """Port of a servo or another device."""
        return self.port

    def reopen(self) -> None:
        """Close and open the port.

        Raises:
            PortError: it is missing.

        """
        reopen(self.port)

    def ping(self, servo_id: int) -> PingReply:
        """Ping one servo.

        Raises:
            NoAnswerError: no reply.

        """

        def transaction() -> PingReply:
            number, result, error = self._sdk.ping(self.port, servo_id)
            if result != sdk.COMM_SUCCESS:
                self._pending.add([servo_id], _PING_BYTES, fast=False)
            self._check_result(result, servo_id, "ping")
            return PingReply(servo_id, number, None, bool(error & ALERT))

        return self._retry(transaction)

    def find(self, servo_ids: Iterable[int]) -> dict[int, PingReply]:
        """Ping each servo; return those that replied."""
        replies = {}
        for servo_id in servo_ids:
            try:
                replies[servo_id] = self.ping(servo_id)
            except NoAnswerError:
                continue
        return replies

    def scan(self) -> dict[int, PingReply]:
        """All servos at the port's baud rate, by a broadcast ping of almost a second."""
        return {
            reply.servo_id: PingReply(
                reply.servo_id,
                int.from_bytes(reply.params[:2], "little"),
                reply.params[2],
                bool(reply.error & ALERT),
            )
            for reply in broadcast_ping(self.port).replies
        }

    def probe(self, servo_id: int, block: tuple[str, str] | None = None) -> Probe:
        """Ping 5 times until quiet, or read from the first to the last register of a block.

        Unlike a ping, it finds two servos with one ID.

        Raises:
            PortError: the port is gone.

        """
        span, length = None, self._ping_bytes
        if block is not None:
            first, last = (self.table_of(servo_id)[name] for name in block)
            length = last.address + last.size - first.address
            span = first.address, length
        packet = self._probe_packet(servo_id, span)
        wait_s = self._settle_s + self.latency_s
        reply_bytes = self._status_bytes + length
        return probe_with(self.port, servo_id, PROBES, packet, reply_bytes, wait_s, self._parser)

    def _probe_packet(self, servo_id: int, span: tuple[int, int] | None) -> bytes:
        """Read of ``span`` (address, length), or ping."""
        kind = Instruction.PING if span is None else Instruction.READ
        params = b"".join(number.to_bytes(2, "little") for number in span or ())
        return encode_instruction(InstructionPacket(servo_id, kind, params))

    def read(self, servo_id: int, name: str) -> int:
        """Value of a register.

        Raises:
            ControlTableError: no such register.
            NoAnswerError: no reply.
            ServoError: the servo refused.

        """
        register = self.table_of(servo_id).register(name)
        return register.decode(self._read(servo_id, register))

    def read_each(
        self, servo_id: int, names: Iterable[str], optional: Iterable[str] = ()
    ) -> dict[str, int]:
        """Values of many registers, one request per block.

        A servo that refuses a block is asked register by register. ``optional`` registers, which a
        firmware may lack, are missing from the result, or 0.

        Raises:
            ControlTableError: no such register.
            NoAnswerError: no reply.
            ServoError: the servo refused.

        """
        table = self.table_of(servo_id)
        may_lack = set(optional)
        values: dict[str, int] = {}
        for block in _blocks(map(table.register, names)):
            first, last = block[0], block[-1]
            span = Register(
                first.name if first is last else f"{first.name} to {last.name}",
                first.address,
                last.address + last.size - first.address,
                signed=False,
            )
            try:
                data = self._read(servo_id, span)
            except ServoError:
                for register in block:
                    try:
                        values[register.name] = register.decode(self._read(servo_id, register))
                    except ServoError:
                        if register.name not in may_lack:
                            raise
                continue
            for register in block:
                values[register.name] = register.decode(data[register.address - first.address :])
        return values

    def _read(self, servo_id: int, register: Register) -> bytes:
        return self._retry(
            lambda: read_register(
                self.port, servo_id, register, self.latency_s, self._pending, self._line
            )
        )

    def write(self, servo_id: int, name: str, value: int, tries: int | None = None) -> None:
        """Write a register; ``tries`` None: as other transactions.

        Raises:
            ControlTableError: no such register, or the value does not fit.
            NoAnswerError: no reply.
            ServoError: the servo refused.

        """
        register = self.table_of(servo_id).register(name)
        data = register.encode(value)
        self._retry(
            lambda: write_register(
                self.port, servo_id, register, data, self.latency_s, self._pending, self._line
            ),
            tries,
        )

    def sync_write(self, servo_ids: Sequence[int], name: str, value: int) -> None:
        """Write one value to all servos, without confirmation.

        Raises:
            ControlTableError: no such register, or the value does not fit.

        """
        register = self._shared_register(servo_ids, name)
        data = register.encode(value)
        params = register.address.to_bytes(2, "little") + register.size.to_bytes(2, "little")
        params += b"".join(bytes([servo_id]) + data for servo_id in servo_ids)
        raw = encode_instruction(InstructionPacket(BROADCAST_ID, Instruction.SYNC_WRITE, params))
        self._line.reserve(len(raw) * BITS_PER_BYTE / self.port.getBaudRate())
        self.port.write(raw)

    def write_kept(self, servo_id: int, name: str, value: int) -> None:
        """Write an EEPROM register so that it persists; raises as ``write``."""
        self.write(servo_id, name, value)

    def write_verified(self, servo_id: int, name: str, value: int, *, kept: bool = False) -> None:
        """Write a register if it differs, and read it back: EEPROM wears out, and writes get lost.

        ``kept`` uses ``write_kept``.

        Raises:
            BusError: the value read back differs.

        """
        if self.read(servo_id, name) == value:
            return
        (self.write_kept if kept else self.write)(servo_id, name, value)
        stored_value = self.read(servo_id, name)
        if stored_value != value:
            raise BusError(f"servo {servo_id}: {name}: wrote {value}, reads back {stored_value}")

    def reboot(self, servo_id: int) -> None:
        """Restart a servo: it loses hardware errors, torque and turn count."""

        def transaction() -> None:
            result, error = self._sdk.reboot(self.port, servo_id)
            self._check_result(result, servo_id, "reboot")
            check_accepted(servo_id, "reboot", error)

        self._retry(transaction)

    def cycle(self, servo_ids: Sequence[int], *, fast: bool = True) -> ControlCycle:
        """Control cycle of these servos: writes Goal Position, reads the state block.

        Raises:
            ControlTableError: the model lacks a register.

        """
        first, *_, last = self.table.state_names
        return self.block(servo_ids, first, last, fast=fast)

    def slow_cycle(self, servo_ids: Sequence[int], *, fast: bool = True) -> ControlCycle:
        """Group read of the slow state block: voltage and temperature.

        Raises:
            ControlTableError: the model lacks a register.

        """
        return self.block(servo_ids, "Present Input Voltage", "Present Temperature", fast=fast)

    def block(
        self, servo_ids: Sequence[int], first: str, last: str, *, fast: bool = True
    ) -> ControlCycle:
        """Group read of the registers from ``first`` to ``last``, inclusive.

        Raises:
            ControlTableError: the model lacks a register.

        """
        end = self._shared_register(servo_ids, last)
        start, end_address = self._shared_register(servo_ids, first).address, end.address + end.size
        return ControlCycle(
            self.port,
            servo_ids,
            registers=(
                self._shared_register(servo_ids, "Goal Position").address,
                start,
                end_address - start,
            ),
            fast=fast,
            latency_s=self.latency_s,
            pending=self._pending,
            line=self._line,
        )

    def device_block(self, device_id: int, address: int, length: int) -> ControlCycle:
        """Group read of a device that is not a servo."""
        return ControlCycle(
            self.port,
            (device_id,),
            registers=(0, address, length),
            fast=False,
            latency_s=self.latency_s,
            pending=self._pending,
            line=self._line,
        )

    def table_of(self, servo_id: int) -> ControlTable:
        """Control table of a servo's model."""
        return self._tables.get(servo_id, self.table)

    def _shared_register(self, servo_ids: Sequence[int], name: str) -> Register:
        """A register that all servos of a group have at one address.

        Raises:
            ControlTableError: a model lacks it, or has it at another address.

        """
        tables = {self.table_of(servo_id).model: servo_id for servo_id in servo_ids}
        registers = {m: self.table_of(i).register(name) for m, i in tables.items()}
        if len(set(registers.values())) > 1:
            places = ", ".join(f"{m} at {r.address}" for m, r in registers.items())
            raise ControlTableError(
                f"{name} lies apart ({places}): such servos cannot share a group packet"
            )
        return next(iter(registers.values())) if registers else self.table.register(name)

    def _retry(self, transaction: Callable[[], T], tries: int | None = None) -> T:
        """Run a transaction, and again after silence or damage; a refusal is final."""
        for remaining in range((tries or self._tries) - 1, -1, -1):
            try:
                return transaction()
            except NoAnswerError:
                self.port.drain_until_quiet(self.latency_s)  # the reply may be late
                if not remaining:
                    raise
            finally:
                self.port.is_using = False
        raise AssertionError("tries is at least 1")

    def _check_result(self, result: int, servo_id: int, what: str) -> None:
        if result != sdk.COMM_SUCCESS:
            reason = self._sdk.getTxRxResult(result).removeprefix("[TxRxResult] ").rstrip("!")
            if result == sdk.COMM_RX_TIMEOUT:
                reason = "no answer"
            baud = self.port.getBaudRate()
            find = "; find it with snakewalk bus scan" if what == "ping" else ""
            raise NoAnswerError(f"servo {servo_id}: {what}: {reason} at {baud} baud{find}")


def _blocks(registers: Iterable[Register]) -> list[list[Register]]:
    blocks: list[list[Register]] = []
    end = 0
    for register in sorted(set(registers), key=lambda entry: entry.address):
        if not blocks or register.address > end + _GAP_BYTES:
            blocks.append([])
        blocks[-1].append(register)
        end = register.address + register.size
    return blocks
