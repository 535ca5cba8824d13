"""AX-12A servos: their control table, and what it does to the motors (e-manual, AX-12A).

The SDK ships no table of this model, so addresses stand here with the rest of the manual's columns.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from config.errors import InputError
from sim.bus.motor import MotorModel, make_drive
from sim.bus.profile import VELOCITY_UNIT_RAD_S, Trajectory
from sim.bus.protocol1 import MAX_ID, Error1
from sim.plant import Plant

MODEL = "AX-12A"
TABLE_BYTES = 50
EEPROM_END = 24
"""Addresses below are locked while Lock(47) is 1."""
CENTRE_TICKS, TICKS_PER_RAD = 512, 1023.0 / np.radians(300.0)
SPEED_UNIT_RAD_S = 0.111 * 2.0 * np.pi / 60.0
"""Moving Speed(32), Present Speed(38)."""
SLICE_S = 2e-3
OVERLOAD_S = 1.0
"""How long full output may be held (ours)."""
AMBIENT_C = 25.0
FAINT = 1e-9
CLOCKWISE = 0x400
"""Bit 10: the direction of speeds and loads."""
AX12_MOTOR = MotorModel(12.0, 1.5, 1.5, 59.0 * 2.0 * np.pi / 60.0, 1e-3, 1.0, 0.050, 12.0, 150.0)
"""E-manual AX-12A: 1.5 N m at 12 V and 1.5 A, 59 rev/min; standby from the AX series; heat ours."""


@dataclass(frozen=True, slots=True)
class Cell:
    """One register: address, size, initial value, and its range if it may be written."""

    address: int
    size: int
    initial: int
    low: int | None = None
    high: int | None = None


CELLS = {
    "Model Number": Cell(0, 2, 12),
    "Firmware Version": Cell(2, 1, 24),
    "ID": Cell(3, 1, 1, 0, MAX_ID),
    "Baud Rate": Cell(4, 1, 1, 0, 254),
    "Return Delay Time": Cell(5, 1, 250, 0, 254),
    "CW Angle Limit": Cell(6, 2, 0, 0, 1023),
    "CCW Angle Limit": Cell(8, 2, 1023, 0, 1023),
    "Temperature Limit": Cell(11, 1, 70, 0, 100),
    "Min Voltage Limit": Cell(12, 1, 60, 50, 160),
    "Max Voltage Limit": Cell(13, 1, 140, 50, 160),
    "Max Torque": Cell(14, 2, 1023, 0, 1023),
    "Status Return Level": Cell(16, 1, 2, 0, 2),
    "Alarm LED": Cell(17, 1, 36, 0, 127),
    "Shutdown": Cell(18, 1, 36, 0, 127),
    "Torque Enable": Cell(24, 1, 0, 0, 1),
    "LED": Cell(25, 1, 0, 0, 1),
    "CW Compliance Margin": Cell(26, 1, 1, 0, 255),
    "CCW Compliance Margin": Cell(27, 1, 1, 0, 255),
    "CW Compliance Slope": Cell(28, 1, 32, 1, 254),
    "CCW Compliance Slope": Cell(29, 1, 32, 1, 254),
    "Goal Position": Cell(30, 2, 512, 0, 1023),
    "Moving Speed": Cell(32, 2, 0, 0, 2047),
    "Torque Limit": Cell(34, 2, 1023, 0, 1023),
    "Present Position": Cell(36, 2, 0),
    "Present Speed": Cell(38, 2, 0),
    "Present Load": Cell(40, 2, 0),
    "Present Voltage": Cell(42, 1, 0),
    "Present Temperature": Cell(43, 1, 0),
    "Registered": Cell(44, 1, 0),
    "Moving": Cell(46, 1, 0),
    "Lock": Cell(47, 1, 0, 0, 1),
    "Punch": Cell(48, 2, 32, 32, 1023),
}
_AT = {cell.address: name for name, cell in CELLS.items()}


class Ax12Servos:
    """S servos on the shafts of ``plant``.

    Raises:
        InputError: an ID is out of 0 to 253 or used twice.

    """

    def __init__(self, ids: tuple[int, ...], plant: Plant, supply_v: float = 12.0) -> None:
        wrong = [
            f"ID {each}: an {MODEL} has 0 to {MAX_ID}" for each in ids if not 0 <= each <= MAX_ID
        ]
        if len(set(ids)) != len(ids):
            wrong.append(f"two servos share an ID: {', '.join(map(str, sorted(ids)))}")
        if wrong:
            raise InputError(wrong)
        self.plant = plant
        self.table = np.zeros((len(ids), TABLE_BYTES), np.uint8)
        self.drive = make_drive([AX12_MOTOR] * len(ids), supply_v)
        self.errors = np.zeros(len(ids), np.uint8)
        """(S,) alarms that last: voltage, heat, overload."""
        self._views = {name: self._view(cell) for name, cell in CELLS.items()}
        self._path = Trajectory(len(ids))
        self._celsius = np.full(len(ids), AMBIENT_C)
        self._blocked_s = np.zeros(len(ids))
        self._time_s = plant.time_s
        for row in range(len(ids)):
            self.reset(row)
        self["ID"][:] = ids
        self._path.place(np.ones(len(ids), bool), plant.position_rad)
        self.refresh()
        self["Goal Position"][:] = self["Present Position"]

    def __getitem__(self, name: str) -> NDArray[np.unsignedinteger]:
        """(S,) live view of a register of all servos."""
        return self._views[name]

    def __len__(self) -> int:
        return len(self.table)

    def reset(self, row: int) -> None:
        """Factory values, the ID too."""
        for name, cell in CELLS.items():
            self[name][row] = cell.initial

    def write(self, row: int, address: int, data: bytes) -> int:
        """Write whole registers or, with an error bit, nothing."""
        found: list[tuple[str, int]] = []
        at = address
        while at < address + len(data):
            name = _AT.get(at)
            if name is None:
                return Error1.INSTRUCTION
            cell = CELLS[name]
            raw = data[at - address : at - address + cell.size]
            value = int.from_bytes(raw, "little")
            locked = at < EEPROM_END and self["Lock"][row]
            if len(raw) < cell.size or locked or cell.low is None or cell.high is None:
                return Error1.INSTRUCTION
            if not cell.low <= value <= cell.high:
                return Error1.RANGE
            if name == "Goal Position" and not self._wheel()[row]:
                low, high = int(self["CW Angle Limit"][row]), int(self["CCW Angle Limit"][row])
                if not low <= value <= high:
                    return Error1.ANGLE_LIMIT
            found.append((name, value))
            at += cell.size
        for name, value in found:
            self[name][row] = value
            if name == "Goal Position":  # a goal switches the torque on
                self["Torque Enable"][row] = 1
        return 0

    def advance(self, until_s: float) -> None:
        """Step physics, trajectories and alarms to ``until_s``."""
        while self._time_s < until_s:
            stop_s = min(until_s, self._time_s + SLICE_S)
            self._steer(stop_s - self._time_s)
            self.plant.advance(stop_s, self.drive)
            self._guard(stop_s - self._time_s)
            self._time_s = stop_s

    def refresh(self) -> None:
        """All present values."""
        ticks = self.plant.position_rad * TICKS_PER_RAD + CENTRE_TICKS
        self["Present Position"][:] = np.clip(np.rint(ticks), 0, 1023)
        speed = self.plant.velocity_rad_s / SPEED_UNIT_RAD_S
        self["Present Speed"][:] = _signed(speed)
        self["Present Load"][:] = _signed(self.drive.pwm * 1023.0)
        self["Present Voltage"][:] = np.rint(self.drive.supply_v * 10.0)
        self["Present Temperature"][:] = np.clip(np.rint(self._celsius), 0, 255)
        self["Moving"][:] = self._path.ongoing & (self["Torque Enable"] == 1) & ~self._wheel()

    def _wheel(self) -> NDArray[np.bool_]:
        return np.asarray((self["CW Angle Limit"] == 0) & (self["CCW Angle Limit"] == 0))

    def _steer(self, seconds: float) -> None:
        drive, wheel = self.drive, self._wheel()
        on, speed = self["Torque Enable"] == 1, self["Moving Speed"].astype(int)
        shaft = self.plant.position_rad
        self._path.place(~on | wheel, shaft)
        goal = (self["Goal Position"].astype(float) - CENTRE_TICKS) / TICKS_PER_RAD
        units = (speed & 1023).astype(np.float64) * (SPEED_UNIT_RAD_S / VELOCITY_UNIT_RAD_S)
        still = np.where(on & ~wheel, goal, self._path.goal).astype(np.float64)
        self._path.aim(still, units, np.zeros(len(self)), np.zeros(len(self), bool))
        self._path.advance(seconds)
        error = self._path.position - shaft
        right = error < 0.0
        margin = np.where(right, self["CW Compliance Margin"], self["CCW Compliance Margin"])
        slope = np.where(right, self["CW Compliance Slope"], self["CCW Compliance Slope"])
        inside = np.abs(error) * TICKS_PER_RAD <= margin
        push = np.where(speed & CLOCKWISE, -1.0, 1.0) * (speed & 1023) / 1023.0
        gain = np.where(wheel | inside, FAINT, TICKS_PER_RAD / slope)
        drive.torque_on[:] = on
        drive.p_gain_per_rad[:] = gain
        aim = np.where(inside, shaft, self._path.position - np.sign(error) * margin / TICKS_PER_RAD)
        drive.goal_rad[:] = np.where(wheel, push / FAINT, aim)
        drive.pwm_limit[:] = np.minimum(self["Torque Limit"], self["Max Torque"]) / 1023.0

    def _guard(self, seconds: float) -> None:
        drive = self.drive
        watts = drive.current_a**2 * AX12_MOTOR.resistance_ohm
        target = AMBIENT_C + AX12_MOTOR.winding_k_per_w * watts
        share = 1.0 - np.exp(-seconds / AX12_MOTOR.thermal_time_s)
        self._celsius += (target - self._celsius) * share
        full = (np.abs(drive.pwm) >= 0.98 * drive.pwm_limit) & (drive.pwm_limit > 0.0)
        slow = np.sign(drive.pwm) * self.plant.velocity_rad_s < 0.05 * AX12_MOTOR.no_load_rad_s
        held = full & slow & (drive.torque_on > 0)
        self._blocked_s = np.where(held, self._blocked_s + seconds, 0.0)
        tenths = np.rint(drive.supply_v * 10.0)
        outside = (tenths < self["Min Voltage Limit"]) | (tenths > self["Max Voltage Limit"])
        found = Error1.VOLTAGE * outside | Error1.OVERLOAD * (self._blocked_s >= OVERLOAD_S)
        found |= Error1.OVERHEATING * (np.rint(self._celsius) > self["Temperature Limit"])
        self.errors |= found.astype(np.uint8)
        off = (self.errors & self["Shutdown"]) != 0
        self["Torque Limit"][off] = 0
        self["Torque Enable"][off] = 0

    def _view(self, cell: Cell) -> NDArray[np.unsignedinteger]:
        block = self.table[:, cell.address : cell.address + cell.size]
        return block.view(f"<u{cell.size}")[:, 0]


def _signed(
    values: NDArray[np.float64],
) -> NDArray[np.int_]:
    """Magnitude up to 1023 and the direction in bit 10."""
    size = np.clip(np.rint(np.abs(values)), 0, 1023).astype(int)
    return np.where((values < 0.0) & (size > 0), size | CLOCKWISE, size)
