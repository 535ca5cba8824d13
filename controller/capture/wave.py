"""The body wave of a recording: its direction, length and speed, one number each."""

from dataclasses import dataclass

import numpy as np
from scipy.ndimage import gaussian_filter1d
from scipy.signal import hilbert

from snakewalk.config.arrays import Floats
from snakewalk.controller.capture.track import Track


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
    headward: float
    """Part of the time in which the pattern ran towards the head: backward crawling, or a file that
    lists the tail first."""

    @property
    def pulse_body_lengths_s(self) -> float:
        """Signed speed of the pattern along the body, positive towards the tail ([PT] 2.4, U)."""
        speed = self.frequency_hz / max(self.waves, 1e-9)
        return speed if self.towards_tail else -speed


def measure_wave(track: Track) -> Wave:
    """Fit one travelling wave: first complex principal component of the analytic curvature.

    Its phase falls along the body when the wave runs from head to tail; the slope is the number of
    waves. A reversal within the recording lowers ``share`` and is counted in ``headward``.
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
        headward=_headward(curvature, track.rate_hz / max(abs(frequency), 1e-9)),
    )


def _headward(curvature: Floats, cycle: float) -> float:
    """Part of the frames (T, N) whose pulse speed is negative, [PT] 2.4 over the whole body.

    Least squares of ``curvature_t = -U curvature_s``, its two sums taken over a quarter of a cycle
    around each frame, as a single frame's difference is mostly noise.
    """
    smooth = gaussian_filter1d(curvature, 3.0, axis=1)
    in_time, along = np.gradient(smooth, axis=0), np.gradient(smooth, axis=1)
    pulse = gaussian_filter1d(-(in_time * along).sum(axis=1), min(cycle, len(curvature)) / 8.0)
    return float((pulse < 0.0).mean())
