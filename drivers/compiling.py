"""Loops compiled for one signature where numba is installed; else they run as they stand.

Compiled when the module with the loop is imported, never at its first call: a bus that stops for a
second to compile has missed fifty cycles. Later imports take the machine code from numba's cache.
"""

from collections.abc import Callable
from importlib.util import find_spec
from typing import Any, TypeVar

F = TypeVar("F", bound=Callable[..., object])
COMPILES = find_spec("numba") is not None
"""Whether loops are compiled here."""


def seen(number: str = "float64", dimensions: int = 1, layout: str = "A") -> str:
    """Name of an array that is only read, as numba writes it; "A" is any layout, "C" no gaps."""
    return f"Array({number}, {dimensions}, '{layout}', readonly=True)"


def compiled(signature: Any, *, nogil: bool = False) -> Callable[[F], F]:
    """Compile for ``signature``, or hand the function back where numba is not installed.

    Args:
        signature: a numba type, or its name as numba writes it, for modules that do without numba.
        nogil: let other threads run meanwhile; worth its cost for a loop that waits.

    """

    def decorate(function: F) -> F:
        if not COMPILES:
            return function
        from numba import njit  # noqa: PLC0415  optional and slow

        made: F = njit(signature, nogil=nogil, cache=True)(function)
        return made

    return decorate
