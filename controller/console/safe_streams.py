"""Standard streams that accept every text, also with a poor encoding or without a descriptor."""

import io
import os
import sys
from contextlib import suppress
from typing import IO, Any, Final

_FAILING: Final = {"strict", "surrogateescape"}
"""Error handlers that raise for a character which the encoding lacks."""


def make_streams_safe() -> None:
    """Open closed standard streams as the null device; escape characters that output lacks.

    A closed descriptor is opened before any file, so that a file or port never becomes the standard
    output of this program.
    """
    for name, mode in (("stdin", "r"), ("stdout", "w"), ("stderr", "w")):
        stream = getattr(sys, name)
        if stream is None:
            setattr(sys, name, _null(mode))
        elif mode == "w" and isinstance(stream, io.TextIOWrapper) and stream.errors in _FAILING:
            with suppress(OSError):  # a stream over a pipe may want to seek
                stream.reconfigure(errors="backslashreplace")


def _null(mode: str) -> IO[Any]:
    """Open the null device at the lowest free descriptor, for child processes too."""
    descriptor = os.open(os.devnull, os.O_RDWR)
    os.set_inheritable(descriptor, True)
    return open(descriptor, mode, encoding="utf-8", errors="backslashreplace", closefd=False)
