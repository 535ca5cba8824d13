"""Live table of a simulated bus: registers of all servos, and the latest packets.

Its functions are quick, because the servos reply in between.
"""

from collections import deque
from collections.abc import Callable

import numpy as np

from snakewalk.sim.ax12.ax12 import Ax12Servos
from snakewalk.sim.line.sim_line import SimLine

COLUMNS = {
    "id": "ID",
    "mode": "Operating Mode",
    "torque": "Torque Enable",
    "goal": "Goal Position",
    "position": "Present Position",
    "velocity": "Present Velocity",
    "volts": "Present Input Voltage",
    "celsius": "Present Temperature",
    "error": "Hardware Error Status",
}
"""Registers shown of each servo, by key."""
Rows = list[dict[str, object]]
Packet = tuple[float, bytes]
"""Time and bytes of one packet."""
KEPT = 32
"""Packets kept from one drawing to the next."""


class LiveTable:
    """A ``PacketTap`` that counts and stores packets; ``registers`` reads the rows."""

    def __init__(self, registers: Callable[[], Rows]) -> None:
        self.registers = registers
        self.questions = self.answers = self.bytes = 0
        self._recent: deque[Packet] = deque(maxlen=KEPT)

    def __call__(self, time_s: float, from_host: bool, data: bytes) -> None:
        """Count and store one packet."""
        self.questions += from_host
        self.answers += not from_host
        self.bytes += len(data)
        self._recent.append((time_s, data))

    def take_recent(self) -> tuple[Packet, ...]:
        """The latest packets since the last call, oldest first."""
        recent = tuple(self._recent)
        self._recent.clear()
        return recent


def servo_rows(line: SimLine) -> Rows:
    """One row per servo of Protocol 2.0: mode, motion and state."""
    line.firmware.refresh()
    bank = line.bank
    measured = line.bank.measures_current
    columns = {key: np.asarray(bank[name]) for key, name in COLUMNS.items()}
    current = bank["Present Current" if measured.any() else "Present Load"]  # at one address
    rows: Rows = []
    for row in range(len(bank)):
        shown: dict[str, object] = {key: int(values[row]) for key, values in columns.items()}
        if measured.any():
            shown["current"] = int(current[row]) if measured[row] else "-"
        if not measured.all():
            shown["load"] = "-" if measured[row] else int(current[row])
        shown["volts"] = columns["volts"][row] / 10.0
        rows.append(shown | {"power": bool(line.firmware.powered[row])})
    return rows


def ax12_rows(servos: Ax12Servos) -> Rows:
    """One row per servo of Protocol 1.0."""
    servos.refresh()
    shown = (
        "ID",
        "Goal Position",
        *(name for name in servos.facts.registers if name.startswith("Present")),
    )
    rows: Rows = []
    for row in range(len(servos)):
        values: dict[str, object] = {
            name.lower().removeprefix("present "): int(servos[name][row]) for name in shown
        }
        alarms = {
            "torque": int(servos["Torque Enable"][row]),
            "error": int(servos.protection.shown[row]),
            "power": bool(servos.powered[row]),
        }
        rows.append(values | alarms)
    return rows
