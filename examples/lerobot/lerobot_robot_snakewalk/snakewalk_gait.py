"""The teleoperator: a gait generates the joint goals in wall time."""

import time
from typing import Any

import numpy as np
from lerobot.teleoperators import Teleoperator
from lerobot.utils.decorators import check_if_already_connected, check_if_not_connected

import snakewalk as sw
from lerobot_robot_snakewalk.config_snakewalk_gait import SnakewalkGaitConfig

_LONGEST_STEP_S = 0.1
"""The gait pauses while LeRobot pauses, for example while it encodes a video (ours)."""


class SnakewalkGait(Teleoperator):
    """Joint goals of a gait, ``<joint>.pos`` in rad."""

    config_class = SnakewalkGaitConfig
    name = "snakewalk_gait"

    def __init__(self, config: SnakewalkGaitConfig) -> None:
        super().__init__(config)
        self.config = config
        self.robot = sw.load_robot(config.robot)
        self._gait = sw.make_gait(config.gait, config.params)
        self._motion: sw.GaitMotion | None = None
        self._last_s = 0.0
        self._head = sw.BodyPose(0.0, np.zeros(3), np.eye(3))
        sw.GaitMotion(self._gait, self.robot)  # rejects a gait that the joints cannot do

    @property
    def action_features(self) -> dict[str, type]:
        return {f"{name}.pos": float for name in self.robot.joint_names}

    @property
    def feedback_features(self) -> dict[str, type]:
        return {}

    @property
    def is_connected(self) -> bool:
        return self._motion is not None

    @property
    def is_calibrated(self) -> bool:
        return True

    def calibrate(self) -> None:
        """Do nothing; a gait needs no calibration."""

    def configure(self) -> None:
        """Do nothing; the configuration contains all parameters."""

    @check_if_already_connected
    def connect(self, calibrate: bool = True) -> None:
        self._motion = sw.GaitMotion(self._gait, self.robot)
        self._last_s = time.monotonic()

    @check_if_not_connected
    def get_action(self) -> dict[str, float]:
        now_s = time.monotonic()
        dt_s = min(now_s - self._last_s, _LONGEST_STEP_S)
        self._last_s = now_s
        motion = self._motion
        view = sw.body_in_world(self.robot, self._head, motion.goal_rad())
        goal_rad = motion.step(dt_s, view)
        return dict(zip(self.action_features, np.asarray(goal_rad).tolist(), strict=True))

    def send_feedback(self, feedback: dict[str, Any]) -> None:
        """Do nothing; a gait has no actuators."""

    @check_if_not_connected
    def disconnect(self) -> None:
        self._motion = None
