"""Contacts of a tracked animal's feet: a motion model fitted to all feet at once.

On the ground a foot goes back at the speed of the trunk. In the air it goes forward by one stride
over the ground, as a share ``I(p, q)`` of the time in the air, the regularised incomplete beta
function. ``p = q = 2`` is the cubic of ``footfall.swing``, ``p = q = 3`` that of least jerk. A
model with one fixed shape counts the slow start of another shape as contact: up to 0.14 of a cycle.
All feet share one shape, because a single foot of a noisy track hardly determines it.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.optimize import least_squares
from scipy.special import betainc

from snakewalk.config.arrays import Floats

DUTIES = (0.12, 0.93)
"""Limits of the share of the cycle on the ground."""
_PLACES = 16
_SHAPES = (1.8, 3.0)
_SHAPE_LIMITS = (1.2, 5.0)
_SHAPE = np.log(2.3)
_SHAPE_SPREAD = 0.5
"""Logarithm of the expected p and q and its standard deviation (ours)."""


@dataclass(frozen=True, slots=True)
class Contact:
    """One foot over the cycle."""

    duty: float
    """Share of the cycle in which the foot is on the ground."""
    down: float
    """Time at which the foot comes down, in cycles, 0 to 1."""
    ahead: float
    """Middle of a step, ahead of the trunk's place."""
    residual: float
    """Root mean square error of the fit."""


def step(phase: Floats, stride: float, duty: Floats | float, shape: tuple[float, float]) -> Floats:
    """Way of a foot (...) over the trunk, 0 in the middle of its contact.

    Args:
        phase: (...) cycles since it came down, 0 to 1.
        stride: way of the trunk in a cycle.
        duty: (...) share of the cycle on the ground.
        shape: p and q of the way in the air.

    """
    air = np.clip((phase - duty) / (1.0 - duty), 0.0, 1.0)
    return stride * (betainc(*shape, air) + 0.5 * duty - phase)


def fit_contacts(
    phases: list[Floats], ahead: list[Floats], stride: float
) -> tuple[list[Contact], tuple[float, float]]:
    """Return the contacts of all feet, and the shape of their ways in the air.

    Args:
        phases: (T,) of each foot, cycles.
        ahead: (T,) of each foot along the direction of travel.
        stride: way of the trunk in a cycle, same unit.

    """
    starts = [
        _start(phase, foot_ahead, stride) for phase, foot_ahead in zip(phases, ahead, strict=True)
    ]
    noise = max(float(np.median([start[3] for start in starts])), 1e-9 * stride)
    count = len(starts)

    def left(x: Floats) -> Any:  # scipy's stubs know no array of floats here
        shape = float(np.exp(x[-2])), float(np.exp(x[-1]))
        parts = []
        for k in range(count):
            rest = ahead[k] - step((phases[k] - x[count + k]) % 1.0, stride, x[k], shape)
            parts.append((rest - rest.mean()) / noise)
        return np.concatenate([*parts, (x[-2:] - _SHAPE) / _SHAPE_SPREAD])

    shape0 = float(np.log(np.median([start[2] for start in starts])))
    low, high = np.log(_SHAPE_LIMITS)
    duties = [start[0] for start in starts]
    downs = [start[1] for start in starts]
    fit = least_squares(
        left,
        np.array([*duties, *downs, shape0, shape0]),
        bounds=(
            [*[DUTIES[0]] * count, *[-1.0] * count, low, low],
            [*[DUTIES[1]] * count, *[2.0] * count, high, high],
        ),
        x_scale=[*[0.05] * (2 * count), 0.3, 0.3],
    ).x
    shape = float(np.exp(fit[-2])), float(np.exp(fit[-1]))
    contacts = []
    for k in range(count):
        duty = float(fit[k])
        down = float(fit[count + k]) % 1.0
        rest = ahead[k] - step((phases[k] - down) % 1.0, stride, duty, shape)
        contacts.append(Contact(duty, down, float(rest.mean()), float(rest.std())))
    return contacts, shape


def duty_of_cycle(
    phase: Floats, ahead: Floats, stride: float, like: Contact, shape: tuple[float, float]
) -> float:
    """Share of one cycle on the ground, for a known shape."""

    def left(x: Floats) -> Any:
        rest = ahead - step((phase - x[1]) % 1.0, stride, x[0], shape)
        return rest - rest.mean()

    bounds = ([DUTIES[0], like.down - 0.25], [DUTIES[1], like.down + 0.25])
    return float(least_squares(left, np.array([like.duty, like.down]), bounds=bounds).x[0])


def _start(phase: Floats, ahead: Floats, stride: float) -> tuple[float, float, float, float]:
    """Duty, touch-down, p = q and RMS of the best of a grid."""
    grid = np.meshgrid(np.arange(0.15, 0.92, 0.1), np.arange(_PLACES) / _PLACES, indexing="ij")
    duty, down = (values.reshape(-1, 1) for values in grid)
    best = (np.inf, 0.0, 0.0, 0.0)
    for p in _SHAPES:
        rest = ahead - step((phase - down) % 1.0, stride, duty, (p, p))
        spread = rest.std(axis=1)
        k = int(np.argmin(spread))
        best = min(best, (float(spread[k]), float(duty[k, 0]), float(down[k, 0]), p))
    return best[1], best[2], best[3], best[0]
