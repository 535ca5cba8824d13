"""Stop profile: a motion comes to rest in its present shape, because its own time slows down.

It can resume from rest, or during the stop, along the same profile.
"""

from snakewalk.controller.kinematics.smoothstep import cubic

STOP_S = 1.0


class StopProfile:
    """The rate of a motion's own time: 1 until ``stop``, and 0 from ``STOP_S`` after it."""

    def __init__(self) -> None:
        self._since_stop_s: float | None = None
        """Time since ``stop``; it runs backwards after ``go_on``."""
        self._is_resuming = False

    @property
    def begun(self) -> bool:
        """Whether ``stop`` has been called."""
        return self._since_stop_s is not None

    @property
    def over(self) -> bool:
        """Whether the motion rests."""
        return self._since_stop_s is not None and self._since_stop_s >= STOP_S

    @property
    def rate(self) -> float:
        """1 at full rate, 0 at rest."""
        return (
            1.0
            if self._since_stop_s is None
            else 1.0 - cubic(min(self._since_stop_s / STOP_S, 1.0))
        )

    def stop(self) -> None:
        """Slow down from now on."""
        self._is_resuming = False
        if self._since_stop_s is None:
            self._since_stop_s = 0.0

    def go_on(self) -> None:
        """Return to full rate from now on."""
        self._is_resuming = self._since_stop_s is not None

    def step(self, dt_s: float) -> float:
        """Advance by ``dt_s``; return the advance of the motion's own time, s."""
        if self._since_stop_s is None:
            return dt_s
        before = self.rate
        if self._is_resuming:
            self._since_stop_s = min(self._since_stop_s, STOP_S) - dt_s
            if self._since_stop_s <= 0.0:
                self._since_stop_s = None
                self._is_resuming = False
        else:
            self._since_stop_s += dt_s
        return 0.5 * (before + self.rate) * dt_s
