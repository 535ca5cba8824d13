"""Joint goals to raw goal positions inside the joint limits."""

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from drivers.compiling import COMPILES
from drivers.types import Floats
from drivers.units import ServoUnits

Ticks = NDArray[np.int32]


class GoalTicks:
    """Nearest ticks of J goals, kept within the limits; in numpy, or compiled with numba."""

    def __init__(self, units: ServoUnits, limits: Ticks, *, compiled: bool | None = None) -> None:
        """Take the limits (J, 2), raw; ``compiled`` None takes numba where it is installed."""
        self._units = units
        self._low, self._high = np.ascontiguousarray(limits.T, np.int32)
        self._scale = np.array([units.rad_per_position, float(units.zero_position)])
        self._loop: Callable[[Floats, Floats, Ticks, Ticks, Ticks], bool] | None = None
        if COMPILES if compiled is None else compiled:
            from drivers.state_loops import ticks  # noqa: PLC0415  numba is optional

            self._loop = ticks

    def of(self, goal_rad: Floats) -> Ticks:
        """(J,) raw goals, a new array.

        Raises:
            ValueError: a goal is not finite, or there are not J of them.

        """
        if goal_rad.shape != self._low.shape:
            raise ValueError(f"goals of shape {goal_rad.shape} for {len(self._low)} joints")
        if self._loop is None:
            raw = self._units.position_raw(goal_rad)
            return np.asarray(np.minimum(np.maximum(raw, self._low), self._high))
        raw = np.empty_like(self._low)
        if not self._loop(goal_rad, self._scale, self._low, self._high, raw):
            raise ValueError("an angle is not finite")
        return raw
