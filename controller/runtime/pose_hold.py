"""A run whose pose is lost: the motion slows down and holds, and the run ends as failed."""

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any, Literal

CAUTIOUS = 0.5
"""Rate of the motion before a source has agreed with the joints (ours)."""
SLOW_S = 0.5
"""Time in which the motion comes to rest, and starts again (ours)."""


@dataclass(frozen=True, slots=True)
class PoseHealth:
    """Whether a pose source can be trusted, and what a run does without it."""

    fault: Callable[[], str | None]
    """Why the pose cannot be trusted in this cycle; None while it can."""
    hold_s: float
    """Longest time for which a run without a pose holds."""
    row: Callable[[], dict[str, Any]]
    """State of the source, as ``PoseSourceTable`` logs it."""
    is_cautious: Callable[[], bool] = lambda: False
    """Whether the motion should be slow until the source has agreed with the joints."""


@dataclass(slots=True)
class PoseHold:
    """Call ``rate`` in each cycle."""

    health: PoseHealth
    on_event: Callable[[Literal["info", "warning"], str], None]
    """Accepts level and text of an event."""
    failure: str | None = None
    """Reason for the run's end; None while it may continue."""
    _rate: float = field(default=1.0, init=False)
    _began_s: float | None = field(default=None, init=False)

    @property
    def is_held(self) -> bool:
        """Whether the motion rests."""
        return self._began_s is not None and self._rate == 0.0

    def rate(self, now_s: float, period_s: float) -> float:
        """Return the rate of the motion, from 1 to 0 without a pose."""
        fault = self.health.fault()
        if fault is not None and self._began_s is None:
            self._began_s = now_s
            self.on_event(
                "warning", f"{fault}; the motion pauses for up to {self.health.hold_s:g} s"
            )
        elif fault is None and self._began_s is not None:
            self.on_event("info", f"the pose is back after {now_s - self._began_s:.1f} s")
            self._began_s = None
        since_s = self._began_s
        if since_s is not None and now_s - since_s >= self.health.hold_s:
            self.failure = f"pose: {fault}"
        step = period_s / SLOW_S
        most = CAUTIOUS if self.health.is_cautious() else 1.0
        target_rate = most if fault is None else 0.0
        self._rate += min(max(target_rate - self._rate, -step), step)
        return self._rate
