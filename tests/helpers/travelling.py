"""A travelling wave by formula: what every format must give back."""

import numpy as np

S = (np.arange(100) + 0.5) / 100
FRAMES, RATE_HZ, WAVES, WAVE_HZ = 60, 20.0, 1.5, 1.0


def wave_angles(towards_tail: bool = True) -> np.ndarray:
    """(60, 100) tangent angles: amplitude 0.5 rad, 1.5 waves on the body, 1 Hz, 3 cycles."""
    time = np.arange(FRAMES)[:, None] / RATE_HZ
    sign = 1.0 if towards_tail else -1.0
    return 0.5 * np.sin(2 * np.pi * (WAVES * S - sign * WAVE_HZ * time)) + 0.3


def ends(angles: np.ndarray, length: float = 1.0) -> np.ndarray:
    """Midline points (T, N + 1, 2) behind a head at the origin."""
    step = np.stack([np.cos(angles), np.sin(angles)], axis=-1) * length / angles.shape[1]
    points = np.zeros((len(angles), angles.shape[1] + 1, 2))
    points[:, 1:] = -np.cumsum(step, axis=1)
    return points
