"""Loops compiled by numba for one signature, when their module is imported.

A compilation at the first call would stop the bus for a second. Later imports load the machine code
from numba's cache.
A light install of the test fixture has no numba (docs/start/ci.md), and runs the loops as Python.
"""

import sys
from array import array
from collections.abc import Callable
from contextlib import suppress
from functools import cache
from typing import Any, TypeVar

import numpy as np

from snakewalk.drivers.compilation import report_compiled
from snakewalk.drivers.fallbacks import is_forced, report_fallback

F = TypeVar("F", bound=Callable[..., object])
_CALLABLE: set[Callable[..., object]] = set()
"""Functions that loops may call."""


def readonly_array(number: str = "float64", dimensions: int = 1, layout: str = "A") -> str:
    """Numba's name of a read-only array; layout "A" is any, "C" is contiguous."""
    return f"Array({number}, {dimensions}, '{layout}', readonly=True)"


def compiled(
    signature: Any,
    *,
    nogil: bool = False,
    divides_by_zero: bool = False,
    makes_arrays: bool = True,
    fastmath: bool = False,
) -> Callable[[F], F]:
    """Compile a function for ``signature``; ``py_func`` is the original.

    Without numba the function itself is returned.

    Args:
        signature: a numba type, or its name, for modules that do not import numba.
        nogil: release Python's lock; worth its cost for a loop that waits.
        divides_by_zero: a division by zero is infinite, not an error; without this check a loop can
            be vectorised.
        makes_arrays: False for a loop that only uses given arrays. Numba then counts no references,
            which would need as much time as a short loop. Such a loop does not compile if it makes
            an array. If numba lacks the option, all loops count references, with the same bits as
            results.
        fastmath: let sums be reordered, so that they can be vectorised; NaN is not expected.

    """

    def decorate(function: F) -> F:
        numba = _numba()
        if numba is None:
            return function
        model = "numpy" if divides_by_zero else "python"
        options: dict[str, Any] = {"fastmath": True} if fastmath else {}
        if not makes_arrays and _can_skip_counting():
            options |= _NO_REFERENCE_COUNTS
        # numba's cache does not know the options: a forced fallback would share its files
        cached = makes_arrays or not is_forced("numba")
        jitted: F = _dispatcher(
            function, signature, cached=cached, nogil=nogil, error_model=model, **options
        )
        stats = getattr(jitted, "stats", None)
        if cached and stats is not None and stats.cache_misses:
            report_compiled(f"{function.__module__}.{function.__name__}")
        return jitted

    return decorate


def compiled_when_called(function: F) -> F:
    """Compile a function of the physics for the types of its first call; it is cached."""
    return _dispatcher(function, None, cached=True, error_model="numpy")


def _dispatcher(function: F, signature: Any, *, cached: bool, **options: Any) -> F:
    """Return numba's dispatcher of a function, compiled if a signature is given."""
    jitted: Any = _numba().njit(**options)(function)
    if jitted is function:  # NUMBA_DISABLE_JIT=1
        return function
    if cached:
        jitted._cache = _cache_of(jitted)
    if signature is not None:
        jitted.compile(signature)
        jitted.disable_compile()
    loop: F = jitted
    return loop


def _cache_of(loop: Any) -> Any:
    """Return the cache of a dispatcher; numba's own, or none, if its private classes differ."""
    try:
        from snakewalk.drivers.loop_cache import LoopCache  # noqa: PLC0415  numba may be missing

        return LoopCache(loop.py_func)
    except (ImportError, AttributeError, TypeError) as error:
        report_fallback(
            "cache",
            f"loops are cached only in numba's own folders ({type(error).__name__}: {error}); "
            "install a version of numba that snakewalk's metadata names",
        )
    with suppress(RuntimeError):  # no folder is writable
        loop.enable_caching()
    return loop._cache


def is_compiling() -> bool:
    """Whether loops are compiled; without numba they run as Python."""
    return _numba() is not None


def callable_in_loops(function: F) -> F:
    """Let compiled loops call a Python function; several packages may ask for the same one."""
    numba = _numba()
    if numba is not None and function not in _CALLABLE:
        _CALLABLE.add(function)
        numba.extending.register_jitable(function)
    return function


def _check_memory() -> None:
    """Reject a limit of memory at which loading numba never ends.

    Raises:
        MemoryError: OpenBLAS, which SciPy loads, then asks again for ever.

    """
    if sys.platform == "win32" or "numba" in sys.modules:
        return
    import resource  # noqa: PLC0415  Unix has it

    limit_bytes, _ = resource.getrlimit(resource.RLIMIT_AS)
    if limit_bytes != resource.RLIM_INFINITY and limit_bytes < _LEAST_MEMORY_BYTES:
        raise MemoryError


def _numba() -> Any:
    """Return the package numba; None in a light install."""
    _check_memory()
    try:
        import numba  # noqa: PLC0415  slow to import, and missing in a light install
    except ModuleNotFoundError as error:
        if error.name != "numba":
            raise
        return None
    return numba


_LEAST_MEMORY_BYTES = 700 * 2**20
"""Least limit of memory: `plan` works at 780 MiB and fails at 586 (ours)."""
_NO_REFERENCE_COUNTS = {"_nrt": False}
"""Numba's option that leaves out the counting of references. It is private to numba."""


def _double(values: Any) -> float:
    total = 0.0
    behind = values[1:]
    for k in range(len(behind)):
        behind[k] *= 2.0
        total += behind[k]
    return total


@cache
def _can_skip_counting() -> bool:
    """Whether numba accepts ``_NO_REFERENCE_COUNTS`` and compiles a small loop correctly."""
    numba = _numba()
    if is_forced("numba"):
        fault = "the environment asks for it"
    else:
        try:
            loop = _dispatcher(
                _double, "float64(float64[::1])", cached=True, **_NO_REFERENCE_COUNTS
            )
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
        except Exception as error:  # an unknown option is a KeyError, or another exception of numba
            fault = f"its option _nrt is not usable ({type(error).__name__})"
    report_fallback(
        "numba",
        f"numba {numba.__version__}: loops count references to arrays, about 2 % slower, because "
        f"{fault}; install a version that snakewalk's metadata names",
    )
    return False


def inlined(function: F) -> F:
    """Inline a function into compiled callers, so that their loops can be vectorised.

    It has no types of its own. Without numba, and outside of compiled functions, it is plain
    Python.
    """
    numba = _numba()
    if numba is None:
        return function
    jitted: F = numba.njit(inline="always")(function)
    return jitted
