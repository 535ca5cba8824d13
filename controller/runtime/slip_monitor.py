"""Slip monitor: an alarm where the shape travels and the body does not (docs/method.md)."""

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class SlipWindow:
    """One window: a body length of travel of the shape."""

    measured_m: float
    """Displacement of the links along themselves, mean over the body."""
    predicted_m: float

    @property
    def share(self) -> float:
        """Measured over predicted displacement."""
        return self.measured_m / self.predicted_m


class SlipMonitor:
    """Compares displacements of the body and of its shape, a body length of the shape at a time."""

    def __init__(self, length_m: float, gain: float, fraction: float) -> None:
        """Set what is expected.

        Args:
            length_m: body length; a window closes when the shape has travelled so far.
            gain: predicted body speed over pulse speed, eta_q.
            fraction: share of the predicted displacement below which the alarm is raised.

        """
        self._length_m = length_m
        self._gain = gain
        self._fraction = fraction
        self._pulse_m = 0.0
        self._displacement_m = 0.0
        self.window: SlipWindow | None = None
        """The last full window."""

    def update(self, pulse_m: float, displacement_m: float) -> bool:
        """Add one cycle; return whether a window has just closed with too small a share."""
        self._displacement_m += displacement_m
        self._pulse_m += pulse_m
        if self._pulse_m < self._length_m:
            return False
        self.window = SlipWindow(self._displacement_m, self._gain * self._pulse_m)
        self._pulse_m = self._displacement_m = 0.0
        return bool(self.window.share < self._fraction)
