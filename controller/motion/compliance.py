"""Shape compliance: joint goals that yield to the load on the joints, from measured current.

An admittance between motion source and safety layer, after M. Travers, J. Whitman, H. Choset,
Shape-based coordination in locomotion control, IJRR 2018: shape parameters beta follow ``B beta' +
K beta = J^T tau``. Here beta is the joint angles, or one factor on the bends of each window of the
body. Ours: no inertia (a current is read 50 times a second), torques in amperes, windows fixed to
the body.
"""

import numpy as np

from snakewalk.config.arrays import Bools, Floats
from snakewalk.config.compliance import ComplianceConfig
from snakewalk.config.robot import RobotConfig
from snakewalk.drivers.types import JointState

_STRAIGHT_WINDOW_RAD = 0.1
"""Windows whose bends are smaller, root of the sum of squares, hardly scale (ours)."""


class Compliance:
    """State of the admittance of one robot; one step per cycle, after the motion source."""

    def __init__(self, config: ComplianceConfig, robot: RobotConfig) -> None:
        self._config = config
        self._limit_rad = np.array(robot.limit_rad)
        self._yields = _chosen(config, robot)
        joints = robot.joint_count
        windows = config.windows
        self._yield_rad = np.zeros(joints)
        self._scale = np.zeros(windows or 0)
        self._window = np.arange(joints) * (windows or 0) // joints

    @property
    def yield_rad(self) -> Floats:
        """(J,) difference of the goals from those of the motion."""
        return self._yield_rad

    def step(self, goal_rad: Floats, state: JointState, dt_s: float) -> Floats:
        """Return goals (J,) that have yielded for ``dt_s`` to the currents in ``state``.

        A joint without a reading in this cycle keeps its yield. Goals inside the joints' range stay
        inside.
        """
        config = self._config
        excess_a = _current_beyond(state.current_a, config.deadband_a)
        load_a = np.where(self._yields, -excess_a, 0.0)
        if len(self._scale):
            wanted_rad = self._scaled_yield(goal_rad, load_a, state.valid, dt_s)
        else:
            share = self._remaining_share(dt_s)
            rest_rad = load_a / config.stiffness_a_rad
            wanted_rad = share * self._yield_rad + (1.0 - share) * rest_rad
        wanted_rad = np.clip(wanted_rad, -config.yield_limit_rad, config.yield_limit_rad)
        # prevents wind-up beyond a joint limit
        wanted_rad = np.clip(
            wanted_rad,
            np.minimum(-self._limit_rad - goal_rad, 0.0),
            np.maximum(self._limit_rad - goal_rad, 0.0),
        )
        reach_rad = config.yield_rate_rad_s * dt_s
        change_rad = np.clip(wanted_rad - self._yield_rad, -reach_rad, reach_rad)
        self._yield_rad = self._yield_rad + np.where(state.valid, change_rad, 0.0)
        return goal_rad + self._yield_rad

    def _remaining_share(self, dt_s: float) -> float:
        """Share of a yield that remains after ``dt_s`` without load."""
        return float(np.exp(-dt_s * self._config.stiffness_a_rad / self._config.damping_a_s_rad))

    def _scaled_yield(self, goal_rad: Floats, load_a: Floats, valid: Bools, dt_s: float) -> Floats:
        """(J,) yield of scaled windows: the joint admittance, projected on the bends in each.

        With ``x = P beta`` the law ``b x' + k x = load`` becomes ``P^T P (b beta' + k beta) = P^T
        load``. Windows share no joint, so ``P^T P`` is diagonal: a sum of squares each.
        """
        bends_rad = np.where(self._yields & valid, goal_rad, 0.0)
        windows = len(self._scale)
        push = np.bincount(self._window, bends_rad * load_a, windows)
        square = np.bincount(self._window, bends_rad * bends_rad, windows) + _STRAIGHT_WINDOW_RAD**2
        share = self._remaining_share(dt_s)
        rest = push / (square * self._config.stiffness_a_rad)
        self._scale = np.clip(share * self._scale + (1.0 - share) * rest, -1.0, 1.0)
        return np.where(self._yields, goal_rad * self._scale[self._window], 0.0)


def chatters(config: ComplianceConfig, current_gain_a_rad: float, period_s: float) -> str | None:
    """Return why an admittance would chatter against a blocked shaft, or None.

    A blocked shaft draws ``c (goal - shaft)``. The goal then returns by ``(c + k) dt / b`` of its
    distance from rest in a cycle, which must not exceed 1.

    Args:
        config: the admittance.
        current_gain_a_rad: current of a servo per radian between its goal and its shaft.
        period_s: of the control cycle.

    """
    least = (current_gain_a_rad + config.stiffness_a_rad) * period_s
    if config.damping_a_s_rad >= least:
        return None
    return (
        f"compliance.damping_a_s_rad {config.damping_a_s_rad:g}: goals would chatter against a "
        f"blocked joint; at {1.0 / period_s:g} Hz and this gain of the servos it must be at least "
        f"{least:.2g}"
    )


def _chosen(config: ComplianceConfig, robot: RobotConfig) -> Bools:
    """(J,) joints that yield."""
    names = {"yaw": robot.yaw_joints, "pitch": robot.pitch_joints}
    chosen = names.get(config.joints, range(robot.joint_count))
    return np.isin(np.arange(robot.joint_count), list(chosen))


def _current_beyond(current_a: Floats, deadband_a: float) -> Floats:
    return np.sign(current_a) * np.maximum(np.abs(current_a) - deadband_a, 0.0)
