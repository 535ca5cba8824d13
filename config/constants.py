"""Constants that several packages share."""

from typing import Literal

GRAVITY_M_S2 = 9.81
"""Value for simulated physics, forecasts and metrics; the standard 9.80665 is 0.03 % less."""
DEFAULT_ROBOT = "yaw16"
"""Shipped robot of a run or a command that names none."""
DEFAULT_WORLD = "flat"
"""Shipped world of a run or a command that names none."""
DEFAULT_SERVO_MODEL = "XM430-W350"
"""Servo model of a robot that names none."""
DEFAULT_BAUD: Literal[1_000_000] = 1_000_000
"""Baud rate of a bus in bit/s, if nothing else is known."""
LOOK = "servos"
"""Look of the body in a film that names none."""
