"""Temperature sensors: whether their readings follow the heat of the motors.

A dead sensor reads 0, or never changes.
"""

import math
from collections.abc import Sequence

import numpy as np

from snakewalk.config.arrays import Floats

RISE_S_PER_K = 2.0
"""Time at full output and at rest that warms a motor by a kelvin, s (ours). Heat of the stall
current over the heat capacity: 1.7 to 2.2 s for XL330, XM430 and XM540."""
COOLING_S = 300.0
"""Time constant with which a motor cools, s (ours)."""
EXPECTED_RISE_K = 4.0
"""Expected rise from which on a reading must have changed (ours)."""
EXPECTED_ALONE_K = 12.0
"""The same where no joint's reading has changed (ours): a chain that is warm at the start may stay
as it is for a while."""
CHANGED_K = 3.0
"""Change that shows a sensor that works (ours)."""
_LONGEST_STEP_S = 5.0
"""A pause between two readings counts as this much, s (ours)."""


class TemperatureSensors:
    """Compares J temperatures with the heat of the currents; reports each joint once."""

    def __init__(self, joint_names: Sequence[str], stall_current_a: Floats) -> None:
        """Start without a reading.

        ``stall_current_a`` (J,) is the current at full output and at rest; infinite if unknown.
        """
        self._names, self._stall_a = joint_names, stall_current_a
        joints = len(joint_names)
        self._first_c = np.full(joints, np.nan)
        self._is_constant = np.ones(joints, np.bool_)
        self._is_reported = np.zeros(joints, np.bool_)
        self.expected_rise_k = np.zeros(joints)
        """(J,) by which the currents so far warm the motors."""
        self._time_s = math.inf

    def update(self, temperature_c: Floats, current_a: Floats, time_s: float) -> list[str]:
        """Evaluate a reading of all joints (J,), NaN where unknown; returns lines to report."""
        step_s = min(max(time_s - self._time_s, 0.0), _LONGEST_STEP_S)
        self._time_s = time_s
        heat_k_s = (np.nan_to_num(current_a) / self._stall_a) ** 2 / RISE_S_PER_K
        self.expected_rise_k += step_s * (heat_k_s - self.expected_rise_k / COOLING_S)
        self._first_c = np.where(np.isnan(self._first_c), temperature_c, self._first_c)
        change_k = np.abs(temperature_c - self._first_c)
        self._is_constant &= ~(change_k > 0.0)
        is_zero = temperature_c == 0.0
        is_frozen = self._is_constant & (self.expected_rise_k >= EXPECTED_RISE_K)
        is_frozen &= np.isfinite(self._first_c)
        if is_frozen.any() and not self._others_warm_up(change_k):
            is_frozen &= self._is_constant.all() & (self.expected_rise_k >= EXPECTED_ALONE_K)
        lines = []
        for joint in np.flatnonzero((is_zero | is_frozen) & ~self._is_reported).tolist():
            self._is_reported[joint] = True
            if is_zero[joint]:
                what = "temperature reads 0 C"
            else:
                what = (
                    f"temperature has read {temperature_c[joint]:.0f} C since the start, though "
                    f"its currents warm it by about {self.expected_rise_k[joint]:.0f} C"
                )
            lines.append(
                f"{self._names[joint]}: {what}: its sensor may be dead, and nothing watches its "
                "heat; stop the run and feel the servo"
            )
        return lines

    def _others_warm_up(self, change_k: Floats) -> bool:
        """Whether half of the readings that change show that the chain warms up or cools down."""
        others = change_k[~self._is_constant]
        return 0 < len(others) <= 2 * int(np.count_nonzero(others >= CHANGED_K))
