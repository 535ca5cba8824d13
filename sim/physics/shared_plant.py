"""A body whose shafts are turned by several groups of servos, such as two makes on two ports."""

from collections.abc import Sequence

import numpy as np

from snakewalk.config.arrays import Floats, Indices
from snakewalk.sim.plant import Plant, ServoDrive
from snakewalk.sim.servo.motor import MotorModel, make_drive

_INPUTS = 9
"""Columns of a drive that servos write; the plant writes the others."""


class SharedPlant:
    """Collects the drives of all groups; the body follows the slowest one."""

    def __init__(self, plant: Plant, motors: Sequence[MotorModel]) -> None:
        """Prepare; ``plant`` has J shafts, ``motors`` are those of all."""
        self.plant = plant
        self.drive = make_drive(motors, [motor.nominal_v for motor in motors])
        self._shares: list[PlantShare] = []

    def share(self, rows: Sequence[int]) -> "PlantShare":
        """The shafts of one group of servos, by index."""
        plant_share = PlantShare(self, np.array(rows, np.intp))
        self._shares.append(plant_share)
        return plant_share

    def advance(self) -> None:
        """Step the body to the time that all groups have reached."""
        until_s = min(share.reached_s for share in self._shares)
        if until_s <= self.plant.time_s:
            return
        self.plant.advance(until_s, self.drive)
        for share in self._shares:
            share.return_outputs()


class PlantShare:
    """The shafts of one group; implements ``sim.plant.Plant``."""

    def __init__(self, shared: SharedPlant, rows: Indices) -> None:
        self._shared = shared
        self._rows = rows
        self._drive: ServoDrive | None = None
        self.reached_s = shared.plant.time_s
        """Time to which the group has advanced."""

    @property
    def time_s(self) -> float:
        """Time of the shafts' state."""
        return self._shared.plant.time_s

    @property
    def position_rad(self) -> Floats:
        """(S,) angles, a copy."""
        return self._shared.plant.position_rad[self._rows]

    @property
    def velocity_rad_s(self) -> Floats:
        """(S,) rad/s, a copy."""
        return self._shared.plant.velocity_rad_s[self._rows]

    def advance(self, until_s: float, drive: ServoDrive) -> None:
        """Set the inputs of these shafts; the body steps when the other groups are as far."""
        self._drive = drive
        self.reached_s = until_s
        for column, part in zip(
            self._shared.drive.columns()[:_INPUTS], drive.columns(), strict=False
        ):
            column[self._rows] = part
        self._shared.advance()

    def return_outputs(self) -> None:
        """Copy the outputs of the last step into the group's drive."""
        if self._drive is None:
            return
        outputs = self._shared.drive.columns()[_INPUTS:]
        for output, share_column in zip(outputs, self._drive.columns()[_INPUTS:], strict=True):
            share_column[:] = output[self._rows]
