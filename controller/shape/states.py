"""Shape states: a body's tangent angles as a few Fourier coefficients ([PT] 2.5).

Corrections to the paper: angles are unwrapped first, or rotation invariance fails across +-pi.
Coefficient 0 is not the body's mean heading. Seven coefficients hold 99 % of the energy only up to
four or five waves on the body.
"""

from dataclasses import dataclass

import numpy as np

from snakewalk.config.arrays import Complexes, Floats

PADDING = 0.28
"""Samples appended per sample of the body: 100 become 128.

The text leaves it open. On five recordings 0.28 keeps the most energy in seven coefficients; 1
would spend half of them on the padding (99 % only up to three waves), 0.1 leaves a steep flank.
"""


def pad(angles_rad: Floats) -> Floats:
    """Append samples from the last angle to the first, so that the periodic signal has no jump.

    Args:
        angles_rad: (..., N) unwrapped.

    Returns:
        (..., N + round(0.28 N)).

    """
    extra = padded_length(angles_rad.shape[-1]) - angles_rad.shape[-1]
    blend = np.arange(1, extra + 1) / (extra + 1)
    first, last = angles_rad[..., :1], angles_rad[..., -1:]
    return np.concatenate([angles_rad, last + blend * (first - last)], axis=-1)


def padded_length(points: int) -> int:
    """Number of samples of a padded body."""
    return points + round(PADDING * points)


def to_states(angles_rad: Floats, coefficients: int = 7) -> Complexes:
    """Return coefficients 1..n of the padded tangent angles: (..., n).

    Not normalised: with 100 points, a wave of amplitude a that fills the padded signal has modulus
    64 a.
    """
    spectrum = np.fft.fft(pad(np.unwrap(angles_rad, axis=-1)), axis=-1)
    return spectrum[..., 1 : coefficients + 1]


def to_angles(states: Complexes, points: int = 100) -> Floats:
    """Return (..., points) angles of zero mean over the body.

    The upper half of the spectrum is the conjugate mirror (the paper's ``R^H``).
    """
    length = padded_length(points)
    spectrum = np.zeros((*states.shape[:-1], length // 2 + 1), dtype=complex)
    spectrum[..., 1 : states.shape[-1] + 1] = states
    angles = np.fft.irfft(spectrum, n=length, axis=-1)[..., :points]
    return np.asarray(angles - angles.mean(axis=-1, keepdims=True))


def energy_kept(angles_rad: Floats, coefficients: int = 7) -> Floats:
    """Share (...) of the shape's energy that the coefficients hold; 1 for a straight body."""
    spectrum = np.fft.rfft(pad(np.unwrap(angles_rad, axis=-1)), axis=-1)
    power = np.abs(spectrum[..., 1:]) ** 2
    total = power.sum(axis=-1)
    kept = power[..., :coefficients].sum(axis=-1)
    return np.where(total > 0.0, kept / np.where(total > 0.0, total, 1.0), 1.0)


@dataclass(frozen=True, slots=True)
class StateRange:
    """Range of a recording's states, from which [PT] 2.5 draws random ones."""

    low: Floats
    """(n,) smallest modulus of each coefficient, C_min of [PT]."""
    high: Floats
    """(n,) largest, C_max."""

    def amplitude_rad(self) -> Floats:
        """(n, 2) amplitudes of a wave of tangent angle: modulus over half the samples."""
        return np.stack([self.low, self.high], axis=-1) / (0.5 * padded_length(100))


def state_range(states: Complexes) -> StateRange:
    """Return the range of the moduli of states (T, n), T >= 1."""
    size = np.abs(states)
    return StateRange(size.min(axis=0), size.max(axis=0))


def random_states(states: Complexes, count: int, rng: np.random.Generator) -> Complexes:
    """Draw (count, n) states with moduli in the recorded range and free phases ([PT] Eq. 1-2)."""
    limits = state_range(states)
    modulus = limits.low + rng.random((count, states.shape[-1])) * (limits.high - limits.low)
    return np.asarray(modulus * np.exp(2j * np.pi * rng.random((count, states.shape[-1]))))


def limit_to_waves(states: Complexes, first: int, last: int, share: float) -> Complexes:
    """Return states (..., n) whose coefficients ``first`` to ``last`` hold a share of the energy.

    [PT] 2.6.6 sets thresholds on this energy (Fig. 13). The other coefficients are scaled down to
    the threshold, then all are scaled up to the original energy: the speed law uses K.

    Raises:
        ValueError: the states have no such coefficients.

    """
    if not 1 <= first <= last <= states.shape[-1]:
        raise ValueError(f"coefficients {first}-{last} of {states.shape[-1]}")
    inside = np.zeros(states.shape[-1], dtype=bool)
    inside[first - 1 : last] = True
    energy = np.abs(states) ** 2
    kept = energy[..., inside].sum(axis=-1)
    rest = energy[..., ~inside].sum(axis=-1)
    most = kept * (1.0 - share) / share  # energy outside the band that the share allows
    down = np.sqrt(np.minimum(1.0, most / np.where(rest > 0.0, rest, 1.0)))
    up = np.sqrt((kept + rest) / np.where(kept > 0.0, kept + down**2 * rest, 1.0))
    return np.asarray(states * up[..., None] * np.where(inside, 1.0, down[..., None]))
