"""One colour per quantity, in figures, report, live page and film.

The colour-blind safe palette of M. Okabe and K. Ito (Color Universal Design, 2008) with a dark and
two grey tones.
"""

from typing import Final

INK: Final = "#22303c"
GREY: Final = "#8796a5"
PALE: Final = "#d9e0e6"
BLUE: Final = "#0072b2"
SKY: Final = "#56b4e9"
GREEN: Final = "#009e73"
AMBER: Final = "#e69f00"
RED: Final = "#d55e00"
PURPLE: Final = "#a4508b"
COLOURS: Final = {
    "ink": INK,
    "grey": GREY,
    "pale": PALE,
    "blue": BLUE,
    "sky": SKY,
    "green": GREEN,
    "amber": AMBER,
    "red": RED,
    "purple": PURPLE,
}
"""The palette by name, as ``column.Curve`` uses it."""
SERIES: Final = (BLUE, RED, GREEN, AMBER, PURPLE, SKY, INK, GREY)
"""Colours of things of one kind, in this order: runs, robots, joints."""
LOWLAND: Final = "#606e46"
HIGHLAND: Final = "#d6c098"
"""Lowest and highest ground; places between are lighter the higher they are."""

MEASURED: Final = BLUE
"""Measured or simulated values."""
GOAL: Final = AMBER
"""Goals that are sent to servos, and predictions."""
ASKED: Final = GREY
"""Values that the motion asks for, before the safety layer."""
PATH: Final = INK
TO_COME: Final = RED
"""Waypoints that are not reached."""
REACHED: Final = GREEN
HIGHEST: Final = RED
"""The joint or servo with the highest value."""
MEAN: Final = SKY
"""Mean of all joints, or all servos."""
SUPPLY: Final = AMBER
WARNING: Final = AMBER
FAULT: Final = RED


CENTRE: Final = BLUE
"""Track of the body's centre."""
HEAD: Final = SKY
"""Track of the head."""


def rgb(colour: str) -> tuple[int, int, int]:
    """Return red, green and blue of ``#rrggbb``, each from 0 to 255."""
    red, green, blue = bytes.fromhex(colour.removeprefix("#"))
    return red, green, blue


def rgba(colour: str, opacity: float = 1.0) -> tuple[float, float, float, float]:
    """Return red, green, blue and opacity of ``#rrggbb``, each from 0 to 1."""
    red, green, blue = rgb(colour)
    return red / 255.0, green / 255.0, blue / 255.0, opacity
