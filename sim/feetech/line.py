"""Feetech servos on the wire."""

from collections.abc import Callable, Sequence

import numpy as np

from snakewalk.drivers.protocol.feetech import FeetechInstruction as Code
from snakewalk.drivers.protocol.protocol1 import BROADCAST_ID, Packet1, frame
from snakewalk.drivers.protocol.registers import RETURN_DELAY_UNIT_S
from snakewalk.sim.ax12.line import BAUD_TOLERANCE, Ax12Line
from snakewalk.sim.feetech.registers import TABLE_END
from snakewalk.sim.feetech.servos import FeetechServos
from snakewalk.sim.line.bus_contention import Reply
from snakewalk.sim.line.clock import SimClock

_ALWAYS_ANSWERED = (Code.PING, Code.READ)
"""Instructions to which servos reply at Status Return Level(8) 0 as well."""
_READ_BYTES = 2
Tamper = Callable[[bytes], Sequence[bytes]]


class FeetechLine(Ax12Line):
    """Feetech ``servos`` behind a serial line of ``baud``.

    A packet with a wrong checksum and an unknown instruction get no reply (ours). In a sync read
    servos after a silent one stay silent (ours).
    """

    servos: FeetechServos  # type: ignore[assignment]

    def __init__(
        self,
        servos: FeetechServos,
        clock: SimClock | None = None,
        baud: int = 1_000_000,
    ) -> None:
        super().__init__(servos, clock, baud)  # type: ignore[arg-type]
        self.tamper: Tamper | None = None
        """Changes one reply on the wire: returns the packets that arrive instead, in order."""

    @property
    def firmware(self) -> FeetechServos:
        """The servos."""
        return self.servos

    @property
    def bank(self) -> FeetechServos:
        """The servos; registers by name."""
        return self.servos

    def register_type(self, row: int, name: str) -> np.dtype[np.integer] | None:
        """Type of a register's numbers; None if a servo lacks it."""
        del row
        register = self.servos.facts.registers.get(name)
        if register is None:
            return None
        return np.dtype(f"{'i' if register.sign_bit is not None else 'u'}{register.size}")

    def _reply_with_faults(self, data: bytes, now_s: float) -> Sequence[tuple[float, bytes]]:
        if self.tamper is not None:
            return [(0.0, packet) for packet in self.tamper(data)]
        return super()._reply_with_faults(data, now_s)

    def _addressed_rows(self, servo_id: int) -> list[int]:
        return self._rows(servo_id, "ID")

    def _rows(self, servo_id: int, name: str) -> list[int]:
        servos = self.servos
        rate = self.getBaudRate()
        if name not in servos.facts.registers:
            return []
        rates = [servos.facts.bauds[int(code)] for code in servos["Baud Rate"]]
        return [
            row
            for row in range(len(servos))
            if servos.powered[row]
            and servo_id in (BROADCAST_ID, servos[name][row])
            and abs(rates[row] / rate - 1.0) <= BAUD_TOLERANCE
        ]

    def _rows_by_secondary_id(self, servo_id: int) -> list[int]:
        """Rows of the servos with this secondary ID; they obey without a reply."""
        if servo_id == BROADCAST_ID:
            return []
        ids = self.servos["ID"]
        return [row for row in self._rows(servo_id, "Secondary ID") if ids[row] != servo_id]

    def _execute_packet(self, packet: Packet1) -> list[Reply]:
        if not packet.intact:
            return []
        if packet.instruction == Code.SYNC_READ:
            return self._sync_read(packet)
        if packet.instruction in (Code.WRITE, Code.REG_WRITE, Code.ACTION):
            for row in self._rows_by_secondary_id(packet.servo_id):
                self._execute_one(row, packet.instruction, packet.params)
        return super()._execute_packet(packet)

    def _obeying(self, servo_id: int) -> list[int]:
        return [*self._addressed_rows(servo_id), *self._rows_by_secondary_id(servo_id)]

    def _replies_to(self, row: int, code: int) -> bool:
        return code in _ALWAYS_ANSWERED or bool(self.servos["Status Return Level"][row])

    def _delay_s(self, row: int) -> float:
        servos = self.servos
        if "Return Delay Time" not in servos.facts.registers:
            return 0.0
        return int(servos["Return Delay Time"][row]) * RETURN_DELAY_UNIT_S

    def _execute_one(self, row: int, code: int, params: bytes) -> tuple[int, bytes]:
        servos = self.servos
        if code == Code.READ and len(params) == _READ_BYTES:
            address, length = params
            servos.refresh()
            return 0, servos.read(row, address, min(length, TABLE_END - address))
        if code == Code.WRITE and len(params) >= _READ_BYTES:
            servos.write(row, params[0], params[1:])
        elif code == Code.REG_WRITE and len(params) >= _READ_BYTES:
            servos.register_write(row, params[0], params[1:])
        elif code == Code.ACTION:
            servos.action(row)
        elif code == Code.RECOVER:
            servos.reset(row)
        elif code == Code.RESTART:
            servos.reboot(row)
        elif code == Code.BACK_UP:
            servos.registers.back_up(row)
        elif code == Code.RESET:
            servos.reset_turns(row)
        elif code == Code.CALIBRATE:
            order = servos.facts.byte_order
            middle = servos.facts.units.zero_position
            servos.calibrate(row, int.from_bytes(params, order) if params else middle)
        return 0, b""

    def _sync_read(self, packet: Packet1) -> list[Reply]:
        servos = self.servos
        params = packet.params
        if not servos.facts.sync_read or len(params) <= _READ_BYTES:
            return []
        servos.refresh()
        address = params[0]
        length = params[1]
        replies = []
        for servo_id in params[2:]:
            rows = [row for row in self._addressed_rows(servo_id) if not self._muted[row]]
            if not rows:
                break
            answers = [
                Reply(
                    self._delay_s(row),
                    frame(
                        servo_id,
                        int(servos.protection.shown[row]),
                        servos.read(row, address, min(length, TABLE_END - address)),
                    ),
                )
                for row in rows
            ]
            replies.append(self._respond(answers))
        return replies
