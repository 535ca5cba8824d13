"""Loops compiled by numba for one signature, when their module is imported.

Never at the first call: a bus that stops for a second to compile has missed fifty cycles. Later
imports take the machine code from numba's cache.

A package of the base install that may be absent all the same: a light install of the test fixture
has no numba (docs/start/ci.md), and runs the loops as they are written.
"""

from collections.abc import Callable
from typing import Any, TypeVar

F = TypeVar("F", bound=Callable[..., object])


def readonly_array(number: str = "float64", dimensions: int = 1, layout: str = "A") -> str:
    """Numba's name of an array that is only read; layout "A" is any, "C" is contiguous."""
    return f"Array({number}, {dimensions}, '{layout}', readonly=True)"


def compiled(
    signature: Any,
    *,
    nogil: bool = False,
    divides_by_zero: bool = False,
    makes_arrays: bool = True,
) -> Callable[[F], F]:
    """Compile a function for ``signature``; the function as written is its ``py_func``.

    Without numba the function itself is given back: what drives servos names numba's types for its
    signatures, and is not imported then.

    Args:
        signature: a numba type, or its name, for modules that do not import numba themselves.
        nogil: release Python's lock meanwhile; worth its cost for a loop that waits.
        divides_by_zero: a division by zero is infinite, not an error; without the question for it
            a loop is made for several numbers at once.
        makes_arrays: False of a loop that only reads and writes what it is given: none of it is
            counted then, which takes as long as a short loop over it. What makes an array all the
            same is not compiled. Of numba's options the one without a page.

    """

    def decorate(function: F) -> F:
        try:
            from numba import njit  # noqa: PLC0415  slow to import
        except ModuleNotFoundError as error:
            if error.name != "numba":
                raise
            return function
        model = "numpy" if divides_by_zero else "python"
        made: F = njit(signature, nogil=nogil, error_model=model, cache=True, _nrt=makes_arrays)(
            function
        )
        return made

    return decorate


def inlined(function: F) -> F:
    """Have numba write a function out where a compiled one calls it.

    A loop around it is then made for several numbers at once. It has no types of its own; without
    numba, and outside of compiled functions, it is called as it is written.
    """
    try:
        from numba import njit  # noqa: PLC0415  slow to import
    except ModuleNotFoundError as error:
        if error.name != "numba":
            raise
        return function
    made: F = njit(inline="always")(function)
    return made
