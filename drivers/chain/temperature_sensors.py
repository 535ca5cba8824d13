"""Temperature sensors: whether their readings follow the heat of the motors.

A dead sensor reads 0, never changes, or jumps. The motor then overheats without a warning, so the
run reports it.
"""

import math
from collections.abc import Sequence

import numpy as np

from snakewalk.config.arrays import Floats
from snakewalk.config.robot import RobotConfig

RISE_S_PER_K = 2.0
"""Time at full output and at rest that warms a motor by a kelvin, s (ours). Heat of the stall
current over the heat capacity: 1.7 to 2.2 s for XL330, XM430 and XM540."""
COOLING_S = 300.0
"""Time constant with which a motor cools, s (ours)."""
EXPECTED_RISE_K = 4.0
"""Expected rise from which on a reading must have changed (ours)."""
EXPECTED_ALONE_K = 12.0
"""Expected rise where no joint's reading has changed (ours): a chain that is warm at the start may
stay as it is for a while."""
CHANGED_K = 3.0
"""Change of temperature that shows that a sensor works (ours)."""
JUMP_K = 8.0
JUMP_K_S = 1.0
"""A reading that changes by more than this, and by this for each second, is not a temperature
(ours): twice the heat of the stall current."""
_LONGEST_STEP_S = 5.0
"""A pause between two readings counts as this much, s (ours)."""


class TemperatureSensors:
    """Compares J temperatures with the heat of the currents; reports each joint once."""

    def __init__(self, joint_names: Sequence[str], stall_current_a: Floats) -> None:
        """``stall_current_a`` (J,) is the current at full output and rest; infinite if unknown."""
        self._names = joint_names
        self._stall_a = stall_current_a
        joints = len(joint_names)
        self._first_c = np.full(joints, np.nan)
        self._is_constant = np.ones(joints, np.bool_)
        self._is_reported = np.zeros(joints, np.bool_)
        self.expected_rise_k = np.zeros(joints)
        """(J,) by which the currents so far warm the motors."""
        self._last_c = np.full(joints, np.nan)
        self._time_s = math.inf

    @classmethod
    def of(cls, robot: RobotConfig) -> "TemperatureSensors":
        """Sensors of the servos of ``robot``."""
        stall_a = [facts.stall_current_a or math.inf for facts in robot.servo_records]
        return cls([robot.joint_label(k) for k in range(robot.joint_count)], np.array(stall_a))

    def update(self, temperature_c: Floats, current_a: Floats, time_s: float) -> list[str]:
        """Evaluate a reading of all joints (J,), NaN if unknown; return lines to report."""
        since_s = max(time_s - self._time_s, 0.0)
        step_s = min(since_s, _LONGEST_STEP_S)
        before_c, self._last_c, self._time_s = self._last_c, temperature_c.copy(), time_s
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
        has_jumped = np.abs(temperature_c - before_c) > JUMP_K + JUMP_K_S * since_s
        lines = []
        is_dead = is_zero | is_frozen | has_jumped
        for joint in np.flatnonzero(is_dead & ~self._is_reported).tolist():
            self._is_reported[joint] = True
            if is_zero[joint]:
                what = "temperature reads 0 C"
            elif has_jumped[joint]:
                what = (
                    f"temperature has changed from {before_c[joint]:.0f} to "
                    f"{temperature_c[joint]:.0f} C in {since_s:.1f} s"
                )
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
        others = change_k[~self._is_constant]
        return 0 < len(others) <= 2 * int(np.count_nonzero(others >= CHANGED_K))
