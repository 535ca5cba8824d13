"""A body with regular samples and, optionally, delayed goals."""

from collections import deque
from collections.abc import Callable

import numpy as np

from snakewalk.config.arrays import Floats
from snakewalk.sim.plant import Plant, ServoDrive


class WatchedPlant:
    """Calls ``on_sample`` every ``period_s`` of simulated time; implements ``sim.plant.Plant``.

    With ``goal_delay_s`` the motors follow the servos' goals later.
    """

    def __init__(
        self,
        plant: Plant,
        period_s: float,
        on_sample: Callable[[], None],
        goal_delay_s: float = 0.0,
    ) -> None:
        self._plant = plant
        self._period_s = period_s
        self._on_sample = on_sample
        self._delay_s = goal_delay_s
        self._samples = 0
        self._start_s = plant.time_s
        self._goals: deque[tuple[float, Floats]] = deque()
        self._applied_rad = self._newest_rad = np.zeros(len(plant.position_rad))

    @property
    def time_s(self) -> float:
        """Time of the shafts' state."""
        return self._plant.time_s

    @property
    def position_rad(self) -> Floats:
        """(J,) live view of the shaft angles."""
        return self._plant.position_rad

    @property
    def velocity_rad_s(self) -> Floats:
        """(J,) live view, rad/s."""
        return self._plant.velocity_rad_s

    def advance(self, until_s: float, drive: ServoDrive) -> None:
        """Step the body under ``drive``, with a stop at each sample."""
        while (due_s := self._start_s + self._samples * self._period_s) <= until_s:
            self._step(due_s, drive)
            self._samples += 1
            self._on_sample()
        self._step(until_s, drive)

    def _step(self, until_s: float, drive: ServoDrive) -> None:
        if self._delay_s <= 0.0:
            self._plant.advance(until_s, drive)
            return
        goal_rad = drive.goal_rad.copy()
        if not drive.torque_on.any():
            self._goals.clear()
            self._applied_rad = self._newest_rad = goal_rad
        elif not np.array_equal(goal_rad, self._newest_rad):
            self._newest_rad = goal_rad
            self._goals.append((self._plant.time_s + self._delay_s, goal_rad))
        while self._goals and self._goals[0][0] <= until_s:
            due_s, next_rad = self._goals.popleft()
            self._follow(due_s, drive)
            self._applied_rad = next_rad
        self._follow(until_s, drive)
        drive.goal_rad[:] = goal_rad

    def _follow(self, until_s: float, drive: ServoDrive) -> None:
        drive.goal_rad[:] = self._applied_rad
        self._plant.advance(until_s, drive)
