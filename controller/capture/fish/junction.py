"""Pieces of motion joined without a step: what is missing at a junction is added, and fades.

[TH] joins segments where the body is straight to 4 degrees; two such ends still differ by up to 8
degrees an angle, and in speed by anything. A servo that is told to jump 8 degrees does what it can.
Here the piece that follows starts with the value *and slope* of the one before it, and the
difference dies away along a quintic: position and speed are continuous, acceleration is bounded.
"""

import numpy as np

from snakewalk.config.arrays import Floats
from snakewalk.controller.kinematics.smoothstep import quintic


def fading(step: Floats, slope: Floats, duration: float, time: Floats) -> Floats:
    """Offset (n, K) that starts as ``step`` (K,) with ``slope`` (K,) and is gone at ``duration``.

    The quintic with ``d(0) = step, d'(0) = slope, d''(0) = 0`` and ``d = d' = d'' = 0`` at the end.

    Args:
        step: at time 0.
        slope: its rate at time 0, per unit of ``time``.
        duration: > 0; beyond it the offset is 0.
        time: (n,) >= 0.

    """
    u = np.clip(np.asarray(time, dtype=float) / duration, 0.0, 1.0)
    value = 1.0 - quintic(u)
    rate = u * (1.0 + u * u * (-6.0 + u * (8.0 - 3.0 * u)))
    return np.outer(value, step) + np.outer(rate, slope) * duration


def join(pieces: list[Floats], samples: int) -> Floats:
    """Join pieces (T_k, K) whose ends fall on one moment: the last sample of one is left out.

    Args:
        pieces: joint angles over time, two or more samples each.
        samples: how long the difference takes to fade; what is left of it at the end of a shorter
            piece is part of the difference there.

    Returns:
        (sum of T_k - 1, plus 1; K). The first piece is unchanged; so is everything if the pieces
        meet in value and slope.

    Raises:
        ValueError: no piece, a piece of one sample, or ``samples`` below 1.

    """
    if not pieces or any(len(piece) < 2 for piece in pieces) or samples < 1:
        raise ValueError("pieces of two or more samples, and a fade of one or more")
    whole = np.concatenate([pieces[0]] + [piece[1:] for piece in pieces[1:]])
    at = len(pieces[0]) - 1
    for piece in pieces[1:]:
        # what stands here holds what is left of the fade before, which this one takes over
        step = whole[at] - piece[0]
        slope = whole[at] - whole[at - 1] - (piece[1] - piece[0])
        count = len(piece) - 1
        whole[at + 1 : at + 1 + count] += fading(
            step, slope, float(samples), np.arange(1.0, count + 1.0)
        )
        at += count
    return whole
