"""Speed of the synthesised body: viscous and Coulomb friction against its bends ([PT] 2.6.3).

``dv/dt = max(0, c3 K - c4 |dO/dt|) - c1 v - c2`` with K the standard deviation of the skeleton
angles and O the heading (Eq. 8-9). Corrections: Eq. 9 equates norms, so a body never slows down;
here the acceleration is signed. ``v >= 0``: friction never pushes backwards at rest. The unit of
length of the printed constants must be given.
"""

from dataclasses import dataclass
from typing import Self

import numpy as np
from numpy.typing import ArrayLike
from scipy.optimize import least_squares, lsq_linear

from snakewalk.config.arrays import Floats


@dataclass(frozen=True, slots=True)
class SpeedLaw:
    """The four constants, in SI units."""

    viscous_1_s: float
    """Coefficient c1 of viscous friction."""
    coulomb_m_s2: float
    """Coefficient c2 of Coulomb friction."""
    bend_m_s2_rad: float
    """Coefficient c3 of the bending, per radian of K."""
    turn_m_s: float
    """Coefficient c4 of turning: m/s^2 lost per rad/s."""

    @classmethod
    def printed(cls, unit_m: float, c4: float = 1.0) -> Self:
        """Return the constants of [PT] (c1 = 1, c2 = 0.5, c3 = 6, c4 < 2) in a unit of length."""
        return cls(1.0, 0.5 * unit_m, 6.0 * unit_m, c4 * unit_m)

    def steady_m_s(self, bend_rad: ArrayLike, turn_rad_s: ArrayLike = 0.0) -> Floats:
        """Steady speed ``(c3 K - c4 |O'| - c2) / c1``, at least 0."""
        free = self._push(bend_rad, turn_rad_s) - self.coulomb_m_s2
        return np.maximum(free, 0.0) / self.viscous_1_s

    def step_m_s(self, speed_m_s: float, bend_rad: float, turn_rad_s: float, dt_s: float) -> float:
        """Speed after one Euler step.

        Raises:
            ValueError: ``dt_s`` is not below ``2 / c1``, where Euler's method diverges.

        """
        if not 0.0 < dt_s * self.viscous_1_s < 2.0:
            raise ValueError(f"time step {dt_s} s: below {2.0 / self.viscous_1_s:.3g} s is stable")
        push = max(0.0, self.bend_m_s2_rad * bend_rad - self.turn_m_s * abs(turn_rad_s))
        pull = self.viscous_1_s * speed_m_s + self.coulomb_m_s2
        return max(0.0, speed_m_s + dt_s * (push - pull))

    def _push(self, bend_rad: ArrayLike, turn_rad_s: ArrayLike) -> Floats:
        bend = self.bend_m_s2_rad * np.asarray(bend_rad, float)
        return np.maximum(bend - self.turn_m_s * np.abs(turn_rad_s), 0.0)


@dataclass(frozen=True, slots=True)
class Identified:
    """A law fitted to the motion of a robot."""

    law: SpeedLaw
    rms_m_s2: float
    """Residual of the balance of accelerations; of steady samples, c1 times that of the speed."""
    explained: float
    """Share of the variance that the law explains; 0 or less: the samples do not follow it."""
    samples: int
    """Moving samples used; one at rest says only that the push is at most c2."""


def identify(
    bend_rad: Floats,
    turn_rad_s: Floats,
    speed_m_s: Floats,
    acceleration_m_s2: Floats | None = None,
    viscous_1_s: float = 1.0,
) -> Identified:
    """Fit the law to samples (S,) of a run by bounded least squares.

    Steady samples contain only ratios to c1; without accelerations c1 is ``viscous_1_s``.

    Raises:
        ValueError: fewer moving samples than constants.

    """
    moving = speed_m_s > 1e-3 * max(float(np.max(speed_m_s, initial=0.0)), 1e-9)
    k = bend_rad[moving]
    turn = np.abs(turn_rad_s[moving])
    v = speed_m_s[moving]
    steady = acceleration_m_s2 is None
    if len(v) < (3 if steady else 4):
        raise ValueError(f"{len(v)} moving samples are too few for the speed law")
    columns = [-np.ones_like(v), k, -turn]
    if acceleration_m_s2 is None:
        viscous_part = viscous_1_s * v
    else:
        columns = [-v, *columns]
        viscous_part = acceleration_m_s2[moving]
    start = lsq_linear(np.column_stack(columns), viscous_part, bounds=(0.0, np.inf)).x

    def missing(coefficients: Floats) -> Floats:
        c2, c3, c4 = coefficients[-3:]
        drag = 0.0 if steady else coefficients[0] * v
        return np.asarray(np.maximum(c3 * k - c4 * turn, 0.0) - c2 - drag - viscous_part)

    fit = least_squares(missing, start, bounds=(0.0, np.inf))
    c2, c3, c4 = (float(value) for value in fit.x[-3:])
    c1 = viscous_1_s if steady else max(float(fit.x[0]), 1e-9)
    rms = float(np.sqrt(np.mean(fit.fun**2)))
    explained = 1.0 - rms**2 / max(float(np.var(viscous_part)), 1e-30)
    return Identified(SpeedLaw(c1, c2, c3, c4), rms, explained, len(v))
