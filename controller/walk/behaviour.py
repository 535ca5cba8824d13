"""What a user may turn ([PT] 2.6.6): sliding, pulse speed and curvature."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from snakewalk.config.arrays import Complexes, Floats

Schedule = float | Callable[[int], float | Floats]
"""A constant, or a function of the frame that gives a scalar or a value per point (N,)."""


@dataclass(frozen=True, slots=True)
class Behaviour:
    """How the angles move along the body.

    Raises:
        ValueError: a constant sliding outside 0..1.

    """

    sliding: Schedule = 0.0
    """w_d in 0..1: share of the pulse that is lost. At 1 the shape is frozen and glides."""
    pulse_m_s: Schedule = 0.0
    """g of Eq. 13, added to the speed of the body."""

    def __post_init__(self) -> None:
        if isinstance(self.sliding, float | int) and not 0.0 <= self.sliding <= 1.0:
            raise ValueError(f"sliding {self.sliding}: expected 0 to 1")


def at_frame(schedule: Schedule, frame: int) -> Floats:
    """Value of a schedule at a frame, () or (N,)."""
    return np.asarray(schedule(frame) if callable(schedule) else schedule, dtype=float)


def waves_mask(states: Complexes, waves: slice, share: float) -> NDArray[np.bool_]:
    """Choose states (S, n) by their waves, as Fig. 13 does: which of them are curved so.

    Args:
        states: coefficients 1..n; scaling them by a factor scales every bend (curvature).
        waves: which coefficients, 0 for the lowest frequency.
        share: least share of the state's energy that these must hold.

    """
    energy = np.abs(states) ** 2
    return np.asarray(energy[:, waves].sum(axis=1) >= share * energy.sum(axis=1))


def varied_pulse(
    points: int,
    frames: int,
    parts: int,
    spread_m_s: float,
    step_m_s: float,
    rng: np.random.Generator,
) -> Floats:
    """Draw g (frames, points) as [PT] 2.6.4 found it: constant on parts, steps below a limit.

    Each of ``parts`` equal parts starts within ``spread_m_s`` of 0 and wanders by less than
    ``step_m_s`` a frame; neighbouring parts never differ by as much as that.
    """
    values = np.empty((frames, parts))
    now = np.cumsum(rng.uniform(-1.0, 1.0, parts) * 0.99 * step_m_s)
    now = np.clip(now, -spread_m_s, spread_m_s)
    for frame in range(frames):
        values[frame] = now
        wish = np.clip(
            now + rng.uniform(-1.0, 1.0, parts) * 0.49 * step_m_s, -spread_m_s, spread_m_s
        )
        for part in range(1, parts):  # from the head on, as neighbours bound each other
            room = 0.99 * step_m_s
            wish[part] = np.clip(wish[part], wish[part - 1] - room, wish[part - 1] + room)
        now = now + np.clip(wish - now, -0.99 * step_m_s, 0.99 * step_m_s)
    return np.repeat(values, np.diff(np.linspace(0, points, parts + 1).astype(int)), axis=1)
