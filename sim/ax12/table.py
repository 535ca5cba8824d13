"""Control table of the AX-12A (e-manual, Control Table of EEPROM Area, of RAM Area).

The SDK ships no table of this model, so addresses stand here with the rest of the manual's columns.
"""

from dataclasses import dataclass

from snakewalk.sim.ax12.protocol1 import MAX_ID

MODEL = "AX-12A"
TABLE_BYTES = 50
EEPROM_END = 24
"""Addresses below outlive the power, and are locked while Lock(47) is 1."""


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
AT = {cell.address: name for name, cell in CELLS.items()}
"""Names by first address."""
