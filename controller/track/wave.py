"""The body wave of a recording: direction, length and speed.

The wave of a recording with gaps, from runs of consecutive frames.

In the plane of the two strongest components of the curvature a travelling wave runs on an ellipse,
so each frame has a phase. The turn between consecutive frames gives a first frequency. Least
squares over all runs, each with its own phase and amplitude, refine it.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from scipy.ndimage import gaussian_filter1d

from snakewalk.config.arrays import Complexes, Floats, Ints
from snakewalk.controller.track.curvature import analytic_signal, smooth_curvature
from snakewalk.controller.track.frame_runs import bridged, missing_frames
from snakewalk.controller.track.resample import SEGMENTS
from snakewalk.controller.track.slowing import CUT_CYCLES
from snakewalk.controller.track.track import Track

_BRIDGE = 8.0
"""Gaps up to this part of a cycle are bridged (ours): a chord of it is 2 % off the arc."""
_LEAST_CYCLES = 1.0
"""Shorter runs are left out where a longer one exists (ours)."""
_REACH = 0.3
"""Part of the first frequency within which the refined one lies (ours)."""
_TRIED_FREQUENCIES = 31
_ZOOMS = 3
_COMPONENTS = 4


class WavePattern(NamedTuple):
    """The strongest travelling pattern of runs of frames."""

    turns_a_frame: float
    """Positive in the direction of ``mode``'s phase."""
    mode: Complexes
    """(N,) of the curvature."""
    share: float
    """Part of the curvature's energy that the pattern explains."""
    runs: list[Floats]
    """Curvature (T, N) of the runs that were used."""


def pattern_of_runs(number: Ints, curvature: Floats) -> WavePattern:
    """Fit one travelling wave to curvature (T, N) of frames (T,)."""
    mean = curvature.mean(axis=0)
    components = _components(curvature - mean)
    first = abs(_first_turns(number, components))
    cycle = 1.0 / max(first, 1e-9)
    filled = bridged(number, curvature, int(min(cycle / _BRIDGE, len(number))))
    longest = max(len(run) for run, _ in filled)
    least = min(longest, max(4, int(np.ceil(_LEAST_CYCLES * cycle))))
    used = [run for run in filled if len(run[0]) >= least]
    energy = np.zeros((curvature.shape[1],) * 2, dtype=complex)
    signals = [analytic_signal(values - mean) for _, values in used]
    for signal in signals:
        energy += signal.T @ signal.conj()
    values, modes = np.linalg.eigh(energy)
    mode = modes[:, -1]
    sense = sum(
        complex((phasor[1:] * phasor[:-1].conj()).sum())
        for phasor in (signal @ mode.conj() for signal in signals)
    )
    turns = _refined_frequency(number, [run for run, _ in used], components, first)
    return WavePattern(
        float(np.copysign(turns, np.angle(sense))),
        np.asarray(mode),
        float(values[-1] / max(float(values.sum()), 1e-300)),
        [run for _, run in used],
    )


def _components(bending: Floats) -> Floats:
    """(T, 4) strongest components, in order."""
    _, axes = np.linalg.eigh(bending.T @ bending)
    return np.asarray(bending @ axes[:, : -_COMPONENTS - 1 : -1])


def _first_turns(number: Ints, components: Floats) -> float:
    """Turns per frame, from the phase of each frame."""
    size = np.maximum(np.sqrt((components[:, :2] ** 2).sum(axis=0)), 1e-300)
    both = components[:, :2] / size
    phasor = both[:, 0] + 1j * both[:, 1]
    joined = np.flatnonzero(np.diff(number) == 1)
    return float(np.angle((phasor[joined + 1] * phasor[joined].conj()).sum())) / (2.0 * np.pi)


def _refined_frequency(number: Ints, spans: list[Ints], components: Floats, first: float) -> float:
    """Frequency near ``first``, turns per frame, with the least residual over the spans."""
    spanned = [np.flatnonzero((number >= span[0]) & (number <= span[-1])) for span in spans]
    best = first
    reach = _REACH
    for _ in range(_ZOOMS):
        tried = np.clip(best * np.linspace(1.0 - reach, 1.0 + reach, _TRIED_FREQUENCIES), 1e-6, 0.5)
        left = [
            sum(_squares_left(number[run], components[run], turns) for run in spanned)
            for turns in tried
        ]
        best = float(tried[int(np.argmin(left))])
        reach = 2.0 * reach / (_TRIED_FREQUENCIES - 1)
    return best


def _squares_left(number: Ints, components: Floats, turns: float) -> float:
    """Squared residual of components (T, K) after a constant, a sine and a cosine."""
    phase = 2.0 * np.pi * turns * (number - number[0])
    columns = [np.cos(phase), np.sin(phase)]
    if turns * (number[-1] - number[0]) > 1.0:
        columns.append(np.ones(len(number)))
    basis, _ = np.linalg.qr(np.stack(columns, axis=1))
    return float(((components - basis @ (basis.T @ components)) ** 2).sum())


LEAST_SHARE = 0.45
"""Share of the bending: recorded animals that turn and reverse lie above 0.5, noise below 0.35."""
LEAST_FRAMES = 4.0
"""Frames a cycle: from 2 on a wave looks like another that runs the other way."""
LEAST_CYCLES = 2.0
"""Least number of cycles in the recording: a wave by formula has its frequency within 1.5 % from
here on."""
LEAST_RUN_CYCLES = 1.0
"""Least number of cycles in the longest part without a gap (ours)."""
_NO_BEND = 1e-9  # rad per segment: rounding errors of a straight body that turns
_STEPS = 6  # until frequency and smoothing are consistent


@dataclass(frozen=True, slots=True)
class Wave:
    """Strongest travelling pattern of the curvature; a wave has the ``unknown_reason`` None."""

    waves: float
    """Wavelengths on the body."""
    frequency_hz: float
    """Frequency with which waves pass a point of the body."""
    towards_tail: bool
    """The direction of an animal that moves forward."""
    share: float
    """Part of the curvature's energy that this pattern explains, 0..1."""
    headward: float
    """Part of the time in which the pattern ran towards the head: backward crawling, or a file that
    lists the tail first."""
    frames_a_cycle: float
    cycles: float
    """Number of cycles in the recording, without its gaps."""
    longest_cycles: float | None = None
    """Cycles of the longest part without a gap; None where the recording has no gap."""

    @property
    def coarse(self) -> bool:
        """Whether frames are too far apart to see the direction and shift of the pattern."""
        return self.frames_a_cycle < LEAST_FRAMES

    @property
    def unknown_reason(self) -> str | None:
        """Reason why frequency, length and direction are unknown, or None."""
        if self.share < LEAST_SHARE:
            share = below(100.0 * self.share, 100.0 * LEAST_SHARE, digits=0)
            return (
                f"one wave is only {share}% of the bending ({LEAST_SHARE:.0%} are needed): "
                "noise, or a body that bends otherwise"
            )
        if self.coarse:
            return (
                f"{below(self.frames_a_cycle, LEAST_FRAMES)} frames a cycle are too few "
                f"({LEAST_FRAMES:g} are needed): record at a higher rate"
            )
        if self.cycles < LEAST_CYCLES:
            return (
                f"{below(self.cycles, LEAST_CYCLES)} cycles are too short a recording "
                f"({LEAST_CYCLES:g} needed)"
            )
        if self.longest_cycles is not None and self.longest_cycles < LEAST_RUN_CYCLES:
            return (
                f"the longest part without a gap has {below(self.longest_cycles, LEAST_RUN_CYCLES)}"
                f" cycles ({LEAST_RUN_CYCLES:g} needed)"
            )
        return None

    @property
    def pulse_body_lengths_s(self) -> float:
        """Signed speed of the pattern along the body, positive towards the tail ([PT] 2.4, U)."""
        speed = self.frequency_hz / max(self.waves, 1e-9)
        return speed if self.towards_tail else -speed


def below(value: float, limit: float, digits: int = 1) -> str:
    """A number with enough digits to show that it is below a limit."""
    while float(text := f"{value:.{digits}f}") >= limit and digits < 12:
        digits += 1
    return text


def measure_wave(track: Track) -> Wave:
    """Fit one travelling wave: first complex principal component of the analytic curvature.

    The slope of its phase is the number of waves; it falls towards the tail if the wave runs that
    way. A reversal within the recording lowers ``share`` and counts in ``headward``.
    """
    number = np.rint(track.time_s * track.rate_hz).astype(np.int64)
    has_gaps = bool(missing_frames(number))
    curvature = smooth_curvature(track.angles_rad if has_gaps else _even_angles_rad(track))
    pattern = pattern_of_runs(number, curvature) if has_gaps else _pattern(curvature)
    slope = _slope(pattern.mode)
    turns = pattern.turns_a_frame
    cycle = 1.0 / max(abs(turns), 1e-9)
    lengths = [len(run) for run in pattern.runs]
    return Wave(
        waves=float(abs(slope)),
        frequency_hz=abs(turns) * track.rate_hz,
        towards_tail=bool(slope * turns < 0.0),
        share=pattern.share if _bends(curvature) else 0.0,
        headward=_headward(pattern.runs, cycle),
        frames_a_cycle=cycle,
        cycles=sum(lengths) / cycle,
        longest_cycles=max(lengths) / cycle if has_gaps else None,
    )


def _even_angles_rad(track: Track) -> Floats:
    """(T, N) angles at even times."""
    even = np.arange(track.time_s[0], track.time_s[-1] + 0.5 / track.rate_hz, 1.0 / track.rate_hz)
    return np.stack([np.interp(even, track.time_s, column) for column in track.angles_rad.T]).T


def _pattern(curvature: Floats) -> WavePattern:
    """Fit one travelling wave to curvature (T, N) without a gap."""
    analytic = analytic_signal(curvature - curvature.mean(axis=0))
    energy, modes = np.linalg.eigh(analytic.T @ analytic.conj())
    mode = modes[:, -1]
    share = float(energy[-1] / max(energy.sum(), 1e-300))
    return WavePattern(_turns_a_frame(analytic @ mode.conj()), mode, share, [curvature])


def _slope(mode: Complexes) -> float:
    """Signed waves on the body, from the phase of a mode (N,)."""
    s = np.arange(len(mode)) / SEGMENTS
    fitted = np.polyfit(s, np.unwrap(np.angle(mode)), 1, w=np.abs(mode))
    return float(fitted[0] / (2.0 * np.pi))


def _bends(curvature: Floats) -> bool:
    return float(np.abs(curvature - curvature.mean(axis=0)).max()) > _NO_BEND


def _turns_a_frame(phasor: Floats) -> float:
    """Turns of the pattern (T,) per frame, weighted by its energy.

    The phasor is smoothed over time, well above the resulting frequency. The first and the last
    cycle are tapered: the analytic signal treats a recording as periodic.
    """
    turns = 0.5
    smooth = phasor
    for step in range(_STEPS):
        if step:
            width = 1.0 / (2.0 * np.pi * CUT_CYCLES * max(abs(turns), 1.0 / len(phasor)))
            smooth = gaussian_filter1d(phasor, width, mode="nearest")
        ramp = np.minimum(np.arange(1, len(phasor)), np.arange(len(phasor) - 1, 0, -1))
        weight = np.sin(0.5 * np.pi * np.minimum(1.0, ramp * abs(turns))) ** 2
        turns = float(np.angle((weight * smooth[1:] * smooth[:-1].conj()).sum())) / (2.0 * np.pi)
    return turns


def _headward(runs: Sequence[Floats], cycle: float) -> float:
    """Part of the frames of runs (T, N) with negative pulse speed ([PT] 2.4, whole body).

    Least squares of ``curvature_t = -U curvature_s`` over a quarter of a cycle around each frame,
    because a single difference is mostly noise.
    """
    negative = []
    for curvature in runs:
        if len(curvature) < 2:
            continue
        in_time = np.gradient(curvature, axis=0)
        along = np.gradient(curvature, axis=1)
        width = min(cycle, len(curvature)) / 8.0
        negative.append(gaussian_filter1d(-(in_time * along).sum(axis=1), width) < 0.0)
    return float(np.concatenate(negative).mean()) if negative else 0.0
