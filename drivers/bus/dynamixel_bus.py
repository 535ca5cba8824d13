"""The bus: service work, with the DYNAMIXEL SDK where it is right and around it where it is not.

What is guarded, with dynamixel-sdk 4.1.0:

- It never stuffs what it sends, and what it unstuffs is not always what was stuffed. A status
  packet with an error and without data counts as success, and of one that is too short the CRC
  counts as data. So registers are read and written by this package's own strict codec; the SDK
  finds servos and reboots them.
- An exception in the port leaves it busy for ever: it is freed again.
- A broadcast ping waits 0.8 s for 252 servos: ``find`` pings the expected ones.

The control cycle does not go through the SDK: see ``drivers.bus.control_cycle``.
"""

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from typing import TypeVar

import dynamixel_sdk as sdk

from snakewalk.drivers.bus.control_cycle import ControlCycle
from snakewalk.drivers.bus.pending_replies import PendingReplies
from snakewalk.drivers.bus.probe import Probe, probe
from snakewalk.drivers.bus.register_io import check_accepted, read_register, write_register
from snakewalk.drivers.errors import BusError, NoAnswerError
from snakewalk.drivers.port.byte_port import BytePort
from snakewalk.drivers.protocol.control_table import ControlTable, load_control_table
from snakewalk.drivers.protocol.packet import (
    ALERT,
    BROADCAST_ID,
    Instruction,
    InstructionPacket,
    encode_instruction,
)

T = TypeVar("T")
_PING_BYTES = 3
"""Model number and firmware."""


@dataclass(frozen=True, slots=True)
class Found:
    """A servo that answered a ping."""

    servo_id: int
    model_number: int
    firmware: int | None
    """None where only the ping was asked."""
    alert: bool
    """It reports a hardware error (register 70)."""


class DynamixelBus:
    """Servos of one model on one byte port."""

    def __init__(
        self,
        port: BytePort,
        model: str = "XM430-W350",
        *,
        latency_s: float = 0.004,
        tries: int = 3,
    ) -> None:
        self.port = port
        self.table: ControlTable = load_control_table(model)
        self.latency_s = latency_s
        """How long adapter and driver may hold bytes back (FTDI: its latency timer)."""
        self._tries = max(1, tries)
        self._pending = PendingReplies(port.clock)
        self._sdk = sdk.PacketHandler(2.0)

    def ping(self, servo_id: int) -> Found:
        """Ask one servo who it is.

        Raises:
            NoAnswerError: nobody answered.

        """

        def once() -> Found:
            number, result, error = self._sdk.ping(self.port, servo_id)
            if result != sdk.COMM_SUCCESS:
                self._pending.add([servo_id], _PING_BYTES, fast=False)
            self._came(result, servo_id, "ping")
            return Found(servo_id, number, None, bool(error & ALERT))

        return self._retry(once)

    def find(self, servo_ids: Iterable[int]) -> dict[int, Found]:
        """Ping each; those that answered."""
        found = {}
        for servo_id in servo_ids:
            try:
                found[servo_id] = self.ping(servo_id)
            except NoAnswerError:
                continue
        return found

    def scan(self) -> dict[int, Found]:
        """All servos at the port's baud rate, by a broadcast ping; takes most of a second."""
        replies, _ = self._guarded(lambda: self._sdk.broadcastPing(self.port))
        return {
            servo_id: Found(servo_id, number, firmware, False)
            for servo_id, (number, firmware) in sorted(replies.items())
        }

    def probe(self, servo_id: int, asked: int = 5) -> Probe:
        """Ping and receive to the end: finds two servos of one ID, which a ping does not."""
        return probe(self.port, servo_id, asked, self.latency_s)

    def read(self, servo_id: int, name: str) -> int:
        """Value of a register by its name.

        Raises:
            ControlTableError: no such register.
            NoAnswerError: nobody answered.
            ServoError: the servo refused.

        """
        register = self.table.register(name)
        data = self._retry(
            lambda: read_register(self.port, servo_id, register, self.latency_s, self._pending)
        )
        return register.decode(data)

    def write(self, servo_id: int, name: str, value: int) -> None:
        """Write a register by its name.

        Raises:
            ControlTableError: no such register, or the value does not fit it.
            NoAnswerError: nobody answered.
            ServoError: the servo refused.

        """
        register = self.table.register(name)
        data = register.encode(value)
        self._retry(
            lambda: write_register(
                self.port, servo_id, register, data, self.latency_s, self._pending
            )
        )

    def sync_write(self, servo_ids: Sequence[int], name: str, value: int) -> None:
        """Write one value to all at once; nobody confirms it.

        Raises:
            ControlTableError: no such register, or the value does not fit it.

        """
        register = self.table.register(name)
        data = register.encode(value)
        params = register.address.to_bytes(2, "little") + register.size.to_bytes(2, "little")
        params += b"".join(bytes([servo_id]) + data for servo_id in servo_ids)
        packet = InstructionPacket(BROADCAST_ID, Instruction.SYNC_WRITE, params)
        self.port.write(encode_instruction(packet))

    def write_verified(self, servo_id: int, name: str, value: int) -> None:
        """Write a register if it differs, and read it back: EEPROM wears, and writes get lost.

        Raises:
            BusError: it does not read back as written.

        """
        if self.read(servo_id, name) == value:
            return
        self.write(servo_id, name, value)
        got = self.read(servo_id, name)
        if got != value:
            raise BusError(f"servo {servo_id}: {name}: wrote {value}, reads back {got}")

    def reboot(self, servo_id: int) -> None:
        """Restart a servo: clears hardware errors, torque goes off, its turn count is lost."""

        def once() -> None:
            result, error = self._sdk.reboot(self.port, servo_id)
            self._came(result, servo_id, "reboot")
            check_accepted(servo_id, "reboot", error)

        self._retry(once)

    def cycle(self, servo_ids: Sequence[int], *, fast: bool = True) -> ControlCycle:
        """Codec of the control cycle for these servos: Goal Position out, current to position in.

        Raises:
            ControlTableError: the model lacks one of the registers.

        """
        return self.block(servo_ids, "Present Current", "Present Position", fast=fast)

    def slow_cycle(self, servo_ids: Sequence[int], *, fast: bool = True) -> ControlCycle:
        """Codec that reads voltage and temperature.

        Raises:
            ControlTableError: the model lacks one of the registers.

        """
        return self.block(servo_ids, "Present Input Voltage", "Present Temperature", fast=fast)

    def block(
        self, servo_ids: Sequence[int], first: str, last: str, *, fast: bool = True
    ) -> ControlCycle:
        """Codec that reads the registers from ``first`` to ``last``, both included.

        Raises:
            ControlTableError: the model lacks one of the registers.

        """
        start, end = self.table[first].address, self.table[last].address + self.table[last].size
        return ControlCycle(
            self.port,
            servo_ids,
            goal_address=self.table["Goal Position"].address,
            read_address=start,
            read_bytes=end - start,
            fast=fast,
            latency_s=self.latency_s,
            pending=self._pending,
        )

    def _retry(self, once: Callable[[], T]) -> T:
        """Run an exchange, again after silence or damage; what the servo refuses is final."""
        for left in range(self._tries - 1, -1, -1):
            try:
                return self._guarded(once)
            except NoAnswerError:
                self.port.drain_until_quiet(self.latency_s)  # it may come late
                if not left:
                    raise
        raise AssertionError("tries is at least 1")

    def _guarded(self, call: Callable[[], T]) -> T:
        try:
            return call()
        finally:
            self.port.is_using = False

    def _came(self, result: int, servo_id: int, what: str) -> None:
        if result != sdk.COMM_SUCCESS:
            said = self._sdk.getTxRxResult(result).removeprefix("[TxRxResult] ")
            raise NoAnswerError(
                f"servo {servo_id}: {what}: {said} at {self.port.getBaudRate()} baud"
            )
