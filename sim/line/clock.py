"""Simulated time: it passes only while a caller waits for it, or as real time does."""

from snakewalk.drivers.clock import WallClock


class SimClock:
    """A ``drivers.clock.Clock`` that jumps; the simulated line moves it while bytes are awaited."""

    def __init__(self, start_s: float = 0.0) -> None:
        self._now_s = start_s

    def now_s(self) -> float:
        """Seconds of simulated time."""
        return self._now_s

    def sleep_until_s(self, time_s: float) -> None:
        """Jump to ``time_s``; nothing happens if that is past, so time never runs back."""
        self._now_s = max(self._now_s, time_s)

    def advance(self, seconds: float) -> None:
        """Let ``seconds`` pass.

        Raises:
            ValueError: negative ``seconds``.

        """
        if seconds < 0.0:
            raise ValueError(f"time does not run back ({seconds} s)")
        self._now_s += seconds


class RealTimeClock(SimClock):
    """Simulated time that is real time, from 0 on: for servos that share a bus with real ones.

    A wait of the host is a real wait; physics catches up whenever the line is used.
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
