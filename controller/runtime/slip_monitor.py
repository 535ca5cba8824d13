"""The alarm for missing advance: the shape travels, the body does not (docs/method.md)."""

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Advance:
    """One window of a body length of pulse."""

    measured_m: float
    """Way of the links along themselves, mean over the body."""
    predicted_m: float

    @property
    def share(self) -> float:
        """Measured over predicted."""
        return self.measured_m / self.predicted_m


class AdvanceWatch:
    """Compares the way of the body with the way of its shape, a body length of pulse at a time."""

    def __init__(self, length_m: float, gain: float, fraction: float) -> None:
        """Set what is expected.

        Args:
            length_m: body length, the window of pulse travel.
            gain: predicted body speed over pulse speed, 0.93 eta_q.
            fraction: alarm when the share falls below.

        """
        self._length_m = length_m
        self._gain = gain
        self._fraction = fraction
        self._pulse_m = 0.0
        self._way_m = 0.0
        self.window: Advance | None = None
        """The last full window."""

    def update(self, pulse_m: float, way_m: float) -> bool:
        """Add one cycle; true when a window has just closed below the wanted share."""
        self._way_m += way_m
        self._pulse_m += pulse_m
        if self._pulse_m < self._length_m:
            return False
        self.window = Advance(self._way_m, self._gain * self._pulse_m)
        self._pulse_m = self._way_m = 0.0
        return self.window.share < self._fraction
