"""The clock interface, and the wall clock; no other module reads the time."""

import time
from typing import Protocol


class Clock(Protocol):
    """A monotonic clock that can also wait."""

    def now_s(self) -> float:
        """Seconds since the clock's own zero."""
        ...

    def sleep_until_s(self, time_s: float) -> None:
        """Return when ``now_s() >= time_s``."""
        ...


class WallClock:
    """Real time, monotonic, zero at creation."""

    def __init__(self) -> None:
        self.zero_s = time.monotonic()
        """Zero of the clock, in the time of the machine's monotonic clock."""

    def now_s(self) -> float:
        """Seconds since creation."""
        return time.monotonic() - self.zero_s

    def sleep_until_s(self, time_s: float) -> None:
        """Sleep until ``time_s``."""
        wait_s = time_s - self.now_s()
        if wait_s > 0.0:
            time.sleep(wait_s)
