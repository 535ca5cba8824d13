"""The wave of a recording with gaps, from runs of consecutive frames.

In the plane of the two strongest components of the curvature a travelling wave runs on an ellipse,
so each frame has a phase. The turn between consecutive frames gives a first frequency. Least
squares over all runs, each with its own phase and amplitude, refine it.
"""

from typing import NamedTuple

import numpy as np

from snakewalk.config.arrays import Complexes, Floats, Ints
from snakewalk.controller.track.curvature import analytic_signal
from snakewalk.controller.track.frame_runs import bridged

_BRIDGE = 8.0
"""Gaps up to this part of a cycle are bridged (ours): a chord of it is 2 % off the arc."""
_LEAST_CYCLES = 1.0
"""Shorter runs are left out where a longer one exists (ours)."""
_REACH = 0.3
"""Part of the first frequency within which the refined one lies (ours)."""
_TRIED = 31
_ZOOMS = 3
_COMPONENTS = 4


class GappedWave(NamedTuple):
    """The strongest travelling pattern of runs of frames."""

    turns_a_frame: float
    """Positive in the direction of ``mode``'s phase."""
    mode: Complexes
    """(N,) of the curvature."""
    share: float
    """Part of the curvature's energy that the pattern explains."""
    runs: list[Floats]
    """Curvature (T, N) of the runs that were used."""


def gapped_wave(number: Ints, curvature: Floats) -> GappedWave:
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
    turns = _refined(number, [run for run, _ in used], components, first)
    return GappedWave(
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


def _refined(number: Ints, spans: list[Ints], components: Floats, first: float) -> float:
    """Frequency near ``first``, turns per frame, with the least residual over the spans."""
    spanned = [np.flatnonzero((number >= span[0]) & (number <= span[-1])) for span in spans]
    best = first
    reach = _REACH
    for _ in range(_ZOOMS):
        tried = np.clip(best * np.linspace(1.0 - reach, 1.0 + reach, _TRIED), 1e-6, 0.5)
        left = [
            sum(_squares_left(number[run], components[run], turns) for run in spanned)
            for turns in tried
        ]
        best = float(tried[int(np.argmin(left))])
        reach = 2.0 * reach / (_TRIED - 1)
    return best


def _squares_left(number: Ints, components: Floats, turns: float) -> float:
    """Squared residual of components (T, K) after a constant, a sine and a cosine."""
    phase = 2.0 * np.pi * turns * (number - number[0])
    columns = [np.cos(phase), np.sin(phase)]
    if turns * (number[-1] - number[0]) > 1.0:
        columns.append(np.ones(len(number)))
    basis, _ = np.linalg.qr(np.stack(columns, axis=1))
    return float(((components - basis @ (basis.T @ components)) ** 2).sum())
