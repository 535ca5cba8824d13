"""A body with some shafts turned by simulated servos, and the others following real ones."""

from collections.abc import Sequence

import numpy as np

from snakewalk.config.arrays import Floats
from snakewalk.sim.plant import Plant, ServoDrive
from snakewalk.sim.servo.motor import MotorModel, make_drive

FOLLOW_GAIN_PER_RAD = 20.0
"""Gain of the motors that make shafts follow: full output at 0.05 rad (ours)."""
FOLLOW_STRENGTH = 4.0
"""Supply of these motors, as a multiple of the nominal one (ours): they carry every load that a
real servo carries."""
AHEAD_S = 0.1
"""Longest time over which a measured velocity is extrapolated (ours)."""
_INPUTS = 9
"""Columns of a drive that servos write; the plant writes the others."""


class SplitPlant:
    """The simulated shafts of ``plant``; implements ``sim.plant.Plant``.

    Strong motors move the others to the angles of ``follow``. Their weight, contacts and friction
    act on the simulated ones, and nothing acts on the real ones.
    """

    def __init__(self, plant: Plant, motors: Sequence[MotorModel], real: Sequence[int]) -> None:
        """Prepare; following shafts are limp until the first ``follow``.

        ``plant`` has J shafts; ``real`` are the indices of the following ones.
        """
        self._plant = plant
        self._real = np.array(sorted(real), np.intp)
        self._simulated = np.setdiff1d(np.arange(len(motors)), self._real)
        supply_v = FOLLOW_STRENGTH * np.array([motor.nominal_v for motor in motors])
        self._drive = make_drive(motors, supply_v)
        self._drive.p_gain_per_rad[self._real] = FOLLOW_GAIN_PER_RAD / FOLLOW_STRENGTH
        self._measured_at_s = np.zeros(len(self._real))
        self._position_rad, self._velocity_rad_s = np.zeros((2, len(self._real)))

    @property
    def time_s(self) -> float:
        """Time of the shafts' state."""
        return self._plant.time_s

    @property
    def position_rad(self) -> Floats:
        """(S,) angles of the simulated shafts, a copy."""
        return self._plant.position_rad[self._simulated]

    @property
    def velocity_rad_s(self) -> Floats:
        """(S,) rad/s, a copy."""
        return self._plant.velocity_rad_s[self._simulated]

    def follow(self, measured_at_s: Floats, position_rad: Floats, velocity_rad_s: Floats) -> None:
        """Store the measured positions of the real joints, (J,) each, if finite."""
        is_known = np.isfinite(position_rad[self._real])
        rows = self._real[is_known]
        self._measured_at_s[is_known] = measured_at_s[rows]
        self._position_rad[is_known] = position_rad[rows]
        self._velocity_rad_s[is_known] = velocity_rad_s[rows]
        self._drive.torque_on[rows] = 1.0

    def advance(self, until_s: float, drive: ServoDrive) -> None:
        """Step the body under ``drive`` (S,), with its other shafts following."""
        joined = self._drive
        rows = self._simulated
        for joined_column, given in zip(joined.columns()[:_INPUTS], drive.columns(), strict=False):
            joined_column[rows] = given
        ahead_s = np.clip(until_s - self._measured_at_s, 0.0, AHEAD_S)
        joined.goal_rad[self._real] = self._position_rad + self._velocity_rad_s * ahead_s
        self._plant.advance(until_s, joined)
        for joined_column, given in zip(
            joined.columns()[_INPUTS:], drive.columns()[_INPUTS:], strict=True
        ):
            given[:] = joined_column[rows]
