"""Loops compiled by numba for one signature, when their module is imported.

Never at the first call: a bus that stops for a second to compile has missed fifty cycles. Later
imports load the machine code from numba's cache.

A package of the base install that may be absent all the same: a light install of the test fixture
has no numba (docs/start/ci.md), and runs the loops as they are written.
"""

import sys
from array import array
from collections.abc import Callable
from functools import cache
from typing import Any, TypeVar

import numpy as np

from snakewalk.drivers.compilation import report_compiled
from snakewalk.drivers.fallbacks import is_forced, report_fallback

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

    Without numba the function itself is returned: modules that drive servos use numba's types in
    their signatures, and they are not imported in that case.

    Args:
        signature: a numba type, or its name, for modules that do not import numba themselves.
        nogil: release Python's lock meanwhile; worth its cost for a loop that waits.
        divides_by_zero: a division by zero is infinite, not an error; without the question for it
            a loop is made for several numbers at once.
        makes_arrays: False for a loop that only reads and writes the arrays it is given. Numba then
            counts no references, which would need as much time as a short loop. A loop that makes
            an array in spite of it does not compile. If numba has no such option, all loops count
            references: the results have the same bits.

    """

    def decorate(function: F) -> F:
        numba = _numba()
        if numba is None:
            return function
        model = "numpy" if divides_by_zero else "python"
        options: dict[str, Any] = {}
        if not makes_arrays and _can_skip_counting():
            options = _UNCOUNTED
        # numba's cache does not know the options: a forced fallback would share its files
        cached = makes_arrays or not is_forced("numba")
        made: F = numba.njit(signature, nogil=nogil, error_model=model, cache=cached, **options)(
            function
        )
        stats = getattr(made, "stats", None)
        if cached and stats is not None and stats.cache_misses:
            report_compiled(f"{function.__module__}.{function.__name__}")
        return made

    return decorate


def is_compiling() -> bool:
    """Whether loops are compiled; without numba they run as they are written."""
    return _numba() is not None


def callable_in_loops(function: F) -> F:
    """Let compiled loops call a function that also runs as it is written."""
    numba = _numba()
    if numba is None:
        return function
    registered: F = numba.extending.register_jitable(function)
    return registered


def _numba() -> Any:
    """Return the package numba; None in a light install."""
    try:
        import numba  # noqa: PLC0415  slow to import, and a light install has none
    except ModuleNotFoundError as error:
        if error.name != "numba":
            raise
        return None
    return numba


_UNCOUNTED = {"_nrt": False}
"""Numba's option that leaves out the counting of references. It is private to numba."""


def _doubled(values: Any) -> float:
    """Double the values behind the first; return the sum of a view of them."""
    total = 0.0
    behind = values[1:]
    for k in range(len(behind)):
        behind[k] *= 2.0
        total += behind[k]
    return total


@cache
def _can_skip_counting() -> bool:
    """Whether numba accepts ``_UNCOUNTED`` and compiles a small loop correctly with it."""
    numba = _numba()
    if is_forced("numba"):
        fault = "the environment asks for it"
    else:
        try:
            loop = numba.njit("float64(float64[::1])", cache=True, **_UNCOUNTED)(_doubled)
            memory = array("d", [1.0, 2.0, 3.0])
            values = np.frombuffer(memory)
            before = sys.getrefcount(memory), sys.getrefcount(values)
            total = loop(values)
            if (
                total == 10.0
                and memory.tolist() == [1.0, 4.0, 6.0]
                and before == (sys.getrefcount(memory), sys.getrefcount(values))
            ):
                return True
            fault = "a loop with its option _nrt is wrong"
        except Exception as error:  # an unknown option is a KeyError, or whatever numba makes of it
            fault = f"its option _nrt is not usable ({type(error).__name__})"
    report_fallback(
        "numba",
        f"numba {numba.__version__}: loops count references to arrays, about 2 % slower, because "
        f"{fault}; install a version that snakewalk's metadata names",
    )
    return False


def inlined(function: F) -> F:
    """Have numba write a function out where a compiled one calls it.

    A loop around it is then made for several numbers at once. It has no types of its own; without
    numba, and outside of compiled functions, it is called as it is written.
    """
    numba = _numba()
    if numba is None:
        return function
    made: F = numba.njit(inline="always")(function)
    return made
