"""Simulated time: it passes only while a caller waits, or as real time."""

from snakewalk.drivers.clock import WallClock


class SimClock:
    """A ``drivers.clock.Clock`` that jumps; the simulated line moves it while bytes are awaited."""

    def __init__(self, start_s: float = 0.0) -> None:
        self._now_s = start_s

    def now_s(self) -> float:
        """Seconds of simulated time."""
        return self._now_s

    def sleep_until_s(self, time_s: float) -> None:
        """Jump to ``time_s``, never back."""
        self._now_s = max(self._now_s, time_s)

    def advance(self, seconds: float) -> None:
        """Advance by ``seconds``.

        Raises:
            ValueError: negative ``seconds``.

        """
        if seconds < 0.0:
            raise ValueError(f"time does not run back ({seconds} s)")
        self._now_s += seconds


class RealTimeClock(SimClock):
    """Simulated time that equals real time from 0: for a bus shared with real servos.

    The host really waits; physics catches up whenever the line is used.
    """

    def __init__(self) -> None:
        super().__init__()
        self._wall = WallClock()

    def now_s(self) -> float:
        """Seconds since creation."""
        return self._wall.now_s()

    def sleep_until_s(self, time_s: float) -> None:
        """Sleep until ``time_s``."""
        self._wall.sleep_until_s(time_s)

    def advance(self, seconds: float) -> None:
        """Sleep for ``seconds``."""
        self._wall.sleep_until_s(self._wall.now_s() + seconds)
