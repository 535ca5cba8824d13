"""Learning of the floor: an object that stays next to the robot becomes floor after a while.

A running estimate from frames with a well-fitting pose. It excludes the body and its surroundings,
and frames with a lost or badly visible body, so that a wrong pose cannot make the robot a part of
the floor.
"""

from dataclasses import replace

import cv2
import numpy as np

from snakewalk.config.arrays import Image, Singles
from snakewalk.config.robot import RobotConfig
from snakewalk.controller.cameras.body_contrast import links_at
from snakewalk.controller.cameras.floor_light import in_light_of
from snakewalk.controller.cameras.overhead_camera import OverheadDetector
from snakewalk.controller.cameras.pose_tracking import REACH_M, BodyPrior, TrackedPose

LEARN_EVERY_S = 1.0
_LONGEST_STEP_S = 5.0  # longest time that one frame counts for, s
_FITS = 0.15  # of the radius: largest residual of a pose to learn from
_BLEACHED_LEVEL = 249.0  # grey levels: a brighter pixel is saturated


class FloorLearning:
    """Learner; call ``after`` with each tracked frame, in order of time."""

    def __init__(self, robot: RobotConfig, learn_s: float) -> None:
        """Learn with the time constant ``learn_s``; 0: never."""
        self._robot = robot
        self._learn_s = learn_s
        self._floor: Singles | None = None
        self._shown: Image | None = None
        self._last_s: float | None = None

    def after(
        self, detector: OverheadDetector, image: Image, prior: BodyPrior, tracked: TrackedPose
    ) -> OverheadDetector:
        """Return the detector for the next frames.

        Args:
            detector: that of this frame.
            image: (H, W[, 3]) the frame.
            prior: the body's shape, and its expected place.
            tracked: its found place.

        """
        if self._learn_s == 0.0:
            return detector
        good = not tracked.fault and tracked.error_m < _FITS * self._robot.body_radius_m
        if not good:
            self._last_s = None
            return detector
        if self._last_s is None:
            self._last_s = tracked.time_s
        passed_s = tracked.time_s - self._last_s
        if passed_s < LEARN_EVERY_S:
            return detector
        self._last_s = tracked.time_s
        if self._floor is None or detector.background is not self._shown:  # or the camera moved
            self._floor = detector.background.astype(np.float32)
        clear = cv2.inRange(image, (0.0,) * 3, (_BLEACHED_LEVEL,) * 3)
        free = cv2.subtract(clear, _body(detector, prior, tracked, self._robot))
        part = 1.0 - float(np.exp(-min(passed_s, _LONGEST_STEP_S) / self._learn_s))
        cv2.accumulateWeighted(in_light_of(image, detector.background), self._floor, part, free)
        self._shown = shown = np.asarray(cv2.convertScaleAbs(self._floor), dtype=np.uint8)
        pictured = detector.background if detector.pictured is None else detector.pictured
        return replace(detector, background=shown, pictured=pictured)


def _body(
    detector: OverheadDetector, prior: BodyPrior, tracked: TrackedPose, robot: RobotConfig
) -> Image:
    """(H, W) 255 at the body and its surroundings."""
    links_px = detector.model.in_image(links_at(prior, tracked), detector.axis_height_m)
    length_px = float(np.hypot(*np.diff(links_px, axis=0).T).sum())
    metre = length_px / robot.centre_distance_m
    mask = np.zeros(detector.background.shape[:2], dtype=np.uint8)
    spots = np.rint(links_px).astype(np.int32).reshape(-1, 1, 2)
    wide_px = 2.0 * (REACH_M + 2.0 * robot.body_radius_m) * metre
    cv2.polylines(mask, [spots], False, 255, max(1, round(wide_px)))
    return mask
