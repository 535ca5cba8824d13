"""Compilation of a typed function for one signature, at import; needs numba."""

from collections.abc import Callable
from typing import Any, TypeVar

from numba import njit

F = TypeVar("F", bound=Callable[..., object])


def compiled(signature: Any) -> Callable[[F], F]:
    """Compile for ``signature`` (a numba type) now, or take it from the cache; runs without GIL."""

    def decorate(function: F) -> F:
        made: F = njit(signature, nogil=True, cache=True)(function)
        return made

    return decorate
