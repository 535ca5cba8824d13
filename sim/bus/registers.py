"""What the e-manual says of each register beside its address: access, initial value, range.

Addresses and sizes come from the SDK's own control tables (``drivers.control_table``); the columns
"Access", "Initial Value" and "Range" are only in the e-manual's control table of each model, and
stand here.
"""

from collections.abc import Mapping
from dataclasses import dataclass

from drivers.errors import ControlTableError


@dataclass(frozen=True, slots=True)
class Rule:
    """Initial value and range; without a range the register is read-only."""

    initial: int
    low: int | None = None
    high: int | None = None

    @property
    def writable(self) -> bool:
        """Access column: RW."""
        return self.low is not None


EEPROM_END = 64
"""Addresses below are the EEPROM area: locked while Torque Enable(64) is 1."""

EXTENDED_RANGE_TICKS = 1_048_575
"""Goal Position(116) in the multi-turn modes: -256 to 256 revolutions."""

WATCHDOG_TRIPPED = 0xFF
"""Bus Watchdog(98) reads -1 in its error state."""

GOALS = ("Goal PWM", "Goal Current", "Goal Velocity", "Goal Position")

CURRENT_MODE, VELOCITY_MODE, POSITION_MODE, EXTENDED_MODE = 0, 1, 3, 4
CURRENT_POSITION_MODE, PWM_MODE = 5, 16
MODES = (0, 1, 3, 4, 5, 16)
"""Operating Mode(11)."""

BAUDS = (9_600, 57_600, 115_200, 1_000_000, 2_000_000, 3_000_000, 4_000_000, 4_500_000)
"""Baud Rate(8), by value."""

MODE_RESETS = (
    *("Velocity I Gain", "Velocity P Gain", "Position D Gain", "Position I Gain"),
    *("Position P Gain", "Feedforward 2nd Gain", "Feedforward 1st Gain"),
    *("Profile Acceleration", "Profile Velocity"),
)

_GAIN = (0, 16_383)

# e-manual, X series, "Control Table of EEPROM Area" and "Control Table of RAM Area".
_X_SERIES: Mapping[str, Rule] = {
    "Model Number": Rule(0),
    "Model Information": Rule(0),
    "Firmware Version": Rule(48),  # fast sync read needs 45 or later
    "ID": Rule(1, 0, 252),
    "Baud Rate": Rule(1, 0, 7),
    "Return Delay Time": Rule(250, 0, 254),
    "Drive Mode": Rule(0, 0, 13),
    "Operating Mode": Rule(3, 0, 16),
    "Secondary(Shadow) ID": Rule(255, 0, 255),
    "Protocol Type": Rule(2, 1, 22),
    "Homing Offset": Rule(0, -1_044_479, 1_044_479),
    "Moving Threshold": Rule(10, 0, 1_023),
    "Temperature Limit": Rule(80, 0, 100),
    "Max Voltage Limit": Rule(160, 95, 160),
    "Min Voltage Limit": Rule(95, 95, 160),
    "PWM Limit": Rule(885, 0, 885),
    "Current Limit": Rule(1_193, 0, 1_193),
    "Velocity Limit": Rule(350, 0, 1_023),
    "Max Position Limit": Rule(4_095, 0, 4_095),
    "Min Position Limit": Rule(0, 0, 4_095),
    "Shutdown": Rule(52, 0, 255),
    "Torque Enable": Rule(0, 0, 1),
    "LED": Rule(0, 0, 1),
    "Status Return Level": Rule(2, 0, 2),
    "Registered Instruction": Rule(0),
    "Hardware Error Status": Rule(0),
    "Velocity I Gain": Rule(1_920, *_GAIN),
    "Velocity P Gain": Rule(100, *_GAIN),
    "Position D Gain": Rule(0, *_GAIN),
    "Position I Gain": Rule(0, *_GAIN),
    "Position P Gain": Rule(800, *_GAIN),
    "Feedforward 2nd Gain": Rule(0, *_GAIN),
    "Feedforward 1st Gain": Rule(0, *_GAIN),
    "Bus Watchdog": Rule(0, 0, 127),
    "Goal PWM": Rule(885, -885, 885),
    "Goal Current": Rule(1_193, -1_193, 1_193),
    "Goal Velocity": Rule(350, -1_023, 1_023),
    "Profile Acceleration": Rule(0, 0, 32_767),
    "Profile Velocity": Rule(0, 0, 32_767),
    "Goal Position": Rule(0, -EXTENDED_RANGE_TICKS, EXTENDED_RANGE_TICKS),
    "Realtime Tick": Rule(0),
    "Moving": Rule(0),
    "Moving Status": Rule(0),
    "Present PWM": Rule(0),
    "Present Current": Rule(0),
    "Present Velocity": Rule(0),
    "Present Position": Rule(0),
    "Velocity Trajectory": Rule(0),
    "Position Trajectory": Rule(0),
    "Present Input Voltage": Rule(0),
    "Present Temperature": Rule(0),
}

# e-manual, the model's own page, where it differs from the above.
_OWN: Mapping[str, Mapping[str, Rule]] = {
    "XM430-W350": {"Model Number": Rule(1_020)},
    "XL330-M288": {
        "Model Number": Rule(1_200),
        "Baud Rate": Rule(1, 0, 6),
        "Temperature Limit": Rule(70, 0, 100),
        "Max Voltage Limit": Rule(70, 31, 70),
        "Min Voltage Limit": Rule(35, 31, 70),
        "Current Limit": Rule(1_750, 0, 1_750),
        "Velocity Limit": Rule(445, 0, 2_047),
        "PWM Slope": Rule(140, 1, 255),
        "Shutdown": Rule(53, 0, 255),
        "Velocity I Gain": Rule(1_600, *_GAIN),
        "Velocity P Gain": Rule(180, *_GAIN),
        "Position P Gain": Rule(400, *_GAIN),
        "Goal Current": Rule(1_750, -1_750, 1_750),
        "Goal Velocity": Rule(445, -2_047, 2_047),
    },
}

MODELS = tuple(_OWN)
"""Servo models that can be simulated."""


def rules(model: str) -> dict[str, Rule]:
    """Register rules of a model by the SDK's register names.

    Raises:
        ControlTableError: the model cannot be simulated.

    """
    if model not in _OWN:
        raise ControlTableError(f"{model}: not simulated; those that are: {', '.join(MODELS)}")
    return {**_X_SERIES, **_OWN[model]}
