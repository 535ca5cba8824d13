"""Shape states: a body's tangent angles as a few Fourier coefficients ([PT] 2.5).

Corrections to the printed text: angles are unwrapped first, or rotation invariance fails across
+-pi. Coefficient 0 belongs to the padded signal and is not the body's mean heading. The 99 % of the
energy in seven coefficients hold up to four or five waves on the body, not beyond.
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
    """Append samples from last back to first, so that the periodic extension has no jump.

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
    """Samples of the padded signal of a body of ``points`` samples."""
    return points + round(PADDING * points)


def to_states(angles_rad: Floats, coefficients: int = 7) -> Complexes:
    """Coefficients 1..n of the padded tangent angles: (..., n), free of place, heading and size.

    Not normalised: a wave of amplitude a that fills the padded signal has modulus 64 a.
    """
    spectrum = np.fft.fft(pad(np.unwrap(angles_rad, axis=-1)), axis=-1)
    return np.asarray(spectrum[..., 1 : coefficients + 1])


def to_angles(states: Complexes, points: int = 100) -> Floats:
    """Rebuild (..., points) angles of zero mean over the body.

    The upper half is the conjugate mirror; ``R^H`` of the text is already conjugated and reversed.
    """
    length = padded_length(points)
    spectrum = np.zeros((*states.shape[:-1], length // 2 + 1), dtype=complex)
    spectrum[..., 1 : states.shape[-1] + 1] = states
    angles = np.fft.irfft(spectrum, n=length, axis=-1)[..., :points]
    return np.asarray(angles - angles.mean(axis=-1, keepdims=True))


def energy_kept(angles_rad: Floats, coefficients: int = 7) -> Floats:
    """Share (...) of the shape's energy (heading left out) that the coefficients hold.

    A straight body has none to lose: 1.
    """
    spectrum = np.fft.rfft(pad(np.unwrap(angles_rad, axis=-1)), axis=-1)
    power = np.abs(spectrum[..., 1:]) ** 2
    total = power.sum(axis=-1)
    kept = power[..., :coefficients].sum(axis=-1)
    return np.asarray(np.where(total > 0.0, kept / np.where(total > 0.0, total, 1.0), 1.0))


@dataclass(frozen=True, slots=True)
class StateRange:
    """Range of a recording's states: [PT] 2.5 draws random ones between these."""

    low: Floats
    """(n,) smallest modulus of each coefficient, C_min of [PT]."""
    high: Floats
    """(n,) largest, C_max."""

    def amplitude_rad(self, points: int = 100) -> Floats:
        """Both as amplitudes of a wave of tangent angle, (n, 2): modulus over half the samples."""
        return np.stack([self.low, self.high], axis=-1) / (0.5 * padded_length(points))


def state_range(states: Complexes) -> StateRange:
    """Range of the moduli of recorded states (T, n), T >= 1."""
    size = np.abs(states)
    return StateRange(size.min(axis=0), size.max(axis=0))


def random_states(states: Complexes, count: int, rng: np.random.Generator) -> Complexes:
    """Draw states with moduli in the recorded range and free phases ([PT] Eq. 1-2): (count, n)."""
    limits = state_range(states)
    modulus = limits.low + rng.random((count, states.shape[-1])) * (limits.high - limits.low)
    return np.asarray(modulus * np.exp(2j * np.pi * rng.random((count, states.shape[-1]))))


def limit_to_waves(states: Complexes, first: int, last: int, share: float) -> Complexes:
    """States (..., n) whose coefficients ``first`` to ``last`` hold a share of their energy.

    [PT] 2.6.6 sets thresholds on the energy of the coefficients (Fig. 13). The other coefficients
    are scaled down to the threshold, all to the energy that the state had: K stays the same, which
    is what drives the speed law.

    Raises:
        ValueError: the states have no such coefficients.

    """
    if not 1 <= first <= last <= states.shape[-1]:
        raise ValueError(f"coefficients {first}-{last} of {states.shape[-1]}")
    inside = np.zeros(states.shape[-1], dtype=bool)
    inside[first - 1 : last] = True
    energy = np.abs(states) ** 2
    kept, rest = energy[..., inside].sum(axis=-1), energy[..., ~inside].sum(axis=-1)
    most = kept * (1.0 - share) / share  # energy outside that the share allows
    down = np.sqrt(np.minimum(1.0, most / np.where(rest > 0.0, rest, 1.0)))
    up = np.sqrt((kept + rest) / np.where(kept > 0.0, kept + down**2 * rest, 1.0))
    return np.asarray(states * up[..., None] * np.where(inside, 1.0, down[..., None]))
