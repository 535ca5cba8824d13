"""Friction of a servo's gears, which data sheets leave out: Coulomb, Stribeck, viscous, by load.

The greatest friction torque is ``dry + stribeck exp(-(w / stribeck_speed)^2) + by_motor |t_motor| +
by_load |t_load|``: teeth press harder the more they carry, whoever drives (Duclusaud et al.,
"Extended Friction Models for the Physics Simulation of Servo Actuators", ICRA 2025). It never
reverses a shaft; a shaft that it can hold rests.
"""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from snakewalk.config.arrays import Floats


@dataclass(frozen=True, slots=True)
class Gearbox:
    """Constants at the output shaft."""

    armature_kg_m2: float
    """The rotor, seen through the gears."""
    dry_n_m: float
    viscous_n_m_s: float
    stribeck_n_m: float
    stribeck_rad_s: float
    by_motor: float
    """Share of the motor's torque that friction takes."""
    by_load: float
    """Share of the load's torque that friction takes."""

    def friction_n_m(self, speed_rad_s: Floats, motor_n_m: Floats, load_n_m: Floats) -> Floats:
        """Greatest friction torque (J,) but for the viscous part, which grows with the speed."""
        slow = np.exp(-((speed_rad_s / self.stribeck_rad_s) ** 2))
        carried = self.by_motor * np.abs(motor_n_m) + self.by_load * np.abs(load_n_m)
        return np.asarray(self.dry_n_m + self.stribeck_n_m * slow + carried)


GEARBOXES: Mapping[str, Gearbox] = {
    # Fitted to recordings of a real one with a pendulum (Rhoban, bam; five logs, three P gains),
    # torque and back-EMF constants as in the data sheet; docs/bus.md has the terms one by one.
    "XL330-M288": Gearbox(1.6e-3, 0.0079, 0.0024, 0.0479, 0.35, 0.25, 0.29),
}
"""Models whose friction somebody has measured."""
