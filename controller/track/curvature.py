"""Curvature of bodies over time, smoothed along the body, and its analytic signal."""

import numpy as np
from scipy.fft import fft, ifft
from scipy.ndimage import gaussian_filter1d

from snakewalk.config.arrays import Complexes, Floats

_SMOOTH = 4.0  # of 100 segments: a wave of half the body keeps 88 % of its amplitude
_END = 8  # segments at each end whose smoothed curvature is one-sided


def smooth_curvature(angles_rad: Floats) -> Floats:
    """(T, N - 16) change of the tangent angles (T, N) per segment, smoothed, without the ends.

    Without smoothing, noise of 0.2 % of the length exceeds the bending itself.
    """
    smooth = gaussian_filter1d(angles_rad, _SMOOTH, axis=1, order=1, mode="nearest")
    return smooth[:, _END:-_END]


def analytic_signal(values: Floats) -> Complexes:
    """Analytic signal (T, N) of each column: the positive frequencies, doubled.

    Bit-identical to ``scipy.signal.hilbert``, which needs a second to import.
    """
    count = len(values)
    share = np.zeros(count)
    share[0] = share[count // 2] = 1.0
    share[1 : (count + 1) // 2] = 2.0
    return ifft(fft(values, axis=0) * share[:, None], axis=0)
