"""The overhead camera in hard views: rendered frames, 16 poses each, with truth.

``python -m benchmarks hard_views``; ``SEED=n`` takes other poses and disturbances. A used pose is
wrong if its head is more than 10 mm off.
"""

import os
from dataclasses import dataclass

import cv2
import numpy as np

from benchmarks.disturbed_views import CAMERA, POSES, Scene, belief, scenes
from benchmarks.rows import Row
from snakewalk.config.arrays import Floats, Image
from snakewalk.config.loader import load_robot
from snakewalk.controller.cameras.overhead_camera import CameraModel, OverheadDetector
from snakewalk.controller.kinematics.links import pose_at
from tests.oracles.view_effects import Effect, View, bands, cloth, hand, jpeg, sensed, shadow

TITLE = "Overhead camera, hard views: 16 poses each, wrong is over 10 mm and used"

WRONG_M = 0.01


EFFECTS: dict[str, Effect] = {
    "as it is": lambda view, chance: view.frame,
    "hard shadow of the body, 40 % of the light left": shadow(0.4),
    "hard shadow of the body, 25 % of the light left": shadow(0.25),
    "hard shadow of the body, 15 % of the light left": shadow(0.15),
    "cloth over 15 to 20 % of the body": cloth,
    "hand over 15 to 20 % of the body": hand,
    "rolling bands, smooth, 40 %": bands(0.4, hard=False),
    "rolling bands, steep, 40 %": bands(0.4, hard=True),
    "rolling bands, steep, 60 %": bands(0.6, hard=True),
    "JPEG of quality 30": jpeg(30),
    "JPEG of quality 20": jpeg(20),
    "JPEG of quality 10": jpeg(10),
}


@dataclass(frozen=True, slots=True)
class Found:
    """Used poses of a condition."""

    off_m: Floats
    """(N,) distance of the head from the truth."""
    within: Floats
    """(N, 3) 1 where x, y and heading are within two standard deviations of the truth."""
    faults: tuple[str, ...]
    """Reasons of the poses that were rejected."""

    @property
    def wrong(self) -> int:
        """Used poses that are more than 10 mm off."""
        return int((self.off_m > WRONG_M).sum())


def run() -> list[Row]:
    """Measure."""
    threads = cv2.getNumThreads()
    cv2.setNumThreads(1)
    seed = int(os.environ.get("SEED", "1000"))
    try:
        drawn, floor = scenes(seed, CAMERA)
        rows, within = [], []
        for name, effect in EFFECTS.items():
            found = measure(drawn, floor, effect, seed)
            rows += _rows(name, found)
            within.append(found.within)
        share = 100.0 * float(np.concatenate(within).mean())
        rows.append(Row("coordinates within two standard deviations", share, "%", "95 %"))
        return rows
    finally:
        cv2.setNumThreads(threads)


def measure(drawn: list[Scene], floor: Image, effect: Effect, seed: int) -> Found:
    """Track each pose from an expected pose that is up to 40 mm off each way, and 0.1 rad."""
    robot = load_robot("yaw16")
    model = CameraModel.of_floor(CAMERA, (0.0, 0.0), None, floor)
    detector = OverheadDetector(model, floor, robot.body_radius_m, CAMERA.shade)
    off_m, within, faults = [], [], []
    for k, scene in enumerate(drawn):
        chance = np.random.default_rng((seed, k, 7))
        pose = pose_at(scene.head_m, scene.heading_rad)
        view = View.of(robot, model, pose, scene.joint_rad, scene.picture)
        image = sensed(effect(view, chance))
        found = detector.registered(image).track(image, 0.0, belief(scene, robot, chance), robot)
        if found.fault:
            faults.append(found.fault)
        else:
            turn = found.heading_rad - scene.heading_rad
            turn = float(np.arctan2(np.sin(turn), np.cos(turn)))
            error = np.append(found.head_m - scene.head_m, turn)
            off_m.append(float(np.hypot(*error[:2])))
            within.append(np.abs(error) < 2.0 * np.sqrt(np.diag(found.covariance)))
    within_all = np.array(within, dtype=float).reshape(-1, 3)
    return Found(np.array(off_m), within_all, tuple(faults))


def _rows(name: str, found: Found) -> list[Row]:
    used, worst = len(found.off_m), float(found.off_m.max(initial=0.0))
    return [
        Row(f"{name}: used, of {POSES}", used, "poses", "15", 15 / max(used, 1), 1.0),
        Row(f"{name}: used and wrong", found.wrong, "poses", "none", float(found.wrong), 0.0),
        Row(f"{name}: head, worst", 1e3 * worst, "mm", "10 mm", worst / WRONG_M, 1.0),
    ]
