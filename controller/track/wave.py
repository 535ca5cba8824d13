"""The body wave of a recording: its direction, length and speed, one number each."""

from dataclasses import dataclass

import numpy as np
from scipy.fft import fft, ifft
from scipy.ndimage import gaussian_filter1d

from snakewalk.config.arrays import Complexes, Floats
from snakewalk.controller.track.slowing import CUT_CYCLES
from snakewalk.controller.track.track import Track

LEAST_SHARE = 0.45
"""Of the bending: recorded animals that turn and reverse lie above 0.5, noise below 0.35."""
LEAST_FRAMES = 4.0
"""Frames a cycle: from 2 on a wave looks like another that runs the other way."""
LEAST_CYCLES = 2.0
"""In the recording: a wave by formula has its frequency within 1.5 % from here on."""
_SMOOTH = 4.0  # of 100 segments: a wave of half the body keeps 88 % of its size
_END = 8  # segments at either end whose smoothed curvature leans on what is not there
_NO_BEND = 1e-9  # rad a segment: a straight body that turns leaves rounding errors
_STEPS = 6  # until frequency and smoothing fit each other


@dataclass(frozen=True, slots=True)
class Wave:
    """The strongest travelling pattern of the curvature; ``not_told`` says whether it is a wave."""

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
    frames_a_cycle: float
    cycles: float
    """How many the recording lasts."""

    @property
    def coarse(self) -> bool:
        """Whether the frames are too far apart to see which way the pattern moved, and how far."""
        return self.frames_a_cycle < LEAST_FRAMES

    @property
    def not_told(self) -> str | None:
        """Why frequency, length and direction are no measurement; None where they are one."""
        if self.share < LEAST_SHARE:
            return (
                f"one wave is only {self.share:.0%} of the bending ({LEAST_SHARE:.0%} are needed): "
                "noise, or a body that bends otherwise"
            )
        if self.coarse:
            return (
                f"{self.frames_a_cycle:.1f} frames a cycle are too few ({LEAST_FRAMES:g} are "
                "needed): record at a higher rate"
            )
        if self.cycles < LEAST_CYCLES:
            return f"{self.cycles:.1f} cycles are too short a recording ({LEAST_CYCLES:g} needed)"
        return None

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
    curvature = _smooth_curvature(angles.T)
    analytic = _analytic(curvature - curvature.mean(axis=0))
    energy, modes = np.linalg.eigh(analytic.T @ analytic.conj())
    mode = modes[:, -1]
    s = np.arange(len(mode)) / len(angles)
    slope = np.polyfit(s, np.unwrap(np.angle(mode)), 1, w=np.abs(mode))[0] / (2.0 * np.pi)
    turns = _turns_a_frame(analytic @ mode.conj())
    cycle = 1.0 / max(abs(turns), 1e-9)
    bends = float(np.abs(curvature - curvature.mean(axis=0)).max()) > _NO_BEND
    return Wave(
        waves=float(abs(slope)),
        frequency_hz=abs(turns) * track.rate_hz,
        towards_tail=bool(slope * turns < 0.0),
        share=float(energy[-1] / energy.sum()) if bends else 0.0,
        headward=_headward(curvature, cycle),
        frames_a_cycle=cycle,
        cycles=len(even) / cycle,
    )


def _smooth_curvature(angles_rad: Floats) -> Floats:
    """(T, N - 16) change of the tangent angles (T, N) from segment to segment, smoothed.

    Noise of the points grows with the square of how closely they lie: without smoothing, 0.2 % of
    the length is more than the bending itself. The ends, where it has one side only, are left out.
    """
    smooth = gaussian_filter1d(angles_rad, _SMOOTH, axis=1, order=1, mode="nearest")
    return np.asarray(smooth[:, _END:-_END])


def _turns_a_frame(phasor: Floats) -> float:
    """How far the pattern (T,) turns from frame to frame, weighted by its energy.

    Noise turns at any rate, so the phasor is smoothed over time as the joints are, well above the
    frequency that comes out. The first and the last cycle count less and less towards the ends:
    the analytic signal takes a recording for periodic.
    """
    turns, smooth = 0.5, phasor
    for step in range(_STEPS):
        if step:
            width = 1.0 / (2.0 * np.pi * CUT_CYCLES * max(abs(turns), 1.0 / len(phasor)))
            smooth = gaussian_filter1d(phasor, width, mode="nearest")
        ramp = np.minimum(np.arange(1, len(phasor)), np.arange(len(phasor) - 1, 0, -1))
        weight = np.sin(0.5 * np.pi * np.minimum(1.0, ramp * abs(turns))) ** 2
        turns = float(np.angle((weight * smooth[1:] * smooth[:-1].conj()).sum())) / (2.0 * np.pi)
    return turns


def _headward(curvature: Floats, cycle: float) -> float:
    """Part of the frames (T, N) whose pulse speed is negative, [PT] 2.4 over the whole body.

    Least squares of ``curvature_t = -U curvature_s``, its two sums taken over a quarter of a cycle
    around each frame, as a single frame's difference is mostly noise.
    """
    in_time, along = np.gradient(curvature, axis=0), np.gradient(curvature, axis=1)
    pulse = gaussian_filter1d(-(in_time * along).sum(axis=1), min(cycle, len(curvature)) / 8.0)
    return float((pulse < 0.0).mean())


def _analytic(values: Floats) -> Complexes:
    """Analytic signal (T, N) of each column: the positive frequencies alone, doubled.

    To the bit as ``scipy.signal.hilbert`` makes it, whose import takes a second.
    """
    count = len(values)
    share = np.zeros(count)
    share[0] = share[count // 2] = 1.0
    share[1 : (count + 1) // 2] = 2.0
    return np.asarray(ifft(fft(values, axis=0) * share[:, None], axis=0))
