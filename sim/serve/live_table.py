"""What the live view of a simulated bus shows: registers of all servos, and recent packets."""

from collections import deque
from collections.abc import Callable

import numpy as np

from snakewalk.sim.ax12.ax12 import Ax12Servos
from snakewalk.sim.ax12.decode import Decoder1
from snakewalk.sim.ax12.table import CELLS
from snakewalk.sim.line.sim_line import SimLine
from snakewalk.sim.servo.bank import ServoBank
from snakewalk.sim.servo.mixed_bank import MixedBank
from snakewalk.sim.sniff.decode import DecodedPacket, Decoder

Rows = list[dict[str, object]]
SHOWN = 8
"""Packets kept."""


class LiveTable:
    """A ``PacketTap`` that counts and remembers; ``registers`` reads those worth looking at."""

    def __init__(self, look: Callable[[], Rows], decoder: Decoder | Decoder1) -> None:
        self.registers = look
        self._decoder = decoder
        self.questions = self.answers = self.bytes = 0
        self.recent: deque[DecodedPacket] = deque(maxlen=SHOWN)

    def __call__(self, time_s: float, from_host: bool, data: bytes) -> None:
        """Take note of one packet."""
        self.questions += from_host
        self.answers += not from_host
        self.bytes += len(data)
        self.recent.extend(self._decoder.feed(time_s, data))


def servo_rows(line: SimLine) -> Rows:
    """One row a servo of Protocol 2.0: what it is, where it is, how it fares."""
    line.firmware.refresh()
    if not isinstance(line.bank, MixedBank):
        rows = _look_at(line.bank)
    else:
        rows = [row for part in line.bank.parts for row in _look_at(part)]
        for row in rows:  # a table has the same columns for all
            row["current"], row["load"] = row.pop("current", "-"), row.pop("load", "-")
    powered = line.firmware.powered
    return [row | {"power": bool(on)} for row, on in zip(rows, powered, strict=True)]


def _look_at(bank: ServoBank) -> Rows:
    drawn = "Present Current" if bank.measures_current else "Present Load"
    names = {
        "id": "ID",
        "mode": "Operating Mode",
        "torque": "Torque Enable",
        "goal": "Goal Position",
        "position": "Present Position",
        "velocity": "Present Velocity",
        drawn.split()[1].lower(): drawn,
        "volts": "Present Input Voltage",
        "celsius": "Present Temperature",
        "error": "Hardware Error Status",
    }
    columns = {key: np.asarray(bank[name]) for key, name in names.items()}
    rows: Rows = []
    for row in range(len(bank)):
        shown: dict[str, object] = {key: int(values[row]) for key, values in columns.items()}
        shown["volts"] = columns["volts"][row] / 10.0
        rows.append(shown)
    return rows


def ax12_rows(servos: Ax12Servos) -> Rows:
    """One row an AX-12A."""
    servos.refresh()
    shown = ("ID", "Goal Position", *(name for name in CELLS if name.startswith("Present")))
    rows: Rows = []
    for row in range(len(servos)):
        seen: dict[str, object] = {
            name.lower().removeprefix("present "): int(servos[name][row]) for name in shown
        }
        alarms = {
            "torque": int(servos["Torque Enable"][row]),
            "error": int(servos.protection.shown[row]),
            "power": bool(servos.powered[row]),
        }
        rows.append(seen | alarms)
    return rows
