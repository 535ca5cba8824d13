"""Simulated time: it passes only when somebody waits for it."""


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
