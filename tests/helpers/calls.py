"""Order in which functions of the program are called."""

import sys
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from types import FrameType
from typing import Any


@contextmanager
def calls_of(functions: Sequence[str]) -> Iterator[list[str]]:
    """Record the first call of each function, and the last return of ``end NAME``.

    Functions are qualified names without their module, so that a function may move.
    """
    last = {name.removeprefix("end ") for name in functions if name.startswith("end ")}
    first = {name for name in functions if not name.startswith("end ")}
    calls: list[str] = []

    def profile(frame: FrameType, event: str, argument: Any) -> None:
        name = frame.f_code.co_qualname
        if event == "call" and name in first and name not in calls:
            calls.append(name)
        elif event == "return" and name in last:
            end = f"end {name}"
            if end in calls:
                calls.remove(end)
            calls.append(end)

    before = sys.getprofile()
    sys.setprofile(profile)
    try:
        yield calls
    finally:
        sys.setprofile(before)
