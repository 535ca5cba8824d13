"""Hold on a trip: a lifted or climbing body holds with low currents before torque goes off.

It holds only after a joint that does not follow, or an operator's stop. All other reasons switch
torque off at once, also during a hold.
"""

from dataclasses import dataclass

import numpy as np

from snakewalk.config.arrays import Floats
from snakewalk.config.robot import RobotConfig
from snakewalk.config.run import SafetyConfig

HOLD_SHARE = 0.2
"""Share of the stall current that holds a joint (ours): a fifth of the stall torque, and 4 % of the
heat of a stalled motor."""
INTERRUPTED = "operator: interrupted (Ctrl-C)"


@dataclass(frozen=True, slots=True)
class TripHold:
    """Duration and strength of a hold after a trip that allows it."""

    seconds: float
    current_a: Floats
    """(J,) greatest current of each joint."""

    @staticmethod
    def from_config(robot: RobotConfig, safety: SafetyConfig) -> "TripHold | None":
        """The hold of a run; None if trips switch torque off at once."""
        if safety.on_trip == "off":
            return None
        if safety.hold_current_a is not None:
            return TripHold(safety.hold_s, np.full(robot.joint_count, safety.hold_current_a))
        stall_a = [facts.stall_current_a or 0.0 for facts in robot.servo_records]
        return TripHold(safety.hold_s, HOLD_SHARE * np.array(stall_a))
