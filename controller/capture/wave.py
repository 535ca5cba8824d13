"""Which way the body wave runs, how long it is, and how fast: one number each for a recording."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.signal import hilbert

from controller.capture.track import Track

Floats = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class Wave:
    """The strongest travelling pattern of the curvature."""

    waves: float
    """Wavelengths on the body."""
    frequency_hz: float
    """How often a wave passes a point of the body."""
    towards_tail: bool
    """The direction of an animal that moves forward."""
    share: float
    """Part of the curvature's energy that this pattern explains, 0..1."""

    @property
    def pulse_body_lengths_s(self) -> float:
        """Signed speed of the pattern along the body, positive towards the tail ([PT] 2.4, U)."""
        speed = self.frequency_hz / max(self.waves, 1e-9)
        return speed if self.towards_tail else -speed


def measure_wave(track: Track) -> Wave:
    """Fit one travelling wave: first complex principal component of the analytic curvature.

    Its phase falls along the body when the wave runs from head to tail; the slope is the number of
    waves. A reversal within the recording lowers ``share``.
    """
    even = np.arange(track.time_s[0], track.time_s[-1] + 0.5 / track.rate_hz, 1.0 / track.rate_hz)
    angles = np.stack([np.interp(even, track.time_s, column) for column in track.angles_rad.T])
    curvature = np.gradient(angles, axis=0).T
    analytic = np.asarray(hilbert(curvature - curvature.mean(axis=0), axis=0))
    energy, modes = np.linalg.eigh(analytic.T @ analytic.conj())
    mode = modes[:, -1]
    s = (np.arange(len(mode)) + 0.5) / len(mode)
    slope = np.polyfit(s, np.unwrap(np.angle(mode)), 1, w=np.abs(mode))[0] / (2.0 * np.pi)
    turned = np.unwrap(np.angle(analytic @ mode.conj()))
    frequency = float(np.median(np.diff(turned))) * track.rate_hz / (2.0 * np.pi)
    return Wave(
        waves=float(abs(slope)),
        frequency_hz=abs(frequency),
        towards_tail=bool(slope * frequency < 0.0),
        share=float(energy[-1] / energy.sum()),
    )
