"""A gait with a turn parameter, and the rate at which the turn may change."""

import numpy as np

from snakewalk.config.robot import RobotConfig
from snakewalk.controller.gaits.gait import CYCLE_SAMPLES, Gait
from snakewalk.controller.gaits.wave import TURN
from snakewalk.controller.motion.source import Pace

TURN_RATE_PER_S = 0.5
"""Rate of change of the turn (ours): within a cycle of 4 s it goes from straight to its limit."""
TURN_PER_S2 = 1.0


def turned(gait: Gait, key: str, turn: float) -> Gait:
    """Return the gait with parameter ``key`` set to a turn, positive to the left."""
    turn = -turn if gait.params.mirror else turn
    return type(gait)(gait.params.model_copy(update={key: turn}))


def rate_beside_turn(gait: Gait, key: str, robot: RobotConfig, pace: Pace) -> float:
    """Return the share of the gait's rate that lets the joints change the turn, too."""
    phases = np.linspace(0.0, TURN, CYCLE_SAMPLES)
    bent = turned(gait, key, 1.0).joints_rad(robot, phases) - gait.joints_rad(robot, phases)
    reach_rad = float(np.abs(bent).max())  # of a joint, for a turn of 1
    room = Pace.limit(robot)
    speed = room.speed_rad_s - reach_rad * TURN_RATE_PER_S
    # a leg's swing is a product with the turn: both rates together count twice
    spent = reach_rad * TURN_PER_S2 + 2.0 * TURN_RATE_PER_S * pace.speed_rad_s
    hard = np.maximum(room.acceleration_rad_s2 - spent, 1e-3)
    share = np.minimum(
        speed / np.maximum(pace.speed_rad_s, 1e-9),
        np.sqrt(hard / np.maximum(pace.acceleration_rad_s2, 1e-9)),
    )
    return float(np.clip(share.min(), 0.05, 1.0))
