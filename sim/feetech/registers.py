"""Registers of S Feetech servos: values, and their bytes in the model's format."""

from collections.abc import Iterable

import numpy as np

from snakewalk.config.arrays import Ints
from snakewalk.config.servo_model import RegisterRow, ServoModel
from snakewalk.drivers.protocol.feetech import decode_word, encode_word

TABLE_END = 256
"""Addresses that a packet can name; those without a register read 0 (ours)."""
_FOLLOWS = {"Goal PWM": "PWM Limit", "Goal Current": "Current Limit", "Secondary ID": "ID"}
"""Registers that have the value of another one after power-on."""
_COPIES = {"Kp": "Position P Gain", "Kd": "Position D Gain", "Ki": "Position I Gain"}


class FeetechRegisters:
    """Values (S,) by name; EEPROM writes while Lock is 1 do not persist."""

    def __init__(self, facts: ServoModel, servos: int) -> None:
        self.facts = facts
        self._rows = dict(sorted(facts.registers.items(), key=lambda item: item[1].address))
        self.values: dict[str, Ints] = {name: np.zeros(servos, np.int64) for name in self._rows}
        self._kept = {
            name: np.zeros(servos, np.int64)
            for name, row in self._rows.items()
            if row.address < facts.ram_from
        }
        self._backup: dict[int, dict[str, int]] = {}
        for row in range(servos):
            self.reset(row, kept_names=())

    def __getitem__(self, name: str) -> Ints:
        """(S,) live view of a register."""
        return self.values[name]

    def initial(self, name: str) -> int:
        """Value of a register of a new servo."""
        values_by_name = {
            "Model Number": self.facts.model_number,
            "Firmware Version": self.facts.firmware,
        }
        return values_by_name.get(name, self._rows[name].initial)

    def read(self, row: int, address: int, length: int) -> bytes:
        """Bytes of a block of one servo."""
        data = bytearray(TABLE_END)
        for name, register in self._registers_in_range(address - 1, address + length + 1):
            raw = encode_word(int(self.values[name][row]), register, self.facts, name)
            data[register.address : register.address + register.size] = raw
        return bytes(data[address : address + length])

    def write(self, row: int, address: int, data: bytes) -> list[str]:
        """Write the registers in a block; return the names of the accepted ones.

        Read-only registers and values out of range are ignored (ours).
        """
        accepted = []
        for name, register in self._registers_in_range(address, address + len(data)):
            if register.range is None:
                continue
            value = decode_word(data[register.address - address :], register, self.facts)
            if register.range[0] <= value <= register.range[1]:
                self.put(row, name, value)
                accepted.append(name)
        return accepted

    def put(self, row: int, name: str, value: int) -> None:
        """Set a register of one servo, like a write."""
        self.values[name][row] = value
        if name in self._kept and not self.values["Lock"][row]:
            self._kept[name][row] = value
        if name == "ID" and "Secondary ID" in self.values:
            self.put(row, "Secondary ID", value)

    def store(self, row: int, name: str) -> None:
        """Make the present value of a register persistent."""
        self._kept[name][row] = self.values[name][row]

    def restart(self, row: int) -> None:
        """Set the values after power-on: the persistent EEPROM, and initial RAM."""
        for name in self._rows:
            kept = self._kept.get(name)
            self.values[name][row] = self.initial(name) if kept is None else kept[row]
        for name, source in (_FOLLOWS | _COPIES).items():
            if name in self.values:
                self.values[name][row] = self.values[source][row]

    def reset(self, row: int, kept_names: Iterable[str] = ("ID",)) -> None:
        """Restore all parameters except ``kept_names``: backed-up ones, else the factory's."""
        backup = self._backup.get(row, {})
        for name, kept in self._kept.items():
            if name not in kept_names:
                kept[row] = backup.get(name, self.initial(name))
        self.restart(row)

    def back_up(self, row: int) -> None:
        """Store the EEPROM parameters for ``reset``."""
        self._backup[row] = {name: int(kept[row]) for name, kept in self._kept.items()}

    def _registers_in_range(self, start: int, end: int) -> Iterable[tuple[str, RegisterRow]]:
        return [
            (name, row)
            for name, row in self._rows.items()
            if start <= row.address and row.address + row.size <= end
        ]
