"""Slip monitor: an alarm where the shape travels and the body does not (docs/method.md)."""

import math
from dataclasses import dataclass

NOISE_SD = 3.0
"""Standard deviations of its noise by which a displacement must be too small (ours)."""


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

    def __init__(
        self, length_m: float, gain: float, fraction: float, pose_sd_m: float = 0.0
    ) -> None:
        """Set the expected speed.

        Args:
            length_m: body length; a window closes when the shape has travelled so far.
            gain: predicted body speed over pulse speed, eta_q.
            fraction: share of the predicted displacement below which the alarm is raised.
            pose_sd_m: standard deviation of a measured position. Two of them are in a displacement.

        """
        self._length_m = length_m
        self._gain = gain
        self._fraction = fraction
        self._margin_m = NOISE_SD * math.sqrt(2.0) * pose_sd_m
        self._pulse_m = 0.0
        self._displacement_m = 0.0
        self.window: SlipWindow | None = None
        """Last full window of the monitor."""

    def update(self, pulse_m: float, displacement_m: float) -> bool:
        """Add one cycle; return whether a window has just closed with too small a share."""
        self._displacement_m += displacement_m
        self._pulse_m += pulse_m
        if self._pulse_m < self._length_m:
            return False
        self.window = SlipWindow(self._displacement_m, self._gain * self._pulse_m)
        self._pulse_m = self._displacement_m = 0.0
        least_m = self._fraction * self.window.predicted_m - self._margin_m
        return bool(self.window.measured_m < least_m)
