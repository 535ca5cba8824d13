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
"""Colours by their names, as ``column.Curve`` uses them."""
SERIES: Final = (BLUE, RED, GREEN, AMBER, PURPLE, SKY, INK, GREY)
"""Colours of things of one kind, in this order: runs, robots, joints."""
LOWLAND: Final = "#606e46"
HIGHLAND: Final = "#d6c098"
"""Colours of the lowest and the highest ground; higher places are lighter."""

MEASURED: Final = BLUE
"""Colour of measured or simulated values."""
GOAL: Final = AMBER
"""Colour of goals that are sent to servos, and of predictions."""
ASKED: Final = GREY
"""Colour of values that the motion asks for, before the safety layer."""
PATH: Final = INK
TO_COME: Final = RED
"""Colour of waypoints that are not reached."""
REACHED: Final = GREEN
HIGHEST: Final = RED
"""Colour of the joint or servo with the highest value."""
MEAN: Final = SKY
"""Colour of the mean of all joints, or all servos."""
SUPPLY: Final = AMBER
WARNING: Final = AMBER
FAULT: Final = RED


CENTRE: Final = BLUE
"""Colour of the track of the body's centre."""
HEAD: Final = SKY
"""Colour of the track of the head."""


def rgb(colour: str) -> tuple[int, int, int]:
    """Return red, green and blue of ``#rrggbb``, each from 0 to 255."""
    red, green, blue = bytes.fromhex(colour.removeprefix("#"))
    return red, green, blue


def rgba(colour: str, opacity: float = 1.0) -> tuple[float, float, float, float]:
    """Return red, green, blue and opacity of ``#rrggbb``, each from 0 to 1."""
    red, green, blue = rgb(colour)
    return red / 255.0, green / 255.0, blue / 255.0, opacity
