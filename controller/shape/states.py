"""Shape states: a body's tangent angles as a few Fourier coefficients ([PT] 2.5).

Corrections to the printed text: angles are unwrapped first, or rotation invariance fails across
+-pi; coefficient 0 belongs to the padded signal and is not the body's mean heading.
"""

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Complexes = NDArray[np.complex128]


def pad(angles_rad: Floats) -> Floats:
    """Append N samples from last back to first, so that the periodic extension has no jump.

    Args:
        angles_rad: (..., N) unwrapped.

    Returns:
        (..., 2 N).

    """
    points = angles_rad.shape[-1]
    blend = np.arange(1, points + 1) / (points + 1)
    first, last = angles_rad[..., :1], angles_rad[..., -1:]
    return np.concatenate([angles_rad, last + blend * (first - last)], axis=-1)


def to_states(angles_rad: Floats, coefficients: int = 7) -> Complexes:
    """Coefficients 1..n of the padded tangent angles: (..., n), free of place, heading and size."""
    spectrum = np.fft.fft(pad(np.unwrap(angles_rad, axis=-1)), axis=-1)
    return np.asarray(spectrum[..., 1 : coefficients + 1])


def to_angles(states: Complexes, points: int = 100) -> Floats:
    """Rebuild (..., points) angles of zero mean over the body.

    The upper half is the conjugate mirror; ``R^H`` of the text is already conjugated and reversed.
    """
    spectrum = np.zeros((*states.shape[:-1], points + 1), dtype=complex)
    spectrum[..., 1 : states.shape[-1] + 1] = states
    angles = np.fft.irfft(spectrum, n=2 * points, axis=-1)[..., :points]
    return np.asarray(angles - angles.mean(axis=-1, keepdims=True))


def energy_kept(angles_rad: Floats, coefficients: int = 7) -> Floats:
    """Share (...) of the shape's energy (heading left out) that the coefficients hold."""
    spectrum = np.fft.rfft(pad(np.unwrap(angles_rad, axis=-1)), axis=-1)
    power = np.abs(spectrum[..., 1:]) ** 2
    return np.asarray(power[..., :coefficients].sum(axis=-1) / power.sum(axis=-1))


def random_states(states: Complexes, count: int, rng: np.random.Generator) -> Complexes:
    """Draw states with moduli in the recorded range and free phases ([PT] Eq. 1-2): (count, n)."""
    size = np.abs(states)
    low, high = size.min(axis=0), size.max(axis=0)
    modulus = low + rng.random((count, states.shape[-1])) * (high - low)
    return np.asarray(modulus * np.exp(2j * np.pi * rng.random((count, states.shape[-1]))))
