"""One colour per quantity, in figures, report, live page and film.

The colour-blind safe palette of M. Okabe and K. Ito (Color Universal Design, 2008) with a dark and
two grey tones.
"""

INK = "#22303c"
GREY = "#8796a5"
PALE = "#d9e0e6"
BLUE = "#0072b2"
SKY = "#56b4e9"
GREEN = "#009e73"
AMBER = "#e69f00"
RED = "#d55e00"
PURPLE = "#a4508b"
COLOURS = {
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
SERIES = (BLUE, RED, GREEN, AMBER, PURPLE, SKY, INK, GREY)
"""Colours of things of one kind, in this order: runs, robots, joints."""
LOWLAND = "#606e46"
HIGHLAND = "#d6c098"
"""Colours of the lowest and the highest ground; higher places are lighter."""

MEASURED = BLUE
"""Colour of measured or simulated values."""
GOAL = AMBER
"""Colour of goals that are sent to servos, and of predictions."""
ASKED = GREY
"""Colour of values that the motion asks for, before the safety layer."""
PATH = INK
TO_COME = RED
"""Colour of waypoints that are not reached."""
REACHED = GREEN
SUPPLY = AMBER
WARNING = AMBER
FAULT = RED


CENTRE = BLUE
"""Colour of the track of the body's centre."""
HEAD = PURPLE
"""Colour of the head, and of its track."""


def rgb(colour: str) -> tuple[int, int, int]:
    """Return red, green and blue of ``#rrggbb``, each from 0 to 255."""
    red, green, blue = bytes.fromhex(colour.removeprefix("#"))
    return red, green, blue


def rgba(colour: str, opacity: float = 1.0) -> tuple[float, float, float, float]:
    """Return red, green, blue and opacity of ``#rrggbb``, each from 0 to 1."""
    red, green, blue = rgb(colour)
    return red / 255.0, green / 255.0, blue / 255.0, opacity
