"""Baud rates and their codes in register 8.

Source: e-manual, Baud Rate(8) of the X and MX(2.0) series; XL330 and XC330 end at 4 Mbit/s.
"""

from drivers.errors import ControlTableError

BAUDS = (9_600, 57_600, 115_200, 1_000_000, 2_000_000, 3_000_000, 4_000_000, 4_500_000)
"""By code."""
FACTORY_BAUD = 57_600
_UP_TO_4M = ("XL330", "XC330")
_ALL = ("XL430", "XC430", "XM", "XH", "XD", "XW", "MX", "2X")


def bauds_of(model: str) -> tuple[int, ...]:
    """Baud rates of a model, by code.

    Raises:
        ControlTableError: its series is not known here.

    """
    if model.startswith(_UP_TO_4M):
        return BAUDS[:-1]
    if model.startswith(_ALL):
        return BAUDS
    raise ControlTableError(f"{model}: baud rate codes not known; known are the X and MX series")


def baud_code(model: str, baud: int) -> int:
    """Value of register 8.

    Raises:
        ControlTableError: the model does not have that rate.

    """
    rates = bauds_of(model)
    if baud not in rates:
        shown = ", ".join(map(str, rates))
        raise ControlTableError(f"{baud} baud: a {model} has {shown}")
    return rates.index(baud)
