"""A simulated run held to real time, for an operator."""

from snakewalk.controller.runtime.guide import Guide
from snakewalk.drivers.clock import Clock, WallClock


class RealTime:
    """Holds a simulated run to the pace of a person's clock."""

    def __init__(self, clock: Clock | None = None) -> None:
        self._clock = clock or WallClock()
        self._ahead_s: float | None = None

    def cycle(self, time_s: float, pilot: Guide, speed_m_s: float) -> None:
        """Wait until the wall clock has come to the run's time."""
        if self._ahead_s is None:
            self._ahead_s = self._clock.now_s() - time_s
        self._clock.sleep_until_s(time_s + self._ahead_s)
